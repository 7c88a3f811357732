// The truth of the simulated world, read from a snapshot: for the observer that needs no picture, and for
// the report.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/sim/bench.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/point.hpp"

namespace punctum::sim {

// w_d = depth along the needle axis from the undeformed membrane, a = half-width of the
// dimple where its depth is 1 % of w_d, outer = the outer face of the zona, entry = where the needle's axis
// meets the undeformed outer membrane.
struct Truth {
  double t_s = 0;             // of the run
  Vec3 tip_m = Vec3::Zero();  // world frame, like everything here
  Vec3 axis = -Vec3::UnitX();
  double axial_force_N = 0;  // on the needle, compression positive
  Vec3 force_N = Vec3::Zero();

  bool cell = false;  // the rest is valid only then
  Vec3 centre_m = Vec3::Zero();
  double R_m = 0;
  double R_inner_m = 0;  // 0 without inner membrane
  Vec3 entry_m = Vec3::Zero();
  double chord_m = 0;    // from entry to the far wall along the axis
  double gap_m = 0;      // tip to entry along the axis: > 0 before contact
  double lateral_m = 0;  // distance of the needle's axis from the cell's centre
  double wd_m = 0;
  double a_m = 0;
  bool contact = false;  // needle and outer membrane touch, or the needle is inside
  bool zona_punctured = false;
  bool punctured = false;  // innermost membrane
  double puncture_s = -1;  // when the innermost membrane gave way, of the run; -1 = not
  double zona_puncture_s = -1;
  bool held = true;   // by the holding pipette; false = torn off
  bool lost = false;  // torn off, ripped open, or the far wall pierced
  std::optional<Vec3> holder_mouth_m;
};

// The shortest way from the needle's glass to other glass; < 0: they touch. The simulated plant feels nothing
// of it: the needle goes through. A horizontal needle's shaft, which is thicker, is nearer to the floor.
struct GlassClearance {
  std::optional<double> floor_m;   // of the tip, from the dish floor
  std::optional<double> holder_m;  // of tip and shaft, from the holding pipette
};
[[nodiscard]] GlassClearance glass_clearance(const SimConfig& config, const Snapshot& snapshot) noexcept;

// Contours need the cell's tables: keep a Cell(params, needle, holder, seed, cell_index), renew() it when
// snapshot.cell_index changes, and call its contour(snapshot.cell, ...).
[[nodiscard]] Truth truth_of(const SimConfig& config, const Snapshot& snapshot) noexcept;

// Centre of the holding pipette's mouth: it touches the cell from the left, drop_m below the centre.
[[nodiscard]] std::optional<Vec3> holder_mouth(const SimConfig& config) noexcept;

}  // namespace punctum::sim
