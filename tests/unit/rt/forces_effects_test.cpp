// The list of effects, and their sum: what is told to the hand, to the guard and to telemetry.
#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <string>

#include "rt/forces/effects.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
constexpr EffectSetup kForcesScaled{.force_scale = 1e5};

EffectParams all() {
  EffectParams params;
#define PUNCTUM_EFFECT(name, Class) params.name.emplace();
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
  return params;
}

EffectInput in_the_guide() {
  EffectInput in;
  in.dt_s = 1e-3;
  in.handle_m = Vec3(0.01, 0, 0);
  in.handle_velocity_m_s = Vec3(0.01, 0, 0);
  in.fixture_point_m = Vec3(10e-6, 12e-6, 0);
  in.needle_tip_m = Vec3(11e-6, 12e-6, 0);
  in.cell_known = true;
  in.cell_radius_m = 60e-6;
  in.cell_centre_m = Vec3(-60e-6, 0, 0);
  in.depth_m = 5e-6;
  in.fixture_gain = 0.8;
  in.force_fade = in.last_force_fade = 0.5;
  return in;
}

const StoringForce& at(const EffectSum& sum, EnergyPoint point) {
  return sum.parts.storing[static_cast<std::size_t>(point)];
}

TEST(Effects, have_the_names_of_their_scene_tables_in_the_order_of_telemetry) {
  EXPECT_EQ(std::size(kEffectNames), effect_count);
  const char* first[] = {"membrane", "cone", "axis", "damping"};  // columns of samples.csv
  for (std::size_t i = 0; i < std::size(first); ++i) {
    EXPECT_EQ(std::string(effect_name(i)), first[i]);
  }
}

TEST(Effects, give_half_the_force_and_energy_at_half_a_commanded_gain) {
  EffectParams params;
  params.cone.emplace();
  params.damping.emplace();
  Effects whole(params, kForcesScaled), halved(params, kForcesScaled);
  EffectGains half = kFullGains;
  half.fill(0.5);
  for (int k = 0; k < 2000; ++k) {
    (void)whole.step(in_the_guide());
    (void)halved.step(in_the_guide(), &half);
  }
  ASSERT_GT(whole.sum().force_N.norm(), 0);
  EXPECT_LT((halved.sum().force_N - 0.5 * whole.sum().force_N).norm(), 1e-12);
  EXPECT_NEAR(halved.sum().stored_J, 0.5 * whole.sum().stored_J, 1e-15);
  EXPECT_NEAR(halved.sum().parts.stiffness_N_m, 0.5 * whole.sum().parts.stiffness_N_m, 1e-9);
  EXPECT_NEAR(halved.sum().parts.damping_Ns_m, 0.5 * whole.sum().parts.damping_Ns_m, 1e-12);
}

TEST(Effects, count_the_energy_that_a_changed_gain_gives_to_a_standing_hand) {
  EffectParams params;
  params.cone.emplace();
  Effects effects(params, kForcesScaled);
  EffectGains gains = kFullGains;
  for (int k = 0; k < 3000; ++k) {  // the guide's own ramp is over
    (void)effects.step(in_the_guide(), &gains);
  }
  const double stored_J = effects.sum().stored_J, injected_J = effects.sum().injected_J;
  ASSERT_GT(stored_J, 0);
  for (int k = 1; k <= 500; ++k) {
    gains[effect_cone] = 1 - k * 1e-3;
    (void)effects.step(in_the_guide(), &gains);
  }
  EXPECT_NEAR(effects.sum().stored_J, 0.5 * stored_J, 1e-9 * stored_J);
  EXPECT_NEAR(effects.sum().injected_J - injected_J, -0.5 * stored_J, 1e-9 * stored_J);
}

TEST(Effects, sum_to_nothing_where_the_scene_has_none) {
  Effects effects(EffectParams{}, kForcesScaled);
  const EffectSum& sum = effects.step(in_the_guide());
  EXPECT_EQ(sum.force_N.norm(), 0);
  EXPECT_EQ(sum.parts.wanted_N().norm(), 0);
  EXPECT_EQ(sum.stored_J + sum.injected_J + sum.parts.stiffness_N_m + sum.parts.damping_Ns_m, 0);
  EXPECT_FALSE(effects.membrane());
}

