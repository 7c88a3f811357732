// What holds in every run of the servo, whatever its devices tell it: one number, one name and one check per
// invariant. rt/control/README.md has the table with formulas and tolerances.
//
// The checker sees one tick after the other: what is true, what the servo was told, what it wrote, and its
// telemetry sample. It knows nothing of how the servo works. A checker is a value: it can be copied with the
// run that it watches.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "hal/devices.hpp"
#include "hal/frames.hpp"
#include "rt/control/config.hpp"
#include "rt/forces/list.hpp"
#include "rt/station/observation.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::rt::test {

enum class Invariant : std::uint8_t {
  finite_writes,
  finite_telemetry,
  force_bounded,
  force_slew,
  force_gone_after_stop,
  force_returns_from_zero,
  fixtures_fade,
  work_bounded,
  moves_with_the_hand,
  deeper_by_the_hand,
  depth_bounded,
  inside_workspace,
  speed_bounded,
  acceleration_bounded,
  jerk_bounded,
  lateral_bounded,
  vision_rate,
  vision_sum,
  blind_only_outwards,
  no_set_point_in_stop,
  begins_at_the_needle,
  no_motion_unpowered,
  outside_regions,
  gate_in_phase,
  gate_own_press,
  gate_one_opening,
  gate_not_cut_short,
  gate_seen,
  gate_time,
  gate_shut_in_stop,
  gate_answered,
  relay_inputs_fresh,
  relay_stage_obeys,
  relay_off_when_distrusted,
  relay_alive,
  relay_hand_obeys,
  leaves_stop_by_reset,
  first_cause_kept,
  stops_on_estop,
  stops_on_silence,
  stops_on_command,
  quick_stop_in_time,
  power_off_in_time,
  waits_for_enabling,
  stops_when_let_go,
  phase_order,
  puncture_confirmed,
  over_at_rest,
  injects_inside,
  count
};
inline constexpr std::size_t kInvariants = static_cast<std::size_t>(Invariant::count);

struct InvariantName {
  const char* number;
  const char* name;
};
inline constexpr std::array<InvariantName, kInvariants> kInvariantNames{{
    {"N1", "finite_writes"},
    {"N2", "finite_telemetry"},
    {"F1", "force_bounded"},
    {"F2", "force_slew"},
    {"F3", "force_gone_after_stop"},
    {"F4", "force_returns_from_zero"},
    {"F5", "fixtures_fade"},
    {"E1", "work_bounded"},
    {"M1", "moves_with_the_hand"},
    {"M2", "deeper_by_the_hand"},
    {"M3", "depth_bounded"},
    {"M4", "inside_workspace"},
    {"M5", "speed_bounded"},
    {"M6", "acceleration_bounded"},
    {"M7", "jerk_bounded"},
    {"M8", "lateral_bounded"},
    {"M9", "vision_rate"},
    {"M10", "vision_sum"},
    {"M11", "blind_only_outwards"},
    {"M12", "no_set_point_in_stop"},
    {"M13", "begins_at_the_needle"},
    {"M14", "no_motion_unpowered"},
    {"M15", "outside_regions"},
    {"G1", "gate_in_phase"},
    {"G2", "gate_own_press"},
    {"G3", "gate_one_opening"},
    {"G4", "gate_not_cut_short"},
    {"G5", "gate_seen"},
    {"G6", "gate_time"},
    {"G7", "gate_shut_in_stop"},
    {"G8", "gate_answered"},
    {"H1", "relay_inputs_fresh"},
    {"H2", "relay_stage_obeys"},
    {"H3", "relay_off_when_distrusted"},
    {"H4", "relay_alive"},
    {"H5", "relay_hand_obeys"},
    {"L1", "leaves_stop_by_reset"},
    {"L2", "first_cause_kept"},
    {"L3", "stops_on_estop"},
    {"L4", "stops_on_silence"},
    {"L5", "stops_on_command"},
    {"L6", "quick_stop_in_time"},
    {"L7", "power_off_in_time"},
    {"L8", "waits_for_enabling"},
    {"L9", "stops_when_let_go"},
    {"P1", "phase_order"},
    {"P2", "puncture_confirmed"},
    {"P3", "over_at_rest"},
    {"P4", "injects_inside"},
}};
[[nodiscard]] constexpr const InvariantName& name(Invariant i) {
  return kInvariantNames[static_cast<std::size_t>(i)];
}

// How far the needle's glass, its tip there, is from the floor and from the holder of a scene, less the
// clearance: the tip alone from the floor, from the holder ball by ball along the shaft.
[[nodiscard]] inline double to_regions_m(const ForbiddenParams& regions, const hal::Vec3& tip_m,
                                         const hal::Vec3& axis, int balls = 400, double shaft_m = 2e-3) {
  double least_m = std::numeric_limits<double>::infinity();
  if (regions.floor) {
    const double z_m = regions.floor->z_m;
    least_m = (z_m > 0 ? z_m - tip_m.z() : tip_m.z() - z_m) - regions.tip_radius_m;
  }
  for (int i = 0; regions.holder && i <= balls; ++i) {
    const double part = i / static_cast<double>(balls);
    const double behind_m = shaft_m * part * part;
    const double radius_m = regions.tip_radius_m + std::min(behind_m / regions.taper_m, 1.0) *
                                                       (regions.shaft_radius_m - regions.tip_radius_m);
    const hal::Vec3 V = tip_m - behind_m * axis - regions.holder->mouth_m;
    const double depth_m = V.dot(regions.holder->axis);
    const double beside_m = V.cross(regions.holder->axis).norm() - regions.holder->radius_m;
    const double aside_m = std::max(beside_m, 0.0), before_m = std::max(-depth_m, 0.0);
    const double to_m = beside_m <= 0 && depth_m >= 0 ? std::max(beside_m, -depth_m)
                                                      : std::sqrt(aside_m * aside_m + before_m * before_m);
    least_m = std::min(least_m, to_m - radius_m);
  }
  return least_m - regions.clearance_m;
}

// The numbers in the checks. They follow from the scene where it has a limit; the others are stated here.
struct Bounds {
  explicit Bounds(const ServoConfig& config)
      : c(config),
        nominal_s(1 / config.rate_Hz),
        stale_s(config.local_model ? config.local_model->stale_after_s : 0) {}

