#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "rt/control/servo.hpp"
#include "rt/station/station.hpp"
#include "tests/support/fake_devices.hpp"

namespace punctum::rt::test {

// Every part of the scene `icsi` that has a place in the servo.
inline ServoConfig icsi() {
  ServoConfig c;
  c.membrane.emplace();
  c.cone.emplace();
  c.axis.emplace();
  c.damping.emplace();
  c.injector.emplace();
  c.vacuum.emplace();
  return c;
}

// The servo in closed loop: the fake devices, a sphere as the cell, and a microscope that sees it late.
struct Bench {
  explicit Bench(const ServoConfig& config, bool with_estop = true, bool with_switch = false)
      : config_(config),
        station(std::make_unique<LocalStation>()),
        servo(std::make_unique<Servo>(
            config,
            Devices{hand, &stage, with_estop ? &estop : nullptr, &injector, config.vacuum ? &vacuum : nullptr,
                    config.force_sensor ? &sensor : nullptr, with_switch ? &enabling : nullptr},
            station->station)) {}

  const ServoConfig config_;
  FakeHand hand;
  FakeStage stage{Vec3(60e-6, 2e-6, 0)};
  FakeEstop estop;
  FakeEnabling enabling;
  FakeInjector injector;
  FakeVacuum vacuum;
  FakeSensor sensor;
  std::unique_ptr<LocalStation> station;
  std::unique_ptr<Servo> servo;

  // The cell, and the microscope.
  Vec3 centre{-40e-6, 0, 0};
  double R = 60e-6, puncture_at = 14e-6, dimple = 0.45;
  bool punctured = false, seeing = true, aim = true;
  bool same_picture = false;              // again and again, with fresh times
  Vec3 picture_shift = Vec3::Zero();      // the microscope was bumped
  std::function<void(Observation&)> lie;  // what vision makes of it
  Observation shown;
  std::vector<std::pair<std::int64_t, Observation>> on_its_way;
  std::int64_t now = 1'000'000'000;
  std::uint64_t ticks = 0, missed = 0, frames = 0;
  std::vector<Phase> order{Phase::free};
  double hand_per_needle = 500;
  Vec3 tip_start{60e-6, 2e-6, 0};
  double wanted_x = 60e-6;  // where the operator wants the tip
  std::function<void()> every_tick;

  double dt() const { return 1 / config_.rate_Hz; }
  double gap() const {
    const double r2 = stage.tip.y() * stage.tip.y() + stage.tip.z() * stage.tip.z();
    return stage.tip.x() - (centre.x() + std::sqrt(R * R - r2));
  }
  const TelemetrySample& sample() const { return servo->sample(); }
  double effect_N(Effect effect) const { return sample().effect_N[effect]; }
  double force() const { return hand.force.norm(); }

  void look() {
    if (-gap() > puncture_at) {
      punctured = true;
    }
    if (gap() > 10e-6) {
      punctured = false;
    }
    if (!seeing) {
      return;
    }
    if (ticks % static_cast<std::uint64_t>(0.04 / dt()) == 0) {
      Observation o;
      o.exposure_ns = now;
      o.flags = Observation::tip_ok | Observation::outer_ok | (punctured ? Observation::punctured : 0U);
      for (int i = 0; i < 2; ++i) {
        o.tip_m[i] = stage.tip[i];
        o.centre_m[i] = centre[i];
      }
      o.R_m = R;
      o.gap_m = gap();
      if (gap() < 0) {
        o.flags |= Observation::contact;
        o.wd_m = punctured ? 0 : -gap();
        o.a_m = 3.8e-6 + dimple * std::sqrt(2 * R * -gap());
      }
      for (int i = 0; i < 2; ++i) {
        o.tip_m[i] += picture_shift[i];
        o.centre_m[i] += picture_shift[i];
      }
      if (same_picture) {
        o = shown;
      }
      o.exposure_ns = now;
      o.frame = ++frames;
      if (lie) {
        lie(o);
      }
      shown = o;
      on_its_way.emplace_back(now + 60'000'000, o);
    }
  }
  void deliver() {
    while (!on_its_way.empty() && on_its_way.front().first <= now) {
      station->observation.slot.push(on_its_way.front().second);
      on_its_way.erase(on_its_way.begin());
    }
  }
  void tell_time() {
    hand.now_ns = stage.now_ns = estop.now_ns = injector.now_ns = vacuum.now_ns = sensor.now_ns =
        enabling.now_ns = now;
  }
  void tick() {
    now += std::llround(1e9 * dt());
    hand.intention.x() = (wanted_x - tip_start.x()) * hand_per_needle;
    hand.step(dt());
    stage.step(dt());
    tell_time();
    look();
    deliver();
    servo->tick({ticks, now, now, dt(), missed});
    if (servo->phase() != order.back()) {
      order.push_back(servo->phase());
    }
    ++ticks;
    ASSERT_TRUE(hand.force.allFinite());
    ASSERT_LE(hand.force.norm(), config_.limits.hand_force_N * (1 + 1e-9));
    if (every_tick) {
      every_tick();
    }
  }
  void run(double seconds) {
    const double until = static_cast<double>(ticks) + seconds / dt();
    while (static_cast<double>(ticks) < until - 0.5) {
      tick();
    }
  }
  // Runs with these buttons of the handle held down; they stay so.
  void hold(std::uint32_t buttons, double seconds) {
    hand.buttons = buttons;
    run(seconds);
  }
  void move(double to, double speed) {
    const double way = to - wanted_x;
    const double from = wanted_x;
    const int n = static_cast<int>(std::abs(way) / speed / dt());
    for (int k = 1; k <= n; ++k) {
      wanted_x = from + way * k / n;
      tick();
    }
  }
  void to_indentation() {
    run(1);
    move(10e-6, 15e-6);
    run(0.3);
    ASSERT_EQ(servo->phase(), Phase::indentation);
  }
  void to_inside() {
    to_indentation();
    while (servo->phase() != Phase::puncture && ticks < 60000) {
      wanted_x -= 5e-9 * dt() * 1e3;
      tick();
    }
    ASSERT_EQ(servo->phase(), Phase::puncture);
  }
};

}  // namespace punctum::rt::test
