#include "rt/control/device_inputs.hpp"

#include <algorithm>
#include <cmath>

#include "rt/forces/ramp.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

constexpr double kLongest_s = 1e6;  // times that are only compared with limits count no further

constexpr double kEstopSilent_s = 0.02;     // an e-stop chain without data for longer: estop_lost
constexpr double kEnablingSilent_s = 0.02;  // an enabling switch without data for longer: enabling_fault
constexpr double kResetHeld_s = 0.02;       // a finger is on the button for longer, interference is not

constexpr double kStageReach_m = 1;  // no stage that carries a needle travels as far
constexpr double kUnit = 1e-3;       // the axis' length is as near to 1
// No drive turns a needle further than this between two samples, nor further than the operator may tilt it,
// once each way, from where it stood when the station began to move: the bound of both is that, and this.
constexpr double kTurn_rad = 0.1;
// Nor faster than this, twice the speed at which set-points turn it: a limit along the axis that turned at
// once would throw the needle aside.
constexpr double kTurnSpeed_rad_s = 1;
constexpr double kLongestTurn_s = 0.02;
// From switched-on to operation: a CiA 402 drive charges its DC link, releases its brake and answers each of
// three transitions; vendors state up to 2 s.
constexpr double kEnablesWithin_s = 3;

constexpr double kPressureMax_Pa = 2e5;  // no pump below ambient reaches more than 1e5

constexpr double kContactSilent_s = 0.1;  // of the injector

constexpr double kSensorSilent_s = 0.1;
constexpr double kSensorRange_N = 1;  // no sensor that tells a micronewton measures more
// What a sample counts at most, in hard limits: one bad sample stops nothing and hides nothing for longer
// than the low-pass takes, twice the limit for good is found all the same.
constexpr double kSensorCounts = 2;

[[nodiscard]] bool is_within(const hal::Vec3& v, double largest) NONBLOCKING {
  return std::abs(v.x()) <= largest && std::abs(v.y()) <= largest && std::abs(v.z()) <= largest;
}
[[nodiscard]] bool can_be_true(const hal::StageState& stage) NONBLOCKING {
  return is_within(stage.tip_m, kStageReach_m) && is_within(stage.following_error_m, kStageReach_m) &&
         std::abs(stage.axis.norm() - 1) <= kUnit;
}

}  // namespace

DeviceInputs::DeviceInputs(const ServoConfig& config, const Devices& devices) NONBLOCKING
    : config_(config),
      devices_(devices),
      hand_clock_(config.hand_timeout_s),
      hand_check_(config.hand_jump_m / 1e-3, config.velocity.d_m),
      stage_clock_(config.stage_timeout_s),
      enabling_clock_(kEnablingSilent_s),
      enabling_contacts_(config.estop.discrepancy_s),
      following_(config.stage_timeout_s),
      estop_clock_(kEstopSilent_s),
      estop_contacts_(config.estop.discrepancy_s),
      vacuum_clock_(config.vacuum ? config.vacuum->window_s : 0),
      injector_clock_(kContactSilent_s),
      sensor_clock_(kSensorSilent_s) {
  readings_.has_stage = devices.stage != nullptr;
  readings_.has_estop = devices.estop != nullptr;
  if (config.enabling) {
    enabling_.emplace(config.enabling->release_s);
  }
}

const Readings& DeviceInputs::read(const TickTime& time, const LastOutput& last) NONBLOCKING {
  // Every device is read on every tick; the most urgent cause comes first.
  readings_.alarms = 0;
  readings_.unusable = 0;
  readings_.estop_fault = read_estop(time);
  readings_.device_faults = read_hand(time, last);
  readings_.device_faults.add(judge_enabling(time, last));
  readings_.device_faults.add(read_stage(time, last));
  readings_.device_faults.add(read_vacuum(time, last));
  readings_.device_faults.add(read_injector(time, last));
  read_force_sensor(time);
  return readings_;
}

