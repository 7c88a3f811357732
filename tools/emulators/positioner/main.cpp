// punctum-positioner: manipulators with the Zaber ASCII protocol behind a pseudo-terminal, for trying and
// testing a station without hardware. Lines on the standard input make them misbehave.
#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <string>
#include <vector>

#include "tools/emulators/positioner/positioner.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/input_lines.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/version.hpp"

namespace {

using namespace punctum;
namespace stop_signal = tools::stop_signal;

constexpr int kInput = 0;
constexpr int kStep_ms = 2;

int bad(const std::string& text) {
  tools::complain("punctum-positioner: " + text);
  return tools::exit_bad_input;
}

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000 + t.tv_nsec;
}

// Both ends of a pseudo-terminal: the other one stays open here, so that a program may come and go.
struct Ends {
  int own = -1, other = -1;
  std::string path;
};
Ends open_ends() {
  Ends ends;
  ends.own = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (ends.own < 0 || grantpt(ends.own) != 0 || unlockpt(ends.own) != 0) {
    return ends;
  }
  const char* const path = ptsname(ends.own);
  ends.other = path != nullptr ? open(path, O_RDWR | O_NOCTTY | O_CLOEXEC) : -1;
  termios line{};
  if (ends.other >= 0 && tcgetattr(ends.other, &line) == 0) {
    cfmakeraw(&line);
    tcsetattr(ends.other, TCSANOW, &line);
    ends.path = path;
  }
  return ends;
}

int serve(emulator::Positioner& positioner, int terminal) {
  bool listening = true;
  tools::InputLines input{kInput};
  while (stop_signal::count() == 0) {
    pollfd ready[] = {{terminal, POLLIN, 0}, {listening ? kInput : -1, POLLIN, 0}};
    if (poll(ready, 2, kStep_ms) < 0 && errno != EINTR) {
      return bad(std::strerror(errno));
    }
    char text[512];
    if (const ssize_t size = read(terminal, text, sizeof(text)); size > 0) {
      positioner.receive({text, static_cast<std::size_t>(size)}, now_ns());
    }
    const std::string out = positioner.step(now_ns());
    if (!out.empty() && write(terminal, out.data(), out.size()) < 0 && errno != EAGAIN) {
      return bad(std::string("the terminal is gone: ") + std::strerror(errno));
    }
    if ((ready[1].revents & (POLLIN | POLLHUP)) != 0) {
      std::vector<std::string> lines;
      listening = input.read_into(lines);
      for (const std::string& line : lines) {
        if (const std::string problem = positioner.command(line); !problem.empty()) {
          tools::complain("punctum-positioner: " + problem);
        }
      }
    }
  }
  return tools::exit_done;
}

int run(int argc, char** argv) {
  CLI::App app("Manipulators with the Zaber ASCII protocol behind a pseudo-terminal, without hardware.",
               "punctum-positioner");
  tools::set_help_style(app);
  emulator::PositionerParams params;
  std::vector<std::string> commands;
  bool not_homed = false;
  app.set_version_flag("--version", tools::version_line("punctum-positioner"), "version and commit");
  app.add_option("--devices", params.devices, "of the chain")->type_name("N")->check(tools::within(1, 9));
  app.add_option("--axes", params.axes, "of each device")->type_name("N")->check(tools::within(1, 9));
  app.add_option("--start", params.start, "where the axes stand at first")
      ->type_name("MICROSTEPS")
      ->check(tools::within(0.0, params.max_microsteps));
  app.add_flag("--not-homed", not_homed, "as after power-up");
  app.add_option("--do", commands, "a line as on the standard input")->type_name("LINE");
  app.footer(std::string("Lines on the standard input:\n  ") + emulator::Positioner::kCommands + "\n\n" +
             tools::help_footer(
                 {{"punctum-positioner", "three devices of one axis; prints the path of its terminal"},
                  {"punctum-positioner --devices 1 --axes 3", "one controller of three"}},
                 {{tools::exit_done, "it was stopped by a signal"},
                  {tools::exit_bad_input, "bad input, or no pseudo-terminal"}}));
  if (const auto over = tools::parse_command_line(app, argc, argv)) {
    return *over;
  }
  params.homed = !not_homed;
  emulator::Positioner positioner(params);
  for (const std::string& line : commands) {
    if (const std::string problem = positioner.command(line); !problem.empty()) {
      return bad(problem);
    }
  }
  const Ends ends = open_ends();
  if (ends.path.empty()) {
    return bad(std::string("no pseudo-terminal: ") + std::strerror(errno));
  }
  stop_signal::watch({SIGTERM, SIGINT, SIGHUP});
  tools::say(ends.path + "\n");
  const int code = serve(positioner, ends.own);
  close(ends.other);
  close(ends.own);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  tools::start_program();
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    return bad(e.what());
  }
}
