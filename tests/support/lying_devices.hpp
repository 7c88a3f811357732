// A station for the servo in which everything can lie: light devices, a sphere as the cell, a microscope that
// sees it late, a hand, a clock. What is true, what the servo is told and what it writes stand apart, so that
// the invariants can be judged by the truth.
//
// A run can be taken back: state() and restore() copy all of it, the servo included, within a tenth of a
// millisecond.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <utility>

#include "hal/devices.hpp"
#include "hal/frames.hpp"
#include "rt/control/servo.hpp"
#include "rt/station/station.hpp"
#include "tests/support/invariants.hpp"

namespace punctum::rt::test {

// What can be done to the servo, by an operator, a device, the clock or another program. Unit of the value.
enum class Lie : std::uint8_t {
  // The hand; these three are no lies.
  moves,     // m at the hand along an axis, over its time, and stays there
  trembles,  // m, 10 Hz
  lets_go,   // no arm at the handle
  clutches,
  injects,
  next_cell,
  enable_up,  // the enabling device, held otherwise
  squeezes,   // to its third position
  // The hand's readings.
  hand_glitch,  // m, added
  hand_no_data,
  hand_gone,
  hand_fault,
  hand_repeats,       // the last reading with its old time
  hand_stuck,         // the last position with fresh times
  hand_late,          // ticks
  hand_every,         // a new reading every so many ticks, repeated in between
  hand_every_silent,  // the same, no data in between
  hand_nan,
  hand_absurd,  // m, instead of the position
  hand_time,    // s, added to the sample's time
  hand_refuses_force,
  hand_takes_no_force,  // it keeps the last one, and says no more than that
  // The stage.
  stage_no_data,
  stage_gone,
  stage_fault,
  stage_repeats,
  stage_stuck,
  stage_late,
  stage_every,
  stage_nan,
  stage_absurd,
  stage_offset,  // m, added along an axis
  stage_error,   // m, following error
  stage_refuses,
  stage_deaf,
  stage_runs_away,  // m/s along an axis
  stage_ignores_stop,
  stage_ignores_power_off,
  stage_sinks,  // m/s along an axis, while it has no power
  stage_never_enables,
  stage_drops_power,
  stage_never_stands,
  stage_axis,  // rad, turned about an axis
  // The e-stop chain.
  contact_a,
  contact_b,
  contacts,
  pulse,
  estop_no_data,
  estop_gone,
  estop_time,  // s, added to the sample's time
  reset,
  // The enabling switch.
  switch_a,
  switch_b,
  switch_welded,  // contact a stays closed
  switch_pulse,
  switch_no_data,
  switch_gone,
  // Vision.
  vision_gone,
  vision_late,     // s
  vision_jumps,    // m along an axis: the cell, not the needle
  picture_shifts,  // m along an axis: the whole picture
  vision_recedes,  // m/s: the cell
  vision_grows,    // m/s: its radius
  false_puncture,
  false_inner_puncture,
  false_contact,
  no_puncture,    // of either membrane
  vision_future,  // s
  vision_past,    // s
  vision_frozen,  // the same picture with fresh times
  vision_nan,
  vision_absurd,  // m
  // Other devices.
  injector_stuck_open,
  injector_stuck_shut,
  injector_time,  // s, added to the sample's time
  vacuum_lost,
  vacuum_time,    // s
  sensor_pushed,  // N
  sensor_nan,
  sensor_time,  // s
  // The clock.
  stall,        // s, one tick afterwards
  start_late,   // s
  clock_back,   // s
  period_told,  // s
  // Commands.
  command_stop,
  command_end,
  command_scale,
  command_odd,
  command_position_scale,  // hand metres per needle metre
  command_depth_limit,     // m
  count
};
inline constexpr std::size_t kLies = static_cast<std::size_t>(Lie::count);
inline constexpr std::array<const char*, kLies> kLieNames{"moves",
                                                          "trembles",
                                                          "lets_go",
                                                          "clutches",
                                                          "injects",
                                                          "next_cell",
                                                          "enable_up",
                                                          "squeezes",
                                                          "hand_glitch",
                                                          "hand_no_data",
                                                          "hand_gone",
                                                          "hand_fault",
                                                          "hand_repeats",
                                                          "hand_stuck",
                                                          "hand_late",
                                                          "hand_every",
                                                          "hand_every_silent",
                                                          "hand_nan",
                                                          "hand_absurd",
                                                          "hand_time",
                                                          "hand_refuses_force",
                                                          "hand_takes_no_force",
                                                          "stage_no_data",
                                                          "stage_gone",
                                                          "stage_fault",
                                                          "stage_repeats",
                                                          "stage_stuck",
                                                          "stage_late",
                                                          "stage_every",
                                                          "stage_nan",
                                                          "stage_absurd",
                                                          "stage_offset",
                                                          "stage_error",
                                                          "stage_refuses",
                                                          "stage_deaf",
                                                          "stage_runs_away",
                                                          "stage_ignores_stop",
                                                          "stage_ignores_power_off",
                                                          "stage_sinks",
                                                          "stage_never_enables",
                                                          "stage_drops_power",
                                                          "stage_never_stands",
                                                          "stage_axis",
                                                          "contact_a",
                                                          "contact_b",
                                                          "contacts",
                                                          "pulse",
                                                          "estop_no_data",
                                                          "estop_gone",
                                                          "estop_time",
                                                          "reset",
                                                          "switch_a",
                                                          "switch_b",
                                                          "switch_welded",
                                                          "switch_pulse",
                                                          "switch_no_data",
                                                          "switch_gone",
                                                          "vision_gone",
                                                          "vision_late",
                                                          "vision_jumps",
                                                          "picture_shifts",
                                                          "vision_recedes",
                                                          "vision_grows",
                                                          "false_puncture",
                                                          "false_inner_puncture",
                                                          "false_contact",
                                                          "no_puncture",
                                                          "vision_future",
                                                          "vision_past",
                                                          "vision_frozen",
                                                          "vision_nan",
                                                          "vision_absurd",
                                                          "injector_stuck_open",
                                                          "injector_stuck_shut",
                                                          "injector_time",
                                                          "vacuum_lost",
                                                          "vacuum_time",
                                                          "sensor_pushed",
                                                          "sensor_nan",
                                                          "sensor_time",
                                                          "stall",
                                                          "start_late",
                                                          "clock_back",
                                                          "period_told",
                                                          "command_stop",
                                                          "command_end",
                                                          "command_scale",
                                                          "command_odd",
                                                          "command_position_scale",
                                                          "command_depth_limit"};

// One lie, from a tick on for so many ticks.
struct Event {
  int at = 0;
  int lasts = 1;
  Lie lie = Lie::moves;
  double value = 0;
  int axis = 0;
};

// Icsi with everything that has a place in the servo, and cells without end. Set-up 1: twice as fast, with
// real actuators, an enabling device and a force sensor. Set-up 2: a dish floor and a holding pipette that
// the hand reaches, beside the way to the cell, and a position scale that commands may change. Set-up 3: as
// 1, with a switch of its own as the enabling device. Set-up 4: a cell with an inner membrane, for which an
// injection waits.
inline ServoConfig searched_config(int setup = 0) {
  ServoConfig c;
  c.membrane.emplace();
  c.cone.emplace();
  c.axis.emplace();
  c.damping.emplace();
  c.guard.emplace();
  c.injector.emplace().max_open_s = 0.3;
  c.vacuum.emplace();
  c.cells = 0;
  // Near enough that a hand reaches its edges.
  c.mapping.workspace_min_m = {-100e-6, -30e-6, -25e-6};
  c.mapping.workspace_max_m = {100e-6, 30e-6, 25e-6};
  if (setup == 1 || setup == 3) {
    c.rate_Hz = 2000;
    c.real_actuators = true;
    c.enabling.emplace();
    c.force_sensor = true;
  }
  c.inner_membrane = setup == 4;
  if (setup == 2) {
    c.forbidden.emplace();
    c.forbidden->clearance_m = 2e-6;
    c.forbidden->felt_m = 4e-6;
    c.forbidden->floor.emplace().z_m = 20e-6;
    c.forbidden->holder = HolderBodyParams{{35e-6, -18e-6, 4e-6}, {0.2, -0.97, 0.1}, 15e-6};
    c.forbidden->holder->axis.normalize();
    c.mapping.position_scale_min = 250;
    c.mapping.position_scale_max = 1000;
  }
  return c;
}

class LyingStation {
  using Vec3 = hal::Vec3;

