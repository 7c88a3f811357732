// Whole injections: phases, cells, the injector's gate, and how a run ends.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/servo_bench.hpp"

namespace punctum::rt {
namespace {

using namespace test;
using enum Phase;

TEST(Servo, takes_a_needle_through_a_whole_injection) {
  for (const double rate : {1000.0, 4000.0}) {
    ServoConfig config = icsi();
    config.rate_Hz = rate;
    Bench b(config);
    double peak = 0, deepest = 0;
    b.every_tick = [&] {
      peak = std::max(peak, b.force());
      deepest = std::max(deepest, -b.gap());
      // The reported parts are the parts of what goes to the hand; the rim's vectors sum to the membrane's.
      const TelemetrySample& s = b.sample();
      Vec3 rim = Vec3::Zero();
      for (const auto& f : s.contact_force_N) {
        rim += Vec3(f[0], f[1], f[2]);
      }
      ASSERT_NEAR(rim.norm(), s.effect_N[effect_membrane], 1e-9);
      ASSERT_LE(b.force(), s.effect_N[effect_membrane] + s.effect_N[effect_cone] + s.effect_N[effect_axis] +
                               s.effect_N[effect_damping] + 1e-9);
    };
    b.to_inside();
    b.move(b.wanted_x - 20e-6, 20e-6);
    b.hold(hal::kButtonInject, 1);
    EXPECT_TRUE(b.injector.open);
    b.hold(0, 0.1);
    EXPECT_FALSE(b.injector.open);
    b.move(60e-6, 40e-6);
    b.run(1);
    EXPECT_EQ(b.order, (std::vector{free, contact, indentation, puncture, injection, withdrawal, clear}));
    EXPECT_EQ(b.servo->outcome(), RunEnd::done);
    EXPECT_EQ(b.force(), 0);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    EXPECT_EQ(b.servo->cells_done(), 1U);
    EXPECT_EQ(b.station->core.status.task_finished.load(), 1U);
    EXPECT_GT(peak, 0.05);
    EXPECT_LT(peak, 2.0);
    EXPECT_LT(deepest, config.limits.penetration_depth_m);
    EXPECT_EQ(b.estop.toggles, static_cast<int>(b.ticks));
    std::printf("%.0f Hz: peak %.2f N, depth %.1f um, injected energy %.2e J\n", rate, peak, 1e6 * deepest,
                b.sample().injected_energy_J);
  }
}

TEST(Servo, does_not_call_a_cell_done_that_got_nothing) {
  for (const bool pressed : {false, true}) {  // pressed: the gate is told to open, but the injector does not
    Bench b(icsi());
    b.injector.jammed = true;
    b.to_inside();
    if (pressed) {
      b.hand.buttons = hal::kButtonInject;
    }
    b.run(0.5);
    b.hand.buttons = 0;
    b.move(60e-6, 40e-6);
    b.run(1);
    EXPECT_EQ(b.servo->phase(), Phase::clear);
    EXPECT_EQ(b.servo->outcome(), RunEnd::stopped);
    EXPECT_EQ(b.station->core.status.task_finished.load(), 0U);
  }
}

TEST(Servo, takes_the_next_cell_with_a_fresh_model) {
  ServoConfig config = icsi();
  config.cells = 2;
  Bench b(config);
  const auto inject = [&] {
    b.to_inside();
    b.hold(hal::kButtonInject, 0.3);
    b.hand.buttons = 0;
    b.move(60e-6, 40e-6);
    b.run(0.5);
    ASSERT_EQ(b.servo->phase(), clear);
  };
  inject();
  EXPECT_FALSE(b.servo->finished());
  EXPECT_EQ(b.servo->cells_done(), 1U);
  b.centre = Vec3(-44e-6, 3e-6, 0);
  b.R = 64e-6;
  b.hold(hal::kButtonNextCell, 0.02);
  EXPECT_EQ(b.servo->phase(), clear);
  b.run(0.003);
  EXPECT_EQ(b.servo->phase(), free);
  EXPECT_EQ(b.sample().cell, 1U);
  EXPECT_EQ(b.sample().R_m, 0);
  b.hold(0, 0.5);
  EXPECT_NEAR(b.sample().R_m, 64e-6, 0.1e-6);
  inject();
  EXPECT_EQ(b.servo->outcome(), RunEnd::done);
  EXPECT_EQ(b.sample().cell, 1U);
  EXPECT_EQ(b.order, (std::vector{free, contact, indentation, puncture, injection, withdrawal, clear, free,
                                  contact, indentation, puncture, injection, withdrawal, clear}));
}

TEST(Servo, clamps_the_injection) {
  ServoConfig config = icsi();
  config.injector->max_open_s = 0.25;
  Bench b(config);
  b.to_inside();
  b.hold(hal::kButtonInject, 2);
  EXPECT_EQ(b.injector.open_ticks, 250);
  EXPECT_FALSE(b.injector.open);
  // Pressing again does not open it again for this cell.
  b.hold(0, 0.1);
  b.hold(hal::kButtonInject, 1);
  EXPECT_EQ(b.injector.open_ticks, 250);
}

TEST(Servo, does_not_open_the_injector_again_after_a_stop_while_the_button_is_still_held) {
  Bench b(icsi());
  b.to_inside();
  b.hold(hal::kButtonInject, 0.2);
  ASSERT_TRUE(b.injector.open);
  b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = false;
  b.run(1);
  b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = true;
  b.run(0.1);
  b.estop.state.reset_pressed = true;
  const int open_ticks = b.injector.open_ticks;
  b.run(1);
  ASSERT_EQ(b.servo->stop_stage(), StopStage::running);
  ASSERT_EQ(b.servo->phase(), injection);
  EXPECT_EQ(b.injector.open_ticks, open_ticks);
  b.hold(0, 0.1);
  b.hold(hal::kButtonInject, 0.1);
  EXPECT_TRUE(b.injector.open);
}

TEST(Servo, shuts_the_gate_while_vision_is_silent_and_waits_for_a_new_press) {
  Bench b(icsi());
  b.to_inside();
  b.hold(hal::kButtonInject, 0.3);
  ASSERT_TRUE(b.injector.open);
  b.seeing = false;
  b.run(0.5);
  EXPECT_FALSE(b.injector.open);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  b.seeing = true;
  b.run(1);
  EXPECT_FALSE(b.injector.open);  // still held down
  b.hold(0, 0.05);
  b.hold(hal::kButtonInject, 0.05);
  EXPECT_TRUE(b.injector.open);
}

TEST(Servo, ends_by_command_only_when_the_needle_is_out_of_the_cell) {
  for (const bool here : {false, true}) {
    Bench b(icsi());
    b.to_inside();
    ASSERT_TRUE(b.station->parent.queue.try_push({Command::end, 0}));
    b.run(0.5);
    EXPECT_EQ(b.servo->outcome(), RunEnd::running);
    EXPECT_GT(b.force(), 0);
    // Not deeper, and nothing is injected; back it goes.
    b.hand.buttons = hal::kButtonInject;
    const double depth = -b.gap();
    b.move(b.wanted_x - 10e-6, 20e-6);
    b.run(0.3);
    EXPECT_LT(-b.gap(), depth + 0.3e-6);
    EXPECT_FALSE(b.injector.open);
    if (here) {
      b.servo->request_end_here();
    } else {
      b.move(60e-6, 40e-6);
    }
    b.run(0.5);
    EXPECT_EQ(b.servo->outcome(), RunEnd::stopped);
    EXPECT_EQ(b.force(), 0);
    EXPECT_EQ(-b.gap() > 0, here);
  }
}

TEST(Servo, checks_the_range_of_commands) {
  Bench b(icsi());
  b.to_indentation();
  b.run(1);
  const double full = b.effect_N(effect_membrane);
  for (const double bad : {-0.1, 1.1, 1e300, std::nan(""), -std::numeric_limits<double>::infinity()}) {
    ASSERT_TRUE(b.station->parent.queue.try_push({Command::force_scale, bad}));
  }
  ASSERT_TRUE(b.station->parent.queue.try_push({77, 0}));
  b.run(0.5);
  EXPECT_EQ(b.station->core.status.commands_refused.load(), 6U);
  EXPECT_NEAR(b.effect_N(effect_membrane), full, 0.02 * full);
  ASSERT_TRUE(b.station->parent.queue.try_push({Command::force_scale, 0.0}));
  b.run(1);
  EXPECT_EQ(b.effect_N(effect_membrane), 0);
  ASSERT_TRUE(b.station->parent.queue.try_push({Command::end, 0}));
  b.run(0.5);
  EXPECT_EQ(b.servo->outcome(), RunEnd::running);  // the needle dents a cell
  b.move(60e-6, 40e-6);
  b.run(0.5);
  EXPECT_EQ(b.servo->outcome(), RunEnd::stopped);
  EXPECT_EQ(b.force(), 0);
}

TEST(Servo, in_a_scene_without_a_cell_only_damps) {
  ServoConfig config;
  config.phases.reset();
  config.local_model.reset();
  config.vision = false;
  config.damping.emplace();
  Bench b(config);
  b.run(0.5);
  b.every_tick = [&] {
    const TelemetrySample& s = b.sample();
    const Vec3 v(s.v_m_s[0], s.v_m_s[1], s.v_m_s[2]);
    ASSERT_LT((b.hand.force + 1.0 * v).norm(), 1e-12);
    ASSERT_EQ(s.phase, free);
    ASSERT_EQ(s.alarms, 0U);
    ASSERT_EQ(s.obs_age_s, -1);
  };
  b.move(-200e-6, 50e-6);
  b.move(60e-6, 50e-6);
  b.run(0.5);
  EXPECT_NEAR(b.stage.tip.x(), 60e-6, 0.2e-6);
  EXPECT_FALSE(b.servo->finished());
}

TEST(Servo, works_without_stage_and_without_estop_chain) {
  ServoConfig config;
  config.phases.reset();
  config.local_model.reset();
  config.vision = false;
  config.damping.emplace();
  FakeHand hand;
  auto station = std::make_unique<LocalStation>();
  auto servo = std::make_unique<Servo>(config, Devices{hand}, station->station);
  std::int64_t now = 0;
  for (std::uint64_t k = 0; k < 1000; ++k) {
    now += 1'000'000;
    hand.now_ns = now;
    hand.intention.x() = 0.01 * std::sin(0.01 * static_cast<double>(k));
    hand.step(1e-3);
    servo->tick({k, now, now, 1e-3, 0});
  }
  EXPECT_GT(hand.force.norm(), 0);
  servo->request_stop();
  for (std::uint64_t k = 1000; k < 1600; ++k) {
    now += 1'000'000;
    hand.now_ns = now;
    servo->tick({k, now, now, 1e-3, 0});
  }
  EXPECT_EQ(servo->outcome(), RunEnd::fault);
  EXPECT_EQ(hand.force.norm(), 0);
}

TEST(Servo, does_not_take_one_frame_for_a_puncture) {
  for (const double at_m : {2.7e-6, 6e-6}) {
    Bench b(icsi());
    b.puncture_at = 1;
    bool once = false;
    b.lie = [&](Observation& o) {
      if (!once && -o.gap_m > at_m) {
        o.flags |= Observation::punctured;
        o.wd_m = 0;
        once = true;
      }
    };
    b.run(1);
    b.move(60e-6 - 45e-6 - at_m, 15e-6);
    b.run(1);
    EXPECT_TRUE(once);
    EXPECT_TRUE(b.order.back() == contact || b.order.back() == indentation);
    EXPECT_GT(b.effect_N(effect_membrane), 0);
  }
}

TEST(Servo, takes_no_flag_for_a_puncture_while_the_membrane_lies_on_the_tip) {
  Bench b(icsi());
  b.puncture_at = 1;
  b.lie = [](Observation& o) { o.flags |= Observation::punctured; };
  b.to_indentation();
  b.run(2);
  EXPECT_EQ(b.servo->phase(), indentation);
  EXPECT_GT(b.effect_N(effect_membrane), 0);
}

TEST(Servo, survives_a_puncture_that_vision_takes_back) {
  Bench b(icsi());
  bool lying = false;
  b.lie = [&](Observation& o) {
    if (lying) {
      o.flags |= Observation::punctured;
      o.wd_m = 0;
    }
  };
  b.to_indentation();
  lying = true;
  b.run(0.5);
  ASSERT_EQ(b.servo->phase(), puncture);
  lying = false;
  b.run(0.5);
  b.hold(hal::kButtonInject, 0.5);
  EXPECT_EQ(b.injector.open_ticks, 0);
  b.move(60e-6, 30e-6);
  b.run(0.5);
  EXPECT_EQ(b.injector.open_ticks, 0);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  EXPECT_EQ(b.servo->phase(), clear);
  EXPECT_EQ(b.servo->outcome(), RunEnd::stopped);  // nothing was injected
}

TEST(Servo, opens_the_gate_only_on_a_press_that_begins_inside) {
  Bench b(icsi());
  b.hand.buttons = hal::kButtonInject;
  b.to_inside();
  b.run(0.5);
  EXPECT_EQ(b.injector.open_ticks, 0);
  EXPECT_EQ(b.servo->phase(), puncture);
  b.hold(0, 0.05);
  b.hold(hal::kButtonInject, 0.05);
  EXPECT_TRUE(b.injector.open);
}

TEST(Servo, opens_the_gate_once_whatever_the_rate_of_the_hand) {
  Bench b(icsi());
  b.to_inside();
  b.run(0.1);
  int edges = 0;
  bool was = false;
  b.every_tick = [&] {
    b.hand.status = b.ticks % 2 == 0 ? hal::Status::ok : hal::Status::no_data;
    edges += b.injector.open != was ? 1 : 0;
    was = b.injector.open;
  };
  b.hold(hal::kButtonInject, 1);
  std::printf("%d edges of the gate in a second\n", edges);
  EXPECT_EQ(edges, 1);
  b.hold(0, 0.1);
  EXPECT_EQ(edges, 2);
}

}  // namespace
}  // namespace punctum::rt
