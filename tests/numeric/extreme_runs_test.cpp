// Extreme runs: the whole station in virtual time - simulated world, executive, servo, an observer that reads
// the truth - driven to where it should not go. Each row of the table names beforehand how the run ends;
// whatever happens, what is promised on every tick is checked on every tick.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <deque>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hal/sim/bench.hpp"
#include "hal/sim/noise.hpp"
#include "hal/sim/truth.hpp"
#include "hal/sim/world.hpp"
#include "rt/control/servo.hpp"
#include "rt/executive/executive.hpp"
#include "rt/station/station.hpp"
#include "tests/support/unwatched.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/truth_observer.hpp"

namespace punctum {
namespace {

using hal::Vec3;
using rt::Fault;
using rt::Phase;
using sim::Device;
using sim::Failure;
using Strings = std::vector<std::string>;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// ---- what is done to the station ----

enum class What {
  fail,         // device, kind, for so long
  press_estop,  // for so long, then reset 0.2 s later
  late,         // the next tick is late by value
  clock_back,   // the clock reads value less on one wake-up
  period,       // one tick is told this period
  start,        // one tick is told it began this much later
  throw_hand,   // value: metres along x (device frame), there at 5 m/s, held for so long, and back
  end,          // command `end`
};

struct Event {
  Phase phase{};  // begins so long after this phase was first entered
  double after_s = 0;
  What what{};
  Device device = Device::hand;
  Failure kind = Failure::none;
  double value = 0;
  double for_s = 1e9;
};

Event fails(Device device, Failure kind, Phase phase, double after_s, double for_s = 1e9) {
  return {phase, after_s, What::fail, device, kind, 0, for_s};
}
Event vision_gone(Phase phase, double after_s, double for_s = 1) {
  return fails(Device::camera, Failure::drop, phase, after_s, for_s);
}
Event late(double by_s, Phase phase, double after_s) {
  return {.phase = phase, .after_s = after_s, .what = What::late, .value = by_s};
}

// ---- how it is to end ----

enum class End {
  refused,       // the scene is refused at load; the message says this
  done,          // injected and clear
  not_injected,  // clear, or ended by command, and nothing was injected
  stopped,       // latched, at rest, by this fault
  time_limit,    // nobody finished; running, no fault
};
const char* name(End e) {
  constexpr const char* names[] = {"refused", "done", "not injected", "stopped", "time limit"};
  return names[static_cast<int>(e)];
}

struct Row {
  std::string name;
  Strings scene = {};  // changes to icsi
  std::vector<Event> events = {};
  End end = End::done;
  Fault fault = Fault::none;
  std::uint32_t alarms = 0;  // that must be seen
  bool lost = false;         // the cell
  std::string message = {};  // of a refusal
  double rate_Hz = 1000;
  double step_N = 0.25;  // largest change of the hand's force from tick to tick
  double shake_mm = 0;   // most that the hand may leave a straight course by within 20 ms; 0 = not asked
  bool real_actuators = false;
};

// ---- the station ----

// Absolute time without waiting; a wake-up may be late, and the clock may be wrong once.
class TestClock final : public hal::Clock {
 public:
  std::int64_t now = 0;
  std::int64_t late_ns = 0;   // of the next wake-up
  std::int64_t wrong_ns = 0;  // at the next reading after a wake-up
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now - std::exchange(wrong_now_, 0); }
  void sleep_until_ns(std::int64_t t_ns) noexcept override {
    now = std::max(now, t_ns) + std::exchange(late_ns, 0);
    wrong_now_ = std::exchange(wrong_ns, 0);
  }

 private:
  mutable std::int64_t wrong_now_ = 0;
};

class PressedEstop final : public hal::EstopChain {
 public:
  explicit PressedEstop(sim::SimEstop& chain) : chain_(chain) {}
  bool pressed = false, reset = false;
  [[nodiscard]] hal::Status read(hal::EstopState& out) noexcept override {
    const hal::Status status = chain_.read(out);
    if (pressed) {
      out.contact_a_closed = out.contact_b_closed = false;
    }
    out.reset_pressed = out.reset_pressed || reset;
    return status;
  }
  void heartbeat(bool level) noexcept override { chain_.heartbeat(level); }

 private:
  sim::SimEstop& chain_;
};

class ThrownHand final : public hal::HapticDevice {
 public:
  explicit ThrownHand(sim::SimHand& hand) : hand_(hand) {}
  double offset_m = 0;
  [[nodiscard]] hal::Status read(hal::HandState& out) noexcept override {
    const hal::Status status = hand_.read(out);
    out.position_m.x() += offset_m;
    return status;
  }
  [[nodiscard]] hal::Status write_force(const Vec3& force_N) noexcept override {
    return hand_.write_force(force_N);
  }

