// The safety latch, over every state it can reach and every input.
#include "rt/control/safety_latch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/tick.hpp"

namespace punctum::rt {
namespace {

using test::kTick_s;

std::vector<LatchInput> every_input() {
  std::vector<LatchInput> all;
  for (int fault = 0; fault < kFaults; ++fault) {
    for (int bits = 0; bits < 128; ++bits) {
      if ((bits & 4) != 0 && (bits & 64) == 0) {
        continue;  // a button that was pressed for long enough is down
      }
      all.push_back({static_cast<Fault>(fault), (bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0,
                     (bits & 8) != 0, (bits & 16) != 0, (bits & 32) != 0, (bits & 64) != 0});
    }
  }
  return all;
}

// Short times, so that the ramp and the limit are a few ticks each and every state is met.
EstopParams short_times() {
  EstopParams params;
  params.hand_ramp_s = 3 * kTick_s;
  params.power_off_after_s = 6 * kTick_s;
  return params;
}

template <class Check>
std::size_t explore(Check&& check) {
  const EstopParams params = short_times();
  const std::vector<LatchInput> inputs = every_input();
  std::vector<SafetyLatch::State> seen{SafetyLatch::State{}};
  for (std::size_t i = 0; i < seen.size(); ++i) {
    for (const LatchInput& in : inputs) {
      const SafetyLatch::State before = seen[i];
      SafetyLatch latch(params, before);
      const LatchOutput out = latch.step(in, kTick_s);
      check(before, in, latch.state(), out);
      bool known = false;
      for (const SafetyLatch::State& s : seen) {
        known = known || s == latch.state();
      }
      if (!known) {
        seen.push_back(latch.state());
      }
    }
  }
  return seen.size();
}

TEST(SafetyLatch, keeps_the_first_cause_until_it_is_cleared) {
  const std::size_t states = explore([](const auto& before, const auto& in, const auto& after, const auto&) {
    if (before.stage == StopStage::running) {
      EXPECT_EQ(after.cause, in.causes.first);
      EXPECT_EQ(after.stage == StopStage::running, in.causes.first == Fault::none);
    } else if (after.stage != StopStage::running) {
      EXPECT_EQ(after.cause, before.cause);
    }
  });
  EXPECT_GT(states, 100U);
  std::printf("%zu states x %zu inputs\n", states, every_input().size());
}

TEST(SafetyLatch, clears_only_when_stopped_released_its_cause_gone_and_its_button_newly_pressed) {
  explore([](const auto& before, const auto& in, const auto& after, const auto& out) {
    const bool clears = before.stage != StopStage::running && after.stage == StopStage::running;
    EXPECT_EQ(clears, out.cleared);
    const bool reset = in.chain_readable && in.reset_pressed && !before.reset_spent;
    const bool button =
        before.cause == Fault::enabling_released && !before.reset_needed ? in.pressed_anew : reset;
    const bool may = before.stage == StopStage::stopped && in.contacts_closed &&
                     in.causes.first == Fault::none && in.drive_obeys && button &&
                     before.cause != Fault::command_stop;
    EXPECT_EQ(clears, may);
  });
}

TEST(SafetyLatch, stops_the_stage_and_shuts_the_gate_on_the_very_tick_and_as_long_as_it_is_latched) {
  explore([](const auto&, const auto&, const auto& after, const auto& out) {
    const bool latched = after.stage != StopStage::running;
    EXPECT_EQ(out.quick_stop, latched);
    EXPECT_EQ(out.gate_shut, latched);
  });
}

TEST(SafetyLatch, takes_drive_power_only_after_the_stop_at_standstill_or_after_the_limit) {
  const EstopParams params = short_times();
  explore([&](const auto& before, const auto& in, const auto& after, const auto& out) {
    EXPECT_EQ(out.drive_power, after.stage != StopStage::stopped);
    if (after.stage == StopStage::stopped && before.stage != StopStage::stopped) {
      EXPECT_EQ(before.stage, StopStage::stopping);  // never on the tick of the stop itself
      EXPECT_TRUE(in.at_standstill || after.since_s >= params.power_off_after_s - 1e-9);
      EXPECT_EQ(out.hand_gain, 0);
    }
    // Nor is it kept beyond the limit.
    if (after.stage == StopStage::stopping) {
      EXPECT_LT(after.since_s, params.power_off_after_s);
    }
  });
}

TEST(SafetyLatch, leaves_the_drive_its_power_to_brake_with_also_where_no_force_has_to_fade) {
  EstopParams params = short_times();
  params.hand_ramp_s = 0;
  SafetyLatch latch(params);
  LatchInput in;
  in.causes = Fault::estop;
  EXPECT_TRUE(latch.step(in, kTick_s).drive_power);  // the standstill is from before the stop
  EXPECT_FALSE(latch.step(in, kTick_s).drive_power);
}

TEST(SafetyLatch, lets_the_hand_force_only_fall) {
  explore([](const auto& before, const auto&, const auto& after, const auto& out) {
    if (before.stage != StopStage::running && after.stage != StopStage::running) {
      EXPECT_LE(after.hand, before.hand);
      EXPECT_LE(out.hand_gain, smooth_step(before.hand));
    }
    if (after.stage == StopStage::running) {
      EXPECT_EQ(out.hand_gain, 1);
    }
  });
}

TEST(SafetyLatch, lets_the_relay_open_only_when_loop_gate_or_drive_are_not_to_be_trusted) {
  const auto distrusts = [](Fault cause) {
    return cause == Fault::overrun || cause == Fault::not_finite || cause == Fault::estop_lost ||
           cause == Fault::injector_open || cause == Fault::stage_lost || cause == Fault::stage_fault ||
           cause == Fault::stage_following || cause == Fault::stage_not_stopping;
  };
  explore([&](const auto& before, const auto& in, const auto& after, const auto& out) {
    const bool distrusted = before.distrusted || distrusts(in.causes.first) ||
                            (before.stage != StopStage::running && !in.drive_obeys);
    if (after.stage == StopStage::stopped) {
      EXPECT_EQ(out.heartbeat, !distrusted && !(in.causes.first != Fault::none && !in.drive_obeys));
    } else {
      EXPECT_TRUE(out.heartbeat);
    }
  });
}

TEST(SafetyLatch, lets_the_relay_open_also_for_what_a_more_urgent_cause_hides) {
  SafetyLatch latch(EstopParams{});
  LatchInput in;
  in.causes = Fault::command_stop;
  in.at_standstill = false;
  latch.step(in, kTick_s);
  in.causes.add(Fault::stage_lost);
  LatchOutput out;
  for (int k = 0; k < 1000; ++k) {
    out = latch.step(in, kTick_s);
  }
  EXPECT_EQ(latch.cause(), Fault::command_stop);
  EXPECT_FALSE(out.heartbeat);
}

TEST(SafetyLatch, gives_no_heartbeat_again_before_the_reset) {
  explore([](const auto& before, const auto&, const auto& after, const auto& out) {
    if (before.stage == StopStage::stopped && before.distrusted) {
      EXPECT_EQ(out.heartbeat, out.cleared);
      EXPECT_EQ(after.distrusted, !out.cleared);
    }
  });
}

TEST(SafetyLatch, is_over_in_time_at_every_rate) {
  for (const double rate : {1000.0, 2000.0, 4000.0, 8000.0}) {
    const EstopParams params;
    SafetyLatch latch(params);
    const double dt = 1 / rate;
    LatchInput in;
    in.causes = Fault::estop;
    in.contacts_closed = false;
    in.at_standstill = false;
    double before = 1;
    double steepest = 0;
    int ticks = 0;
    do {
      const LatchOutput out = latch.step(in, dt);
      steepest = std::max(steepest, before - out.hand_gain);
      before = out.hand_gain;
      ++ticks;
    } while (before > 0 && ticks < 1000);
    EXPECT_LE(ticks * dt, 0.020 + 1e-9);
    EXPECT_LE(steepest, 1.9 * dt / params.hand_ramp_s);  // no jolt: at most 15/8 of an even ramp
    // The stage never reports standstill: power goes at the limit.
    while (latch.stage() == StopStage::stopping && ticks < 100000) {
      latch.step(in, dt);
      ++ticks;
    }
    EXPECT_NEAR(ticks * dt, params.power_off_after_s, 1.5 * dt);
  }
}

TEST(SafetyLatch, ignores_a_reset_button_that_is_stuck) {
  SafetyLatch latch(EstopParams{});
  LatchInput in;
  in.reset_pressed = true;
  in.causes = Fault::estop;
  latch.step(in, kTick_s);
  in.causes = Fault::none;
  for (int k = 0; k < 5000; ++k) {
    latch.step(in, kTick_s);
  }
  EXPECT_EQ(latch.stage(), StopStage::stopped);
  in.reset_pressed = false;
  latch.step(in, kTick_s);
  EXPECT_EQ(latch.stage(), StopStage::stopped);
  in.reset_pressed = true;
  EXPECT_TRUE(latch.step(in, kTick_s).cleared);
  // Held down through a second stop it does not clear that one.
  in.causes = Fault::hand_lost;
  latch.step(in, kTick_s);
  in.causes = Fault::none;
  for (int k = 0; k < 5000; ++k) {
    latch.step(in, kTick_s);
  }
  EXPECT_EQ(latch.stage(), StopStage::stopped);
  EXPECT_EQ(latch.cause(), Fault::hand_lost);
}

TEST(SafetyLatch, takes_no_press_of_the_reset_button_that_began_before_all_was_released) {
  for (const bool before : {true, false}) {
    SafetyLatch latch(EstopParams{});
    LatchInput in;
    in.causes = Fault::estop;
    in.contacts_closed = false;
    for (int k = 0; k < 1000; ++k) {
      latch.step(in, kTick_s);
    }
    // A press counts once it has lasted for a while: the contacts close meanwhile, or were closed before.
    in.reset_down = before;
    latch.step(in, kTick_s);
    in.causes = Fault::none;
    in.contacts_closed = true;
    latch.step(in, kTick_s);
    in.reset_down = true;
    latch.step(in, kTick_s);
    in.reset_pressed = true;
    EXPECT_EQ(latch.step(in, kTick_s).cleared, !before);
    // Nor one during which a cause came back.
    if (before) {
      in.reset_down = in.reset_pressed = false;
      latch.step(in, kTick_s);
      in.reset_down = true;
      latch.step(in, kTick_s);
      in.causes = Fault::estop;
      latch.step(in, kTick_s);
      in.causes = Fault::none;
      in.reset_pressed = true;
      EXPECT_FALSE(latch.step(in, kTick_s).cleared);
    }
  }
}

TEST(SafetyLatch, asks_for_the_reset_button_when_more_than_the_enabling_device_was_let_go) {
  for (const Fault later : {Fault::none, Fault::estop}) {
    SafetyLatch latch(EstopParams{});
    LatchInput in;
    in.causes = Fault::enabling_released;
    latch.step(in, kTick_s);
    in.causes = later;
    latch.step(in, kTick_s);
    in.causes = Fault::none;
    for (int k = 0; k < 1000; ++k) {
      latch.step(in, kTick_s);
    }
    in.pressed_anew = true;
    EXPECT_EQ(latch.step(in, kTick_s).cleared, later == Fault::none);
    EXPECT_EQ(latch.cause(), later == Fault::none ? Fault::none : Fault::enabling_released);
  }
}

TEST(SafetyLatch, the_table_orders_quick_stop_gate_hand_power_for_every_cause) {
  for (const SafetyRule& rule : kSafetyRules) {
    if (rule.cause == Fault::none) {
      continue;
    }
    EXPECT_EQ(rule.actions[0], SafetyAction::quick_stop);
    EXPECT_EQ(rule.actions[1], SafetyAction::gate_shut);
    EXPECT_EQ(rule.actions[2], SafetyAction::hand_force_to_zero);
    EXPECT_EQ(rule.actions[3], SafetyAction::drive_power_off);
  }
}

std::string row_of(const SafetyRule& rule) {
  constexpr const char* actions[] = {"none",          "quick_stop",     "gate_shut", "hand_force_to_zero",
                                     "heartbeat_off", "drive_power_off"};
  constexpr const char* cleared_by[] = {"never", "release_and_reset", "release_and_press"};
  std::string in_order;
  for (const SafetyAction action : rule.actions) {
    if (action != SafetyAction::none) {
      in_order += (in_order.empty() ? "`" : ", `") + std::string(actions[static_cast<int>(action)]) + "`";
    }
  }
  return "| `" + std::string(name(rule.cause)) + "` | " + in_order + " | `" +
         cleared_by[static_cast<int>(rule.cleared_by)] + "` |";
}

TEST(SafetyLatch, the_readme_has_the_table_row_by_row) {
  std::ifstream in(PUNCTUM_SOURCE_DIR "/rt/control/README.md");
  std::string line;
  while (std::getline(in, line) && line != "| cause | actions, in order | cleared by |") {
  }
  ASSERT_TRUE(std::getline(in, line));
  EXPECT_EQ(line, "| --- | --- | --- |");
  std::vector<std::string> written, rules;
  while (std::getline(in, line) && line.starts_with('|')) {
    written.push_back(line);
  }
  for (const SafetyRule& rule : kSafetyRules) {
    if (rule.cause != Fault::none) {
      rules.push_back(row_of(rule));
    }
  }
  EXPECT_EQ(written, rules);
}

}  // namespace
}  // namespace punctum::rt
