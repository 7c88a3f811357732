#include "tools/punctum/core_process.hpp"

#include <fmt/format.h>
#include <signal.h>

namespace punctum::tools {
namespace {

constexpr double kTimeToAnswer_s = 5;
constexpr double kHung_s = 2;          // without a tick
constexpr double kHungVirtual_s = 30;  // it may wait for camera and recorder
// Without a step of its set-up or its shut-down: they read a scene, lock memory, open devices and let the
// drive brake, a second or two of work on an idle machine.
constexpr double kHungOutsideLoop_s = 10;

}  // namespace

CoreProcess::CoreProcess(const rt::CoreSegment& segment, rt::CommandQueue& commands, bool real_time,
                         Terminal& terminal)
    : status_(segment.status),
      commands_(commands),
      terminal_(terminal),
      longest_without_tick_s_(real_time ? kHung_s : kHungVirtual_s),
      longest_outside_loop_s_(real_time ? kHungOutsideLoop_s : kHungVirtual_s) {}

tl::expected<void, std::string> CoreProcess::start(const std::vector<std::string>& args,
                                                   const std::string& log,
                                                   const std::vector<int>& descriptors) {
  auto child = Child::start("punctum-core", args, log, descriptors);
  if (!child) {
    return tl::unexpected(child.error());
  }
  child_ = std::move(*child);
  return {};
}

void CoreProcess::ask(rt::Command::Kind what) {
  rt::Command command;
  command.kind = what;
  (void)commands_.try_push(command);  // full: the core hangs, and is watched for that
}

void CoreProcess::watch(double now_s, int stop_signals) {
  watch_stop(now_s, stop_signals);
  watch_progress(now_s);
}

void CoreProcess::watch_stop(double now_s, int stop_signals) {
  const auto step = [this, now_s](Step next) {
    step_ = next;
    stepped_s_ = now_s;
  };
  if (step_ == Step::none && stop_signals > 0) {
    step(Step::commanded);
    ask(rt::Command::stop);
    terminal_.say("stopping: needle held, force to zero (again Ctrl-C to insist)");
  }
  if (step_ == Step::commanded && (stop_signals > 1 || now_s > stepped_s_ + kTimeToAnswer_s)) {
    step(Step::signalled);
    child_.send(SIGTERM);
  }
  if (step_ == Step::signalled && (stop_signals > 2 || now_s > stepped_s_ + kTimeToAnswer_s)) {
    step(Step::killed);
    terminal_.complain("the core does not end: killed");
    child_.send(SIGKILL);
  }
}

// A core that hangs will not come back by itself; its heartbeat has stopped and the relay has acted. It is
// watched from its first moment to its last, by whatever moves in its status.
void CoreProcess::watch_progress(double now_s) {
  const Progress progress{status_.ticks.load(std::memory_order_relaxed),
                          status_.started.load(std::memory_order_relaxed) != 0,
                          status_.counters_final.load(std::memory_order_relaxed) != 0};
  const bool in_loop = progress.started && !progress.loop_ended;
  const double longest_s = in_loop ? longest_without_tick_s_ : longest_outside_loop_s_;
  if (progress != seen_) {
    seen_ = progress;
    moved_s_ = now_s;
  } else if (now_s > moved_s_ + longest_s) {
    terminal_.complain(in_loop
                           ? fmt::format("the core has not ticked for {:.0f} s: killed", longest_s)
                           : fmt::format("the core has hung for {:.0f} s {}: killed", longest_s,
                                         progress.started ? "in its shut-down" : "before its first tick"));
    child_.send(SIGKILL);
    moved_s_ = now_s;
  }
}

}  // namespace punctum::tools
