// The simulated cell: zona (outer) and inner membrane as concentric elastic spheres, held by suction.
//
// Quasi-static membranes from MembraneTruth, recoil integrated exactly, contact and punctures located inside
// the step. Off-centre contact: the axisymmetric law with the depth's component along the local normal at the
// entry point; the force is its gradient, so that an intact membrane gives back the work done on it. Needle
// and normal differ by a few degrees. World frame, SI units. The
// constructor solves the tables (allocates); everything else is real-time safe and deterministic.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>

#include "hal/realtime.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/plant/membrane_truth.hpp"

namespace punctum::sim {

enum class Membrane : std::uint8_t { outer, inner };

struct MembraneState {
  bool punctured = false;
  double puncture_time_s = -1;  // on CellState::time_s
  double puncture_depth_m = 0;  // of the dimple, along the needle, when it gave way
  double dimple_m = 0;          // depth of the dimple along its axis, now
  double axis_m[3] = {-1, 0,
                      0};  // of the dimple: inward normal where the needle's axis meets the surface (unit)
  double lean[3] = {};     // sideways shift of the dimple's bottom per depth: it meets the tip
};

// Trivially copyable: goes into the bench snapshot.
struct CellState {
  double time_s = 0;  // advanced by step(); the plant may set it to its own time before each step
  MembraneState outer, inner;
  bool contact = false;  // the needle touches or has entered the cell
  bool attached = true;  // false: torn off the holding pipette
  bool far_wall_pierced = false;
  bool torn = false;                 // ripped open by sideways motion of the needle
  double first_contact_time_s = -1;  // located inside the step
  double clear_time_s = -1;          // the tip has last left the cell after a puncture
  double leak = 0;                   // 0 .. 1, fluid lost through a rip or a pierced wall
  double hole_m[3] = {};    // where the needle went through the undeformed outer surface; moves with the cell
  double offset_m[3] = {};  // of the whole cell once it is torn off
  // Where the needle's axis last met the cell:
  double entry_m[3] = {};  // needle axis meets the undeformed outer surface

  [[nodiscard]] bool lost() const NONBLOCKING { return !attached || far_wall_pierced || torn; }
};
static_assert(std::is_trivially_copyable_v<CellState>);

// The needle over one step: straight on from one tip and axis to the other.
struct TipMotion {
  Vec3 tip_begin_m = Vec3::Zero();
  Vec3 tip_end_m = Vec3::Zero();
  Vec3 axis_begin = -Vec3::UnitX();  // unit, out of the tip
  Vec3 axis_end = -Vec3::UnitX();
  double vacuum_Pa = -1;  // of the holding pipette now; negative = its nominal value
  // Of a drive that nears its set-point: what was left to go at the beginning, and what is left where its
  // speed is no longer limited and it goes on as a first-order lag. No lag: constant speed.
  double left_m = 0;
  double knee_m = 0;
  double lag_s = 0;

  // Part of the step's time at which this part of the way is done, 0 .. 1.
  [[nodiscard]] double time_at(double way) const NONBLOCKING;
};

// At the end of the step.
struct CellForce {
  Vec3 force_N = Vec3::Zero();  // on the needle, all parts
  double membrane_N = 0;        // zona + inner membrane along the needle, >= 0
  double outer_N = 0;           // zona alone, along its normal
  double inner_N = 0;
  double drag_N = 0;  // viscous drag and grip of the holes along the needle's axis; > 0 pushes it inwards
  bool contact = false;
  double depth_m = 0;      // of the tip past the undeformed outer membrane along the axis; < 0 outside
  double wd_m = 0;         // depth of the outer dimple along the axis
  double a_m = 0;          // its half-width where the depth has fallen to 1 %
  double rim_m = 0;        // radius of the outer dimple's rim as it is seen, where the membrane is highest
  double rim_depth_m = 0;  // of the dimple's bottom below that rim
  double inner_wd_m = 0;
  double chord_m = 0;           // from entry to the far wall along the axis
  double strain = 0;            // largest, of the intact outer membrane
  double tension_N_m = 0;       // nominal meridional tension of the intact outer membrane at the tip's rim
  double pressure_Pa = 0;       // inside
  Vec3 entry_m = Vec3::Zero();  // valid when the needle's axis meets the cell
  bool aims_at_cell = false;
};

class Cell {
 public:
  static constexpr int kContour = 2 * MembraneTruth::kProfile - 2;  // points of a closed contour (512)

