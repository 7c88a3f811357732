#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <mutex>

#include "tools/report/topic.hpp"
#include "tools/shared/say.hpp"

namespace punctum::report {
namespace {

using Steady = std::chrono::steady_clock;
constexpr int kBar = 24;
constexpr double kBarEvery_s = 0.1, kLineEvery_s = 15;

}  // namespace

struct Progress::Shared {
  std::mutex mutex;
  std::string topic, what;
  std::int64_t done = 0, steps = 0;
  bool terminal = isatty(STDERR_FILENO) == 1;
  Steady::time_point begun = Steady::now(), told = begun;

  void tell(bool now) {
    const auto t = Steady::now();
    const double since = std::chrono::duration<double>(t - told).count();
    if (!now && since < (terminal ? kBarEvery_s : kLineEvery_s)) {
      return;
    }
    told = t;
    const double part =
        steps > 0 ? std::clamp(static_cast<double>(done) / static_cast<double>(steps), 0.0, 1.0) : 0;
    const auto full = static_cast<std::size_t>(part * kBar);
    const double seconds = std::chrono::duration<double>(t - begun).count();
    if (terminal) {
      tools::say_aside(fmt::format("\r{:<12}[{}{}] {:3.0f} %  {} {:.0f} s\033[K", topic,
                                   std::string(full, '#'), std::string(kBar - full, '.'), part * 100, what,
                                   seconds));
    } else {
      tools::complain(fmt::format("{:<12}{:3.0f} %  {} {:.0f} s", topic, part * 100, what, seconds));
    }
  }
};

Progress::Progress(std::string topic) : shared_(std::make_unique<Shared>()) {
  shared_->topic = std::move(topic);
}

Progress::~Progress() {
  if (shared_->terminal) {
    tools::say_aside("\r\033[K");
  }
}

void Progress::start(const std::string& what, std::int64_t steps) {
  const std::lock_guard lock(shared_->mutex);
  shared_->what = what;
  shared_->done = 0;
  shared_->steps = steps;
  shared_->tell(shared_->terminal);
}

void Progress::step(std::int64_t n) {
  const std::lock_guard lock(shared_->mutex);
  shared_->done += n;
  shared_->tell(false);
}

}  // namespace punctum::report
