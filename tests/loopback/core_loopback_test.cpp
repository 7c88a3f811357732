// The whole core at 1 kHz, on the simulated handle and stage and a real GPIO chip.
#include "tests/loopback/core_run.hpp"

namespace punctum::loopback {
namespace {

using rt::Fault;
using rt::StopStage;

using CoreLoopback = CoreRun;

TEST_F(CoreLoopback, misses_no_tick_and_beats_on_each) {
  int same = 0, samples = 0;
  run(1000, [&] {
    bool before = false;
    for (int i = 0; i < 500; ++i) {
      at(100.9 + i);
      const bool level = board->level(kHeartbeat);
      same += i > 0 && level == before ? 1 : 0;
      before = level;
      ++samples;
    }
  });
  EXPECT_EQ(missed, 0U);
  ASSERT_EQ(seen.size(), 1000U);
  EXPECT_EQ(seen.back().fault, Fault::none);
  EXPECT_EQ(samples, 500);
  EXPECT_EQ(same, 0);
}

TEST_F(CoreLoopback, stops_within_two_ticks_of_an_opened_contact_wherever_in_the_tick_it_opens) {
  const std::vector<double> openings_ms = {50.02, 250.15, 450.5, 650.85, 850.98};
  std::vector<std::int64_t> opened_ns;
  run(1050, [&] {
    int turn = 0;
    for (const double t_ms : openings_ms) {
      const int contact = turn++ % 2 == 0 ? kContactA : kContactB;
      at(t_ms);
      board->drive(contact, false);
      opened_ns.push_back(clock.now_ns());
      at(t_ms + 20);
      board->drive(contact, true);
      press_reset(t_ms + 60, t_ms + 120);
    }
  });
  ASSERT_EQ(opened_ns.size(), openings_ms.size());
  for (std::size_t i = 0; i < opened_ns.size(); ++i) {
    EXPECT_EQ(at_ms(openings_ms[i] - 5).stage, StopStage::running) << i;
    EXPECT_LE(ticks_to_stop(opened_ns[i]), 2U) << i;
    EXPECT_EQ(at_ms(openings_ms[i] + 5).fault, Fault::estop) << i;
  }
  EXPECT_EQ(missed, 0U);
}

TEST_F(CoreLoopback, stops_for_a_pulse_that_no_tick_sees_as_a_level) {
  std::int64_t pulse_ns = 0;
  run(150, [&] {
    at(50.6);
    board->drive(kContactA, false);
    board->drive(kContactA, true);
    pulse_ns = clock.now_ns();
  });
  for (const Seen& s : seen) {
    EXPECT_EQ(s.contacts & 3, 0) << s.tick;
  }
  EXPECT_LE(ticks_to_stop(pulse_ns), 2U);
  EXPECT_EQ(seen.back().fault, Fault::estop);
  EXPECT_NE(seen.back().stage, StopStage::running);
}

TEST_F(CoreLoopback, goes_on_only_after_contacts_are_closed_and_reset_is_pressed) {
  run(800, [&] {
    at(50);
    board->drive(kContactA, false);
    board->drive(kContactB, false);
    press_reset(150, 250);  // while the contacts are open
    at(300);
    board->drive(kContactA, true);
    board->drive(kContactB, true);
    press_reset(450.3, 455.3);  // too short for a finger
    press_reset(600, 700);
  });
  EXPECT_EQ(at_ms(260).stage, StopStage::stopped);
  EXPECT_EQ(at_ms(440).stage, StopStage::stopped);
  EXPECT_EQ(at_ms(590).stage, StopStage::stopped);
  EXPECT_EQ(at_ms(799).stage, StopStage::running);
  EXPECT_EQ(at_ms(799).fault, Fault::none);
  EXPECT_EQ(missed, 0U);
}

TEST_F(CoreLoopback, is_not_reset_while_one_contact_has_not_shown_that_it_opens) {
  run(900, [&] {
    at(50);
    board->drive(kContactB, false);  // contact a is welded
    at(150);
    board->drive(kContactB, true);
    press_reset(250, 350);
    at(450);
    board->drive(kContactA, false);
    board->drive(kContactB, false);
    at(500);
    board->drive(kContactA, true);
    board->drive(kContactB, true);
    press_reset(600, 700);
  });
  EXPECT_EQ(at_ms(60).stage == StopStage::running, false);
  EXPECT_EQ(at_ms(440).stage, StopStage::stopped);
  EXPECT_EQ(at_ms(899).stage, StopStage::running);
}

TEST_F(CoreLoopback, stops_within_two_ticks_of_a_chip_that_is_gone_and_stays_stopped) {
  std::int64_t gone_ns = 0;
  run(700, [&] {
    at(50.4);
    board->unplug();
    gone_ns = clock.now_ns();
  });
  EXPECT_LE(ticks_to_stop(gone_ns), 2U);
  EXPECT_EQ(at_ms(50).fault, Fault::none);
  EXPECT_EQ(seen.back().fault, Fault::estop_lost);
  EXPECT_EQ(seen.back().stage, StopStage::stopped);
}

// With an enabling switch, an enable line and the holding vacuum on the chip too.
class WholeBoard : public CoreRun {
 protected:
  WholeBoard()
      : CoreRun([](tools::Scene& s) {
          s.devices.enabling = tools::kGpiod;
          s.devices.vacuum = tools::kGpiod;
          s.servo.enabling.emplace();
          s.servo.vacuum.emplace().min_Pa = 1000;
          s.servo.vacuum->still_s = 0;
          s.gpiod->enabling_a = kEnablingA;
          s.gpiod->enabling_b = kEnablingB;
          s.gpiod->enable = kEnable;
          s.gpiod->vacuum_gate = kVacuumGate;
          s.gpiod->vacuum_switch = kVacuumSwitch;
          s.gpiod->vacuum_switch_Pa = 20'000;
        }) {
    board->drive(kVacuumSwitch, true);
  }
  void hold(bool a, bool b) {
    board->drive(kEnablingA, a);
    board->drive(kEnablingB, b);
  }
  // Until then: the level of the enable line, after each tick.
  void watch_until(double to_ms) {
    for (; watched_ms < to_ms; watched_ms += 1) {
      at(watched_ms + 0.9);
      enable.push_back(board->level(kEnable));
      held = held && board->level(kVacuumGate);
    }
  }
  double watched_ms = 0;
  std::vector<bool> enable;
  bool held = true;
};

TEST_F(WholeBoard, enables_its_drives_while_the_switch_is_held_and_until_they_stand_after_it_was_let_go) {
  run(1200, [&] {
    watch_until(100);
    hold(true, true);
    watch_until(500);
    hold(false, false);
    watch_until(800);
    hold(true, true);
    watch_until(1199);
  });
  EXPECT_EQ(missed, 0U);
  EXPECT_TRUE(held) << "the vacuum";
  EXPECT_EQ(at_ms(499).fault, Fault::none);
  EXPECT_EQ(at_ms(560).fault, Fault::enabling_released);
  EXPECT_EQ(at_ms(1190).fault, Fault::none);
  int braking = 0;
  for (std::size_t k = 0; k < enable.size(); ++k) {
    const bool pressed = (k >= 125 && k < 800) || k >= 825;
    const bool waits = k >= 100 && k < 125;  // until the press has lasted
    if (!waits && !(k >= 800 && k < 825)) {
      EXPECT_EQ(enable[k], pressed && seen[k].stage != StopStage::stopped) << k;
    }
    braking += enable[k] && seen[k].stage == StopStage::stopping ? 1 : 0;
  }
  EXPECT_GE(braking, 10) << "it brakes under power";
}

TEST_F(WholeBoard,
       holds_when_one_contact_of_the_switch_opens_and_is_not_pressed_on_while_the_other_never_did) {
  run(1000, [&] {
    at(100);
    hold(true, true);
    at(300);
    hold(true, false);  // contact a is welded
    at(500);
    hold(true, true);
    press_reset(600, 700);
    at(750);
    hold(false, false);
    press_reset(800, 850);
    at(900);
    hold(true, true);
  });
  EXPECT_EQ(at_ms(299).stage, StopStage::running);
  EXPECT_EQ(at_ms(330).fault, Fault::enabling_released);
  EXPECT_EQ(at_ms(599).stage, StopStage::stopped) << "a press alone";
  EXPECT_EQ(at_ms(740).stage, StopStage::stopped) << "the reset button, contact a never opened";
  EXPECT_EQ(at_ms(860).stage, StopStage::running);
  EXPECT_NE(
      station->station.core.status.faults_latched.load() >> static_cast<int>(Fault::enabling_fault) & 1U, 0U);
  EXPECT_EQ(at_ms(999).fault, Fault::none);
  EXPECT_TRUE(board->level(kEnable));
  assembly.reset();
  EXPECT_FALSE(board->level(kEnable));
}

TEST_F(WholeBoard, stops_when_the_vacuum_switch_opens_and_leaves_the_valve_holding) {
  run(600, [&] {
    at(300);
    board->drive(kVacuumSwitch, false);
    watched_ms = 300;
    watch_until(599);
  });
  EXPECT_EQ(at_ms(299).fault, Fault::none);
  EXPECT_EQ(at_ms(450).fault, Fault::vacuum_lost);
  EXPECT_TRUE(held);
  board->drive(kVacuumGate, true);
  assembly.reset();
  EXPECT_TRUE(board->level(kVacuumGate));
}

}  // namespace
}  // namespace punctum::loopback
