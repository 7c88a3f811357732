// The local membrane model against a sphere whose place is known, seen late, through a registration it is not
// told.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "rt/control/local_membrane_model.hpp"
#include "tests/support/tick.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;
using test::kTick_ns;
using test::kTick_s;

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

struct ModelInWorld {
  explicit ModelInWorld(const LocalModelParams& params = {}) : model(params, 3.8e-6, 60e-6) {}
  LocalMembraneModel model;
  World world;
  std::int64_t now = 5'000'000'000;
  Vec3 tip{60e-6, 5e-6, 0};
  int latency = 80;
  bool seeing = true;
  double R_sd_m = 0, a_sd_m = 0;
  double noise_m = 0, error_m = 0;  // of an observation: what it says, and what it has
  std::array<Vec3, 1024> past{};
  std::uint64_t tick = 0;
  bool used = false;

  void step() {
    now += kTick_ns;
    past[tick % 1024] = tip;
    model.push_pose({now, tip + world.registration, world.axis});
    used = false;
    if (seeing && tick % 40 == 0 && tick > static_cast<std::uint64_t>(latency)) {
      Observation o = world.see(past[(tick - latency) % 1024], now - latency * kTick_ns);
      o.noise_m = noise_m;
      o.R_sd_m = R_sd_m;
      o.a_sd_m = a_sd_m;
      o.gap_m += error_m;
      used = model.observe(o, false);
    }
    model.step(now, world.axis, kTick_s);
    ++tick;
  }
  double error() const { return model.depth_m(tip + world.registration) + world.gap(tip); }
};

TEST(LocalMembraneModel, follows_a_moving_needle_between_late_frames) {
  ModelInWorld b;
  double worst = 0;
  for (int k = 0; k < 4000; ++k) {
    b.tip += Vec3(-30e-9, 4e-9 * std::sin(0.01 * k), 0);  // 30 um/s
    b.step();
    if (b.model.membrane().known) {
      worst = std::max(worst, std::abs(b.error()));
    }
  }
  // At 30 um/s an 80 ms old depth taken for the present one would be 2.4 um off.
  EXPECT_LT(worst, 20e-9);
  EXPECT_NEAR(
      (b.model.membrane().entry_m - b.world.registration - (b.world.centre + Vec3(60e-6, 0, 0))).norm(), 0,
      30e-9);
}

// One frame of five shows the gap a micrometre wrong, and says so.
TEST(LocalMembraneModel, is_corrected_less_by_a_doubtful_observation) {
  double worst[2] = {};
  for (const bool says_so : {false, true}) {
    ModelInWorld b;
    for (int k = 0; k < 4000; ++k) {
      const bool doubtful = k / 40 % 5 == 4;
      b.error_m = doubtful ? 1e-6 : 0;
      b.noise_m = doubtful && says_so ? 1e-6 : 0.1e-6;
      b.step();
      if (k > 1000) {
        worst[says_so ? 1 : 0] = std::max(worst[says_so ? 1 : 0], std::abs(b.error()));
      }
    }
  }
  EXPECT_GT(worst[0], 0.2e-6);
  EXPECT_LT(worst[1], 0.05e-6);
}

// The less they tell, the longer it takes; but they are all there is.
TEST(LocalMembraneModel, follows_doubtful_observations_where_there_are_no_others) {
  ModelInWorld b;
  b.noise_m = 1e-6;
  for (int k = 0; k < 500; ++k) {
    b.step();
  }
  b.world.centre += Vec3(4e-6, 0, 0);
  for (int k = 0; k < 400; ++k) {
    b.step();
  }
  EXPECT_GT(std::abs(b.error()), 1e-6);
  for (int k = 0; k < 4000; ++k) {
    b.step();
  }
  EXPECT_LT(std::abs(b.error()), 0.2e-6);
}