Fault DeviceInputs::read_estop(const TickTime& time) NONBLOCKING {
  readings_.estop_discrepancy = false;
  if (!devices_.estop) {
    return Fault::none;
  }
  hal::EstopState read;
  const hal::Status status = devices_.estop->read(read);
  estop_clock_.step(time.elapsed_s);
  const bool answered = status == hal::Status::ok;
  const SampleIs sample = answered ? estop_clock_.take(read.sample_ns, time.now_ns) : SampleIs::untimely;
  readings_.estop_readable = sample != SampleIs::untimely && !estop_clock_.timed_out();
  if (sample == SampleIs::fresh) {
    readings_.estop = read;
    // Since the first sample that said so.
    const bool held = read.reset_pressed && readings_.reset_down;
    reset_held_s_ = held ? std::min(reset_held_s_ + time.elapsed_s, 2 * kResetHeld_s) : 0;
    readings_.reset_down = read.reset_pressed;
    readings_.estop.reset_pressed = reset_held_s_ > kResetHeld_s;
  } else if (answered) {  // an open contact counts, whatever its time
    readings_.estop.contact_a_closed = readings_.estop.contact_a_closed && read.contact_a_closed;
    readings_.estop.contact_b_closed = readings_.estop.contact_b_closed && read.contact_b_closed;
  }
  if (!readings_.estop_readable) {
    unusable(device_estop);
  }
  if ((!answered && status != hal::Status::no_data) || estop_clock_.timed_out()) {
    return Fault::estop_lost;
  }
  const bool a = readings_.estop.contact_a_closed;
  const bool b = readings_.estop.contact_b_closed;
  estop_contacts_.step(a, b, time.elapsed_s);
  if (!a || !b || (answered && read.pulse_seen)) {
    readings_.estop_discrepancy = estop_contacts_.discrepancy();
    return Fault::estop;
  }
  return estop_contacts_.discrepancy() ? Fault::estop_discrepancy : Fault::none;
}

Fault DeviceInputs::read_hand(const TickTime& time, const LastOutput& last) NONBLOCKING {
  hal::HandState read;
  const hal::Status status = devices_.hand.read(read);
  hand_clock_.step(time.elapsed_s);
  readings_.hand_age_s += time.elapsed_s;
  readings_.hand_fresh = false;
  readings_.hand_begins = false;
  readings_.hand_leaps = false;
  const bool answered = status == hal::Status::ok;
  const SampleIs sample = answered ? hand_clock_.take(read.sample_ns, time.now_ns) : SampleIs::untimely;
  const bool contradicts = sample == SampleIs::repeated && read.position_m != newest_hand_m_;
  if (sample == SampleIs::untimely || contradicts) {
    unusable(device_haptic);
  }
  if ((!answered && status != hal::Status::no_data) || hand_clock_.timed_out()) {
    unusable(device_haptic);
    release_buttons();
    return Fault::hand_lost;
  }
  if (sample == SampleIs::fresh) {
    newest_hand_m_ = read.position_m;
    hand_is_ = hand_check_.judge(read);
    if (hand_is_ != HandCheck::Is::ignored && hand_is_ != HandCheck::Is::invalid) {
      take_hand(read, last);
      return Fault::none;
    }
  }
  if (hand_is_ == HandCheck::Is::ignored && readings_.hand_seen) {
    unusable(device_haptic);
    if (readings_.hand_age_s > config_.hand_timeout_s + kRounding_s) {
      hand_check_.distrust();
      hand_is_ = HandCheck::Is::invalid;
    }
  }
  if (hand_is_ == HandCheck::Is::invalid) {
    unusable(device_haptic);
    release_buttons();
    return Fault::hand_invalid;
  }
  if (readings_.hand_stuck) {
    unusable(device_haptic);
  }
  return Fault::none;
}

void DeviceInputs::take_hand(const hal::HandState& read, const LastOutput& last) NONBLOCKING {
  readings_.hand_fresh = true;
  readings_.hand_begins = hand_is_ == HandCheck::Is::begins;
  readings_.hand_leaps = hand_is_ == HandCheck::Is::leaps;
  readings_.between_hand_s = readings_.hand_begins
                                 ? readings_.hand_age_s
                                 : 1e-9 * static_cast<double>(read.sample_ns - readings_.hand.sample_ns);
  readings_.hand = read;
  readings_.hand.orientation.normalize();
  readings_.inject_down = (read.buttons & hal::kButtonInject) != 0;
  inject_.step(readings_.inject_down, readings_.between_hand_s);
  next_cell_.step((read.buttons & hal::kButtonNextCell) != 0, readings_.between_hand_s);
  readings_.hand.buttons &= ~(hal::kButtonInject | hal::kButtonNextCell);
  readings_.hand.buttons |=
      (inject_.pressed() ? hal::kButtonInject : 0U) | (next_cell_.pressed() ? hal::kButtonNextCell : 0U);
  readings_.hand_seen = true;
  readings_.hand_age_s = hand_clock_.age_s();
  // A handle without force is moved by none.
  const hal::Vec3 felt_N = config_.device.force_max_N > 0 ? last.hand_force_N : hal::Vec3(hal::Vec3::Zero());
  hand_watch_.step(read.position_m, felt_N, readings_.between_hand_s);
  readings_.hand_stuck = hand_watch_.stuck();
  if (readings_.hand_stuck) {
    unusable(device_haptic);
  }
}

