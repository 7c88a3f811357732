// From the hand to the needle: scale, clutch, slip at limits, tremor filter, tilt of the approach axis.
//
// hand_point() is the hand at needle scale: anchor + R (x - x_anchor)/k_p, unfiltered; fixtures act on it, so
// that no filter lag stands inside their loop. set_point() is what the stage gets: hand_point() behind a
// second-order low-pass (Butterworth, implicit mid-point, stable at any period).
#pragma once

#include "hal/devices.hpp"
#include "rt/control/config.hpp"

namespace punctum::rt {

class MasterToStage {
 public:
  explicit MasterToStage(const MappingParams& params) noexcept : params_(params) {}

  // The needle stands still at tip_m; from here on the hand moves it relative to where the hand is now. Until
  // the needle has been tilted once, the handle's orientation counts from the identity; later from the axis
  // given.
  void anchor(const hal::HandState& hand, const hal::Vec3& tip_m, const hal::Vec3& axis) noexcept;
  [[nodiscard]] bool anchored() const noexcept { return anchored_; }

  // One tick. coupled = false (clutch): the hand moves freely, hand_point() stays. tilting = false: the axis
  // stays.
  void step(const hal::HandState& hand, bool coupled, bool tilting) noexcept;

  // Moves the anchor so that hand_point() is `to`: at a limit the hand slips, nothing winds up.
  void slip(const hal::Vec3& to) noexcept;

  // Advances the tremor filter towards hand_point() and returns it. Call once per tick, after slip().
  const hal::StageCommand& filter(double dt_s) noexcept;

  [[nodiscard]] const hal::Vec3& hand_point() const noexcept { return hand_point_m_; }
  [[nodiscard]] const hal::StageCommand& set_point() const noexcept { return set_point_; }

 private:
  MappingParams params_;
  bool anchored_ = false;
  bool has_tilted_ = false;
  hal::Vec3 anchor_hand_m_ = hal::Vec3::Zero();
  hal::Vec3 anchor_tip_m_ = hal::Vec3::Zero();
  hal::Vec3 hand_point_m_ = hal::Vec3::Zero();
  hal::Vec3 filter_velocity_m_s_ = hal::Vec3::Zero();
  hal::Vec3 base_axis_ = -hal::Vec3::UnitX();
  hal::Vec3 tilt_anchor_rad_ = hal::Vec3::Zero();  // added to the handle's tilt
  hal::Vec3 tilt_wanted_rad_ = hal::Vec3::Zero();  // rotation vector, across the base axis
  hal::Vec3 tilt_rad_ = hal::Vec3::Zero();         // behind the filter
  hal::Vec3 tilt_velocity_rad_s_ = hal::Vec3::Zero();
  hal::StageCommand set_point_;
};

}  // namespace punctum::rt