 public:
  explicit LyingStation(const ServoConfig& config, bool with_switch = false)
      : config_(config),
        dt_s_(1 / config.rate_Hz),
        lag_(std::exp(-dt_s_ / 0.004)),
        frame_ticks_(std::llround(0.04 / dt_s_)),
        station_(std::make_unique<LocalStation>()),
        with_switch_(with_switch),
        checker_(config) {
    truth.on = config.enabling.has_value();  // as another program left it
    new (servo_bytes_.data())
        Servo(config,
              Devices{hand_, &stage_, &estop_, config.injector ? &injector_ : nullptr,
                      config.vacuum ? &vacuum_ : nullptr, config.force_sensor ? &sensor_ : nullptr,
                      with_switch ? &switch_ : nullptr},
              station_->station);
  }
  ~LyingStation() { servo().~Servo(); }
  LyingStation(const LyingStation&) = delete;
  LyingStation& operator=(const LyingStation&) = delete;

  Servo& servo() { return *std::launder(reinterpret_cast<Servo*>(servo_bytes_.data())); }
  const TelemetrySample& sample() { return servo().sample(); }
  Invariants& checker() { return checker_; }
  LocalStation& memory() { return *station_; }  // shared with vision and the writers of commands

  static constexpr std::size_t kPast = 64;
  static constexpr double kRelay_s = 0.05;  // without a heartbeat: the hand's amplifier is off