TEST(LocalMembraneModel, tells_how_well_it_knows_the_depth) {
  ModelInWorld b;
  EXPECT_EQ(b.model.depth_sd_m(), 0) << "of no cell";
  b.noise_m = 0.5e-6;
  b.R_sd_m = 0.2e-6;
  b.a_sd_m = 0.3e-6;
  while (!b.model.membrane().known) {
    b.step();
  }
  const double first_m = b.model.depth_sd_m();
  EXPECT_NEAR(first_m, 0.5e-6, 0.05e-6);
  for (int k = 0; k < 2000; ++k) {
    b.step();
  }
  const double followed_m = b.model.depth_sd_m();
  EXPECT_LT(followed_m, 0.7 * first_m) << "many pictures say more than one";
  EXPECT_EQ(b.model.R_sd_m(), 0.2e-6);
  EXPECT_EQ(b.model.seen_a_sd_m(), 0.3e-6);
  b.seeing = false;
  for (int k = 0; k < 3000; ++k) {
    b.step();
  }
  EXPECT_GT(b.model.depth_sd_m(), 1.5 * followed_m) << "and an old one less";
  b.model.restart(b.now);
  EXPECT_EQ(b.model.depth_sd_m(), 0);
  EXPECT_EQ(b.model.R_sd_m(), 0);
}

TEST(LocalMembraneModel, refuses_a_deviation_that_is_none) {
  ModelInWorld b;
  for (int k = 0; k < 500; ++k) {
    b.step();
  }
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  for (const auto& [noise_m, R_sd_m, a_sd_m] : {std::array{kNaN, 0.0, 0.0},
                                                {kInfinite, 0.0, 0.0},
                                                {-1e-7, 0.0, 0.0},
                                                {0.0, kNaN, 0.0},
                                                {0.0, -1e-7, 0.0},
                                                {0.0, 0.0, kNaN}}) {
    b.noise_m = noise_m;
    b.R_sd_m = R_sd_m;
    b.a_sd_m = a_sd_m;
    const Vec3 entry = b.model.membrane().entry_m;
    b.error_m = 2e-6;
    for (int k = 0; k < 200; ++k) {
      b.step();
      EXPECT_FALSE(b.used);
    }
    EXPECT_EQ(b.model.membrane().entry_m, entry);
  }
}

TEST(LocalMembraneModel, corrects_itself_at_a_bounded_rate) {
  const LocalModelParams params;
  ModelInWorld b(params);
  for (int k = 0; k < 500; ++k) {
    b.step();
  }
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
  ModelInWorld b(params);
  for (int k = 0; k < 200; ++k) {
    b.step();
  }
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
  ModelInWorld b(params);
  b.tip = Vec3(25e-6, 2e-6, 0);
  for (int k = 0; k < 6000; ++k) {
    if (b.tip.x() > 8e-6) {
      b.tip.x() -= 10e-9;
    }
    b.step();
  }
  EXPECT_NEAR(b.model.dimple_scale(), 0.45, 1e-3);
}

TEST(LocalMembraneModel, fades_when_vision_falls_silent_and_returns_by_a_ramp) {
  const LocalModelParams params;
  ModelInWorld b(params);
  EXPECT_TRUE(b.model.stale());
  EXPECT_EQ(b.model.age_s(), -1);
  for (int k = 0; k < 1500; ++k) {
    b.step();
  }
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
    if (b.model.force_gain() < 1 && b.model.force_gain() > 0) {
      ++fading;
    }
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
  ModelInWorld b;
  for (int k = 0; k < 300; ++k) {
    b.step();
  }
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
  ModelInWorld b;
  for (int k = 0; k < 1500; ++k) {
    b.step();
  }
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
  ModelInWorld b;
  for (int k = 0; k < 1500; ++k) {
    b.step();
  }
  const double z = b.model.membrane().entry_m.z();
  for (int cell = 0; cell < 20; ++cell) {
    b.tip.z() += 2e-6;  // where she happens to be when the next cell comes
    b.model.restart(b.now);
    for (int k = 0; k < 500; ++k) {
      b.step();
    }
    ASSERT_TRUE(b.model.membrane().known);
    EXPECT_NEAR(b.model.membrane().entry_m.z(), z, 1e-12);
  }
}

TEST(LocalMembraneModel, moves_the_entry_in_the_plane_of_the_picture_only_however_the_needle_is_tilted) {
  ModelInWorld b;
  b.world.axis = Vec3(-std::cos(0.2), 0, std::sin(0.2));
  for (int k = 0; k < 500; ++k) {
    b.step();
  }
  const Vec3 before = b.model.membrane().entry_m;
  b.world.R = 63e-6;
  for (int k = 0; k < 1500; ++k) {
    b.step();
  }
  EXPECT_GT((b.model.membrane().entry_m - before).norm(), 2e-6);
  EXPECT_NEAR(b.model.membrane().entry_m.z(), before.z(), 1e-12);
}

