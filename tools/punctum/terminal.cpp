#include "tools/punctum/terminal.hpp"

#include <unistd.h>

#include <cmath>

#include "tools/shared/say.hpp"

namespace punctum::tools {
Terminal::Terminal() : is_terminal_(isatty(STDOUT_FILENO) != 0) {}

void Terminal::complain(const std::string& text) {
  clear_progress();
  tools::complain("punctum: " + text);
}

void Terminal::print(const std::string& text) {
  clear_progress();
  tools::say(text);
}

void Terminal::progress(const std::string& line) {
  if (!is_terminal_) {
    say("{}", line);
    return;
  }
  tools::say("\r\033[K" + line);
  progress_drawn_ = true;
}

void Terminal::clear_progress() {
  if (progress_drawn_) {
    tools::say("\r\033[K");
  }
  progress_drawn_ = false;
}

std::string progress_line(const Scene& scene, const rt::TelemetrySample& newest, const rt::CoreStatus& core) {
  const double hand_N = std::hypot(newest.force_N[0], newest.force_N[1], newest.force_N[2]);
  std::string line =
      fmt::format("{:8.1f} s  {:<11}  hand {:5.2f} N", newest.t_s, rt::name(newest.phase), hand_N);
  if (scene.servo.membrane) {
    line += fmt::format("  needle {:6.1f} uN  depth {:6.1f} um", newest.tip_force_N * 1e6, newest.wd_m * 1e6);
  }
  if (scene.servo.cells != 1 && scene.servo.phases) {
    line += fmt::format("  cell {}", newest.cell + 1);
  }
  line += fmt::format("  missed {}", core.missed.load());
  if (newest.fault != rt::Fault::none) {
    line += fmt::format("  FAULT {}", rt::name(newest.fault));
  }
  if ((newest.alarms & rt::alarm_vision_stale) != 0) {
    line += "  vision stale";
  }
  return line;
}

}  // namespace punctum::tools