 private:
  sim::SimHand& hand_;
};

// A brisk operator, so that a run takes seconds.
const Strings kBrisk{"sim.operator.approach_s=0.6",
                     "sim.operator.indentation_speed_um_s=25",
                     "sim.operator.withdrawal_speed_um_s=40",
                     "sim.operator.dwell_s=0.6",
                     "sim.operator.reaction_s=0.15",
                     "scene.seconds=20",
                     "scene.seed=1"};

// The tables of a cell take a moment to solve: one world for all rows of the same scene.
struct Plant {
  std::unique_ptr<sim::World> world;
  sim::Snapshot begin;
};

sim::Bench& bench() {
  static const auto one = std::make_unique<sim::Bench>();
  return *one;
}

Plant& plant(const sim::SimConfig& config, const std::string& key) {
  (void)bench();  // first: the worlds write to it to the end
  static std::map<std::string, Plant> plants;
  Plant& p = plants[key];
  if (!p.world) {
    p.world = std::make_unique<sim::World>(config, &bench(), 0);
    p.begin = p.world->snapshot();
  }
  p.world->restore(p.begin);
  return p;
}

// What was seen of a run.
struct Seen {
  End end = End::time_limit;
  Fault fault = Fault::none;  // the first
  std::uint32_t alarms = 0;
  bool lost = false;
  double seconds = 0;
  double peak_N = 0, step_N = 0, deepest_m = -1, speed_m_s = 0, shake_m = 0;
  std::uint64_t ticks = 0, missed = 0;
};

class Station {
 public:
  Station(const Row& row, const tools::Scene& scene, sim::World& world)
      : row_(row),
        scene_(scene),
        world_(world),
        station_(std::make_unique<rt::LocalStation>()),
        estop_(world.estop()),
        hand_(world.hand()),
        servo_(scene.servo,
               rt::Devices{hand_, &world.stage(), &estop_, world.injector(), world.vacuum(),
                           world.force_sensor()},
               station_->station),
        noise_(1, sim::Noise::Stream::free_use, 7) {
    first_.fill(-1);
  }

  Seen run() {
    for (auto& word : bench().failures.word) {
      word.store(0);
    }
    exposed_ = bench().exposed.load();
    const rt::Slot slots[] = {rt::slot<&Station::step_plant>("plant", *this),
                              rt::slot<&Station::tick_servo>("servo", *this)};
    rt::ExecutiveConfig config;
    config.period_ns = std::llround(1e9 / scene_.servo.rate_Hz);
    config.start_ns = config.period_ns;
    config.overrun_window_ticks = static_cast<std::uint32_t>(scene_.servo.rate_Hz);
    rt::Executive executive(clock_, clock_, config, slots, station_->core.status);
    const std::atomic<bool> never{false};
    EXPECT_EQ(executive.run(never), rt::Executive::Ended::by_slot);
    finish();
    return seen_;
  }

 private:
  rt::After step_plant(const rt::Tick& tick) noexcept {
    world_.step(tick.wake_ns);
    return rt::After::go_on;
  }

  rt::After tick_servo(const rt::Tick& tick) noexcept {
    t_s_ = 1e-9 * static_cast<double>(clock_.now);
    look();
    rt::TickInfo now = tick.info();
    act(now);
    servo_.tick(now);
    ++seen_.ticks;
    seen_.missed = tick.missed;
    check();
    return over() ? rt::After::end : rt::After::go_on;
  }

  // The observer: what the camera exposes is told latency_s later, unless the camera fails.
  void look() {
    const tests::Unwatched unwatched;
    if (bench().exposed.load() != exposed_) {
      exposed_ = bench().exposed.load();
      sim::Exposure e;
      std::uint64_t index = 0;
      if (bench().exposures.newest(e, index) == hal::Read::ok) {
        expose(e);
      }
    }
    while (!under_way_.empty() && under_way_.front().first <= clock_.now) {
      station_->observation.slot.push(under_way_.front().second);
      under_way_.pop_front();
    }
  }
  void expose(const sim::Exposure& e) {
    const Failure failure = e.world.failure[static_cast<std::size_t>(Device::camera)].kind;
    const sim::Truth truth = sim::truth_of(*scene_.sim, e.world);
    rt::Observation o = tools::observe_truth(truth, e.frame, e.exposure_ns, before_);
    before_ = truth;
    double after_s = scene_.sim->microscope->latency_s;
    switch (failure) {
      case Failure::drop:
      case Failure::disconnect:
      case Failure::nan:
      case Failure::saturate:
        return;
      case Failure::freeze: {
        const auto t = o.exposure_ns;
        o = last_;
        o.frame = e.frame;
        o.exposure_ns = t;
        break;
      }
      case Failure::delay:
        after_s += 0.25;
        break;
      case Failure::noise: {
        const auto shake = [&](double& x, double rms_m) { x += rms_m * noise_.gaussian(shaken_++); };
        for (int i = 0; i < 2; ++i) {
          shake(o.tip_m[i], 0.5e-6);
          shake(o.centre_m[i], 2e-6);
        }
        shake(o.R_m, 2e-6);
        shake(o.gap_m, 2e-6);
        shake(o.wd_m, 2e-6);
        shake(o.a_m, 2e-6);
        break;
      }
      default:
        break;
    }
    last_ = o;
    under_way_.emplace_back(e.exposure_ns + sim::to_ns(after_s), o);
  }

