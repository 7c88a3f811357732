#include "vision/puncture.hpp"

#include <algorithm>

namespace punctum::vision {

bool Puncture::update(const PunctureInput& in) {
  velocity_ = 0;
  relative_ = 0;
  ++frames_;
  if (punctured_) {
    if (in.gap_px > 2 * in.radius_px) {  // clear of the cell: the next one may come
      reset();
    }
  }
  if (!in.contact || !in.points) {
    have_last_ = false;
    inside_frames_ = 0;
    recoil_frames_ = 0;
    if (!in.contact) {
      pushing_ = false;
    }
    return punctured_;
  }
  if (have_last_ && in.t_ns > last_ns_) {
    const double dt = static_cast<double>(in.t_ns - last_ns_) * 1e-9;
    velocity_ = (in.membrane_px - last_membrane_) / dt;
    relative_ = velocity_ - (in.tip_px - last_tip_) / dt;
  }
  if (!pushing_) {
    pushing_ = true;
    first_ = in.membrane_px;
    deepest_ = in.membrane_px;
    tip_at_deepest_ = in.tip_px;
  }
  // Pushed, the membrane goes no faster than the needle: what jumps ahead of it is a mistaken point.
  double membrane = in.membrane_px;
  if (have_last_) {
    membrane =
        std::min(membrane, std::max(last_membrane_, deepest_) + std::max(0.0, in.tip_px - last_tip_) + 0.7);
  }
  if (membrane >= deepest_) {
    deepest_ = membrane;
    tip_at_deepest_ = in.tip_px;
  }
  // Both signs of fig. 9: against the picture the membrane moves back, against the needle it moves back by
  // more than the needle itself was withdrawn. A punctured membrane gives up most of its dimple at once; a
  // quarter of it in two frames, or three quarters in one, is no scatter of the contact points.
  const double back = deepest_ - membrane;
  const double needle_back = std::max(0.0, tip_at_deepest_ - in.tip_px);
  const double recoil = back - needle_back;
  const double dimple = std::max(0.0, deepest_ - (in.membrane_px - in.depth_px));
  const double least = std::max(recoil_px_, 0.25 * dimple);
  recoil_frames_ = recoil > least ? recoil_frames_ + 1 : 0;
  if (!punctured_ && (recoil_frames_ >= 2 || recoil > std::max(3 * recoil_px_, 0.75 * dimple))) {
    punctured_ = true;
  }
  // A tip far inside a membrane that is hardly dented is through it, whether or not the recoil was seen.
  if (!punctured_ && -in.gap_px > 3 * in.radius_px && in.depth_px < -0.35 * in.gap_px) {
    if (++inside_frames_ >= (frames_ < 3 ? 1 : 3)) {
      punctured_ = true;
    }
  } else {
    inside_frames_ = 0;
  }
  have_last_ = true;
  last_ns_ = in.t_ns;
  last_membrane_ = membrane;
  last_tip_ = in.tip_px;
  return punctured_;
}

}  // namespace punctum::vision
