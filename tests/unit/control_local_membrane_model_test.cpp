// The local membrane model against a sphere whose place is known, seen late, through a registration it is not
// told.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "rt/control/local_membrane_model.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
constexpr std::int64_t kTick_ns = 1'000'000;
constexpr double kTick_s = 1e-3;

// A cell in the picture; the stage's encoders read tip + registration.
struct World {
  Vec3 centre{-40e-6, 2e-6, 0};
  double R = 60e-6;
  Vec3 axis = -Vec3::UnitX();
  Vec3 registration{3e-6, -2e-6, 1e-6};

  double gap(const Vec3& tip) const {  // along the axis from the tip to the sphere
    const Vec3 V = tip - centre;
    const double along = V.dot(axis);
    const double r2 = (V - along * axis).squaredNorm();
    return -std::sqrt(R * R - r2) - along;
  }
  Observation see(const Vec3& tip, std::int64_t t_ns) const {
    Observation o;
    o.exposure_ns = t_ns;
    o.flags = Observation::tip_ok | Observation::outer_ok;
    for (int i = 0; i < 2; ++i) {  // z is 0: one picture does not tell depth
      o.tip_m[i] = tip[i];
      o.centre_m[i] = centre[i];
    }
    o.R_m = R;
    o.gap_m = gap(tip);
    if (o.gap_m < 0) {
      o.flags |= Observation::contact;
      o.wd_m = -o.gap_m;
      o.a_m = 3.8e-6 + 0.45 * std::sqrt(2 * R * o.wd_m);
    }
    return o;
  }
};

struct Bench {
  explicit Bench(const LocalModelParams& params = {}) : model(params, 3.8e-6, 60e-6) {}
  LocalMembraneModel model;
  World world;
  std::int64_t now = 5'000'000'000;
  Vec3 tip{60e-6, 5e-6, 0};
  int latency = 80;
  bool seeing = true;
  std::array<Vec3, 1024> past{};
  std::uint64_t tick = 0;
  bool used = false;

  void step() {
    now += kTick_ns;
    past[tick % 1024] = tip;
    model.push_pose({now, tip + world.registration, world.axis});
    used = false;
    if (seeing && tick % 40 == 0 && tick > static_cast<std::uint64_t>(latency)) {
      used = model.observe(world.see(past[(tick - latency) % 1024], now - latency * kTick_ns), false);
    }
    model.step(now, world.axis, kTick_s);
    ++tick;
  }
  double error() const { return model.depth_m(tip + world.registration) + world.gap(tip); }
};

TEST(LocalMembraneModel, follows_a_moving_needle_between_late_frames) {
  Bench b;
  double worst = 0;
  for (int k = 0; k < 4000; ++k) {
    b.tip += Vec3(-30e-9, 4e-9 * std::sin(0.01 * k), 0);  // 30 um/s
    b.step();
    if (b.model.membrane().known) worst = std::max(worst, std::abs(b.error()));
  }
  // At 30 um/s an 80 ms old depth taken for the present one would be 2.4 um off.
  EXPECT_LT(worst, 20e-9);
  EXPECT_NEAR(
      (b.model.membrane().entry_m - b.world.registration - (b.world.centre + Vec3(60e-6, 0, 0))).norm(), 0,
      30e-9);
}

TEST(LocalMembraneModel, corrects_itself_at_a_bounded_rate) {
  const LocalModelParams params;
  Bench b(params);
  for (int k = 0; k < 500; ++k) b.step();
  b.world.centre += Vec3(25e-6, -10e-6, 0);  // the cell is pushed
  Vec3 entry = b.model.membrane().entry_m;
  double fastest = 0;
  for (int k = 0; k < 3000; ++k) {
    b.step();
    fastest = std::max(fastest, (b.model.membrane().entry_m - entry).norm() / kTick_s);
    entry = b.model.membrane().entry_m;
  }
  EXPECT_LE(fastest, params.max_rate_m_s * (1 + 1e-9));
  EXPECT_LT(std::abs(b.error()), 1e-9);
}