  ServoConfig c;
  double nominal_s;
  double stale_s;

  double slew_N_s = 300;       // an injection without a fault takes 50
  double work_J = 3e-3;        // 0.28 m/s of a handle of 75 g; 1 mJ of it is 3 N on 0.3 m/s for a period
  double work_W = 2e-3;        // a fifth of what a hand gives that presses 0.5 N at 20 mm/s
  double path_slack_m = 1e-6;  // encoder steps and the ends of the tremor filter
  double overshoot = 1.15;     // path of the filter's answer over the path of its input: 1.09 for a step
  // What one false reading of up to 20 ms may move the needle by, there and again back: less than a pixel.
  double false_motion_m = 0.5e-6;
  double brief_s = 0.02;
  double switch_timeout_s = 0.02;
  double filter_s = 0.3;         // the tremor filter has settled
  double vision_sum_m = 8.5e-6;  // from first contact on
  double clear_m = c.phases.value_or(PhaseParams{}).clear_m;
  double clear_known_m = 3e-6;  // nobody outside knows closer when the core takes the needle for clear
  double remounted = 0.5;       // a needle that is turned by this (rad) was mounted otherwise
  double truth_m = 3e-6;        // the core knows the membrane's place to this
  double lateral_m = c.limits.lateral_m + 2e-6;  // the tip follows the set-point late
  double shortest_opening_s = 0.02;
  double injector_silent_s = 0.1;
  double ramp_s = 0.6;        // of a command
  double brake_s = 0.03;      // v/a, and two periods of the slowest check
  double relay_s = 0.02;      // beyond the stop's own time
  double settles_m = 13e-6;   // a stage without power: its bearings, and two ticks at 1 mm/s
  double region_m = 0.05e-6;  // the checker's balls are up to 10 um apart
  double nearer_m = 3e-6;     // a needle comes to a region per tick, by its way and its tilt
  int punctured_frames = 2;
};

// One tick.
struct Seen {
  double elapsed_s = 0;  // really, since the last tick
  std::int64_t now_ns = 0;
  // The servo was told that time: by its period, by the clock at the beginning of this tick and of the one
  // before, by its number. One of them may have been wrong.
  bool clock_true = true;

  // The hand. true: of the handle; false: what a lie adds to its position.
  hal::Status hand_status = hal::Status::ok;
  hal::HandState hand;
  hal::Vec3 hand_true_m = hal::Vec3::Zero();
  double hand_false_m = 0;
  bool hand_hidden = false;  // its readings stand still, although they come, wherever the handle goes
  double hand_work_J = 0;    // of the written force on the true handle, since the last tick
  int hand_writes = 0;
  hal::Vec3 force_N = hal::Vec3::Zero();  // that acts
  hal::Vec3 asked_N = hal::Vec3::Zero();  // the same, unless the device refused it

  hal::Status stage_status = hal::Status::ok;
  hal::StageState stage;
  hal::Vec3 tip_true_m = hal::Vec3::Zero();  // in the frame of the stage's encoders
  bool stage_true = true;                    // it has obeyed and told the truth so far
  bool stage_moves = false;                  // in truth
  int commands = 0;
  hal::StageCommand command;
  int quick_stops = 0;
  bool power = false;        // as last asked for
  bool enable_line = false;  // of the e-stop chain, likewise

  hal::Status estop_status = hal::Status::ok;
  hal::EstopState estop;
  bool level = false;  // of the heartbeat

  // The enabling device, where it is a switch of its own.
  bool has_switch = false;
  hal::Status switch_status = hal::Status::ok;
  hal::EnablingState enabling;

  // Vision: exposure of the newest observation that was delivered, of those that a core may believe.
  std::int64_t seen_ns = 0;
  int punctured_frames = 0, inner_punctured_frames = 0;  // delivered with this tick
  bool gate = false;
  bool injector_stuck = false;
  hal::Status injector_status = hal::Status::ok;
  hal::InjectorState injector;
  bool stop_commanded = false;
  double position_scale = 0;  // commanded on this tick, within the scene's bounds
  double depth_limit_m = 0;   // likewise
  bool ending = false;
  bool finished = false;
  const TelemetrySample* sample = nullptr;
};

struct Broken {
  Invariant what = Invariant::count;
  int tick = 0;
  double found = 0;
  double allowed = 0;
  double worst = 0;  // of the whole run
};

class Invariants {
 public:
  explicit Invariants(const ServoConfig& config) : b_(config) {}

