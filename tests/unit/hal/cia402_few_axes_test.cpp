// A stage of one or two emulated drives takes the needle through a whole injection: it moves along the axes
// that there are, whatever hand, guide and vision want beside them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/cia402/calibration.hpp"
#include "hal/cia402/cia402_stage.hpp"
#include "rt/control/servo.hpp"
#include "rt/station/station.hpp"
#include "tests/support/fake_devices.hpp"
#include "tests/support/invariants.hpp"
#include "tests/support/virtual_can.hpp"
#include "tests/support/watched_devices.hpp"

namespace punctum::cia402 {
namespace {

using hal::Vec3;
using rt::Fault;
using rt::Phase;

constexpr std::int64_t kEveryTick_ns = 1'000'000;
constexpr double kScale = 500;  // hand metres per needle metre

class FewAxes {
 public:
  explicit FewAxes(const std::vector<Vec3>& counts_m) {
    params.axis_count = static_cast<int>(counts_m.size());
    for (std::size_t i = 0; i < counts_m.size(); ++i) {
      params.axes[i].node = static_cast<int>(i) + 1;
      params.axes[i].count_m = counts_m[i];
      can.add({.node = params.axes[i].node});
    }
    params.tip_m = kStart_m;
    params.needle =
        Vec3(-1, 0, 0.015).normalized();  // beside what the axes can do, as far as a scene may say
    can.sleep_until_ns(can.now_ns() + kEveryTick_ns);
    stage.emplace(params, 1e-3, can, can.master());
    const auto opened = stage->open();
    EXPECT_TRUE(opened) << opened.error();
    EXPECT_TRUE(stage->start(can.now_ns()));
    config.membrane.emplace();
    config.cone.emplace();
    config.axis.emplace();
    config.guard.emplace();
    config.injector.emplace();
    config.cells = 0;
    config.real_actuators = true;
    config.mapping.max_tilt_rad = 0;
    config.stage_reach = reach_of_axes(params);
    checker.emplace(config);
    watched.emplace(rt::Devices{hand, &*stage, &estop, &injector});
    servo.emplace(config, watched->devices(), station->station);
  }

  [[nodiscard]] Vec3 tip_m() {
    Vec3 tip_m = params.tip_m;
    for (int i = 0; i < params.axis_count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      tip_m += params.axes[k].count_m * can.drive(k).position();
    }
    return tip_m;
  }
  [[nodiscard]] Phase phase() const { return servo->phase(); }
  // Of a hand that rests, across the needle.
  [[nodiscard]] double sideways_N() const { return std::hypot(hand.force.y(), hand.force.z()); }

  void ticks(int n) {
    for (int i = 0; i < n; ++i) {
      tick();
    }
  }
  // Where the operator wants the tip: x from here to there, at this speed. Meanwhile the hand goes beside it.
  void move(double to_m, double speed_m_s) {
    const double from_m = wanted_m.x();
    const int n = static_cast<int>(std::abs(to_m - from_m) / speed_m_s / 1e-3);
    for (int k = 1; k <= n; ++k) {
      wanted_m.x() = from_m + (to_m - from_m) * k / n;
      tick();
    }
  }
  void go_in() {
    while (phase() != Phase::puncture && ticked < 60'000) {
      wanted_m.x() -= 5e-9;
      tick();
    }
    ASSERT_EQ(phase(), Phase::puncture);
    move(wanted_m.x() - 10e-6, 20e-6);
  }
  void expect_whole_and_safe() {
    EXPECT_EQ(servo->fault(), Fault::none);
    EXPECT_EQ(order, (std::vector{Phase::free, Phase::contact, Phase::indentation, Phase::puncture,
                                  Phase::injection, Phase::withdrawal, Phase::clear}));
    std::string broken;
    for (const rt::test::Broken& b : checker->broken()) {
      broken += std::string(rt::test::name(b.what).number) + " ";
    }
    EXPECT_EQ(broken, "");
    EXPECT_LT(out_of_reach_m, 1e-12) << "of the set-points";
    EXPECT_LT(largest_error_m, 1e-6) << "of the drives";
    EXPECT_LT((watched->seen.stage.axis - Vec3(-1, 0, 0)).norm(), 1e-12) << "told along the way that it goes";
  }