  // The truth, and what the devices remember. Plain data.
  struct Truth {
    std::int64_t now = 1'000'000'000;
    std::int64_t latest_start = 0;  // of a tick, as the servo was told
    std::uint64_t tick = 0, missed = 0;
    // The hand: 75 g, an arm that pulls towards an intention.
    Vec3 x = Vec3::Zero(), v = Vec3::Zero(), intention = Vec3::Zero(), force = Vec3::Zero();
    double work_J = 0;
    std::uint32_t buttons = 0;
    hal::HandState told_hand;
    double told_false_m = 0;  // of its position, what a lie has added
    std::array<hal::HandState, kPast> hand_past{};
    // The stage, in the frame of the picture.
    Vec3 tip{60e-6, 2e-6, 0}, target{60e-6, 2e-6, 0}, speed = Vec3::Zero();
    bool on = false, stopped = false, power = false, enable_line = false;
    bool stage_true = true;
    hal::StageState told_stage;
    std::array<hal::StageState, kPast> stage_past{};
    bool level = false;
    hal::EstopState chain;
    // Cell and microscope.
    Vec3 centre{-40e-6, 0, 0};
    bool punctured = false, inner_punctured = false;
    Vec3 recession = Vec3::Zero();
    double growth_m = 0;
    Observation shown;
    std::int64_t seen_ns = 0;
    std::array<Observation, 16> on_its_way{};
    std::array<std::int64_t, 16> due_ns{};
    std::size_t waiting = 0;
    bool gate = false;
    int gauge = 0;
    bool ending = false;
    bool start_lied = false;  // on the tick before
  };
  Truth truth;

  // What these devices tell in place of their readings, for faults that no lie above is.
  std::function<hal::Status(hal::EstopState&)> tell_estop;
  std::function<hal::Status(hal::EnablingState&)> tell_switch;
  std::function<hal::Status(hal::InjectorState&)> tell_injector;
  std::function<hal::Status(hal::VacuumState&)> tell_vacuum;
  std::function<hal::Status(hal::ForceState&)> tell_sensor;
  int frame_divisor = 1;  // only every so many pictures is seen

  static constexpr double kR_m = 60e-6, kPuncture_m = 14e-6, kInnerPuncture_m = 22e-6;
  const Vec3 registration{3e-6, -2e-6, 0};

  [[nodiscard]] double gap_m() const {
    const double r2 = truth.tip.y() * truth.tip.y() + truth.tip.z() * truth.tip.z();
    return truth.tip.x() - (truth.centre.x() + std::sqrt(std::max(0.0, kR_m * kR_m - r2)));
  }

  // A run that can be taken up again here, and only here: the servo keeps its address.
  struct State {
    Truth truth;
    Invariants checker;
    std::unique_ptr<std::byte[]> servo;
    std::unique_ptr<std::byte[]> observation;
  };
  [[nodiscard]] State state() const {
    State s{truth, checker_, std::make_unique<std::byte[]>(sizeof(Servo)),
            std::make_unique<std::byte[]>(sizeof(ObservationSegment))};
    std::memcpy(s.servo.get(), servo_bytes_.data(), sizeof(Servo));
    std::memcpy(s.observation.get(), static_cast<const void*>(&station_->observation),
                sizeof(ObservationSegment));
    return s;
  }
  // The servo has no heap and points to nothing of its own: its bytes are its state.
  void restore(const State& s) {
    truth = s.truth;
    checker_ = s.checker;
    std::memcpy(servo_bytes_.data(), s.servo.get(), sizeof(Servo));
    std::memcpy(static_cast<void*>(&station_->observation), s.observation.get(), sizeof(ObservationSegment));
    std::memset(static_cast<void*>(&station_->parent.queue), 0, sizeof station_->parent.queue);
    std::memset(static_cast<void*>(&station_->console.queue), 0, sizeof station_->console.queue);
  }