TEST(LocalMembraneModel, stays_bounded_whatever_vision_claims) {
  LocalModelParams params;
  params.dimple_scale_rate_1_s = 0.5;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> u(-1, 1);
  std::uniform_int_distribution<int> pick(0, 9);
  const auto wild = [&]() -> double {
    switch (pick(random)) {
      case 0:
        return std::numeric_limits<double>::quiet_NaN();
      case 1:
        return std::numeric_limits<double>::infinity();
      case 2:
        return 1e300;
      case 3:
        return -1e-3;
      default:
        return 200e-6 * u(random);
    }
  };
  Bench b(params);
  for (int k = 0; k < 200; ++k) b.step();
  b.seeing = false;
  Vec3 entry = b.model.membrane().entry_m;
  double R = b.model.R_m();
  double scale = b.model.dimple_scale();
  for (int k = 0; k < 50000; ++k) {
    Observation o;
    o.exposure_ns = b.now - 1'000'000 * pick(random);
    o.flags = static_cast<std::uint32_t>(pick(random) * 7);
    for (int i = 0; i < 3; ++i) {
      o.tip_m[i] = wild();
      o.centre_m[i] = wild();
    }
    o.gap_m = wild();
    o.R_m = wild();
    o.wd_m = wild();
    o.a_m = wild();
    (void)b.model.observe(o, pick(random) == 0);
    b.step();
    ASSERT_TRUE(b.model.membrane().entry_m.allFinite());
    ASSERT_LE((b.model.membrane().entry_m - entry).norm(), params.max_rate_m_s * kTick_s * (1 + 1e-9));
    ASSERT_LE(std::abs(b.model.R_m() - R), params.max_rate_m_s * kTick_s * (1 + 1e-9));
    ASSERT_GT(b.model.R_m(), 3.8e-6);
    ASSERT_LE(std::abs(b.model.dimple_scale() - scale), params.dimple_scale_rate_1_s * kTick_s * (1 + 1e-9));
    ASSERT_GE(b.model.dimple_scale(), 0.1);
    ASSERT_LE(b.model.dimple_scale(), 3);
    entry = b.model.membrane().entry_m;
    R = b.model.R_m();
    scale = b.model.dimple_scale();
  }
}

TEST(LocalMembraneModel, learns_the_width_of_the_dimple_when_it_may) {
  LocalModelParams params;
  params.dimple_scale_rate_1_s = 0.5;
  Bench b(params);
  b.tip = Vec3(25e-6, 2e-6, 0);
  for (int k = 0; k < 6000; ++k) {
    if (b.tip.x() > 8e-6) b.tip.x() -= 10e-9;
    b.step();
  }
  EXPECT_NEAR(b.model.dimple_scale(), 0.45, 1e-3);
}

TEST(LocalMembraneModel, fades_when_vision_falls_silent_and_returns_by_a_ramp) {
  const LocalModelParams params;
  Bench b(params);
  EXPECT_TRUE(b.model.stale());
  EXPECT_EQ(b.model.age_s(), -1);
  for (int k = 0; k < 1500; ++k) b.step();
  EXPECT_FALSE(b.model.stale());
  EXPECT_EQ(b.model.force_gain(), 1);

  b.seeing = false;
  const std::int64_t newest = b.now - static_cast<std::int64_t>(b.model.age_s() * 1e9);
  double gain = 1;
  int fading = 0;
  for (int k = 0; k < 1000; ++k) {
    b.step();
    const double age = static_cast<double>(b.now - newest) * 1e-9;
    EXPECT_NEAR(b.model.age_s(), age, 1e-6);
    EXPECT_EQ(b.model.stale(), b.model.age_s() > params.stale_after_s);
    EXPECT_EQ(b.model.overdue(), b.model.stale());
    EXPECT_LE(b.model.force_gain(), gain);
    EXPECT_LT(gain - b.model.force_gain(), 2 * kTick_s / params.fade_s);
    if (b.model.force_gain() < 1 && b.model.force_gain() > 0) ++fading;
    gain = b.model.force_gain();
  }
  EXPECT_EQ(gain, 0);
  EXPECT_NEAR(fading * kTick_s, params.fade_s, 0.01);

  b.seeing = true;
  for (int k = 0; k < 1000; ++k) {
    b.step();
    EXPECT_LT(b.model.force_gain() - gain, 2 * kTick_s / params.return_s);
    gain = b.model.force_gain();
  }
  EXPECT_EQ(gain, 1);
}

