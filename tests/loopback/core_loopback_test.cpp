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

}  // namespace
}  // namespace punctum::loopback
