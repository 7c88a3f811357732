// What is asked of the core from outside.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "rt/control/requests.hpp"

namespace punctum::rt {
namespace {

TEST(Requests, are_kept_once_they_were_made) {
  const auto station = std::make_unique<LocalStation>();
  Requests requests(ServoConfig{}, station->station);
  EXPECT_FALSE(requests.take(1e-3).stop);
  ASSERT_TRUE(station->parent.queue.try_push({Command::stop, 0}));
  ASSERT_TRUE(station->parent.queue.try_push({Command::end, 0}));
  EXPECT_TRUE(requests.take(1e-3).stop);
  EXPECT_TRUE(requests.take(1e-3).stop);
  EXPECT_TRUE(requests.take(1e-3).end);
  EXPECT_FALSE(requests.requested().end_here);
  requests.end_here();
  EXPECT_TRUE(requests.take(1e-3).end_here);
}

TEST(Requests, ramp_the_force_scale_towards_what_was_commanded) {
  const auto station = std::make_unique<LocalStation>();
  Requests requests(ServoConfig{}, station->station);
  ASSERT_TRUE(station->parent.queue.try_push({Command::force_scale, 0.5}));
  double last = requests.take(1e-3).force_scale;
  EXPECT_EQ(last, 1);
  for (int k = 0; k < 300; ++k) {
    const double scale = requests.take(1e-3).force_scale;
    EXPECT_LE(scale, last);
    EXPECT_LE(last - scale, 2e-3 * (1 + 1e-9));
    last = scale;
  }
  EXPECT_NEAR(last, 0.5, 1e-12);
}

TEST(Requests, count_and_drop_what_is_out_of_range_or_unknown) {
  const auto station = std::make_unique<LocalStation>();
  Requests requests(ServoConfig{}, station->station);
  for (const double bad : {-0.1, 1.1, std::nan("")}) {
    ASSERT_TRUE(station->parent.queue.try_push({Command::force_scale, bad}));
  }
  ASSERT_TRUE(station->parent.queue.try_push({77, 0}));
  EXPECT_EQ(requests.take(1e-3).refused, 4U);
  EXPECT_EQ(requests.take(1).force_scale, 1);
}

TEST(Requests, are_taken_a_few_at_a_time_so_that_a_full_queue_makes_no_tick_late) {
  const auto station = std::make_unique<LocalStation>();
  Requests requests(ServoConfig{}, station->station);
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(station->parent.queue.try_push({77, 0}));
  }
  EXPECT_EQ(requests.take(1e-3).refused, 8U);
  EXPECT_EQ(requests.take(1e-3).refused, 16U);
  EXPECT_EQ(requests.take(1e-3).refused, 20U);
}

ServoConfig with_damping() {
  ServoConfig config;
  config.damping.emplace();
  config.limits.hand_force_N = 4;
  return config;
}

TEST(Requests, ramp_the_gain_of_an_effect_that_the_scene_has) {
  const auto station = std::make_unique<LocalStation>();
  Requests requests(with_damping(), station->station);
  ASSERT_TRUE(station->console.queue.try_push({Command::effect_gain, 0, effect_damping}));
  double last = requests.take(1e-3).effect_gain[effect_damping];
  EXPECT_EQ(last, 1);
  for (int k = 0; k < 600; ++k) {
    const double gain = requests.take(1e-3).effect_gain[effect_damping];
    EXPECT_LE(last - gain, 2e-3 * (1 + 1e-9));
    last = gain;
  }
  EXPECT_NEAR(last, 0, 1e-12);
  EXPECT_EQ(requests.requested().effect_gain[effect_cone], 1);
  EXPECT_EQ(requests.requested().refused, 0U);
}

TEST(Requests, lower_the_hands_force_limit_within_the_scenes_and_never_raise_it) {
  const auto station = std::make_unique<LocalStation>();
  Requests requests(with_damping(), station->station);
  EXPECT_EQ(requests.take(1e-3).hand_force_N, 4);
  for (const double bad : {0.0, -1.0, 4.1, std::nan("")}) {
    ASSERT_TRUE(station->console.queue.try_push({Command::hand_force_limit, bad}));
  }
  EXPECT_EQ(requests.take(1e-3).refused, 4U);
  ASSERT_TRUE(station->console.queue.try_push({Command::hand_force_limit, 1}));
  (void)requests.take(1e-3);
  EXPECT_NEAR(requests.take(1e-3).hand_force_N, 4 - 2e-3 * 4, 1e-12);
  EXPECT_NEAR(requests.take(10).hand_force_N, 1, 1e-12);
}

TEST(Requests, lower_the_depth_limit_within_the_scenes_and_never_raise_it) {
  const auto station = std::make_unique<LocalStation>();
  ServoConfig config;
  config.limits.penetration_depth_m = 80e-6;
  Requests requests(config, station->station);
  EXPECT_EQ(requests.take(1e-3).depth_limit_m, 80e-6);
  for (const double bad : {0.0, -1e-6, 81e-6, std::nan("")}) {
    ASSERT_TRUE(station->console.queue.try_push({Command::depth_limit, bad}));
  }
  ASSERT_TRUE(station->parent.queue.try_push({Command::depth_limit, 30e-6}));  // not its role
  EXPECT_EQ(requests.take(1e-3).refused, 5U);
  ASSERT_TRUE(station->console.queue.try_push({Command::depth_limit, 30e-6}));
  (void)requests.take(1e-3);
  EXPECT_NEAR(requests.take(1e-3).depth_limit_m, (1 - 2e-3) * 80e-6, 1e-15);
  EXPECT_NEAR(requests.take(10).depth_limit_m, 30e-6, 1e-15);
}

TEST(Requests, change_the_position_scale_within_the_scenes_bounds_and_not_without_them) {
  const auto station = std::make_unique<LocalStation>();
  ServoConfig config;
  const auto ask = [&](double scale) {
    ASSERT_TRUE(station->console.queue.try_push({Command::position_scale, scale}));
  };
  Requests fixed(config, station->station);
  ask(400);
  EXPECT_EQ(fixed.take(1e-3).refused, 1U);
  EXPECT_EQ(fixed.requested().position_scale, 500);
  config.mapping.position_scale_min = 200;
  config.mapping.position_scale_max = 800;
  Requests requests(config, station->station);
  for (const double bad : {199.0, 801.0, 0.0, -500.0, std::nan("")}) {
    ask(bad);
  }
  EXPECT_EQ(requests.take(1e-3).refused, 5U);
  EXPECT_EQ(requests.requested().position_scale, 500);
  ask(250);
  const Requested& taken = requests.take(1e-3);
  EXPECT_EQ(taken.position_scale, 250);
  ASSERT_EQ(taken.taken_count, 1U);  // as the event tells it
  EXPECT_TRUE(taken.taken[0].obeyed);
  EXPECT_EQ(taken.taken[0].command.value, 250);
  ASSERT_TRUE(station->parent.queue.try_push({Command::position_scale, 300}));  // not its role
  EXPECT_EQ(requests.take(1e-3).refused, 6U);
}

TEST(Requests, change_nothing_that_the_scene_does_not_have_or_the_writer_may_not_ask) {
  const auto station = std::make_unique<LocalStation>();
  Requests requests(with_damping(), station->station);
  ASSERT_TRUE(station->console.queue.try_push({Command::effect_gain, 0, effect_cone}));  // not there
  ASSERT_TRUE(station->console.queue.try_push({Command::effect_gain, 0, 1'000'000}));    // no effect
  ASSERT_TRUE(station->console.queue.try_push({Command::effect_gain, 1.5, effect_damping}));
  ASSERT_TRUE(station->parent.queue.try_push({Command::effect_gain, 0, effect_damping}));  // not its role
  EXPECT_EQ(requests.take(1e-3).refused, 4U);
  EXPECT_EQ(requests.take(10).effect_gain, kFullGains);
}

TEST(Requests, tell_of_each_command_who_gave_it_and_whether_it_was_obeyed) {
  const auto station = std::make_unique<LocalStation>();
  Requests requests(with_damping(), station->station);
  ASSERT_TRUE(station->parent.queue.try_push({Command::force_scale, 0.5}));
  ASSERT_TRUE(station->console.queue.try_push({Command::force_scale, 7}));
  const Requested& r = requests.take(1e-3);
  ASSERT_EQ(r.taken_count, 2U);
  EXPECT_TRUE(r.taken[0].obeyed);
  EXPECT_STREQ(kCommandWriters[r.taken[0].writer]->name, "parent");
  EXPECT_FALSE(r.taken[1].obeyed);
  EXPECT_STREQ(kCommandWriters[r.taken[1].writer]->name, "console");
  EXPECT_EQ(r.taken[1].command.value, 7);
  EXPECT_EQ(requests.take(1e-3).taken_count, 0U);
}

}  // namespace
}  // namespace punctum::rt
