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
  if (in.membrane_px >= deepest_) {
    deepest_ = in.membrane_px;
    tip_at_deepest_ = in.tip_px;
  }
  // Both signs of fig. 9: against the picture the membrane moves back, against the needle it moves back by
  // more than the needle itself was withdrawn.
  const double back = deepest_ - in.membrane_px;
  const double needle_back = std::max(0.0, tip_at_deepest_ - in.tip_px);
  // A large step back is enough; a small one must last, or it is noise of the contact points.
  const double recoil = back - needle_back;
  recoil_frames_ = recoil > recoil_px_ ? recoil_frames_ + 1 : 0;
  if (!punctured_ && (recoil > 3 * recoil_px_ || recoil_frames_ >= 2)) {
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
  last_membrane_ = in.membrane_px;
  last_tip_ = in.tip_px;
  return punctured_;
}

}  // namespace punctum::vision
