// punctum-drive: a CiA 402 drive on a CAN interface, for trying and testing a station without hardware. Lines
// on the standard input make it misbehave.
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "tools/emulators/drive/drive.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/exit_codes.hpp"
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

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000 + t.tv_nsec;
}

// A raw socket on the interface, or the line that says why not.
struct Opened {
  int socket = -1;
  std::string problem;
};
Opened open_interface(const std::string& name) {
  const auto failed = [&](int socket, const char* what) {
    const std::string why = name + ": " + what + ": " + std::strerror(errno);
    if (socket >= 0) {
      close(socket);
    }
    return Opened{-1, why};
  };
  const int socket = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
  if (socket < 0) {
    return failed(socket, "this kernel gives no CAN socket");
  }
  ifreq request{};
  if (name.size() >= sizeof(request.ifr_name)) {
    errno = ENODEV;
    return failed(socket, "is no interface");
  }
  name.copy(request.ifr_name, name.size());
  if (ioctl(socket, SIOCGIFINDEX, &request) != 0) {
    return failed(socket, "there is no such interface");
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = request.ifr_ifindex;
  if (bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return failed(socket, "cannot be bound");
  }
  return {socket, {}};
}

// One program can be several drives: each command begins with a node number, or is for all.
class Drives {
 public:
  void add(const emulator::DriveParams& params) {
    drives_.push_back({params.node, std::make_unique<emulator::Drive>(params)});
  }
  void on_frame(const can_frame& frame) {
    for (One& one : drives_) {
      one.drive->on_frame(frame, now_ns());
    }
  }
  [[nodiscard]] bool step(int socket) {
    for (One& one : drives_) {
      for (const can_frame& frame : one.drive->step(now_ns())) {
        if (write(socket, &frame, sizeof(frame)) < 0 && errno != ENOBUFS && errno != EAGAIN) {
          return false;
        }
      }
    }
    return true;
  }
  [[nodiscard]] std::string command(const std::string& line) {
    char* end = nullptr;
    const long node = std::strtol(line.c_str(), &end, 10);
    const bool for_one = end != line.c_str();
    bool found = false;
    for (One& one : drives_) {
      if (for_one && one.node != node) {
        continue;
      }
      found = true;
      const std::string rest = for_one ? line.substr(static_cast<std::size_t>(end - line.c_str())) : line;
      if (std::string problem = one.drive->command(rest); !problem.empty()) {
        return problem;
      }
    }
    return found ? std::string{} : "\"" + line + "\": there is no such node";
  }

 private:
  struct One {
    int node;
    std::unique_ptr<emulator::Drive> drive;
  };
  std::vector<One> drives_;
};

// Whole lines from a descriptor that does not block.
class Lines {
 public:
  // False: there will be no more.
  bool read_into(std::vector<std::string>& lines) {
    char text[512];
    const ssize_t size = ::read(kInput, text, sizeof(text));
    if (size <= 0) {
      return size < 0 && errno == EINTR;
    }
    rest_.append(text, static_cast<std::size_t>(size));
    for (std::size_t end = rest_.find('\n'); end != std::string::npos; end = rest_.find('\n')) {
      lines.push_back(rest_.substr(0, end));
      rest_.erase(0, end + 1);
    }
    return true;
  }

 private:
  std::string rest_;
};

int serve(Drives& drives, int socket) {
  Lines input;
  bool listening = true;
  while (stop_signal::count() == 0) {
    pollfd ready[] = {{socket, POLLIN, 0}, {listening ? kInput : -1, POLLIN, 0}};
    if (poll(ready, 2, kStep_ms) < 0 && errno != EINTR) {
      return bad(std::strerror(errno));
    }
    can_frame frame{};
    while (read(socket, &frame, sizeof(frame)) == static_cast<ssize_t>(sizeof(frame))) {
      drives.on_frame(frame);
    }
    if (!drives.step(socket)) {
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
  app.set_version_flag("--version", tools::version_line("punctum-drive"));
  app.add_option("interface", interface, "a CAN interface that is up")->type_name("NAME");
  app.add_option("--node", nodes, "node numbers, a drive for each")
      ->type_name("N")
      ->check(CLI::Range(1, 127))
      ->delimiter(',');
  app.add_option("--start", start_counts, "where the drives stand at first, in counts")->type_name("COUNTS");
  app.add_option("--do", commands, "a line as on the standard input")->type_name("LINE");
  app.footer(std::string("Lines on the standard input, for all drives or behind a node number for one:\n  ") +
             emulator::Drive::kCommands + "\n\n" +
             tools::help_footer({{"punctum-drive vcan0 --node 1,2,3", "three drives"},
                                 {"punctum-drive can1 --do 'ignore quick-stop'", "one that does not stop"}},
                                {{tools::exit_done, "it was stopped by a signal"},
                                 {tools::exit_bad_input, "bad input, or no such interface"}}));
  if (const auto over = tools::parse_command_line(app, argc, argv)) {
    return *over;
  }
  Drives drives;
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
  const Opened opened = open_interface(interface);
  if (opened.socket < 0) {
    return bad(opened.problem);
  }
  stop_signal::watch({SIGTERM, SIGINT, SIGHUP});
  const int code = serve(drives, opened.socket);
  close(opened.socket);
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