  // One tick: k is its number in the schedule.
  void tick(int k, std::span<const Event> events) {
    find(k, events);
    const int periods = 1 + std::max(0, static_cast<int>(std::min(value(Lie::stall), 1.0) / dt_s_));
    truth.work_J = 0;
    for (int i = 0; i < periods; ++i) {
      truth.now += std::llround(1e9 * dt_s_);
      const double before_J = truth.work_J;
      // A core that does not run can take no force away: that is left to the relay.
      if (i * dt_s_ > kRelay_s) {
        truth.force.setZero();
      }
      step_hand(k, events);
      if (i >= 2) {
        truth.work_J = std::min(truth.work_J, before_J);
      }
      step_stage();
      look();
      deliver();
      if (i + 1 < periods) {
        ++truth.tick;
        ++truth.missed;
      }
    }
    begin_seen(periods);
    command();
    TickInfo info{truth.tick, truth.now, truth.now, periods * dt_s_, truth.missed};
    if (on(Lie::start_late)) {
      info.start_ns += std::llround(1e9 * std::abs(value(Lie::start_late)));
    }
    if (on(Lie::clock_back)) {
      info.start_ns -= std::llround(1e9 * std::abs(value(Lie::clock_back)));
    }
    if (on(Lie::period_told)) {
      info.period_s = value(Lie::period_told);
    }
    truth.latest_start = std::max(truth.latest_start, info.start_ns);
    servo().tick(info);
    ++truth.tick;
    seen_.sample = &sample();
    seen_.level = truth.level;
    seen_.power = truth.power;
    seen_.enable_line = truth.enable_line;
    seen_.gate = truth.gate;
    seen_.force_N = truth.force;
    seen_.ending = truth.ending;
    seen_.finished = servo().finished();
    checker_.step(seen_);
  }

 private:
  // ---- which lies are told on this tick ----
  void find(int k, std::span<const Event> events) {
    active_.fill(nullptr);
    begins_.fill(false);
    for (const Event& e : events) {
      if (k >= e.at && k < e.at + e.lasts) {
        active_[static_cast<std::size_t>(e.lie)] = &e;
        begins_[static_cast<std::size_t>(e.lie)] = k == e.at;
      }
    }
  }
  [[nodiscard]] bool on(Lie lie) const { return active_[static_cast<std::size_t>(lie)] != nullptr; }
  [[nodiscard]] bool begins(Lie lie) const { return begins_[static_cast<std::size_t>(lie)]; }
  [[nodiscard]] double value(Lie lie) const {
    return on(lie) ? active_[static_cast<std::size_t>(lie)]->value : 0;
  }
  [[nodiscard]] Vec3 along(Lie lie) const {
    return on(lie) ? Vec3(value(lie) * Vec3::Unit(active_[static_cast<std::size_t>(lie)]->axis))
                   : Vec3::Zero();
  }
  // Where the reading lies that a late device gives.
  [[nodiscard]] std::size_t place(Lie late) const {
    const auto ago = static_cast<std::uint64_t>(on(late) ? std::clamp(value(late), 0.0, kPast - 1.0) : 0.0);
    return (truth.tick - std::min(truth.tick, ago)) % kPast;
  }
  [[nodiscard]] bool skips(Lie lie) const {
    return on(lie) && truth.tick % static_cast<std::uint64_t>(std::clamp(value(lie), 1.0, 64.0)) != 0;
  }

  // Of a reading that is taken now.
  [[nodiscard]] std::int64_t at_false_time(Lie lie) const {
    return truth.now + std::llround(1e9 * value(lie));
  }
  // No core needs to believe a reading from the future.
  [[nodiscard]] bool ahead(std::int64_t sample_ns) const {
    return sample_ns > std::max(truth.now, truth.latest_start) + 1'000'000;
  }

