// The wire to the devices: lines out, lines in. SerialLine is a terminal of the kernel; a test has one of its
// own, in virtual time.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "hal/devices.hpp"

namespace punctum::zaber {

class Wire {
 public:
  Wire() = default;
  virtual ~Wire() = default;
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  [[nodiscard]] virtual tl::expected<void, std::string> open() = 0;  // the error is one line
  virtual void close() noexcept = 0;
  // ok, or disconnected.
  [[nodiscard]] virtual hal::Status send(std::string_view text) = 0;
  // The next whole line, without its end: ok; no_data: none came within the time; disconnected.
  [[nodiscard]] virtual hal::Status receive(std::string& line, std::int64_t timeout_ns) = 0;
};

// 115200 baud, 8 bits, no parity, one stop bit, no flow control; nobody else opens it meanwhile.
class SerialLine final : public Wire {
 public:
  explicit SerialLine(std::string port) : port_(std::move(port)) {}
  ~SerialLine() override { SerialLine::close(); }

  [[nodiscard]] tl::expected<void, std::string> open() override;
  void close() noexcept override;
  [[nodiscard]] hal::Status send(std::string_view text) override;
  [[nodiscard]] hal::Status receive(std::string& line, std::int64_t timeout_ns) override;

 private:
  [[nodiscard]] bool take_line(std::string& line);

  const std::string port_;
  int file_ = -1;
  std::string come_;  // not yet a whole line
};

}  // namespace punctum::zaber
