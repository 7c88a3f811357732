#include "hal/cia402/axis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace punctum::cia402 {
namespace {

constexpr std::uint8_t kPositionMode = 8;
constexpr ObjectId kMode{0x6060, 0};
constexpr ObjectId kShownMode{0x6061, 0};

// Standing: within one count of where it was, which a resting encoder can flicker by, for so long. A drive
// slower than that, 100 counts per second, is judged by the core, which knows its micrometres.
constexpr std::int32_t kStill_counts = 1;
constexpr std::int64_t kStill_ns = 10'000'000;

// A drive answers a controlword within a few cycles; a fault that is still there by then was not to be reset.
constexpr std::int64_t kResetWithin_ns = 200'000'000;
constexpr std::int64_t kAnswersWithin_ns = 200'000'000;
// The first answer to a controlword is older than it, and the second may be.
constexpr int kAnswered_cycles = 3;

}  // namespace

void Axis::set_up(const AxisParams& params, bool to_home, double heartbeat_timeout_s) {
  *this = Axis{};
  params_ = params;
  to_home_ = to_home;
  heartbeat_timeout_ns_ = std::llround(heartbeat_timeout_s * 1e9);
}

void Axis::take_position(const CanFrame& frame, std::int64_t sync_ns) NONBLOCKING {
  constexpr std::uint8_t kSize = 6;
  if (frame.size != kSize) {
    ++malformed_;
    return;
  }
  statusword_ = static_cast<std::uint16_t>(get(frame, 0, 2));
  state_ = power_state(statusword_);
  position_ = static_cast<std::int32_t>(get(frame, 2, 4));
  const auto away = std::abs(static_cast<std::int64_t>(position_) - still_at_);
  if (!seen_ || away > kStill_counts) {
    still_at_ = position_;
    still_since_ns_ = sync_ns;
  }
  still_ = sync_ns - still_since_ns_ >= kStill_ns;
  if (!fresh_) {
    cycles_ = std::min(cycles_ + 1, kAnswered_cycles);
  }
  sample_ns_ = sync_ns;
  seen_ = true;
  fresh_ = true;
}

void Axis::take_heartbeat(const CanFrame& frame, std::int64_t now_ns) NONBLOCKING {
  const auto says = node_state(frame);
  if (!says) {
    ++malformed_;
    return;
  }
  heard_ns_ = now_ns;
  lost_ = lost_ || *says != NodeState::operational;
}

void Axis::take_emergency(const CanFrame& frame) NONBLOCKING {
  const auto says = emergency(frame);
  if (!says) {
    ++malformed_;
    return;
  }
  if (says->code != 0) {  // that the error is gone does not unsay it
    emergency_ = *says;
    emergencies_ = std::min(emergencies_, std::numeric_limits<std::uint32_t>::max() - 1) + 1;
  }
}

void Axis::take_sdo_answer(const CanFrame& frame) NONBLOCKING {
  const auto answer = sdo_answer(frame);
  if (!answer) {
    return;
  }
  if (step_ == Step::to_position_mode && answer->object == kMode) {
    next(answer->is == SdoAnswer::Is::downloaded ? Step::confirm_position_mode : Step::dropped);
  } else if (step_ == Step::confirm_position_mode && answer->object == kShownMode) {
    const bool shown = answer->is == SdoAnswer::Is::uploaded && (answer->value & 0xFFU) == kPositionMode;
    to_home_ = to_home_ && !shown;
    next(shown ? Step::walk : Step::confirm_position_mode);  // not yet: ask again, within the time-out
  }
}

void Axis::begin(std::int64_t now_ns) NONBLOCKING { heard_ns_ = now_ns; }

void Axis::next(Step step) NONBLOCKING {
  if (step == Step::to_position_mode || (step == Step::confirm_position_mode && step_ != step)) {
    requested_ns_ = 0;
  }
  step_ = step;
  cycles_ = 0;
  request_due_ = step == Step::confirm_position_mode;
}

void Axis::step(Wanted wanted, std::int64_t now_ns) NONBLOCKING {
  lost_ = lost_ || now_ns - heard_ns_ > heartbeat_timeout_ns_;
  if (step_ != Step::follow) {
    target_ = position_;  // operation begins where the drive stands
  }
  if (wanted != Wanted::operation || lost_) {
    urge(lost_ ? Wanted::quick_stop : wanted);
    return;
  }
  switch (step_) {
    case Step::see_it_off:
      controlword_ = kDisableVoltage;
      if (cycles_ >= kAnswered_cycles && !powered(state_)) {
        next(Step::walk);
      }
      break;
    case Step::walk:
      walk(now_ns);
      break;
    case Step::start_homing:
    case Step::home:
      home();
      break;
    case Step::to_position_mode:
    case Step::confirm_position_mode:
      change_mode(now_ns);
      break;
    case Step::follow:
      if (state_ != PowerState::operation_enabled) {
        next(Step::dropped);
        controlword_ = kQuickStop;
      }
      break;
    case Step::dropped:
      controlword_ = kQuickStop;
      break;
  }
}