  tests::VirtualCan can;
  CanStageParams params;
  std::optional<Cia402Stage> stage;
  rt::ServoConfig config;
  rt::test::FakeHand hand;
  rt::test::FakeEstop estop;
  rt::test::FakeInjector injector;
  std::unique_ptr<rt::LocalStation> station = std::make_unique<rt::LocalStation>();
  std::optional<tests::WatchedDevices> watched;
  std::optional<rt::test::Invariants> checker;
  std::optional<rt::Servo> servo;

  Vec3 wanted_m = kStart_m;
  Vec3 centre_m{-40e-6, 0, 0};
  bool seeing = true;
  std::vector<Phase> order{Phase::free};
  double out_of_reach_m = 0, largest_error_m = 0;
  int ticked = 0;
  inline static const Vec3 kStart_m{60e-6, 2e-6, 0};

 private:
  static constexpr double kR_m = 60e-6, kPuncture_m = 14e-6;
  static constexpr int kFrameEvery = 40, kFrameLate = 60;  // ticks

  void look() {
    const Vec3 V = tip_m() - centre_m;
    const double gap_m = V.x() - std::sqrt(std::max(0.0, kR_m * kR_m - V.y() * V.y() - V.z() * V.z()));
    punctured_ = gap_m <= 10e-6 && (punctured_ || -gap_m > kPuncture_m);
    if (seeing && ticked % kFrameEvery == 0) {
      rt::Observation o;
      o.exposure_ns = can.now_ns();
      o.flags = rt::Observation::tip_ok | rt::Observation::outer_ok |
                (punctured_ ? rt::Observation::punctured : 0U) | (gap_m < 0 ? rt::Observation::contact : 0U);
      for (int i = 0; i < 2; ++i) {
        o.tip_m[i] = tip_m()[i];
        o.centre_m[i] = centre_m[i];
      }
      o.R_m = kR_m;
      o.gap_m = gap_m;
      if (gap_m < 0) {
        o.wd_m = punctured_ ? 0 : -gap_m;
        o.a_m = 3.8e-6 + 0.45 * std::sqrt(2 * kR_m * -gap_m);
      }
      on_their_way_.emplace_back(ticked + kFrameLate, o);
    }
    while (!on_their_way_.empty() && on_their_way_.front().first <= ticked) {
      const rt::Observation& o = on_their_way_.front().second;
      station->observation.slot.push(o);
      seen_ns_ = o.exposure_ns;
      punctured_frames_ += o.has(rt::Observation::punctured) ? 1 : 0;
      on_their_way_.pop_front();
    }
  }

  void tick() {
    const Vec3 hand_was_m = hand.x;
    const Vec3 acts_N = hand.force;
    hand.intention = kScale * (wanted_m - kStart_m);
    hand.step(1e-3);
    hand.now_ns = estop.now_ns = injector.now_ns = can.now_ns();
    look();
    rt::test::Seen& seen = watched->seen;
    seen = {};
    seen.elapsed_s = 1e-3;
    seen.now_ns = can.now_ns();
    seen.hand_true_m = hand.x;
    seen.hand_work_J = acts_N.dot(hand.x - hand_was_m);
    seen.tip_true_m = tip_m();
    for (int i = 0; i < params.axis_count; ++i) {
      seen.stage_moves = seen.stage_moves || can.drive(static_cast<std::size_t>(i)).speed() != 0;
    }
    seen.seen_ns = seen_ns_;
    seen.punctured_frames = std::exchange(punctured_frames_, 0);
    servo->tick({static_cast<std::uint64_t>(ticked), can.now_ns(), can.now_ns(), 1e-3, 0});
    ++ticked;
    seen.asked_N = seen.force_N = hand.force;
    seen.power = watched->power;
    seen.enable_line = watched->enable_line;
    seen.gate = injector.open;
    seen.level = estop.level;
    seen.sample = &servo->sample();
    checker->step(seen);
    if (seen.commands > 0) {
      const Vec3 V = seen.command.tip_m - params.tip_m;
      out_of_reach_m = std::max(out_of_reach_m, (V - *config.stage_reach * V).norm());
      largest_error_m = std::max(largest_error_m, seen.stage.following_error_m.norm());
    }
    if (phase() != order.back()) {
      order.push_back(phase());
    }
    can.sleep_until_ns(can.now_ns() + kEveryTick_ns);
  }

