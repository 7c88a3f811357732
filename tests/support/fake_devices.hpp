// Small devices for tests of the core: a hand with an arm, a lagging stage, an e-stop chain, an injector, a
// gauge, a force sensor. Each can fail in the ways the tests need. Nothing here comes from the simulated
// station. Whoever ticks the core sets now_ns of each device to the time of the tick: every reading is a
// sample of that time unless the test says otherwise.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "hal/devices.hpp"

namespace punctum::rt::test {

using hal::Status;
using hal::Vec3;

// 75 g, 0.1 N s/m, encoder steps of 0.03 mm; the arm pulls towards an intention.
struct FakeHand final : hal::HapticDevice {
  Vec3 x = Vec3::Zero(), v = Vec3::Zero(), intention = Vec3::Zero(), force = Vec3::Zero();
  double arm_k = 250, arm_c = 6;
  std::uint32_t buttons = 0;
  Status status = Status::ok;
  Status write_status = Status::ok;  // its readings may go on while no force reaches it
  bool nan = false;
  double jump_m = 0;
  double turn_rad = 0;  // about y
  double length = 1;    // of the quaternion
  bool frozen = false;  // readings repeat and look fresh
  bool only_x = false;  // of one axis
  Vec3 frozen_at = Vec3::Zero();
  bool held = false;  // the handle does not move
  int writes = 0;
  std::int64_t now_ns = 0;
  std::int64_t sample_every_ns = 0;  // the device has a rate of its own and repeats its newest sample
  std::int64_t ahead_ns = 0;         // its clock is wrong
  bool sampled = false;
  std::int64_t sampled_at_ns = 0;
  hal::HandState newest;  // what it showed last

  void step(double dt) {
    if (held) {
      v.setZero();
      return;
    }
    const int n = 50;
    for (int i = 0; i < n; ++i) {
      const Vec3 f = force + arm_k * (intention - x) - arm_c * v - 0.1 * v;
      v += f / 0.075 * (dt / n);
      x += v * (dt / n);
    }
  }
  Status read(hal::HandState& out) noexcept override {
    if (status != Status::ok) {
      return status;
    }
    if (sampled && now_ns < sampled_at_ns + sample_every_ns) {
      out = newest;
      return Status::ok;
    }
    for (int i = 0; i < 3; ++i) {
      out.position_m[i] = 0.03e-3 * std::round(x[i] / 0.03e-3);
    }
    out.position_m.x() += jump_m;
    if (frozen) {
      out.position_m.x() = frozen_at.x();
    }
    if (frozen && !only_x) {
      out.position_m = frozen_at;
    }
    frozen_at = out.position_m;
    if (nan) {
      out.position_m.y() = std::numeric_limits<double>::quiet_NaN();
    }
    out.orientation = hal::Quat(std::cos(turn_rad / 2), 0, std::sin(turn_rad / 2), 0);
    out.orientation.coeffs() *= length;
    out.buttons = buttons;
    out.sample_ns = now_ns + ahead_ns;
    newest = out;
    sampled = true;
    sampled_at_ns = now_ns;
    return Status::ok;
  }
  Status write_force(const Vec3& f) noexcept override {
    if (write_status != Status::ok) {
      return write_status;
    }
    force = f;
    ++writes;
    return Status::ok;
  }
};

struct FakeStage final : hal::Stage {
  Vec3 tip, axis = -Vec3::UnitX(), registration{3e-6, -2e-6, 0}, target, speed = Vec3::Zero();
  bool on = false, stopped = false, off_at_once = false;
  Status status = Status::ok;
  Status command_status = Status::ok;  // its readings may go on while no set-point reaches it
  double extra_error_m = 0;
  Vec3 false_m = Vec3::Zero();  // is told beside where the tip is
  bool nan = false;
  bool frozen = false;         // the encoders stand still, the drive finds nothing wrong
  bool deaf = false;           // it does not move any more
  bool runaway = false;        // it moves by itself
  bool ignores_stop = false;   // and goes on whatever it is told, powered or not
  bool hides_motion = false;   // it says that it stands
  bool ignores_power = false;  // it keeps its power when that is taken
  bool never_enables = false;
  std::size_t delay = 0;  // readings are so many ticks old
  std::int64_t now_ns = 0;
  bool repeats = false;  // the newest sample again and again, with its time
  std::vector<hal::StageState> readings;
  int commands = 0, quick_stops = 0;
  std::vector<Vec3> commanded;
  Vec3 commanded_axis = axis;