// A button that is held all the time is no new press when the hand comes back, or it would inject by itself
// or call for the next cell. The clutch counts as it is: it only keeps the needle where it is.
void DeviceInputs::release_buttons() NONBLOCKING {
  readings_.hand.buttons = 0;
  readings_.inject_down = false;
  inject_.mute();
  next_cell_.mute();
}

Fault DeviceInputs::judge_enabling(const TickTime& time, const LastOutput& last) NONBLOCKING {
  if (!enabling_) {
    return Fault::none;
  }
  Fault fault = Fault::none;
  if (devices_.enabling) {
    fault = read_enabling_switch(time);
  } else if (readings_.hand_fresh) {
    enabling_->read(readings_.hand.buttons, readings_.between_hand_s);
  }
  fault = first_of(fault, enabling_->step(last.running, time.elapsed_s));
  readings_.enabled = enabling_->enabled();
  readings_.pressed_anew = enabling_->pressed_anew();
  if (last.running && !readings_.enabled) {
    readings_.alarms |= alarm_not_enabled;
  }
  return fault;
}

// Held means: both contacts closed, and no pulse between two readings. A switch that cannot be read, or whose
// contacts disagree, counts as squeezed: it is to be seen let go altogether before its next press.
Fault DeviceInputs::read_enabling_switch(const TickTime& time) NONBLOCKING {
  hal::EnablingState read;
  const hal::Status status = devices_.enabling->read(read);
  enabling_clock_.step(time.elapsed_s);
  const bool answered = status == hal::Status::ok;
  const SampleIs sample = answered ? enabling_clock_.take(read.sample_ns, time.now_ns) : SampleIs::untimely;
  if (sample == SampleIs::untimely) {
    unusable(device_enabling);
  }
  if (answered) {
    const bool a = read.contact_a_closed, b = read.contact_b_closed;
    enabling_contacts_.step(a, b, time.elapsed_s);
    const bool held = a && b && !read.pulse_seen;
    if (sample == SampleIs::fresh) {
      enabling_->read(held ? hal::kButtonEnable : 0,
                      1e-9 * static_cast<double>(read.sample_ns - enabling_ns_));
      enabling_ns_ = read.sample_ns;
    } else if (!held) {  // an open contact counts, whatever its time
      enabling_->read(0, 0);
    }
  }
  const bool lost = (!answered && status != hal::Status::no_data) || enabling_clock_.timed_out();
  if (!lost && !enabling_contacts_.discrepancy()) {
    return Fault::none;
  }
  unusable(device_enabling);
  enabling_->read(hal::kButtonPanic, 0);
  return Fault::enabling_fault;
}

