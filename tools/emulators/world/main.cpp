// punctum-world: one simulated world (cell, operator, emergency stop, injector, microscope) behind emulated
// devices on this machine's own drivers, so that a station with real drivers can be played without hardware.
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstring>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hal/sim/camera/sim_camera.hpp"
#include "tools/emulators/drive/drive_bus.hpp"
#include "tools/emulators/falcon/vhci.hpp"
#include "tools/emulators/world/picture_output.hpp"
#include "tools/emulators/world/safety_chain.hpp"
#include "tools/emulators/world/wired_world.hpp"
#include "tools/scene/scene.hpp"
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
constexpr int kLook_ms = 20;  // at the standard input and at what has happened
// Wires answer at once: above a core, whose priority is 80.
constexpr int kWiresPriority = 90;
constexpr std::int64_t kStep_ns = 1'000'000;
// Heartbeats toggle at 1, 2, 4 or 8 kHz: no multiple of their periods.
constexpr std::int64_t kChainLook_ns = 230'000;

int bad(const std::string& text) {
  tools::complain("punctum-world: " + text);
  return tools::exit_bad_input;
}

struct Options {
  std::string scene = "icsi", can, gpio, video;
  std::vector<std::string> overrides;
  std::vector<int> nodes = {1, 2, 3};
  bool usb = false;
};

class Station {
 public:
  Station(const Options& options, const sim::SimConfig& config)
      : options_(options), config_(config), world_(config, bench_.get()) {
    for (const int node : options.nodes) {
      drives_.add({.node = node});
    }
  }

  // Empty, or the line that says why not.
  [[nodiscard]] std::string open() {
    if (!options_.can.empty()) {
      if (std::string problem = drives_.open(options_.can); !problem.empty()) {
        return problem;
      }
    }
    if (options_.usb) {
      if (std::string problem = plug(); !problem.empty()) {
        return problem;
      }
    }
    std::optional<emulator::GpioWires> wires;
    if (!options_.gpio.empty()) {
      auto found = emulator::GpioWires::of(options_.gpio);
      if (!found) {
        return found.error();
      }
      wires.emplace(std::move(*found));
    }
    if (!options_.video.empty()) {
      if (std::string problem = open_microscope(); !problem.empty()) {
        return problem;
      }
    }
    const std::int64_t now_ns = emulator::monotonic_ns();
    began_ns_ = now_ns;
    world_.begin(now_ns);
    if (wires) {
      chain_.emplace(config_, std::move(*wires), world_, now_ns);
      give_power(chain_->power());
    }
    return {};
  }

  int run() {
    std::thread wires([this] { serve_wires(); });
    std::thread microscope([this] { show_pictures(); });
    const sched_param priority{kWiresPriority};
    if (pthread_setschedparam(wires.native_handle(), SCHED_FIFO, &priority) != 0) {
      tools::complain("punctum-world: without real-time priority: its answers may come late");
    }
    tools::say(fmt::format("the world of {} runs; {}\n", options_.scene, what_is_wired()));
    listen();
    over_ = true;
    wires.join();
    microscope.join();
    tell_events();
    return failed_ ? tools::exit_not_done : tools::exit_done;
  }

 private:
  [[nodiscard]] std::string what_is_wired() const {
    std::vector<std::string> parts;
    if (!options_.can.empty()) {
      parts.push_back(fmt::format("drives {} on {}", fmt::join(options_.nodes, ", "), options_.can));
    }
    if (options_.usb) {
      parts.emplace_back("a Falcon on USB");
    }
    if (!options_.gpio.empty()) {
      parts.push_back("stop chain and injector on " + options_.gpio);
    }
    if (picture_) {
      parts.push_back("pictures from " + picture_->camera().path());
    }
    return fmt::format("{}", fmt::join(parts, ", "));
  }

  [[nodiscard]] std::string open_microscope() {
    if (!config_.microscope) {
      return options_.scene + ": has no simulated camera";
    }
    camera_.emplace(config_, *bench_, *answers_);
    // vivid takes pictures at a rate of its own, and shows each again until the next one.
    constexpr std::array<int, 4> kRates = {25, 30, 50, 60};
    const auto rate = std::find_if(kRates.begin(), kRates.end(),
                                   [this](int fps) { return fps >= config_.microscope->fps; });
    auto output = emulator::PictureOutput::open(options_.video, camera_->width(), camera_->height(),
                                                rate != kRates.end() ? *rate : kRates.back());
    if (!output) {
      return output.error();
    }
    picture_ = std::move(*output);
    return {};
  }

