#include "hal/sim/truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace punctum::sim {
namespace {
constexpr double kBareMouth_m = -100e-6;  // of a holder that holds nothing
}

std::optional<Vec3> holder_mouth(const SimConfig& config) noexcept {
  if (!config.holder) {
    return std::nullopt;
  }
  if (!config.cell) {
    return Vec3(kBareMouth_m, config.holder->drop_m, 0);
  }
  return Vec3(config.cell->centre_m + Vec3(-config.cell->R_m, config.holder->drop_m, 0));
}

// The needle is taken as balls on its axis, closer together near the tip.
GlassClearance glass_clearance(const SimConfig& config, const Snapshot& s) noexcept {
  GlassClearance out;
  const Vec3 tip_m = s.stage.tip_m, axis = s.stage.axis;
  const NeedleParams& needle = config.needle;
  if (config.dish) {
    const double below_m = config.dish->floor_m - tip_m.z();
    out.floor_m = (config.dish->floor_m > 0 ? below_m : -below_m) - needle.radius_m;
  }
  const std::optional<Vec3> mouth_m = holder_mouth(config);
  if (!mouth_m) {
    return out;
  }
  constexpr int kBalls = 200;
  constexpr double kShaft_m = 5e-3;
  double least_m = std::numeric_limits<double>::max();
  for (int i = 0; i <= kBalls; ++i) {
    const double part = static_cast<double>(i) / kBalls;
    const double behind_m = part * part * kShaft_m;
    const double grown = behind_m < needle.taper_m ? behind_m / needle.taper_m : 1;
    const double radius_m = needle.radius_m + grown * (needle.shaft_radius_m - needle.radius_m);
    // The holder leads from its mouth to -x.
    const Vec3 at_m = tip_m - behind_m * axis - *mouth_m;
    const double before_m = at_m.x();
    const double beside_m =
        std::sqrt(at_m.y() * at_m.y() + at_m.z() * at_m.z()) - config.holder->outer_radius_m;
    const double out_m = before_m > 0 && beside_m > 0 ? std::sqrt(before_m * before_m + beside_m * beside_m)
                                                      : std::max(before_m, beside_m);
    least_m = std::min(least_m, out_m - radius_m);
  }
  out.holder_m = least_m;
  return out;
}

Truth truth_of(const SimConfig& config, const Snapshot& s) noexcept {
  Truth t;
  const auto seconds = [&s](std::int64_t ns) { return static_cast<double>(ns - s.start_ns) * 1e-9; };
  t.t_s = seconds(s.t_ns);
  t.tip_m = s.stage.tip_m;
  t.axis = s.stage.axis;
  t.holder_mouth_m = holder_mouth(config);
  if (s.has_cell == 0) {
    return t;
  }
  const CellReading& r = s.cell_reading;
  t.cell = true;
  t.force_N = r.force_N;
  t.axial_force_N = -t.force_N.dot(t.axis);
  t.centre_m = r.centre_m;
  t.R_m = r.R_m;
  t.R_inner_m = r.R_inner_m;
  t.chord_m = r.chord_m;
  const Vec3 to_centre = t.centre_m - t.tip_m;
  const double along = to_centre.dot(t.axis);
  t.lateral_m = (to_centre - along * t.axis).norm();
  if (r.aims_at_cell != 0) {
    t.entry_m = r.entry_m;
    t.gap_m = -r.depth_m;
  } else {  // it passes beside the cell: where it comes nearest
    t.entry_m = t.tip_m + along * t.axis;
    t.gap_m = along;
  }
  t.wd_m = r.wd_m;
  t.a_m = r.a_m;
  t.contact = r.contact != 0;
  t.zona_punctured = s.cell.outer.punctured;
  t.punctured = s.puncture_ns != 0;
  if (s.puncture_ns != 0) {
    t.puncture_s = seconds(s.puncture_ns);
  }
  if (s.zona_puncture_ns != 0) {
    t.zona_puncture_s = seconds(s.zona_puncture_ns);
  }
  t.held = s.cell.attached;
  t.lost = s.cell.lost();
  return t;
}

}  // namespace punctum::sim