Fault DeviceInputs::read_stage(const TickTime& time, const LastOutput& last) NONBLOCKING {
  if (!devices_.stage) {
    return Fault::none;
  }
  if (last.uncoupled) {
    following_.restart();
  }
  if (last.stage_commanded) {
    following_.sent(last.set_point_m);
  }
  hal::StageState read;
  const hal::Status status = devices_.stage->read(read);
  stage_clock_.step(time.elapsed_s);
  following_.step(time.elapsed_s);
  readings_.stage_fresh = false;
  readings_.stage_age_s = stage_clock_.age_s();
  if (status == hal::Status::fault || status == hal::Status::disconnected) {
    unusable(device_stage);
    return status == hal::Status::fault ? Fault::stage_fault : Fault::stage_lost;
  }
  if (status == hal::Status::ok && !can_be_true(read)) {
    unusable(device_stage);
    return Fault::stage_fault;
  }
  const bool answered = status == hal::Status::ok;
  const hal::Vec3 told_axis = answered ? read.axis.normalized() : read.axis;
  const bool believed = answered && axis_can_be_true(told_axis, last);
  const SampleIs sample = believed ? stage_clock_.take(read.sample_ns, time.now_ns) : SampleIs::untimely;
  if (sample == SampleIs::untimely || stage_clock_.timed_out()) {
    unusable(device_stage);
  }
  if (sample != SampleIs::fresh) {
    Fault fault = stage_clock_.timed_out() ? Fault::stage_lost : Fault::none;
    // No power counts, whatever else it tells; but not what a sample says that is older than the newest one.
    if (answered && !read.enabled && (!believed || read.sample_ns > readings_.stage.sample_ns)) {
      readings_.stage.enabled = false;
      fault = first_of(fault, judge_stage(last));
    }
    return first_of(fault, not_enabled(time, last));
  }
  const hal::Vec3 axis = turned(told_axis, read.sample_ns, last);
  readings_.stage = read;
  readings_.stage.axis = axis;
  readings_.stage_seen = true;
  readings_.stage_fresh = true;
  readings_.stage_age_s = stage_clock_.age_s();
  return first_of(judge_stage(last), not_enabled(time, last));
}

// Every depth is measured along the needle's axis: one that points elsewhere turns inward and outward round.
// In a stop a needle may be mounted anew; two samples in a row say so.
bool DeviceInputs::axis_can_be_true(const hal::Vec3& axis, const LastOutput& last) NONBLOCKING {
  const auto near = [&axis](const hal::Vec3& other, double turn_rad) {
    return axis.dot(other) > 1 - 0.5 * turn_rad * turn_rad;
  };
  const bool twice = near(last_told_axis_, kTurn_rad);
  last_told_axis_ = axis;
  if (!last.running || !readings_.stage_seen) {
    if (twice || !readings_.stage_seen) {
      mounted_axis_ = axis;
      return true;
    }
    return near(readings_.stage.axis, kTurn_rad);
  }
  return near(readings_.stage.axis, kTurn_rad) &&
         near(mounted_axis_, 2 * config_.mapping.max_tilt_rad + kTurn_rad);
}

hal::Vec3 DeviceInputs::turned(const hal::Vec3& axis, std::int64_t sample_ns, const LastOutput& last) const
    NONBLOCKING {
  if (!last.running || !readings_.stage_seen) {
    return axis;
  }
  const double since_s = 1e-9 * static_cast<double>(sample_ns - readings_.stage.sample_ns);
  const double most = kTurnSpeed_rad_s * std::clamp(since_s, 0.0, kLongestTurn_s);
  const hal::Vec3 turn = axis - readings_.stage.axis;
  const double length = turn.norm();
  return length <= most ? axis : hal::Vec3(readings_.stage.axis + turn * (most / length)).normalized();
}

Fault DeviceInputs::judge_stage(const LastOutput& last) NONBLOCKING {
  const hal::StageState& stage = readings_.stage;
  if (!last.running || !readings_.enabled) {
    stage_was_enabled_ = false;
    return Fault::none;
  }
  if (stage_was_enabled_ && !stage.enabled) {
    return Fault::stage_fault;  // the drive took its power away without being asked
  }
  stage_was_enabled_ = stage.enabled;
  const double limit_m = config_.limits.following_error_m;
  const bool follows = stage.following_error_m.norm() <= limit_m && following_.follows(stage.tip_m, limit_m);
  return stage.enabled && !follows ? Fault::stage_following : Fault::none;
}

Fault DeviceInputs::not_enabled(const TickTime& time, const LastOutput& last) NONBLOCKING {
  const bool waits = last.running && readings_.enabled && readings_.stage_seen && !readings_.stage.enabled;
  not_enabled_s_ = waits ? std::min(not_enabled_s_ + time.elapsed_s, 2 * kEnablesWithin_s) : 0;
  return not_enabled_s_ > kEnablesWithin_s ? Fault::stage_not_enabled : Fault::none;
}

