#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "hal/frames.hpp"
#include "hal/sim/operator/operator.hpp"
#include "hal/sim/plant/hand.hpp"

namespace punctum::sim {
namespace {

TEST(Operator, moves_by_the_minimum_jerk_profile) {
  EXPECT_EQ(minimum_jerk(-1), 0);
  EXPECT_EQ(minimum_jerk(0), 0);
  EXPECT_EQ(minimum_jerk(0.25), 106.0 / 1024);  // 10/64 - 15/256 + 6/1024
  EXPECT_EQ(minimum_jerk(0.5), 0.5);
  EXPECT_EQ(minimum_jerk(2), 1);
  EXPECT_EQ(minimum_jerk_rate(0.5), 1.875);
  EXPECT_EQ(minimum_jerk_rate(0), 0);
  EXPECT_EQ(minimum_jerk_rate(1), 0);
  for (int i = 1; i < 100; ++i) {  // against a difference quotient of the profile
    const double x = 0.01 * i;
    EXPECT_NEAR((minimum_jerk(x + 1e-6) - minimum_jerk(x - 1e-6)) / 2e-6, minimum_jerk_rate(x), 1e-8);
  }
}

// Power of the samples per band by a plain discrete Fourier transform.
double part_in_band(const std::vector<double>& y, double rate_Hz, double low_Hz, double high_Hz) {
  const double n = static_cast<double>(y.size());
  double inside = 0;
  double all = 0;
  for (int k = 1; k * rate_Hz / n < 40; ++k) {
    const double f = k * rate_Hz / n;
    std::complex<double> sum = 0;
    const std::complex<double> turn = std::polar(1.0, -2 * std::numbers::pi * f / rate_Hz);
    std::complex<double> phase = 1;
    for (std::size_t i = 0; i < y.size(); ++i) {
      const double window = 1 - std::cos(2 * std::numbers::pi * static_cast<double>(i) / n);
      sum += y[i] * window * phase;
      phase *= turn;
    }
    all += std::norm(sum);
    if (f >= low_Hz && f <= high_Hz) {
      inside += std::norm(sum);
    }
  }
  return inside / all;
}

TEST(Operator, trembles_between_8_and_12_hertz) {
  const HandParams hand;
  const Tremor tremor(3, 0.25e-3, hand, 250, 6);
  std::vector<double> y;
  for (int i = 0; i < 4000; ++i) {
    y.push_back(tremor.at(i * 0.005).y());
  }
  EXPECT_GT(part_in_band(y, 200, 7.8, 12.2), 0.9999);
}

TEST(Operator, shakes_the_handle_by_what_the_scene_says) {
  HandParams hand;
  hand.coulomb_N = 0;
  const OperatorParams operator_params;
  const ArmImpedance arm{operator_params.arm_stiffness_N_m, operator_params.arm_damping_Ns_m};
  double mean = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Tremor tremor(seed, operator_params.tremor_m, hand, arm.stiffness_N_m, arm.damping_Ns_m);
    HandAxis axis{tremor.at(0).x(), 0};
    double sum = 0;
    const int n = 20'000;
    for (int i = 0; i < n; ++i) {
      const double p0 = tremor.at(0.001 * i).x();
      const double p1 = tremor.at(0.001 * (i + 1)).x();
      advance(axis, hand, arm, 0, p0, (p1 - p0) / 0.001, 0.001);
      sum += axis.x_m * axis.x_m;
    }
    mean += sum / n / 5;
  }
  EXPECT_NEAR(std::sqrt(mean), 0.25e-3, 0.25e-3 * 0.03);
}

TEST(Operator, trembles_the_same_for_the_same_seed_only) {
  const HandParams hand;
  const Tremor a(3, 1, hand, 250, 6);
  const Tremor b(3, 1, hand, 250, 6);
  const Tremor c(4, 1, hand, 250, 6);
  EXPECT_EQ(a.at(1.234), b.at(1.234));
  EXPECT_NE(a.at(1.234), c.at(1.234));
}

TEST(Noise, has_the_moments_of_a_gaussian) {
  const Noise noise(11, Noise::Stream::free_use);
  double sum = 0;
  double square = 0;
  double neighbour = 0;
  const int n = 200'000;
  for (std::uint64_t i = 0; i < n; ++i) {
    const double g = noise.gaussian(i);
    sum += g;
    square += g * g;
    neighbour += g * noise.gaussian(i + 1);
  }
  EXPECT_NEAR(sum / n, 0, 4 / std::sqrt(n));
  EXPECT_NEAR(square / n, 1, 4 * std::sqrt(2.0 / n));
  EXPECT_NEAR(neighbour / n, 0, 4 / std::sqrt(n));
}

// The operator and a stage that follows the hand at once: no arm, no core.
class OperatorAtWork : public testing::Test {
 protected:
  OperatorAtWork() {
    config.operator_params.tremor_m = 0;
    config.operator_params.drift_m_s = 0;
    config.operator_params.aim_error_m = 0;
    view.tip_m = config.stage.start_m;
    view.cell = true;
    view.centre_m = Vec3(-40e-6, 0, 0);
    view.R_m = 60e-6;
  }
  void run(Operator& the_operator, double seconds, bool follows = true) {
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
      const Vec3 before = the_operator.state().arm_target_m;
      the_operator.step(t, t + 0.001, view);
      t += 0.001;
      view.hand_m = the_operator.state().arm_target_m;
      const bool clutched = (the_operator.state().buttons & hal::kButtonClutch) != 0;
      if (follows && !clutched) {
        view.tip_m += world_from_hand(view.hand_m - before) / config.position_scale;
      }
      if (puncture_at > 0 && depth() > puncture_at) {
        view.punctured = true;
      }
    }
  }
  [[nodiscard]] double depth() const { return view.centre_m.x() + view.R_m - view.tip_m.x(); }
  SimConfig config;
  OperatorView view;
  double t = 0;
  double puncture_at = 0;
};

