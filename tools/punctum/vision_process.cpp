#include "tools/punctum/vision_process.hpp"

#include <fmt/format.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "tools/shared/exit_codes.hpp"

namespace punctum::tools {
namespace {

constexpr std::size_t kMostRestarts = 5;  // within the window
constexpr double kRestartWindow_s = 60;
constexpr double kFirstPause_s = 0.2;  // before the second restart; doubled each time
constexpr std::chrono::seconds kTimeToEnd{5};

}  // namespace

VisionProcess::VisionProcess(std::vector<std::string> args, std::vector<int> descriptors, std::string log,
                             const std::atomic<std::uint64_t>* rounds, bool real_time, Terminal& terminal)
    : args_(std::move(args)),
      descriptors_(std::move(descriptors)),
      log_(std::move(log)),
      terminal_(terminal),
      rounds_(rounds),
      watchdog_(real_time) {}

tl::expected<void, std::string> VisionProcess::start() {
  auto child = Child::start("punctum-vision", args_, log_, descriptors_);
  if (!child) {
    over_ = true;
    return tl::unexpected(child.error());
  }
  child_ = std::move(*child);
  is_watched_ = false;
  return {};
}

void VisionProcess::kill_if_it_hangs(double now_s) {
  if (rounds_ == nullptr || !child_.running() || !killed_because_.empty()) {
    return;
  }
  const std::uint64_t rounds = rounds_->load(std::memory_order_relaxed);
  if (!is_watched_) {
    watchdog_.started(now_s, rounds);
    is_watched_ = true;
  }
  if (watchdog_.hangs(now_s, rounds)) {
    killed_because_ = fmt::format("hung for {:.0f} s and was killed", watchdog_.silent_s());
    child_.send(SIGKILL);
  }
}

void VisionProcess::start_again() {
  start_is_planned_ = false;
  if (auto started = start(); !started) {
    terminal_.complain(started.error());
  } else {
    terminal_.say("vision restarted (process {})", child_.pid());
  }
}

VisionProcess::News VisionProcess::watch(double now_s, double run_s) {
  if (over_) {
    return News::none;
  }
  if (start_is_planned_ && now_s >= next_start_s_) {
    start_again();
  }
  kill_if_it_hangs(now_s);
  Ended how;
  if (!child_.ended(how)) {
    return News::none;
  }
  if (how.exited && how.code == exit_done) {
    over_ = true;
    return News::frames_ended;
  }
  const std::string why = !killed_because_.empty() ? std::exchange(killed_because_, {})
                                                   : how.text() + (how.exited ? ": " + last_line(log_) : "");
  if (how.exited && how.code == exit_bad_input) {
    terminal_.complain("vision " + why);
    over_ = true;
    return News::refused;
  }
  restarts_.push_back({run_s, why});
  recent_s_.push_back(now_s);
  std::erase_if(recent_s_, [now_s](double at_s) { return at_s < now_s - kRestartWindow_s; });
  if (recent_s_.size() > kMostRestarts) {
    terminal_.complain(fmt::format("vision {}; {} restarts within {:.0f} s are enough, going on without it",
                                   why, kMostRestarts, kRestartWindow_s));
    over_ = true;
    return News::given_up;
  }
  // Virtual time waits meanwhile: the dead process still counts as an attached camera.
  const auto before = static_cast<double>(recent_s_.size()) - 1;
  next_start_s_ = now_s + (before > 0 ? kFirstPause_s * std::pow(2.0, before - 1) : 0);
  start_is_planned_ = true;
  terminal_.complain(
      fmt::format("vision {} at {:.3f} s; the core goes on without it, restarting", why, run_s));
  return News::none;
}

void VisionProcess::end(bool at_once) {
  if (!child_.running()) {
    return;
  }
  const auto begun = std::chrono::steady_clock::now();
  bool asked = false;
  Ended how;
  while (!child_.ended(how)) {
    const auto waited = std::chrono::steady_clock::now() - begun;
    if (!asked && (at_once || waited > kTimeToEnd)) {
      child_.send(SIGTERM);
      asked = true;
    }
    if (waited > 2 * kTimeToEnd) {
      terminal_.complain("vision does not end: killed");
      child_ = Child();
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (!asked && (!how.exited || how.code != exit_done)) {
    terminal_.complain(fmt::format("vision {}{}", how.text(), how.exited ? ": " + last_line(log_) : ""));
  }
}

}  // namespace punctum::tools
