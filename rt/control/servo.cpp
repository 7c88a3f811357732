#include "rt/control/servo.hpp"

#include <algorithm>
#include <cmath>

#include "rt/control/frames.hpp"
#include "rt/station/station.hpp"

namespace punctum::rt {
namespace {

constexpr double kLongestStep_s = 0.02;  // what one late tick may advance ramps and filters by
constexpr double kShortestStep =
    0.1;  // of the nominal period: no two ticks are nearer, whatever the clock says
constexpr double kLongestStageStep =
    2;                                  // of it: a late tick moves the set-point no further, it makes no leap
constexpr double kFallSilent_s = 0.02;  // e-stop chain without data for longer: estop_lost
constexpr double kDecouple_s = 0.05;    // forces fade over this when the clutch is pressed or the run ends
constexpr double kOutwardTau_s = 0.03;  // low-pass of the tip's speed
constexpr double kSensorTau_s = 0.005;
constexpr double kSensorTimeout_s = 0.1;
constexpr double kSoftHysteresis = 0.9;    // of the soft tip-force limit
constexpr double kForceScaleRate_1_s = 2;  // of the command force_scale
constexpr double kRounding_s = 1e-9;
constexpr double kStiffnessKept = 0.9;  // of the commanded one; less raises an alarm
constexpr int kCommandsPerTick = 8;

[[nodiscard]] bool is_finite(const hal::Vec3& v) noexcept {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}
[[nodiscard]] bool is_unit(const hal::Vec3& v) noexcept { return std::abs(v.squaredNorm() - 1) < 1e-3; }

[[nodiscard]] Fault first_of(Fault a, Fault b) noexcept { return a != Fault::none ? a : b; }

void copy(double (&to)[3], const hal::Vec3& from) noexcept {
  for (Eigen::Index i = 0; i < 3; ++i) to[i] = from[i];
}

}  // namespace

Servo::Servo(const ServoConfig& config, const Devices& devices, Station& station, bool degraded) noexcept
    : config_(config),
      devices_(devices),
      station_(station),
      degraded_(degraded),
      mapping_(config.mapping),
      stage_limits_(config.limits, config.mapping),
      latch_(config.estop),
      following_(config.stage_timeout_s) {
  if (config.velocity.method == VelocityParams::Method::foaw) {
    foaw_.emplace(at_rate(config.velocity, config.rate_Hz));
  } else {
    kalman_.emplace(config.velocity, 1 / config.rate_Hz);
  }
  if (config.membrane) membrane_.emplace(*config.membrane);
  if (config.cone) cone_.emplace(*config.cone, config.mapping.position_scale);
  if (config.axis) axis_.emplace(*config.axis, config.mapping.position_scale);
  if (config.damping) damping_.emplace(*config.damping);
  if (config.guard) {
    guard_.emplace(*config.guard, config.device, config.velocity, config.rate_Hz);
  }
  if (config.repulsive) repulsive_.emplace(*config.repulsive, config.mapping.position_scale);
  if (config.friction) friction_.emplace(*config.friction);
  if (config.vibration) vibration_.emplace(*config.vibration, config.device.delay_ticks);
  if (config.phases) phases_.emplace(*config.phases);
  if (config.vision && config.local_model) {
    const MembraneParams membrane = config.membrane.value_or(MembraneParams{});
    model_.emplace(*config.local_model, membrane.c_m, membrane.R_m);
  }
}

// One tick of the servo.
void Servo::tick(const TickInfo& now) noexcept {
  begin(now);
  Fault cause = read_devices(now);
  take_newest_observation();
  estimate_velocity();
  advance_phase();
  const hal::Vec3 wanted_N = sum_force_effects();
  cause = first_of(cause, limit_force(keep_passive(wanted_N)));
  latch(cause);
  choose_stage_set_point();
  write_devices();
  publish(now);
}

Outcome Servo::outcome() const noexcept {
  if (latch_.stage() == StopStage::stopped) {
    const bool for_good =
        stop_requested_ || !devices_.estop || safety_rule(latch_.cause()).cleared_by == ClearedBy::never;
    return for_good ? Outcome::fault : Outcome::running;
  }
  const bool at_rest = presence_.at() == 0 && (!devices_.stage || stage_.at_standstill);
  if (latch_.stage() == StopStage::running && ending() && at_rest) {
    return task_done() ? Outcome::done : Outcome::ended;
  }
  return Outcome::running;
}

void Servo::begin(const TickInfo& now) noexcept {
  if (ticks_++ == 0) first_release_ns_ = now.release_ns;
  const bool sane = std::isfinite(now.period_s) && now.period_s > 0;
  const double nominal_s = 1 / config_.rate_Hz;
  elapsed_s_ = sane ? std::max(now.period_s, kShortestStep * nominal_s) : nominal_s;
  dt_s_ = std::min(elapsed_s_, kLongestStep_s);
  now_ns_ = now.start_ns;
  alarms_ = degraded_ ? alarm_degraded : 0U;
  const double way = force_scale_wanted_ - force_scale_;
  force_scale_ += std::clamp(way, -kForceScaleRate_1_s * dt_s_, kForceScaleRate_1_s * dt_s_);
}

// ---- read devices ----

Fault Servo::read_devices(const TickInfo& now) noexcept {
  // The most urgent cause first; every device is read on every tick.
  Fault cause = read_estop();
  cause = first_of(cause, take_commands());
  cause = first_of(cause, read_hand());
  cause = first_of(cause, read_stage());
  cause = first_of(cause, read_vacuum());
  cause = first_of(cause, read_injector());
  cause = first_of(cause, check_overruns(now));
  cause = first_of(cause, write_fault_);
  read_force_sensor();
  follow_hand();
  return cause;
}

Fault Servo::read_estop() noexcept {
  if (!devices_.estop) return Fault::none;
  hal::EstopState read;
  const hal::Status status = devices_.estop->read(read);
  estop_readable_ = status == hal::Status::ok;
  if (!estop_readable_) {
    alarms_ |= alarm_sensor;
    since_estop_s_ += elapsed_s_;
    if (status != hal::Status::no_data || since_estop_s_ > kFallSilent_s) return Fault::estop_lost;
  } else {
    since_estop_s_ = 0;
    estop_ = read;
  }
  const bool a = estop_.contact_a_closed;
  const bool b = estop_.contact_b_closed;
  differing_s_ = a != b ? differing_s_ + elapsed_s_ : 0;
  if (differing_s_ > config_.estop.discrepancy_s) discrepancy_ = true;
  if (!a && !b) discrepancy_ = false;  // both contacts have shown that they open
  if (!a || !b || (estop_readable_ && estop_.pulse_seen)) {
    if (discrepancy_) faults_latched_ |= 1ULL << static_cast<unsigned>(Fault::estop_discrepancy);
    return Fault::estop;
  }
  return discrepancy_ ? Fault::estop_discrepancy : Fault::none;
}

Fault Servo::read_hand() noexcept {
  hal::HandState read;
  const hal::Status status = devices_.hand.read(read);
  since_hand_s_ += elapsed_s_;
  hand_fresh_ = false;
  if (status != hal::Status::ok) {
    alarms_ |= alarm_sensor;
    const bool lost = status != hal::Status::no_data || since_hand_s_ > config_.hand_timeout_s;
    return lost ? Fault::hand_lost : Fault::none;
  }
  const double possible_m = config_.hand_jump_m * (since_hand_s_ / 1e-3);
  const bool finite = is_finite(read.position_m) && read.orientation.coeffs().allFinite();
  const bool jumped = finite && hand_seen_ &&
                      (!((read.position_m - hand_.position_m).norm() <= possible_m) ||
                       hand_watch_.leaps(read.position_m, config_.hand_timeout_s, since_hand_s_));
  if (!finite || jumped) {
    alarms_ |= alarm_sensor;
    hand_.buttons = 0;
    return Fault::hand_invalid;
  }
  hand_watch_.step(read.position_m, hand_force_N_, since_hand_s_);
  if (hand_watch_.stuck()) alarms_ |= alarm_sensor;
  hand_ = read;
  hand_seen_ = true;
  hand_fresh_ = true;
  between_hand_s_ = since_hand_s_;
  since_hand_s_ = 0;
  return Fault::none;
}

Fault Servo::read_stage() noexcept {
  if (!devices_.stage) return Fault::none;
  hal::StageState read;
  const hal::Status status = devices_.stage->read(read);
  since_stage_s_ += elapsed_s_;
  following_.step(elapsed_s_);
  stage_fresh_ = false;
  if (status != hal::Status::ok) {
    alarms_ |= alarm_sensor;
    if (status == hal::Status::fault) return Fault::stage_fault;
    const bool lost = status == hal::Status::disconnected || since_stage_s_ > config_.stage_timeout_s;
    return lost ? Fault::stage_lost : Fault::none;
  }
  if (!is_finite(read.tip_m) || !is_finite(read.following_error_m) || !is_finite(read.axis) ||
      !is_unit(read.axis)) {
    alarms_ |= alarm_sensor;
    return Fault::stage_fault;
  }
  stage_ = read;
  stage_seen_ = true;
  stage_fresh_ = true;
  since_stage_s_ = 0;
  if (latch_.stage() != StopStage::running) {
    stage_was_enabled_ = false;
    return Fault::none;
  }
  if (stage_was_enabled_ && !stage_.enabled) return Fault::stage_fault;  // power went without being asked
  stage_was_enabled_ = stage_.enabled;
  // By the drive's own word, and by what it was sent and is read back.
  const double error_m = std::max(stage_.following_error_m.norm(), following_.error_m(stage_.tip_m));
  const bool follows = error_m <= config_.limits.following_error_m;
  return stage_.enabled && !follows ? Fault::stage_following : Fault::none;
}

Fault Servo::read_vacuum() noexcept {
  if (!devices_.vacuum || !config_.vacuum) return Fault::none;
  double pressure_Pa = 0;
  const bool read = devices_.vacuum->read(pressure_Pa) == hal::Status::ok && std::isfinite(pressure_Pa);
  if (read) {
    const bool same = pressure_Pa == vacuum_Pa_;
    vacuum_still_s_ = same ? vacuum_still_s_ + elapsed_s_ : 0;
    vacuum_Pa_ = pressure_Pa;
  }
  const double still_s = config_.vacuum->still_s;
  if (!read || (still_s > 0 && vacuum_still_s_ > still_s)) alarms_ |= alarm_sensor;
  const bool holds = read && pressure_Pa >= config_.vacuum->min_Pa;
  vacuum_low_s_ = holds ? 0 : vacuum_low_s_ + elapsed_s_;
  const bool between_cells = phase() == Phase::clear;
  return vacuum_low_s_ > config_.vacuum->window_s && !between_cells ? Fault::vacuum_lost : Fault::none;
}

Fault Servo::check_overruns(const TickInfo& now) noexcept {
  if (now.missed_in_window <= static_cast<std::uint64_t>(config_.overrun_limit)) return Fault::none;
  if (config_.real_actuators) return Fault::overrun;
  alarms_ |= alarm_overrun;
  return Fault::none;
}

Fault Servo::take_commands() noexcept {
  Command command;
  for (int i = 0; i < kCommandsPerTick && station_.commands.try_pop(command); ++i) {
    switch (command.kind) {
      case Command::stop:
        stop_requested_ = true;
        break;
      case Command::end:
        end_requested_ = true;
        break;
      case Command::force_scale:
        if (command.value >= 0 && command.value <= 1) {
          force_scale_wanted_ = command.value;
        } else {
          ++commands_refused_;
        }
        break;
      default:
        ++commands_refused_;
        break;
    }
  }
  return stop_requested_ ? Fault::command_stop : Fault::none;
}

Fault Servo::read_injector() noexcept {
  if (!devices_.injector || !config_.injector) return Fault::none;
  bool open = false;
  if (devices_.injector->read(open) == hal::Status::ok) {
    injector_open_ = open;
    if (open && gate_open_) injected_ = true;
  } else {
    alarms_ |= alarm_sensor;
  }
  open_unasked_s_ = injector_open_ && !gate_open_ ? open_unasked_s_ + elapsed_s_ : 0;
  return open_unasked_s_ > config_.injector->shut_within_s ? Fault::injector_open : Fault::none;
}

void Servo::read_force_sensor() noexcept {
  if (!devices_.force_sensor || !config_.force_sensor) return;
  double axial_N = 0;
  if (devices_.force_sensor->read(axial_N) != hal::Status::ok || !std::isfinite(axial_N)) {
    alarms_ |= alarm_sensor;
    since_sensor_s_ += elapsed_s_;
    return;
  }
  sensor_N_ = axial_N;
  const double part = sensor_seen_ ? 1 - std::exp(-dt_s_ / kSensorTau_s) : 1.0;
  sensor_filtered_N_ += part * (axial_N - sensor_filtered_N_);
  sensor_seen_ = true;
  since_sensor_s_ = 0;
}

void Servo::anchor(const hal::Vec3& tip_m, const hal::Vec3& axis) noexcept {
  mapping_.anchor(hand_, tip_m, axis);
  stage_limits_.restart(tip_m, axis);
}

// The hand at needle scale. Until the stage holds its position, and while a stop is latched, they are not
// coupled.
void Servo::follow_hand() noexcept {
  if (!hand_seen_ || (devices_.stage && !stage_seen_)) return;
  const bool holding = latch_.stage() == StopStage::running && (!devices_.stage || stage_.enabled);
  if (!holding || !mapping_.anchored()) {
    anchor(stage_.tip_m, stage_.axis);
    following_.restart();
    return;
  }
  if ((sighted() && !was_sighted_) || (hand_was_stuck_ && !hand_watch_.stuck())) {
    // What the hand did meanwhile is forgotten: the needle does not catch up by itself.
    anchor(stage_limits_.set_point().tip_m, stage_limits_.set_point().axis);
  }
  was_sighted_ = sighted();
  hand_was_stuck_ = hand_watch_.stuck();
  const bool coupled = !button(hal::kButtonClutch) && !ending();
  const bool tilting = phase() == Phase::free && sighted();
  mapping_.step(hand_, coupled, tilting);
  if (sighted()) {
    const StageLimits::Checked allowed = stage_limits_.check(mapping_.hand_point(), constraint());
    alarms_ |= allowed.alarms;
    mapping_.slip(allowed.point_m);
  }
}

// ---- observation, velocity, phase ----

bool Servo::sighted() const noexcept { return !model_ || !model_->stale(); }

bool Servo::ending() const noexcept {
  const bool outside = phase() == Phase::free || phase() == Phase::clear;
  return task_over_ || end_here_requested_ || (end_requested_ && outside);
}

bool Servo::inside() const noexcept {
  return phases_ ? phases_->inside() : model_ && model_->puncture_seen();
}

void Servo::take_newest_observation() noexcept {
  if (!model_ || (devices_.stage && !stage_seen_)) return;
  const hal::Vec3& tip = devices_.stage ? stage_.tip_m : mapping_.hand_point();
  if (!devices_.stage || stage_fresh_) model_->push_pose({now_ns_, tip, stage_.axis});

  if (station_.observation.head() != observation_head_) {
    Observation seen;
    std::uint64_t index = 0;
    if (station_.observation.newest(seen, index) == hal::Read::ok) {
      observation_head_ = index + 1;
      ++observations_;
      const bool used = model_->observe(seen, inside());
      if (!used && model_->membrane().known) alarms_ |= alarm_sensor;
    }
  }

  const bool free_to_turn = phase() == Phase::free || phase() == Phase::clear;
  if (free_to_turn && devices_.stage) approach_ = stage_.axis.normalized();
  const bool known = model_->membrane().known;
  const double before_m = model_->depth_m(tip);
  model_->step(now_ns_, approach_, dt_s_);
  depth_m_ = model_->depth_m(tip);
  model_moved_m_ = known ? depth_m_ - before_m : 0;

  if (model_->overdue()) {
    alarms_ |= alarm_vision_stale;
    ++stale_ticks_;
  }
  const double outward = -approach_.dot(tip - tip_before_m_) / elapsed_s_;
  tip_before_m_ = tip;
  if (ticks_ > 1) outward_m_s_ += (1 - std::exp(-dt_s_ / kOutwardTau_s)) * (outward - outward_m_s_);
}

void Servo::estimate_velocity() noexcept {
  if (hand_fresh_ && kalman_) estimated_m_s_ = kalman_->step(hand_.position_m, between_hand_s_);
  if (hand_fresh_ && foaw_) estimated_m_s_ = foaw_->step(hand_.position_m, between_hand_s_);
  const double tau_s = config_.velocity.smooth_s;
  const double part = tau_s > 0 ? 1 - std::exp(-dt_s_ / tau_s) : 1.0;
  hand_velocity_m_s_ += part * (estimated_m_s_ - hand_velocity_m_s_);
}

void Servo::advance_phase() noexcept {
  if (!phases_) return;
  PhaseInput in;
  if (model_) {
    in.membrane_known = model_->membrane().known;
    in.depth_m = depth_m_;
    in.inward_m = approach_.dot(tip_before_m_);
    in.outward_m_s = outward_m_s_;
    in.vision_contact = model_->contact_seen();
    in.vision_punctured = model_->puncture_seen();
  }
  in.inject = button(hal::kButtonInject);
  in.next_cell = button(hal::kButtonNextCell);
  phases_->step(in, dt_s_);
  if (phases_->timed_out()) alarms_ |= alarm_phase_timeout;

  if (phases_->entered(Phase::puncture)) insertion_ = {stage_.tip_m, approach_};
  if (phases_->entered(Phase::clear)) {
    ++cells_done_;
    if (!config_.injector || injected_) ++cells_injected_;
    if (config_.cells > 0 && cells_done_ >= static_cast<std::uint32_t>(config_.cells)) task_over_ = true;
  }
  if (phases_->entered(Phase::free) && phases_->cell() == cells_done_ && injected_cell_ != cells_done_) {
    // The next cell: everything that was learned belongs to the old one.
    injected_cell_ = cells_done_;
    if (model_) model_->restart(now_ns_);
    if (membrane_) membrane_->rearm();
    injected_s_ = 0;
    injected_ = false;
  }
}

// ---- forces ----

hal::Vec3 Servo::sum_force_effects() noexcept {
  const bool running = latch_.stage() == StopStage::running;
  const bool holding = running && mapping_.anchored() && (!devices_.stage || stage_.enabled);
  const double return_s = config_.mapping.coupling_s;
  presence_before_ = presence_.gain();
  presence_.step(holding && !ending() && !hand_watch_.stuck(), return_s, running ? kDecouple_s : 0, dt_s_);
  coupling_.step(holding && !button(hal::kButtonClutch), return_s, kDecouple_s, dt_s_);

  const hal::Vec3& tip = mapping_.hand_point();
  const hal::Vec3 velocity = world_from_hand(hand_velocity_m_s_);
  const bool known = model_ && model_->membrane().known;
  const bool punctured = inside() || phase() == Phase::clear;
  const double gain_before = fixture_gain_;
  fixture_gain_ = model_ ? coupling_.gain() * model_->force_gain() : 0;

  cone_N_.setZero();
  axis_N_.setZero();
  double energy_J = 0;
  double injected_J = 0;
  if (cone_) {
    const double so_far_J = cone_->injected_energy_J();
    const FixtureFrame entry =
        known ? FixtureFrame{model_->membrane().entry_m, model_->membrane().axis} : cone_->frame();
    cone_N_ = fixture_gain_ * cone_->step(tip, entry, known && !punctured, dt_s_);
    energy_J += cone_->stored_energy_J();
    injected_J += cone_->injected_energy_J() - so_far_J;
  }
  if (axis_) {
    const double so_far_J = axis_->injected_energy_J();
    axis_N_ = fixture_gain_ *
              axis_->step(tip, velocity, insertion_, known && inside(), phase() == Phase::withdrawal, dt_s_);
    energy_J += axis_->stored_energy_J();
    injected_J += axis_->injected_energy_J() - so_far_J;
  }
  if (repulsive_) {
    const double so_far_J = repulsive_->injected_energy_J();
    hal::Vec3 centre_m = hal::Vec3::Zero();
    if (known) centre_m = model_->membrane().entry_m + model_->R_m() * model_->membrane().axis;
    repulsive_N_ = fixture_gain_ * repulsive_->step(tip, centre_m, known, dt_s_);
    energy_J += repulsive_->stored_energy_J();
    injected_J += repulsive_->injected_energy_J() - so_far_J;
  }
  // d(gU) at a standing hand: what the fixtures and the gain did between the last tick and this one.
  stored_J_ = fixture_gain_ * energy_J;
  injected_J_ += fixture_gain_ * energy_J - gain_before * (energy_J - injected_J);

  render_membrane(fixture_gain_);
  const hal::Vec3 hand_m = world_from_hand(hand_.position_m);
  if (friction_) {
    friction_N_ = friction_->step(hand_m, presence_.gain() > 0);
    stored_J_ += friction_->stored_energy_J();
  }
  if (vibration_) {
    const double so_far_J = vibration_->injected_energy_J();
    const bool begins = phases_ && (phases_->entered(Phase::contact) || phases_->entered(Phase::puncture));
    vibration_N_ = vibration_->step(hand_m, approach_, begins, presence_.gain(), dt_s_);
    injected_J_ += vibration_->injected_energy_J() - so_far_J;
  }
  if (damping_) damping_N_ = damping_->step(velocity, inside(), dt_s_);
  return presence_.gain() *
         (membrane_N_ + cone_N_ + axis_N_ + damping_N_ + repulsive_N_ + friction_N_ + vibration_N_);
}

// What the hand may be given of it.
hal::Vec3 Servo::keep_passive(const hal::Vec3& wanted_N) noexcept {
  if (!guard_) return wanted_N;
  const double presence = presence_.gain();
  const double k_p = config_.mapping.position_scale;
  GuardInput in;
  in.position_m = world_from_hand(hand_.position_m);
  hal::Vec3 one_way_N = hal::Vec3::Zero();
  if (axis_) one_way_N = fixture_gain_ * axis_->one_way_N();
  in.storing[0] = {presence * (cone_N_ + axis_N_ - one_way_N + repulsive_N_), k_p * mapping_.hand_point()};
  in.storing[1] = {presence * membrane_N_, k_p * (devices_.stage ? stage_.tip_m : mapping_.hand_point())};
  in.storing[2] = {presence * friction_N_, in.position_m};
  in.dissipative_N = presence * (damping_N_ + one_way_N);
  in.active_N = presence * vibration_N_;
  double fixtures_N_m = 0;
  if (cone_) fixtures_N_m += cone_->stiffness_N_m();
  if (axis_) fixtures_N_m += axis_->stiffness_N_m();
  if (repulsive_) fixtures_N_m += repulsive_->stiffness_N_m();
  in.stiffness_N_m = presence * fixture_gain_ * fixtures_N_m;
  if (membrane_) {
    in.stiffness_N_m += presence * fixture_gain_ * force_scale_ * config_.mapping.force_scale / k_p *
                        membrane_->state().stiffness_N_m;
  }
  if (friction_) in.stiffness_N_m += presence * friction_->stiffness_N_m();
  in.damping_Ns_m = presence * ((damping_ ? damping_->B_Ns_m() : 0) + (axis_ ? axis_->B_Ns_m() : 0));
  in.elapsed_s = elapsed_s_;
  const hal::Vec3 force_N = guard_->step(in);
  guard_N_ = (force_N - wanted_N).norm();
  if (guard_->gain() < kStiffnessKept) alarms_ |= alarm_stiffness_reduced;
  return force_N;
}

void Servo::render_membrane(double gain) noexcept {
  if (!membrane_) return;
  const bool known = model_ && model_->membrane().known;
  const bool punctured = inside() || phase() == Phase::clear;
  const double w = known ? depth_m_ : 0;
  membrane_->step(w, model_ ? model_->R_m() : 0, model_ ? model_->dimple_scale() : 1, punctured, dt_s_);

  const double scale = gain * config_.mapping.force_scale * force_scale_;
  double force_N = scale * membrane_->state().force_N;
  // After the puncture the hand's force only ever falls, even while gain and presence return.
  if (membrane_->punctured()) {
    const double before_N = membrane_N_.norm() * std::min(presence_before_, presence_.gain());
    force_N = presence_.gain() > 0 ? std::min(force_N, before_N / presence_.gain()) : 0;
  }
  membrane_N_ = -force_N * approach_;
  rim_ = rim_forces(membrane_->state(), force_N, approach_);

  const double k_p = config_.mapping.position_scale;
  stored_J_ += scale * membrane_->stored_energy_J() * k_p;
  injected_J_ += force_N * model_moved_m_ * k_p;
  if (w > 0 && !membrane_->state().shallow) alarms_ |= alarm_model_invalid;
}

// ---- limits and safety ----

Fault Servo::limit_force(const hal::Vec3& wanted_N) noexcept {
  // The tip's own force: the membrane law's, or the measured one if that is more. A sensor that hangs at zero
  // lifts no limit.
  const bool measured = sensor_seen_ && since_sensor_s_ < kSensorTimeout_s;
  tip_force_N_ = membrane_ ? membrane_->state().force_N : 0;
  if (measured) tip_force_N_ = std::max(tip_force_N_, sensor_filtered_N_);
  const double soft_N = config_.limits.tip_force_soft_N;
  tip_force_soft_ = tip_force_N_ > (tip_force_soft_ ? kSoftHysteresis * soft_N : soft_N);
  if (tip_force_soft_) alarms_ |= alarm_tip_force;
  Fault cause = tip_force_N_ > config_.limits.tip_force_hard_N ? Fault::tip_force : Fault::none;

  // The hand's force, last of all: bounded, finite.
  const LimitedForce limited = limit_hand_force(hand_from_world(wanted_N), config_.limits.hand_force_N);
  if (limited.limited) alarms_ |= alarm_force_limited;
  if (!limited.finite) cause = first_of(cause, Fault::not_finite);
  if (limited.finite) live_force_N_ = limited.force_N;
  return cause;
}

void Servo::latch(Fault cause) noexcept {
  LatchInput in;
  in.cause = cause;
  in.chain_readable = devices_.estop != nullptr && estop_readable_;
  in.contacts_closed = estop_.contact_a_closed && estop_.contact_b_closed;
  in.reset_pressed = estop_.reset_pressed;
  in.at_standstill = !devices_.stage || (stage_fresh_ && stage_.at_standstill);
  stop_ = latch_.step(in, elapsed_s_);

  if (latch_.cause() != Fault::none) faults_latched_ |= 1ULL << static_cast<unsigned>(latch_.cause());
  if (stop_.cleared) {
    presence_.set(0);
    hand_force_N_.setZero();
    force_before_stop_N_.setZero();
    if (hand_seen_ && (stage_seen_ || !devices_.stage)) anchor(stage_.tip_m, stage_.axis);
  } else if (latch_.stage() == StopStage::running) {
    hand_force_N_ = live_force_N_;
    force_before_stop_N_ = hand_force_N_;
  } else {
    hand_force_N_ = stop_.hand_gain * force_before_stop_N_;
  }
}

// ---- stage, devices, telemetry ----

StageConstraint Servo::constraint() const noexcept {
  StageConstraint c;
  if (model_) c.membrane = model_->membrane();
  c.membrane.axis = approach_;
  c.withdrawal_only = !sighted() || end_requested_;
  c.no_deeper = tip_force_soft_;
  return c;
}

void Servo::choose_stage_set_point() noexcept {
  if (!devices_.stage || !mapping_.anchored()) return;
  if (latch_.stage() != StopStage::running || !stage_.enabled) return;
  const double longest_s = kLongestStageStep / config_.rate_Hz;
  stage_limits_.step(mapping_.filter(dt_s_), constraint(), std::min(dt_s_, longest_s));
  alarms_ |= stage_limits_.alarms();
}

void Servo::write_devices() noexcept {
  write_fault_ = Fault::none;

  if (hal::Stage* stage = devices_.stage) {
    if (stop_.quick_stop) {
      stage->quick_stop();
      if (!stop_.drive_power) stage->enable(false);
    } else if (!stage_.enabled) {
      if (stage_seen_) stage->enable(true);
    } else if (until_command_ <= 0 && mapping_.anchored()) {
      const hal::Status status = stage->command(stage_limits_.set_point());
      following_.sent(stage_limits_.set_point().tip_m);
      if (status == hal::Status::disconnected) write_fault_ = Fault::stage_lost;
      if (status == hal::Status::fault) write_fault_ = Fault::stage_fault;
      until_command_ = std::max(config_.stage_divisor, 1);
    }
    --until_command_;
  }

  if (hal::Injector* injector = devices_.injector) {
    // Nobody injects unseen. A button that is still down from before a stop or a loss of sight opens nothing.
    const bool may = !stop_.gate_shut && sighted();
    inject_released_ = may && (inject_released_ || !button(hal::kButtonInject));
    const bool wanted = may && !ending() && !end_requested_ && inject_released_ && config_.injector &&
                        phase() == Phase::injection && button(hal::kButtonInject) && hand_fresh_;
    gate_open_ = wanted && injected_s_ + elapsed_s_ <= config_.injector->max_open_s + kRounding_s;
    if (gate_open_) injected_s_ += elapsed_s_;
    injector->gate(gate_open_);
  }

  if (guard_) guard_->wrote(world_from_hand(hand_force_N_));
  const hal::Status status = devices_.hand.write_force(hand_force_N_);
  if (status == hal::Status::disconnected || status == hal::Status::fault) {
    write_fault_ = first_of(write_fault_, Fault::hand_lost);
  }

  if (devices_.estop && stop_.heartbeat && write_fault_ == Fault::none) {
    heartbeat_level_ = !heartbeat_level_;
    devices_.estop->heartbeat(heartbeat_level_);
  }
}

void Servo::publish(const TickInfo& now) noexcept {
  TelemetrySample& s = sample_;
  s.tick = now.tick;
  s.t_s = static_cast<double>(now.release_ns - first_release_ns_) * 1e-9;
  s.phase = phase();
  s.fault = latch_.cause();
  s.stop = latch_.stage();
  s.estop = static_cast<std::uint8_t>((estop_.contact_a_closed ? 0U : 1U) |
                                      (estop_.contact_b_closed ? 0U : 2U) | (estop_.reset_pressed ? 4U : 0U));
  s.alarms = alarms_;
  s.buttons = hand_.buttons;
  s.cell = phases_ ? phases_->cell() : 0;

  copy(s.x_m, hand_.position_m);
  copy(s.v_m_s, hand_velocity_m_s_);
  copy(s.tip_m, stage_.tip_m);
  copy(s.cmd_m, stage_limits_.set_point().tip_m);
  copy(s.force_N, hand_force_N_);

  const bool live = latch_.stage() == StopStage::running;
  const double presence = live ? presence_.gain() : 0;
  s.membrane_N = presence * membrane_N_.norm();
  s.cone_N = presence * cone_N_.norm();
  s.axis_N = presence * axis_N_.norm();
  s.damping_N = presence * damping_N_.norm();
  s.repulsive_N = presence * repulsive_N_.norm();
  s.friction_N = presence * friction_N_.norm();
  s.vibration_N = presence * vibration_N_.norm();
  s.guard_N = guard_N_;

  if (model_ && model_->membrane().known) {
    s.wd_m = std::max(depth_m_, 0.0);
    s.R_m = model_->R_m();
    copy(s.entry_m, model_->membrane().entry_m);
  } else {
    s.wd_m = 0;
    s.R_m = 0;
    copy(s.entry_m, hal::Vec3::Zero());
  }
  copy(s.axis, approach_);
  if (membrane_) {
    const MembraneState& m = membrane_->state();
    s.a_m = m.a_m;
    s.tip_force_N = m.force_N;
    s.sigma_d_Pa = m.sigma_d_Pa;
    s.pressure_Pa = m.pressure_Pa;
  }
  for (std::size_t i = 0; i < rim_.size(); ++i) {
    copy(s.contact_force_N[i], presence * hand_from_world(rim_[i]));
  }

  s.obs_age_s = model_ ? model_->age_s() : -1;
  s.obs_gap_m = model_ ? model_->seen_gap_m() : 0;
  s.observations = observations_;
  s.stale_ticks = stale_ticks_;
  s.sensor_N = sensor_N_;
  s.vacuum_Pa = vacuum_Pa_;
  s.stored_energy_J = stored_J_;
  s.injected_energy_J = injected_J_;
  s.injector_open = injector_open_ ? 1 : 0;
  station_.telemetry.push(s);

  CoreStatus& core = station_.core;
  core.fault.store(static_cast<std::uint64_t>(s.fault), std::memory_order_relaxed);
  core.faults_latched.store(faults_latched_, std::memory_order_relaxed);
  core.phase.store(static_cast<std::uint64_t>(s.phase), std::memory_order_relaxed);
  core.task_finished.store(task_done() ? 1 : 0, std::memory_order_relaxed);
  core.commands_refused.store(commands_refused_, std::memory_order_relaxed);
}

}  // namespace punctum::rt
