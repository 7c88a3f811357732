// The stop chain from wire to wire: a contact opens on a GPIO chip; the heartbeat's line falls silent, and
// quick stops go out on a CAN bus to three drives. The core between them runs at 1 kHz.
#include <algorithm>
#include <array>
#include <cstdio>

#include "tests/loopback/can_wires.hpp"
#include "tests/loopback/core_run.hpp"

namespace punctum::loopback {
namespace {

using emulator::DriveState;

// Where the delays of many stops lie, a line for every tenth of a tick.
void print_histogram(const char* title, std::vector<std::int64_t> delays_ns) {
  std::sort(delays_ns.begin(), delays_ns.end());
  const auto us = [](std::int64_t ns) { return static_cast<long>(ns / 1000); };
  std::printf("%s: %zu stops, p50 %ld us, largest %ld us\n", title, delays_ns.size(),
              us(delays_ns[delays_ns.size() / 2]), us(delays_ns.back()));
  constexpr std::int64_t kBin_ns = kPeriod_ns / 10;
  for (std::int64_t from_ns = delays_ns.front() / kBin_ns * kBin_ns; from_ns <= delays_ns.back();
       from_ns += kBin_ns) {
    const auto in_bin = std::count_if(delays_ns.begin(), delays_ns.end(), [from_ns](std::int64_t d) {
      return d >= from_ns && d < from_ns + kBin_ns;
    });
    std::printf("  from %5ld us %3ld %s\n", us(from_ns), static_cast<long>(in_bin),
                std::string(static_cast<std::size_t>(in_bin), '#').c_str());
  }
}

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
      board->drive(kContactA, false);
      board->drive(kContactB, false);
      opened_ns.push_back(clock.now_ns());
      stopped_ns.push_back(delay_until([&] { return every_drive(DriveState::quick_stop_active); }));
      off_ns.push_back(delay_until([&] { return every_drive(DriveState::switch_on_disabled); }) +
                       stopped_ns.back());
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
  print_histogram("from the opened contact to the last of three drives in its quick stop", stopped_ns);
  print_histogram("from the opened contact to the last of three drives without power", off_ns);
  EXPECT_GT(*std::min_element(stopped_ns.begin(), stopped_ns.end()), 0);
  EXPECT_LE(*std::max_element(stopped_ns.begin(), stopped_ns.end()), 2 * kPeriod_ns + kPeriod_ns / 4);
}

TEST_F(StopChain, the_heartbeat_ends_when_a_drive_neither_stops_nor_lets_go_of_its_power) {
  std::int64_t opened_ns = 0, last_beat_ns = 0;
  run(1100, [&] {
    at(300.5);
    EXPECT_TRUE(every_drive(DriveState::operation_enabled));
    for (const char* habit : {"ignore quick-stop", "ignore disable"}) {
      EXPECT_EQ(drives.with(1, [habit](emulator::Drive& d) { return d.command(habit); }), "");
    }
    Watched beat(board->value_file(kHeartbeat));
    board->drive(kContactA, false);
    board->drive(kContactB, false);
    opened_ns = clock.now_ns();
    bool level = beat.level();
    for (double t_ms = 300.9; t_ms < 1080; t_ms += 0.9) {
      at(t_ms);
      if (beat.level() != level) {
        level = !level;
        last_beat_ns = clock.now_ns();
      }
    }
  });
  EXPECT_EQ(missed, 0U);
  EXPECT_LE(ticks_to_stop(opened_ns), 2U);
  const double after_ms = 1e-6 * static_cast<double>(last_beat_ns - opened_ns);
  std::printf(
      "a drive that does not obey: from the opened contact to the last edge of the heartbeat %.1f ms\n",
      after_ms);
  EXPECT_GT(after_ms, 2);
  EXPECT_LE(after_ms, 1e3 * (scene.servo.estop.power_off_after_s + 0.02));
}

}  // namespace
}  // namespace punctum::loopback