Fault DeviceInputs::read_vacuum(const TickTime& time, const LastOutput& last) NONBLOCKING {
  if (!devices_.vacuum || !config_.vacuum) {
    return Fault::none;
  }
  hal::VacuumState vacuum;
  vacuum_clock_.step(time.elapsed_s);
  const bool answered =
      devices_.vacuum->read(vacuum) == hal::Status::ok && std::abs(vacuum.pressure_Pa) <= kPressureMax_Pa;
  const SampleIs sample = answered ? vacuum_clock_.take(vacuum.sample_ns, time.now_ns) : SampleIs::untimely;
  vacuum_same_s_ = std::min(vacuum_same_s_ + time.elapsed_s, kLongest_s);
  if (sample == SampleIs::fresh) {
    vacuum_same_s_ = vacuum.pressure_Pa == readings_.vacuum_Pa ? vacuum_same_s_ : 0;
    readings_.vacuum_Pa = vacuum.pressure_Pa;
  }
  const bool read = sample != SampleIs::untimely && !vacuum_clock_.timed_out();
  const double still_s = config_.vacuum->still_s;
  if (!read || (still_s > 0 && vacuum_same_s_ > still_s)) {
    unusable(device_vacuum);
  }
  const bool holds = read && readings_.vacuum_Pa >= config_.vacuum->min_Pa;
  // Counted up and down, so that single good readings do not hide a loss.
  const double window_s = config_.vacuum->window_s;
  vacuum_low_s_ = std::clamp(vacuum_low_s_ + (holds ? -time.elapsed_s : time.elapsed_s), 0.0, 2 * window_s);
  return vacuum_low_s_ > window_s && !last.between_cells ? Fault::vacuum_lost : Fault::none;
}

Fault DeviceInputs::read_injector(const TickTime& time, const LastOutput& last) NONBLOCKING {
  readings_.injected = false;
  if (!devices_.injector || !config_.injector) {
    return Fault::none;
  }
  hal::InjectorState injector;
  const hal::Status status = devices_.injector->read(injector);
  injector_clock_.step(time.elapsed_s);
  const SampleIs sample =
      status == hal::Status::ok ? injector_clock_.take(injector.sample_ns, time.now_ns) : SampleIs::untimely;
  if (sample == SampleIs::fresh) {
    readings_.injector_open = injector.open;
    opened_unseen_ = false;
  }
  opened_unseen_ = opened_unseen_ || last.gate_open;
  readings_.injector_known = !injector_clock_.timed_out();
  if (sample == SampleIs::untimely || !readings_.injector_known) {
    unusable(device_injector);
  } else {
    readings_.injected = readings_.injector_open && last.gate_open;
  }
  const bool may_be_open = readings_.injector_open || (opened_unseen_ && !readings_.injector_known);
  const bool unasked = may_be_open && !last.gate_open;
  open_unasked_s_ = unasked ? std::min(open_unasked_s_ + time.elapsed_s, kLongest_s) : 0;
  return open_unasked_s_ > config_.injector->shut_within_s ? Fault::injector_open : Fault::none;
}

void DeviceInputs::read_force_sensor(const TickTime& time) NONBLOCKING {
  if (!devices_.force_sensor || !config_.force_sensor) {
    return;
  }
  hal::ForceState force;
  const hal::Status status = devices_.force_sensor->read(force);
  const double axial_N = force.axial_force_N;
  sensor_clock_.step(time.elapsed_s);
  const SampleIs sample = status == hal::Status::ok && std::abs(axial_N) <= kSensorRange_N
                              ? sensor_clock_.take(force.sample_ns, time.now_ns)
                              : SampleIs::untimely;
  if (sample == SampleIs::untimely) {
    unusable(device_force_sensor);
  }
  if (sample == SampleIs::fresh) {
    const double since_s = 1e-9 * static_cast<double>(force.sample_ns - sensor_ns_);
    const double part = sensor_seen_ ? low_pass_part(since_s, kSensorTau_s) : 1.0;
    readings_.sensor_N = axial_N;
    const double most_N = kSensorCounts * config_.limits.tip_force_hard_N;
    readings_.sensor_filtered_N +=
        part * (std::clamp(axial_N, -most_N, most_N) - readings_.sensor_filtered_N);
    sensor_seen_ = true;
    sensor_ns_ = force.sample_ns;
  }
  readings_.sensor_fresh = sensor_seen_ && !sensor_clock_.timed_out();
}

}  // namespace punctum::rt