TEST_F(OperatorAtWork, goes_through_an_injection_in_order) {
  puncture_at = 20e-6;
  Operator the_operator(config);
  std::vector<Activity> seen;
  bool injected = false;
  double deepest = 0;
  for (int i = 0; i < 300 && the_operator.state().activity != Activity::rest; ++i) {
    run(the_operator, 0.1);
    if (seen.empty() || seen.back() != the_operator.state().activity) {
      seen.push_back(the_operator.state().activity);
    }
    injected = injected || (the_operator.state().buttons & hal::kButtonInject) != 0;
    deepest = std::max(deepest, depth());
  }
  const std::vector<Activity> expected = {Activity::settle,  Activity::approach, Activity::indent,
                                          Activity::push_on, Activity::inject,   Activity::withdraw,
                                          Activity::rest};
  EXPECT_EQ(seen, expected);
  EXPECT_TRUE(injected);
  EXPECT_NEAR(deepest, 20e-6 + config.operator_params.depth_m, 2e-6);
  EXPECT_LT(depth(), -20e-6);
}

TEST_F(OperatorAtWork, notices_the_puncture_after_the_reaction_time) {
  config.operator_params.reaction_s = 0.4;
  Operator the_operator(config);
  while (the_operator.state().activity != Activity::indent) {
    run(the_operator, 0.01);
  }
  run(the_operator, 1);
  view.punctured = true;
  run(the_operator, 0.38);
  EXPECT_EQ(the_operator.state().activity, Activity::indent);
  run(the_operator, 0.04);
  EXPECT_EQ(the_operator.state().activity, Activity::push_on);
}

TEST_F(OperatorAtWork, draws_back_a_second_after_the_needle_is_refused) {
  Operator the_operator(config);
  while (the_operator.state().activity != Activity::indent) {
    run(the_operator, 0.01);
  }
  run(the_operator, 1.5);
  double held = 0;
  while (the_operator.state().activity == Activity::indent && held < 10) {
    run(the_operator, 0.05, false);
    held += 0.05;
  }
  EXPECT_EQ(the_operator.state().activity, Activity::withdraw);
  EXPECT_GT(held, 0.9);
  EXPECT_LT(held, 3.0);
  run(the_operator, 10);  // it follows again: the operator starts over
  EXPECT_EQ(the_operator.state().attempts, 1U);
  EXPECT_NE(the_operator.state().activity, Activity::rest);
}

TEST_F(OperatorAtWork, does_not_push_against_a_refusal_for_ever) {
  Operator the_operator(config);
  while (the_operator.state().activity != Activity::indent) {
    run(the_operator, 0.01);
  }
  const Vec3 before = view.hand_m;
  run(the_operator, 60, false);
  EXPECT_LT((view.hand_m - before).norm(), 2 * config.hand.workspace_m);
  EXPECT_LT(view.hand_m.cwiseAbs().maxCoeff(), config.hand.workspace_m);
}

