// The USB side of a Falcon: control requests, one packet out at a time, packets in. One thread at a time uses
// a link; only wake() may come from another.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "hal/falcon/frame.hpp"
#include "hal/realtime.hpp"

namespace punctum::falcon {

struct Packet {
  std::array<std::uint8_t, kPacketSize> bytes{};
  std::size_t size = 0;
  std::int64_t received_ns = 0;  // on the station's clock
};

enum class Event : std::uint8_t {
  packet,     // `out` holds one
  oversized,  // one that did not fit came, and was dropped
  nothing,    // the packet is out, somebody called wake(), or the time is over
  gone,       // unplugged, or nothing but errors: from here on always
};

class UsbLink {
 public:
  virtual ~UsbLink() = default;

  // Set-up: may block and allocate. From here on a packet in is always asked for. The error is one line.
  [[nodiscard]] virtual tl::expected<void, std::string> open() = 0;
  virtual void close() noexcept = 0;
  // A request to the FTDI chip; set-up, waits for its end.
  [[nodiscard]] virtual bool control(std::uint8_t request, std::uint16_t value) = 0;

  // At most kPacketSize bytes. False: the packet before is still on its way, it could not be queued, or
  // the device is gone.
  [[nodiscard]] virtual bool send(std::span<const std::uint8_t> bytes) = 0;
  [[nodiscard]] virtual bool sending() const = 0;
  // The packet that was sent last has ended, and the device has taken all of it.
  [[nodiscard]] virtual bool sent() const = 0;
  [[nodiscard]] virtual Event wait(std::int64_t longest_ns, Packet& out) = 0;
  // Ends a wait(), or the next one.
  virtual void wake() NONBLOCKING = 0;
};

}  // namespace punctum::falcon
