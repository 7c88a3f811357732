// From the hand to the needle: scale, clutch, slip at limits, tremor filter, tilt of the approach axis.
//
// hand_point() is the hand at needle scale: anchor + R (x - x_anchor)/k_p, unfiltered; fixtures act on it, so
// that no filter lag stands inside their loop. set_point() is what the stage gets: hand_point() behind a
// second-order low-pass (Butterworth, implicit mid-point, stable at any period).
#pragma once

#include "hal/devices.hpp"
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"

namespace punctum::rt {

struct MappingParams {
  double position_scale = 500;    // k_p: hand metres per needle metre
  double position_scale_min = 0;  // what a command may change it to; 0 = as position_scale
  double position_scale_max = 0;
  double force_scale = 1e5;       // k_f: hand newtons per needle newton
  double tremor_cutoff_Hz = 3.0;  // second-order low-pass on the set-point; 0 = off
  double coupling_s = 0.3;        // forces return over this after a start, a clutch, a reset
  double max_tilt_rad = 0.1;      // the handle's orientation tilts the approach axis up to this; 0 = off
  hal::Vec3 workspace_min_m{-280e-6, -180e-6, -60e-6};  // of the needle tip, world frame
  hal::Vec3 workspace_max_m{280e-6, 180e-6, 60e-6};

  [[nodiscard]] constexpr double least_position_scale() const NONBLOCKING {
    return position_scale_min > 0 ? position_scale_min : position_scale;
  }
  [[nodiscard]] constexpr double most_position_scale() const NONBLOCKING {
    return position_scale_max > 0 ? position_scale_max : position_scale;
  }
};
constexpr auto keys_of(const MappingParams*) {
  return hal::keys(hal::real("position_scale", &MappingParams::position_scale, 1, 1e5),
                   hal::real("position_scale_min", &MappingParams::position_scale_min, 0, 1e5),
                   hal::real("position_scale_max", &MappingParams::position_scale_max, 0, 1e5),
                   hal::real("force_scale", &MappingParams::force_scale, 0, 1e7),
                   hal::real("tremor_cutoff_hz", &MappingParams::tremor_cutoff_Hz, 0, 100),
                   hal::real("max_tilt_rad", &MappingParams::max_tilt_rad, 0, 0.5),
                   hal::real("coupling_s", &MappingParams::coupling_s, 0, 5),
                   hal::micro_vector("workspace_min_um", &MappingParams::workspace_min_m, -1e5, 1e5),
                   hal::micro_vector("workspace_max_um", &MappingParams::workspace_max_m, -1e5, 1e5));
}

class MasterToStage {
 public:
  explicit MasterToStage(const MappingParams& params) NONBLOCKING : params_(params) {}

  // The needle stands still at tip_m; from here on the hand moves it relative to where the hand is now. Until
  // the needle has been tilted once, the handle's orientation counts from the identity; later from the axis
  // given.
  void anchor(const hal::HandState& hand, const hal::Vec3& tip_m, const hal::Vec3& axis) NONBLOCKING;
  [[nodiscard]] bool anchored() const NONBLOCKING { return anchored_; }

  // One tick. coupled = false (clutch): the hand moves freely, hand_point() stays. tilting = false: the axis
  // stays.
  void step(const hal::HandState& hand, bool coupled, bool tilting) NONBLOCKING;

  // Hand metres per needle metre from here on. While hand and needle are uncoupled: the hand's way so far
  // would move the needle otherwise.
  void set_position_scale(double scale) NONBLOCKING { params_.position_scale = scale; }
  [[nodiscard]] double position_scale() const NONBLOCKING { return params_.position_scale; }

  // Moves the anchor so that hand_point() is `to`: at a limit the hand slips, nothing winds up.
  void slip(const hal::Vec3& to) NONBLOCKING;

  // Advances the tremor filter towards hand_point() and returns it. Call once per tick, after slip().
  const hal::StageCommand& filter(double dt_s) NONBLOCKING;

  // How long set_point() is behind a hand_point() that moves steadily.
  [[nodiscard]] double lag_s() const NONBLOCKING;
  [[nodiscard]] const hal::Vec3& hand_point() const NONBLOCKING { return hand_point_m_; }
  [[nodiscard]] const hal::StageCommand& set_point() const NONBLOCKING { return set_point_; }

 private:
  [[nodiscard]] const hal::Vec3& handle_tilt_rad(const hal::Quat& handle) NONBLOCKING;

  MappingParams params_;
  bool anchored_ = false;
  bool has_tilted_ = false;
  bool tilts_ = false;                          // the needle with the handle, since step()
  bool tilt_stands_ = false;                    // the handle turned freely, and the needle's tilt stayed
  hal::Quat stood_at_ = hal::Quat::Identity();  // the handle, when it was seen last meanwhile
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
  // What was worked out once: of a handle that has not turned since, and of a tilt that is the same.
  hal::Quat handle_ = hal::Quat::Identity();
  hal::Vec3 handle_tilt_rad_ = hal::Vec3::Zero();
  hal::Vec3 turned_by_rad_ = hal::Vec3::Zero();  // the axis of set_point_; not a number: another way
};

}  // namespace punctum::rt