TEST(LocalMembraneModel, believes_only_frames_that_show_needle_and_cell) {
  Bench b;
  for (int k = 0; k < 300; ++k) b.step();
  b.seeing = false;
  b.step();
  const auto usable = [&](auto&& change, bool inside = false) {
    b.step();
    Observation o = b.world.see(b.tip, b.now);
    change(o);
    return b.model.observe(o, inside);
  };
  EXPECT_TRUE(usable([](Observation&) {}));
  EXPECT_FALSE(usable([](Observation& o) { o.flags &= ~Observation::tip_ok; }));
  EXPECT_FALSE(usable([](Observation& o) { o.flags &= ~Observation::outer_ok; }));
  EXPECT_TRUE(usable([](Observation& o) { o.flags &= ~Observation::outer_ok; }, true));
  EXPECT_FALSE(usable([](Observation& o) { o.flags = 0; }, true));
  EXPECT_FALSE(usable([](Observation& o) { o.gap_m = std::nan(""); }));
  EXPECT_FALSE(usable([](Observation& o) { o.tip_m[1] = std::nan(""); }));
  EXPECT_FALSE(usable([](Observation& o) { o.centre_m[0] = 1e300; }));
  EXPECT_FALSE(usable([](Observation& o) { o.R_m = 0; }));
  EXPECT_FALSE(usable([](Observation& o) { o.exposure_ns += 1'000'000; }));       // from the future
  EXPECT_FALSE(usable([](Observation& o) { o.exposure_ns -= 20'000'000'000; }));  // older than the history
  // Older than one that was used: the newest wins.
  EXPECT_TRUE(usable([](Observation&) {}));
  EXPECT_FALSE(usable([](Observation& o) { o.exposure_ns -= 5'000'000; }));
}

TEST(LocalMembraneModel, forgets_the_old_cell_and_waits_for_a_frame_of_the_new_one) {
  Bench b;
  for (int k = 0; k < 1500; ++k) b.step();
  b.model.restart(b.now);
  EXPECT_FALSE(b.model.membrane().known);
  EXPECT_TRUE(b.model.stale());
  EXPECT_EQ(b.model.force_gain(), 0);
  // Frames exposed before the restart come in for another 80 ms.
  int ticks = 0;
  while (!b.model.membrane().known && ticks < 1000) {
    b.step();
    ++ticks;
  }
  EXPECT_GE(ticks, b.latency);
  EXPECT_LE(ticks, b.latency + 41);
}

TEST(LocalMembraneModel, keeps_the_focal_plane_from_cell_to_cell) {
  Bench b;
  for (int k = 0; k < 1500; ++k) b.step();
  const double z = b.model.membrane().entry_m.z();
  for (int cell = 0; cell < 20; ++cell) {
    b.tip.z() += 2e-6;  // where she happens to be when the next cell comes
    b.model.restart(b.now);
    for (int k = 0; k < 500; ++k) b.step();
    ASSERT_TRUE(b.model.membrane().known);
    EXPECT_NEAR(b.model.membrane().entry_m.z(), z, 1e-12);
  }
}

TEST(PoseHistory, begins_anew_when_the_clock_jumps_back) {
  static PoseHistory history;
  for (int k = 0; k < 100; ++k) history.push({k * 1'000'000, Vec3(1, 0, 0), -Vec3::UnitX()});
  history.push({2'000'000'000, Vec3(2, 0, 0), -Vec3::UnitX()});  // one tick a second ahead
  for (int k = 101; k < 120; ++k) history.push({k * 1'000'000, Vec3(3, 0, 0), -Vec3::UnitX()});
  TipPose pose;
  EXPECT_FALSE(history.at(50'000'000, pose));
  EXPECT_FALSE(history.at(2'000'000'000, pose));
  ASSERT_TRUE(history.at(110'500'000, pose));
  EXPECT_EQ(pose.tip_m, Vec3(3, 0, 0));
}

TEST(PoseHistory, interpolates_and_reaches_back_more_than_a_second_at_8_kHz) {
  static PoseHistory history;
  const auto place = [](double t) { return Vec3(1e-6 * t, 2e-6 * t * 3, -t * 1e-6); };
  const std::int64_t dt = 125'000;
  const int n = 40000;
  for (int k = 0; k < n; ++k) {
    history.push({k * dt, place(static_cast<double>(k * dt) * 1e-9), -Vec3::UnitX()});
  }
  std::mt19937_64 random(2);
  const std::int64_t newest = (n - 1) * dt;
  std::uniform_int_distribution<std::int64_t> back(0, 1'000'000'000);
  TipPose pose;
  for (int k = 0; k < 10000; ++k) {
    const std::int64_t t = newest - back(random);
    ASSERT_TRUE(history.at(t, pose));
    ASSERT_EQ(pose.t_ns, t);
    ASSERT_LT((pose.tip_m - place(static_cast<double>(t) * 1e-9)).norm(), 1e-18);
  }
  EXPECT_FALSE(history.at(newest + 1, pose));
  EXPECT_FALSE(history.at(newest - static_cast<std::int64_t>(PoseHistory::kSize) * dt, pose));
  EXPECT_TRUE(history.at(newest, pose));
}

}  // namespace
}  // namespace punctum::rt
