// When the injector's gate is open.
#include <gtest/gtest.h>

#include <cmath>

#include "rt/control/injection_gate.hpp"

namespace punctum::rt {
namespace {

struct Gate {
  explicit Gate(double max_open_s = 0.1) : gate(config_of(max_open_s)) {
    readings.hand_seen = true;
    in.injection_phase = in.may_inject = true;
  }
  static ServoConfig config_of(double max_open_s) {
    ServoConfig config;
    config.injector.emplace();
    config.injector->max_open_s = max_open_s;
    return config;
  }
  bool step(bool pressed) {
    readings.hand.buttons = pressed ? hal::kButtonInject : 0;
    return gate.step(readings, in, 1e-3);
  }
  Readings readings;
  GateInput in;
  InjectionGate gate;
};

TEST(InjectionGate, is_open_while_the_button_is_pressed_in_the_injection_phase) {
  Gate g;
  EXPECT_FALSE(g.step(false));
  for (int k = 0; k < 30; ++k) {
    EXPECT_TRUE(g.step(true));
  }
  EXPECT_FALSE(g.step(false));
  g.in.injection_phase = false;
  EXPECT_FALSE(g.step(true));
}

TEST(InjectionGate, opens_only_on_a_press_that_begins_where_an_injection_may_begin) {
  Gate g;
  g.in.may_inject = false;
  (void)g.step(false);
  EXPECT_FALSE(g.step(true));
  g.in.may_inject = true;
  EXPECT_FALSE(g.step(true));
  (void)g.step(false);
  EXPECT_TRUE(g.step(true));
}

TEST(InjectionGate, once_open_is_not_shut_at_once_but_by_a_stop_without_sight_or_by_the_end_of_the_phase) {
  for (const int cause : {0, 1, 2, 3, 4, 5}) {
    Gate g;
    (void)g.step(false);
    ASSERT_TRUE(g.step(true));
    g.in.stopped = cause == 0;
    g.in.vision_fresh = cause != 1;
    g.in.ending = cause == 2;
    g.in.may_inject = cause != 3;
    g.in.injection_phase = cause != 5;
    int open_ticks = 1;
    for (int k = 0; k < 100; ++k) {
      open_ticks += g.step(cause != 4) ? 1 : 0;
    }
    const bool at_once = cause < 2 || cause == 5;
    EXPECT_EQ(open_ticks, at_once ? 1 : std::lround(InjectionGate::kShortest_s / 1e-3)) << cause;
    // Not a second time by itself.
    g.in = GateInput{.injection_phase = true, .may_inject = true};
    if (cause != 4) {
      EXPECT_FALSE(g.step(true)) << cause;
    }
  }
}

TEST(InjectionGate, stays_open_between_two_samples_of_a_slow_hand) {
  Gate g;
  (void)g.step(false);
  int edges = 0;
  bool was = false;
  for (int k = 0; k < 90; ++k) {
    g.readings.hand_age_s = k % 10 * 1e-3;
    const bool open = g.step(true);
    edges += open != was ? 1 : 0;
    was = open;
  }
  EXPECT_EQ(edges, 1);
}

TEST(InjectionGate, stays_shut_for_a_button_that_was_never_up) {
  Gate g;
  EXPECT_FALSE(g.step(true));
  EXPECT_FALSE(g.step(true));
  (void)g.step(false);
  EXPECT_TRUE(g.step(true));
}

TEST(InjectionGate, waits_for_a_new_press_after_a_stop_and_after_a_stale_observation) {
  for (const bool stop : {true, false}) {
    Gate g;
    (void)g.step(false);
    ASSERT_TRUE(g.step(true));
    (stop ? g.in.stopped : g.in.vision_fresh) = stop;
    EXPECT_FALSE(g.step(true));
    g.in = GateInput{.injection_phase = true, .may_inject = true};
    EXPECT_FALSE(g.step(true));
    (void)g.step(false);
    EXPECT_TRUE(g.step(true));
  }
}

TEST(InjectionGate, is_shut_without_a_fresh_hand_and_at_the_end_of_the_run) {
  Gate g;
  (void)g.step(false);
  g.readings.hand_age_s = 0.1;
  EXPECT_FALSE(g.step(true));
  g.readings.hand_age_s = 0;
  EXPECT_FALSE(g.step(true));  // who knows what she did meanwhile
  (void)g.step(false);
  for (int k = 0; k < 30; ++k) {
    EXPECT_TRUE(g.step(true));
  }
  g.in.ending = true;
  EXPECT_FALSE(g.step(true));
}

TEST(InjectionGate, opens_for_its_bounded_time_in_each_cell) {
  Gate g(0.1);
  (void)g.step(false);
  int open_ticks = 0;
  for (int k = 0; k < 300; ++k) {
    open_ticks += g.step(k % 50 != 49) ? 1 : 0;
  }
  EXPECT_EQ(open_ticks, 100);
  g.in.new_cell = true;
  EXPECT_TRUE(g.step(true));
}

TEST(InjectionGate, never_opens_in_a_scene_without_an_injector) {
  InjectionGate gate{ServoConfig{}};
  Readings readings;
  readings.hand_seen = true;
  const GateInput in{.injection_phase = true, .may_inject = true};
  (void)gate.step(readings, in, 1e-3);
  readings.hand.buttons = hal::kButtonInject;
  EXPECT_FALSE(gate.step(readings, in, 1e-3));
}

}  // namespace
}  // namespace punctum::rt
