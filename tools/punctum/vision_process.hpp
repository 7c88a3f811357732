// Vision as its parent sees it: started, and started again when it dies or hangs, at once and then ever
// slower.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "tools/punctum/terminal.hpp"
#include "tools/punctum/vision_watchdog.hpp"
#include "tools/shared/child.hpp"

namespace punctum::tools {

struct Restart {
  double t_s = 0;  // of the run
  std::string why;
};

class VisionProcess {
 public:
  enum class News : std::uint8_t {
    none,
    frames_ended,  // it has come to the end of its frames, and is over
    given_up,      // it died too often, and is over
    refused,       // its input is bad: it is over, and so is the run
  };

  // `rounds`: as vision counts them in its segment; null: nobody does.
  VisionProcess(std::vector<std::string> args, std::vector<int> descriptors, std::string log,
                const std::atomic<std::uint64_t>* rounds, bool real_time, Terminal& terminal);

  [[nodiscard]] tl::expected<void, std::string> start();
  // Once per round of the parent; run_s is the time of the run, for the record of restarts.
  [[nodiscard]] News watch(double now_s, double run_s);
  // The plant has stopped: vision ends by itself. When it does not, it is asked to, and then killed. At once:
  // it is asked without waiting, for the plant never was.
  void end(bool at_once = false);

  [[nodiscard]] bool over() const noexcept { return over_; }
  [[nodiscard]] const std::vector<Restart>& restarts() const noexcept { return restarts_; }

 private:
  void start_again();
  void kill_if_it_hangs(double now_s);

  std::vector<std::string> args_;
  std::vector<int> descriptors_;
  std::string log_;
  Terminal& terminal_;
  Child child_;
  const std::atomic<std::uint64_t>* rounds_;
  VisionWatchdog watchdog_;
  bool is_watched_ = false;  // since its newest start
  std::string killed_because_;
  bool over_ = false;
  bool start_is_planned_ = false;
  double next_start_s_ = 0;
  std::vector<Restart> restarts_;
  std::vector<double> recent_s_;
};

}  // namespace punctum::tools
