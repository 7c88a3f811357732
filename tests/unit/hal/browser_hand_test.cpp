// The hand on the page: whoever tells what the fingers do is another process, which may be silent, dead or
// wrong.
#include "hal/browser/browser_hand.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>

namespace punctum::browser {
namespace {

constexpr std::int64_t kMs = 1'000'000;

struct SetClock final : hal::Clock {
  std::int64_t now = 5'000'000'000;
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now; }
  void sleep_until_ns(std::int64_t t_ns) noexcept override { now = t_ns; }
};

class BrowserHandTest : public testing::Test {
 protected:
  void tell(double x_m, std::uint32_t buttons = 0, std::uint64_t session = 1) {
    fingers_->newest.push({{x_m, 0, 0}, clock_.now, session, buttons, 0});
  }
  hal::HandState read_after(std::int64_t ms) {
    hal::HandState state;
    for (std::int64_t i = 0; i < ms; ++i) {
      clock_.now += kMs;
      EXPECT_EQ(hand_.read(state), hal::Status::ok);
      EXPECT_EQ(state.sample_ns, clock_.now);
      const double step_m = (state.position_m - at_m_).norm();
      EXPECT_LE(step_m, BrowserHand::kSpeed_m_s * 1e-3 + 1e-12) << "never faster than the hand may go";
      at_m_ = state.position_m;
    }
    return state;
  }
  // As a page does: again and again.
  hal::HandState keep_telling(double x_m, std::uint32_t buttons, std::int64_t ms, std::uint64_t session = 1) {
    hal::HandState state;
    for (std::int64_t i = 0; i < ms; i += 100) {
      tell(x_m, buttons, session);
      state = read_after(100);
    }
    return state;
  }

  SetClock clock_;
  std::unique_ptr<FingersSegment> fingers_ = std::make_unique<FingersSegment>();
  BrowserHand hand_{*fingers_, clock_};
  hal::Vec3 at_m_ = hal::Vec3::Zero();
};

TEST_F(BrowserHandTest, rests_where_it_began_while_nobody_has_it) {
  const hal::HandState state = read_after(500);
  EXPECT_EQ(state.position_m, hal::Vec3::Zero());
  EXPECT_EQ(state.buttons, 0U);
  tell(0.1, hal::kButtonEnable, 0);
  EXPECT_EQ(read_after(50).buttons, 0U) << "session 0 is nobody's";
}

TEST_F(BrowserHandTest, goes_as_far_as_the_fingers_and_presses_what_they_press) {
  keep_telling(0.3, 0, 100);  // where they are when they take it is no way
  EXPECT_EQ(at_m_, hal::Vec3::Zero());
  tell(0.302, hal::kButtonEnable | hal::kButtonInject);
  const hal::HandState state = read_after(200);
  EXPECT_NEAR(state.position_m.x(), 0.002, 1e-6);
  EXPECT_EQ(state.buttons, hal::kButtonEnable | hal::kButtonInject);
  tell(0.302, 0xFFFFFFFFU);
  EXPECT_EQ(read_after(1).buttons,
            hal::kButtonClutch | hal::kButtonInject | hal::kButtonNextCell | hal::kButtonEnable)
      << "no button that a page does not have";
}

TEST_F(BrowserHandTest, lets_go_and_rests_when_nothing_is_told_any_more) {
  keep_telling(0, 0, 100);
  keep_telling(0, hal::kButtonEnable, 200);
  EXPECT_EQ(read_after(400).buttons, hal::kButtonEnable) << "a page that is late by so much is still there";
  EXPECT_EQ(read_after(101).buttons, 0U);
  const hal::Vec3 rested_m = at_m_;
  tell(0.2, hal::kButtonEnable);
  EXPECT_EQ(read_after(20).position_m, rested_m) << "what was moved meanwhile is not made up for";
  tell(0.201, hal::kButtonEnable);
  EXPECT_EQ(read_after(100).buttons, 0U) << "held through the gap: nothing goes on by itself";
  EXPECT_GT(at_m_.x(), rested_m.x() + 0.5e-3);
  keep_telling(0.201, 0, 100);
  EXPECT_EQ(keep_telling(0.201, hal::kButtonEnable, 100).buttons, hal::kButtonEnable);
}

TEST_F(BrowserHandTest, does_not_jump_when_another_takes_it) {
  keep_telling(0.05, 0, 300);
  EXPECT_EQ(keep_telling(-0.2, hal::kButtonEnable, 300, 2).buttons, 0U)
      << "the button was not pressed for this one";
  EXPECT_EQ(at_m_, hal::Vec3::Zero());
}

TEST_F(BrowserHandTest, takes_nothing_from_a_writer_that_is_wrong) {
  keep_telling(0, 0, 100);
  keep_telling(0, hal::kButtonEnable, 200);
  for (const double wrong :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300, -0.51}) {
    tell(wrong, hal::kButtonEnable | hal::kButtonInject);
    EXPECT_EQ(read_after(1).buttons, 0U) << wrong;
    EXPECT_EQ(at_m_, hal::Vec3::Zero()) << wrong;
    EXPECT_EQ(keep_telling(0, hal::kButtonEnable, 100).buttons, 0U) << wrong;
    keep_telling(0, 0, 100);
    EXPECT_EQ(keep_telling(0, hal::kButtonEnable, 100).buttons, hal::kButtonEnable);
  }
  fingers_->newest.push({{0, 0, 0}, clock_.now + 600 * kMs, 1, hal::kButtonEnable, 0});
  EXPECT_EQ(read_after(1).buttons, 0U) << "of another time";
  // Whatever stands in the segment: the hand stays slow, near and finite, which read_after() looks at.
  std::mt19937_64 random(3);
  auto* words = reinterpret_cast<std::uint64_t*>(static_cast<void*>(&fingers_->newest));
  for (int round = 0; round < 300; ++round) {
    for (std::size_t i = 0; i < sizeof fingers_->newest / 8; ++i) {
      words[i] = random() % 2 == 0 ? random() : random() % 9;
    }
    read_after(3);
    ASSERT_TRUE(at_m_.allFinite());
    tell(random() % 2 == 0 ? 1e-3 * static_cast<double>(random() % 1000) : 1e200, hal::kButtonEnable,
         random() % 3);
    read_after(3);
    ASSERT_LE(at_m_.cwiseAbs().maxCoeff(), hal::HandFollower::kReach_m);
  }
}

}  // namespace
}  // namespace punctum::browser
