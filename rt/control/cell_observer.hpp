// The cell as the core knows it: takes the newest observation, and between two frames follows the needle with
// the local membrane model.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "hal/realtime.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/limits.hpp"
#include "rt/control/local_membrane_model.hpp"
#include "rt/station/station.hpp"

namespace punctum::rt {

struct CellFacts {
  bool vision_fresh = true;  // vision is not needed, or its newest observation is not too old
  Membrane3D membrane;       // where it is known
  double dimple_scale = 1;
  double force_gain = 0;          // of the forces that need vision: fades when the observation is too old
  double depth_m = 0;             // of the tip past the undeformed membrane, along the approach axis
  double depth_correction_m = 0;  // the part of its change on this tick that vision's correction made
  hal::Vec3 approach_axis = -hal::Vec3::UnitX();  // of the needle, frozen from contact on
  double inward_m = 0;     // position of the tip along the axis by the encoders; only differences count
  double outward_m_s = 0;  // outward speed of the tip, low-passed
  // By the encoders alone, the way of the tip past the place of the first contact. Before it: depth_m.
  double contact_depth_m = 0;
  // inward_m at the first contact; infinite before it.
  double contact_inward_m = std::numeric_limits<double>::infinity();
  // What inward_m may not exceed: the distance from the far wall of the cell as it was first seen. No
  // observation that comes later moves it inwards.
  double inward_limit_m = std::numeric_limits<double>::infinity();
  bool vision_implausible = false;  // the newest observation contradicts what is known of this cell
  bool contact_seen = false;
  bool puncture_seen = false;        // of the outer membrane, in two observations in a row
  bool inner_puncture_seen = false;  // likewise of the inner one
  double observation_age_s = -1;     // -1: nothing seen yet
  double observed_gap_m = 0;
  double depth_sd_m = 0;  // standard deviations: of depth_m, and of what the newest observation says
  double R_sd_m = 0;
  double observed_a_m = 0;
  double observed_a_sd_m = 0;
  std::uint64_t observations = 0;
  std::uint64_t stale_ticks = 0;
  std::uint32_t alarms = 0;
};

// Of the tick before: the phase is advanced after the observation.
struct LastPhase {
  bool outside = true;       // the approach axis follows the needle's
  bool inside_cell = false;  // a frame that shows the needle is enough
};

class CellObserver {
 public:
  CellObserver(const ServoConfig& config, Station& station) NONBLOCKING;

  // hand_point_m stands for the tip where there is no stage.
  const CellFacts& step(const TickTime& time, const Readings& readings, const hal::Vec3& hand_point_m,
                        const LastPhase& last) NONBLOCKING;
  // A new cell: what was learned belongs to the old one.
  void restart(std::int64_t now_ns) NONBLOCKING;

  [[nodiscard]] const CellFacts& facts() const NONBLOCKING { return facts_; }

 private:
  void take_newest_observation(LocalMembraneModel& model, bool inside_cell) NONBLOCKING;
  void measure_speed(const TickTime& time, const hal::Vec3& tip_m) NONBLOCKING;
  void count_from_contact(LocalMembraneModel& model, const hal::Vec3& tip_m, bool outside) NONBLOCKING;
  void copy_from(const LocalMembraneModel& model) NONBLOCKING;

  Station& station_;
  double far_wall_m_;
  bool has_phases_;
  double let_go_m_;  // this far outside the first contact, the next one is the first
  std::optional<LocalMembraneModel> model_;
  CellFacts facts_;
  std::uint64_t next_observation_ = 0;
  hal::Vec3 last_tip_m_ = hal::Vec3::Zero();
  bool touched_ = false;
  hal::Vec3 contact_m_ = hal::Vec3::Zero();  // where the needle's line met the undeformed membrane
};

}  // namespace punctum::rt
