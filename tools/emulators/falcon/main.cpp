// punctum-falcon: a Novint Falcon on this machine's USB, for trying and testing a station without hardware.
// Lines on the standard input make it misbehave.
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <exception>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "tools/emulators/falcon/falcon.hpp"
#include "tools/emulators/falcon/vhci.hpp"
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
constexpr std::int64_t kLongest_ns = 100'000'000;

int bad(const std::string& text) {
  tools::complain("punctum-falcon: " + text);
  return tools::exit_bad_input;
}

// A hand that goes round in a circle across the axis, or rests.
class CirclingHand final : public emulator::Hand {
 public:
  CirclingHand(double radius_m, double rate_Hz, unsigned buttons)
      : radius_m_(radius_m), rate_Hz_(rate_Hz), buttons_(buttons) {}
  emulator::Grip grip(std::int64_t now_ns) override {
    const double turn = 2 * std::numbers::pi * std::fmod(rate_Hz_ * 1e-9 * static_cast<double>(now_ns), 1.0);
    emulator::Grip grip;
    grip.position_m[0] = radius_m_ * std::cos(turn);
    grip.position_m[1] = radius_m_ * std::sin(turn);
    grip.buttons = static_cast<std::uint8_t>(buttons_);
    return grip;
  }
  void push(const emulator::Triple& force_N, std::int64_t /*now_ns*/) override { force_N_ = force_N; }
  [[nodiscard]] const emulator::Triple& force_N() const { return force_N_; }

 private:
  double radius_m_, rate_Hz_;
  unsigned buttons_;
  emulator::Triple force_N_{};
};

class Station {
 public:
  Station(const emulator::FalconParams& params, CirclingHand& hand) : hand_(hand), falcon_(params, hand) {}

  // Empty, or what is wrong.
  std::string command(const std::string& line) {
    if (line == "unplug") {
      unplug();
      return {};
    }
    if (line == "plug") {
      return plug();
    }
    if (line == "force") {
      const auto& f = hand_.force_N();
      tools::say(std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) + " N\n");
      return {};
    }
    return falcon_.command(line);
  }
  std::string plug() {
    if (port_) {
      return "it is plugged in";
    }
    auto port = emulator::VhciPort::plug_in();
    if (!port) {
      return port.error();
    }
    falcon_.power_on();
    device_.emplace(falcon_);
    port_.emplace(std::move(*port));
    return {};
  }
  int serve() {
    tools::InputLines input{kInput};
    bool listening = true;
    while (stop_signal::count() == 0) {
      if (port_ &&
          !(port_->wait(std::min(due_ns(), kLongest_ns), listening ? kInput : -1) && port_->talk(*device_))) {
        tools::complain("punctum-falcon: the host has let go" +
                        (device_->problem().empty() ? std::string{} : ": " + device_->problem()));
        unplug();
      }
      pollfd ready{listening ? kInput : -1, POLLIN, 0};
      if (poll(&ready, 1, port_ ? 0 : 100) > 0) {
        std::vector<std::string> lines;
        listening = input.read_into(lines);
        for (const std::string& line : lines) {
          if (const std::string problem = command(line); !problem.empty()) {
            tools::complain("punctum-falcon: " + problem);
          }
        }
      }
    }
    return tools::exit_done;
  }

 private:
  void unplug() {
    port_.reset();
    falcon_.motors_off(emulator::monotonic_ns());
  }
  [[nodiscard]] std::int64_t due_ns() const {
    const std::int64_t now_ns = emulator::monotonic_ns();
    return device_->next_ns(now_ns) - now_ns;
  }

  CirclingHand& hand_;
  emulator::FalconEmulator falcon_;
  std::optional<emulator::UsbIpDevice> device_;
  std::optional<emulator::VhciPort> port_;
};

int run(int argc, char** argv) {
  CLI::App app("A Novint Falcon on this machine's USB: for trying a station without hardware.",
               "punctum-falcon");
  tools::set_help_style(app);
  double radius_mm = 0, rate_Hz = 0.2;
  unsigned buttons = 0;
  emulator::FalconParams params;
  std::vector<std::string> commands;
  app.set_version_flag("--version", tools::version_line("punctum-falcon"), "version and commit");
  app.add_option("--circle", radius_mm, "the hand goes round in a circle of this radius")
      ->type_name("MM")
      ->check(tools::within(0.0, 45.0));
  app.add_option("--rate", rate_Hz, "so often in a second")->type_name("HZ")->check(tools::within(0.0, 20.0));
  app.add_option("--buttons", buttons, "that are pressed, as a number of four bits")
      ->type_name("BITS")
      ->check(tools::within(0, 15));
  app.add_flag("--booted", params.booted, "it has its firmware from the start");
  app.add_flag("--homed", params.homed, "and it is homed");
  app.add_option("--do", commands, "a line as on the standard input")->type_name("LINE");
  app.footer(
      std::string("Lines on the standard input:\n  unplug, plug, force (says it), ") +
      emulator::FalconEmulator::kCommands + "\n\n" +
      tools::help_footer({{"punctum-falcon --circle 30", "a hand that moves; it is to be booted and homed"},
                          {"punctum-falcon --booted --homed --do 'corrupt 10'", "ten damaged frames"}},
                         {{tools::exit_done, "it was stopped by a signal"},
                          {tools::exit_bad_input, "bad input, or no virtual USB host controller"}}));
  if (const auto over = tools::parse_command_line(app, argc, argv)) {
    return *over;
  }
  CirclingHand hand(radius_mm * 1e-3, rate_Hz, buttons);
  Station station(params, hand);
  if (const std::string problem = station.plug(); !problem.empty()) {
    return bad(problem);
  }
  for (const std::string& line : commands) {
    if (const std::string problem = station.command(line); !problem.empty()) {
      return bad(problem);
    }
  }
  stop_signal::watch({SIGTERM, SIGINT, SIGHUP});
  return station.serve();
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
