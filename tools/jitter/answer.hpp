// From an input of the machine to its output, through the loop: something outside changes, the next tick sees
// it and answers, and the time between the two is taken outside.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "hal/gpiod/lines.hpp"
#include "tools/jitter/measurement.hpp"
#include "tools/jitter/result.hpp"

namespace punctum::jitter {

// The other end of the wires. Used by one thread, beside the loop; times are of CLOCK_MONOTONIC.
class Outside {
 public:
  Outside() = default;
  virtual ~Outside() = default;
  Outside(const Outside&) = delete;
  Outside& operator=(const Outside&) = delete;

  // The input is to be this from now on.
  virtual void ask(bool high) = 0;
  // When the output became this; none: it is not yet. Called again and again, wait_ns apart.
  [[nodiscard]] virtual std::optional<std::int64_t> answered_ns(bool high) = 0;
  [[nodiscard]] virtual std::int64_t wait_ns() const { return 0; }
  // What is measured, in words.
  [[nodiscard]] virtual std::string what() const = 0;
};

// `work` answers. It is asked at random moments of the tick, until the measurement is over.
[[nodiscard]] tl::expected<Result, std::string> measure_answers(const Wanted& wanted, Work work,
                                                                Outside& outside);

// Two lines of a GPIO chip as the loop uses them: each tick writes what it reads.
class GpioEcho {
 public:
  [[nodiscard]] static tl::expected<std::unique_ptr<GpioEcho>, std::string> claim(gpiod::Chip& chip, int in,
                                                                                  int out);
  [[nodiscard]] Work work() { return {.slots = {rt::slot<&GpioEcho::tick>("gpio", *this)}}; }
  rt::After tick(const rt::Tick& tick) NONBLOCKING;

 private:
  std::unique_ptr<gpiod::Line> in_, out_;
  bool level_ = false;
};

// "CHIP:IN,OUT,ASK,SEEN": line ASK is wired to IN, and OUT to SEEN. The error says what is wrong with it.
[[nodiscard]] tl::expected<Result, std::string> measure_gpio_answers(const Wanted& wanted,
                                                                     const std::string& lines);

}  // namespace punctum::jitter
