// The path of the needle: follows the hand at needle scale, then makes set-points of it that the stage may
// get.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"
#include "rt/control/cell_observer.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/limits.hpp"
#include "rt/control/master_to_stage.hpp"

namespace punctum::rt {

// What was true at the end of the last tick; the hand is followed before this tick's observation is taken.
struct FollowInput {
  bool running = true;  // no stop is latched
  bool vision_fresh = true;
  bool clutched = false;  // the operator or the end of the run has uncoupled hand and needle
  bool may_tilt = true;   // the handle's orientation turns the approach axis
  StageConstraint constraint;
  double elapsed_s = 0;         // since the last tick
  double position_scale = 500;  // as commanded
  bool nothing_felt = false;    // of what stands at the needle, on the last tick
};

class StageSetPoint {
 public:
  explicit StageSetPoint(const ServoConfig& config) NONBLOCKING;

  // Moves hand_point_m() with the hand, once both were seen; in a stop and without power it stays at the
  // needle, from where the motion goes on afterwards. Alarms of the limits that hold it.
  [[nodiscard]] std::uint32_t follow_hand(const Readings& readings, const FollowInput& in) NONBLOCKING;

  // The set-point of this tick, once hand and needle are coupled. Alarms of the limits that hold it.
  [[nodiscard]] std::uint32_t step(const StageConstraint& constraint, double dt_s) NONBLOCKING;

  [[nodiscard]] bool anchored() const NONBLOCKING { return mapping_.anchored(); }
  [[nodiscard]] bool uncoupled() const NONBLOCKING {
    return uncoupled_;
  }  // on this tick, by a stop or no power
  [[nodiscard]] const hal::Vec3& hand_point_m() const NONBLOCKING { return mapping_.hand_point(); }
  [[nodiscard]] double position_scale() const NONBLOCKING { return mapping_.position_scale(); }
  // For the stage; null while hand and needle are not coupled: where the needle is was told once, and that
  // may be false.
  [[nodiscard]] const hal::StageCommand* command() const NONBLOCKING {
    return anchored() && !uncoupled_ ? &limits_.set_point() : nullptr;
  }
  [[nodiscard]] const hal::StageCommand& set_point() const NONBLOCKING { return limits_.set_point(); }

 private:
  // What of the hand's way between two samples was not believed stays undone, but for what drew back.
  void catch_up(const Readings& readings, const hal::Vec3& believed_m, bool clutched, const hal::Vec3& inward)
      NONBLOCKING;
  // From here on the hand moves the needle relative to where both are now.
  void anchor(const hal::HandState& hand, const hal::Vec3& tip_m, const hal::Vec3& axis) NONBLOCKING;

  MasterToStage mapping_;
  StageLimits limits_;
  double lag_s_;  // of the whole way from the hand to the set-point
  bool uncoupled_ = false;
  bool last_withdrawal_only_ = false;
  bool last_hand_stuck_ = false;
  bool last_clutched_ = false;
  bool last_uncoupled_ = true;
  bool out_of_sight_ = false;                  // the hand: after a gap or in a leap
  hal::Vec3 last_seen_m_ = hal::Vec3::Zero();  // the hand, before that
};

}  // namespace punctum::rt