TEST_F(OperatorAtWork, gives_up_a_membrane_that_does_not_give) {
  Operator the_operator(config);
  double deepest = 0;
  for (int i = 0; i < 1500 && the_operator.state().activity != Activity::rest; ++i) {
    run(the_operator, 0.1);
    deepest = std::max(deepest, depth());
  }
  EXPECT_EQ(the_operator.state().activity, Activity::rest);
  EXPECT_EQ(the_operator.state().given_up, 1U);
  EXPECT_LT(deepest, view.R_m);
}

TEST_F(OperatorAtWork, uses_the_clutch_before_the_end_of_the_workspace) {
  config.position_scale = 1500;  // 70 um to the membrane are 105 mm of the hand
  puncture_at = 20e-6;
  Operator the_operator(config);
  double furthest = 0;
  for (int i = 0; i < 600 && the_operator.state().activity != Activity::rest; ++i) {
    run(the_operator, 0.1);
    furthest = std::max(furthest, view.hand_m.cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(the_operator.state().activity, Activity::rest);
  EXPECT_EQ(the_operator.state().given_up, 0U);
  EXPECT_GE(the_operator.state().clutched, 1U);
  EXPECT_LT(furthest, config.hand.workspace_m);
}

TEST_F(OperatorAtWork, asks_for_the_next_cell_and_comes_back) {
  config.cells = 2;
  puncture_at = 20e-6;
  Operator the_operator(config);
  int presses = 0;
  bool down = false;
  for (int i = 0; i < 60'000 && the_operator.state().activity != Activity::rest; ++i) {
    run(the_operator, 0.001001);
    const bool now = (the_operator.state().buttons & hal::kButtonNextCell) != 0;
    if (now && !down) {
      ++presses;
      view.punctured = false;
      ++view.cell_index;
    }
    down = now;
  }
  EXPECT_EQ(presses, 1);
  EXPECT_EQ(the_operator.state().cells_done, 2U);
}

TEST_F(OperatorAtWork, gives_way_to_a_sideways_force) {
  config.stage.start_m = Vec3(90e-6, 0, 0);  // the path has no sideways part
  view.tip_m = config.stage.start_m;
  Operator the_operator(config);
  run(the_operator, 1);
  const double before = the_operator.state().intention_m.y;
  for (int i = 0; i < 500; ++i) {  // the handle stands 2 mm to the side of the intended position
    view.hand_m = the_operator.state().arm_target_m.vec() + Vec3(0, 2e-3, 0);
    the_operator.step(t, t + 0.001, view);
    t += 0.001;
  }
  EXPECT_NEAR(the_operator.state().intention_m.y - before, 2.0 * 2e-3 * (0.5 - 0.15), 0.1e-3);
}

TEST_F(OperatorAtWork, misjudges_the_axis_by_what_the_scene_says) {
  config.operator_params.aim_error_m = 4e-6;
  double across = 0;
  double deep = 0;
  const int n = 400;
  for (int seed = 1; seed <= n; ++seed) {
    config.seed = static_cast<std::uint64_t>(seed);
    Operator the_operator(config);
    t = 0;
    view.tip_m = config.stage.start_m;
    run(the_operator, 0.6);
    const Vec3 off = the_operator.state().target_m.vec() - (view.centre_m + Vec3(60e-6, 0, 0));
    across += off.y() * off.y() / n;
    deep += off.z() * off.z() / n;
  }
  EXPECT_NEAR(std::sqrt(across), 4e-6, 0.6e-6);
  EXPECT_NEAR(std::sqrt(deep), 6e-6, 0.9e-6);  // depth is judged worse
}

TEST_F(OperatorAtWork, strokes_to_and_fro_without_a_cell) {
  view.cell = false;
  Operator the_operator(config);
  double least = 0;
  double most = 0;
  for (int i = 0; i < 200; ++i) {
    run(the_operator, 0.1);
    least = std::min(least, the_operator.state().intention_m.x);
    most = std::max(most, the_operator.state().intention_m.x);
  }
  EXPECT_NEAR(least, -0.030, 1e-4);
  EXPECT_NEAR(most, 0, 1e-4);
}

}  // namespace
}  // namespace punctum::sim