  // The first violation of each invariant, in the order of the ticks.
  [[nodiscard]] std::span<const Broken> broken() const { return {broken_.data(), broken_count_}; }
  [[nodiscard]] bool holds(Invariant i) const { return !was_broken_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const Bounds& bounds() const { return b_; }
  [[nodiscard]] double largest(Invariant i) const { return largest_[static_cast<std::size_t>(i)]; }

  // From here on the run is judged: what was moved and worked before is settled.
  void begin() {
    tick_ = 0;
    broken_count_ = 0;
    was_broken_.fill(false);
    largest_.fill(0);
    settle_paths();
    settle_work();
  }

  void step(const Seen& s) {
    const TelemetrySample& t = *s.sample;
    const bool running = t.stop == StopStage::running;
    watch_inputs(s);
    watch_scale(s, running);
    numbers(s, t);
    force(s, t, running);
    latch(s, t, running);
    motion(s, t, running);
    vision(s, t);
    gate(s, t, running);
    relay(s, t, running);
    phase(s, t);
    remember(s, t, running);
    ++tick_;
  }

 private:
  using I = Invariant;
  using Vec3 = hal::Vec3;

  // A value that must not be larger than allowed; NaN is larger than everything.
  void at_most(I what, double found, double allowed) {
    const auto k = static_cast<std::size_t>(what);
    if (found <= allowed) {
      largest_[k] = std::max(largest_[k], found);
      return;
    }
    if (!was_broken_[k]) {
      was_broken_[k] = true;
      broken_[broken_count_++] = {what, tick_, found, allowed, found};
      return;
    }
    for (std::size_t i = 0; i < broken_count_; ++i) {
      if (broken_[i].what == what) {
        broken_[i].worst = std::max(broken_[i].worst, found);
      }
    }
  }
  void must(I what, bool holds, double found = 1) { at_most(what, holds ? 0 : found, 0); }

  static bool open(const hal::EstopState& e) {
    return !e.contact_a_closed || !e.contact_b_closed || e.pulse_seen;
  }

  // ---- what was told ----
  void watch_inputs(const Seen& s) {
    const double dt = s.elapsed_s;
    // A servo whose clocks agree on too short a time counts no more than that; it takes a tenth of its own at
    // least.
    told_s_ = s.clock_true ? dt : std::min(dt, 0.1 * b_.nominal_s);
    hand_silent_s_ += told_s_;
    stage_silent_s_ += told_s_;
    estop_silent_s_ += told_s_;
    if (s.hand_status == hal::Status::ok && s.hand.sample_ns != hand_sample_ns_) {
      hand_sample_ns_ = s.hand.sample_ns;
      hand_silent_s_ =
          std::min(hand_silent_s_, std::max(0.0, 1e-9 * static_cast<double>(s.now_ns - s.hand.sample_ns)));
      buttons_were_ = buttons_;
      buttons_ = s.hand.buttons;
      if (!hand_known_) {
        buttons_were_ = buttons_;
      }
      hand_known_ = true;
    } else {
      buttons_were_ = buttons_;
    }
    watch_enabling(s);
    const bool held = (enabling_ & hal::kButtonEnable) != 0;
    const bool was_held = (enabling_were_ & hal::kButtonEnable) != 0;
    press_edge_ = !was_running_ && held && (press_edge_ || !was_held);
    if (s.stage_status == hal::Status::ok && s.stage.sample_ns > stage_sample_ns_) {
      stage_sample_ns_ = s.stage.sample_ns;
      stage_silent_s_ =
          std::min(stage_silent_s_, std::max(0.0, 1e-9 * static_cast<double>(s.now_ns - s.stage.sample_ns)));
      stage_told_before_m_ = stage_known_ ? stage_told_.tip_m : s.stage.tip_m;
      stage_told_ = s.stage;
      stage_known_ = true;
    }
    stage_new_ = stage_silent_s_ < 0.5 * s.elapsed_s;
    if (s.estop_status == hal::Status::ok && s.estop.sample_ns > estop_sample_ns_) {
      estop_sample_ns_ = s.estop.sample_ns;
      estop_silent_s_ =
          std::min(estop_silent_s_, std::max(0.0, 1e-9 * static_cast<double>(s.now_ns - s.estop.sample_ns)));
      // A press that began in this stop with the contacts closed, and was held with them closed since.
      if (s.estop.reset_pressed && !reset_ && !was_running_) {
        reset_edge_ = true;
      }
      reset_edge_ = reset_edge_ && s.estop.reset_pressed;
      reset_ = s.estop.reset_pressed;
    }
    reset_edge_ = reset_edge_ && !was_running_ && !(s.estop_status == hal::Status::ok && open(s.estop));
    injector_silent_s_ += told_s_;
    if (s.injector_status == hal::Status::ok && s.injector.sample_ns > injector_sample_ns_ &&
        s.injector.sample_ns <= s.now_ns + 1'000'000) {
      injector_sample_ns_ = s.injector.sample_ns;
      injector_silent_s_ = std::min(
          injector_silent_s_, std::max(0.0, 1e-9 * static_cast<double>(s.now_ns - s.injector.sample_ns)));
    }
    unseen_s_ = 1e-9 * static_cast<double>(s.now_ns - s.seen_ns);
    blind_s_ = s.seen_ns > 0 && unseen_s_ > b_.stale_s + 2 * b_.nominal_s ? blind_s_ + dt : 0;
  }

  // Its buttons are those of the hand, or both contacts of a switch that has one: it is never told to be
  // squeezed. One of them that is told to be open is let go, whatever its time.
  void watch_enabling(const Seen& s) {
    if (!s.has_switch) {
      enabling_ = buttons_;
      enabling_were_ = buttons_were_;
      return;
    }
    switch_silent_s_ += told_s_;
    enabling_were_ = enabling_;
    if (s.switch_status != hal::Status::ok) {
      return;
    }
    const bool held = s.enabling.contact_a_closed && s.enabling.contact_b_closed && !s.enabling.pulse_seen;
    if (s.enabling.sample_ns != switch_sample_ns_ || !held) {
      enabling_ = held ? hal::kButtonEnable : 0;
    }
    if (!switch_known_) {
      enabling_were_ = enabling_;
    }
    if (s.enabling.sample_ns != switch_sample_ns_) {
      switch_sample_ns_ = s.enabling.sample_ns;
      switch_silent_s_ = 0;
      switch_known_ = true;
    }
  }

  // The scale may change only while hand and needle are uncoupled; when exactly is not known.
  void watch_scale(const Seen& s, bool running) {
    if (s.position_scale > 0) {
      scale_ = least_scale_;
      next_scale_ = s.position_scale;
      scale_may_change_ = false;
    }
    const bool clutched = (buttons_ & hal::kButtonClutch) != 0;
    const bool coupled = running && was_running_ && !clutched && stage_known_ && stage_told_.enabled;
    uncoupled_s_ = coupled ? 0 : uncoupled_s_ + s.elapsed_s;
    scale_may_change_ = scale_may_change_ || !coupled;
    if (uncoupled_s_ > b_.filter_s) {
      scale_ = next_scale_;
    }
    least_scale_ = scale_may_change_ ? std::min(scale_, next_scale_) : scale_;
  }

  // ---- N ----
  void numbers(const Seen& s, const TelemetrySample& t) {
    if (s.hand_writes > 0) {
      must(I::finite_writes, s.asked_N.allFinite());
    }
    if (s.commands > 0) {
      must(I::finite_writes, s.command.tip_m.allFinite() && s.command.axis.allFinite() &&
                                 std::abs(s.command.axis.norm() - 1) < 1e-6);
    }
    bool finite = std::isfinite(t.t_s);
    for (const std::span<const double> part : {std::span<const double>(t.x_m),
                                               {t.v_m_s},
                                               {t.tip_m},
                                               {t.cmd_m},
                                               {t.force_N},
                                               {t.effect_N},
                                               {t.entry_m},
                                               {t.axis},
                                               {&t.wd_m, 6}}) {
      for (const double x : part) {
        finite = finite && std::isfinite(x);
      }
    }
    for (const double x : {t.guard_N, t.obs_age_s, t.sensor_N, t.vacuum_Pa, t.stored_energy_J,
                           t.injected_energy_J, t.obs_gap_m, t.wd_sd_m, t.R_sd_m, t.tip_force_sd_N, t.obs_a_m,
                           t.obs_a_sd_m, t.E_fit_Pa, t.E_fit_sd_Pa}) {
      finite = finite && std::isfinite(x);
    }
    must(I::finite_telemetry, finite);
  }

  // ---- F, E ----
  void force(const Seen& s, const TelemetrySample& t, bool running) {
    const double f = s.asked_N.norm();
    at_most(I::force_bounded, f, b_.c.limits.hand_force_N * (1 + 1e-9));
    stop_clock_true_ = (running || stop_clock_true_) && s.clock_true;
    stop_s_ = running ? 0 : stop_s_ + (was_running_ ? 0 : s.elapsed_s);
    if (running && was_running_ && known_) {
      // A late tick may let go of what the force could have lost meanwhile, straight towards zero.
      const double size = asked_N_.norm();
      const double falls = std::min(size, b_.slew_N_s * std::max(0.0, s.elapsed_s - 2 * b_.nominal_s));
      const double kept = size > 0 ? std::clamp(s.asked_N.dot(asked_N_) / size, size - falls, size) : 0;
      at_most(I::force_slew, size > 0 ? (s.asked_N - asked_N_ * (kept / size)).norm() : f,
              b_.slew_N_s *
                      (s.clock_true ? std::clamp(s.elapsed_s, b_.nominal_s, 2 * b_.nominal_s)
                                    : 2 * b_.nominal_s) *
                      (1 + 1e-9) +
                  1e-9);
    }
    if (!running) {
      if (stop_clock_true_ && stop_s_ >= b_.c.estop.hand_ramp_s - 0.5 * b_.nominal_s) {
        at_most(I::force_gone_after_stop, f, 0);
      }
      if (known_) {
        at_most(I::force_gone_after_stop, f, asked_N_.norm() + 1e-12);
      }
    }
    if (running && !was_running_ && known_) {
      at_most(I::force_returns_from_zero, f, 1e-9);
    }
    // Forces of the cell: none once vision has been silent for long enough, none of the axis outside.
    const bool inside =
        t.phase == Phase::puncture || t.phase == Phase::injection || t.phase == Phase::withdrawal;
    const double ramp_s = std::min(s.elapsed_s, 0.02);  // one late tick moves no ramp by more
    outside_s_ = inside ? 0 : outside_s_ + ramp_s;
    faded_s_ = blind_s_ > 0 ? faded_s_ + ramp_s : 0;
    if (b_.c.local_model && faded_s_ > b_.c.local_model->fade_s + b_.brake_s) {
      at_most(I::fixtures_fade,
              t.effect_N[effect_membrane] + t.effect_N[effect_cone] + t.effect_N[effect_axis], 1e-9);
    }
    if (b_.c.axis && outside_s_ > b_.c.axis->ramp_s + b_.brake_s) {
      at_most(I::fixtures_fade, t.effect_N[effect_axis], 1e-9);
    }
    // A handle that is told to rest may rest under a steady force, and a device that refuses a force keeps
    // the last one: what is given there, and until a ramp that follows has ended, no servo can know or
    // prevent.
    unknown_s_ = s.hand_hidden || refused_ ? b_.c.estop.hand_ramp_s : unknown_s_ - s.elapsed_s;
    const bool beyond = unknown_s_ > 0;
    work_J_ += (beyond ? std::min(s.hand_work_J, 0.0) : s.hand_work_J) - b_.work_W * s.elapsed_s;
    refused_ = s.force_N != s.asked_N;
    stored_J_ = std::clamp(t.stored_energy_J, 0.0, 0.02);
    at_most(I::work_bounded, work_J_ - credit_J_, b_.work_J);
    credit_J_ = std::min(credit_J_, work_J_ + stored_J_);
  }
  void settle_work() {
    work_J_ = 0;
    credit_J_ = stored_J_;
  }

  // ---- L ----
  void latch(const Seen& s, const TelemetrySample& t, bool running) {
    if (running && !was_running_ && known_) {
      const bool may = stop_ == StopStage::stopped && s.estop_status == hal::Status::ok && !open(s.estop) &&
                       (reset_edge_ || (fault_ == Fault::enabling_released && press_edge_)) &&
                       fault_ != Fault::command_stop;
      must(I::leaves_stop_by_reset, may);
    }
    if (running) {
      must(I::first_cause_kept, t.fault == Fault::none);
    } else if (!was_running_) {
      must(I::first_cause_kept, t.fault == fault_);
    } else {
      must(I::first_cause_kept, t.fault != Fault::none);
    }
    if (s.estop_status == hal::Status::ok && open(s.estop)) {
      must(I::stops_on_estop, !running && s.quick_stops > 0 && !s.gate);
    }
    const double two = 2 * b_.nominal_s + std::max(s.elapsed_s, last_elapsed_s_);
    if (hand_known_ && hand_silent_s_ > b_.c.hand_timeout_s + two) {
      must(I::stops_on_silence, !running, hand_silent_s_);
    }
    if (stage_known_ && stage_silent_s_ > b_.c.stage_timeout_s + two) {
      must(I::stops_on_silence, !running, stage_silent_s_);
    }
    if (estop_silent_s_ > 0.05 + two) {
      must(I::stops_on_silence, !running, estop_silent_s_);
    }
    if (switch_known_ && switch_silent_s_ > 0.05 + two) {
      must(I::stops_on_silence, !running, switch_silent_s_);
    }
    commanded_ticks_ = s.stop_commanded || commanded_ticks_ > 0 ? commanded_ticks_ + 1 : 0;
    if (commanded_ticks_ > 2) {
      must(I::stops_on_command, !running);
    }
    if (b_.c.enabling) {
      enabling(s, running, two);
    }
    // A quick stop on the tick of the stop or on the next.
    if (running) {
      since_stop_ = 0;
      quick_stopped_ = false;
    } else {
      ++since_stop_;
      quick_stopped_ = quick_stopped_ || s.quick_stops > 0;
      if (since_stop_ >= 2) {
        must(I::quick_stop_in_time, quick_stopped_);
      }
    }
    // Drive power: gone at the limit, never while the needle still brakes.
    if (!running && stop_clock_true_ && stop_s_ > b_.c.estop.power_off_after_s + two) {
      must(I::power_off_in_time, !s.power);
    }
    if (!s.power && power_ && known_ && stop_clock_true_) {
      must(I::power_off_in_time, !running && (stage_told_.at_standstill ||
                                              stop_s_ >= b_.c.estop.power_off_after_s - 2 * b_.nominal_s));
    }
    if (s.power && !power_ && known_) {
      must(I::power_off_in_time, running);
    }
    must(I::power_off_in_time, s.enable_line == s.power);
  }

  void enabling(const Seen& s, bool running, double two_ticks_s) {
    const auto squeezed = [](std::uint32_t buttons) { return (buttons & hal::kButtonPanic) != 0; };
    const auto enable = [](std::uint32_t buttons) { return (buttons & hal::kButtonEnable) != 0; };
    const bool held = enable(enabling_) && !squeezed(enabling_);
    const bool press = held && !enable(enabling_were_) && !squeezed(enabling_were_);
    // A press that began in the stop counts as soon as its sample is believed.
    pressed_ = running && (press || (was_running_ ? pressed_ : press_edge_));
    if (running && !pressed_) {
      must(I::waits_for_enabling, !s.power && s.commands == 0 && s.asked_N.norm() == 0);
    }
    // A sample that is not believed may be the one that tells it: the hand is silent then.
    // A press in the stop before is one that the core may believe or not: without it the station does
    // nothing.
    const bool acts = s.power || s.commands != 0 || s.asked_N.norm() != 0;
    const bool on = running && was_running_ && pressed_ && acts;
    // A contact that chatters counts: being held makes up for a tenth.
    let_go_s_ = on ? std::max(let_go_s_ + (held ? -0.1 : 1.0) * s.elapsed_s, 0.0) : 0;
    squeezed_s_ = on && squeezed(enabling_) ? squeezed_s_ + s.elapsed_s : 0;
    const double unseen_s = (s.has_switch ? b_.switch_timeout_s : b_.c.hand_timeout_s) + two_ticks_s;
    at_most(I::stops_when_let_go, let_go_s_, b_.c.enabling->release_s + unseen_s);
    at_most(I::stops_when_let_go, squeezed_s_, unseen_s);
  }

  // ---- M ----
  void motion(const Seen& s, const TelemetrySample& t, bool running) {
    const Vec3 axis = -Vec3::UnitX();
    const bool clutched = (buttons_ & hal::kButtonClutch) != 0 || (buttons_were_ & hal::kButtonClutch) != 0;
    const Vec3 hand_way = world_from_hand(s.hand_true_m - hand_m_) / least_scale_;
    const bool coupled = running && was_running_ && !clutched;
    // Once the clutch has lasted, the needle goes no way until hand and needle are coupled again.
    const bool settled = clutched_s_ > b_.filter_s;
    clutched_s_ = clutched ? clutched_s_ + s.elapsed_s : 0;
    if (!running || (!settled && clutched_s_ > b_.filter_s)) {
      settle_paths();
    } else if (known_ && !clutched) {
      hand_path_m_ += hand_way.norm();
      if (blind_s_ == 0) {
        hand_inward_m_ += std::max(0.0, hand_way.dot(axis));
      }
    }
    // A false reading moves the needle by a little at most while it is brief; one that stays is a motion.
    const double false_m = s.hand_false_m / least_scale_;
    if (false_m != false_m_) {
      false_for_s_ = 0;
      false_paid_m_ = 0;
    }
    false_for_s_ += s.elapsed_s;
    if (false_m != false_m_ || false_for_s_ > b_.brief_s) {
      const double change_m = std::abs(false_m - (false_m != false_m_ ? false_m_ : 0.0));
      const double due_m = false_for_s_ > b_.brief_s && false_m != 0 ? 2 * std::abs(false_m)
                                                                     : std::min(change_m, b_.false_motion_m);
      if (due_m > false_paid_m_) {
        false_path_m_ += due_m - false_paid_m_;
        false_paid_m_ = due_m;
      }
    }
    if (s.commands == 0) {
      way_known_ = sent_known_ = sent_known_ && coupled;
    } else {
      must(I::no_set_point_in_stop, running);
      const Vec3& p = s.command.tip_m;
      if (b_.c.forbidden) {
        region_room_m_ -= b_.nearer_m;
        if (!sent_known_ || region_room_m_ <= 0) {
          region_room_m_ = to_regions_m(*b_.c.forbidden, p, s.command.axis);
          inside_m_ = std::min(sent_known_ ? std::max(inside_m_, region_room_m_) : region_room_m_, 0.0);
          at_most(I::outside_regions, inside_m_ - region_room_m_, b_.region_m);
        }
      }
      if (!sent_known_) {
        if (stage_known_) {
          false_start_m_ = std::min((stage_told_.tip_m - s.tip_true_m).norm(), b_.settles_m);
          // Hand and needle are coupled on this tick, or by the reset on the tick before.
          at_most(I::begins_at_the_needle,
                  std::min((p - stage_told_.tip_m).norm(), (p - stage_told_before_m_).norm()), 1e-6);
        }
        settle_paths();
        way_known_ = false;
      } else {
        const Vec3 way = p - sent_m_;
        const double length = way.norm();
        path_m_ += length;
        inward_m_ += std::max(0.0, way.dot(axis));
        const double extra = false_path_m_ + b_.path_slack_m;
        at_most(I::moves_with_the_hand, path_m_ - b_.overshoot * hand_path_m_, extra);
        // A filter that overshoots on the way out comes back in by a part of that way.
        at_most(I::deeper_by_the_hand, inward_m_ - hand_inward_m_ - (b_.overshoot - 1) * hand_path_m_, extra);
        at_most(I::speed_bounded, length, b_.c.limits.stage_velocity_m_s * b_.nominal_s * (1 + 1e-6));
        regular_ =
            s.clock_true && std::abs(s.elapsed_s - b_.nominal_s) < 0.01 * b_.nominal_s ? regular_ + 1 : 0;
        if (way_known_ && regular_ >= 2) {
          const double gain = (length - way_m_.norm()) / b_.nominal_s / b_.nominal_s;
          at_most(I::acceleration_bounded, gain, b_.c.limits.stage_acceleration_m_s2 * 1.02 + 1e-6);
          // A position limit may stop the needle at once: nothing is left of its way across that limit.
          const double most = b_.c.limits.stage_acceleration_m_s2 * 1.02;
          Vec3 a = (way - way_m_) / b_.nominal_s / b_.nominal_s;
          bool held = std::abs(way.dot(a)) <= 0.01 * std::abs(way_m_.dot(a));
          // A curved limit takes it along a direction that only its alarm tells.
          held = held || (t.alarms & (alarm_depth_limited | alarm_tip_force | alarm_forbidden_region)) != 0;
          for (int i = 0; i < 3; ++i) {
            held = held || (std::abs(way[i]) <= 1e-12 && std::abs(way_m_[i]) > 1e-12);
          }
          if (!held) {
            at_most(I::acceleration_bounded, a.norm(), most + 1e-6);
          }
          if (held) {
            a.setConstant(std::numeric_limits<double>::infinity());
          }
          if (regular_ >= 3 && a.norm() < most && a_m_s2_.norm() < most && length > 0 && way_m_.norm() > 0) {
            at_most(I::jerk_bounded, (a - a_m_s2_).norm() / b_.nominal_s, b_.c.limits.stage_jerk_m_s3 * 1.1);
          }
          a_m_s2_ = a;
        } else {
          a_m_s2_.setConstant(std::numeric_limits<double>::infinity());
        }
        // All of it together: what is left of braking is less than a tenth of a micrometre.
        blind_way_m_ = blind_s_ > b_.brake_s
                           ? blind_way_m_ + std::max(0.0, way.dot(axis)) + (way - way.dot(axis) * axis).norm()
                           : 0;
        at_most(I::blind_only_outwards, blind_way_m_, 0.1e-6);
        if (stage_known_ && !stage_told_.enabled && unpowered_ticks_ >= 2) {
          at_most(I::no_motion_unpowered, length, 1e-9);
        }
        // Inside the travel, or no further outside.
        for (int i = 0; i < 3; ++i) {
          const double low = std::min(b_.c.mapping.workspace_min_m[i], sent_m_[i]);
          const double high = std::max(b_.c.mapping.workspace_max_m[i], sent_m_[i]);
          at_most(I::inside_workspace, std::max(p[i] - high, low - p[i]), 1e-9);
        }
        way_m_ = way;
        way_known_ = true;
      }
      sent_m_ = p;
      sent_known_ = true;
    }
    unpowered_ticks_ = stage_known_ && !stage_told_.enabled ? unpowered_ticks_ + 1 : 0;
    hand_m_ = s.hand_true_m;
    false_m_ = false_m;

    // Depth by the needle's true place, from where the core first said contact. The needle has to come out
    // before another contact counts as first.
    if (t.phase == Phase::contact && phase_ != Phase::contact && !touched_) {
      touched_ = true;
      first_contact_m_ = s.tip_true_m;
    }
    const double depth = touched_ ? (s.tip_true_m - first_contact_m_).dot(axis) : 0;
    if (touched_ && (depth < -1e-6 || t.cell != cell_)) {
      touched_ = false;
    }
    if (s.depth_limit_m > 0) {
      depth_ramp_s_ = b_.ramp_s;
      asked_depth_m_ = s.depth_limit_m;
      depth_limit_m_ = std::max(depth_limit_m_, asked_depth_m_);
    }
    depth_ramp_s_ -= told_s_;
    if (!touched_ && depth_ramp_s_ <= 0) {
      depth_limit_m_ = asked_depth_m_;
    }
    if (touched_ && s.stage_true) {
      // A commanded limit holds from where the needle is once the command's ramp has ended; vision moves it
      // by no more than its sum.
      depth_limit_m_ =
          depth_ramp_s_ > 0 ? depth_limit_m_ : std::max(asked_depth_m_, std::min(depth_limit_m_, depth));
      at_most(I::depth_bounded, depth, depth_limit_m_ + b_.vision_sum_m + b_.truth_m);
    }
    const bool inside =
        t.phase == Phase::puncture || t.phase == Phase::injection || t.phase == Phase::withdrawal;
    if (inside && !inside_) {
      entered_m_ = s.tip_true_m;
    }
    if (inside && s.stage_true) {
      const Vec3 off = s.tip_true_m - entered_m_;
      at_most(I::lateral_bounded, (off - off.dot(axis) * axis).norm(), b_.lateral_m + false_start_m_);
    }
    inside_ = inside;
  }
  void settle_paths() { path_m_ = inward_m_ = hand_path_m_ = hand_inward_m_ = false_path_m_ = 0; }

  // ---- vision's corrections ----
  void vision(const Seen& s, const TelemetrySample& t) {
    const bool in = t.phase != Phase::free && t.phase != Phase::clear;
    const Vec3 entry(t.entry_m[0], t.entry_m[1], t.entry_m[2]);
    if (in && entry_known_ && t.cell == cell_ && b_.c.local_model) {
      const double dt = s.clock_true ? std::min(s.elapsed_s, 0.02) : 0.02;
      at_most(I::vision_rate, (entry - entry_m_).norm(),
              2 * b_.c.local_model->max_rate_m_s * std::max(dt, b_.nominal_s) * 1.01 + 1e-9);
      const double this_touch_m = (entry - first_entry_m_).norm();
      const double all_m = (entry - contact_entry_m_).norm();
      at_most(I::vision_sum, surely_near_ ? all_m : std::min(this_touch_m, all_m), b_.vision_sum_m);
    }
    if (!in || !entry_known_) {
      first_entry_m_ = entry;
      contact_entry_m_ = near_contact_ ? contact_entry_m_ : entry;
    }
    // A needle that leaves the cell by less than clear_um and comes back touches it for the first time no
    // more.
    if (in && !near_contact_) {
      touched_at_m_ = stage_told_.tip_m;
      touched_axis_ = stage_told_.axis.normalized();
      surely_near_ = true;
    }
    const double out_m = (stage_told_.tip_m - touched_at_m_).x();
    near_contact_ = in || (near_contact_ && t.cell == cell_ && out_m < b_.clear_m + b_.clear_known_m);
    // In a stop the needle may be mounted otherwise: what it would enter then is another place.
    const bool turned = (stage_told_.axis.normalized() - touched_axis_).norm() > b_.remounted;
    near_contact_ = near_contact_ && !(!in && turned && t.stop != StopStage::running);
    surely_near_ = surely_near_ && near_contact_ && (in || out_m < b_.clear_m - b_.clear_known_m);
    entry_known_ = in;
    entry_m_ = entry;
  }

  // ---- G ----
  void gate(const Seen& s, const TelemetrySample& t, bool running) {
    const bool pressed = (buttons_ & hal::kButtonInject) != 0;
    const bool was_pressed = (buttons_were_ & hal::kButtonInject) != 0;
    const bool within = t.phase == Phase::puncture || t.phase == Phase::injection;
    const bool was_within = phase_ == Phase::puncture || phase_ == Phase::injection;
    if (pressed && !was_pressed) {
      own_press_ = within && was_within;
      openings_ = 0;
    }
    if (!pressed || !within) {
      own_press_ = false;
    }
    if (t.cell != cell_ || (known_ && t.phase == Phase::free)) {
      open_in_cell_s_ = 0;
    }
    if (s.gate) {
      must(I::gate_in_phase, t.phase == Phase::injection);
      must(I::gate_shut_in_stop, running);
      if (s.seen_ns > 0) {
        must(I::gate_seen, unseen_s_ <= b_.stale_s + 2 * b_.nominal_s + 1e-9, unseen_s_);
      }
      if (b_.c.injector) {
        at_most(I::gate_answered, injector_silent_s_, b_.injector_silent_s + 2 * b_.nominal_s);
      }
      if (!gate_) {
        must(I::gate_own_press, own_press_);
        ++openings_;
        at_most(I::gate_one_opening, openings_, 1);
        open_s_ = b_.nominal_s;
      } else {
        open_s_ += s.elapsed_s;
      }
      open_in_cell_s_ += told_s_;
      if (b_.c.injector) {
        at_most(I::gate_time, open_in_cell_s_,
                b_.c.injector->max_open_s + std::max(s.elapsed_s, b_.nominal_s) + 1e-9);
      }
    } else if (gate_ && open_s_ < b_.shortest_opening_s - 0.5 * b_.nominal_s) {
      const bool cause =
          !s.clock_true || !running || t.phase != Phase::injection || s.ending ||
          (t.alarms & alarm_vision_stale) != 0 || injector_silent_s_ > b_.injector_silent_s - b_.nominal_s ||
          (b_.c.injector && open_in_cell_s_ + s.elapsed_s + b_.nominal_s >= b_.c.injector->max_open_s);
      must(I::gate_not_cut_short, cause, open_s_);
    }
  }

  // ---- H ----
  void relay(const Seen& s, const TelemetrySample& t, bool running) {
    // From the first tick on that can know it: in a stall nobody toggles the level either.
    const auto count = [&s](double& lost_s, bool lost) {
      lost_s = !lost ? -1 : lost_s < 0 ? 0 : lost_s + s.elapsed_s;
    };
    count(stage_lost_s_, stage_known_ && stage_silent_s_ > b_.c.stage_timeout_s);
    count(estop_lost_s_, estop_silent_s_ > 0.05);
    const bool toggled = known_ && s.level != level_;
    force_lost_s_ = s.force_N == s.asked_N ? 0 : force_lost_s_ + (s.clock_true ? s.elapsed_s : 0);
    if (toggled) {
      at_most(I::relay_hand_obeys, force_lost_s_ - b_.c.hand_timeout_s, b_.relay_s);
      const double stop_takes_s = b_.c.estop.power_off_after_s + b_.relay_s;
      at_most(I::relay_inputs_fresh, stage_lost_s_, stop_takes_s);
      at_most(I::relay_inputs_fresh, estop_lost_s_, stop_takes_s);
      if (t.stop == StopStage::stopped) {  // a reset makes a new beginning
        at_most(I::relay_stage_obeys, powered_s_, 0.1 + b_.relay_s);
        at_most(I::relay_stage_obeys, moves_s_, 0.25 + b_.relay_s);
        at_most(I::relay_stage_obeys, away_s_, b_.relay_s);
      }
      if (running) {
        at_most(I::relay_stage_obeys, idle_powered_s_, b_.c.estop.power_off_after_s + 0.1 + b_.relay_s);
      }
      must(I::relay_off_when_distrusted, !(t.stop == StopStage::stopped && stop_ == StopStage::stopped &&
                                           asks_for(t.fault, SafetyAction::heartbeat_off)));
    }
    // It was stopped and its power was taken: it has power, or the needle moves, or has gone away. A needle
    // that moves where it is told to stand still can be known only by its power.
    const bool stopped = t.stop == StopStage::stopped && stop_ == StopStage::stopped;
    left_m_ = stopped ? left_m_ : stage_told_.tip_m;
    const bool told_true = (stage_told_.tip_m - s.tip_true_m).norm() < 1e-6;
    powered_s_ = stopped && stage_new_ && stage_told_.powered ? powered_s_ + s.elapsed_s : 0;
    moves_s_ = stopped && s.stage_moves && told_true ? moves_s_ + s.elapsed_s : 0;
    away_s_ = stopped && (stage_told_.tip_m - left_m_).norm() > b_.settles_m ? away_s_ + s.elapsed_s : 0;
    // Nobody has enabled it, and it has power.
    const bool idle = b_.c.enabling && running && was_running_ && !pressed_;
    idle_powered_s_ = idle && stage_new_ && stage_told_.powered ? idle_powered_s_ + s.elapsed_s : 0;
    still_ticks_ = toggled || !running ? 0 : still_ticks_ + 1;
    at_most(I::relay_alive, still_ticks_, 10);
  }

  // ---- P ----
  void phase(const Seen& s, const TelemetrySample& t) {
    const int p = static_cast<int>(phase_);
    const int n = static_cast<int>(t.phase);
    if (known_ && n != p) {
      const bool forth = n == p + 1 || (phase_ == Phase::puncture && t.phase == Phase::withdrawal) ||
                         (phase_ == Phase::clear && t.phase == Phase::free);
      const bool back = (phase_ == Phase::contact || phase_ == Phase::indentation) && n < p;
      must(I::phase_order, forth || back, p + 0.1 * n);
    }
    if (s.finished) {
      must(I::over_at_rest, s.asked_N.norm() == 0 && !s.gate);
    }
    if (t.phase == Phase::free || t.phase == Phase::clear) {
      punctured_frames_ = inner_punctured_frames_ = 0;
    }
    punctured_frames_ += s.punctured_frames;
    inner_punctured_frames_ += s.inner_punctured_frames;
    if (b_.c.inner_membrane && known_ && t.phase == Phase::injection && phase_ != Phase::injection) {
      at_most(I::injects_inside, b_.punctured_frames - inner_punctured_frames_, 0);
    }
    if (known_ && t.phase == Phase::puncture && phase_ != Phase::puncture) {
      at_most(I::puncture_confirmed, b_.punctured_frames - punctured_frames_, 0);
    }
  }

  void remember(const Seen& s, const TelemetrySample& t, bool running) {
    known_ = true;
    last_elapsed_s_ = s.elapsed_s;
    was_running_ = running;
    stop_ = t.stop;
    fault_ = t.fault;
    phase_ = t.phase;
    cell_ = t.cell;
    asked_N_ = s.asked_N;
    gate_ = s.gate;
    power_ = s.power;
    level_ = s.level;
  }

  Bounds b_;
  int tick_ = 0;
  std::array<Broken, kInvariants> broken_{};
  std::size_t broken_count_ = 0;
  std::array<bool, kInvariants> was_broken_{};
  std::array<double, kInvariants> largest_{};

  // The last tick.
  bool known_ = false, was_running_ = true;
  StopStage stop_ = StopStage::running;
  Fault fault_ = Fault::none;
  Phase phase_ = Phase::free;
  std::uint32_t cell_ = 0;
  Vec3 asked_N_ = Vec3::Zero();
  bool gate_ = false, power_ = false, level_ = false;
  double last_elapsed_s_ = 0;

  // What was told.
  bool hand_known_ = false, stage_known_ = false, stage_new_ = false;
  std::int64_t hand_sample_ns_ = -1, stage_sample_ns_ = -1, estop_sample_ns_ = -1;
  double told_s_ = 0;  // of this tick, as the servo may count it
  double hand_silent_s_ = 0, stage_silent_s_ = 0, estop_silent_s_ = 0;
  std::uint32_t buttons_ = 0, buttons_were_ = 0;
  std::uint32_t enabling_ = 0, enabling_were_ = 0;
  bool switch_known_ = false;
  std::int64_t switch_sample_ns_ = -1;
  double switch_silent_s_ = 0;
  hal::StageState stage_told_;
  Vec3 stage_told_before_m_ = Vec3::Zero();
  bool reset_ = true, reset_edge_ = false;
  bool press_edge_ = false;  // of the enabling device, in this stop
  double unseen_s_ = 0, blind_s_ = 0;
  std::int64_t injector_sample_ns_ = 0;
  double injector_silent_s_ = 0;

  double stop_s_ = 0, work_J_ = 0, credit_J_ = 0, stored_J_ = 0;
  bool stop_clock_true_ = true;
  double unknown_s_ = 0;
  double force_lost_s_ = 0;  // for so long another force has acted than was written
  bool refused_ = false;     // the force that acts is not the one that was written
  double outside_s_ = 0, faded_s_ = 0;
  int commanded_ticks_ = 0, since_stop_ = 0;
  bool quick_stopped_ = false;

  double scale_ = b_.c.mapping.position_scale, next_scale_ = scale_, least_scale_ = scale_;
  double uncoupled_s_ = 0;
  bool scale_may_change_ = true;
  double region_room_m_ = 0, inside_m_ = 0;
  // L8, L9: a press of the enabling device that began after the start, or after the last stop.
  bool pressed_ = false;
  double let_go_s_ = 0, squeezed_s_ = 0;

  double path_m_ = 0, inward_m_ = 0, hand_path_m_ = 0, hand_inward_m_ = 0;
  double clutched_s_ = 0;
  double false_path_m_ = 0, false_m_ = 0, false_for_s_ = 0, false_paid_m_ = 0;
  Vec3 hand_m_ = Vec3::Zero(), sent_m_ = Vec3::Zero(), way_m_ = Vec3::Zero();
  bool sent_known_ = false, way_known_ = false;
  int regular_ = 0, unpowered_ticks_ = 0;
  double blind_way_m_ = 0;
  Vec3 a_m_s2_ = Vec3::Zero();
  bool touched_ = false, inside_ = false;
  // Where the needle was told to be when its motion began: without power it may have gone there.
  double false_start_m_ = 0;
  double asked_depth_m_ = b_.c.limits.penetration_depth_m, depth_limit_m_ = asked_depth_m_, depth_ramp_s_ = 0;
  Vec3 first_contact_m_ = Vec3::Zero(), entered_m_ = Vec3::Zero();

  bool entry_known_ = false;
  bool near_contact_ = false, surely_near_ = false;
  Vec3 contact_entry_m_ = Vec3::Zero(), touched_at_m_ = Vec3::Zero(), touched_axis_ = Vec3::Zero();
  Vec3 entry_m_ = Vec3::Zero(), first_entry_m_ = Vec3::Zero();

  bool own_press_ = false;
  int openings_ = 0;
  double open_s_ = 0, open_in_cell_s_ = 0;
  double powered_s_ = 0, moves_s_ = 0, away_s_ = 0, idle_powered_s_ = 0;
  Vec3 left_m_ = Vec3::Zero();                    // where the needle was told to be when its power went
  double stage_lost_s_ = -1, estop_lost_s_ = -1;  // < 0: not
  int still_ticks_ = 0;
  int punctured_frames_ = 0, inner_punctured_frames_ = 0;
};

}  // namespace punctum::rt::test