  [[nodiscard]] std::string plug() {
    if (port_) {
      return "it is plugged in";
    }
    auto port = emulator::VhciPort::plug_in();
    if (!port) {
      return port.error();
    }
    falcon_.power_on();
    usb_.emplace(falcon_);
    port_.emplace(std::move(*port));
    return {};
  }

  void unplug() {
    port_.reset();
    falcon_.motors_off(emulator::monotonic_ns());
  }

  void give_power(bool on) {
    hand_.power(on, emulator::monotonic_ns());
    (void)drives_.command(on ? "switch-on" : "switch-off");
  }

  // A line that a person has typed: empty, or what is wrong with it.
  [[nodiscard]] std::string command(const std::string& line) {
    const auto behind = [&](std::string_view word) { return line.substr(word.size()); };
    if (line.starts_with("drive ")) {
      return drives_.command(behind("drive "));
    }
    if (line == "falcon unplug") {
      unplug();
      return {};
    }
    if (line == "falcon plug") {
      return plug();
    }
    if (line.starts_with("falcon ")) {
      return falcon_.command(behind("falcon "));
    }
    if (chain_ && chain_->command(line, emulator::monotonic_ns())) {
      return {};
    }
    return fmt::format("\"{}\": unknown, allowed: {}drive LINE, falcon LINE", line,
                       chain_ ? std::string(emulator::SafetyChain::kCommands) + ", " : "");
  }

  // ---- the thread of the wires ----

  void serve_wires() {
    std::int64_t step_ns = began_ns_, look_ns = began_ns_;
    while (!over_) {
      const std::int64_t now_ns = emulator::monotonic_ns();
      take_lines();
      if (chain_ && now_ns >= look_ns) {
        const bool power = chain_->power();
        if (!chain_->step(now_ns)) {
          return wire_is_off(options_.gpio + ": the chip is gone");
        }
        if (chain_->power() != power) {
          give_power(!power);
        }
        look_ns = now_ns + kChainLook_ns;
      }
      if (now_ns >= step_ns) {
        world_.step(drives_, now_ns);
        step_ns = std::max(step_ns + kStep_ns, now_ns);
      }
      wait_until(std::min({step_ns, chain_ ? look_ns : step_ns, port_ ? usb_->next_ns(now_ns) : step_ns}));
      if (port_ && !port_->talk(*usb_)) {
        tools::complain("punctum-world: the USB host has let go" +
                        (usb_->problem().empty() ? std::string{} : ": " + usb_->problem()));
        unplug();
      }
      if (!options_.can.empty() && !drives_.serve()) {
        return wire_is_off(options_.can + ": the interface is gone");
      }
      world_.look_at(drives_, emulator::monotonic_ns());
    }
  }
  void wait_until(std::int64_t due_ns) const {
    const std::int64_t left_ns = std::max<std::int64_t>(0, due_ns - emulator::monotonic_ns());
    std::array<pollfd, 2> ready = {port_ ? port_->waits_for() : pollfd{-1, 0, 0},
                                   {options_.can.empty() ? -1 : drives_.socket(), POLLIN, 0}};
    const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
    (void)ppoll(ready.data(), ready.size(), &left, nullptr);
  }
  void wire_is_off(const std::string& what) {
    tools::complain("punctum-world: " + what);
    failed_ = true;
    stop_signal::request();
  }
  void take_lines() {
    const std::unique_lock lock(lines_mutex_, std::try_to_lock);
    while (lock.owns_lock() && !lines_.empty()) {
      if (const std::string problem = command(lines_.front()); !problem.empty()) {
        tools::complain("punctum-world: " + problem);
      }
      lines_.pop_front();
    }
  }

  // ---- the thread of the microscope ----

  void show_pictures() {
    while (picture_ && !over_) {
      hal::Frame frame;
      if (camera_->next(frame, 100'000'000) != hal::Status::ok) {
        continue;
      }
      const auto shown_ns = frame.exposure_ns + std::llround(config_.microscope->latency_s * 1e9);
      std::this_thread::sleep_for(std::chrono::nanoseconds(shown_ns - emulator::monotonic_ns()));
      const std::size_t size =
          static_cast<std::size_t>(camera_->width()) * static_cast<std::size_t>(camera_->height());
      if (const std::string problem = picture_->show({frame.pixels, size}); !problem.empty()) {
        return wire_is_off(problem);
      }
      camera_->release(frame);
    }
  }

  // ---- the person ----