  // ---- the truth ----
  void step_hand(int k, std::span<const Event> events) {
    Truth& w = truth;
    Vec3 wanted = w.intention;
    for (const Event& e : events) {
      if (e.lie == Lie::moves && k >= e.at) {
        const double part = std::min(1.0, (k - e.at + 1.0) / e.lasts);
        wanted[e.axis] += e.value * part * part * (3 - 2 * part);
      }
      if (e.lie == Lie::trembles && k >= e.at && k < e.at + e.lasts) {
        wanted[e.axis] += e.value * std::sin(2 * 3.141592653589793 * 10 * dt_s_ * (k - e.at));
      }
    }
    const bool free = on(Lie::lets_go);
    const int n = 6;
    const Vec3 from = w.x;
    for (int i = 0; i < n; ++i) {
      Vec3 f = w.force - 0.1 * w.v;
      if (!free) {
        f += 250 * (wanted - w.x) - 6 * w.v;
      }
      w.v += f / 0.075 * (dt_s_ / n);
      w.x += w.v * (dt_s_ / n);
    }
    w.work_J += w.force.dot(w.x - from);
    w.buttons = (on(Lie::clutches) ? hal::kButtonClutch : 0) | (on(Lie::injects) ? hal::kButtonInject : 0) |
                (on(Lie::next_cell) ? hal::kButtonNextCell : 0) |
                // Seen let go before the first press.
                (on(Lie::enable_up) || w.tick < 60 ? 0 : hal::kButtonEnable) |
                (on(Lie::squeezes) ? hal::kButtonPanic : 0);
    hal::HandState& now = w.hand_past[w.tick % kPast];
    now = {};
    for (int i = 0; i < 3; ++i) {
      now.position_m[i] = 0.03e-3 * std::round(w.x[i] / 0.03e-3);
    }
    now.buttons = w.buttons;
    now.sample_ns = w.now;
  }
  void step_stage() {
    Truth& w = truth;
    const Vec3 from = w.tip;
    if (on(Lie::stage_drops_power)) {
      w.on = false;
    }
    if (!w.on || w.stopped || on(Lie::stage_deaf)) {
      w.target = w.tip;
    }
    if (on(Lie::stage_runs_away) && w.on && !w.stopped) {
      w.target += dt_s_ * along(Lie::stage_runs_away);
    }
    if (on(Lie::stage_sinks) && !w.on) {
      w.target = w.tip += dt_s_ * along(Lie::stage_sinks);
    }
    const Vec3 next = w.target + (w.tip - w.target) * lag_;
    w.speed = (next - from) / dt_s_;
    w.tip = next;
    hal::StageState& now = w.stage_past[w.tick % kPast];
    now = {};
    now.tip_m = w.tip + registration;
    now.enabled = w.on && !w.stopped;
    now.powered = w.on;
    now.at_standstill = w.speed.norm() < 1e-6;
    now.sample_ns = w.now;
    for (const Lie lie :
         {Lie::stage_late, Lie::stage_deaf, Lie::stage_ignores_stop, Lie::stage_ignores_power_off,
          Lie::stage_runs_away, Lie::stage_sinks, Lie::stage_repeats, Lie::stage_every, Lie::stage_no_data,
          Lie::stage_never_enables}) {
      w.stage_true = w.stage_true && !on(lie);
    }
    const double gap = gap_m();
    w.punctured = gap <= 10e-6 && (w.punctured || -gap > kPuncture_m);
    w.inner_punctured = w.punctured && (w.inner_punctured || -gap > kInnerPuncture_m);
    if (on(Lie::vision_recedes)) {
      w.recession.x() -= value(Lie::vision_recedes) * dt_s_;
    }
    if (on(Lie::vision_grows)) {
      w.growth_m += value(Lie::vision_grows) * dt_s_;
    }
  }

  void look() {
    Truth& w = truth;
    if (static_cast<std::int64_t>(w.tick) % (frame_ticks_ * frame_divisor) != 0 || on(Lie::vision_gone)) {
      return;
    }
    Observation o;
    const double gap = gap_m();
    o.flags = Observation::tip_ok | Observation::outer_ok | (w.punctured ? Observation::punctured : 0U);
    if (config_.inner_membrane) {
      o.flags |= Observation::inner_ok | (w.inner_punctured ? Observation::inner_punctured : 0U);
    }
    const Vec3 off = along(Lie::vision_jumps) + w.recession;
    const double R = kR_m + w.growth_m;
    for (int i = 0; i < 2; ++i) {
      o.tip_m[i] = w.tip[i];
      o.centre_m[i] = w.centre[i] + off[i];
    }
    o.R_m = R;
    o.gap_m = gap - off.x() - w.growth_m;
    if (o.gap_m < 0 && !on(Lie::no_puncture)) {
      o.flags |= Observation::contact;
    }
    if (o.gap_m < 0) {
      o.wd_m = w.punctured ? 0 : -o.gap_m;
      o.a_m = 3.8e-6 + 0.45 * std::sqrt(2 * R * -o.gap_m);
    }
    if (on(Lie::false_puncture)) {
      o.flags |= Observation::punctured;
    }
    if (on(Lie::false_inner_puncture)) {
      o.flags |= Observation::inner_punctured;
    }
    if (on(Lie::false_contact)) {
      o.flags |= Observation::contact;
    }
    if (on(Lie::no_puncture)) {
      o.flags &= ~(std::uint32_t{Observation::punctured} | std::uint32_t{Observation::inner_punctured});
    }
    const Vec3 shift = along(Lie::picture_shifts);
    for (int i = 0; i < 2; ++i) {
      o.tip_m[i] += shift[i];
      o.centre_m[i] += shift[i];
    }
    if (on(Lie::vision_nan)) {
      o.tip_m[0] = o.centre_m[0] = o.gap_m = o.R_m = std::numeric_limits<double>::quiet_NaN();
    }
    if (on(Lie::vision_absurd)) {
      o.tip_m[0] = o.centre_m[0] = o.gap_m = value(Lie::vision_absurd);
    }
    // Marks what no core needs to believe.
    o.reserved = on(Lie::vision_nan) || on(Lie::vision_absurd) ? 1 : 0;
    if (on(Lie::vision_frozen)) {
      o = w.shown;
    }
    o.exposure_ns = w.now;
    w.shown = o;
    // Told with a wrong time.
    if (on(Lie::vision_future)) {
      o.exposure_ns += std::llround(1e9 * std::abs(value(Lie::vision_future)));
    }
    if (on(Lie::vision_past)) {
      o.exposure_ns -= std::llround(1e9 * std::abs(value(Lie::vision_past)));
    }
    const double late_s = 0.06 + (on(Lie::vision_late) ? std::abs(value(Lie::vision_late)) : 0.0);
    if (w.waiting < w.on_its_way.size()) {
      w.on_its_way[w.waiting] = o;
      w.due_ns[w.waiting++] = w.now + std::llround(1e9 * late_s);
    }
  }
  void deliver() {
    Truth& w = truth;
    while (w.waiting > 0 && w.due_ns[0] <= w.now) {
      const Observation& o = w.on_its_way[0];
      if (o.reserved == 0) {
        if (o.exposure_ns <= w.now) {
          w.seen_ns = std::max(w.seen_ns, o.exposure_ns);
        }
        punctured_frames_ += o.has(Observation::punctured) ? 1 : 0;
        inner_punctured_frames_ += o.has(Observation::inner_punctured) ? 1 : 0;
      }
      station_->observation.slot.push(o);
      --w.waiting;
      std::copy(w.on_its_way.begin() + 1, w.on_its_way.end(), w.on_its_way.begin());
      std::copy(w.due_ns.begin() + 1, w.due_ns.end(), w.due_ns.begin());
    }
  }

