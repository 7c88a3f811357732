// Hold to run: which press counts, and what a release does.
#include <gtest/gtest.h>

#include "rt/control/enabling_device.hpp"

namespace punctum::rt {
namespace {

using hal::kButtonEnable;
using hal::kButtonPanic;

struct Held {
  Fault tick(std::uint32_t buttons, bool running = true) {
    device.read(buttons, 1e-3);
    return device.step(running, 1e-3);
  }
  Fault ticks(std::uint32_t buttons, int n) {
    Fault fault = Fault::none;
    for (int k = 0; k < n; ++k) {
      fault = first_of(fault, tick(buttons));
    }
    return fault;
  }
  // As long as a finger, which is longer than interference.
  Fault finger(std::uint32_t buttons, bool running = true) {
    Fault fault = Fault::none;
    for (int k = 0; k < 22; ++k) {
      fault = first_of(fault, tick(buttons, running));
      pressed_anew = pressed_anew || device.pressed_anew();
    }
    return fault;
  }
  EnablingDevice device{0.02};
  bool pressed_anew = false;
};

TEST(EnablingDevice, takes_a_new_press_alone_for_an_act) {
  Held h;
  EXPECT_EQ(h.ticks(kButtonEnable, 1000), Fault::none);
  EXPECT_FALSE(h.device.enabled());        // held from the start
  EXPECT_EQ(h.ticks(0, 20), Fault::none);  // interference
  EXPECT_EQ(h.ticks(kButtonEnable, 1000), Fault::none);
  EXPECT_FALSE(h.device.enabled());
  EXPECT_EQ(h.finger(0), Fault::none);
  EXPECT_FALSE(h.device.enabled());
  EXPECT_EQ(h.ticks(kButtonEnable, 20), Fault::none);
  EXPECT_EQ(h.ticks(0, 1), Fault::none);
  EXPECT_FALSE(h.device.enabled());
  EXPECT_EQ(h.ticks(kButtonEnable, 20), Fault::none);
  EXPECT_FALSE(h.device.enabled());
  int pressed = 0;
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(h.tick(kButtonEnable), Fault::none);
    pressed += h.device.pressed_anew() ? 1 : 0;
  }
  EXPECT_EQ(pressed, 1);
  EXPECT_EQ(h.ticks(kButtonEnable, 1000), Fault::none);
  EXPECT_TRUE(h.device.enabled());
}

TEST(EnablingDevice, forgives_a_bounce_and_no_more) {
  Held h;
  h.finger(0);
  h.finger(kButtonEnable);
  EXPECT_EQ(h.ticks(0, 19), Fault::none);
  EXPECT_EQ(h.ticks(kButtonEnable, 200), Fault::none);
  EXPECT_TRUE(h.device.enabled());
  EXPECT_EQ(h.ticks(0, 19), Fault::none);
  EXPECT_EQ(h.ticks(0, 3), Fault::enabling_released);
  EXPECT_FALSE(h.device.enabled());
}

// A bad plug: let go, and yet one reading in ten says that it is held.
TEST(EnablingDevice, is_released_also_where_its_contact_chatters) {
  Held h;
  h.finger(0);
  h.finger(kButtonEnable);
  Fault fault = Fault::none;
  int ticks = 0;
  for (; fault == Fault::none && ticks < 100; ++ticks) {
    fault = h.tick(ticks % 10 == 9 ? kButtonEnable : 0U);
  }
  EXPECT_EQ(fault, Fault::enabling_released);
  EXPECT_LE(ticks, 24);  // 20 ms, two held readings and what they made up for
}

TEST(EnablingDevice, stops_at_once_when_squeezed_and_is_let_go_before_it_enables_again) {
  for (const std::uint32_t squeezed : {kButtonPanic, kButtonPanic | kButtonEnable}) {
    Held h;
    h.finger(0);
    h.finger(kButtonEnable);
    EXPECT_EQ(h.tick(squeezed), Fault::enabling_released);
    h.pressed_anew = false;
    EXPECT_EQ(h.finger(kButtonEnable, false), Fault::none);
    EXPECT_FALSE(h.pressed_anew);
    EXPECT_EQ(h.finger(0, false), Fault::none);
    EXPECT_FALSE(h.pressed_anew);
    for (int k = 0; k < 30 && !h.device.pressed_anew(); ++k) {
      EXPECT_EQ(h.tick(kButtonEnable, false), Fault::none);
    }
    EXPECT_TRUE(h.device.pressed_anew());
    EXPECT_EQ(h.tick(kButtonEnable), Fault::none);  // this press ended the stop
    EXPECT_TRUE(h.device.enabled());
  }
}

TEST(EnablingDevice, keeps_no_press_that_did_not_end_the_stop) {
  for (const int ticks : {2, 30}) {
    Held h;
    EXPECT_EQ(h.finger(0, false), Fault::none);
    for (int k = 0; k < ticks; ++k) {
      EXPECT_EQ(h.tick(kButtonEnable, false), Fault::none);
    }
    EXPECT_EQ(h.ticks(kButtonEnable, 100), Fault::none);  // the reset button ended it
    EXPECT_FALSE(h.device.enabled()) << ticks;
  }
}

}  // namespace
}  // namespace punctum::rt