  void act(rt::TickInfo& now) {
    auto& since = first_[static_cast<std::size_t>(servo_.phase())];
    if (since < 0) {
      since = t_s_;
    }
    estop_.pressed = estop_.reset = false;
    hand_.offset_m = 0;
    for (std::size_t i = 0; i < row_.events.size(); ++i) {
      const Event& e = row_.events[i];
      const double entered = first_[static_cast<std::size_t>(e.phase)];
      if (entered < 0 || t_s_ < entered + e.after_s) {
        continue;
      }
      const double t = t_s_ - entered - e.after_s;  // since it began
      const bool begins = !begun_[i];
      begun_[i] = true;
      switch (e.what) {
        case What::fail:
          if (begins) {
            bench().failures.set(e.device, e.kind);
          }
          if (t >= e.for_s && !ended_[i]) {
            bench().failures.set(e.device, Failure::none), ended_[i] = true;
          }
          break;
        case What::press_estop:
          estop_.pressed = estop_.pressed || t < e.for_s;
          estop_.reset = estop_.reset || (t >= e.for_s + 0.2 && t < e.for_s + 0.3);
          break;
        case What::late:
          if (begins) {
            clock_.late_ns = sim::to_ns(e.value);
          }
          break;
        case What::clock_back:
          if (begins) {
            clock_.wrong_ns = sim::to_ns(e.value);
          }
          break;
        case What::period:
          if (begins) {
            now.period_s = e.value;
          }
          break;
        case What::start:
          if (begins) {
            now.start_ns += sim::to_ns(e.value);
          }
          break;
        case What::throw_hand:
          hand_.offset_m += e.value * (thrown(t, std::abs(e.value)) - thrown(t - e.for_s, std::abs(e.value)));
          break;
        case What::end:
          if (begins) {
            rt::Command end;
            end.kind = rt::Command::end;
            (void)station_->parent.queue.try_push(end);
          }
          break;
      }
    }
  }
  // 0 .. 1: along `way` at up to 5 m/s, speeding up and braking at 250 m/s^2.
  static double thrown(double t, double way) {
    constexpr double push = 250;
    const double speed = std::min(5.0, std::sqrt(push * way));
    const double ramp = speed / push;
    const double whole = ramp + way / speed;
    const double x = std::clamp(t, 0.0, whole);
    const double out = x < ramp           ? 0.5 * push * x * x
                       : x > whole - ramp ? way - 0.5 * push * (whole - x) * (whole - x)
                                          : speed * (x - 0.5 * ramp);
    return out / way;
  }

  // ---- what holds on every tick ----

  void broken(const char* what) {
    if (++broken_ <= 3) {
      ADD_FAILURE() << row_.name << ": " << what << " at " << t_s_ << " s";
    }
  }

  void finite(double x) {
    if (!std::isfinite(x)) {
      broken("not finite");
    }
  }