  std::deque<std::pair<int, rt::Observation>> on_their_way_;
  std::int64_t seen_ns_ = 0;
  int punctured_frames_ = 0;
  bool punctured_ = false;
};

// The cone's edge is beside the needle, and the hand goes far beside it: what is felt across the needle is
// nothing, and where the needle is across its axis stays what it is.
void inject(FewAxes& s, double beside_m) {
  s.ticks(1000);
  s.wanted_m.y() += beside_m;
  s.wanted_m.z() -= beside_m;
  s.move(25e-6, 15e-6);
  s.ticks(1000);
  s.centre_m += Vec3(0, 1.5e-6, 0);  // vision sees the cell move aside
  s.move(12e-6, 15e-6);
  s.go_in();
  s.hand.buttons = hal::kButtonInject;
  s.ticks(500);
  EXPECT_TRUE(s.injector.open);
  s.hand.buttons = 0;
  s.ticks(100);
}

TEST(Cia402FewAxes, one_drive_along_the_needle_injects_a_cell_and_the_needle_leaves_its_line_nowhere) {
  FewAxes s({{-40e-9, 0, 0}});
  inject(s, 10e-6);
  s.move(60e-6, 40e-6);
  s.ticks(1000);
  s.expect_whole_and_safe();
  EXPECT_NEAR(s.tip_m().x(), 60e-6, 0.5e-6) << "where the hand is";
  EXPECT_EQ(s.tip_m().y(), 2e-6);
}

TEST(Cia402FewAxes, two_oblique_drives_inject_a_cell_and_follow_the_hand_in_their_plane) {
  FewAxes s({{40e-9, 0, 0}, {-30e-9, 40e-9, 0}});
  inject(s, 5e-6);
  s.move(60e-6, 40e-6);
  s.ticks(1000);
  s.expect_whole_and_safe();
  EXPECT_NEAR(s.tip_m().x(), 60e-6, 0.5e-6);
  EXPECT_EQ(s.tip_m().z(), 0);
}

TEST(Cia402FewAxes, what_pulls_across_the_only_axis_is_not_felt_and_the_guide_in_a_plane_is) {
  for (const bool plane : {false, true}) {
    FewAxes s(plane ? std::vector<Vec3>{{40e-9, 0, 0}, {0, 40e-9, 0}} : std::vector<Vec3>{{40e-9, 0, 0}});
    s.centre_m.y() = 12e-6;  // the cone's axis is 10 um beside the needle
    s.ticks(1000);
    s.move(25e-6, 15e-6);
    s.ticks(500);
    EXPECT_EQ(s.phase(), Phase::free);
    if (plane) {
      EXPECT_GT(s.sideways_N(), 0.02);
    } else {
      EXPECT_LT(s.sideways_N(), 1e-9);
      EXPECT_LT(std::hypot(s.hand.x.y(), s.hand.x.z()), 1e-6) << "nor is the hand pulled away";
    }
  }
}

TEST(Cia402FewAxes, a_hand_that_goes_far_beside_the_only_axis_and_turns_does_not_have_to_come_back) {
  FewAxes s({{40e-9, 0, 0}});
  s.ticks(500);
  s.wanted_m.y() += 40e-6;  // 20 mm at the hand
  s.ticks(1000);
  const double x_m = s.tip_m().x();
  EXPECT_NEAR(x_m, 60e-6, 0.2e-6);
  s.move(50e-6, 20e-6);
  s.ticks(500);
  EXPECT_NEAR(s.tip_m().x(), 50e-6, 0.5e-6);
  EXPECT_EQ(s.servo->fault(), Fault::none);
  EXPECT_TRUE(s.checker->broken().empty());
}

TEST(Cia402FewAxes, one_drive_withdraws_the_needle_from_the_cell_when_vision_is_lost) {
  FewAxes s({{40e-9, 0, 0}});
  inject(s, 10e-6);
  s.seeing = false;
  s.ticks(500);
  const double inside_m = s.tip_m().x();
  s.move(s.wanted_m.x() - 5e-6, 40e-6);
  s.ticks(200);
  EXPECT_NEAR(s.tip_m().x(), inside_m, 0.2e-6) << "no deeper";
  s.move(60e-6, 40e-6);
  s.ticks(1000);
  EXPECT_GT(s.tip_m().x(), inside_m + 30e-6);
  EXPECT_EQ(s.servo->fault(), Fault::none);
  EXPECT_TRUE(s.checker->broken().empty());
  EXPECT_LT(s.out_of_reach_m, 1e-12);
}

}  // namespace
}  // namespace punctum::cia402
