// What the handle cannot render is found with its numbers. The limits are those of device_limits_reference.py
// for the default handle at 1 kHz: 17.35 Ns/m without delay; 489.7 N/m beside B = 1 Ns/m with two ticks of
// delay; passive without a guard up to b/(T/2 + delay) = 40 N/m.
#include <gtest/gtest.h>

#include "rt/control/renderable.hpp"

namespace punctum::rt {
namespace {

using What = NotRenderable::What;

ServoConfig bare() {
  ServoConfig config;
  config.phases.reset();
  config.local_model.reset();
  return config;
}

// Refused for this, and with this asked of the handle; the limits are what each test looks at.
NotRenderable refused(const ServoConfig& config, What what, double asked) {
  const auto found = find_not_renderable(config);
  EXPECT_TRUE(found);
  if (!found) {
    return {};
  }
  EXPECT_EQ(found->what, what);
  EXPECT_EQ(found->asked, asked);
  return *found;
}

TEST(Renderable, a_bare_handle_can_render_nothing_wrong) { EXPECT_FALSE(find_not_renderable(bare())); }

TEST(Renderable, a_handle_without_force_is_asked_for_nothing) {
  ServoConfig config = bare();
  config.damping = DampingParams{.B1_Ns_m = 18, .B2_Ns_m = 18};
  config.friction = FrictionParams{.F_c_N = 0.1, .K_N_m = 1e5};
  ASSERT_TRUE(find_not_renderable(config));
  config.device.force_max_N = 0;
  EXPECT_FALSE(find_not_renderable(config));
}

TEST(Renderable, damping_above_the_stable_limit_is_found_with_the_limit) {
  ServoConfig config = bare();
  config.damping = DampingParams{.B1_Ns_m = 17.3, .B2_Ns_m = 17.3};
  EXPECT_FALSE(find_not_renderable(config));

  config.damping->B2_Ns_m = 17.4;
  EXPECT_NEAR(refused(config, What::damping_inside, 17.4).most, 17.35, 0.01);
  config.damping->B1_Ns_m = 18;
  refused(config, What::damping_outside, 18);
}

TEST(Renderable, damping_of_the_axis_adds_to_the_damping_inside) {
  ServoConfig config = bare();
  config.damping = DampingParams{.B1_Ns_m = 1, .B2_Ns_m = 4};
  config.axis = AxisParams{.K_N_m = 0, .B_inward_Ns_m = 13};
  EXPECT_FALSE(find_not_renderable(config));
  config.axis->B_inward_Ns_m = 14;
  const NotRenderable found = refused(config, What::damping_inward, 14);
  EXPECT_EQ(found.beside_Ns_m, 4);
}

TEST(Renderable, a_spring_that_swings_by_itself_is_found_beside_its_damping) {
  ServoConfig config = bare();
  config.device.delay_ticks = 2;
  config.damping = DampingParams{.B1_Ns_m = 1, .B2_Ns_m = 1};
  config.guard = GuardParams{};
  config.friction = FrictionParams{.F_c_N = 0.1, .K_N_m = 489};
  EXPECT_FALSE(find_not_renderable(config));
  config.friction->K_N_m = 490;
  const NotRenderable found = refused(config, What::unstable, 490);
  EXPECT_NEAR(found.most, 489.7, 0.1);
  EXPECT_EQ(found.beside_Ns_m, 1);
  EXPECT_EQ(found.spring_count, 1);
  EXPECT_EQ(found.stiffest, Spring::Of::friction);
}

TEST(Renderable, without_a_guard_the_sum_of_the_springs_must_be_passive) {
  ServoConfig config = bare();
  config.device.delay_ticks = 2;
  config.damping = DampingParams{.B1_Ns_m = 1, .B2_Ns_m = 1};
  config.friction = FrictionParams{.F_c_N = 0.1, .K_N_m = 15};
  config.repulsive = RepulsiveParams{.K_N_m = 24};
  EXPECT_FALSE(find_not_renderable(config));
  config.repulsive->K_N_m = 26;
  const NotRenderable found = refused(config, What::not_passive, 41);
  EXPECT_DOUBLE_EQ(found.most, 40);
  EXPECT_EQ(found.spring_count, 2);
  EXPECT_EQ(found.stiffest, Spring::Of::repulsive);
  config.guard = GuardParams{};
  EXPECT_FALSE(find_not_renderable(config));
}

TEST(Renderable, a_step_of_the_stage_is_felt_in_proportion_to_its_size_and_the_force_scale) {
  ServoConfig config;
  config.membrane = MembraneParams{};
  const double click_N = stage_click_N(config, 0.04e-6);
  EXPECT_GT(click_N, 0);
  EXPECT_LT(click_N, kLargestClick_N);
  EXPECT_NEAR(stage_click_N(config, 0.08e-6), 2 * click_N, 1e-12);
  config.mapping.position_scale *=
      2;  // the law is at the needle: the handle's stiffness halves, its step doubles
  EXPECT_NEAR(stage_click_N(config, 0.04e-6), click_N, 1e-12);
  config.membrane.reset();
  EXPECT_EQ(stage_click_N(config, 0.04e-6), 0);
}

}  // namespace
}  // namespace punctum::rt