TEST(Effects, give_the_guard_the_same_force_in_parts_that_the_hand_is_to_feel) {
  Effects effects(all(), kForcesScaled);
  EffectInput in = in_the_guide();
  for (int k = 0; k < 500; ++k) {
    in.inside_cell = in.punctured = k > 250;
    in.withdrawing = k > 300;
    in.contact_or_puncture_begins = k == 251;
    in.handle_m.x() += 1e-5 * std::sin(0.1 * k);
    in.handle_velocity_m_s.x() = -0.01 * std::cos(0.1 * k);
    const EffectSum& sum = effects.step(in);
    ASSERT_LT((sum.force_N - sum.parts.wanted_N()).norm(), 1e-12) << k;
  }
}

TEST(Effects, fade_all_together_and_are_told_without_the_fade) {
  EffectInput in = in_the_guide();
  EffectSum whole, half;
  for (const double fade : {1.0, 0.5}) {
    EffectParams params;
    params.cone.emplace();
    params.damping.emplace();
    Effects effects(params, kForcesScaled);
    in.force_fade = fade;
    for (int k = 0; k < 400; ++k) {
      (fade == 1.0 ? whole : half) = effects.step(in);
    }
  }
  EXPECT_GT(whole.force_N.norm(), 0.1);
  EXPECT_LT((half.force_N - 0.5 * whole.force_N).norm(), 1e-15);
  EXPECT_NEAR(half.parts.stiffness_N_m, 0.5 * whole.parts.stiffness_N_m, 1e-12);
  EXPECT_NEAR(half.parts.damping_Ns_m, 0.5 * whole.parts.damping_Ns_m, 1e-15);
  EXPECT_EQ(half.effect_N, whole.effect_N);
  EXPECT_EQ(half.stored_J, whole.stored_J);
}

TEST(Effects, are_scaled_with_their_energy_by_the_gain_of_the_fixtures) {
  EffectParams params;
  params.cone.emplace();
  params.repulsive.emplace();
  params.repulsive->offset_m = Vec3(65e-6, 5e-6, 0);
  EffectSum sums[2];
  for (const int i : {0, 1}) {
    Effects effects(params, kForcesScaled);
    EffectInput in = in_the_guide();
    in.fixture_gain = i == 0 ? 1 : 0.25;
    for (int k = 0; k < 400; ++k) {
      sums[i] = effects.step(in);
    }
  }
  EXPECT_GT(sums[0].effect_N[effect_repulsive], 0);
  EXPECT_LT((sums[1].force_N - 0.25 * sums[0].force_N).norm(), 1e-15);
  EXPECT_NEAR(sums[1].stored_J, 0.25 * sums[0].stored_J, 1e-18);
  EXPECT_NEAR(sums[1].parts.stiffness_N_m, 0.25 * sums[0].parts.stiffness_N_m, 1e-12);
}

TEST(Effects, count_as_injected_what_a_gain_stores_at_a_standing_hand) {
  EffectParams params;
  params.cone.emplace();
  Effects effects(params, kForcesScaled);
  EffectInput in = in_the_guide();
  for (int k = 0; k < 1000; ++k) {
    in.fixture_gain = 0.5 + 0.5 * std::sin(0.01 * k);
    const EffectSum& sum = effects.step(in);
    ASSERT_NEAR(sum.stored_J, sum.injected_J, 1e-15);  // nothing was given by the hand
  }
}

TEST(Effects, store_at_the_point_that_their_energy_depends_on) {
  EffectParams params;
  params.membrane.emplace();
  params.cone.emplace();
  params.friction.emplace();
  Effects effects(params, kForcesScaled);
  EffectInput in = in_the_guide();
  (void)effects.step(in);
  in.handle_m.x() += 0.5e-3;
  const EffectSum& sum = effects.step(in);
  EXPECT_NEAR(at(sum, EnergyPoint::fixture_point).force_N.norm(), 0.5 * sum.effect_N[effect_cone], 1e-15);
  EXPECT_NEAR(at(sum, EnergyPoint::needle).force_N.norm(), 0.5 * sum.effect_N[effect_membrane], 1e-15);
  EXPECT_NEAR(at(sum, EnergyPoint::handle).force_N.norm(), 0.5 * sum.effect_N[effect_friction], 1e-15);
  EXPECT_EQ(at(sum, EnergyPoint::fixture_point).point_m, 500 * in.fixture_point_m);
  EXPECT_EQ(at(sum, EnergyPoint::needle).point_m, 500 * in.needle_tip_m);
  EXPECT_EQ(at(sum, EnergyPoint::handle).point_m, in.handle_m);
}

}  // namespace
}  // namespace punctum::rt