  void check() {
    const tests::Unwatched unwatched;
    const rt::TelemetrySample& s = servo_.sample();
    const sim::Snapshot& world = world_.snapshot();
    const sim::Truth truth = sim::truth_of(*scene_.sim, world);
    const auto& limits = scene_.servo.limits;
    const Vec3 force(s.force_N[0], s.force_N[1], s.force_N[2]);
    const Vec3 command(s.cmd_m[0], s.cmd_m[1], s.cmd_m[2]);
    const Vec3 axis(s.axis[0], s.axis[1], s.axis[2]);
    const double nominal_s = 1 / scene_.servo.rate_Hz;
    const bool running = s.stop == rt::StopStage::running;
    const bool stale = (s.alarms & rt::alarm_vision_stale) != 0;

    // One sample for every tick that ran, all of it finite.
    if (station_->core.telemetry.head() != seen_.ticks) {
      broken("a tick without telemetry");
    }
    for (const std::span<const double> part : {std::span<const double>(s.x_m),
                                               {s.v_m_s},
                                               {s.tip_m},
                                               {s.cmd_m},
                                               {s.force_N},
                                               {s.entry_m},
                                               {s.axis}}) {
      for (const double x : part) {
        finite(x);
      }
    }
    for (const double x : s.effect_N) {
      finite(x);
    }
    for (const double x : {s.guard_N,
                           s.wd_m,
                           s.a_m,
                           s.R_m,
                           s.tip_force_N,
                           s.sigma_d_Pa,
                           s.pressure_Pa,
                           s.obs_age_s,
                           s.obs_gap_m,
                           s.sensor_N,
                           s.vacuum_Pa,
                           s.stored_energy_J,
                           s.injected_energy_J,
                           world.hand.work_J,
                           s.wd_sd_m,
                           s.R_sd_m,
                           s.tip_force_sd_N,
                           s.obs_a_m,
                           s.obs_a_sd_m,
                           s.E_fit_Pa,
                           s.E_fit_sd_Pa}) {
      finite(x);
    }

    // The hand.
    if (force.norm() > limits.hand_force_N * (1 + 1e-9)) {
      broken("hand force above its limit");
    }
    const double step_N = (force - force_before_).norm();
    if (step_N > row_.step_N) {
      broken("a step of the hand's force");
    }
    seen_.step_N = std::max(seen_.step_N, step_N);
    seen_.peak_N = std::max(seen_.peak_N, force.norm());

    // The needle.
    if (running && was_running_ && world.stage.powered != 0 && was_powered_) {
      const Vec3 way = command - command_before_;
      seen_.speed_m_s = std::max(seen_.speed_m_s, way.norm() / nominal_s);
      if (way.norm() > limits.stage_velocity_m_s * 2 * nominal_s * (1 + 1e-6)) {
        broken("set-point too fast");
      }
      if (stale && was_stale_ && (way.dot(axis) > 1e-12 || (way - way.dot(axis) * axis).norm() > 1e-12)) {
        broken("a set-point other than outwards while vision is stale");
      }
    }
    if (truth.cell && truth.held) {
      seen_.deepest_m = std::max(seen_.deepest_m, -truth.gap_m);
      if (-truth.gap_m > limits.penetration_depth_m + kTruth_m) {
        broken("deeper than the limit");
      }
      if (world.cell.far_wall_pierced) {
        broken("through the far wall");
      }
    }

    // The injector's gate.
    if (world_.injector() != nullptr && world_.injector()->state().gate != 0) {
      if (!running) {
        broken("the gate is open after a stop");
      }
      if (s.phase != Phase::injection) {
        broken("the gate is open out of phase");
      }
      if (stale) {
        broken("the gate is open while vision is stale");
      }
    }

    // After a stop nothing moves by itself.
    if (running) {
      stopped_at_s_ = t_s_;
    }
    if (t_s_ - stopped_at_s_ > kStopped_s) {
      if (force.norm() != 0) {
        broken("a force on the hand after a stop");
      }
      if (!resting_) {
        resting_ = world.stage.tip_m.vec();
      }
      if ((world.stage.tip_m.vec() - *resting_).norm() > 0.1e-6) {
        broken("motion after a stop");
      }
    } else {
      resting_.reset();
    }

    // The membrane's force only falls once it is through; its energy is not given back.
    const bool through = s.phase == Phase::puncture || s.phase == Phase::injection ||
                         s.phase == Phase::withdrawal || s.phase == Phase::clear;
    if (through && was_through_ && s.effect_N[rt::effect_membrane] > membrane_before_N_ + 1e-12) {
      broken("the membrane's force rises after the puncture");
    }

    seen_.alarms |= s.alarms;
    seen_.fault = seen_.fault == Fault::none ? s.fault : seen_.fault;
    // Second difference over 10 ms while it touches and feels the cell: four times the amplitude of a fast
    // swing.
    const auto lag = static_cast<std::size_t>(0.01 * scene_.servo.rate_Hz);
    if (s.phase == Phase::free || (s.buttons & hal::kButtonClutch) != 0) {
      hand_past_.clear();
    }
    hand_past_.emplace_back(s.x_m[0], s.x_m[1], s.x_m[2]);
    if (hand_past_.size() > 2 * lag + 1) {
      hand_past_.pop_front();
    }
    if (hand_past_.size() == 2 * lag + 1) {
      const Vec3 off = hand_past_[0] - 2 * hand_past_[lag] + hand_past_[2 * lag];
      seen_.shake_m = std::max(seen_.shake_m, off.norm());
    }
    seen_.lost = seen_.lost || truth.lost;
    was_running_ = running;
    was_stale_ = stale;
    was_through_ = through;
    was_powered_ = world.stage.powered != 0;
    membrane_before_N_ = s.effect_N[rt::effect_membrane];
    force_before_ = force;
    command_before_ = command;
  }

  bool over() {
    if (servo_.outcome() == rt::RunEnd::done) {
      return seen_.end = End::done, true;
    }
    if (servo_.outcome() == rt::RunEnd::stopped) {
      return seen_.end = End::not_injected, true;
    }
    const bool rests = servo_.stop_stage() == rt::StopStage::stopped;
    rests_s_ = rests ? rests_s_ + 1 / scene_.servo.rate_Hz : 0;
    if (rests_s_ > 2.5) {
      return seen_.end = End::stopped, true;  // longer than the operator takes to reset what can be reset
    }
    return t_s_ >= scene_.seconds;
  }

  void finish() {
    seen_.seconds = t_s_;
    if (seen_.end != End::stopped && !world_.estop().power()) {
      broken("the relay is open at the end");
    }
  }

  static constexpr double kTruth_m = 3e-6;   // the core knows the membrane's place to this
  static constexpr double kStopped_s = 0.1;  // braking and the hand's ramp are over

  const Row& row_;
  const tools::Scene& scene_;
  sim::World& world_;
  std::unique_ptr<rt::LocalStation> station_;
  PressedEstop estop_;
  ThrownHand hand_;
  rt::Servo servo_;
  TestClock clock_;
  sim::Noise noise_;
  std::uint64_t shaken_ = 0;
  Seen seen_;
  double t_s_ = 0;
  int broken_ = 0;
  std::array<double, rt::kPhases> first_{};
  std::array<bool, 8> begun_{}, ended_{};
  std::uint64_t exposed_ = 0;
  std::optional<sim::Truth> before_;
  rt::Observation last_;
  std::deque<std::pair<std::int64_t, rt::Observation>> under_way_;
  std::deque<Vec3> hand_past_;

