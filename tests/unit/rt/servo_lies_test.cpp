// The whole servo against devices that are honest but slow and uneven, and against single false samples that
// come where nobody looks.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "rt/station/alarm.hpp"
#include "tests/support/servo_bench.hpp"

namespace punctum::rt::test {
namespace {

// A device with a rate of its own: its periods vary by the part `uneven`, and its samples' times are late by
// up to late_s. Both from a fixed sequence of random numbers.
struct HandRate {
  double rate_Hz = 1000;
  double uneven = 0;
  double late_s = 0;
};

// The station with a hand that goes exactly where it is put.
struct PlacedHand {
  explicit PlacedHand(const HandRate& rate) : device(rate) {
    bench.to_inside();
    bench.run(0.5);
    bench.hand.held = true;
    at_m = bench.hand.x;
  }

  void tick(double to_m) {
    FakeHand& hand = bench.hand;
    hand.x = at_m + Vec3(to_m, 0, 0);
    const bool samples = bench.now + std::llround(1e9 * bench.dt()) >= hand.sampled_at_ns + period_ns;
    if (samples) {
      hand.ahead_ns = -std::llround(1e9 * device.late_s * uniform());
    }
    hand.sample_every_ns = period_ns;
    bench.tick();
    if (samples) {
      const double uneven = 1 + device.uneven * (2 * uniform() - 1);
      period_ns = std::llround(1e9 / device.rate_Hz * uneven);
    }
    alarms |= bench.sample().alarms;
  }
  // From x to x + way_m with this acceleration, halfway to and halfway from its largest speed.
  void start_and_stop(double way_m, double acceleration_m_s2) {
    const double half_s = std::sqrt(std::abs(way_m) / acceleration_m_s2);
    const double a = std::copysign(acceleration_m_s2, way_m);
    for (double t = 0; t < 2 * half_s; t += bench.dt()) {
      tick(x_m + (t < half_s ? a / 2 * t * t : way_m - a / 2 * (2 * half_s - t) * (2 * half_s - t)));
    }
    x_m += way_m;
    rest(0.6);
  }
  void rest(double seconds) {
    for (double t = 0; t < seconds; t += bench.dt()) {
      tick(x_m);
    }
  }
  double uniform() { return 0x1p-32 * static_cast<double>(random()); }
  double needle_um() const { return 1e6 * bench.stage.tip.x(); }