  void command() {
    Command c;
    c.kind = begins(Lie::command_stop)    ? Command::stop
             : begins(Lie::command_end)   ? Command::end
             : begins(Lie::command_scale) ? Command::force_scale
                                          : Command::none;
    c.value = value(Lie::command_scale);
    if (c.kind != Command::none) {
      (void)station_->parent.queue.try_push(c);
    }
    if (begins(Lie::command_odd)) {
      (void)station_->parent.queue.try_push({17, 0, 0});
    }
    if (begins(Lie::command_position_scale)) {
      const double scale = value(Lie::command_position_scale);
      (void)station_->console.queue.try_push({Command::position_scale, scale, 0});
      const MappingParams& m = config_.mapping;
      const bool within = scale >= m.least_position_scale() && scale <= m.most_position_scale();
      seen_.position_scale = within ? scale : 0;
    }
    if (begins(Lie::command_depth_limit)) {
      const double limit_m = value(Lie::command_depth_limit);
      (void)station_->console.queue.try_push({Command::depth_limit, limit_m, 0});
      seen_.depth_limit_m = limit_m > 0 && limit_m <= config_.limits.penetration_depth_m ? limit_m : 0;
    }
    seen_.stop_commanded = begins(Lie::command_stop);
    truth.ending = truth.ending || begins(Lie::command_end);
  }

  void begin_seen(int periods) {
    Truth& w = truth;
    seen_ = {};
    seen_.elapsed_s = periods * dt_s_;
    seen_.now_ns = w.now;
    seen_.asked_N = w.force;
    const bool start_lied = on(Lie::start_late) || on(Lie::clock_back);
    seen_.clock_true = !on(Lie::period_told) || !(start_lied || w.start_lied);
    w.start_lied = start_lied;
    seen_.hand_true_m = w.x;
    seen_.hand_work_J = w.work_J;
    seen_.tip_true_m = w.tip + registration;
    seen_.stage_true = w.stage_true;
    seen_.stage_moves = w.speed.norm() > 15e-6;
    seen_.seen_ns = w.seen_ns;
    seen_.punctured_frames = std::exchange(punctured_frames_, 0);
    seen_.inner_punctured_frames = std::exchange(inner_punctured_frames_, 0);
    seen_.hand_hidden = on(Lie::hand_stuck);
    seen_.hand_false_m = on(Lie::hand_absurd) ? 1 : w.told_false_m;
    seen_.hand_status = seen_.stage_status = seen_.estop_status = seen_.switch_status =
        seen_.injector_status = hal::Status::no_data;
    seen_.has_switch = with_switch_;
  }