TEST(PoseHistory, begins_anew_when_the_clock_jumps_back) {
  static PoseHistory history;
  for (int k = 0; k < 100; ++k) {
    history.push({k * 1'000'000, Vec3(1, 0, 0), -Vec3::UnitX()});
  }
  history.push({2'000'000'000, Vec3(2, 0, 0), -Vec3::UnitX()});  // one tick a second ahead
  for (int k = 101; k < 120; ++k) {
    history.push({k * 1'000'000, Vec3(3, 0, 0), -Vec3::UnitX()});
  }
  TipPose pose;
  EXPECT_FALSE(history.at(50'000'000, pose));
  EXPECT_FALSE(history.at(2'000'000'000, pose));
  ASSERT_TRUE(history.at(110'500'000, pose));
  EXPECT_EQ(pose.tip_m, Vec3(3, 0, 0));
}

TEST(PoseHistory, interpolates_and_reaches_back_more_than_a_second_at_8_k_hz) {
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

// Usable observations of a cell that is there, up to the present.
void see_for(ModelInWorld& b, int ticks) {
  for (int k = 0; k < ticks; ++k) {
    b.step();
  }
}

TEST(LocalMembraneModel, refuses_another_radius_and_another_place_and_is_stale_while_they_last) {
  for (const int claim : {0, 1, 2, 3}) {
    ModelInWorld b;
    see_for(b, 1000);
    const World truth = b.world;
    b.world.R *= claim == 0 ? 1.12 : claim == 1 ? 0.88 : 1;
    b.world.centre += claim == 2 ? Vec3(-35e-6, 0, 0) : claim == 3 ? Vec3(0, 35e-6, 0) : Vec3(0, 0, 0);
    b.step();
    const Vec3 entry = b.model.membrane().entry_m;
    const double R = b.model.R_m();
    see_for(b, 1000);
    EXPECT_TRUE(b.model.implausible()) << claim;
    EXPECT_TRUE(b.model.stale()) << claim;
    EXPECT_LT((b.model.membrane().entry_m - entry).norm(), 1e-9) << claim;
    EXPECT_NEAR(b.model.R_m(), R, 1e-9) << claim;
    b.world = truth;
    see_for(b, 1000);
    EXPECT_FALSE(b.model.implausible() || b.model.stale()) << claim;
  }
}

TEST(LocalMembraneModel, once_touched_moves_no_further_than_picture_and_stage_may_disagree) {
  const LocalModelParams params;
  std::mt19937_64 random(4);
  std::normal_distribution<double> n(0, 1);
  for (int seed = 0; seed < 20; ++seed) {
    ModelInWorld b;
    see_for(b, 1000);
    b.model.touch();
    const Vec3 entry = b.model.membrane().entry_m;
    const double R = b.model.R_m();
    Vec3 drift = Vec3::Zero();
    const Vec3 centre = b.world.centre;
    for (int k = 0; k < 20000; ++k) {
      // A lie that wanders and a lie that grows, back and forth.
      if (k % 500 == 0) {
        drift = 20e-9 * Vec3(n(random), n(random), 0);
      }
      b.world.centre += drift;
      b.world.R = std::max(30e-6, b.world.R + 5e-9 * n(random));
      if ((b.world.centre - centre).norm() > 20e-6) {
        b.world.centre = centre;
        b.world.R = R;
      }
      b.step();
      ASSERT_LE((b.model.membrane().entry_m - entry).head<2>().norm(), params.disagree_m * (1 + 1e-9));
      ASSERT_LE(std::abs(b.model.R_m() - R), 0.1 * R * (1 + 1e-9));
    }
  }
}

TEST(LocalMembraneModel, looks_only_for_cells_as_large_as_the_scene_says) {
  LocalModelParams params;
  params.R_min_m = 35e-6;
  params.R_max_m = 80e-6;
  for (const double R_um : {30.0, 60.0, 90.0}) {
    ModelInWorld b(params);
    b.world.R = 1e-6 * R_um;
    b.tip.x() = 90e-6;
    see_for(b, 500);
    EXPECT_EQ(b.model.membrane().known, R_um == 60.0);
    EXPECT_EQ(b.model.implausible(), R_um != 60.0);
  }
}

TEST(LocalMembraneModel, holds_later_frames_against_the_median_of_the_first_ones) {
  ModelInWorld b;
  b.world.R = 85e-6;
  see_for(b, 121);  // one frame
  ASSERT_TRUE(b.model.membrane().known);
  b.world.R = 60e-6;
  see_for(b, 3000);
  EXPECT_FALSE(b.model.stale() || b.model.implausible());
  EXPECT_NEAR(b.model.first_seen().R_m, 60e-6, 1e-12);
  EXPECT_NEAR(b.model.R_m(), 60e-6, 1e-9);
}

TEST(LocalMembraneModel, counts_no_observation_from_the_future_as_fresh) {
  ModelInWorld b;
  see_for(b, 1000);
  b.seeing = false;
  // One tick ten seconds ahead, with an observation of that time.
  const std::int64_t ahead = b.now + 10'000'000'000;
  b.model.push_pose({ahead, b.tip + b.world.registration, b.world.axis});
  EXPECT_TRUE(b.model.observe(b.world.see(b.tip, ahead), false));
  b.model.step(ahead, b.world.axis, kTick_s);
  int fresh = 0;
  for (int k = 0; k < 2000; ++k) {
    b.step();
    fresh += b.model.stale() ? 0 : 1;
    ASSERT_TRUE(b.model.age_s() == -1 || b.model.age_s() >= 0);
  }
  EXPECT_EQ(fresh, 0);
  b.seeing = true;
  see_for(b, 500);
  EXPECT_FALSE(b.model.stale());
}

TEST(LocalMembraneModel, takes_observations_only_in_their_order_and_only_young_ones) {
  ModelInWorld b;
  see_for(b, 1000);
  b.seeing = false;
  const auto usable = [&](std::uint64_t frame, std::int64_t exposure_ns) {
    Observation o = b.world.see(b.tip, exposure_ns);
    o.frame = frame;
    return b.model.observe(o, false);
  };
  b.step();
  EXPECT_TRUE(usable(100, b.now));
  b.step();
  EXPECT_FALSE(usable(99, b.now));  // a frame that comes again
  EXPECT_TRUE(b.model.implausible());
  EXPECT_TRUE(usable(101, b.now));
  EXPECT_FALSE(usable(102, b.now - 5'000'000));
  EXPECT_FALSE(usable(102, b.now + 1));
  EXPECT_FALSE(usable(102, std::numeric_limits<std::int64_t>::max()));
  EXPECT_FALSE(usable(102, std::numeric_limits<std::int64_t>::min()));
  // Vision was silent: another one may count its frames anew, but what it says must be young.
  see_for(b, 1000);
  ASSERT_TRUE(b.model.stale());
  EXPECT_FALSE(usable(3, b.now - 400'000'000));
  EXPECT_TRUE(usable(4, b.now - 100'000'000));
}

TEST(LocalMembraneModel, believes_a_flag_that_two_observations_in_a_row_show) {
  ModelInWorld b;
  b.tip.x() = 10e-6;
  see_for(b, 1000);
  b.seeing = false;
  const auto see = [&](std::uint32_t flags, double gap_m = -10e-6, double wd_m = 3e-6) {
    b.step();
    Observation o = b.world.see(b.tip, b.now);
    o.flags |= flags;
    o.gap_m = gap_m;
    o.wd_m = wd_m;
    ASSERT_TRUE(b.model.observe(o, false));
  };
  for (int k = 0; k < 50; ++k) {  // it flickers
    see(k % 2 == 0 ? Observation::punctured | Observation::inner_punctured : 0U);
    ASSERT_FALSE(b.model.puncture_seen() || b.model.inner_puncture_seen());
  }
  see(Observation::punctured);
  see(Observation::punctured);
  EXPECT_TRUE(b.model.puncture_seen());
  EXPECT_FALSE(b.model.inner_puncture_seen());
  for (int k = 0; k < 50; ++k) {
    see(k % 2 == 0 ? 0U : Observation::punctured);
    ASSERT_TRUE(b.model.puncture_seen());
  }
  see(0);
  see(0);
  EXPECT_FALSE(b.model.puncture_seen());
  for (int k = 0; k < 10; ++k) {  // by the same frame the tip is outside
    see(Observation::punctured, 1e-6);
    ASSERT_FALSE(b.model.puncture_seen());
  }
  for (int k = 0; k < 10; ++k) {  // the membrane still lies on the tip
    see(Observation::punctured, -10e-6, 10e-6);
    ASSERT_FALSE(b.model.puncture_seen());
  }
}

}  // namespace
}  // namespace punctum::rt
