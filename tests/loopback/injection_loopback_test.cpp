// A whole injection, and one that is stopped half-way, with the programs as they are installed and every
// device behind a driver of the kernel: the handle on a USB host controller (vhci_hcd), the stage's three
// drives on a CAN bus (kvaser_pci), the microscope on a video device (vivid), emergency stop and injector on
// a GPIO chip (gpio-sim). Behind the wires there is one simulated world.
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/mount.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hal/sim/camera/sim_camera.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "tests/loopback/can_wires.hpp"
#include "tests/loopback/gpiod_wiring.hpp"
#include "tests/loopback/vivid_loop.hpp"
#include "tests/support/descendants.hpp"
#include "tests/support/programs.hpp"
#include "tools/emulators/falcon/vhci.hpp"
#include "tools/emulators/world/wired_world.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::loopback {
namespace {

using emulator::HandOnGrip, emulator::WatchedLevel, emulator::WiredWorld, emulator::WorldEvent;

constexpr int kWiresPriority = 90;  // wires are as fast as they are: above the core
constexpr int kFps = 25;
constexpr double kShown_s = 0.04;                 // from an exposure to its picture on the wire
constexpr const char* kReports = "/tmp/reports";  // where a disk of its own may be
constexpr const char* kReport = "/tmp/reports/run";

// The world of scene `icsi`, with an operator in a hurry.
sim::SimConfig simulated_world() {
  const auto scene =
      tools::load_scene("icsi", {"mapping.position_scale=250", "camera.width_px=480", "camera.height_px=320",
                                 "camera.fps=6", "sim.haptic.workspace_mm=40", "sim.operator.approach_s=1.5",
                                 "sim.operator.indentation_speed_um_s=12", "sim.operator.dwell_s=0.4",
                                 "sim.operator.tremor_mm=0.15", "sim.operator.withdrawal_speed_um_s=40"});
  EXPECT_TRUE(scene) << scene.error();
  return *scene->sim;
}

// A boot stream of nothing: what a Falcon is booted with is its maker's.
std::string boot_stream_file() {
  std::string file = "/tmp/boot_stream";
  std::ofstream out(file, std::ios::binary);
  const auto word = [&out](unsigned value) {
    out.put(static_cast<char>(value & 0xFFU));
    out.put(static_cast<char>(value >> 8U));
  };
  word(0x08AA);
  for (int i = 0; i < 8; ++i) {
    word(0);
  }
  // Where it begins, one block of four words, and the end.
  for (const unsigned value : {0x3FU, 0x8000U, 4U, 0x3FU, 0x8000U, 1U, 2U, 3U, 4U, 0U}) {
    word(value);
  }
  return file;
}

void print(std::vector<WorldEvent> events, std::int64_t from_ns) {
  std::sort(events.begin(), events.end(),
            [](const WorldEvent& a, const WorldEvent& b) { return a.t_ns < b.t_ns; });
  for (const WorldEvent& event : events) {
    std::printf("%10.3f ms  %s\n", 1e-6 * static_cast<double>(event.t_ns - from_ns), event.what.c_str());
  }
}

double ms_until(const std::string& what, const std::vector<WorldEvent>& events, std::int64_t from_ns) {
  const auto found =
      std::find_if(events.begin(), events.end(), [&](const WorldEvent& event) { return event.what == what; });
  return found == events.end() ? 1e9 : 1e-6 * static_cast<double>(found->t_ns - from_ns);
}

class Injection : public testing::Test {
 protected:
  Injection() {
    EXPECT_TRUE(gate.is_there() && heartbeat.is_there());
    board.drive(kContactA, true);
    board.drive(kContactB, true);
    for (int node = 1; node <= WiredWorld::kAxes; ++node) {
      drives.add(emulator::DriveParams{.node = node});
    }
    EXPECT_EQ(drives.open("can1"), "");
    auto plugged = emulator::VhciPort::plug_in();
    EXPECT_TRUE(plugged) << plugged.error();
    port = std::make_unique<emulator::VhciPort>(std::move(*plugged));
    fs::create_directories(kReports);
    world.begin(clock.now_ns());
    wires = std::thread([this] { serve_wires(); });
    const sched_param priority{kWiresPriority};
    EXPECT_EQ(pthread_setschedparam(wires.native_handle(), SCHED_FIFO, &priority), 0);
    microscope = std::thread([this] { show_pictures(); });
    // The kernel asks the handle what it is before a program may open it.
    EXPECT_TRUE(wait_for([] { return fs::exists("/sys/bus/usb/devices/1-1/idVendor"); }, 5));
  }
  ~Injection() override {
    over = true;
    wires.join();
    microscope.join();
    (void)umount(kReports);
  }

