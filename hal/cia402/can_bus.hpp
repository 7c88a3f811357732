// A CAN bus as the tick sees it: frames out, frames in, nothing waits.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "hal/realtime.hpp"

namespace punctum::cia402 {

// A classic data frame with an 11-bit identifier; CANopen knows no other.
struct CanFrame {
  std::uint16_t id = 0;
  std::uint8_t size = 0;  // bytes of data, at most 8
  std::array<std::uint8_t, 8> data{};
};

enum class Sent : std::uint8_t {
  ok,
  full,  // the queue takes no more now: the frame is not sent
  down,  // the interface is gone
};

enum class Received : std::uint8_t {
  frame,
  nothing,
  error,    // the controller tells of errors on the wire, or of frames that it lost
  bus_off,  // the controller has left the bus
  down,     // the interface is gone
};

class CanBus {
 public:
  virtual ~CanBus() = default;

  // Set-up: may block and allocate. Only frames with one of `ids` are received. The error is one line.
  [[nodiscard]] virtual tl::expected<void, std::string> open(std::span<const std::uint16_t> ids) = 0;
  virtual void close() noexcept = 0;

  [[nodiscard]] virtual Sent send(const CanFrame& frame) NONBLOCKING = 0;
  // `out` is written only with Received::frame.
  [[nodiscard]] virtual Received receive(CanFrame& out) NONBLOCKING = 0;
};

}  // namespace punctum::cia402