  explicit FakeStage(const Vec3& start) : tip(start), target(start) {}
  void step(double dt) {
    if (!on || stopped || deaf) {
      target = tip;
    }
    if (runaway && on && !stopped) {
      target += Vec3(0, 100e-6 * dt, 0);
    }
    if (ignores_stop) {
      target = tip + Vec3(0, 0.4e-6, 0);
    }
    const Vec3 next = target + (tip - target) * std::exp(-dt / 0.004);
    speed = (next - tip) / dt;
    tip = next;
  }
  Status read(hal::StageState& out) noexcept override {
    if (status != Status::ok) {
      return status;
    }
    if (!repeats || readings.empty()) {
      hal::StageState newest;
      newest.tip_m = frozen && !readings.empty() ? readings.back().tip_m : Vec3(tip + registration + false_m);
      newest.sample_ns = now_ns;
      readings.push_back(newest);
    }
    const hal::StageState& read = readings[readings.size() - 1 - std::min(delay, readings.size() - 1)];
    out.tip_m = read.tip_m;
    out.sample_ns = read.sample_ns;
    if (nan) {
      out.tip_m.x() = std::numeric_limits<double>::infinity();
    }
    out.axis = axis;
    out.following_error_m = Vec3(extra_error_m, 0, 0);
    out.enabled = on && !stopped && !off_at_once;
    out.powered = on && !off_at_once;
    out.at_standstill = hides_motion || speed.norm() < 1e-6;
    return Status::ok;
  }
  Status command(const hal::StageCommand& set_point) noexcept override {
    if (command_status != Status::ok) {
      return command_status;
    }
    if (!runaway) {
      target = set_point.tip_m - registration;
    }
    commanded.push_back(set_point.tip_m);
    commanded_axis = set_point.axis;
    ++commands;
    return Status::ok;
  }
  void quick_stop() noexcept override {
    stopped = true;
    ++quick_stops;
  }
  void enable(bool o) noexcept override {
    if (!o && !ignores_power) {
      stopped = false;
    }
    on = (o && !never_enables) || (on && ignores_power);
  }
};

struct FakeEstop final : hal::EstopChain {
  hal::EstopState state;
  Status status = Status::ok;
  std::int64_t now_ns = 0;
  int toggles = 0;
  bool level = false;
  bool enable_line = false;
  void drive_power(bool on) noexcept override { enable_line = on; }
  Status read(hal::EstopState& out) noexcept override {
    if (status == Status::ok) {
      out = state;
      out.sample_ns = now_ns;
    }
    return status;
  }
  void heartbeat(bool l) noexcept override {
    if (l != level) {
      ++toggles;
    }
    level = l;
  }
};

struct FakeEnabling final : hal::EnablingSwitch {
  hal::EnablingState state;
  Status status = Status::ok;
  std::int64_t now_ns = 0;
  void hold(bool held) { state.contact_a_closed = state.contact_b_closed = held; }
  Status read(hal::EnablingState& out) noexcept override {
    if (status == Status::ok) {
      out = state;
      out.sample_ns = now_ns;
    }
    return status;
  }
};

struct FakeInjector final : hal::Injector {
  bool open = false;
  int open_ticks = 0;
  bool jammed = false;
  Status status = Status::ok;
  std::int64_t now_ns = 0;
  void gate(bool o) noexcept override {
    if (!jammed) {
      open = o;
    }
    if (o) {
      ++open_ticks;
    }
  }
  Status read(hal::InjectorState& out) noexcept override {
    if (status == Status::ok) {
      out.open = open;
      out.sample_ns = now_ns;
    }
    return status;
  }
};

struct FakeVacuum final : hal::HoldingVacuum {
  double pressure = 600;
  int reads = 0;
  std::int64_t now_ns = 0;
  bool hangs = false;  // the same digits again and again
  Status read(hal::VacuumState& out) noexcept override {
    out.pressure_Pa = pressure + (hangs ? 0 : 0.1 * (reads++ % 2));
    out.sample_ns = now_ns;
    return Status::ok;
  }
};

struct FakeSensor final : hal::ForceSensor {
  double force = 0;
  std::int64_t now_ns = 0;
  Status read(hal::ForceState& out) noexcept override {
    out.axial_force_N = force;
    out.sample_ns = now_ns;
    return Status::ok;
  }
};

}  // namespace punctum::rt::test
