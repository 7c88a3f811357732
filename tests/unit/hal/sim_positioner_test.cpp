#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hal/sim/plant/positioner.hpp"

namespace punctum::sim {
namespace {

class HandClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return t_ns; }
  void sleep_until_ns(std::int64_t until_ns) noexcept override { t_ns = until_ns; }
  void pass(double seconds) { t_ns += std::llround(seconds * 1e9); }
  std::int64_t t_ns = 1'000;
};

// 2 mm/s and 10 mm/s^2: full speed is reached after 0.2 s and 0.2 mm.
class SimPositionerTest : public testing::Test {
 protected:
  hal::PositionerState read() {
    hal::PositionerState s;
    EXPECT_EQ(positioner.read(s), hal::Status::ok);
    return s;
  }
  double x_mm() { return 1e3 * read().position_m.x(); }
  HandClock clock;
  SimPositioner positioner{PositionerParams{Vec3::Zero(), 2e-3, 10e-3, 12.5e-3}, clock};
};

TEST_F(SimPositionerTest, stands_where_it_starts_and_says_when_it_was_read) {
  clock.pass(3);
  const hal::PositionerState s = read();
  EXPECT_EQ(s.position_m, Vec3(Vec3::Zero()));
  EXPECT_FALSE(s.moving);
  EXPECT_EQ(s.sample_ns, clock.t_ns);
}

TEST_F(SimPositionerTest, moves_by_a_trapezoid_of_speed) {
  ASSERT_TRUE(positioner.move_to(Vec3(1e-3, 0, 0)));  // 0.2 s up, 0.6 mm at full speed, 0.2 s down: 0.7 s
  clock.pass(0.1);
  EXPECT_NEAR(x_mm(), 0.05, 1e-9);
  clock.pass(0.1);
  EXPECT_NEAR(x_mm(), 0.2, 1e-9);
  clock.pass(0.15);
  EXPECT_NEAR(x_mm(), 0.5, 1e-9);
  clock.pass(0.25);
  EXPECT_NEAR(x_mm(), 0.95, 1e-9);
  EXPECT_TRUE(read().moving);
  clock.pass(0.1);
  EXPECT_NEAR(x_mm(), 1, 1e-9);
  EXPECT_FALSE(read().moving);
}

TEST_F(SimPositionerTest, turns_round_before_full_speed_on_a_short_move) {
  ASSERT_TRUE(positioner.move_to(Vec3(0, -0.1e-3, 0)));  // 0.1 s up to 1 mm/s, 0.1 s down
  clock.pass(0.1);
  EXPECT_NEAR(read().position_m.y(), -0.05e-3, 1e-12);
  clock.pass(0.1);
  EXPECT_NEAR(read().position_m.y(), -0.1e-3, 1e-12);
  EXPECT_FALSE(read().moving);
}

TEST_F(SimPositionerTest, keeps_its_speed_and_acceleration_over_a_queue_of_moves) {
  ASSERT_TRUE(positioner.move_to(Vec3(2e-3, 1e-3, 0)));
  ASSERT_TRUE(positioner.move_to(Vec3(2e-3, 1e-3, -3e-3)));
  ASSERT_TRUE(positioner.move_to(Vec3(2.05e-3, 1e-3, -3e-3)));
  EXPECT_EQ(read().queued, 2);
  const double dt = 1e-3;
  Vec3 before = read().position_m, speed = Vec3::Zero();
  int ticks = 0;
  while (read().moving && ticks < 10'000) {
    clock.pass(dt);
    const Vec3 now = read().position_m;
    const Vec3 v = (now - before) / dt;
    ASSERT_LT(v.norm(), 2e-3 * (1 + 1e-6));
    ASSERT_LT((v - speed).norm() / dt, 10e-3 * (1 + 1e-6));
    before = now;
    speed = v;
    ++ticks;
  }
  EXPECT_LT((before - Vec3(2.05e-3, 1e-3, -3e-3)).norm(), 1e-12);
  EXPECT_EQ(read().queued, 0);
}

TEST_F(SimPositionerTest, begins_a_queued_move_when_the_one_before_has_ended) {
  ASSERT_TRUE(positioner.move_to(Vec3(1e-3, 0, 0)));  // 0.7 s
  ASSERT_TRUE(positioner.move_to(Vec3(0, 0, 0)));
  clock.pass(0.8);
  EXPECT_NEAR(x_mm(), 0.95, 1e-9);  // 0.1 s into the way back
  EXPECT_EQ(read().queued, 0);
  EXPECT_TRUE(read().moving);
}

TEST_F(SimPositionerTest, brakes_on_its_ramp_and_forgets_its_queue_when_it_is_stopped) {
  ASSERT_TRUE(positioner.move_to(Vec3(10e-3, 0, 0)));
  ASSERT_TRUE(positioner.move_to(Vec3(0, 0, 0)));
  clock.pass(1);
  const double at_mm = x_mm();
  positioner.stop();
  EXPECT_NEAR(x_mm(), at_mm, 1e-9);
  EXPECT_TRUE(read().moving);
  positioner.stop();  // again, in the same instant: no jolt
  clock.pass(0.1);
  EXPECT_NEAR(x_mm(), at_mm + 0.15, 1e-9);
  positioner.stop();  // and while it brakes
  clock.pass(0.1);
  EXPECT_NEAR(x_mm(), at_mm + 0.2, 1e-9);  // v^2 / 2a
  clock.pass(5);
  EXPECT_NEAR(x_mm(), at_mm + 0.2, 1e-9);
  EXPECT_FALSE(read().moving);
  ASSERT_TRUE(positioner.move_to(Vec3(0, 0, 0)));
  clock.pass(10);
  EXPECT_NEAR(x_mm(), 0, 1e-9);
}

TEST_F(SimPositionerTest, refuses_what_it_cannot_do_and_stays_as_it_was) {
  EXPECT_FALSE(positioner.move_to(Vec3(0, 12.6e-3, 0)));
  EXPECT_FALSE(positioner.move_to(Vec3(0, 0, std::numeric_limits<double>::quiet_NaN())));
  EXPECT_FALSE(read().moving);
  for (int i = 0; i <= SimPositioner::kQueue; ++i) {
    EXPECT_TRUE(positioner.move_to(Vec3(1e-3 * (1 + i % 2), 0, 0)));
  }
  EXPECT_FALSE(positioner.move_to(Vec3::Zero()));
  EXPECT_EQ(read().queued, SimPositioner::kQueue);
  clock.pass(0.71);  // the first has ended
  EXPECT_TRUE(positioner.move_to(Vec3::Zero()));
  clock.pass(60);
  EXPECT_NEAR(x_mm(), 0, 1e-9);
}

}  // namespace
}  // namespace punctum::sim
