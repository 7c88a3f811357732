// punctum-drive: a CiA 402 drive on a CAN interface, for trying and testing a station without hardware. Lines
// on the standard input make it misbehave.
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <string>
#include <vector>

#include "tools/emulators/drive/drive_bus.hpp"
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
constexpr int kStep_ms = 1;

int bad(const std::string& text) {
  tools::complain("punctum-drive: " + text);
  return tools::exit_bad_input;
}

int serve(emulator::DriveBus& drives) {
  tools::InputLines input{kInput};
  bool listening = true;
  while (stop_signal::count() == 0) {
    pollfd ready[] = {{drives.socket(), POLLIN, 0}, {listening ? kInput : -1, POLLIN, 0}};
    if (poll(ready, 2, kStep_ms) < 0 && errno != EINTR) {
      return bad(std::strerror(errno));
    }
    if (!drives.serve()) {
      return bad(std::string("the interface is gone: ") + std::strerror(errno));
    }
    if ((ready[1].revents & (POLLIN | POLLHUP)) != 0) {
      std::vector<std::string> lines;
      listening = input.read_into(lines);
      for (const std::string& line : lines) {
        if (const std::string problem = drives.command(line); !problem.empty()) {
          tools::complain("punctum-drive: " + problem);
        }
      }
    }
  }
  return tools::exit_done;
}

int run(int argc, char** argv) {
  CLI::App app("A CiA 402 drive, or several, on a CAN interface: for trying a station without hardware.",
               "punctum-drive");
  tools::set_help_style(app);
  std::string interface = "vcan0";
  std::vector<int> nodes = {1};
  std::vector<std::string> commands;
  double start_counts = 0;
  bool data_sheet = false;
  app.set_version_flag("--version", tools::version_line("punctum-drive"), "version and commit");
  app.add_option("interface", interface, "a CAN interface that is up")->type_name("NAME");
  app.add_option("--node", nodes, "node numbers, a drive for each")
      ->type_name("N")
      ->check(tools::within(1, 127))
      ->delimiter(',');
  app.add_option("--start", start_counts, "where the drives stand at first, in counts")
      ->type_name("COUNTS")
      ->check(tools::within(-2147483648.0, 2147483647.0));
  app.add_flag("--eds", data_sheet, "print its electronic data sheet (CiA 306), and end");
  app.add_option("--do", commands, "a line as on the standard input")->type_name("LINE");
  app.footer(
      std::string("Lines on the standard input, for all drives or behind a node number for one:\n  ") +
      emulator::Drive::kCommands + "\n\n" +
      tools::help_footer({{"punctum-drive vcan0 --node 1,2,3", "three drives"},
                          {"punctum-drive can1 --do 'ignore quick-stop'", "one that does not stop"},
                          {"punctum-drive --eds > punctum-drive.eds", "what it has, for a CANopen master"}},
                         {{tools::exit_done, "it was stopped by a signal, or has printed what was asked for"},
                          {tools::exit_not_done, "what was asked for could not be written"},
                          {tools::exit_bad_input, "bad input, or no such interface"}}));
  if (const auto over = tools::parse_command_line(app, argc, argv)) {
    return *over;
  }
  if (data_sheet) {
    tools::say(emulator::Drive::data_sheet({}));
    return tools::code_after_words(tools::exit_done);
  }
  if (const std::string problem = emulator::check_nodes(nodes); !problem.empty()) {
    return bad("--node: " + problem);
  }
  emulator::DriveBus drives;
  for (const int node : nodes) {
    emulator::DriveParams params;
    params.node = node;
    params.start_counts = start_counts;
    drives.add(params);
  }
  for (const std::string& line : commands) {
    if (const std::string problem = drives.command(line); !problem.empty()) {
      return bad(problem);
    }
  }
  if (const std::string problem = drives.open(interface); !problem.empty()) {
    return bad(problem);
  }
  stop_signal::watch({SIGTERM, SIGINT, SIGHUP});
  return serve(drives);
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
