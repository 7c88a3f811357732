// Does the drive of the stage obey? Judged from its samples while it is to stand, in a stop and before it is
// enabled: what it says of itself, and whether its tip moves. A drive that cannot be read obeys nothing.
#pragma once

#include <algorithm>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "rt/control/device_inputs.hpp"

namespace punctum::rt {

class DriveCheck {
 public:
  // Once per tick; running: the drive may have power; stopped: its power was taken on an earlier tick.
  void step(const Readings& readings, bool running, bool stopped, double elapsed_s) NONBLOCKING {
    stands_ = false;
    if (running || !readings.has_stage) {
      *this = DriveCheck{};
      stands_ = !readings.has_stage;
      return;
    }
    since_stop_s_ = std::min(since_stop_s_ + elapsed_s, kLongest_s);
    still_s_ = std::min(still_s_ + elapsed_s, kLongest_s);
    // A sample from before the stop says nothing about it.
    const bool seen = readings.stage_fresh && readings.stage_age_s < since_stop_s_;
    if (seen) {
      watch(readings.stage);
      stands_ = readings.stage.at_standstill && still_s_ >= kStill_s;
      stood_ = stood_ || stands_;
    }
    if (!stopped) {
      if (seen) {
        left_m_ = readings.stage.tip_m;
        left_ = true;
      }
      return;
    }
    const bool off = seen && !readings.stage.powered;
    const bool at_rest = stands_ && still_s_ >= kAtRest_s;
    powered_s_ = off ? 0 : std::min(powered_s_ + elapsed_s, kLongest_s);
    restless_s_ = at_rest ? 0 : std::min(restless_s_ + elapsed_s, kLongest_s);
    stood_ = stood_ || (off && at_rest);
    // Not one standstill until the power went: the quick stop has failed.
    rests_ = stood_ && powered_s_ <= kPowerOff_s && restless_s_ <= kComesToRest_s;
    creeps_ = seen && creeps(readings.stage.tip_m);
  }

  // Seen to stand on this tick.
  [[nodiscard]] bool stands() const NONBLOCKING { return stands_; }
  [[nodiscard]] bool obeys() const NONBLOCKING { return rests_ && !creeps_; }
  // Without power and at rest, as far as a drive can show that somebody may adjust by hand.
  [[nodiscard]] bool rests() const NONBLOCKING { return rests_; }

 private:
  // Standing: within a micrometre, more than encoders flicker, for as long. Without power it has to be
  // longer: 10 um/s is found there.
  static constexpr double kStill_m = 1e-6;
  static constexpr double kStill_s = 0.01;
  static constexpr double kAtRest_s = 0.1;
  // A drive whose power is taken says so and has been read again within this time: a CAN drive answers in a
  // few milliseconds, and its motor holds until a holding brake has closed, up to 50.
  static constexpr double kPowerOff_s = 0.1;
  // By then it has settled in its bearings and was watched for kAtRest_s.
  static constexpr double kComesToRest_s = 0.25;
  // Without power a stage settles by its backlash and by what its bearings give, less than this.
  static constexpr double kCreep_m = 10e-6;
  static constexpr double kLongest_s = 1e6;

  void watch(const hal::StageState& stage) NONBLOCKING {
    if (!placed_ || !((stage.tip_m - place_m_).norm() <= kStill_m)) {
      place_m_ = stage.tip_m;
      placed_ = true;
      still_s_ = 0;
    }
  }
  [[nodiscard]] bool creeps(const hal::Vec3& tip_m) NONBLOCKING {
    if (!left_) {
      left_m_ = tip_m;
      left_ = true;
    }
    const bool away = !((tip_m - left_m_).norm() <= kCreep_m);
    left_ = !away;
    return away;
  }

  double since_stop_s_ = 0;
  double still_s_ = 0;  // the tip has been at place_m_
  bool placed_ = false;
  hal::Vec3 place_m_ = hal::Vec3::Zero();
  bool stands_ = false, stood_ = false, rests_ = true, creeps_ = false;
  // While its power is taken, since a sample that shows it
  double powered_s_ = 0;   // without power
  double restless_s_ = 0;  // at rest
  bool left_ = false;
  hal::Vec3 left_m_ = hal::Vec3::Zero();  // where the tip was when its power went
};

}  // namespace punctum::rt
