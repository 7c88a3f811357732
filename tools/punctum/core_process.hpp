// The control core as its parent sees it: started once, asked to stop in steps, killed when it hangs:
// in its set-up, in its loop or in its shut-down.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/station/station.hpp"
#include "tools/punctum/terminal.hpp"
#include "tools/shared/child.hpp"

namespace punctum::tools {

class CoreProcess {
 public:
  CoreProcess(const rt::CoreSegment& segment, rt::CommandQueue& commands, bool real_time, Terminal& terminal);

  [[nodiscard]] tl::expected<void, std::string> start(const std::vector<std::string>& args,
                                                      const std::string& log,
                                                      const std::vector<int>& descriptors);
  [[nodiscard]] bool ended(Ended& how) { return child_.ended(how); }
  [[nodiscard]] const std::string& log() const noexcept { return child_.log(); }
  void ask(rt::Command::Kind what);
  // Once per round of the parent, with the number of stop signals so far. A first signal is a commanded stop;
  // a second one, or no answer in time, SIGTERM; a third one, or still no answer, SIGKILL.
  void watch(double now_s, int stop_signals);
  [[nodiscard]] bool stop_was_asked() const noexcept { return step_ != Step::none; }

 private:
  enum class Step : std::uint8_t { none, commanded, signalled, killed };
  struct Progress {
    std::uint64_t ticks = 0;
    bool started = false, loop_ended = false;
    friend bool operator==(const Progress&, const Progress&) = default;
  };
  void watch_stop(double now_s, int stop_signals);
  void watch_progress(double now_s);

  const rt::CoreStatus& status_;
  rt::CommandQueue& commands_;
  Terminal& terminal_;
  double longest_without_tick_s_, longest_outside_loop_s_;
  Child child_;
  Step step_ = Step::none;
  double stepped_s_ = 0;
  Progress seen_;
  double moved_s_ = 0;  // when it last changed
};

}  // namespace punctum::tools