  Cell(const CellParams& params, const NeedleParams& needle, const std::optional<HolderParams>& holder,
       std::uint64_t seed, int cell_index);

  // Another individual of the same kind: its size and stiffness differ by `spread`. The tables are kept: the
  // patch under the tip scales with the cell's size.
  void renew(std::uint64_t seed, int cell_index) NONBLOCKING;

  [[nodiscard]] CellForce step(CellState& state, const TipMotion& motion, double dt_s) const NONBLOCKING;

  // Closed contour as the picture plane shows it (world x, y, metres), from the bottom of the dimple round
  // the cell and back, first point not repeated. Returns the points written: kContour, or 0 when the membrane
  // does not exist or `out` is too small.
  int contour(const CellState& state, Membrane which, std::span<std::array<double, 2>> out) const NONBLOCKING;

  // This individual, undeformed.
  [[nodiscard]] Vec3 centre_m(const CellState& state) const NONBLOCKING;
  [[nodiscard]] double R_m() const NONBLOCKING { return R_m_; }
  [[nodiscard]] double R_inner_m() const NONBLOCKING { return R_inner_m_; }  // 0: no inner membrane
  [[nodiscard]] double outer_Eh_N_m() const NONBLOCKING { return outer_Eh_; }
  [[nodiscard]] double puncture_depth_m() const NONBLOCKING { return outer_puncture_m_; }  // normal, outer
  [[nodiscard]] double inner_puncture_depth_m() const NONBLOCKING { return inner_puncture_m_; }
  [[nodiscard]] Vec3 holder_mouth_m() const
      NONBLOCKING;  // centre of the mouth: the same for every individual
  [[nodiscard]] const MembraneTruth& table(Membrane which) const NONBLOCKING {
    return which == Membrane::outer ? *outer_table_ : *inner_table_;
  }

 private:
  enum class Event : std::uint8_t;
  struct Occurrence;
  struct Pose;
  [[nodiscard]] Pose pose(const CellState& state, const TipMotion& motion, double s) const NONBLOCKING;
  [[nodiscard]] double past(const CellState& state, Event event, const Pose& pose) const NONBLOCKING;
  [[nodiscard]] double locate(const CellState& state, const TipMotion& motion, Event event, double before,
                              double past_end) const NONBLOCKING;
  [[nodiscard]] Occurrence first_event(const CellState& state, const TipMotion& motion, double at,
                                       const Pose& end) const NONBLOCKING;
  void happen(CellState& state, Event event, const Pose& pose, double now_s) const NONBLOCKING;
  [[nodiscard]] CellForce force(CellState& state, const Pose& pose, const TipMotion& motion,
                                double dt_s) const NONBLOCKING;
  void relax(CellState& state, const Pose& pose, double dt_s) const NONBLOCKING;
  void hold(CellState& state, const Vec3& force_on_needle, double vacuum_Pa) const NONBLOCKING;
  [[nodiscard]] double seat_radius_m() const NONBLOCKING;

  CellParams params_;
  std::optional<HolderParams> holder_;
  std::shared_ptr<const MembraneTruth> outer_table_, inner_table_;
  Vec3 centre_m_ = Vec3::Zero();
  double R_m_ = 0, R_inner_m_ = 0;
  double outer_Eh_ = 0, inner_Eh_ = 0;
  double outer_puncture_m_ = 0, inner_puncture_m_ = 0;
};

}  // namespace punctum::sim
