// The device's end of USB/IP (Documentation/usb/usbip_protocol.rst of the kernel), for one Falcon: bytes from
// the host's kernel in, bytes for it out.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "tools/emulators/falcon/falcon.hpp"

namespace punctum::emulator {

class UsbIpDevice {
 public:
  explicit UsbIpDevice(FalconEmulator& falcon) : falcon_(falcon) {}

  // False: what came is not USB/IP; the connection is to be closed.
  [[nodiscard]] bool take(std::span<const std::uint8_t> bytes, std::int64_t now_ns);
  // What is due is appended to output().
  void step(std::int64_t now_ns);
  // When step() may have something to say; at most a second from now.
  [[nodiscard]] std::int64_t next_ns(std::int64_t now_ns) const;
  [[nodiscard]] std::vector<std::uint8_t>& output() { return output_; }
  [[nodiscard]] std::size_t waiting() const { return in_.size() + out_.size(); }
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  static constexpr std::size_t kHeader = 48;
  struct Header {
    std::uint32_t command, sequence, direction, endpoint, flags, length, start_frame, packets;
    std::array<std::uint8_t, 8> setup;
  };
  struct In {  // asked for, not answered
    std::uint32_t sequence;
    std::size_t length;
    std::vector<std::uint8_t> data;
  };
  struct Out {  // the Falcon has no room for it yet
    std::uint32_t sequence;
    std::vector<std::uint8_t> data;
  };

  [[nodiscard]] static Header header_of(std::span<const std::uint8_t> bytes);
  [[nodiscard]] bool acceptable(const Header& h);
  void submit(const Header& h, std::span<const std::uint8_t> data, std::int64_t now_ns);
  void control(const Header& h, std::int64_t now_ns);
  void unlink(const Header& h);
  void answer(std::uint32_t sequence, int status, std::size_t length, std::span<const std::uint8_t> data);
  void put(std::uint32_t value);

  FalconEmulator& falcon_;
  std::vector<std::uint8_t> input_, output_;
  std::deque<In> in_;
  std::deque<Out> out_;
  std::string problem_;
  std::uint8_t configuration_ = 0;
};

}  // namespace punctum::emulator