  // ---- what the servo is told, and what it writes ----
  struct Hand final : hal::HapticDevice {
    explicit Hand(LyingStation& s) : at(s) {}
    LyingStation& at;
    hal::Status read(hal::HandState& out) noexcept override { return at.read_hand(out); }
    hal::Status write_force(const Vec3& f) noexcept override {
      ++at.seen_.hand_writes;
      at.seen_.asked_N = f;
      if (at.on(Lie::hand_refuses_force)) {
        return hal::Status::fault;
      }
      if (at.on(Lie::hand_takes_no_force)) {
        return hal::Status::no_data;
      }
      at.truth.force = f.allFinite() ? f : Vec3::Zero();
      return hal::Status::ok;
    }
  };
  hal::Status read_hand(hal::HandState& out) {
    Truth& w = truth;
    const hal::Status status = on(Lie::hand_gone)    ? hal::Status::disconnected
                               : on(Lie::hand_fault) ? hal::Status::fault
                               : on(Lie::hand_no_data) || skips(Lie::hand_every_silent) ? hal::Status::no_data
                                                                                        : hal::Status::ok;
    seen_.hand_status = status;
    if (status != hal::Status::ok) {
      return status;
    }
    hal::HandState told = w.hand_past[place(Lie::hand_late)];
    double false_m = 0;
    if (on(Lie::hand_glitch)) {
      told.position_m += along(Lie::hand_glitch);
      false_m = std::abs(value(Lie::hand_glitch));
    }
    if (on(Lie::hand_repeats) || skips(Lie::hand_every)) {
      told = w.told_hand;
      false_m = w.told_false_m;
    }
    if (on(Lie::hand_stuck)) {
      told.position_m = w.told_hand.position_m;
      false_m = w.told_false_m;
    }
    w.told_hand = told;
    w.told_false_m = false_m;
    seen_.hand_false_m = on(Lie::hand_absurd) ? 1 : false_m;
    if (on(Lie::hand_nan)) {
      told.position_m.y() = std::numeric_limits<double>::quiet_NaN();
    }
    if (on(Lie::hand_absurd)) {
      told.position_m[active_[static_cast<std::size_t>(Lie::hand_absurd)]->axis] = value(Lie::hand_absurd);
    }
    if (on(Lie::hand_time)) {
      told.sample_ns += std::llround(1e9 * value(Lie::hand_time));
    }
    out = told;
    seen_.hand = told;
    if (on(Lie::hand_nan) || on(Lie::hand_absurd) || ahead(told.sample_ns)) {
      seen_.hand_status = hal::Status::fault;  // no core needs to believe it
    }
    return hal::Status::ok;
  }

  struct Stage final : hal::Stage {
    explicit Stage(LyingStation& s) : at(s) {}
    LyingStation& at;
    hal::Status read(hal::StageState& out) noexcept override { return at.read_stage(out); }
    hal::Status command(const hal::StageCommand& c) noexcept override {
      ++at.seen_.commands;
      at.seen_.command = c;
      if (at.on(Lie::stage_refuses)) {
        return hal::Status::fault;
      }
      if (c.tip_m.allFinite()) {
        at.truth.target = c.tip_m - at.registration;
      }
      return hal::Status::ok;
    }
    void quick_stop() noexcept override {
      ++at.seen_.quick_stops;
      at.truth.stopped = at.truth.stopped || !at.on(Lie::stage_ignores_stop);
    }
    void enable(bool power) noexcept override {
      at.truth.power = power;
      if (!power && !at.on(Lie::stage_ignores_power_off)) {
        at.truth.stopped = at.truth.on = false;
      }
      if (power && !at.truth.on && !at.on(Lie::stage_never_enables)) {
        at.truth.on = true;
      }
    }
  };
  hal::Status read_stage(hal::StageState& out) {
    Truth& w = truth;
    const hal::Status status = on(Lie::stage_gone)      ? hal::Status::disconnected
                               : on(Lie::stage_fault)   ? hal::Status::fault
                               : on(Lie::stage_no_data) ? hal::Status::no_data
                                                        : hal::Status::ok;
    seen_.stage_status = status;
    if (status != hal::Status::ok) {
      return status;
    }
    hal::StageState told = w.stage_past[place(Lie::stage_late)];
    told.tip_m += along(Lie::stage_offset);
    if (on(Lie::stage_repeats) || skips(Lie::stage_every)) {
      told = w.told_stage;
    }
    if (on(Lie::stage_stuck)) {
      told.tip_m = w.told_stage.tip_m;
    }
    if (on(Lie::stage_axis)) {
      const int about = std::max(1, active_[static_cast<std::size_t>(Lie::stage_axis)]->axis);
      told.axis = Eigen::AngleAxisd(value(Lie::stage_axis), Vec3::Unit(about)) * told.axis;
    }
    if (on(Lie::stage_never_stands)) {
      told.at_standstill = false;
    }
    if (on(Lie::stage_error)) {
      told.following_error_m = along(Lie::stage_error);
    }
    w.told_stage = told;
    if (on(Lie::stage_nan)) {
      told.tip_m.x() = std::numeric_limits<double>::infinity();
    }
    if (on(Lie::stage_absurd)) {
      told.tip_m += along(Lie::stage_absurd);
    }
    out = told;
    seen_.stage = told;
    if (on(Lie::stage_nan) || on(Lie::stage_absurd)) {
      seen_.stage_status = hal::Status::fault;
    }
    return hal::Status::ok;
  }