  Vec3 force_before_ = Vec3::Zero(), command_before_ = Vec3::Zero();
  std::optional<Vec3> resting_;
  double membrane_before_N_ = 0, stopped_at_s_ = 0, rests_s_ = 0;
  bool was_running_ = false, was_stale_ = false, was_through_ = false, was_powered_ = false;
};

std::string words(std::uint32_t alarms) {
  std::string s;
  for (std::size_t i = 0; i < std::size(rt::kAlarmNames); ++i) {
    if ((alarms >> i & 1U) != 0) {
      s += std::string(s.empty() ? "" : " ") + rt::kAlarmNames[i];
    }
  }
  return s.empty() ? "-" : s;
}

void PrintTo(const Row& row, std::ostream* out) { *out << row.name; }

class Extreme : public testing::TestWithParam<Row> {};

TEST_P(Extreme, ends_in_the_state_that_is_named_beforehand) {
  const Row& row = GetParam();
  Strings changes = kBrisk;
  changes.push_back("servo.rate_hz=" + std::to_string(static_cast<int>(row.rate_Hz)));
  changes.insert(changes.end(), row.scene.begin(), row.scene.end());
  auto scene = tools::load_scene("icsi", changes);
  if (row.end == End::refused) {
    ASSERT_FALSE(scene) << row.name << ": accepted";
    EXPECT_NE(scene.error().find(row.message), std::string::npos) << scene.error();
    EXPECT_NE(scene.error().find("allowed"), std::string::npos) << scene.error();
    EXPECT_EQ(scene.error().find('\n'), std::string::npos);
    std::printf("%-44s | refused      | %s\n", row.name.c_str(), scene.error().c_str());
    return;
  }
  ASSERT_TRUE(scene) << row.name << ": " << scene.error();
  scene->servo.real_actuators = row.real_actuators;

  std::string key;
  for (const std::string& change : row.scene) {
    key += change + " ";
  }
  Plant& p = plant(*scene->sim, key);
  const auto station = std::make_unique<Station>(row, *scene, *p.world);
  const Seen seen = station->run();
  std::printf(
      "%-44s | %-12s | %-12s %-12s %s%s| %.2f N, step %.3f N, %.1f um deep, %.2f mm/s, shake %.3f mm, %.1f "
      "s\n",
      row.name.c_str(), name(row.end), name(seen.end), rt::name(seen.fault), words(seen.alarms).c_str(),
      seen.lost ? " LOST " : " ", seen.peak_N, seen.step_N, 1e6 * seen.deepest_m, 1e3 * seen.speed_m_s,
      1e3 * seen.shake_m, seen.seconds);
  EXPECT_STREQ(name(seen.end), name(row.end));
  EXPECT_STREQ(rt::name(seen.fault), rt::name(row.fault));
  EXPECT_EQ(seen.alarms & row.alarms, row.alarms) << words(seen.alarms);
  EXPECT_EQ(seen.lost, row.lost);
  if (row.shake_mm > 0) {
    EXPECT_LT(1e3 * seen.shake_m, row.shake_mm);
  }
}

std::string kHz(double rate_Hz) { return std::to_string(static_cast<int>(rate_Hz / 1000)) + " kHz"; }

std::vector<Row> rows() {
  using enum Phase;
  using enum End;
  using D = Device;
  using F = Failure;
  std::vector<Row> all;
  // Nothing happens: what the others are to be held against.
  for (const double rate : {1000.0, 4000.0, 8000.0}) {
    all.push_back({.name = "nothing " + kHz(rate), .rate_Hz = rate});
  }

  // Suction off. The pump fails: the watch stops the station, wherever the needle is; between two cells
  // nothing is held and nothing stops. A needle on its way out takes the cell along before the watch has made
  // up its mind. A gauge that is gone, or repeats its newest sample, counts like a lost pressure; noise is no
  // loss.
  for (const Phase phase : {free, contact, indentation, puncture, injection, withdrawal}) {
    all.push_back({.name = std::string("suction off in ") + rt::name(phase),
                   .events = {fails(D::vacuum, F::saturate, phase, 0.1)},
                   .end = stopped,
                   .fault = Fault::vacuum_lost,
                   .lost = phase == withdrawal});
  }
  all.push_back({.name = "suction off between two cells",
                 .scene = {"scene.cells=2"},
                 .events = {fails(D::vacuum, F::saturate, clear, 0.05, 0.4)}});
  for (const F kind : {F::freeze, F::drop, F::nan, F::disconnect}) {
    all.push_back({.name = "gauge gone, kind " + std::to_string(static_cast<int>(kind)),
                   .events = {fails(D::vacuum, kind, indentation, 0.1)},
                   .end = stopped,
                   .fault = Fault::vacuum_lost,
                   .alarms = rt::alarm_sensor});
  }
  all.push_back({.name = "gauge disturbed", .events = {fails(D::vacuum, F::noise, free, 0)}});

  // The cell comes off: hardly any suction, nobody watches it. It goes where the needle goes, so the needle
  // never gets clear of it; that takes longer than it should, and the station says so.
  all.push_back({.name = "cell torn away",
                 .scene = {"vacuum=off", "sim.holder.vacuum_Pa=1", "phases.timeout_withdrawal_s=3"},
                 .end = time_limit,
                 .alarms = rt::alarm_phase_timeout,
                 .lost = true});
  // Ripped by sideways motion: the core cannot know, the world does, the task goes on.
  all.push_back(
      {.name = "cell ripped by sideways motion", .scene = {"sim.cell.tear_lateral_um=0.5"}, .lost = true});

  // The needle at 10 mm/s. Faster than the stage, or than its lag lets it be followed: refused. Else the hand
  // is thrown at 5 m/s into the cell, rests there, and comes back: limits hold, the cell is entered and left,
  // torn off by the drag, and nothing is injected. With the usual limit the same throw is only a lag.
  all.push_back({.name = "10 mm per s above the stage",
                 .scene = {"limits.stage_velocity_um_s=10000"},
                 .end = refused,
                 .message = "limits.stage_velocity_um_s"});
  all.push_back({.name = "10 mm per s above what can be followed",
                 .scene = {"limits.stage_velocity_um_s=10000", "sim.stage.velocity_max_um_s=10000"},
                 .end = refused,
                 .message = "limits.following_error_um"});
  const Strings fast{"limits.stage_velocity_um_s=10000",      "sim.stage.velocity_max_um_s=10000",
                     "limits.stage_acceleration_mm_s2=5000",  "limits.stage_jerk_m_s3=1000",
                     "limits.stage_velocity_near_um_s=10000", "limits.stage_velocity_inside_um_s=10000",
                     "limits.following_error_um=60",          "mapping.tremor_cutoff_hz=0"};
  constexpr double kThrown_N = (4 + 5) * 0.25;  // damping inside and in withdrawal, 250 m/s^2 for a tick
  const Event throw_in{.phase = free, .after_s = 0.1, .what = What::throw_hand, .value = -0.1, .for_s = 0.25};
  all.push_back({.name = "10 mm per s thrown into the cell",
                 .scene = fast,
                 .events = {throw_in},
                 .end = not_injected,
                 .alarms = rt::alarm_depth_limited,
                 .lost = true,
                 .step_N = kThrown_N});
  all.push_back(
      {.name = "10 mm per s thrown away from the cell",
       .scene = fast,
       .events = {{.phase = free, .after_s = 0.1, .what = What::throw_hand, .value = 0.1, .for_s = 0.25}},
       .alarms = rt::alarm_travel_limited,
       .step_N = kThrown_N});
  all.push_back(
      {.name = "thrown at the usual limit",
       .events = {{.phase = free, .after_s = 0.1, .what = What::throw_hand, .value = 0.03, .for_s = 0.15}},
       .alarms = rt::alarm_travel_limited,
       .step_N = kThrown_N});
  all.push_back(
      {.name = "thrown inside the cell",
       .scene = fast,
       .events =
           {{.phase = injection, .after_s = 0.1, .what = What::throw_hand, .value = -0.1, .for_s = 0.3}},
       .alarms = rt::alarm_depth_limited,
       .lost = true,
       .step_N = kThrown_N});

  // 1 GPa is refused. At the most that is accepted, 0.1 GPa, a stiff zona that the core takes for a soft one
  // is only pierced; with a force sensor it is a hard tip force. A law too stiff to be rendered is refused;
  // one that can be, 1 MPa, lets the needle no further than its soft limit: the operator gives up.
  all.push_back({.name = "zona of 1 GPa",
                 .scene = {"sim.cell.zona_E_kPa=1e6"},
                 .end = refused,
                 .message = "sim.cell.zona_E_kPa"});
  all.push_back(
      {.name = "law of 1 GPa", .scene = {"membrane.E_kPa=1e6"}, .end = refused, .message = "membrane.E_kPa"});
  all.push_back({.name = "zona of 100 MPa", .scene = {"sim.cell.zona_E_kPa=1e5"}});
  all.push_back({.name = "zona of 100 MPa, force sensor",
                 .scene = {"sim.cell.zona_E_kPa=1e5", "force_sensor=on"},
                 .end = stopped,
                 .fault = Fault::tip_force});
  for (const char* which : {"paper", "large_deflection"}) {
    const std::string law = std::string("membrane.law=") + which;
    all.push_back({.name = std::string("law of 100 MPa, ") + which,
                   .scene = {"membrane.E_kPa=1e5", law},
                   .end = refused,
                   .message = "membrane.E_kPa"});
    for (const double rate : {1000.0, 4000.0, 8000.0}) {
      all.push_back(
          {.name = std::string("law of 1 MPa, ") + which + " " + kHz(rate),
           .scene = {"membrane.E_kPa=1e3", law, "sim.operator.tremor_mm=0", "sim.operator.drift_um_s=0"},
           .end = time_limit,
           .alarms = rt::alarm_tip_force,
           .rate_Hz = rate,
           .shake_mm = 0.2});
    }
  }
  all.push_back({.name = "clicks of the stage",
                 .scene = {"membrane.E_kPa=1e3", "mapping.force_scale=2e4", "sim.stage.resolution_um=4"},
                 .end = refused,
                 .message = "membrane.E_kPa: one step of the stage"});

  // A pipette as wide as the dimple. Wider than a quarter of the cell: refused, in the plant and in the law.
  // As wide as that it dents and does not pierce: the operator gives up, the cell is whole; a weak zona gives
  // way, and the injection is one like any other. A law whose dimple is not much wider than the pipette is so
  // stiff that the needle cannot get in.
  all.push_back({.name = "needle too wide",
                 .scene = {"sim.needle.radius_um=15.1", "sim.needle.shaft_radius_um=16"},
                 .end = refused,
                 .message = "sim.needle.radius_um"});
  all.push_back(
      {.name = "law too wide", .scene = {"membrane.c_um=15.1"}, .end = refused, .message = "membrane.c_um"});
  const Strings wide{"sim.needle.radius_um=15", "sim.needle.shaft_radius_um=16", "membrane.c_um=15"};
  all.push_back({.name = "needle as wide as allowed", .scene = wide, .end = time_limit});
  Strings wide_and_weak = wide;
  wide_and_weak.insert(wide_and_weak.end(),
                       {"sim.cell.zona_puncture_strain=0.25", "sim.cell.inner.puncture_strain=0.12"});
  all.push_back({.name = "needle as wide as allowed, weak zona", .scene = wide_and_weak});
  all.push_back({.name = "dimple as narrow as the pipette",
                 .scene = {"membrane.law=paper", "local_model.dimple_scale=0.15"},
                 .end = time_limit});

  // 10 kHz noise, broadband at every rate: nothing stops but for an e-stop chain that flickers.
  for (const double rate : {1000.0, 4000.0, 8000.0}) {
    all.push_back({.name = "noise on the hand " + kHz(rate),
                   .events = {fails(D::hand, F::noise, free, 0)},
                   .rate_Hz = rate,
                   .step_N = 2});
  }
  all.push_back({.name = "noise on the stage's encoders", .events = {fails(D::stage, F::noise, free, 0)}});
  all.push_back({.name = "noise on the force sensor",
                 .scene = {"force_sensor=on"},
                 .events = {fails(D::force_sensor, F::noise, free, 0)}});
  all.push_back(
      {.name = "noise on the injector's contact", .events = {fails(D::injector, F::noise, free, 0)}});
  all.push_back({.name = "noise on vision", .events = {fails(D::camera, F::noise, free, 0)}});
  all.push_back({.name = "noise on the e-stop chain",
                 .events = {fails(D::estop, F::noise, indentation, 0.1)},
                 .end = stopped,
                 .fault = Fault::estop});
  all.push_back({.name = "noise everywhere else",
                 .scene = {"force_sensor=on"},
                 .events = {fails(D::hand, F::noise, free, 0), fails(D::stage, F::noise, free, 0),
                            fails(D::vacuum, F::noise, free, 0), fails(D::force_sensor, F::noise, free, 0),
                            fails(D::injector, F::noise, free, 0), fails(D::camera, F::noise, free, 0)},
                 .step_N = 2});

  // Vision gone for a second: only outwards meanwhile, no force, a shut gate; then the task goes on and is
  // done. Gone for good: the operator draws back, nothing more.
  for (const Phase phase : {free, contact, indentation, puncture, injection, withdrawal}) {
    all.push_back({.name = std::string("vision gone for 1 s in ") + rt::name(phase),
                   .events = {vision_gone(phase, 0.1)},
                   .alarms = rt::alarm_vision_stale});
  }
  all.push_back({.name = "vision gone for good",
                 .events = {vision_gone(indentation, 0.2, 1e9)},
                 .end = time_limit,
                 .alarms = rt::alarm_vision_stale});
  for (const F kind : {F::freeze, F::delay}) {
    all.push_back({.name = kind == F::freeze ? "vision frozen for 1 s" : "vision late for 1 s",
                   .events = {fails(D::camera, kind, indentation, 0.1, 1)}});
  }

  // A clock that jumps. Forwards by a second: nobody fed the relay, it is open, until the operator resets it.
  // Back by 10 ms, or a nonsense period, or a start far off: one odd tick.
  for (const Phase phase : {free, indentation, injection, withdrawal}) {
    all.push_back({.name = std::string("clock 1 s forwards in ") + rt::name(phase),
                   .events = {late(1, phase, 0.2)},
                   .fault = Fault::stage_fault,
                   .alarms = rt::alarm_overrun,
                   .step_N = 0.5});
    all.push_back({.name = std::string("clock 10 ms back in ") + rt::name(phase),
                   .events = {{.phase = phase, .after_s = 0.2, .what = What::clock_back, .value = 0.01}},
                   .step_N = 0.5});
  }
  int n = 0;
  for (const double period : {0.0, kNaN, -1.0, 1e-9, 1e9}) {
    all.push_back({.name = "nonsense period " + std::to_string(n++),
                   .events = {{.phase = indentation, .after_s = 0.2, .what = What::period, .value = period},
                              {.phase = injection, .after_s = 0.2, .what = What::period, .value = period}}});
  }
  for (const double off : {1.0, -0.01, -1.0}) {
    all.push_back({.name = "start off, " + std::to_string(n++),
                   .events = {{.phase = indentation, .after_s = 0.2, .what = What::start, .value = off},
                              {.phase = injection, .after_s = 0.2, .what = What::start, .value = off}}});
  }

  // A tick late by 50 ms. The relay waits 50 ms for the heartbeat and opens; the operator resets it. One that
  // waits longer: an alarm, and the task goes on; with real actuators so many lost ticks are a fault.
  for (const Phase phase : {free, contact, indentation, puncture, injection, withdrawal}) {
    all.push_back({.name = std::string("50 ms late in ") + rt::name(phase),
                   .events = {late(0.05, phase, 0.1)},
                   .fault = Fault::stage_fault,
                   .alarms = rt::alarm_overrun,
                   .step_N = 0.5});
    all.push_back({.name = std::string("50 ms late, patient relay, in ") + rt::name(phase),
                   .scene = {"sim.estop.relay_timeout_ms=100"},
                   .events = {late(0.05, phase, 0.1)},
                   .alarms = rt::alarm_overrun,
                   .step_N = 0.5});
  }
  for (const double rate : {4000.0, 8000.0}) {
    all.push_back({.name = "50 ms late, patient relay, " + kHz(rate),
                   .scene = {"sim.estop.relay_timeout_ms=100"},
                   .events = {late(0.05, indentation, 0.1), late(0.05, injection, 0.1)},
                   .alarms = rt::alarm_overrun,
                   .rate_Hz = rate,
                   .step_N = 0.5});
  }
  all.push_back({.name = "50 ms late, real actuators",
                 .scene = {"sim.estop.relay_timeout_ms=100"},
                 .events = {late(0.05, indentation, 0.1)},
                 .fault = Fault::overrun,
                 .step_N = 0.5,
                 .real_actuators = true});
  all.push_back(
      {.name = "15 ms late again and again",
       .events = {late(0.015, free, 0.3), late(0.015, contact, 0.05), late(0.015, indentation, 0.2),
                  late(0.015, puncture, 0.1), late(0.015, injection, 0.1), late(0.015, withdrawal, 0.1)},
       .step_N = 0.5});

  // Two at once: the first cause is kept, and what is still wrong is not reset away.
  all.push_back({.name = "vision gone, then a tick late",
                 .scene = {"sim.estop.relay_timeout_ms=100"},
                 .events = {vision_gone(indentation, 0.1), late(0.05, indentation, 0.6)},
                 .alarms = rt::alarm_vision_stale | rt::alarm_overrun,
                 .step_N = 0.5});
  const Event press{.phase = indentation, .after_s = 0.2, .what = What::press_estop, .for_s = 0.3};
  all.push_back({.name = "e-stop, reset", .events = {press}, .fault = Fault::estop});
  all.push_back({.name = "e-stop and suction off, reset",
                 .events = {press, fails(D::vacuum, F::saturate, indentation, 0.2)},
                 .end = stopped,
                 .fault = Fault::estop});
  all.push_back({.name = "e-stop and a tick late, reset",
                 .scene = {"sim.estop.relay_timeout_ms=100"},
                 .events = {press, late(0.05, indentation, 0.2)},
                 .fault = Fault::estop,
                 .alarms = rt::alarm_overrun,
                 .step_N = 0.5});
  all.push_back({.name = "stage and vision gone",
                 .events = {vision_gone(injection, 0.1), fails(D::stage, F::drop, injection, 0.6)},
                 .end = stopped,
                 .fault = Fault::stage_lost,
                 .alarms = rt::alarm_vision_stale});
  all.push_back({.name = "hand not a number while thrown",
                 .scene = fast,
                 .events = {throw_in, fails(D::hand, F::nan, free, 0.12)},
                 .end = stopped,
                 .fault = Fault::hand_invalid,
                 .step_N = kThrown_N});
  all.push_back(
      {.name = "noise on the hand, vision gone, a tick late",
       .scene = {"sim.estop.relay_timeout_ms=100"},
       .events = {fails(D::hand, F::noise, free, 0), vision_gone(injection, 0.1), late(0.05, injection, 0.3)},
       .alarms = rt::alarm_vision_stale | rt::alarm_overrun,
       .step_N = 2});

  // Command `end`: outside at once, inside as soon as the needle is out.
  for (const Phase phase : {free, indentation, puncture, injection}) {
    const bool injects = phase == injection;
    all.push_back({.name = std::string("command end in ") + rt::name(phase),
                   .events = {{.phase = phase, .after_s = 0.35, .what = What::end}},
                   .end = injects ? done : not_injected});
  }
  // The same at other rates: a third of the rows at 4 kHz, a third at 8 kHz.
  const std::size_t at_1_kHz = all.size();
  for (std::size_t i = 0; i < at_1_kHz; ++i) {
    Row row = all[i];
    if (row.name.ends_with("kHz") || row.end == refused || i % 3 == 2) {
      continue;
    }
    row.rate_Hz = i % 3 == 0 ? 4000 : 8000;
    row.name += ", at " + kHz(row.rate_Hz);
    all.push_back(row);
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Row, Extreme, testing::ValuesIn(rows()), [](const auto& which) {
  std::string n = which.param.name;
  for (char& c : n) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) {
      c = '_';
    }
  }
  return n;
});

}  // namespace
}  // namespace punctum