  HandRate device;
  Bench bench{[] {
    ServoConfig c = icsi();
    c.vacuum.reset();
    return c;
  }()};
  std::mt19937 random{1};
  Vec3 at_m = Vec3::Zero();
  double x_m = 0;
  std::int64_t period_ns = 1'000'000;
  std::uint32_t alarms = 0;
};

// The tip is told false_um off on one tick.
double moves_by_itself_um(Bench& b, int at, double false_um) {
  const Vec3 tip = b.stage.tip;
  double most_um = 0;
  for (int k = 0; k < 300; ++k) {
    b.stage.false_m.x() = k == at ? false_um * 1e-6 : 0;
    b.tick();
    most_um = std::max(most_um, 1e6 * (b.stage.tip - tip).norm());
  }
  return most_um;
}

// 10 mm of the hand are 20 um of the needle.
TEST(ServoLies, the_needle_draws_back_with_a_hand_that_starts_back_whatever_its_device_samples) {
  for (const bool blind : {false, true}) {
    for (const HandRate& device : {HandRate{1000}, HandRate{250}, HandRate{250, 0.3},
                                   HandRate{250, 0, 2.4e-3}, HandRate{200}, HandRate{125}, HandRate{100}}) {
      PlacedHand p(device);
      p.rest(0.3);
      if (blind) {
        p.bench.seeing = false;
        p.rest(1);
      }
      const double before_um = p.needle_um();
      p.start_and_stop(10e-3, 40);
      EXPECT_EQ(p.bench.sample().fault, Fault::none);
      EXPECT_GT(p.needle_um() - before_um, 15)
          << (blind ? "blind, " : "seeing, ") << device.rate_Hz << " Hz, uneven by " << device.uneven
          << ", late by up to " << device.late_s << " s";
    }
  }
}

TEST(ServoLies, a_hand_that_comes_slowly_and_goes_quickly_leaves_the_needle_no_deeper) {
  for (const HandRate& device : {HandRate{1000}, HandRate{250, 0.3}, HandRate{200}, HandRate{125}}) {
    PlacedHand p(device);
    p.rest(0.3);
    const double before_um = p.needle_um();
    for (int i = 0; i < 3; ++i) {
      p.start_and_stop(-10e-3, 0.1);
      p.start_and_stop(10e-3, 40);
    }
    EXPECT_GT(p.needle_um(), before_um - 5) << device.rate_Hz << " Hz, uneven by " << device.uneven;
  }
}

// 10 mm at 35 mm/s at most, into the cell and out again.
TEST(ServoLies, the_needle_follows_a_slow_hand_whatever_its_device_samples) {
  for (const HandRate& device :
       {HandRate{100}, HandRate{100, 0, 0.2e-3}, HandRate{100, 0.02}, HandRate{125, 0.3}}) {
    PlacedHand p(device);
    p.rest(0.3);
    for (const double way_m : {-10e-3, 10e-3}) {
      const double from_um = p.needle_um();
      p.start_and_stop(way_m, 0.125);
      EXPECT_NEAR(p.needle_um() - from_um, way_m / 500 * 1e6, 2)
          << device.rate_Hz << " Hz, uneven by " << device.uneven << ", late by up to " << device.late_s
          << " s";
    }
  }
}

TEST(ServoLies, one_false_axis_of_the_stage_turns_no_depth_limit_round) {
  for (const double turned_rad : {1.7, 2.5, 2.9, 3.14159}) {
    for (const double from_um : {30.0, 50.0}) {
      ServoConfig c = icsi();
      c.guard.emplace();
      Bench b(c);
      b.run(1);
      b.move(from_um * 1e-6, 30e-6);
      b.run(0.5);
      ASSERT_EQ(b.servo->phase(), Phase::free);
      b.stage.axis = Vec3(-std::cos(turned_rad), 0, std::sin(turned_rad));
      b.tick();
      b.stage.axis = -Vec3::UnitX();
      double deepest_m = 0;
      b.every_tick = [&] { deepest_m = std::max(deepest_m, -b.gap()); };
      b.run(0.3);
      const bool outside = b.servo->phase() == Phase::free || b.sample().stop != StopStage::running;
      EXPECT_TRUE(outside) << turned_rad << " rad, " << 1e6 * b.gap()
                           << " um before the cell: " << name(b.servo->phase());
      b.move(-150e-6, 60e-6);
      b.run(1);
      EXPECT_LE(1e6 * deepest_m, 90 + 3) << turned_rad << " rad, from " << from_um << " um";
    }
  }
}

// Up to 10 um: beyond that the drive is found to have crept in the stop.
TEST(ServoLies, one_false_tip_at_the_reset_moves_the_needle_nowhere) {
  for (const double false_um : {-9.0, 9.0, 100.0}) {
    double most_um = 0;
    for (int at = 15; at < 25; ++at) {
      Bench b(icsi());
      b.to_inside();
      b.run(0.5);
      hal::EstopState& chain = b.estop.state;
      chain.contact_a_closed = chain.contact_b_closed = false;
      b.run(0.6);
      chain.contact_a_closed = chain.contact_b_closed = true;
      b.run(0.1);
      chain.reset_pressed = true;
      most_um = std::max(most_um, moves_by_itself_um(b, at, false_um));
    }
    EXPECT_LT(most_um, 1) << false_um;
  }
}

TEST(ServoLies, one_false_tip_at_the_start_moves_the_needle_nowhere) {
  for (const double false_um : {-300.0, -50.0, -9.0, 9.0}) {
    double most_um = 0;
    for (int at = 0; at < 5; ++at) {
      Bench b(icsi());
      most_um = std::max(most_um, moves_by_itself_um(b, at, false_um));
    }
    EXPECT_LT(most_um, 1) << false_um;
  }
}

TEST(ServoLies, one_false_sample_of_a_button_injects_nothing) {
  Bench b(icsi());
  b.to_inside();
  b.run(1);
  const int before = b.injector.open_ticks;
  b.hand.buttons = hal::kButtonInject;
  b.tick();
  b.hand.buttons = 0;
  b.run(0.2);
  EXPECT_EQ(b.injector.open_ticks - before, 0);
}

TEST(ServoLies, one_false_sample_of_the_enabling_device_gives_no_power_and_ends_no_stop) {
  ServoConfig c = icsi();
  c.enabling.emplace();
  Bench b(c);
  b.run(1);
  for (const bool in_a_stop : {false, true}) {
    int powered = 0, sent = b.stage.commands;
    b.hand.buttons = hal::kButtonEnable;
    b.tick();
    b.hand.buttons = 0;
    for (int k = 0; k < 300; ++k) {
      b.tick();
      powered += b.stage.on ? 1 : 0;
    }
    EXPECT_EQ(powered, 0) << in_a_stop;
    EXPECT_EQ(b.stage.commands, sent) << in_a_stop;
    b.run(1);
  }
}

}  // namespace
}  // namespace punctum::rt::test