void Axis::walk(std::int64_t now_ns) NONBLOCKING {
  if (state_ == PowerState::fault) {
    // Once, on its rising edge: whoever told the drive on again after its stop has acknowledged the fault.
    controlword_ = reset_tried_ ? kDisableVoltage : kFaultReset;
    reset_ns_ = reset_tried_ ? reset_ns_ : now_ns;
    reset_tried_ = true;
    return;
  }
  controlword_ = step_to_operation(state_);
  if (state_ == PowerState::operation_enabled) {
    next(!to_home_ ? Step::follow : attained_ ? Step::to_position_mode : Step::start_homing);
    given_ = reached_ = target_;
  }
}

void Axis::home() NONBLOCKING {
  if (state_ != PowerState::operation_enabled) {
    next(Step::dropped);
    controlword_ = kQuickStop;
    return;
  }
  if (step_ == Step::start_homing) {
    // Bit 4 must rise.
    controlword_ = cycles_ >= kAnswered_cycles ? kStartHoming : kEnableOperation;
    if (controlword_ == kStartHoming) {
      next(Step::home);
    }
    return;
  }
  if (cycles_ < kAnswered_cycles) {
    return;  // what it says is of before the start
  }
  if ((statusword_ & kHomingError) != 0) {
    next(Step::dropped);
    controlword_ = kQuickStop;
  } else if ((statusword_ & kHomingAttained) != 0 && (statusword_ & kTargetReached) != 0) {
    attained_ = true;
    next(Step::to_position_mode);
    controlword_ = kEnableOperation;
  }
}

void Axis::change_mode(std::int64_t now_ns) NONBLOCKING {
  if (step_ == Step::to_position_mode && requested_ns_ == 0) {
    if (cycles_ < kAnswered_cycles) {
      return;  // homing has shifted its origin: its set-point must have followed before it counts
    }
    request_due_ = true;
  }
  requested_ns_ = requested_ns_ == 0 ? now_ns : requested_ns_;
  if (state_ != PowerState::operation_enabled || now_ns - requested_ns_ > kAnswersWithin_ns) {
    next(Step::dropped);
    controlword_ = kQuickStop;
  }
}

void Axis::urge(Wanted wanted) NONBLOCKING {
  if (wanted == Wanted::operation) {
    return;
  }
  controlword_ = wanted == Wanted::off ? kDisableVoltage : kQuickStop;
  if (step_ != Step::see_it_off) {
    next(Step::see_it_off);
  }
  target_ = position_;
  reset_tried_ = false;
}

void Axis::drop() NONBLOCKING {
  if (step_ != Step::see_it_off && step_ != Step::dropped) {
    next(Step::dropped);
    controlword_ = kQuickStop;
    target_ = position_;
  }
}

void Axis::synced() NONBLOCKING {
  reached_ = given_;
  given_ = target_;
  fresh_ = false;
}

CanFrame Axis::command() const NONBLOCKING {
  CanFrame frame{rpdo1_id(params_.node), 6, {}};
  put(frame, 0, controlword_, 2);
  put(frame, 2, static_cast<std::uint32_t>(target_), 4);
  return frame;
}

CanFrame Axis::request() const NONBLOCKING {
  return step_ == Step::to_position_mode ? sdo_download(params_.node, kMode, kPositionMode, 1)
                                         : sdo_upload(params_.node, kShownMode);
}

std::int32_t Axis::following_error() const NONBLOCKING {
  if (step_ != Step::follow) {
    return 0;
  }
  constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
  const std::int64_t error = static_cast<std::int64_t>(reached_) - position_;
  return static_cast<std::int32_t>(std::clamp(error, -most, most));
}

bool Axis::enabled() const NONBLOCKING {
  return step_ == Step::follow && state_ == PowerState::operation_enabled && (statusword_ & kFollows) != 0;
}

bool Axis::has_fault(Wanted wanted, std::int64_t now_ns) const NONBLOCKING {
  if (wanted == Wanted::off) {
    return false;  // without power, and waiting for somebody who resets the stop
  }
  const bool resets = reset_tried_ && now_ns - reset_ns_ <= kResetWithin_ns;
  const bool acknowledged = wanted == Wanted::operation &&
                            (resets || step_ == Step::see_it_off || (step_ == Step::walk && !reset_tried_));
  if (state_ == PowerState::fault || state_ == PowerState::fault_reaction) {
    return !acknowledged;
  }
  return step_ == Step::dropped ||
         (step_ == Step::follow && wanted == Wanted::operation && (statusword_ & kFollowingError) != 0);
}

}  // namespace punctum::cia402
