// Scene `hands-on` on a terminal, with the programs as they are installed: somebody at a mouse who sees
// nothing but the line on the terminal does what it says next, and injects a cell. What the terminal showed
// is printed as a recording (asciicast, version 2): the lines from `{"version"` on, for a player.
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "rt/executive/monotonic_clock.hpp"
#include "tests/loopback/virtual_input.hpp"

namespace punctum::loopback {
namespace {

constexpr int kColumns = 110, kRows = 30;
constexpr double kLook_s = 0.02;  // between two motions of the mouse

// A program on a terminal of its own, and all that it shows there.
class OnTerminal {
 public:
  explicit OnTerminal(std::vector<std::string> words) {
    winsize size{};
    size.ws_col = kColumns;
    size.ws_row = kRows;
    pid_ = forkpty(&terminal_, nullptr, nullptr, &size);
    if (pid_ == 0) {
      setenv("LC_ALL", "C.UTF-8", 1);
      setenv("TERM", "xterm-256color", 1);
      std::vector<char*> arguments;
      std::transform(words.begin(), words.end(), std::back_inserter(arguments),
                     [](std::string& word) { return word.data(); });
      arguments.push_back(nullptr);
      execv(arguments[0], arguments.data());
      _exit(127);
    }
    EXPECT_GT(pid_, 0) << "no terminal could be opened";
    begun_ns_ = clock_.now_ns();
  }
  ~OnTerminal() { close(terminal_); }
  OnTerminal(const OnTerminal&) = delete;
  OnTerminal& operator=(const OnTerminal&) = delete;

  // What it shows within that time. False: it has ended.
  bool watch(double for_s) {
    if (pid_ <= 0) {
      return false;
    }
    const std::int64_t until_ns = clock_.now_ns() + static_cast<std::int64_t>(for_s * 1e9);
    for (std::int64_t left_ns = until_ns - clock_.now_ns(); left_ns > 0;
         left_ns = until_ns - clock_.now_ns()) {
      pollfd in{terminal_, POLLIN, 0};
      if (poll(&in, 1, static_cast<int>((left_ns + 999'999) / 1'000'000)) <= 0) {
        continue;
      }
      char text[4096];
      const ssize_t size = read(terminal_, text, sizeof text);
      if (size <= 0) {
        return false;
      }
      const std::string shown(text, static_cast<std::size_t>(size));
      const double t_s = 1e-9 * static_cast<double>(clock_.now_ns() - begun_ns_);
      recording_ += nlohmann::json::array({t_s, "o", shown})
                        .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) +
                    "\n";
      shown_ += shown;
    }
    return true;
  }
  // Of the live line: what to do next. Empty: nothing, or not known yet.
  [[nodiscard]] std::string next_step() const {
    const std::size_t line = shown_.rfind('\r');
    const std::size_t at = line == std::string::npos ? line : shown_.find("> ", line);
    if (at == std::string::npos) {
      return "";
    }
    const std::size_t end = shown_.find("  ", at);
    return shown_.substr(at + 2, end == std::string::npos ? end : end - at - 2);
  }
  [[nodiscard]] const std::string& shown() const { return shown_; }
  [[nodiscard]] std::string recording() const {
    const nlohmann::json head = {{"version", 2}, {"width", kColumns}, {"height", kRows}};
    return head.dump() + "\n" + recording_;
  }
  int end() {
    int status = 0;
    waitpid(pid_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  rt::MonotonicClock clock_;
  int terminal_ = -1;
  pid_t pid_ = -1;
  std::int64_t begun_ns_ = 0;
  std::string shown_, recording_;
};

class AtTheMouse {
 public:
  explicit AtTheMouse(VirtualInput& mouse) : mouse_(mouse) {}

  void follow(const std::string& words, double for_s) {
    if (words == "hold enable") {
      // Once more after a second: a button that was held from the start on counts for nothing.
      asked_s_ += for_s;
      press(BTN_LEFT, holds_, std::fmod(asked_s_, 1.0) >= kLetGo_s);
    } else if (words == "to the cell") {
      move(-kApproach_m_s, for_s);
    } else if (words == "push on" || words == "deeper") {
      press(BTN_RIGHT, injects_, false);
      move(-kPush_m_s, for_s);
      inside_s_ = 0;
    } else if (words == "press inject") {
      // First a little further, so that the whole tip is in the cell.
      inside_s_ += for_s;
      if (inside_s_ < kFurther_s) {
        move(-kPush_m_s, for_s);
      } else {
        press(BTN_RIGHT, injects_, true);
      }
    } else if (words == "hold inject") {
      injected_s_ += for_s;
      press(BTN_RIGHT, injects_, injected_s_ < kDose_s);
    } else if (words == "draw back") {
      press(BTN_RIGHT, injects_, false);
      move(kBack_m_s, for_s);
    }
  }

 private:
  static constexpr double kScale = 500;      // mapping.position_scale of the scene
  static constexpr double kCount_m = 25e-6;  // evdev.count_um
  // Of the needle.
  static constexpr double kApproach_m_s = 40e-6, kPush_m_s = 15e-6, kBack_m_s = 60e-6;
  static constexpr double kFurther_s = 1, kDose_s = 0.6, kLetGo_s = 0.2;

  void press(int button, bool& pressed, bool down) {
    if (pressed != down) {
      mouse_.press(button, down);
      pressed = down;
    }
  }
  void move(double needle_m_s, double for_s) {
    owed_ += kScale * needle_m_s * for_s / kCount_m;
    const int counts = static_cast<int>(owed_);
    owed_ -= counts;
    if (counts != 0) {
      mouse_.emit(EV_REL, REL_X, counts);
      mouse_.report();
    }
  }

  VirtualInput& mouse_;
  bool holds_ = false, injects_ = false;
  double owed_ = 0, asked_s_ = 0, inside_s_ = 0, injected_s_ = 0;
};

TEST(HandsOnTerminal, leads_somebody_who_does_what_it_says_through_a_whole_injection) {
  VirtualInput mouse(mouse_model());
  AtTheMouse somebody(mouse);
  OnTerminal terminal({"/guest/punctum", "run", "hands-on", "--seconds", "40", "--report", "/tmp/report",
                       "--no-frames", "--no-figure", "--set", "evdev.path=" + mouse.path(), "--set",
                       "vision.method=truth"});  // no picture is drawn: the guest is slow
  while (terminal.watch(kLook_s)) {
    somebody.follow(terminal.next_step(), kLook_s);
  }
  EXPECT_EQ(terminal.end(), 0) << terminal.shown();
  for (const char* words : {"> hold enable", "> to the cell", "> push on", "> press inject", "> hold inject",
                            "> draw back", "outcome"}) {
    EXPECT_NE(terminal.shown().find(words), std::string::npos) << words;
  }
  std::printf("%s", terminal.recording().c_str());
}

}  // namespace
}  // namespace punctum::loopback
