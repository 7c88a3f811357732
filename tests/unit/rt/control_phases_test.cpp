// The phases on scripted sequences, with noise around every threshold.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include "rt/control/phases.hpp"
#include "tests/support/tick.hpp"

namespace punctum::rt {
namespace {

using test::kTick_s;

struct Needle {
  explicit Needle(const PhaseParams& params = {}) : phases(params) { in.membrane_known = true; }
  Phase step() {
    const Phase before = phases.phase();
    in.inward_m = in.depth_m + vision_m;
    in.contact_depth_m = in.depth_m;
    in.may_inject = in.vision_punctured;
    const Phase now = phases.step(in, kTick_s);
    if (now != before) {
      order.push_back(now);
    }
    EXPECT_EQ(phases.changed(), now != before);
    return now;
  }
  Phase hold(double seconds) {
    for (double t = 0; t < seconds; t += kTick_s) {
      step();
    }
    return phases.phase();
  }
  void move(double to_m, double speed_m_s) {
    const double way = to_m - in.depth_m;
    const int n = std::max(1, static_cast<int>(std::abs(way) / speed_m_s / kTick_s));
    in.outward_m_s = way < 0 ? speed_m_s : -speed_m_s;
    const double from = in.depth_m;
    for (int k = 1; k <= n; ++k) {
      in.depth_m = from + way * k / n;
      step();
    }
    in.outward_m_s = 0;
  }
  Phases phases;
  PhaseInput in;
  double vision_m = 0;  // the encoders' way to the depth that vision says
  std::vector<Phase> order;
};

using enum Phase;

TEST(Phases, go_through_one_injection_in_order) {
  Needle r;
  r.in.depth_m = -40e-6;
  r.move(18e-6, 10e-6);
  r.in.vision_punctured = true;
  r.move(40e-6, 10e-6);
  r.in.inject = true;
  r.hold(1);
  r.in.inject = false;
  r.move(-20e-6, 30e-6);
  EXPECT_EQ(r.order, (std::vector{contact, indentation, puncture, injection, withdrawal, clear}));
  EXPECT_EQ(r.phases.cell(), 0U);
}

TEST(Phases, take_no_correction_by_vision_for_a_withdrawal) {
  for (const bool moves : {false, true}) {
    Needle r;
    r.in.depth_m = -10e-6;
    r.move(10e-6, 10e-6);
    r.in.vision_punctured = true;
    r.move(30e-6, 10e-6);
    ASSERT_EQ(r.phases.phase(), puncture);
    r.in.outward_m_s = 10e-6;  // she trembles
    r.in.depth_m -= 3e-6;      // more than the way back that a withdrawal takes
    if (!moves) {
      r.vision_m += 3e-6;
    }
    r.hold(0.1);
    EXPECT_EQ(r.phases.phase(), moves ? withdrawal : puncture);
  }
}

TEST(Phases, allow_withdrawal_without_an_injection) {
  Needle r;
  r.in.depth_m = -10e-6;
  r.move(10e-6, 10e-6);
  r.in.vision_punctured = true;
  r.move(30e-6, 10e-6);
  r.move(-20e-6, 30e-6);
  EXPECT_EQ(r.order, (std::vector{contact, indentation, puncture, withdrawal, clear}));
}

TEST(Phases, fall_back_when_the_needle_leaves_before_the_puncture) {
  Needle r;
  r.in.depth_m = -10e-6;
  r.move(10e-6, 10e-6);
  r.move(-10e-6, 10e-6);
  EXPECT_EQ(r.order, (std::vector{contact, indentation, contact, free}));
}

TEST(Phases, do_not_chatter_under_noise_at_any_threshold) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> n(0, 0.1e-6);  // a third of the narrowest hysteresis band
  const PhaseParams params;
  for (const double threshold :
       {params.contact_on_m, -params.contact_off_m, params.indentation_on_m, params.indentation_on_m / 2}) {
    for (const double from : {-30e-6, 30e-6}) {
      Needle r;
      r.in.depth_m = from;
      r.hold(0.01);
      r.in.depth_m = 10e-6;
      if (from > 0) {
        r.hold(0.01);
      }
      r.order.clear();
      // Sits on the threshold for a minute.
      for (int k = 0; k < 60000; ++k) {
        r.in.depth_m = threshold + n(random);
        r.step();
      }
      EXPECT_LE(r.order.size(), 2U) << threshold << " from " << from;
    }
  }
}

TEST(Phases, begin_withdrawal_by_motion_not_by_tremor) {
  Needle r;
  r.in.depth_m = 10e-6;
  r.hold(0.01);
  r.in.vision_punctured = true;
  r.hold(0.01);
  ASSERT_EQ(r.phases.phase(), puncture);
  // Tremor of 0.5 um at 10 Hz: speeds of 30 um/s, no way back.
  for (int k = 0; k < 10000; ++k) {
    const double t = k * kTick_s;
    r.in.depth_m = 10e-6 + 0.5e-6 * std::sin(62.8 * t);
    r.in.outward_m_s = -0.5e-6 * 62.8 * std::cos(62.8 * t);
    r.step();
  }
  EXPECT_EQ(r.phases.phase(), puncture);
  // Creeping out slower than the speed asked for does not begin it either, until the needle is outside.
  r.move(1e-6, 2e-6);
  EXPECT_EQ(r.phases.phase(), puncture);
  r.move(-2e-6, 2e-6);
  EXPECT_EQ(r.phases.phase(), withdrawal);
}

TEST(Phases, need_the_button_anew_for_the_next_cell) {
  Needle r;
  r.in.next_cell = true;  // held down all the time
  r.in.depth_m = 10e-6;
  r.hold(0.01);
  r.in.vision_punctured = true;
  r.hold(0.01);
  r.move(-20e-6, 30e-6);
  ASSERT_EQ(r.phases.phase(), clear);
  r.hold(1);
  EXPECT_EQ(r.phases.phase(), clear);
  r.in.next_cell = false;
  r.in.vision_punctured = false;
  r.hold(0.01);
  r.in.next_cell = true;
  r.step();
  EXPECT_EQ(r.phases.phase(), free);
  EXPECT_EQ(r.phases.cell(), 1U);
  EXPECT_TRUE(r.phases.entered(free));
}

TEST(Phases, ignore_a_puncture_seen_without_contact) {
  Needle r;
  r.in.vision_punctured = true;
  r.in.depth_m = -20e-6;
  r.hold(1);
  EXPECT_EQ(r.phases.phase(), free);
}

TEST(Phases, stay_free_until_the_membrane_is_known) {
  Needle r;
  r.in.membrane_known = false;
  r.in.depth_m = 10e-6;
  r.in.vision_contact = r.in.vision_punctured = true;
  r.hold(1);
  EXPECT_EQ(r.phases.phase(), free);
}

TEST(Phases, say_when_one_takes_too_long) {
  PhaseParams params;
  params.timeout_s[static_cast<int>(contact)] = 2;
  Needle r(params);
  r.in.depth_m = 1e-6;
  r.hold(1.9);
  EXPECT_FALSE(r.phases.timed_out());
  r.hold(0.2);
  EXPECT_TRUE(r.phases.timed_out());
  r.move(5e-6, 10e-6);
  EXPECT_FALSE(r.phases.timed_out());
}

TEST(Phases, never_go_back_from_inside_and_never_skip_whatever_comes) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> depth(-30e-6, 60e-6);
  std::uniform_int_distribution<int> coin(0, 40);
  for (int seed = 0; seed < 200; ++seed) {
    Needle r;
    Phase before = free;
    for (int k = 0; k < 2000; ++k) {
      if (coin(random) == 0) {
        r.in.depth_m = depth(random);
      }
      if (coin(random) == 0) {
        r.in.outward_m_s = depth(random);
      }
      if (coin(random) == 0) {
        r.in.vision_punctured = !r.in.vision_punctured;
      }
      if (coin(random) == 0) {
        r.in.vision_contact = !r.in.vision_contact;
      }
      if (coin(random) == 0) {
        r.in.inject = !r.in.inject;
      }
      if (coin(random) == 0) {
        r.in.next_cell = !r.in.next_cell;
      }
      const Phase now = r.step();
      if (now != before) {
        const bool ok = (before == free && now == contact) ||
                        (before == contact && (now == free || now == indentation || now == puncture)) ||
                        (before == indentation && (now == contact || now == puncture)) ||
                        (before == puncture && (now == injection || now == withdrawal)) ||
                        (before == injection && now == withdrawal) ||
                        (before == withdrawal && now == clear) || (before == clear && now == free);
        EXPECT_TRUE(ok) << name(before) << " -> " << name(now);
      }
      before = now;
    }
  }
}

