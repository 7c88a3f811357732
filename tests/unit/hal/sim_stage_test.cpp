#include <gtest/gtest.h>

#include <cmath>

#include "hal/sim/plant/stage.hpp"

namespace punctum::sim {
namespace {

constexpr double kTick = 0.001;

class SimStageTest : public testing::Test {
 protected:
  SimStageTest() { params.registration_m = Vec3::Zero(); }
  void run(SimStage& stage, double seconds, bool power = true, Failure failure = Failure::none) {
    const int ticks = static_cast<int>(std::lround(seconds / kTick));
    for (int i = 0; i < ticks; ++i) {
      stage.step(t_ns += 1'000'000, kTick, power, failure);
    }
  }
  static hal::StageState read(SimStage& stage) {
    hal::StageState s;
    EXPECT_EQ(stage.read(s), hal::Status::ok);
    return s;
  }
  StageParams params;
  std::int64_t t_ns = 0;
};

TEST_F(SimStageTest, follows_a_step_as_a_first_order_lag) {
  params.velocity_max_m_s = 1;
  SimStage stage(params);
  stage.enable(true);
  run(stage, kTick);
  const Vec3 from = params.start_m;
  const Vec3 step(1e-6, -2e-6, 0.4e-6);
  ASSERT_EQ(stage.command({from + step, params.axis}), hal::Status::ok);
  for (const double t : {0.001, 0.004, 0.010, 0.020}) {
    const double before = static_cast<double>(t_ns) * 1e-9 - kTick;
    run(stage, t - before);
    const Vec3 expected = from + step * (1 - std::exp(-t / params.lag_s));
    EXPECT_NEAR((stage.state().tip_m.vec() - expected).norm(), 0, 1e-18) << t;
  }
}

TEST_F(SimStageTest, is_no_faster_than_it_can_be_and_then_lags_in_exactly) {
  params.velocity_max_m_s = 100e-6;
  params.lag_s = 0.01;
  SimStage stage(params);
  stage.enable(true);
  run(stage, kTick);
  const Vec3 to = params.start_m + Vec3(-21e-6, 0, 0);
  ASSERT_EQ(stage.command({to, params.axis}), hal::Status::ok);
  // 20 um at full speed take 0.2 s, the last 100 um/s * 10 ms = 1 um comes in exponentially.
  run(stage, 0.1);
  EXPECT_NEAR(stage.state().tip_m.x, params.start_m.x() - 10e-6, 1e-16);
  run(stage, 0.1 + 0.02);
  EXPECT_NEAR(stage.state().tip_m.x, to.x() + 1e-6 * std::exp(-2.0), 1e-16);
  EXPECT_NEAR(stage.state().velocity_m_s.x, -100e-6 * std::exp(-2.0), 1e-14);
}

TEST_F(SimStageTest, shows_the_error_it_follows_with) {
  SimStage stage(params);
  stage.enable(true);
  run(stage, kTick);
  ASSERT_EQ(stage.command({params.start_m + Vec3(0, 8e-6, 0), params.axis}), hal::Status::ok);
  run(stage, params.lag_s);
  EXPECT_NEAR(read(stage).following_error_m.y(), 8e-6 - (stage.state().tip_m.y - params.start_m.y()), 1e-15);
  run(stage, 0.2);
  EXPECT_NEAR(read(stage).following_error_m.norm(), 0, 1e-12);
  EXPECT_TRUE(read(stage).at_standstill);
}

TEST_F(SimStageTest, reads_in_its_own_frame_and_in_steps_of_its_encoders) {
  params.registration_m = Vec3(3e-6, -2e-6, 0);
  SimStage stage(params);
  run(stage, kTick);
  const Vec3 seen = read(stage).tip_m;
  EXPECT_NEAR((seen - (params.start_m + params.registration_m)).cwiseAbs().maxCoeff(), 0, 0.0201e-6);
  for (int i = 0; i < 3; ++i) {
    const double counts = seen[i] / params.resolution_m;
    EXPECT_NEAR(counts, std::round(counts), 1e-6);
  }
  stage.enable(true);
  run(stage, kTick);
  ASSERT_EQ(stage.command({Vec3(50e-6, 0, 0), params.axis}), hal::Status::ok);
  run(stage, 1);
  EXPECT_NEAR(stage.state().tip_m.x, 47e-6, 1e-12);
  EXPECT_NEAR(read(stage).tip_m.x(), 50e-6, 1e-12);
}

TEST_F(SimStageTest, ends_at_its_travel) {
  params.travel_m = 120e-6;
  SimStage stage(params);
  stage.enable(true);
  run(stage, kTick);
  ASSERT_EQ(stage.command({Vec3(1, 0, 0), params.axis}), hal::Status::ok);
  run(stage, 2);
  EXPECT_NEAR(read(stage).tip_m.x(), 120e-6, 1e-9);
}

TEST_F(SimStageTest, quick_stop_brakes_on_the_ramp_and_holds) {
  params.velocity_max_m_s = 1e-3;
  params.brake_m_s2 = 0.5;
  SimStage stage(params);
  stage.enable(true);
  run(stage, kTick);
  ASSERT_EQ(stage.command({params.start_m + Vec3(1e-3, 0, 0), params.axis}), hal::Status::ok);
  run(stage, 0.1);
  const double at = stage.state().tip_m.x;
  stage.quick_stop();
  run(stage, 0.002);                                                        // v / a
  EXPECT_NEAR(stage.state().tip_m.x - at, 1e-3 * 1e-3 / (2 * 0.5), 1e-15);  // v^2 / 2a
  EXPECT_EQ(stage.state().velocity_m_s.x, 0);
  ASSERT_EQ(stage.command({params.start_m, params.axis}), hal::Status::ok);
  run(stage, 0.1);
  EXPECT_NEAR(stage.state().tip_m.x - at, 1e-6, 1e-15);
  EXPECT_FALSE(read(stage).enabled);
}

TEST_F(SimStageTest, moves_again_only_after_it_was_switched_off_and_on) {
  SimStage stage(params);
  stage.enable(true);
  run(stage, kTick);
  stage.quick_stop();
  run(stage, 0.05);
  stage.enable(true);
  run(stage, kTick);
  EXPECT_FALSE(read(stage).enabled);
  stage.enable(false);
  run(stage, kTick);
  stage.enable(true);
  run(stage, kTick);
  EXPECT_TRUE(read(stage).enabled);
  EXPECT_NEAR(read(stage).following_error_m.norm(), 0, 1e-15);
}

TEST_F(SimStageTest, brakes_without_power_and_goes_on_from_where_it_stands) {
  SimStage stage(params);
  stage.enable(true);
  run(stage, kTick);
  ASSERT_EQ(stage.command({params.start_m + Vec3(-100e-6, 0, 0), params.axis}), hal::Status::ok);
  run(stage, 0.02);
  run(stage, 0.05, false);
  const double stands = stage.state().tip_m.x;
  EXPECT_EQ(stage.state().velocity_m_s.x, 0);
  EXPECT_LT(stands, params.start_m.x() - 20e-6);
  run(stage, 0.05);
  EXPECT_EQ(stage.state().tip_m.x, stands);
  EXPECT_TRUE(read(stage).enabled);
}

TEST_F(SimStageTest, does_not_move_before_it_is_enabled) {
  SimStage stage(params);
  ASSERT_EQ(stage.command({Vec3::Zero(), params.axis}), hal::Status::ok);
  run(stage, 0.1);
  EXPECT_EQ(stage.state().tip_m.x, params.start_m.x());
}

TEST_F(SimStageTest, tilts_the_needle_within_its_limit) {
  SimStage stage(params);
  stage.enable(true);
  run(stage, kTick);
  const Vec3 wanted = Vec3(-std::cos(0.05), std::sin(0.05), 0);
  ASSERT_EQ(stage.command({params.start_m, wanted}), hal::Status::ok);
  run(stage, 0.2);
  EXPECT_NEAR(read(stage).axis.dot(wanted), 1, 1e-12);
  EXPECT_NEAR(read(stage).axis.norm(), 1, 1e-15);
  ASSERT_EQ(stage.command({params.start_m, Vec3(0, 1, 0)}), hal::Status::ok);
  run(stage, 0.5);
  EXPECT_NEAR(std::acos(read(stage).axis.dot(params.axis)), SimStage::kTiltMax_rad, 1e-9);
}

TEST_F(SimStageTest, refuses_a_set_point_that_is_not_a_number) {
  SimStage stage(params);
  stage.enable(true);
  run(stage, kTick);
  EXPECT_EQ(stage.command({Vec3(std::nan(""), 0, 0), params.axis}), hal::Status::fault);
  run(stage, 0.1);
  EXPECT_EQ(stage.state().tip_m.x, params.start_m.x());
}

}  // namespace
}  // namespace punctum::sim
