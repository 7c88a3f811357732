// The backend evdev without a device: what its events mean. The kernel's part is tested in the guest
// (tests/loopback/input_loopback_test.cpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "hal/evdev/evdev_hand.hpp"
#include "hal/evdev/which_hand.hpp"

namespace punctum::evdev {
namespace {

using hal::Vec3;

constexpr std::int64_t kMillisecond_ns = 1'000'000;

Abilities abilities(const std::vector<int>& keys, const std::vector<int>& relative,
                    const std::vector<int>& absolute) {
  Abilities all;
  for (const int code : keys) {
    all.keys.add(static_cast<std::size_t>(code));
  }
  for (const int code : relative) {
    all.relative.add(static_cast<std::size_t>(code));
  }
  for (const int code : absolute) {
    all.absolute.add(static_cast<std::size_t>(code));
  }
  return all;
}
Abilities of_a_mouse() { return abilities({BTN_LEFT, BTN_RIGHT, BTN_MIDDLE}, {REL_X, REL_Y, REL_WHEEL}, {}); }
Abilities of_a_gamepad() {
  return abilities({BTN_SOUTH, BTN_EAST, BTN_NORTH, BTN_TL, BTN_TR}, {}, {ABS_X, ABS_Y, ABS_RX, ABS_RY});
}
Abilities of_a_knob(bool absolute) {
  const std::vector<int> axes = {REL_X,  REL_Y,  REL_Z,
                                 REL_RX, REL_RY, REL_RZ};  // ABS_X .. ABS_RZ are 0 .. 5 too
  return abilities({BTN_0, BTN_1}, absolute ? std::vector<int>{} : axes,
                   absolute ? axes : std::vector<int>{});
}

// A device whose events come when they are told, read every millisecond.
class EvdevMotion : public testing::Test {
 protected:
  void use(const Abilities& of, Range range = {-1000, 1000}) {
    const Layout* layout = layout_of(of);
    ASSERT_NE(layout, nullptr);
    motion.emplace(params, *layout, std::array<Range, 3>{range, range, range});
    (void)motion->at(now_ns);
  }
  void tell(int type, int code, int value, std::int64_t ago_ns = 0) {
    input_event event{};
    event.type = static_cast<std::uint16_t>(type);
    event.code = static_cast<std::uint16_t>(code);
    event.value = value;
    const std::int64_t t_ns = now_ns - ago_ns;
    event.input_event_sec = static_cast<decltype(event.input_event_sec)>(t_ns / 1'000'000'000);
    event.input_event_usec = static_cast<decltype(event.input_event_usec)>(t_ns / 1'000 % 1'000'000);
    motion->take(event, now_ns);
  }
  void report() { tell(EV_SYN, SYN_REPORT, 0); }
  hal::HandState pass(int milliseconds) {
    hal::HandState state;
    for (int i = 0; i < milliseconds; ++i) {
      now_ns += kMillisecond_ns;
      const Vec3 before_m = at_m;
      state = motion->at(now_ns);
      at_m = state.position_m;
      fastest_m_s = std::max(fastest_m_s, (at_m - before_m).norm() / 1e-3);
    }
    return state;
  }

  EvdevParams params;
  std::optional<HandMotion> motion;
  std::int64_t now_ns = 1'000'000'000'000;
  Vec3 at_m = Vec3::Zero();
  double fastest_m_s = 0;
};

TEST(EvdevLayout, knows_mice_gamepads_and_knobs_and_nothing_else) {
  EXPECT_STREQ(layout_of(of_a_mouse())->name, "mouse");
  EXPECT_STREQ(layout_of(of_a_gamepad())->name, "gamepad");
  EXPECT_STREQ(layout_of(of_a_knob(true))->name, "SpaceMouse");
  EXPECT_STREQ(layout_of(of_a_knob(false))->name, "SpaceMouse");
  EXPECT_STREQ(layout_of(abilities({BTN_LEFT, BTN_RIGHT}, {REL_X, REL_Y}, {}))->name, "mouse");
  for (const Abilities& none :
       {Abilities{}, abilities({KEY_A, KEY_ENTER}, {}, {}), abilities({BTN_LEFT, BTN_RIGHT}, {REL_WHEEL}, {}),
        abilities({BTN_LEFT}, {REL_X, REL_Y}, {}), abilities({BTN_LEFT, BTN_TOUCH}, {}, {ABS_X, ABS_Y}),
        abilities({BTN_SOUTH}, {}, {ABS_X, ABS_Y, ABS_RY}),
        abilities({BTN_SOUTH, BTN_TR}, {}, {ABS_X, ABS_Y})}) {
    EXPECT_EQ(layout_of(none), nullptr);
  }
}

TEST_F(EvdevMotion, follows_the_counts_of_a_mouse_to_the_last_one) {
  use(of_a_mouse());
  for (int i = 0; i < 100; ++i) {  // 8 ms apart, 10 counts: 31 mm/s
    tell(EV_REL, REL_X, 10);
    tell(EV_REL, REL_Y, -3);
    report();
    pass(8);
  }
  tell(EV_REL, REL_WHEEL, -2);
  const hal::HandState state = pass(1000);
  EXPECT_NEAR(state.position_m.x(), 1000 * 25e-6, 1e-12);
  EXPECT_NEAR(state.position_m.y(), 300 * 25e-6, 1e-12);
  EXPECT_NEAR(state.position_m.z(), -2e-3, 1e-12);
  EXPECT_EQ(state.sample_ns, now_ns);
  EXPECT_EQ(state.orientation.coeffs(), hal::Quat::Identity().coeffs());
}

TEST_F(EvdevMotion, makes_an_even_motion_of_counts_that_come_in_lumps) {
  use(of_a_mouse());
  double slowest_m_s = 1;
  for (int i = 0; i < 100; ++i) {
    tell(EV_REL, REL_X, 10);  // 31 mm/s
    for (int k = 0; k < 8; ++k) {
      const Vec3 before_m = at_m;
      pass(1);
      slowest_m_s = i < 20 ? slowest_m_s : std::min(slowest_m_s, (at_m - before_m).norm() / 1e-3);
    }
  }
  EXPECT_GT(slowest_m_s, 0.02);
  EXPECT_LT(fastest_m_s, 0.04);
}

TEST_F(EvdevMotion, is_never_faster_than_its_speed_and_forgets_what_was_too_fast) {
  use(of_a_mouse());
  for (const int counts : {100'000, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
    tell(EV_REL, REL_X, counts);
    tell(EV_REL, REL_Y, counts);
    tell(EV_REL, REL_WHEEL, counts);
    pass(1);
  }
  const Vec3 before_m = at_m;
  pass(1000);
  EXPECT_LT((at_m - before_m).norm(), params.speed_m_s * 0.041);
  EXPECT_LE(fastest_m_s, params.speed_m_s * (1 + 1e-9));
  EXPECT_GT(fastest_m_s, params.speed_m_s * 0.9);
}

TEST_F(EvdevMotion, moves_at_the_speed_of_a_stick_and_rests_with_it) {
  use(of_a_gamepad());
  tell(EV_ABS, ABS_X, 1000);
  tell(EV_ABS, ABS_Y, 1000);  // pulled towards the operator
  tell(EV_ABS, ABS_RY, 1000);
  pass(300);
  const Vec3 from_m = at_m;
  pass(500);
  // Three axes at once are no faster than one.
  EXPECT_NEAR((at_m - from_m).norm() / 0.5, params.speed_m_s, 1e-6);
  EXPECT_NEAR(at_m.y(), -at_m.x(), 1e-12);
  EXPECT_NEAR(at_m.z(), -at_m.x(), 1e-12);
  for (const int axis : {ABS_X, ABS_Y, ABS_RY}) {
    tell(EV_ABS, axis, 0);
  }
  pass(400);
  const Vec3 rests_m = at_m;
  pass(1000);
  EXPECT_EQ(at_m, rests_m);
}

TEST_F(EvdevMotion, goes_by_the_square_of_what_is_beyond_the_dead_zone) {
  params.dead_zone = 0.2;
  use(of_a_gamepad(), {0, 255});  // middle 127.5
  const auto speed_at = [&](int value) {
    tell(EV_ABS, ABS_X, value);
    pass(300);
    const double from_m = at_m.x();
    pass(100);
    return (at_m.x() - from_m) / 0.1;
  };
  EXPECT_NEAR(speed_at(152), 0, 1e-7);  // 0.19 of the way
  EXPECT_NEAR(speed_at(255), params.speed_m_s, 1e-6);
  EXPECT_NEAR(speed_at(0), -params.speed_m_s, 1e-6);
  // (204 - 127.5) / 127.5 = 0.6; beyond the dead zone 0.4 of 0.8
  EXPECT_NEAR(speed_at(204), params.speed_m_s / 4, 1e-6);
  EXPECT_NEAR(speed_at(400), params.speed_m_s, 1e-6);  // beyond its own range
}

TEST_F(EvdevMotion, a_knob_is_lifted_pushed_and_pulled_in_the_frame_of_the_hand) {
  use(of_a_knob(true), {-350, 350});
  tell(EV_ABS, ABS_Z, -350);  // lifted
  pass(100);
  EXPECT_GT(at_m.y(), 1e-3);
  EXPECT_EQ(at_m.z(), 0);
  tell(EV_ABS, ABS_Z, 0);
  tell(EV_ABS, ABS_Y, 350);  // towards the operator
  pass(100);
  EXPECT_GT(at_m.z(), 1e-3);
  EXPECT_EQ(at_m.x(), 0);
  tell(EV_ABS, ABS_RX, 350);  // tilted
  pass(10);
  EXPECT_EQ(at_m.x(), 0);
}

TEST_F(EvdevMotion, full_deflection_told_a_hundred_times_a_second_is_full_speed) {
  use(of_a_knob(false));
  double from_m = 0;
  for (int i = 0; i < 100; ++i) {
    from_m = i == 50 ? at_m.x() : from_m;
    tell(EV_REL, REL_X, 350);
    tell(EV_REL, REL_Y, 52);  // just within the dead zone
    report();
    pass(10);
  }
  EXPECT_NEAR((at_m.x() - from_m) / 0.5, params.speed_m_s, 1e-4);
  EXPECT_EQ(at_m.z(), 0);
}

TEST_F(EvdevMotion, a_button_counts_as_held_until_it_is_let_go) {
  use(of_a_mouse());
  tell(EV_KEY, BTN_LEFT, 1);
  tell(EV_KEY, BTN_RIGHT, 1);
  EXPECT_EQ(pass(1).buttons, hal::kButtonEnable | hal::kButtonInject);
  tell(EV_KEY, BTN_LEFT, 2);  // a repetition
  EXPECT_EQ(pass(1).buttons, hal::kButtonEnable | hal::kButtonInject);
  tell(EV_KEY, BTN_RIGHT, 0);
  tell(EV_KEY, KEY_A, 1);
  EXPECT_EQ(pass(1000).buttons, hal::kButtonEnable);
}

TEST_F(EvdevMotion, believes_nothing_between_lost_events_and_the_answer_to_its_question) {
  use(of_a_mouse());
  tell(EV_KEY, BTN_LEFT, 1);
  tell(EV_SYN, SYN_DROPPED, 0);
  EXPECT_FALSE(motion->wants_state());
  tell(EV_KEY, BTN_RIGHT, 1);
  tell(EV_REL, REL_X, 100);
  EXPECT_FALSE(motion->wants_state());
  report();
  ASSERT_TRUE(motion->wants_state());
  EXPECT_EQ(pass(1).buttons, hal::kButtonEnable);
  Keys held;
  held.add(BTN_MIDDLE);
  motion->is(held, {});
  EXPECT_FALSE(motion->wants_state());
  EXPECT_EQ(pass(100).buttons, hal::kButtonClutch);
  EXPECT_EQ(at_m.x(), 0);
  tell(EV_REL, REL_X, 100);
  pass(500);
  EXPECT_NEAR(at_m.x(), 100 * params.count_m, 1e-12);
}

TEST_F(EvdevMotion, is_told_where_its_sticks_are_after_lost_events) {
  use(of_a_gamepad());
  tell(EV_ABS, ABS_X, 1000);
  pass(100);
  tell(EV_SYN, SYN_DROPPED, 0);
  report();
  motion->is({}, {0, -1000, 0});
  pass(300);
  const Vec3 from_m = at_m;
  pass(100);
  EXPECT_NEAR(at_m.x(), from_m.x(), 1e-8);
  EXPECT_NEAR(at_m.y() - from_m.y(), params.speed_m_s * 0.1, 1e-6);
}

TEST_F(EvdevMotion, a_movement_that_waited_is_dropped_and_a_button_is_not) {
  use(of_a_mouse());
  tell(EV_REL, REL_X, 100, HandMotion::kStale_ns + kMillisecond_ns);
  tell(EV_KEY, BTN_LEFT, 1, HandMotion::kStale_ns + kMillisecond_ns);
  EXPECT_EQ(pass(300).buttons, hal::kButtonEnable);
  EXPECT_EQ(at_m.x(), 0);
  tell(EV_REL, REL_X, 100, HandMotion::kStale_ns - kMillisecond_ns);
  pass(500);
  EXPECT_NEAR(at_m.x(), 100 * params.count_m, 1e-12);
}

TEST_F(EvdevMotion, a_gap_between_two_readings_moves_it_no_further_than_a_short_one) {
  use(of_a_gamepad());
  tell(EV_ABS, ABS_X, 1000);
  pass(500);
  const double from_m = at_m.x();
  now_ns += 10'000'000'000;
  EXPECT_LE(motion->at(now_ns).position_m.x() - from_m, params.speed_m_s * 0.03);
  now_ns -= 5'000'000'000;  // a clock that goes back
  const double there_m = motion->at(now_ns).position_m.x();
  EXPECT_EQ(motion->at(now_ns).position_m.x(), there_m);
}

TEST_F(EvdevMotion, stays_within_reach_and_comes_back_at_once) {
  params.speed_m_s = 1;
  use(of_a_gamepad());
  tell(EV_ABS, ABS_X, -1000);
  pass(5000);
  EXPECT_NEAR(at_m.x(), -hal::HandFollower::kReach_m, 1e-6);
  tell(EV_ABS, ABS_X, 1000);
  pass(100);
  EXPECT_GT(at_m.x(), -hal::HandFollower::kReach_m + 0.05);
}

TEST_F(EvdevMotion, whatever_is_told_the_hand_is_continuous) {
  std::mt19937 random(1);
  for (const Abilities& of : {of_a_mouse(), of_a_gamepad(), of_a_knob(true), of_a_knob(false)}) {
    use(of);
    at_m.setZero();
    for (int i = 0; i < 5000; ++i) {
      tell(static_cast<int>(random() % 5), static_cast<int>(random() % 16), static_cast<int>(random()));
      if (motion->wants_state()) {
        motion->is({}, {static_cast<int>(random()), static_cast<int>(random()), static_cast<int>(random())});
      }
      const hal::HandState state = pass(1);
      ASSERT_TRUE(state.position_m.allFinite());
      ASSERT_LE(state.position_m.cwiseAbs().maxCoeff(), hal::HandFollower::kReach_m);
    }
    EXPECT_LE(fastest_m_s, params.speed_m_s * (1 + 1e-9));
  }
}

class StandingClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return 1; }
  void sleep_until_ns(std::int64_t /*t_ns*/) noexcept override {}
};

TEST(WhichHand, is_the_only_device_that_can_be_one_and_has_the_part_in_its_name) {
  const Layout* mouse = layout_of(of_a_mouse());
  const Layout* pad = layout_of(of_a_gamepad());
  const std::vector<InputDevice> two = {{"/dev/input/event1", "Keyboard of a mouse", nullptr, ""},
                                        {"/dev/input/event2", "Optical Mouse", mouse, ""},
                                        {"/dev/input/event10", "X-Box 360 pad", pad, ""}};
  EXPECT_EQ(choose_hand(two, "Mouse"), "/dev/input/event2");
  EXPECT_EQ(choose_hand(two, "pad"), "/dev/input/event10");
  EXPECT_EQ(choose_hand(two, ""),
            tl::unexpected<std::string>(
                "several devices can be the hand: /dev/input/event2 (Optical Mouse), /dev/input/event10 "
                "(X-Box 360 pad), allowed: one of them as evdev.path"));
  EXPECT_EQ(choose_hand(two, "Keyboard"),
            tl::unexpected<std::string>("no mouse, gamepad or SpaceMouse called \"Keyboard\" in /dev/input, "
                                        "allowed: plug one in, or say which in evdev.path"));
}

TEST(WhichHand, is_told_to_be_out_of_reach_only_where_none_may_be_read) {
  const Layout* mouse = layout_of(of_a_mouse());
  const InputDevice shut{"/dev/input/event1", "", nullptr, "event1: this user may not read it"};
  const InputDevice shut_too{"/dev/input/event2", "", nullptr, "event2: this user may not read it"};
  EXPECT_EQ(choose_hand({shut, {"/dev/input/event3", "Mouse", mouse, ""}}, ""), "/dev/input/event3");
  EXPECT_EQ(choose_hand({shut, shut_too}, ""), tl::unexpected<std::string>(shut.refused));
}

TEST(EvdevHandTest, says_in_one_line_what_is_no_input_device) {
  const StandingClock clock;
  for (const char* path : {"/dev/null", "/nowhere/event0", "/proc/version", "/tmp"}) {
    EvdevParams params;
    params.path = path;
    EvdevHand hand(params, clock);
    const auto opened = hand.open();
    ASSERT_FALSE(opened) << path;
    EXPECT_EQ(opened.error().find(std::string(path) + ": "), 0U) << opened.error();
    EXPECT_EQ(opened.error().find('\n'), std::string::npos);
  }
}

TEST(EvdevHandTest, takes_every_force_and_is_a_hand_only) {
  const StandingClock clock;
  EvdevHand hand({}, clock);
  EXPECT_EQ(hand.write_force(Vec3(1, 2, 3)), hal::Status::ok);
  const hal::Served served = hand.served();
  EXPECT_EQ(served.haptic, &hand);
  EXPECT_EQ(served.stage, nullptr);
  EXPECT_EQ(served.estop, nullptr);
}

}  // namespace
}  // namespace punctum::evdev
