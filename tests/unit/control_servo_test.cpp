// The servo in closed loop with small devices of this file's own: a hand with an arm, a lagging stage, a
// sphere seen late. Nothing here comes from the simulated station.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "rt/control/frames.hpp"
#include "rt/control/servo.hpp"
#include "rt/station/station.hpp"

namespace punctum::rt {
namespace {

using hal::Status;
using hal::Vec3;

// 75 g, 0.1 N s/m, encoder steps of 0.03 mm; the arm pulls towards an intention.
struct FakeHand final : hal::HapticDevice {
  Vec3 x = Vec3::Zero(), v = Vec3::Zero(), intention = Vec3::Zero(), force = Vec3::Zero();
  double arm_k = 250, arm_c = 6;
  std::uint32_t buttons = 0;
  Status status = Status::ok;
  bool nan = false;
  double jump_m = 0;
  bool frozen = false;  // readings repeat and look fresh
  bool only_x = false;  // of one axis
  Vec3 frozen_at = Vec3::Zero();
  bool held = false;  // the handle does not move
  int writes = 0;

  void step(double dt) {
    if (held) return v.setZero(), void();
    const int n = 50;
    for (int i = 0; i < n; ++i) {
      const Vec3 f = force + arm_k * (intention - x) - arm_c * v - 0.1 * v;
      v += f / 0.075 * (dt / n);
      x += v * (dt / n);
    }
  }
  Status read(hal::HandState& out) noexcept override {
    if (status != Status::ok) return status;
    for (int i = 0; i < 3; ++i) out.position_m[i] = 0.03e-3 * std::round(x[i] / 0.03e-3);
    out.position_m.x() += jump_m;
    if (frozen) out.position_m.x() = frozen_at.x();
    if (frozen && !only_x) out.position_m = frozen_at;
    frozen_at = out.position_m;
    if (nan) out.position_m.y() = std::numeric_limits<double>::quiet_NaN();
    out.buttons = buttons;
    return Status::ok;
  }
  Status write_force(const Vec3& f) noexcept override {
    force = f;
    ++writes;
    return Status::ok;
  }
};

struct FakeStage final : hal::Stage {
  Vec3 tip, axis = -Vec3::UnitX(), registration{3e-6, -2e-6, 0}, target, speed = Vec3::Zero();
  bool on = false, stopped = false, off_at_once = false;
  Status status = Status::ok;
  double extra_error_m = 0;
  bool nan = false;
  bool frozen = false;    // the encoders stand still, the drive finds nothing wrong
  bool deaf = false;      // it does not move any more
  bool runaway = false;   // it moves by itself
  std::size_t delay = 0;  // readings are so many ticks old
  std::vector<Vec3> readings;
  int commands = 0, quick_stops = 0;
  std::vector<Vec3> commanded;

  explicit FakeStage(const Vec3& start) : tip(start), target(start) {}
  void step(double dt) {
    if (!on || stopped || deaf) target = tip;
    if (runaway && on && !stopped) target += Vec3(0, 100e-6 * dt, 0);
    const Vec3 next = target + (tip - target) * std::exp(-dt / 0.004);
    speed = (next - tip) / dt;
    tip = next;
  }
  Status read(hal::StageState& out) noexcept override {
    if (status != Status::ok) return status;
    readings.push_back(frozen && !readings.empty() ? readings.back() : Vec3(tip + registration));
    out.tip_m = readings[readings.size() - 1 - std::min(delay, readings.size() - 1)];
    if (nan) out.tip_m.x() = std::numeric_limits<double>::infinity();
    out.axis = axis;
    out.following_error_m = Vec3(extra_error_m, 0, 0);
    out.enabled = on && !stopped && !off_at_once;
    out.at_standstill = speed.norm() < 1e-6;
    return Status::ok;
  }
  Status command(const hal::StageCommand& set_point) noexcept override {
    if (!runaway) target = set_point.tip_m - registration;
    commanded.push_back(set_point.tip_m);
    ++commands;
    return Status::ok;
  }
  void quick_stop() noexcept override {
    stopped = true;
    ++quick_stops;
  }
  void enable(bool o) noexcept override {
    if (!o) stopped = false;
    on = o;
  }
};

struct FakeEstop final : hal::EstopChain {
  hal::EstopState state;
  Status status = Status::ok;
  int toggles = 0;
  bool level = false;
  Status read(hal::EstopState& out) noexcept override {
    if (status == Status::ok) out = state;
    return status;
  }
  void heartbeat(bool l) noexcept override {
    if (l != level) ++toggles;
    level = l;
  }
};

struct FakeInjector final : hal::Injector {
  bool open = false;
  int open_ticks = 0;
  bool jammed = false;
  void gate(bool o) noexcept override {
    if (!jammed) open = o;
    if (o) ++open_ticks;
  }
  Status read(bool& o) noexcept override {
    o = open;
    return Status::ok;
  }
};

struct FakeVacuum final : hal::HoldingVacuum {
  double pressure = 600;
  int reads = 0;
  bool hangs = false;  // the same digits again and again
  Status read(double& p) noexcept override {
    p = pressure + (hangs ? 0 : 0.1 * (reads++ % 2));
    return Status::ok;
  }
};

struct FakeSensor final : hal::ForceSensor {
  double force = 0;
  Status read(double& f) noexcept override {
    f = force;
    return Status::ok;
  }
};

ServoConfig icsi() {
  ServoConfig c;
  c.membrane.emplace();
  c.cone.emplace();
  c.axis.emplace();
  c.damping.emplace();
  c.injector.emplace();
  c.vacuum.emplace();
  return c;
}

struct Bench {
  explicit Bench(const ServoConfig& config, bool with_estop = true)
      : config_(config),
        station(std::make_unique<Station>()),
        servo(std::make_unique<Servo>(
            config,
            Devices{hand, &stage, with_estop ? &estop : nullptr, &injector, config.vacuum ? &vacuum : nullptr,
                    config.force_sensor ? &sensor : nullptr},
            *station)) {}

  const ServoConfig config_;
  FakeHand hand;
  FakeStage stage{Vec3(60e-6, 2e-6, 0)};
  FakeEstop estop;
  FakeInjector injector;
  FakeVacuum vacuum;
  FakeSensor sensor;
  std::unique_ptr<Station> station;
  std::unique_ptr<Servo> servo;

  // The cell and who looks at it.
  Vec3 centre{-40e-6, 0, 0};
  double R = 60e-6, puncture_at = 14e-6, dimple = 0.45;
  bool punctured = false, seeing = true, aim = true;
  bool same_picture = false;          // again and again, with fresh times
  Vec3 picture_shift = Vec3::Zero();  // somebody has bumped the microscope
  Observation shown;
  std::vector<std::pair<std::int64_t, Observation>> on_its_way;
  std::int64_t now = 1'000'000'000;
  std::uint64_t ticks = 0, missed = 0;
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
  double force() const { return hand.force.norm(); }