  void serve_wires() {
    HandOnGrip hand(world);
    emulator::FalconEmulator falcon({}, hand);
    emulator::UsbIpDevice usb(falcon);
    std::int64_t next_ns = clock.now_ns();
    while (!over) {
      const std::int64_t now_ns = clock.now_ns();
      if (now_ns >= next_ns) {
        world.step(drives, now_ns);
        next_ns += 1'000'000;
      }
      const std::int64_t due_ns = std::min(next_ns, usb.next_ns(now_ns));
      if (!port->wait(std::max<std::int64_t>(0, due_ns - clock.now_ns()), drives.socket()) ||
          !port->talk(usb) || !drives.serve()) {
        ADD_FAILURE() << "a wire has come off: " << usb.problem();
        return;
      }
      world.look_at(drives, clock.now_ns());
    }
  }
  void show_pictures() {
    while (!over) {
      hal::Frame frame;
      if (camera.next(frame, 100'000'000) != hal::Status::ok) {
        continue;
      }
      const std::vector<std::uint8_t> pixels(frame.pixels, frame.pixels + camera.width() * camera.height());
      clock.sleep_until_ns(frame.exposure_ns + static_cast<std::int64_t>(kShown_s * 1e9));
      if (plugged_in) {
        picture.show(pixels);
      }
      camera.release(frame);
    }
  }

