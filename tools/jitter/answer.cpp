#include "tools/jitter/answer.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <random>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "rt/executive/monotonic_clock.hpp"
#include "tools/jitter/ordinary_thread.hpp"

namespace punctum::jitter {
namespace {

constexpr std::int64_t kGiveUp_ns = 50'000'000;
constexpr std::size_t kMostAnswerBins = 10'000;  // of 1 us

// Asks, and waits for the answer; then it leaves the loop alone for a few ticks and a random part of one.
class Asker {
 public:
  Asker(Outside& outside, const Wanted& wanted)
      : outside_(outside),
        period_ns_(1e9 / wanted.rate_Hz),
        asks_for_ns_(std::llround(wanted.seconds * 1e9) - kGiveUp_ns) {}

  void start(std::int64_t first_release_ns) {
    thread_ = ordinary_thread([this, first_release_ns](const std::stop_token& over) {
      clock_.sleep_until_ns(first_release_ns);
      ask(over, first_release_ns + asks_for_ns_);
    });
    // Below every loop; above the threads that only look, where there is a single processor.
    const sched_param lowest{.sched_priority = 1};
    (void)pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &lowest);
  }
  void end(Result& into) {
    thread_.request_stop();
    if (thread_.joinable()) {
      thread_.join();
    }
    into.answered = outside_.what();
    into.answer = std::move(answer_);
    into.answer_min_us = std::isfinite(min_us_) ? min_us_ : 0;
    into.unanswered = unanswered_;
  }

 private:
  void ask(const std::stop_token& over, std::int64_t until_ns) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> ticks(3, 5);
    bool high = false;
    while (!over.stop_requested()) {
      clock_.sleep_until_ns(clock_.now_ns() + std::llround(ticks(random) * period_ns_));
      if (clock_.now_ns() >= until_ns) {
        return;  // after the last tick nobody answers
      }
      high = !high;
      // After an answer that did not come the output may be there already: then nothing tells when it
      // answers.
      const bool there = outside_.answered_ns(high).has_value();
      const std::int64_t asked_ns = clock_.now_ns();
      outside_.ask(high);
      if (there) {
        continue;
      }
      std::optional<std::int64_t> answered_ns;
      while (!(answered_ns = outside_.answered_ns(high)) && !over.stop_requested() &&
             clock_.now_ns() - asked_ns < kGiveUp_ns) {
        if (outside_.wait_ns() > 0) {
          clock_.sleep_until_ns(clock_.now_ns() + outside_.wait_ns());
        }
      }
      if (answered_ns) {
        add(1e-3 * static_cast<double>(*answered_ns - asked_ns));
      } else if (!over.stop_requested()) {  // the loop may have ended early
        ++unanswered_;
      }
    }
  }
  void add(double us) {
    const auto bin = static_cast<std::size_t>(std::max(us, 0.0));
    if (bin < kMostAnswerBins) {
      answer_.count.resize(std::max(answer_.count.size(), bin + 1), 0);
      ++answer_.count[bin];
    } else {
      ++answer_.longer;
    }
    answer_.max_us = std::max(answer_.max_us, us);
    min_us_ = std::min(min_us_, us);
  }

  Outside& outside_;
  const double period_ns_;
  const std::int64_t asks_for_ns_;
  rt::MonotonicClock clock_;
  Distribution answer_;
  double min_us_ = INFINITY;
  std::uint64_t unanswered_ = 0;
  std::jthread thread_;
};

// The other ends of two wires, on two more lines of the same chip.
class WiredLines final : public Outside {
 public:
  WiredLines(std::unique_ptr<gpiod::Line> ask, std::unique_ptr<gpiod::Line> seen)
      : ask_(std::move(ask)), seen_(std::move(seen)) {}
  void ask(bool high) override { (void)ask_->write(high); }
  std::optional<std::int64_t> answered_ns(bool high) override {
    bool level = !high;
    const bool told = seen_->read(level) == hal::Status::ok;
    return told && level == high ? std::optional(clock_.now_ns()) : std::nullopt;
  }
  [[nodiscard]] std::string what() const override {
    return "edge in to edge out on two pairs of wired GPIO lines, asked and seen by a thread of this machine";
  }