  void look() {
    if (-gap() > puncture_at) punctured = true;
    if (gap() > 10e-6) punctured = false;
    if (!seeing) return;
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
      if (same_picture) o = shown;
      o.exposure_ns = now;
      shown = o;
      on_its_way.emplace_back(now + 60'000'000, o);
    }
  }
  void deliver() {
    while (!on_its_way.empty() && on_its_way.front().first <= now) {
      station->observation.push(on_its_way.front().second);
      on_its_way.erase(on_its_way.begin());
    }
  }
  void tick() {
    now += std::llround(1e9 * dt());
    hand.intention.x() = (wanted_x - tip_start.x()) * hand_per_needle;
    hand.step(dt());
    stage.step(dt());
    look();
    deliver();
    servo->tick({ticks, now, now, dt(), missed});
    if (servo->phase() != order.back()) order.push_back(servo->phase());
    ++ticks;
    ASSERT_TRUE(hand.force.allFinite());
    ASSERT_LE(hand.force.norm(), config_.limits.hand_force_N * (1 + 1e-9));
    if (every_tick) every_tick();
  }
  void run(double seconds) {
    const double until = static_cast<double>(ticks) + seconds / dt();
    while (static_cast<double>(ticks) < until - 0.5) tick();
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

using enum Phase;

TEST(Servo, takes_a_needle_through_a_whole_injection) {
  for (const double rate : {1000.0, 4000.0}) {
    ServoConfig config = icsi();
    config.rate_Hz = rate;
    Bench b(config);
    double peak = 0, deepest = 0;
    b.every_tick = [&] {
      peak = std::max(peak, b.force());
      deepest = std::max(deepest, -b.gap());
      // The reported parts are the parts of what goes to the hand; the rim's vectors sum to the membrane's.
      const TelemetrySample& s = b.sample();
      Vec3 rim = Vec3::Zero();
      for (const auto& f : s.contact_force_N) rim += Vec3(f[0], f[1], f[2]);
      ASSERT_NEAR(rim.norm(), s.membrane_N, 1e-9);
      ASSERT_LE(b.force(), s.membrane_N + s.cone_N + s.axis_N + s.damping_N + 1e-9);
    };
    b.to_inside();
    b.move(b.wanted_x - 20e-6, 20e-6);
    b.hand.buttons = hal::kButtonInject;
    b.run(1);
    EXPECT_TRUE(b.injector.open);
    b.hand.buttons = 0;
    b.run(0.1);
    EXPECT_FALSE(b.injector.open);
    b.move(60e-6, 40e-6);
    b.run(1);
    EXPECT_EQ(b.order, (std::vector{free, contact, indentation, puncture, injection, withdrawal, clear}));
    EXPECT_EQ(b.servo->outcome(), Outcome::done);
    EXPECT_EQ(b.force(), 0);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    EXPECT_EQ(b.servo->cells_done(), 1U);
    EXPECT_EQ(b.station->core.task_finished.load(), 1U);
    EXPECT_GT(peak, 0.05);
    EXPECT_LT(peak, 2.0);
    EXPECT_LT(deepest, config.limits.penetration_depth_m);
    EXPECT_EQ(b.estop.toggles, static_cast<int>(b.ticks));
    std::printf("%.0f Hz: peak %.2f N, depth %.1f um, injected energy %.2e J\n", rate, peak, 1e6 * deepest,
                b.sample().injected_energy_J);
  }
}

TEST(Servo, does_not_call_a_cell_done_that_got_nothing) {
  for (const bool pressed : {false, true}) {  // pressed: the gate is told to open, but the injector does not
    Bench b(icsi());
    b.injector.jammed = true;
    b.to_inside();
    if (pressed) b.hand.buttons = hal::kButtonInject;
    b.run(0.5);
    b.hand.buttons = 0;
    b.move(60e-6, 40e-6);
    b.run(1);
    EXPECT_EQ(b.servo->phase(), Phase::clear);
    EXPECT_EQ(b.servo->outcome(), Outcome::ended);
    EXPECT_EQ(b.station->core.task_finished.load(), 0U);
  }
}

TEST(Servo, renders_the_papers_law_of_the_depth_it_reports_within_a_percent_at_rest) {
  ServoConfig config = icsi();
  config.membrane->law = MembraneParams::Law::paper;
  config.local_model->dimple_scale_rate_1_s = 0.5;
  Bench b(config);
  b.to_indentation();
  b.run(3);
  const TelemetrySample& s = b.sample();
  EXPECT_NEAR(s.wd_m, -b.gap(), 20e-9);
  EXPECT_NEAR(s.a_m, 3.8e-6 + 0.45 * std::sqrt(2 * 60e-6 * s.wd_m), 0.1e-6);
  const double force =
      membrane_force(35.3e3, 0.5, 4.6e-6, 3.8e-6, -b.gap(), 3.8e-6 + 0.45 * std::sqrt(-b.gap() * 2 * 60e-6));
  EXPECT_NEAR(s.membrane_N / (1e5 * force), 1, 0.01);
  EXPECT_GT(s.force_N[0], 0);  // pushes the hand back, to the right
  EXPECT_NEAR(s.pressure_Pa, s.tip_force_N / (3.14159265 * s.a_m * s.a_m), 1e-6 * s.pressure_Pa);
  EXPECT_NE(s.alarms & alarm_model_invalid, 0U);  // too steep for it
}

TEST(Servo, renders_the_corrected_law_of_the_depth_it_reports_at_rest) {
  Bench b(icsi());
  b.to_indentation();
  b.run(3);
  const TelemetrySample& s = b.sample();
  EXPECT_NEAR(s.wd_m, -b.gap(), 20e-9);
  // F / (E h R w) = 0.715 at w/R = 0.125 and 0.720 at 0.375: membrane_truth_reference.py, of c/R = 0.0625.
  const double force = 0.717 * 35.3e3 * 4.6e-6 * -b.gap();
  EXPECT_NEAR(s.membrane_N / (1e5 * force), 1, 0.05);
  EXPECT_GT(s.force_N[0], 0);
  EXPECT_EQ(s.alarms & alarm_model_invalid, 0U);
}

TEST(Servo, stops_when_the_membrane_law_gives_no_number) {
  ServoConfig config = icsi();
  config.membrane->E_Pa = std::numeric_limits<double>::quiet_NaN();
  Bench b(config);
  b.run(2);
  EXPECT_EQ(b.sample().fault, Fault::not_finite);
  for (const double f : b.sample().force_N) EXPECT_EQ(f, 0);
}

TEST(Servo, holds_still_in_contact_without_a_limit_cycle) {
  // Of a stiff membrane: at the hand k_f/k_p dF/dw of the order of the arm's own stiffness.
  for (const double rate : {1000.0, 8000.0}) {
    ServoConfig config = icsi();
    config.membrane->E_Pa *= 5;
    config.rate_Hz = rate;
    config.limits.tip_force_soft_N = 1;
    config.limits.tip_force_hard_N = 1;
    Bench b(config);
    b.puncture_at = 1;
    b.to_indentation();
    b.move(0, 15e-6);
    b.run(3);
    double low = 1, high = -1;
    b.every_tick = [&] {
      low = std::min(low, b.hand.x.x());
      high = std::max(high, b.hand.x.x());
    };
    b.run(2);
    EXPECT_LT(high - low, 0.06e-3) << "two encoder steps";
    std::printf("%.0f Hz: hand moves %.3f mm at %.2f N\n", rate, 1e3 * (high - low), b.force());
  }
}

// The needle follows the hand late, so its force gives energy; the stage pays for the dimple that it presses
// in while the hand already rests.
TEST(Servo, leaves_the_membrane_its_force_under_a_hand_that_rests_although_the_guard_is_on) {
  ServoConfig config = icsi();
  config.guard.emplace();
  Bench b(config);
  b.puncture_at = 1;
  b.run(1);
  for (const double speed_m_s : {15e-6, 50e-6, 100e-6}) {
    b.move(8e-6, speed_m_s);
    b.run(0.5);
    double force_N = 0, membrane_N = 0;
    b.every_tick = [&] {
      force_N += b.hand.force.x();
      membrane_N += b.sample().membrane_N;
    };
    b.run(3);
    b.every_tick = nullptr;
    EXPECT_GT(force_N, 0.9 * membrane_N) << speed_m_s;
    b.move(30e-6, speed_m_s);
    b.run(0.5);
  }
}

// A bristle is a spring until it slides.
TEST(Servo, does_not_let_a_free_handle_ring_in_a_stiff_bristle_with_the_guard) {
  for (const bool guarded : {false, true}) {
    ServoConfig config;
    config.friction = FrictionParams{.F_c_N = 0.5, .K_N_m = 1000};
    if (guarded) config.guard.emplace();
    Bench b(config);
    b.hand.arm_k = b.hand.arm_c = 0;
    b.run(1);
    b.hand.v = {0.05, 0.02, 0};
    b.run(4);
    Vec3 low = b.hand.x, high = b.hand.x;
    b.every_tick = [&] {
      low = low.cwiseMin(b.hand.x);
      high = high.cwiseMax(b.hand.x);
    };
    b.run(1);
    if (guarded) {
      EXPECT_LT((high - low).maxCoeff(), 0.06e-3);
    } else {
      EXPECT_GT((high - low).maxCoeff(), 0.5e-3);
    }
  }
}

TEST(Servo, does_not_let_a_loosely_held_hand_swing_against_the_late_needle_with_the_guard) {
  for (const bool guarded : {false, true}) {
    ServoConfig config = icsi();
    config.damping.reset();
    config.cone.reset();
    if (guarded) config.guard.emplace();
    Bench b(config);
    b.puncture_at = 1;
    b.hand.arm_k = 8;
    b.hand.arm_c = 1;
    b.run(1);
    b.move(-20e-6, 200e-6);
    b.run(8);
    double low = 1, high = -1;
    b.every_tick = [&] {
      low = std::min(low, b.hand.x.x());
      high = std::max(high, b.hand.x.x());
    };
    b.run(2);
    if (guarded) {
      EXPECT_LT(high - low, 0.15e-3);
      EXPECT_GT(b.hand.force.x(), 0.9 * b.sample().membrane_N);
    } else {
      EXPECT_GT(high - low, 10e-3);
    }
  }
}

TEST(Servo, pushes_a_handle_that_is_let_go_out_of_contact_and_no_further) {
  Bench b(icsi());
  b.to_indentation();
  b.hand.arm_k = b.hand.arm_c = 0;
  double fastest = 0;
  b.every_tick = [&] { fastest = std::max(fastest, b.hand.v.norm()); };
  b.run(5);
  EXPECT_GT(b.gap(), -1e-6);
  EXPECT_LT(b.gap(), 40e-6);
  EXPECT_LT(b.hand.v.norm(), 2e-3);
  EXPECT_LT(fastest, 0.3);
}

TEST(Servo, lets_a_handle_that_is_let_go_come_to_rest_in_the_guide) {
  for (const double rate : {1000.0, 8000.0}) {
    ServoConfig config = icsi();
    config.rate_Hz = rate;
    Bench b(config);
    b.tip_start = b.stage.tip = b.stage.target = Vec3(30e-6, 12e-6, 0);
    b.wanted_x = 30e-6;
    b.run(1);
    EXPECT_GT(b.sample().cone_N, 0.2);
    b.hand.arm_k = b.hand.arm_c = 0;
    b.run(5);
    double low = 1, high = -1;
    b.every_tick = [&] {
      low = std::min(low, b.hand.x.y());
      high = std::max(high, b.hand.x.y());
    };
    b.run(1);
    EXPECT_LT(high - low, 0.1e-3);
    EXPECT_LT(std::abs(b.stage.tip.y()), 4e-6);  // inside the free core
    std::printf("%.0f Hz: handle moves %.3f mm, tip %.1f um beside the axis\n", rate, 1e3 * (high - low),
                1e6 * b.stage.tip.y());
  }
}

TEST(Servo, drops_the_force_at_the_puncture_without_a_bounce) {
  Bench b(icsi());
  b.to_indentation();
  double before = 1e9;
  bool falling = false;
  int ticks_to_zero = 0;
  b.every_tick = [&] {
    const double membrane = b.sample().membrane_N;
    if (b.servo->phase() == puncture || falling) {
      falling = true;
      ASSERT_LE(membrane, before + 1e-12);
      if (membrane > 0) ++ticks_to_zero;
    }
    before = membrane;
  };
  b.move(0, 15e-6);
  b.run(3);
  EXPECT_TRUE(falling);
  EXPECT_EQ(before, 0);
  EXPECT_LE(ticks_to_zero, 31);
}

TEST(Servo, stops_within_the_tick_that_sees_the_contact_open_and_fades_the_hand_in_20_ms) {
  for (const bool a : {true, false}) {
    Bench b(icsi());
    b.to_inside();
    b.hand.buttons = hal::kButtonInject;
    b.run(0.2);
    ASSERT_TRUE(b.injector.open);
    const double force = b.force();
    ASSERT_GE(force, 0);
    (a ? b.estop.state.contact_a_closed : b.estop.state.contact_b_closed) = false;
    b.tick();
    EXPECT_GE(b.stage.quick_stops, 1);
    EXPECT_FALSE(b.injector.open);
    EXPECT_EQ(b.servo->fault(), Fault::estop);
    double before = b.force();
    for (int k = 1; k < 20; ++k) {
      b.tick();
      EXPECT_LE(b.force(), before + 1e-12);
      EXPECT_LE(before - b.force(), 2 * force / 20 + 1e-12);
      before = b.force();
    }
    EXPECT_EQ(b.force(), 0);
    b.run(0.6);
    EXPECT_FALSE(b.stage.on);
    EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
    EXPECT_FALSE(b.servo->finished());
  }
}

TEST(Servo, sees_a_pulse_shorter_than_a_tick) {
  Bench b(icsi());
  b.run(0.5);
  b.estop.state.pulse_seen = true;
  b.tick();
  EXPECT_EQ(b.servo->fault(), Fault::estop);
}

TEST(Servo, resumes_only_after_release_and_reset_and_moves_nothing_by_itself) {
  Bench b(icsi());
  b.to_indentation();
  b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = false;
  b.run(1);
  // Meanwhile the hand goes somewhere else.
  b.wanted_x = -20e-6;
  b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = true;
  b.run(1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
  EXPECT_FALSE(b.stage.on);
  const Vec3 tip = b.stage.tip;
  b.estop.state.reset_pressed = true;
  double before = b.force();
  double steepest = 0;
  b.every_tick = [&] {
    steepest = std::max(steepest, b.force() - before);
    before = b.force();
  };
  b.run(0.2);
  b.estop.state.reset_pressed = false;
  b.run(2);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  EXPECT_TRUE(b.stage.on);
  EXPECT_LT((b.stage.tip - tip).norm(), 1.5e-6);  // only what the returning force pushes the hand back
  EXPECT_LT(steepest, 0.02);                      // N per ms
  EXPECT_EQ(b.station->core.faults_latched.load(), 1U << static_cast<int>(Fault::estop));
  // And the hand drives it again.
  b.move(b.wanted_x + 20e-6, 20e-6);
  EXPECT_GT(b.stage.tip.x() - tip.x(), 15e-6);
}

TEST(Servo, refuses_a_reset_while_one_contact_is_welded) {
  Bench b(icsi());
  b.run(0.5);
  b.estop.state.contact_a_closed = false;  // b stays shut
  b.run(0.2);
  EXPECT_EQ(b.servo->fault(), Fault::estop);  // first cause kept
  EXPECT_NE(b.station->core.faults_latched.load() & (1U << static_cast<int>(Fault::estop_discrepancy)), 0U);
  b.estop.state.contact_a_closed = true;
  b.run(1);
  b.estop.state.reset_pressed = true;
  b.run(0.1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
  // Both open once: they are seen to work.
  b.estop.state = {false, false, false, false};
  b.run(0.1);
  b.estop.state = {true, true, false, false};
  b.run(0.1);
  b.estop.state.reset_pressed = true;
  b.run(0.1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::running);
}

TEST(Servo, latches_each_device_fault_under_its_own_name) {
  struct Case {
    Fault expected;
    double within_s;
    std::function<void(Bench&)> break_it;
  };
  const std::vector<Case> cases{
      {Fault::hand_lost, 0.001, [](Bench& b) { b.hand.status = Status::disconnected; }},
      {Fault::hand_lost, 0.022, [](Bench& b) { b.hand.status = Status::no_data; }},
      {Fault::hand_invalid, 0.001, [](Bench& b) { b.hand.nan = true; }},
      {Fault::hand_invalid, 0.001, [](Bench& b) { b.hand.jump_m = 0.03; }},
      {Fault::stage_lost, 0.001, [](Bench& b) { b.stage.status = Status::disconnected; }},
      {Fault::stage_lost, 0.022, [](Bench& b) { b.stage.status = Status::no_data; }},
      {Fault::stage_fault, 0.001, [](Bench& b) { b.stage.status = Status::fault; }},
      {Fault::stage_fault, 0.001, [](Bench& b) { b.stage.nan = true; }},
      {Fault::stage_fault, 0.001, [](Bench& b) { b.stage.off_at_once = true; }},
      {Fault::stage_following, 0.001, [](Bench& b) { b.stage.extra_error_m = 20e-6; }},
      {Fault::estop_lost, 0.001, [](Bench& b) { b.estop.status = Status::disconnected; }},
      {Fault::estop_lost, 0.022, [](Bench& b) { b.estop.status = Status::no_data; }},
      {Fault::vacuum_lost, 0.102, [](Bench& b) { b.vacuum.pressure = 100; }},
      {Fault::command_stop, 0.001,
       [](Bench& b) {
         ASSERT_TRUE(b.station->commands.try_push({Command::stop, 0}));
       }},
      {Fault::command_stop, 0.001, [](Bench& b) { b.servo->request_stop(); }},
  };
  for (const Case& c : cases) {
    Bench b(icsi());
    b.to_indentation();
    ASSERT_EQ(b.servo->fault(), Fault::none);
    c.break_it(b);
    b.run(c.within_s);
    EXPECT_EQ(b.servo->fault(), c.expected) << name(c.expected);
    EXPECT_FALSE(b.injector.open);
    b.run(1);
    EXPECT_EQ(b.force(), 0);
    EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
    EXPECT_EQ(b.servo->fault(), c.expected);
    EXPECT_EQ(b.servo->finished(), c.expected == Fault::command_stop);
    EXPECT_EQ(b.vacuum.pressure, c.expected == Fault::vacuum_lost ? 100 : 600);
  }
}

TEST(Servo, treats_overruns_as_a_fault_with_real_actuators_and_as_an_alarm_without) {
  for (const bool real : {false, true}) {
    ServoConfig config = icsi();
    config.real_actuators = real;
    Bench b(config);
    b.run(0.5);
    b.missed = 20;
    b.run(0.1);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    b.missed = 21;
    b.run(0.1);
    EXPECT_EQ(b.servo->fault(), real ? Fault::overrun : Fault::none);
    EXPECT_EQ((b.sample().alarms & alarm_overrun) != 0, !real);
    // A loop that is not to be trusted lets the relay open once it has stopped.
    b.run(1);
    const int toggles = b.estop.toggles;
    b.run(0.1);
    EXPECT_EQ(b.estop.toggles - toggles, real ? 0 : 100);
  }
}

TEST(Servo, survives_a_missing_sample_without_a_step) {
  Bench b(icsi());
  b.to_indentation();
  double before = b.force();
  double steepest = 0;
  b.every_tick = [&] {
    steepest = std::max(steepest, std::abs(b.force() - before));
    before = b.force();
    b.hand.status = b.ticks % 7 == 0 ? Status::no_data : Status::ok;
    b.stage.status = b.ticks % 11 == 0 ? Status::no_data : Status::ok;
    b.estop.status = b.ticks % 13 == 0 ? Status::no_data : Status::ok;
  };
  b.run(2);
  EXPECT_NE(b.servo->fault(), Fault::hand_lost);
  EXPECT_LT(steepest, 0.05);
}

TEST(Servo, accepts_only_withdrawal_while_vision_is_silent_and_goes_on_when_it_is_back) {
  Bench b(icsi());
  b.to_indentation();
  EXPECT_GT(b.sample().membrane_N, 0.02);
  b.seeing = false;
  b.run(1);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_EQ(b.sample().membrane_N, 0);
  EXPECT_EQ(b.sample().cone_N, 0);
  EXPECT_GT(b.sample().obs_age_s, 1);
  EXPECT_GT(b.sample().stale_ticks, 500U);

  // Wherever the hand goes, set-points move only outward along the axis.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  Vec3 before = b.stage.commanded.back();
  b.every_tick = [&] {
    if (b.ticks % 100 == 0) {
      b.wanted_x += 8e-6 * u(random);
      b.hand.intention.y() = 0.01 * u(random);
      b.hand.intention.z() = 0.01 * u(random);
    }
    const Vec3 step = b.stage.commanded.back() - before;
    ASSERT_GE(step.x(), 0);
    ASSERT_EQ(step.y(), 0);
    ASSERT_EQ(step.z(), 0);
    before = b.stage.commanded.back();
  };
  b.run(5);
  b.every_tick = nullptr;
  const double silent_tip = b.stage.tip.x();

  // Back again: nothing jumps, the force returns by a ramp, the hand moves the needle in again.
  b.seeing = true;
  double force = b.force();
  double steepest = 0;
  double speed = 0;
  b.every_tick = [&] {
    steepest = std::max(steepest, b.force() - force);
    force = b.force();
    speed = std::max(speed, b.stage.speed.norm());
  };
  b.run(1.5);
  EXPECT_EQ(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_NEAR(b.stage.tip.x(), silent_tip, 3e-6);
  EXPECT_LT(steepest, 0.02);
  EXPECT_LT(speed, 60e-6);
  b.every_tick = nullptr;
  b.move(b.wanted_x - 15e-6, 15e-6);
  b.run(0.3);
  EXPECT_LT(b.stage.tip.x(), silent_tip - 5e-6);
}

TEST(Servo, does_not_push_the_needle_on_by_a_picture_that_stands_still) {
  Bench b(icsi());
  b.puncture_at = 1;
  b.to_indentation();
  b.same_picture = true;
  const double tip = b.stage.tip.x();
  b.move(b.wanted_x - 40e-6, 10e-6);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_EQ(b.sample().membrane_N, 0);
  EXPECT_LT(tip - b.stage.tip.x(), 8e-6 + 0.4 * 10e-6);
  // Pictures again: it goes on.
  b.same_picture = false;
  b.run(1);
  EXPECT_EQ(b.sample().alarms & alarm_vision_stale, 0U);
  const double again = b.stage.tip.x();
  b.move(b.wanted_x - 3e-6, 10e-6);
  b.run(0.3);
  EXPECT_LT(b.stage.tip.x(), again - 2e-6);
}

TEST(Servo, trusts_a_bumped_microscope_again_once_the_needle_has_moved_in_its_picture) {
  Bench b(icsi());
  b.to_indentation();
  b.picture_shift = Vec3(0, 30e-6, 0);
  b.run(1);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  b.run(60);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  b.move(b.wanted_x + 30e-6, 20e-6);  // out is allowed
  b.run(1);
  EXPECT_EQ(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_EQ(b.servo->fault(), Fault::none);
}

TEST(Servo, does_not_let_the_needle_approach_before_anything_was_seen) {
  Bench b(icsi());
  b.seeing = false;
  b.run(0.5);
  b.move(20e-6, 20e-6);
  EXPECT_NEAR(b.stage.tip.x(), 60e-6, 0.1e-6);
  EXPECT_NE(b.sample().alarms & alarm_vision_stale, 0U);
  EXPECT_EQ(b.sample().obs_age_s, -1);
}

TEST(Servo, holds_the_needle_at_the_depth_limit_and_at_the_soft_tip_force) {
  ServoConfig config = icsi();
  config.limits.penetration_depth_m = 20e-6;
  Bench b(config);
  b.to_inside();
  b.move(-60e-6, 40e-6);
  b.run(1);
  EXPECT_NE(b.sample().alarms & alarm_depth_limited, 0U);
  EXPECT_LT(-b.gap(), 20.1e-6);
  EXPECT_GT(-b.gap(), 19e-6);

  ServoConfig soft = icsi();
  soft.limits.tip_force_soft_N = 2e-6;
  Bench s(soft);
  s.puncture_at = 1;
  s.to_indentation();
  s.move(-20e-6, 10e-6);
  s.run(0.5);
  EXPECT_NE(s.sample().alarms & alarm_tip_force, 0U);
  EXPECT_LT(s.sample().tip_force_N, 2.4e-6);
  EXPECT_EQ(s.servo->fault(), Fault::none);
}

TEST(Servo, stops_at_the_hard_tip_force_as_measured) {
  ServoConfig config = icsi();
  config.force_sensor = true;
  Bench b(config);
  b.to_indentation();
  b.sensor.force = 70e-6;
  b.run(0.05);
  EXPECT_EQ(b.servo->fault(), Fault::tip_force);
}

TEST(Servo, clamps_the_injection) {
  ServoConfig config = icsi();
  config.injector->max_open_s = 0.25;
  Bench b(config);
  b.to_inside();
  b.hand.buttons = hal::kButtonInject;
  b.run(2);
  EXPECT_EQ(b.injector.open_ticks, 250);
  EXPECT_FALSE(b.injector.open);
  // Pressing again does not open it again for this cell.
  b.hand.buttons = 0;
  b.run(0.1);
  b.hand.buttons = hal::kButtonInject;
  b.run(1);
  EXPECT_EQ(b.injector.open_ticks, 250);
}

TEST(Servo, clutch_uncouples_the_needle_and_its_forces) {
  Bench b(icsi());
  b.to_indentation();
  const double gap = b.gap();
  b.hand.buttons = hal::kButtonClutch;
  b.run(0.5);
  EXPECT_EQ(b.sample().membrane_N, 0);
  const Vec3 tip = b.stage.tip;
  b.hand_per_needle = 300;  // the hand goes elsewhere
  b.run(1);
  EXPECT_LT((b.stage.tip - tip).norm(), 0.1e-6);
  b.hand.buttons = 0;
  b.run(0.5);
  EXPECT_NEAR(b.gap(), gap, 3e-6);
  EXPECT_GT(b.sample().membrane_N, 0);
}

TEST(Servo, notices_a_stage_whose_readings_stand_still_or_run_away_while_its_drive_says_all_is_well) {
  for (const double rate : {1000.0, 8000.0}) {
    for (const int how : {0, 1, 2}) {
      ServoConfig config = icsi();
      config.rate_Hz = rate;
      Bench b(config);
      b.run(1);
      (how == 0 ? b.stage.frozen : how == 1 ? b.stage.deaf : b.stage.runaway) = true;
      const Vec3 told = b.stage.commanded.back();
      const Vec3 stood = b.stage.tip;
      for (int k = 0; k < 3 * rate && b.servo->fault() == Fault::none; ++k) {
        if (how != 2) b.wanted_x -= 20e-6 * b.dt();
        b.tick();
      }
      EXPECT_EQ(b.servo->fault(), Fault::stage_following) << how;
      EXPECT_GE(b.stage.quick_stops, 1);
      // No further than the limit and what a reading may be old.
      EXPECT_LT((b.stage.commanded.back() - told).norm(), 11e-6) << how;
      EXPECT_LT((b.stage.tip - stood).norm(), 13e-6) << how;
    }
  }
}

TEST(Servo, follows_a_stage_whose_readings_are_as_old_as_they_may_be_at_full_speed) {
  for (const double rate : {1000.0, 8000.0}) {
    ServoConfig config = icsi();
    config.rate_Hz = rate;
    config.mapping.tremor_cutoff_Hz = 0;
    Bench b(config);
    b.stage.delay = static_cast<std::size_t>(0.019 * rate);
    b.run(1);
    double fastest = 0;
    b.every_tick = [&] { fastest = std::max(fastest, b.stage.speed.norm()); };
    b.move(250e-6, 380e-6);
    b.move(60e-6, 380e-6);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    EXPECT_GT(fastest, 350e-6);
  }
}

TEST(Servo, does_not_follow_a_hand_whose_readings_stood_still_and_are_suddenly_elsewhere) {
  for (const bool one_axis : {false, true}) {
    Bench b(icsi());
    b.to_indentation();
    b.hand.frozen = true;
    b.hand.only_x = one_axis;
    int tick = 0;
    b.every_tick = [&] { b.hand.intention.y() = 0.5e-3 * std::sin(0.05 * ++tick); };
    b.move(b.wanted_x + 20e-6, 40e-6);  // 10 mm at the hand
    b.run(0.5);
    EXPECT_EQ(b.servo->fault(), Fault::none);
    const Vec3 tip = b.stage.tip;
    b.hand.frozen = false;
    b.run(1);
    EXPECT_EQ(b.servo->fault(), Fault::hand_invalid);
    EXPECT_LT(std::abs(b.stage.tip.x() - tip.x()), 0.1e-6);
  }
}

TEST(Servo, fades_the_force_on_a_handle_that_a_changing_force_does_not_move) {
  ServoConfig config = icsi();
  config.membrane->E_Pa *= 3;
  Bench b(config);
  b.to_indentation();
  b.run(1);
  b.hand.frozen = true;
  b.run(1);
  // At rest under a steady force: an arm can do that.
  EXPECT_EQ(b.sample().alarms & alarm_sensor, 0U);
  EXPECT_GT(b.force(), 0.1);
  // Vision finds the cell nearer: the force rises, and nothing moves.
  b.centre.x() += 20e-6;
  b.puncture_at = 1;
  double most = 0;
  b.every_tick = [&] { most = std::max(most, b.force()); };
  b.run(2);
  EXPECT_GT(most, 0.6);
  EXPECT_NE(b.sample().alarms & alarm_sensor, 0U);
  EXPECT_EQ(b.force(), 0);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  // The handle moves again: the force returns by a ramp, and the needle stays where it is meanwhile.
  const Vec3 tip = b.stage.tip;
  double before = 0;
  double steepest = 0;
  b.every_tick = [&] {
    steepest = std::max(steepest, b.force() - before);
    before = b.force();
  };
  b.hand.x = b.hand.frozen_at;
  b.hand.v.setZero();
  b.hand.intention = b.hand.x + Vec3(0.1e-3, 0.1e-3, 0);
  b.hand.frozen = false;
  b.tip_start.x() = b.wanted_x - b.hand.x.x() / 500 - 0.2e-6;
  b.run(0.05);
  EXPECT_LT((b.stage.tip - tip).norm(), 0.3e-6);
  b.run(1);
  EXPECT_EQ(b.sample().alarms & alarm_sensor, 0U);
  EXPECT_GT(b.force(), 0.1);
  EXPECT_LT(steepest, 0.03);
}

TEST(Servo, lets_a_hand_rest_still_for_a_minute) {
  Bench b(icsi());
  b.to_indentation();
  b.run(1);
  b.hand.held = true;
  std::uint32_t alarms = 0;
  b.every_tick = [&] { alarms |= b.sample().alarms; };
  b.run(60);
  EXPECT_EQ(alarms & alarm_sensor, 0U);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  EXPECT_GT(b.force(), 0.05);
}

TEST(Servo, does_not_open_the_injector_again_after_a_stop_while_the_button_is_still_held) {
  Bench b(icsi());
  b.to_inside();
  b.hand.buttons = hal::kButtonInject;
  b.run(0.2);
  ASSERT_TRUE(b.injector.open);
  b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = false;
  b.run(1);
  b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = true;
  b.run(0.1);
  b.estop.state.reset_pressed = true;
  const int open_ticks = b.injector.open_ticks;
  b.run(1);
  ASSERT_EQ(b.servo->stop_stage(), StopStage::running);
  ASSERT_EQ(b.servo->phase(), injection);
  EXPECT_EQ(b.injector.open_ticks, open_ticks);
  b.hand.buttons = 0;
  b.run(0.1);
  b.hand.buttons = hal::kButtonInject;
  b.run(0.1);
  EXPECT_TRUE(b.injector.open);
}

TEST(Servo, shuts_the_gate_while_vision_is_silent_and_waits_for_a_new_press) {
  Bench b(icsi());
  b.to_inside();
  b.hand.buttons = hal::kButtonInject;
  b.run(0.3);
  ASSERT_TRUE(b.injector.open);
  b.seeing = false;
  b.run(0.5);
  EXPECT_FALSE(b.injector.open);
  EXPECT_EQ(b.servo->fault(), Fault::none);
  b.seeing = true;
  b.run(1);
  EXPECT_FALSE(b.injector.open);  // still held down
  b.hand.buttons = 0;
  b.run(0.05);
  b.hand.buttons = hal::kButtonInject;
  b.run(0.05);
  EXPECT_TRUE(b.injector.open);
}

TEST(Servo, says_when_the_gauge_stands_still) {
  for (const double still_s : {1.0, 0.0}) {
    ServoConfig config = icsi();
    config.vacuum->still_s = still_s;
    Bench b(config);
    b.run(1);
    b.vacuum.hangs = true;
    b.run(0.99);
    EXPECT_EQ(b.sample().alarms & alarm_sensor, 0U);
    b.run(0.05);
    EXPECT_EQ((b.sample().alarms & alarm_sensor) != 0, still_s > 0);
    b.vacuum.hangs = false;
    b.run(0.01);
    EXPECT_EQ(b.sample().alarms & alarm_sensor, 0U);
    EXPECT_EQ(b.servo->fault(), Fault::none);
  }
}

TEST(Servo, ends_by_command_only_when_the_needle_is_out_of_the_cell) {
  for (const bool here : {false, true}) {
    Bench b(icsi());
    b.to_inside();
    ASSERT_TRUE(b.station->commands.try_push({Command::end, 0}));
    b.run(0.5);
    EXPECT_EQ(b.servo->outcome(), Outcome::running);
    EXPECT_GT(b.force(), 0);
    // Not deeper, and nothing is injected; back it goes.
    b.hand.buttons = hal::kButtonInject;
    const double depth = -b.gap();
    b.move(b.wanted_x - 10e-6, 20e-6);
    b.run(0.3);
    EXPECT_LT(-b.gap(), depth + 0.3e-6);
    EXPECT_FALSE(b.injector.open);
    if (here) {
      b.servo->request_end_here();
    } else {
      b.move(60e-6, 40e-6);
    }
    b.run(0.5);
    EXPECT_EQ(b.servo->outcome(), Outcome::ended);
    EXPECT_EQ(b.force(), 0);
    EXPECT_EQ(-b.gap() > 0, here);
  }
}

TEST(Servo, moves_the_set_point_by_no_leap_after_a_late_tick) {
  const ServoConfig config = icsi();
  Bench b(config);
  b.run(0.5);
  Vec3 before = b.stage.commanded.back();
  double most = 0;
  b.every_tick = [&] {
    most = std::max(most, (b.stage.commanded.back() - before).norm());
    before = b.stage.commanded.back();
  };
  b.move(40e-6, 100e-6);
  b.hand.step(0.05);
  b.stage.step(0.05);
  b.now += 49'000'000;
  b.servo->tick({b.ticks += 49, b.now, b.now, 0.05, 49});
  b.every_tick();
  b.move(20e-6, 100e-6);
  EXPECT_LE(most, 2 * config.limits.stage_velocity_m_s * 1e-3 * (1 + 1e-9));
  EXPECT_EQ(b.servo->fault(), Fault::none);
}

TEST(Servo, stops_when_the_injector_stays_open_although_its_gate_is_shut) {
  Bench b(icsi());
  b.to_inside();
  b.hand.buttons = hal::kButtonInject;
  b.run(0.2);
  ASSERT_TRUE(b.injector.open);
  b.injector.jammed = true;
  b.run(0.2);
  b.hand.buttons = 0;
  b.run(0.2);
  EXPECT_EQ(b.servo->fault(), Fault::none);  // a valve takes its time
  b.run(0.1);
  EXPECT_EQ(b.servo->fault(), Fault::injector_open);
  // The relay takes the power that keeps it open.
  b.run(0.6);
  const int toggles = b.estop.toggles;
  b.run(0.1);
  EXPECT_EQ(b.estop.toggles, toggles);
  // No reset while it is open.
  b.estop.state.reset_pressed = true;
  b.run(0.1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::stopped);
  b.injector.jammed = false;
  b.estop.state.reset_pressed = false;
  b.run(0.1);
  b.estop.state.reset_pressed = true;
  b.run(0.1);
  EXPECT_EQ(b.servo->stop_stage(), StopStage::running);
}

TEST(Servo, a_commanded_stop_ends_a_run_that_has_stopped_already) {
  Bench b(icsi());
  b.run(0.5);
  b.hand.status = Status::disconnected;
  b.run(1);
  ASSERT_EQ(b.servo->stop_stage(), StopStage::stopped);
  EXPECT_FALSE(b.servo->finished());  // a reset could still clear it
  b.servo->request_stop();
  b.tick();
  EXPECT_EQ(b.servo->outcome(), Outcome::fault);
  EXPECT_EQ(b.servo->fault(), Fault::hand_lost);  // the first cause
}

TEST(Servo, is_not_fooled_about_the_tip_force_by_a_sensor_that_says_zero) {
  ServoConfig config = icsi();
  config.force_sensor = true;
  config.limits.tip_force_soft_N = 2e-6;
  Bench b(config);
  b.puncture_at = 1;
  b.to_indentation();
  b.move(-20e-6, 10e-6);
  b.run(0.5);
  EXPECT_NE(b.sample().alarms & alarm_tip_force, 0U);
  EXPECT_LT(b.sample().tip_force_N, 2.4e-6);
}

TEST(Servo, takes_the_drive_power_away_in_time_however_late_its_ticks_are) {
  Bench b(icsi());
  b.run(0.5);
  b.stage.speed = Vec3(1, 0, 0);
  b.estop.state.contact_a_closed = false;
  b.tick();
  ASSERT_TRUE(b.stage.on);
  b.stage.speed = Vec3(1, 0, 0);  // it does not come to rest
  b.now += 600'000'000;
  b.servo->tick({b.ticks++, b.now, b.now, 0.6, 0});
  EXPECT_FALSE(b.stage.on);
}

TEST(Servo, checks_the_range_of_commands) {
  Bench b(icsi());
  b.to_indentation();
  b.run(1);
  const double full = b.sample().membrane_N;
  for (const double bad : {-0.1, 1.1, 1e300, std::nan(""), -std::numeric_limits<double>::infinity()}) {
    ASSERT_TRUE(b.station->commands.try_push({Command::force_scale, bad}));
  }
  ASSERT_TRUE(b.station->commands.try_push({77, 0}));
  b.run(0.5);
  EXPECT_EQ(b.station->core.commands_refused.load(), 6U);
  EXPECT_NEAR(b.sample().membrane_N, full, 0.02 * full);
  ASSERT_TRUE(b.station->commands.try_push({Command::force_scale, 0.0}));
  b.run(1);
  EXPECT_EQ(b.sample().membrane_N, 0);
  ASSERT_TRUE(b.station->commands.try_push({Command::end, 0}));
  b.run(0.5);
  EXPECT_EQ(b.servo->outcome(), Outcome::running);  // the needle dents a cell
  b.move(60e-6, 40e-6);
  b.run(0.5);
  EXPECT_EQ(b.servo->outcome(), Outcome::ended);
  EXPECT_EQ(b.force(), 0);
}

TEST(Servo, takes_the_next_cell_with_a_fresh_model) {
  ServoConfig config = icsi();
  config.cells = 2;
  Bench b(config);
  const auto inject = [&] {
    b.to_inside();
    b.hand.buttons = hal::kButtonInject;
    b.run(0.3);
    b.hand.buttons = 0;
    b.move(60e-6, 40e-6);
    b.run(0.5);
    ASSERT_EQ(b.servo->phase(), clear);
  };
  inject();
  EXPECT_FALSE(b.servo->finished());
  EXPECT_EQ(b.servo->cells_done(), 1U);
  b.centre = Vec3(-44e-6, 3e-6, 0);
  b.R = 64e-6;
  b.hand.buttons = hal::kButtonNextCell;
  b.tick();
  b.tick();
  EXPECT_EQ(b.servo->phase(), free);
  EXPECT_EQ(b.sample().cell, 1U);
  EXPECT_EQ(b.sample().R_m, 0);
  b.hand.buttons = 0;
  b.run(0.5);
  EXPECT_NEAR(b.sample().R_m, 64e-6, 0.1e-6);
  inject();
  EXPECT_EQ(b.servo->outcome(), Outcome::done);
  EXPECT_EQ(b.sample().cell, 1U);
  EXPECT_EQ(b.order, (std::vector{free, contact, indentation, puncture, injection, withdrawal, clear, free,
                                  contact, indentation, puncture, injection, withdrawal, clear}));
}

TEST(Servo, in_a_scene_without_a_cell_only_damps) {
  ServoConfig config;
  config.phases.reset();
  config.local_model.reset();
  config.vision = false;
  config.damping.emplace();
  Bench b(config);
  b.run(0.5);
  b.every_tick = [&] {
    const TelemetrySample& s = b.sample();
    const Vec3 v(s.v_m_s[0], s.v_m_s[1], s.v_m_s[2]);
    ASSERT_LT((b.hand.force + 1.0 * v).norm(), 1e-12);
    ASSERT_EQ(s.phase, free);
    ASSERT_EQ(s.alarms, 0U);
    ASSERT_EQ(s.obs_age_s, -1);
  };
  b.move(-200e-6, 50e-6);
  b.move(60e-6, 50e-6);
  b.run(0.5);
  EXPECT_NEAR(b.stage.tip.x(), 60e-6, 0.2e-6);
  EXPECT_FALSE(b.servo->finished());
}

TEST(Servo, works_without_stage_and_without_estop_chain) {
  ServoConfig config;
  config.phases.reset();
  config.local_model.reset();
  config.vision = false;
  config.damping.emplace();
  FakeHand hand;
  auto station = std::make_unique<Station>();
  auto servo = std::make_unique<Servo>(config, Devices{hand}, *station);
  std::int64_t now = 0;
  for (std::uint64_t k = 0; k < 1000; ++k) {
    now += 1'000'000;
    hand.intention.x() = 0.01 * std::sin(0.01 * static_cast<double>(k));
    hand.step(1e-3);
    servo->tick({k, now, now, 1e-3, 0});
  }
  EXPECT_GT(hand.force.norm(), 0);
  servo->request_stop();
  for (std::uint64_t k = 1000; k < 1600; ++k) {
    now += 1'000'000;
    servo->tick({k, now, now, 1e-3, 0});
  }
  EXPECT_EQ(servo->outcome(), Outcome::fault);
  EXPECT_EQ(hand.force.norm(), 0);
}

TEST(Servo, never_sends_anything_beyond_a_limit_whatever_the_devices_say) {
  // Everything fails at random, all the time; resets are pressed at random too.
  for (unsigned seed = 0; seed < 8; ++seed) {
    ServoConfig config = icsi();
    config.force_sensor = true;
    Bench b(config);
    std::mt19937_64 random(seed);
    const auto one_in = [&](int n) { return std::uniform_int_distribution<int>(1, n)(random) == 1; };
    const auto any = [&] { return static_cast<Status>(std::uniform_int_distribution<int>(0, 3)(random)); };
    Vec3 force = Vec3::Zero();
    std::size_t commanded = 0;
    std::uint64_t stops = 0, clears = 0;
    bool running = true;
    b.every_tick = [&] {
      b.hand.status = one_in(400) ? any() : Status::ok;
      b.hand.nan = one_in(900);
      b.hand.jump_m = one_in(900) ? 1e3 : 0;
      b.stage.status = one_in(900) ? any() : Status::ok;
      b.stage.nan = one_in(2000);
      b.estop.status = one_in(900) ? any() : Status::ok;
      if (one_in(800)) b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = one_in(2);
      if (one_in(100)) b.estop.state.contact_a_closed = b.estop.state.contact_b_closed = true;
      if (one_in(100)) b.estop.state.reset_pressed = one_in(2);
      if (one_in(50))
        b.hand.buttons = static_cast<std::uint32_t>(std::uniform_int_distribution<int>(0, 7)(random));
      if (one_in(100)) b.wanted_x = std::uniform_real_distribution<double>(-100e-6, 100e-6)(random);
      if (one_in(500)) b.seeing = one_in(2);
      b.sensor.force = one_in(500) ? std::nan("") : (one_in(2000) ? 1.0 : 5e-6);
      b.missed = one_in(1000) ? 1000 : 0;
      for (; commanded < b.stage.commanded.size(); ++commanded) {
        const Vec3& p = b.stage.commanded[commanded];
        ASSERT_TRUE(p.allFinite());
        for (int i = 0; i < 3; ++i) {
          ASSERT_GE(p[i], config.mapping.workspace_min_m[i] - 1e-9);
          ASSERT_LE(p[i], config.mapping.workspace_max_m[i] + 1e-9);
        }
      }
      const bool now_running = b.servo->stop_stage() == StopStage::running;
      if (running && !now_running) ++stops;
      if (!running && now_running) ++clears;
      if (!now_running) {
        ASSERT_FALSE(b.injector.open);
        // No command reaches the stage, and the force only falls.
        ASSERT_LE(b.hand.force.norm(), force.norm() + 1e-12);
      }
      running = now_running;
      force = b.hand.force;
    };
    b.run(20);
    EXPECT_GT(stops, 3U);
    EXPECT_GT(clears, 3U);
  }
}

}  // namespace
}  // namespace punctum::rt