  // punctum run loopback, to its end: its exit status. The guest sees about four pictures a second.
  int run(const char* seconds, const std::function<void(const e2e::Running&)>& meanwhile) {
    e2e::Running program(
        {"run", "loopback", "--report", kReport, "--overwrite", "--no-frames", "--no-figure", "--seconds",
         seconds, "--set", "local_model.stale_after_s=1", "--set", "gpiod.chip=" + board.path(), "--set",
         "v4l2.path=" + picture.path(), "--set", "falcon.firmware=" + boot_stream_file()},
        "/tmp/words");
    meanwhile(program);
    const int status = program.wait();
    words = program.output() + e2e::read_all(fs::path(kReport) / "core.log") +
            e2e::read_all(fs::path(kReport) / "vision.log");
    report = nlohmann::json::parse(e2e::read_all(fs::path(kReport) / "report.json"), nullptr, false);
    return status;
  }
  // Waits for it, but not for ever.
  template <class Condition>
  bool wait_for(Condition holds, double at_most_s, std::int64_t look_every_ns = 1'000'000) {
    const std::int64_t until_ns = clock.now_ns() + static_cast<std::int64_t>(at_most_s * 1e9);
    while (!holds() && clock.now_ns() < until_ns) {
      clock.sleep_until_ns(clock.now_ns() + look_every_ns);
    }
    return holds();
  }
  [[nodiscard]] std::vector<WorldEvent> events_after(std::int64_t t_ns) const {
    std::vector<WorldEvent> events = world.events();
    std::erase_if(events, [t_ns](const WorldEvent& event) { return event.t_ns <= t_ns; });
    return events;
  }
  // Of the heartbeat, from now on.
  [[nodiscard]] int edges_until(std::int64_t until_ns) {
    int edges = 0;
    bool level = heartbeat.level();
    while (clock.now_ns() < until_ns) {
      clock.sleep_until_ns(clock.now_ns() + 250'000);
      const bool now = heartbeat.level();
      edges += now != level ? 1 : 0;
      level = now;
    }
    return edges;
  }
  [[nodiscard]] bool gate_is_open() { return gate.level(); }

  rt::MonotonicClock clock;
  GpioSim board;
  WatchedLevel gate{board.value_file(kGate)}, heartbeat{board.value_file(kHeartbeat)};
  CanInterface can0{"can0"}, can1{"can1"};
  sim::SimConfig config = simulated_world();
  std::unique_ptr<sim::Bench> bench = std::make_unique<sim::Bench>();
  std::unique_ptr<sim::CameraAnswers> answers = std::make_unique<sim::CameraAnswers>();
  WiredWorld world{config, bench.get()};
  sim::SimCamera camera{config, *bench, *answers};
  VividLoop picture{camera.width(), camera.height(), kFps};
  emulator::DriveBus drives;
  std::unique_ptr<emulator::VhciPort> port;
  std::atomic<bool> over{false}, plugged_in{true};  // the run, the camera
  std::thread wires, microscope;

  std::string words;
  nlohmann::json report;
};

TEST_F(Injection, injects_a_cell_through_four_drivers_without_a_missed_tick) {
  const std::int64_t began_ns = clock.now_ns();
  std::int64_t opened_ns = 0, shut_ns = 0;
  const int status = run("30", [&](const e2e::Running&) {
    constexpr std::int64_t kLook_ns =
        20'000'000;  // at the kernel's file, which takes the guest longer than a tick
    if (wait_for([&] { return gate_is_open(); }, 25, kLook_ns)) {
      opened_ns = clock.now_ns();
    }
    if (wait_for([&] { return !gate_is_open(); }, 5, kLook_ns)) {
      shut_ns = clock.now_ns();
    }
  });
  std::vector<WorldEvent> events = world.events();
  events.push_back({opened_ns, "the injector's gate opens"});
  events.push_back({shut_ns, "the injector's gate shuts"});
  print(events, began_ns);
  std::printf("%s\n", words.c_str());
  ASSERT_EQ(status, 0);
  ASSERT_TRUE(report.is_object());
  EXPECT_EQ(report["outcome"], "done");
  EXPECT_EQ(report["missed"], 0);
  EXPECT_EQ(report["allocations"], 0);
  EXPECT_GT(opened_ns, 0);

  const WiredWorld::Now end = world.now();
  EXPECT_TRUE(end.truth.punctured);
  EXPECT_TRUE(end.truth.held);
  EXPECT_FALSE(end.truth.lost);
  EXPECT_GT(end.truth.gap_m, 0) << "the needle is out again";
  EXPECT_EQ(end.force_N, 0) << "at the end nothing pushes the hand";
  EXPECT_GT(end.largest_force_N, 0.05) << "it felt the cell before";
  EXPECT_FALSE(end.powered);
  EXPECT_FALSE(gate_is_open());
}

TEST_F(Injection, is_stopped_by_a_contact_that_opens_while_it_injects) {
  std::int64_t stop_ns = 0, gate_ns = 0;
  int edges = 0;
  hal::Vec3 tip_m = hal::Vec3::Zero();
  const int status = run("27", [&](const e2e::Running& program) {
    ASSERT_TRUE(wait_for([&] { return gate_is_open() && world.now().force_N > 0; }, 25));
    stop_ns = clock.now_ns();
    board.drive(kContactA, false);
    board.drive(kContactB, false);
    ASSERT_TRUE(wait_for([&] { return !gate_is_open(); }, 1, 20'000));
    gate_ns = clock.now_ns();
    // The needle has braked by then.
    clock.sleep_until_ns(stop_ns + 50'000'000);
    tip_m = world.now().truth.tip_m;
    edges = edges_until(stop_ns + 100'000'000);
    program.send(SIGINT);
  });
  // Each output, and the ticks of a millisecond that it took.
  std::vector<WorldEvent> outputs = events_after(stop_ns);
  outputs.push_back({gate_ns, "the injector's gate is shut"});
  std::printf("after the contact opened:\n");
  print(outputs, stop_ns);
  std::printf("%s\n", words.c_str());
  EXPECT_EQ(status, 3) << "a fault";
  ASSERT_TRUE(report.is_object());
  EXPECT_EQ(report["missed"], 0);

  const auto ticks_until = [&](const std::string& what) { return ms_until(what, outputs, stop_ns); };
  // Within two ticks; a gate and a drive take what their wires take beyond that.
  EXPECT_LE(ticks_until("the injector's gate is shut"), 2.3);
  for (const char* drive :
       {"drive 1: quick stop active", "drive 2: quick stop active", "drive 3: quick stop active"}) {
    EXPECT_LE(ticks_until(drive), 2.3) << drive;
  }
  EXPECT_LE(ticks_until("the handle is without force"), 22);
  EXPECT_GT(edges, 20) << "the heartbeat goes on: the drives obey";
  const WiredWorld::Now end = world.now();
  EXPECT_FALSE(end.powered);
  EXPECT_EQ(end.force_N, 0);
  EXPECT_LT((end.truth.tip_m - tip_m).norm(), WiredWorld::kCount_m) << "nothing moves after the stop";
  EXPECT_FALSE(end.truth.lost);
}

// The camera is unplugged while the needle indents the cell, and nothing more fits on the disk. The hand goes
// on; the needle, which nobody sees, does not.
TEST_F(Injection, goes_no_deeper_without_its_camera_and_runs_on_when_the_disk_is_full) {
  constexpr double kStale_s = 1, kWatched_s = 2.5;
  // 12 um/s for the whole stale second from here, and the membranes (27 um) hold.
  constexpr double kUnplugged_m = 10e-6;
  struct Place {
    double t_s, needle_m, hand_m;  // since the camera has gone; towards the cell
  };
  ASSERT_EQ(mount("small", kReports, "tmpfs", 0, "size=4m"), 0);
  std::vector<Place> places;
  bool opened = false;
  std::int64_t gone_ns = 0;
  const int status = run("13", [&](const e2e::Running&) {
    ASSERT_TRUE(wait_for([&] { return world.now().truth.gap_m < -kUnplugged_m; }, 14));
    plugged_in = false;
    clock.sleep_until_ns(clock.now_ns() + 100'000'000);  // a picture may be on its way to the wire
    EXPECT_TRUE(picture.camera().set("Disconnect", 1));
    gone_ns = clock.now_ns();
    std::ofstream filler(fs::path(kReports) / "filler");
    const std::string block(4096, 'x');
    while (filler.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
    }
    for (double t_s = 0; t_s < kWatched_s; t_s = 1e-9 * static_cast<double>(clock.now_ns() - gone_ns)) {
      places.push_back({t_s, -world.now().truth.gap_m, -world.grip().position_m[0]});
      opened = opened || gate_is_open();
      clock.sleep_until_ns(clock.now_ns() + 20'000'000);
    }
    EXPECT_GT(edges_until(clock.now_ns() + 100'000'000), 20) << "no fault: the station waits for its camera";
  });
  ASSERT_FALSE(places.empty());
  const auto deepest = std::max_element(
      places.begin(), places.end(), [](const Place& a, const Place& b) { return a.needle_m < b.needle_m; });
  const auto stopped = std::find_if(places.begin(), places.end(), [&](const Place& place) {
    return place.needle_m > deepest->needle_m - 0.1e-6;
  });
  const auto farthest = std::max_element(stopped, places.end(),
                                         [](const Place& a, const Place& b) { return a.hand_m < b.hand_m; });
  const double hand_went_m = farthest->hand_m - stopped->hand_m;
  std::printf(
      "%s\nthe needle goes on by %.1f um, until %.2f s after the camera has gone; the hand then by %.1f mm\n",
      words.c_str(), 1e6 * (deepest->needle_m - places.front().needle_m), stopped->t_s, 1e3 * hand_went_m);
  EXPECT_EQ(status, 1) << "not done, and its report is not complete";
  ASSERT_TRUE(report.is_object());
  EXPECT_EQ(report["missed"], 0);
  EXPECT_NE(words.find("is not kept from here on"), std::string::npos);
  EXPECT_NE(words.find("looking for it"), std::string::npos);
  EXPECT_LT(stopped->t_s, kStale_s + 0.05);
  EXPECT_GT(hand_went_m, 1e-3) << "or nothing more was asked of the needle";
  EXPECT_FALSE(opened);
  const WiredWorld::Now end = world.now();
  EXPECT_FALSE(end.truth.punctured);
  EXPECT_FALSE(end.powered);
  EXPECT_EQ(end.force_N, 0);
}

// Nobody is left who could write anything: the relay hears no heartbeat, and the drives miss their master.
TEST_F(Injection, a_core_that_is_killed_in_motion_leaves_a_silent_heartbeat_and_drives_that_stop) {
  constexpr double kDrivesMissIt_ms = 60, kBraking_ms = 20;
  std::int64_t killed_ns = 0;
  int edges = 0;
  hal::Vec3 tip_m = hal::Vec3::Zero();
  const int status = run("30", [&](const e2e::Running& program) {
    const hal::Vec3 start_m = world.now().truth.tip_m;
    ASSERT_TRUE(wait_for([&] { return (world.now().truth.tip_m - start_m).norm() > 20e-6; }, 20));
    const pid_t core = e2e::child_named(program.pid(), "punctum-core");
    ASSERT_GT(core, 0);
    kill(core, SIGKILL);
    killed_ns = clock.now_ns();
    clock.sleep_until_ns(killed_ns + 2'000'000);
    edges = edges_until(killed_ns + 100'000'000);
    tip_m = world.now().truth.tip_m;
  });
  const std::vector<WorldEvent> events = events_after(killed_ns);
  std::printf("after the core was killed:\n");
  print(events, killed_ns);
  std::printf("%s\n", words.c_str());
  EXPECT_EQ(status, 3);
  ASSERT_TRUE(report.is_object());
  EXPECT_EQ(report["outcome"], "core died");
  EXPECT_LE(edges, 1) << "the kernel lets go of the line";
  for (const char* drive :
       {"drive 1: quick stop active", "drive 2: quick stop active", "drive 3: quick stop active"}) {
    EXPECT_LE(ms_until(drive, events, killed_ns), kDrivesMissIt_ms + kBraking_ms) << drive;
  }
  const WiredWorld::Now end = world.now();
  EXPECT_LT((end.truth.tip_m - tip_m).norm(), WiredWorld::kCount_m) << "nothing moves afterwards";
  EXPECT_FALSE(gate_is_open());
}

}  // namespace
}  // namespace punctum::loopback
