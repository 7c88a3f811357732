#include "rt/control/local_membrane_model.hpp"

#include <algorithm>
#include <cmath>

namespace punctum::rt {
namespace {

// What an observation may claim at most; beyond it the frame is not believed.
constexpr double kFarthest_m = 5e-3;     // no objective that shows a needle's tip has a field of 10 mm
constexpr double kLargestCell_m = 2e-3;  // radius; an egg of Xenopus has 0.65 mm
// An undeformed cell keeps its size. 10 % of R are 17 % of the law's force, as much as one pixel in the depth
// and the width of the dimple makes, and far more than the fit of a circle scatters.
constexpr double kRadiusPart = 0.1;
// Depth of the dimple by that of the tip: 1 while the membrane lies on the tip, below 0.7 a frame after it
// has given way, as its recoil takes some 50 ms.
constexpr double kLetGo = 0.8;
// Before the needle touches a cell it may be pushed by its holder; a cell that is further off than half its
// radius is another one.
constexpr double kStrayPart = 0.5;
// Width of the dimple over sqrt(2 R w_d), the width of a sphere that is cut flat at that depth. A scene says
// 0.6 where nobody has measured it; a dimple far from that is a wrong contour.
constexpr double kScaleMin = 0.1;
constexpr double kScaleMax = 3;
// Stage minus picture: a change slower than this time constant is drift. After a disagreement, the two agree
// anew once both have seen the needle move alike by this many times disagree_m.
constexpr double kDrift_s = 10;
constexpr double kAgreesAgain = 2.5;
// Variance that the entry's place gains: a held cell wanders by 0.26 um in a second. Of a picture every 40 ms
// that shows it to 0.15 um, three tenths are then taken.
constexpr double kWander_m2_s = 7e-14;

[[nodiscard]] bool plausible(const double (&p)[3]) NONBLOCKING {
  return std::abs(p[0]) < kFarthest_m && std::abs(p[1]) < kFarthest_m && std::abs(p[2]) < kFarthest_m;
}
[[nodiscard]] hal::Vec3 vec(const double (&p)[3]) NONBLOCKING { return {p[0], p[1], p[2]}; }

// In the picture's plane: no picture tells depth.
[[nodiscard]] double apart_m(const hal::Vec3& a, const hal::Vec3& b) NONBLOCKING {
  return hal::Vec3(a.x() - b.x(), a.y() - b.y(), 0).norm();
}

// Moves `value` by what is left of a correction, at most `most`.
void correct(double& value, double& left, double most) NONBLOCKING {
  const double now = std::clamp(left, -most, most);
  value += now;
  left -= now;
}

}  // namespace

void PoseHistory::push(const TipPose& pose) NONBLOCKING {
  // A clock that jumped back: what was kept has no order with what comes.
  if (size_ > 0 && pose.t_ns <= poses_[(next_ + kSize - 1) % kSize].t_ns) {
    size_ = 0;
  }
  poses_[next_] = pose;
  next_ = (next_ + 1) % kSize;
  size_ = std::min(size_ + 1, kSize);
}

bool PoseHistory::at(std::int64_t t_ns, TipPose& out) const NONBLOCKING {
  if (size_ == 0) {
    return false;
  }
  const auto pose = [this](std::size_t i) -> const TipPose& {  // i = 0: the oldest
    return poses_[(next_ + kSize - size_ + i) % kSize];
  };
  if (t_ns < pose(0).t_ns || t_ns > pose(size_ - 1).t_ns) {
    return false;
  }
  std::size_t low = 0;  // the last pose not after t
  std::size_t high = size_;
  while (high - low > 1) {  // at most 13 rounds: each halves kSize
    const std::size_t middle = (low + high) / 2;
    (pose(middle).t_ns <= t_ns ? low : high) = middle;
  }
  out = pose(low);
  if (low + 1 < size_ && out.t_ns < t_ns) {
    const TipPose& after = pose(low + 1);
    const double part = static_cast<double>(t_ns - out.t_ns) / static_cast<double>(after.t_ns - out.t_ns);
    out.tip_m += part * (after.tip_m - out.tip_m);
    out.axis += part * (after.axis - out.axis);
  }
  out.t_ns = t_ns;
  return true;
}

LocalMembraneModel::LocalMembraneModel(const LocalModelParams& params, double c_m, double R_m) NONBLOCKING
    : params_(params),
      c_m_(c_m),
      R_default_m_(R_m),
      dimple_scale_(params.dimple_scale) {
  membrane_.R_m = R_m;
}

bool LocalMembraneModel::observe(const Observation& seen, bool inside) NONBLOCKING {
  TipPose pose;
  implausible_ = false;
  if (!in_order(seen) || !history_.at(seen.exposure_ns, pose)) {
    return false;
  }
  const bool shows_needle = seen.has(Observation::tip_ok) && plausible(seen.tip_m);
  const bool shows_cell = shows_needle && seen.has(Observation::outer_ok) && plausible(seen.centre_m) &&
                          seen.R_m > c_m_ && seen.R_m < kLargestCell_m &&
                          std::abs(seen.gap_m) < kFarthest_m && seen.noise_m >= 0 &&
                          std::isfinite(seen.noise_m) && seen.R_sd_m >= 0 && std::isfinite(seen.R_sd_m) &&
                          seen.a_sd_m >= 0 && std::isfinite(seen.a_sd_m) && std::isfinite(seen.a_m);
  if (!shows_cell && !(inside && shows_needle && membrane_.known)) {
    return false;
  }
  if (!agrees(pose, vec(seen.tip_m))) {
    return false;
  }

  const Membrane3D now = shows_cell ? claimed_by(seen, pose) : Membrane3D{};
  if (shows_cell && !can_be(now)) {
    implausible_ = true;
    return false;
  }

  const double gain = shows_cell ? gain_of(seen) : 0;
  newest_exposure_ns_ = seen.exposure_ns;
  newest_frame_ = seen.frame;
  seen_ = true;
  ++used_;
  contact_ = seen.has(Observation::contact);
  // A tip that this very frame shows outside, or under a dimple as deep as the tip, is through nothing.
  const bool let_go = !shows_cell || seen.wd_m < -kLetGo * seen.gap_m;
  punctured_.see(seen.has(Observation::punctured) && let_go);
  inner_punctured_.see(seen.has(Observation::inner_punctured) && let_go);
  if (!shows_cell) {
    return true;
  }
  seen_gap_m_ = seen.gap_m;
  R_sd_m_ = seen.R_sd_m;
  seen_a_m_ = seen.a_m;
  seen_a_sd_m_ = seen.a_sd_m;
  remember_first(now);

  settled_ = false;
  if (!membrane_.known) {
    membrane_ = now;
    entry_correction_m_.setZero();
    R_correction_m_ = 0;
    scale_correction_ = 0;
    return true;
  }
  entry_correction_m_ = gain * (now.entry_m - membrane_.entry_m);
  entry_correction_m_.z() = 0;
  R_correction_m_ = gain * (now.R_m - membrane_.R_m);

  const bool shows_dimple = contact_ && !seen.has(Observation::punctured) && !inside &&
                            seen.wd_m > params_.dimple_min_m && seen.wd_m < seen.R_m && seen.a_m > c_m_ &&
                            seen.a_m < 2 * seen.R_m;
  if (shows_dimple) {
    const double scale = (seen.a_m - c_m_) / std::sqrt(2 * seen.R_m * seen.wd_m);
    scale_correction_ = gain * (std::clamp(scale, kScaleMin, kScaleMax) - dimple_scale_);
  }
  return true;
}

// A doubtful observation corrects less: the share of a Kalman filter, and no more than the scene allows.
double LocalMembraneModel::gain_of(const Observation& seen) NONBLOCKING {
  const double noise_m2 = seen.noise_m * seen.noise_m;
  if (!membrane_.known) {
    variance_m2_ = noise_m2;
    return params_.gain;
  }
  variance_m2_ += kWander_m2_s * static_cast<double>(seen.exposure_ns - newest_exposure_ns_) * 1e-9;
  const double gain = std::min(params_.gain, variance_m2_ / (variance_m2_ + noise_m2));
  variance_m2_ *= 1 - gain;
  return gain;
}

double LocalMembraneModel::depth_sd_m() const NONBLOCKING {
  return membrane_.known ? std::sqrt(variance_m2_ + kWander_m2_s * std::max(age_s_, 0.0)) : 0;
}

// Where this frame puts the entry, in the stage's frame: by the difference from the tip it shows.
Membrane3D LocalMembraneModel::claimed_by(const Observation& seen, const TipPose& pose) NONBLOCKING {
  Membrane3D now;
  now.known = true;
  now.axis = pose.axis.normalized();
  now.R_m = seen.R_m;
  hal::Vec3 centre = pose.tip_m + (vec(seen.centre_m) - vec(seen.tip_m));
  if (!focused_) {  // no picture tells depth: the needle is in focus when the run begins
    focused_ = true;
    focus_z_m_ = pose.tip_m.z();
  }
  centre.z() = focus_z_m_;
  now.entry_m = centre - now.R_m * now.axis;
  now.entry_m += (now.depth_m(pose.tip_m) + seen.gap_m) * now.axis;
  if (membrane_.known) {
    now.entry_m += now.R_m * (now.axis - membrane_.axis);  // the same cell on today's axis
    now.axis = membrane_.axis;
  }
  return now;
}

// Newer than the last one, not from the future, and not too old to be of use. Frame numbers rise; they begin
// anew only with a vision that was silent before.
bool LocalMembraneModel::in_order(const Observation& seen) NONBLOCKING {
  if (history_.size() == 0 || seen.exposure_ns < not_before_ns_ ||
      (seen_ && seen.exposure_ns <= newest_exposure_ns_)) {
    return false;
  }
  const std::int64_t age_ns = history_.newest_ns() - seen.exposure_ns;  // both lie after the start
  implausible_ = age_ns < 0 || (seen_ && !stale_ && seen.frame < newest_frame_);
  return !implausible_ && static_cast<double>(age_ns) * 1e-9 <= params_.stale_after_s;
}

void LocalMembraneModel::remember_first(const Membrane3D& claim) NONBLOCKING {
  if (first_frames_ == kFirstFrames) {
    return;
  }
  first_claims_[first_frames_++] = claim;
  if (first_frames_ == 1) {
    first_ = claim;
  } else if (first_frames_ == kFirstFrames) {
    // The frame with the median radius.
    for (const Membrane3D& one : first_claims_) {
      std::size_t smaller = 0;
      std::size_t larger = 0;
      for (const Membrane3D& other : first_claims_) {
        smaller += other.R_m < one.R_m ? 1 : 0;
        larger += other.R_m > one.R_m ? 1 : 0;
      }
      if (smaller <= kFirstFrames / 2 && larger <= kFirstFrames / 2) {
        first_ = one;
      }
    }
  }
}

bool LocalMembraneModel::can_be(const Membrane3D& claim) const NONBLOCKING {
  if (claim.R_m < (1 - kRadiusPart) * params_.R_min_m || claim.R_m > (1 + kRadiusPart) * params_.R_max_m) {
    return false;
  }
  if (touched_ && apart_m(claim.entry_m, touched_entry_m_) > params_.disagree_m) {
    return false;
  }
  return first_frames_ < kFirstFrames || (std::abs(claim.R_m - first_.R_m) <= kRadiusPart * first_.R_m &&
                                          apart_m(claim.entry_m, first_.entry_m) <= kStrayPart * first_.R_m);
}

void LocalMembraneModel::touch() NONBLOCKING {
  if (touched_ || !membrane_.known) {
    return;
  }
  touched_ = true;
  touched_entry_m_ = membrane_.entry_m;
  const double length = entry_correction_m_.norm();
  if (length > params_.disagree_m) {
    entry_correction_m_ *= params_.disagree_m / length;
  }
}

bool LocalMembraneModel::agrees(const TipPose& pose, const hal::Vec3& seen_tip_m) NONBLOCKING {
  hal::Vec3 off = pose.tip_m - seen_tip_m;
  off.z() = 0;
  const double since_s = static_cast<double>(pose.t_ns - registered_ns_) * 1e-9;
  registered_ns_ = pose.t_ns;
  if (!registered_) {
    registered_ = true;
    disagreed_ = false;
    registration_m_ = off;
    return true;
  }
  if ((off - registration_m_).norm() <= params_.disagree_m) {
    disagreed_ = false;
    registration_m_ += low_pass_part(since_s, kDrift_s) * (off - registration_m_);
    return true;
  }
  if (!disagreed_) {
    disagreed_ = true;
    disagreed_at_m_ = pose.tip_m;
    disagreed_off_m_ = off;
    return false;
  }
  hal::Vec3 way = pose.tip_m - disagreed_at_m_;
  way.z() = 0;
  if (way.norm() < kAgreesAgain * params_.disagree_m) {
    return false;
  }
  registered_ =
      (off - disagreed_off_m_).norm() > params_.disagree_m;  // a new agreement counts from the next frame
  disagreed_ = false;
  return false;
}

bool LocalMembraneModel::step(std::int64_t now_ns, const hal::Vec3& axis, double dt_s) NONBLOCKING {
  if (!started_) {
    started_ = true;
    not_before_ns_ = now_ns;
  }
  const bool moves = !settled_ || axis != membrane_.axis;
  if (moves) {
    move(axis, dt_s);
  }

  seen_ = seen_ && newest_exposure_ns_ <= now_ns;  // the clock went back: that time says nothing
  const double since_start_s = static_cast<double>(now_ns - not_before_ns_) * 1e-9;
  age_s_ = seen_ ? static_cast<double>(now_ns - newest_exposure_ns_) * 1e-9 : -1;
  stale_ = !seen_ || age_s_ > params_.stale_after_s;
  overdue_ = stale_ && since_start_s > params_.stale_after_s;
  fade_.step(!stale_, params_.return_s, params_.fade_s, dt_s);
  return moves;
}

void LocalMembraneModel::move(const hal::Vec3& axis, double dt_s) NONBLOCKING {
  // The cell stays where it is when the needle's axis tilts about it.
  const hal::Vec3 turn = membrane_.axis - axis;
  touched_entry_m_ += membrane_.R_m * turn;
  membrane_.entry_m += membrane_.R_m * turn;
  membrane_.axis = axis;
  first_.entry_m += first_.R_m * (first_.axis - axis);
  first_.axis = axis;

  const double most_m = params_.max_rate_m_s * dt_s;
  const double length = entry_correction_m_.norm();
  const double part = length > most_m ? most_m / length : 1.0;
  membrane_.entry_m += part * entry_correction_m_;
  entry_correction_m_ *= 1 - part;
  correct(membrane_.R_m, R_correction_m_, most_m);
  correct(dimple_scale_, scale_correction_, params_.dimple_scale_rate_1_s * dt_s);
  settled_ =
      part == 1 && R_correction_m_ == 0 && (scale_correction_ == 0 || params_.dimple_scale_rate_1_s == 0);
}

void LocalMembraneModel::restart(std::int64_t now_ns) NONBLOCKING {
  settled_ = false;
  membrane_.known = false;
  membrane_.R_m = R_default_m_;
  entry_correction_m_.setZero();
  R_correction_m_ = 0;
  R_sd_m_ = seen_a_m_ = seen_a_sd_m_ = 0;
  scale_correction_ = 0;
  dimple_scale_ = params_.dimple_scale;
  not_before_ns_ = now_ns;
  started_ = true;
  registered_ = false;
  seen_ = false;
  stale_ = true;
  age_s_ = -1;
  fade_.set(0);
  contact_ = false;
  punctured_ = inner_punctured_ = {};
  implausible_ = false;
  touched_ = false;
  first_ = {};
  first_frames_ = 0;
}

}  // namespace punctum::rt