 private:
  rt::MonotonicClock clock_;
  std::unique_ptr<gpiod::Line> ask_, seen_;
};

tl::expected<std::unique_ptr<gpiod::Line>, std::string> claim_line(gpiod::Chip& chip, int offset,
                                                                   gpiod::Use use) {
  auto line = chip.claim({.offset = static_cast<unsigned>(offset), .use = use});
  return line ? std::move(line) : tl::unexpected(fmt::format("--gpio: line {}: {}", offset, line.error()));
}

}  // namespace

tl::expected<Result, std::string> measure_answers(const Wanted& wanted, Work work, Outside& outside) {
  Asker asker(outside, wanted);
  work.start = [&asker, start = std::move(work.start)](std::int64_t first_release_ns,
                                                       bool degraded) -> tl::expected<void, std::string> {
    if (start) {
      if (auto started = start(first_release_ns, degraded); !started) {
        return started;
      }
    }
    asker.start(first_release_ns);
    return {};
  };
  auto result = measure(wanted, work);
  Result ignored;
  asker.end(result ? *result : ignored);
  return result;
}

tl::expected<std::unique_ptr<GpioEcho>, std::string> GpioEcho::claim(gpiod::Chip& chip, int in, int out) {
  auto echo = std::make_unique<GpioEcho>();
  for (const auto& [offset, use, into] :
       {std::tuple(in, gpiod::Use::input, &echo->in_), std::tuple(out, gpiod::Use::output, &echo->out_)}) {
    auto line = claim_line(chip, offset, use);
    if (!line) {
      return tl::unexpected(line.error());
    }
    *into = std::move(*line);
  }
  return echo;
}

rt::After GpioEcho::tick(const rt::Tick& /*tick*/) NONBLOCKING {
  bool level = level_;
  if (in_->read(level) == hal::Status::ok && level != level_ && out_->write(level) == hal::Status::ok) {
    level_ = level;
  }
  return rt::After::go_on;
}

tl::expected<Result, std::string> measure_gpio_answers(const Wanted& wanted, const std::string& lines) {
  const std::size_t colon = lines.rfind(':');
  std::array<int, 4> offset{};
  const char* at = lines.data() + (colon == std::string::npos ? lines.size() : colon + 1);
  const char* const end = lines.data() + lines.size();
  bool good = colon != std::string::npos && colon > 0;
  for (std::size_t i = 0; good && i < offset.size(); ++i) {
    const auto [after, error] = std::from_chars(at, end, offset[i]);
    const bool last = i + 1 == offset.size();
    good = error == std::errc{} && offset[i] >= 0 && (last ? after == end : after < end && *after == ',') &&
           std::find(offset.begin(), offset.begin() + static_cast<std::ptrdiff_t>(i), offset[i]) ==
               offset.begin() + static_cast<std::ptrdiff_t>(i);
    at = after + (last ? 0 : 1);
  }
  if (!good) {
    return tl::unexpected(fmt::format(
        "--gpio: {}: allowed: CHIP:IN,OUT,ASK,SEEN, four different lines of a chip such as /dev/gpiochip0, "
        "with ASK wired to IN and OUT to SEEN",
        lines));
  }
  auto chip = gpiod::open_chip(lines.substr(0, colon));
  if (!chip) {
    return tl::unexpected("--gpio: " + chip.error());
  }
  auto echo = GpioEcho::claim(**chip, offset[0], offset[1]);
  if (!echo) {
    return tl::unexpected(echo.error());
  }
  auto ask = claim_line(**chip, offset[2], gpiod::Use::output);
  auto seen = claim_line(**chip, offset[3], gpiod::Use::input);
  if (!ask || !seen) {
    return tl::unexpected(!ask ? ask.error() : seen.error());
  }
  WiredLines outside(std::move(*ask), std::move(*seen));
  return measure_answers(wanted, (*echo)->work(), outside);
}

}  // namespace punctum::jitter
