// The lines of a GPIO chip, whichever version of libgpiod stands behind them. lines_v1.cpp and lines_v2.cpp
// are for libgpiod 1 (Debian 12) and 2 (Debian 13), lines_none.cpp for a build without.
#pragma once

#include <cerrno>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"

namespace punctum::gpiod {

enum class Use : std::uint8_t {
  input,
  watched_input,  // the kernel keeps its changes until they are taken
  output,         // inactive from the first moment on
  held_output,    // active from the first moment on
};
[[nodiscard]] constexpr bool is_output(Use use) { return use == Use::output || use == Use::held_output; }
enum class Bias : std::uint8_t { as_it_is, pull_up, pull_down };

struct LineRequest {
  unsigned offset = 0;
  Use use = Use::input;
  bool active_low = false;
  Bias bias = Bias::as_it_is;
};

// A line that is claimed for as long as this lives. The methods do not block.
class Line {
 public:
  Line() = default;
  virtual ~Line() = default;
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  // Of an output: as it is driven.
  [[nodiscard]] virtual hal::Status read(bool& active) NONBLOCKING = 0;
  [[nodiscard]] virtual hal::Status write(bool active) NONBLOCKING = 0;
  // How many changes of a watched input the kernel has kept since they were taken last; beyond some 16 it
  // keeps no more. Which way a change went is not said: the kernel reads the level late.
  [[nodiscard]] virtual hal::Status take_changes(int& changes) NONBLOCKING = 0;
};

// What the chip says of a line, whoever uses it.
struct LineFacts {
  std::string name;  // empty: it has none
  bool used = false;
  std::string user;
};

class Chip {
 public:
  Chip() = default;
  virtual ~Chip() = default;
  Chip(const Chip&) = delete;
  Chip& operator=(const Chip&) = delete;

  [[nodiscard]] virtual unsigned line_count() const = 0;
  [[nodiscard]] virtual std::string label() const = 0;
  [[nodiscard]] virtual LineFacts facts(unsigned offset) const = 0;
  // The error says why not, in a few words.
  [[nodiscard]] virtual tl::expected<std::unique_ptr<Line>, std::string> claim(
      const LineRequest& request) = 0;
};

// A chip by the path of its device. The error says why not, in a few words.
[[nodiscard]] tl::expected<std::unique_ptr<Chip>, std::string> open_chip(const std::string& path);
using OpenChip = std::function<tl::expected<std::unique_ptr<Chip>, std::string>(const std::string& path)>;

// What the kernel's answer says of the device.
[[nodiscard]] inline hal::Status status_of(int error) NONBLOCKING {
  return error == ENODEV ? hal::Status::disconnected : hal::Status::fault;
}

}  // namespace punctum::gpiod
