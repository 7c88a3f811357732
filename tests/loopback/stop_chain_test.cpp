// The stop chain from wire to wire: a contact opens on a GPIO chip; the heartbeat's line falls silent, and
// quick stops go out on a CAN bus to three drives. The core between them runs at 1 kHz.
#include <algorithm>
#include <array>
#include <cstdio>

#include "tests/loopback/can_wires.hpp"
#include "tests/loopback/core_run.hpp"
#include "tests/loopback/histogram.hpp"

namespace punctum::loopback {
namespace {

using emulator::DriveState;

void put_stage_on_can(tools::Scene& scene) {
  scene.devices.stage = tools::kCia402;
  scene.cia402 = three_drives();
}

// What must be there before the stage is opened.
struct DrivesOnCan {
  CanInterface can0{"can0"}, can1{"can1"};
  DrivesOnBus drives{"can1", 3};
};

class StopChain : protected DrivesOnCan, public CoreRun {
 protected:
  static constexpr std::int64_t kBin_ns = kPeriod_ns / 10;
  static constexpr int kStops = 40;
  static constexpr double kFirst_ms = 300,
                          kApart_ms = 150;  // a stop, its reset, and the drives enabled again

  StopChain() : CoreRun(put_stage_on_can) {}

  [[nodiscard]] bool every_drive(DriveState state) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (drives.with(i, [](emulator::Drive& d) { return d.state(); }) != state) {
        return false;
      }
    }
    return true;
  }
  // How long it takes, and half a second at most.
  template <class Condition>
  [[nodiscard]] std::int64_t delay_until(Condition holds) {
    const std::int64_t from_ns = clock.now_ns();
    std::int64_t now_ns = from_ns;
    while (!holds() && now_ns < from_ns + 500 * kPeriod_ns) {
      clock.sleep_until_ns(now_ns + 50'000);
      now_ns = clock.now_ns();
    }
    return now_ns - from_ns;
  }
};

TEST_F(StopChain, an_opened_contact_stops_three_drives_within_two_ticks_wherever_in_the_tick_it_opens) {
  std::vector<std::int64_t> opened_ns, stopped_ns, off_ns;
  int enabled = 0;
  run(static_cast<std::uint64_t>(kFirst_ms + kStops * kApart_ms), [&] {
    for (int stop = 0; stop < kStops; ++stop) {
      const double t_ms = kFirst_ms + stop * kApart_ms + static_cast<double>(stop) / kStops;
      at(t_ms);
      enabled += every_drive(DriveState::operation_enabled) ? 1 : 0;
      opened_ns.push_back(clock.now_ns());
      board->drive(kContactA, false);
      board->drive(kContactB, false);
      (void)delay_until([&] { return every_drive(DriveState::quick_stop_active); });
      stopped_ns.push_back(clock.now_ns() - opened_ns.back());
      (void)delay_until([&] { return every_drive(DriveState::switch_on_disabled); });
      off_ns.push_back(clock.now_ns() - opened_ns.back());
      board->drive(kContactA, true);
      board->drive(kContactB, true);
      press_reset(t_ms + 30, t_ms + 60);
    }
  });
  EXPECT_EQ(enabled, kStops) << "the drives followed before each stop";
  EXPECT_EQ(missed, 0U);
  for (const std::int64_t from_ns : opened_ns) {
    EXPECT_LE(ticks_to_stop(from_ns), 2U);
  }
  print_histogram("from the opened contact to the last of three drives in its quick stop", stopped_ns,
                  kBin_ns);
  print_histogram("from the opened contact to the last of three drives without power", off_ns, kBin_ns);
  EXPECT_GT(*std::min_element(stopped_ns.begin(), stopped_ns.end()), 0);
  EXPECT_LE(*std::max_element(stopped_ns.begin(), stopped_ns.end()), 2 * kPeriod_ns + kPeriod_ns / 4);
}

TEST_F(StopChain, the_heartbeat_ends_when_a_drive_neither_stops_nor_lets_go_of_its_power) {
  constexpr int kDisobeyed = 8;
  constexpr double kEach_ms = 1500;  // a stop, what the drive does to it, its reset
  std::vector<std::int64_t> opened_ns, silent_ns;
  int enabled = 0;
  run(static_cast<std::uint64_t>(kFirst_ms + kDisobeyed * kEach_ms), [&] {
    for (int stop = 0; stop < kDisobeyed; ++stop) {
      const double t_ms = kFirst_ms + stop * kEach_ms + static_cast<double>(stop) / kDisobeyed;
      at(t_ms);
      enabled += every_drive(DriveState::operation_enabled) ? 1 : 0;
      for (const char* habit : {"ignore quick-stop", "ignore disable"}) {
        EXPECT_EQ(drives.with(1, [habit](emulator::Drive& d) { return d.command(habit); }), "");
      }
      emulator::WatchedLevel beat(board->value_file(kHeartbeat));
      opened_ns.push_back(clock.now_ns());
      board->drive(kContactA, false);
      board->drive(kContactB, false);
      bool level = beat.level();
      std::int64_t last_beat_ns = 0;
      for (double after_ms = 0.4; after_ms < 800; after_ms += 0.9) {
        at(t_ms + after_ms);
        if (beat.level() != level) {
          level = !level;
          last_beat_ns = clock.now_ns();
        }
      }
      silent_ns.push_back(last_beat_ns - opened_ns.back());
      EXPECT_EQ(drives.with(1, [](emulator::Drive& d) { return d.command("obey"); }), "");
      board->drive(kContactA, true);
      board->drive(kContactB, true);
      press_reset(t_ms + 1200, t_ms + 1250);
    }
  });
  EXPECT_EQ(enabled, kDisobeyed) << "the drives followed before each stop";
  EXPECT_EQ(missed, 0U);
  for (const std::int64_t from_ns : opened_ns) {
    EXPECT_LE(ticks_to_stop(from_ns), 2U);
  }
  print_histogram("a drive that does not obey: from the opened contact to the last edge of the heartbeat",
                  silent_ns, kPeriod_ns);
  EXPECT_GT(*std::min_element(silent_ns.begin(), silent_ns.end()), 2 * kPeriod_ns);
  EXPECT_LE(1e-9 * static_cast<double>(*std::max_element(silent_ns.begin(), silent_ns.end())),
            scene.servo.estop.power_off_after_s + 0.02);
}

}  // namespace
}  // namespace punctum::loopback
