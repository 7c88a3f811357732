#include "tools/punctum/core_process.hpp"

#include <fmt/format.h>
#include <signal.h>

namespace punctum::tools {
namespace {

constexpr double kTimeToAnswer_s = 5;
constexpr double kHung_s = 2;          // without a tick
constexpr double kHungVirtual_s = 30;  // it may wait for camera and recorder

}  // namespace

CoreProcess::CoreProcess(const rt::CoreSegment& segment, rt::CommandQueue& commands, bool real_time,
                         Terminal& terminal)
    : status_(segment.status),
      commands_(commands),
      terminal_(terminal),
      longest_without_tick_s_(real_time ? kHung_s : kHungVirtual_s) {}

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
  watch_ticks(now_s);
}

void CoreProcess::watch_stop(double now_s, int stop_signals) {
  const auto step = [this, now_s](Step next) {
    step_ = next;
    stepped_s_ = now_s;
  };
  if (step_ == Step::none && stop_signals > 0) {
    step(Step::commanded);
    terminal_.say("stopping: needle held, force to zero (again Ctrl-C to insist)");
    ask(rt::Command::stop);
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

// A core that hangs will not come back by itself; its heartbeat has stopped and the relay has acted.
void CoreProcess::watch_ticks(double now_s) {
  const std::uint64_t ticks = status_.ticks.load(std::memory_order_relaxed);
  const bool in_loop = status_.started.load(std::memory_order_relaxed) != 0 &&
                       status_.counters_final.load(std::memory_order_relaxed) == 0;
  if (ticks != seen_ticks_ || !in_loop) {
    seen_ticks_ = ticks;
    ticked_s_ = now_s;
  } else if (now_s > ticked_s_ + longest_without_tick_s_) {
    terminal_.complain(fmt::format("the core has not ticked for {:.0f} s: killed", longest_without_tick_s_));
    child_.send(SIGKILL);
    ticked_s_ = now_s;
  }
}

}  // namespace punctum::tools
