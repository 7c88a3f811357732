#include "hal/sim/plant/cell.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/math/elementary.hpp"
#include "hal/sim/noise.hpp"

namespace punctum::sim {
namespace {

constexpr double kLip_m = 0.8e-6;        // a punctured membrane stays drawn in by this much round the needle
constexpr double kDragLength_m = 20e-6;  // immersed length at which the drag has its full value
constexpr double kGrip_N = 0.05e-6;      // friction of one hole on the needle
constexpr double kGripSpeed_m_s = 5e-6;  // above which it is Coulomb friction
constexpr double kHoleStiffness_N_m = 0.01;  // sideways, of the hole on the needle
constexpr double kFriction = 0.4;            // zona on the glass of the holding pipette
constexpr double kStick_N = 0.05e-6;         // holding force without suction
constexpr double kAdhesion_N = 60e-6;        // of a cell without a holding pipette, on its dish
constexpr double kLeak_s = 1.5;              // time constant of a ripped cell
constexpr int kTrials = 80;                  // at most, to locate an event
constexpr int kEventsPerStep = 8;

Vec3 vec(const double (&a)[3]) NONBLOCKING { return {a[0], a[1], a[2]}; }
void put(double (&a)[3], const Vec3& v) NONBLOCKING {
  for (int i = 0; i < 3; ++i) {
    a[i] = v[i];
  }
}

// Where a line meets a sphere: b unit along the line, m from the sphere's centre to a point of the line.
struct Chord {
  bool hit = false;
  double depth = 0;            // from the entry to m, along b
  double half = 0;             // half length of the chord
  Vec3 normal = Vec3::Zero();  // inward, unit, at the entry
  Vec3 push = Vec3::Zero();    // gradient of the depth along the normal: what a force upon it acts along
};
Chord chord(const Vec3& m, const Vec3& b, double R) NONBLOCKING {
  Chord c;
  const double along = b.dot(m);
  const Vec3 across = m - along * b;
  const double rest = R * R - across.squaredNorm();
  if (!(rest > 0)) {
    return c;
  }
  c.hit = true;
  c.half = std::sqrt(rest);
  c.depth = along + c.half;
  c.normal = (c.half * b - across) / R;
  c.push = c.normal - (c.depth / (c.half * R)) * across;  // of (along + half) half / R, the axis held
  return c;
}

}  // namespace

enum class Cell::Event : std::uint8_t { none, touch, leave, outer_gives, inner_gives, far_wall, rip };

struct Cell::Occurrence {
  Event event = Event::none;
  double at = 1;  // part of the step's way
};

// The needle against the undeformed cell at one instant.
struct Cell::Pose {
  Vec3 tip, axis;
  Chord outer, inner;
  double normal_depth = 0;  // of the tip past the outer surface, along its normal
  double inner_normal_depth =
      0;                // past the inner one, of what touches it: the zona while intact, else the tip
  double sideways = 0;  // of the needle's axis from the hole
  Vec3 from_hole = Vec3::Zero();
};

Cell::Cell(const CellParams& params, const NeedleParams& needle, const std::optional<HolderParams>& holder,
           std::uint64_t seed, int cell_index)
    : params_(params), holder_(holder) {
  const double seat = seat_radius_m();
  outer_table_ = std::make_shared<const MembraneTruth>(
      MembraneShape{needle.radius_m / params_.R_m, seat / params_.R_m, params_.nu, params_.zona_pretension});
  if (params_.inner) {
    const double R = params_.R_m - params_.zona_h_m - params_.inner_gap_m;
    inner_table_ = std::make_shared<const MembraneTruth>(
        MembraneShape{needle.radius_m / R, seat / params_.R_m, params_.nu, params_.inner_pretension});
  }
  renew(seed, cell_index);
}

// The fire-polished mouth is a shallow bowl; the cell sits in it half-way across its wall.
double Cell::seat_radius_m() const NONBLOCKING {
  return holder_ ? std::min(0.5 * (holder_->inner_radius_m + holder_->outer_radius_m), 0.7 * params_.R_m)
                 : 0.5 * params_.R_m;
}

void Cell::renew(std::uint64_t seed, int cell_index) NONBLOCKING {
  const Noise noise(seed, Noise::Stream::free_use, static_cast<std::uint64_t>(cell_index));
  const auto factor = [&](std::uint64_t n) {
    return std::max(0.3, 1 + params_.spread * std::clamp(noise.gaussian(n), -2.5, 2.5));
  };
  R_m_ = params_.R_m * factor(0);
  outer_Eh_ = params_.zona_E_Pa * params_.zona_h_m * factor(1);
  inner_Eh_ = params_.inner_E_Pa * params_.inner_h_m * factor(2);
  R_inner_m_ = params_.inner ? std::max(0.2 * R_m_, R_m_ - params_.zona_h_m - params_.inner_gap_m) : 0;
  centre_m_ = params_.centre_m;
  if (holder_) {
    centre_m_.x() += R_m_ - params_.R_m;  // the mouth stays, the cell reaches further
  }
  outer_puncture_m_ = R_m_ * outer_table_->depth_at_strain(params_.zona_puncture_strain);
  inner_puncture_m_ =
      params_.inner ? R_inner_m_ * inner_table_->depth_at_strain(params_.inner_puncture_strain) : 0;
}

Vec3 Cell::centre_m(const CellState& state) const NONBLOCKING { return centre_m_ + vec(state.offset_m); }

Vec3 Cell::holder_mouth_m() const NONBLOCKING {
  return params_.centre_m + Vec3(-params_.R_m, holder_ ? holder_->drop_m : 0, 0);
}

double TipMotion::time_at(double way) const NONBLOCKING {
  const double length = (tip_end_m - tip_begin_m).norm();
  if (!(lag_s > 0 && knee_m > 0 && length > 0 && left_m > length)) {
    return way;
  }
  // In lags, from left_m to `left`.
  const auto lags = [this](double left) {
    return (std::max(left_m, knee_m) - std::max(left, knee_m)) / knee_m +
           math::log(std::min(left_m, knee_m) / std::min(left, knee_m));
  };
  const double part = lags(left_m - way * length) / lags(left_m - length);
  return std::isfinite(part) ? std::clamp(part, 0.0, 1.0) : way;
}

Cell::Pose Cell::pose(const CellState& state, const TipMotion& motion, double s) const NONBLOCKING {
  Pose p;
  p.tip = motion.tip_begin_m + s * (motion.tip_end_m - motion.tip_begin_m);
  p.axis = (motion.axis_begin + s * (motion.axis_end - motion.axis_begin)).normalized();
  const Vec3 m = p.tip - centre_m(state);
  p.outer = chord(m, p.axis, R_m_);
  if (p.outer.hit) {
    p.normal_depth = p.outer.depth * p.outer.normal.dot(p.axis);
  }
  if (params_.inner) {
    p.inner = chord(m, p.axis, R_inner_m_);
    if (p.inner.hit) {
      const double thickness = state.outer.punctured ? 0 : params_.zona_h_m;
      p.inner_normal_depth = p.inner.depth * p.inner.normal.dot(p.axis) + thickness;
    }
  }
  if (state.outer.punctured) {
    const Vec3 hole = p.tip - vec(state.hole_m);
    p.from_hole = hole - hole.dot(p.axis) * p.axis;
    p.sideways = p.from_hole.norm();
  }
  return p;
}

// Dimples at a pose reached after dt_s without events. Intact ones follow what pushes them; punctured ones
// recoil exponentially, to a lip while the needle is in the hole.
void Cell::relax(CellState& state, const Pose& p, double dt_s) const NONBLOCKING {
  const auto keep = [&]() NONBLOCKING { return math::exp(-dt_s / params_.recoil_s); };
  const bool inside = p.outer.hit && p.outer.depth > 0;
  const auto aim = [&](MembraneState& membrane, const Chord& c) {
    put(membrane.axis_m, c.normal);
    put(membrane.lean, p.axis / c.normal.dot(p.axis) - c.normal);
  };
  const auto recoil = [&](MembraneState& membrane, bool plugged) {
    const double lip = plugged ? std::min(kLip_m, membrane.puncture_depth_m) : 0;
    membrane.dimple_m = lip + (membrane.dimple_m - lip) * keep();
  };
  if (state.outer.punctured) {
    recoil(state.outer, inside);
  } else if (!state.attached) {
    state.outer.dimple_m *= keep();
  } else {
    state.outer.dimple_m = inside ? p.normal_depth : 0;
    if (p.outer.hit) {
      aim(state.outer, p.outer);
    }
  }
  if (!params_.inner) {
    return;
  }
  if (state.inner.punctured) {
    recoil(state.inner, inside && p.inner.hit && p.inner.depth > 0);
  } else {
    // After its puncture the zona no longer pushes the inner membrane, which recoils until it meets the tip.
    const double pushed = inside && p.inner.hit && state.attached ? std::max(0.0, p.inner_normal_depth) : 0;
    const double left = state.outer.punctured || !state.attached ? state.inner.dimple_m * keep() : 0;
    if (pushed > 0) {
      aim(state.inner, p.inner);
    }
    state.inner.dimple_m = std::max(pushed, left);
  }
}

// Suction, and friction under the needle's own push, against what the needle does to the cell.
void Cell::hold(CellState& state, const Vec3& force_on_needle, double vacuum_Pa) const NONBLOCKING {
  const Vec3 load = -force_on_needle;
  if (!holder_) {
    if (load.norm() > kAdhesion_N) {
      state.attached = false;
    }
    return;
  }
  constexpr double pi = 3.14159265358979323846;
  const double suction =
      kStick_N + std::max(0.0, vacuum_Pa) * pi * holder_->inner_radius_m * holder_->inner_radius_m;
  const double push = -load.x();  // the holding pipette is on the left
  const double sideways = math::hypot(load.y(), load.z());
  const bool holds =
      push >= 0 ? sideways <= suction + kFriction * push : math::hypot(push, sideways) <= suction;
  if (!holds) {
    state.attached = false;
  }
}

// How far past an event a pose is: it has happened where this is positive.
double Cell::past(const CellState& state, Event event, const Pose& p) const NONBLOCKING {
  constexpr double never = -std::numeric_limits<double>::infinity();
  if (event == Event::leave) {
    return !state.contact ? never : p.outer.hit ? -p.outer.depth : -never;
  }
  if (!p.outer.hit) {
    return never;
  }
  if (event == Event::touch) {
    return state.contact ? never : p.outer.depth;
  }
  if (!(p.outer.depth > 0)) {
    return never;
  }
  switch (event) {
    case Event::outer_gives:
      return state.outer.punctured || !state.attached ? never : p.normal_depth - outer_puncture_m_;
    case Event::inner_gives:
      return !params_.inner || !p.inner.hit || !state.outer.punctured || state.inner.punctured ||
                     !state.attached
                 ? never
                 : p.inner_normal_depth - inner_puncture_m_;
    case Event::far_wall:
      return state.far_wall_pierced || !state.attached
                 ? never
                 : p.outer.depth - 2 * p.outer.half - params_.far_wall_strain_margin_m;
    case Event::rip:
      return !state.outer.punctured || state.torn ? never : p.sideways - params_.tear_lateral_m;
    default:
      return never;
  }
}

// Where on the way from `before` on an event that has happened at the end did: Illinois, and halves.
double Cell::locate(const CellState& state, const TipMotion& motion, Event event, double before,
                    double past_end) const NONBLOCKING {
  double past_before = past(state, event, pose(state, motion, before));
  if (past_before > 0) {
    return before;
  }
  double after = 1, past_after = past_end;
  int side = 0;
  constexpr double fine = std::numeric_limits<double>::epsilon();
  for (int i = 0; i < kTrials && after - before > 2 * fine; ++i) {
    const double secant = before + (after - before) * past_before / (past_before - past_after);
    const double trial = std::isfinite(secant) && i % 3 != 2 ? std::clamp(secant, before + fine, after - fine)
                                                             : before + (after - before) / 2;
    const double there = past(state, event, pose(state, motion, trial));
    if (there == 0) {
      return trial;
    }
    if (there > 0) {
      after = trial;
      past_after = there;
      if (side == 1) {
        past_before /= 2;
      }
      side = 1;
    } else {
      before = trial;
      past_before = there;
      if (side == -1) {
        past_after /= 2;
      }
      side = -1;
    }
  }
  return after;
}

// The first event on the way from `at` to the end, and where on it; Event::none when there is none.
Cell::Occurrence Cell::first_event(const CellState& state, const TipMotion& motion, double at,
                                   const Pose& end) const NONBLOCKING {
  Occurrence first;
  for (const Event event :
       {Event::touch, Event::outer_gives, Event::inner_gives, Event::far_wall, Event::rip, Event::leave}) {
    const double past_end = past(state, event, end);
    if (!(past_end > 0)) {
      continue;
    }
    const double there = locate(state, motion, event, at, past_end);
    if (first.event == Event::none || there < first.at) {
      first = {event, there};
    }
  }
  return first;
}

void Cell::happen(CellState& state, Event event, const Pose& p, double now_s) const NONBLOCKING {
  const auto give_way = [&](MembraneState& membrane, const Chord& c) {
    membrane.punctured = true;
    membrane.puncture_time_s = now_s;
    membrane.puncture_depth_m = membrane.dimple_m / c.normal.dot(p.axis);
  };
  switch (event) {
    case Event::touch:
      state.contact = true;
      if (state.first_contact_time_s < 0) {
        state.first_contact_time_s = now_s;
      }
      break;
    case Event::leave:
      state.contact = false;
      if (state.outer.punctured) {
        state.clear_time_s = now_s;
      }
      break;
    case Event::outer_gives:
      give_way(state.outer, p.outer);
      put(state.hole_m, p.tip - p.outer.depth * p.axis);
      break;
    case Event::inner_gives:
      give_way(state.inner, p.inner);
      break;
    case Event::far_wall:
      state.far_wall_pierced = true;
      break;
    case Event::rip:
      state.torn = true;
      break;
    case Event::none:
      break;
  }
}

CellForce Cell::step(CellState& state, const TipMotion& motion, double dt_s) const NONBLOCKING {
  // A cell that is torn off goes where the needle that carries it goes.
  if (!state.attached && state.contact) {
    const Vec3 moved = motion.tip_end_m - motion.tip_begin_m;
    put(state.offset_m, vec(state.offset_m) + moved);
    put(state.hole_m, vec(state.hole_m) + moved);
  }

  Pose end = pose(state, motion, 1);
  double at = 0, time = 0;  // parts of the way and of the time
  for (int handled = 0; handled < kEventsPerStep; ++handled) {
    const Occurrence first = first_event(state, motion, at, end);
    if (first.event == Event::none) {
      break;
    }
    at = first.at;
    const Pose p = pose(state, motion, at);
    const double time_now = motion.time_at(at);
    relax(state, p, (time_now - time) * dt_s);
    time = time_now;
    happen(state, first.event, p, state.time_s + time * dt_s);
    end = pose(state, motion, 1);
  }
  relax(state, end, (1 - time) * dt_s);
  state.time_s += dt_s;
  if (state.torn || state.far_wall_pierced) {
    state.leak = 1 - (1 - state.leak) * math::exp(-dt_s / kLeak_s);
  }
  return force(state, end, motion, dt_s);
}

// What the needle feels and what there is to see where the step ends; a force too large tears the cell off.
CellForce Cell::force(CellState& state, const Pose& p, const TipMotion& motion, double dt_s) const
    NONBLOCKING {
  CellForce out;
  out.contact = state.contact;
  out.aims_at_cell = p.outer.hit;
  const double full = 1 - state.leak;
  const MembraneTruth::Reading outer = outer_table_->read(state.outer.dimple_m / R_m_);
  const double pressure = state.outer.punctured ? outer_table_->pressure(0) : outer.pressure;
  out.pressure_Pa = full * pressure * outer_Eh_ / R_m_;
  if (!p.outer.hit) {
    return out;
  }

  out.depth_m = p.outer.depth;
  out.chord_m = 2 * p.outer.half;
  out.entry_m = p.tip - p.outer.depth * p.axis;
  put(state.entry_m, out.entry_m);
  if (state.outer.dimple_m > 0) {
    out.wd_m = state.outer.dimple_m / std::max(0.5, vec(state.outer.axis_m).dot(p.axis));
    out.a_m = outer.half_width * R_m_;
    out.rim_m = outer.rim_radius * R_m_;
    out.rim_depth_m = outer.rim_depth * R_m_;
  }
  if (state.inner.dimple_m > 0) {
    out.inner_wd_m = state.inner.dimple_m / std::max(0.5, vec(state.inner.axis_m).dot(p.axis));
  }
  if (!(p.outer.depth > 0)) {
    return out;
  }

  if (!state.outer.punctured) {
    out.strain = outer.strain;
    out.tension_N_m = outer.tip_tension * outer_Eh_;
  }
  if (!state.attached) {
    return out;  // a loose cell gives way
  }

  if (!state.outer.punctured) {
    out.outer_N = full * outer.force * outer_Eh_ * R_m_;
    out.force_N -= out.outer_N * p.outer.push;
  }
  if (params_.inner && !state.inner.punctured && p.inner.hit && p.inner_normal_depth > 0 &&
      p.inner_normal_depth >= state.inner.dimple_m) {
    out.inner_N = full * inner_table_->force(p.inner_normal_depth / R_inner_m_) * inner_Eh_ * R_inner_m_;
    out.force_N -= out.inner_N * p.inner.push;
  }
  out.membrane_N = -out.force_N.dot(p.axis);
  if (state.outer.punctured && dt_s > 0) {
    const Vec3 velocity = (motion.tip_end_m - motion.tip_begin_m) / dt_s;
    const double forwards = velocity.dot(p.axis);
    const double immersed = std::min(1.0, p.outer.depth / kDragLength_m);
    const double holes = 1 + (state.inner.punctured && p.inner.hit && p.inner.depth > 0 ? 1 : 0);
    const Vec3 drag = -params_.viscosity_Ns_m * immersed * velocity -
                      kGrip_N * holes * math::tanh(forwards / kGripSpeed_m_s) * p.axis;
    out.drag_N = drag.dot(p.axis);
    out.force_N += drag - full * kHoleStiffness_N_m * p.from_hole;
  }
  const double nominal_Pa = holder_ ? holder_->vacuum_Pa : 0;
  hold(state, out.force_N, motion.vacuum_Pa >= 0 ? motion.vacuum_Pa : nominal_Pa);
  return out;
}

int Cell::contour(const CellState& state, Membrane which, std::span<std::array<double, 2>> out) const
    NONBLOCKING {
  constexpr int kProfile = MembraneTruth::kProfile;
  const bool outer = which == Membrane::outer;
  if (out.size() < kContour || (!outer && !params_.inner)) {
    return 0;
  }
  const MembraneTruth& truth = outer ? *outer_table_ : *inner_table_;
  const MembraneState& membrane = outer ? state.outer : state.inner;
  const double R = outer ? R_m_ : R_inner_m_;
  const double w = membrane.dimple_m / R;

  std::array<std::array<double, 2>, kProfile> meridian;
  truth.profile(w, meridian);

  // The meridian plane that shows the dimple: its axis as the picture has it.
  const Vec3 centre = centre_m(state);
  double ux = -membrane.axis_m[0], uy = -membrane.axis_m[1];
  const double length = math::hypot(ux, uy);
  if (length > 1e-9) {
    ux /= length;
    uy /= length;
  } else {
    ux = 1;
    uy = 0;
  }
  const double shift_x = membrane.lean[0] * membrane.dimple_m, shift_y = membrane.lean[1] * membrane.dimple_m;
  for (int j = 0; j < kProfile; ++j) {
    const auto [r, z] = meridian[j];
    double follow = 0;  // of the dimple's sideways shift: 1 at its bottom
    if (w > 0) {
      follow = std::clamp((math::cos(truth.undeformed_theta(j)) - z) / w, 0.0, 1.0);
    }
    const double x = centre.x() + R * z * ux + follow * shift_x;
    const double y = centre.y() + R * z * uy + follow * shift_y;
    out[j] = {x - R * r * uy, y + R * r * ux};
    if (j > 0 && j < kProfile - 1) {
      out[kContour - j] = {x + R * r * uy, y - R * r * ux};
    }
  }
  return kContour;
}

}  // namespace punctum::sim