TEST(Phases, need_the_encoders_to_dent_the_cell_for_a_puncture) {
  PhaseInput in;
  in.membrane_known = in.vision_punctured = in.vision_contact = true;
  in.depth_m = 20e-6;  // a membrane that only vision has moved
  in.contact_depth_m = 1e-6;
  Phases phases{PhaseParams{}};
  for (int k = 0; k < 1000; ++k) {
    phases.step(in, kTick_s);
  }
  EXPECT_EQ(phases.phase(), indentation);
  in.contact_depth_m = 5e-6;
  phases.step(in, kTick_s);
  EXPECT_EQ(phases.phase(), puncture);
}

// Every state that any sequence of inputs can reach, and every input in it. The inputs stand on either side
// of each threshold.
TEST(Phases, keep_their_rules_in_every_reachable_state_whatever_comes) {
  const PhaseParams params;
  std::vector<PhaseInput> inputs;
  for (const double depth_um : {-20.0, -2.0, -0.4, -0.1, 0.5, 2.0, 5.0, 20.0}) {
    for (const double contact_depth_um : {-1.0, 1.0, 5.0}) {
      for (const double inward_um : {0.0, 5.0}) {
        for (const double outward_m_s : {0.0, 20e-6}) {
          for (unsigned bits = 0; bits < 128; ++bits) {
            PhaseInput in;
            in.depth_m = 1e-6 * depth_um;
            in.contact_depth_m = 1e-6 * contact_depth_um;
            in.inward_m = 1e-6 * inward_um;
            in.outward_m_s = outward_m_s;
            in.membrane_known = (bits & 1U) != 0;
            in.vision_contact = (bits & 2U) != 0;
            in.vision_punctured = (bits & 4U) != 0;
            in.may_inject = (bits & 8U) != 0;
            in.inject = (bits & 16U) != 0;
            in.next_cell = (bits & 32U) != 0;
            in.vision_contradicts = (bits & 64U) != 0;
            inputs.push_back(in);
          }
        }
      }
    }
  }
  const auto allowed = [](Phase from, Phase to) {
    switch (from) {
      case free:
        return to == contact;
      case contact:
        return to == free || to == indentation;
      case indentation:
        return to == contact || to == puncture;
      case puncture:
        return to == injection || to == withdrawal;
      case injection:
        return to == withdrawal;
      case withdrawal:
        return to == clear;
      case clear:
        return to == free;
    }
    return false;
  };
  std::vector<Phases::State> reached{Phases::State{}};
  std::array<bool, kPhases> seen{};
  for (std::size_t i = 0; i < reached.size(); ++i) {
    const Phases::State before = reached[i];
    seen[static_cast<std::size_t>(before.phase)] = true;
    for (const PhaseInput& in : inputs) {
      Phases phases(params, before);
      const Phase to = phases.step(in, 0);
      const Phase from = before.phase;
      ASSERT_EQ(phases.changed(), to != from);
      ASSERT_EQ(phases.cell(), before.cell + (from == clear && to == free ? 1U : 0U));
      if (to != from) {
        ASSERT_TRUE(allowed(from, to)) << name(from) << " -> " << name(to);
        ASSERT_TRUE(in.membrane_known || from == clear);
      }
      if (to != from && to == puncture) {
        ASSERT_TRUE(in.vision_punctured && in.contact_depth_m > 1e-6);
      }
      if (to != from && to == injection) {
        ASSERT_TRUE(in.inject && !before.inject_was && in.may_inject);
      }
      if (to != from && to == clear) {
        ASSERT_TRUE(in.depth_m < -params.clear_m && in.contact_depth_m < 0 && !in.vision_contradicts);
      }
      if (from == clear && to == free) {
        ASSERT_TRUE(in.next_cell && !before.next_cell_was);
      }
      Phases::State after = phases.state();
      after.cell = 0;
      if (std::find(reached.begin(), reached.end(), after) == reached.end()) {
        reached.push_back(after);
      }
    }
    // From everywhere a needle that is drawn out ends outside.
    Phases phases(params, before);
    PhaseInput out;
    out.membrane_known = true;
    out.depth_m = out.contact_depth_m = -20e-6;
    for (int k = 0; k < 3; ++k) {
      phases.step(out, kTick_s);
    }
    ASSERT_TRUE(phases.phase() == free || phases.phase() == clear) << name(before.phase);
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), kPhases);
  EXPECT_GT(reached.size(), 30U);
}

}  // namespace
}  // namespace punctum::rt