  void listen() {
    tools::InputLines input{kInput};
    bool listening = true;
    while (stop_signal::count() == 0) {
      pollfd ready{listening ? kInput : -1, POLLIN, 0};
      if (poll(&ready, 1, kLook_ms) > 0) {
        std::vector<std::string> lines;
        listening = input.read_into(lines);
        const std::lock_guard lock(lines_mutex_);
        lines_.insert(lines_.end(), lines.begin(), lines.end());
      }
      tell_events();
    }
  }
  void tell_events() {
    const std::vector<emulator::WorldEvent> events = world_.events(told_);
    told_ += events.size();
    for (const emulator::WorldEvent& event : events) {
      tools::say(
          fmt::format("{:9.3f} s  {}\n", 1e-9 * static_cast<double>(event.t_ns - began_ns_), event.what));
    }
  }

  const Options& options_;
  const sim::SimConfig config_;
  std::unique_ptr<sim::Bench> bench_ = std::make_unique<sim::Bench>();
  std::unique_ptr<sim::CameraAnswers> answers_ = std::make_unique<sim::CameraAnswers>();
  emulator::WiredWorld world_;
  emulator::DriveBus drives_;
  emulator::HandOnGrip hand_{world_};
  emulator::FalconEmulator falcon_{{.booted = true}, hand_};  // its firmware is its maker's
  std::optional<emulator::UsbIpDevice> usb_;
  std::optional<emulator::VhciPort> port_;
  std::optional<emulator::SafetyChain> chain_;
  std::optional<sim::SimCamera> camera_;
  std::unique_ptr<emulator::PictureOutput> picture_;
  std::int64_t began_ns_ = 0;
  std::size_t told_ = 0;

  std::atomic<bool> over_{false}, failed_{false};
  std::mutex lines_mutex_;
  std::deque<std::string> lines_;
};

int run(int argc, char** argv) {
  CLI::App app(
      "One simulated world behind emulated devices: for playing a station with real drivers without "
      "hardware. "
      "A wire that is not named is not there.",
      "punctum-world");
  tools::set_help_style(app);
  Options options;
  app.set_version_flag("--version", tools::version_line("punctum-world"), "version and commit");
  app.add_option("scene", options.scene, "whose [sim] tables are the world, with its operator")
      ->type_name("SCENE");
  app.add_option("--set", options.overrides, "a key of the scene")->type_name("TABLE.KEY=VALUE");
  app.add_option("--can", options.can,
                 "three CiA 402 drives carry the needle, on this interface, which is up")
      ->type_name("NAME");
  app.add_option("--nodes", options.nodes, "their node numbers, along x, y and z")
      ->type_name("N,N,N")
      ->check(tools::within(1, 127))
      ->delimiter(',')
      ->expected(emulator::WiredWorld::kAxes);
  app.add_flag("--usb", options.usb, "the operator holds a Falcon on the virtual USB host controller");
  app.add_option(
         "--gpio", options.gpio,
         "contacts (lines 0 and 1), reset (2), heartbeat (3) and the injector's gate (4) on this chip of "
         "gpio-sim")
      ->type_name("/dev/gpiochipN");
  app.add_option("--video", options.video,
                 "the microscope's pictures, into a device of vivid or v4l2loopback")
      ->type_name("/dev/videoN");
  app.footer(
      std::string("Lines on the standard input:\n  ") + emulator::SafetyChain::kCommands +
      "\n  drive LINE (as punctum-drive takes it: drive 2 ignore quick-stop)\n  falcon LINE (as "
      "punctum-falcon takes it: falcon unplug)\n\n" +
      tools::help_footer({{"punctum-world icsi --can vcan0 --usb --gpio /dev/gpiochip0 --video /dev/video0",
                           "a whole station, for punctum run loopback"},
                          {"punctum-world icsi --can vcan0", "only the drives"}},
                         {{tools::exit_done, "it was stopped by a signal"},
                          {tools::exit_not_done, "a wire has come off"},
                          {tools::exit_bad_input, "bad input, or something that is not there"}}));
  if (const auto over = tools::parse_command_line(app, argc, argv)) {
    return *over;
  }
  if (options.can.empty() && !options.usb && options.gpio.empty() && options.video.empty()) {
    return bad("no wire, allowed: --can, --usb, --gpio and --video");
  }
  if (const std::string problem = emulator::check_nodes(options.nodes); !problem.empty()) {
    return bad("--nodes: " + problem);
  }
  const auto scene = tools::load_scene(options.scene, options.overrides);
  if (!scene) {
    return bad(scene.error());
  }
  if (!scene->sim) {
    return bad(options.scene + ": simulates nothing");
  }
  stop_signal::watch({SIGTERM, SIGINT, SIGHUP});
  Station station(options, *scene->sim);
  if (const std::string problem = station.open(); !problem.empty()) {
    return bad(problem);
  }
  return station.run();
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