  struct Estop final : hal::EstopChain {
    explicit Estop(LyingStation& s) : at(s) {}
    LyingStation& at;
    hal::Status read(hal::EstopState& out) noexcept override {
      hal::Status status = at.on(Lie::estop_gone)      ? hal::Status::disconnected
                           : at.on(Lie::estop_no_data) ? hal::Status::no_data
                                                       : hal::Status::ok;
      if (status == hal::Status::ok) {
        out.contact_a_closed = !at.on(Lie::contact_a) && !at.on(Lie::contacts);
        out.contact_b_closed = !at.on(Lie::contact_b) && !at.on(Lie::contacts);
        out.reset_pressed = at.on(Lie::reset);
        out.pulse_seen = at.on(Lie::pulse);
        out.sample_ns = at.at_false_time(Lie::estop_time);
        status = at.tell_estop ? at.tell_estop(out) : status;
      }
      at.seen_.estop_status = status;
      if (status == hal::Status::ok) {
        at.seen_.estop = out;
      }
      if (at.ahead(out.sample_ns)) {
        at.seen_.estop_status = hal::Status::fault;
      }
      return status;
    }
    void heartbeat(bool level) noexcept override { at.truth.level = level; }
    void drive_power(bool power) noexcept override { at.truth.enable_line = power; }
  };

  // Held and let go by the same motion as the button of the handle.
  struct Switch final : hal::EnablingSwitch {
    explicit Switch(LyingStation& s) : at(s) {}
    LyingStation& at;
    hal::Status read(hal::EnablingState& out) noexcept override {
      hal::Status status = at.on(Lie::switch_gone)      ? hal::Status::disconnected
                           : at.on(Lie::switch_no_data) ? hal::Status::no_data
                                                        : hal::Status::ok;
      if (status == hal::Status::ok) {
        const bool held =
            (at.truth.buttons & hal::kButtonEnable) != 0 && (at.truth.buttons & hal::kButtonPanic) == 0;
        out.contact_a_closed = (held || at.on(Lie::switch_welded)) && !at.on(Lie::switch_a);
        out.contact_b_closed = held && !at.on(Lie::switch_b);
        out.pulse_seen = at.on(Lie::switch_pulse);
        out.sample_ns = at.truth.now;
        status = at.tell_switch ? at.tell_switch(out) : status;
      }
      at.seen_.switch_status = status;
      if (status == hal::Status::ok) {
        at.seen_.enabling = out;
      }
      return status;
    }
  };

  struct Injector final : hal::Injector {
    explicit Injector(LyingStation& s) : at(s) {}
    LyingStation& at;
    void gate(bool open) noexcept override { at.truth.gate = open; }
    hal::Status read(hal::InjectorState& out) noexcept override {
      out.open = (at.truth.gate || at.on(Lie::injector_stuck_open)) && !at.on(Lie::injector_stuck_shut);
      out.sample_ns = at.at_false_time(Lie::injector_time);
      at.seen_.injector_status = at.tell_injector ? at.tell_injector(out) : hal::Status::ok;
      at.seen_.injector = out;
      return at.seen_.injector_status;
    }
  };
  struct Vacuum final : hal::HoldingVacuum {
    explicit Vacuum(LyingStation& s) : at(s) {}
    LyingStation& at;
    hal::Status read(hal::VacuumState& out) noexcept override {
      out.pressure_Pa = (at.on(Lie::vacuum_lost) ? 50 : 600) + 0.1 * (at.truth.gauge++ % 2);
      out.sample_ns = at.at_false_time(Lie::vacuum_time);
      return at.tell_vacuum ? at.tell_vacuum(out) : hal::Status::ok;
    }
  };

  struct Sensor final : hal::ForceSensor {
    explicit Sensor(LyingStation& s) : at(s) {}
    LyingStation& at;
    hal::Status read(hal::ForceState& out) noexcept override {
      out.axial_force_N = at.on(Lie::sensor_nan) ? std::numeric_limits<double>::quiet_NaN()
                                                 : at.value(Lie::sensor_pushed) + 1e-9 * (at.truth.gauge % 2);
      out.sample_ns = at.at_false_time(Lie::sensor_time);
      return at.tell_sensor ? at.tell_sensor(out) : hal::Status::ok;
    }
  };

  const ServoConfig config_;
  const double dt_s_;
  const double lag_;
  const std::int64_t frame_ticks_;
  Hand hand_{*this};
  Stage stage_{*this};
  Estop estop_{*this};
  Switch switch_{*this};
  Injector injector_{*this};
  Vacuum vacuum_{*this};
  Sensor sensor_{*this};
  std::unique_ptr<LocalStation> station_;
  const bool with_switch_;
  alignas(Servo) std::array<std::byte, sizeof(Servo)> servo_bytes_;
  Invariants checker_;
  Seen seen_;
  int punctured_frames_ = 0, inner_punctured_frames_ = 0;
  std::array<const Event*, kLies> active_{};
  std::array<bool, kLies> begins_{};
};

}  // namespace punctum::rt::test
