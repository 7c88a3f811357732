#include "vision/events/puncture.hpp"

#include <algorithm>

namespace punctum::vision {

bool Puncture::update(const PunctureInput& in) {
  velocity_ = 0;
  ++frames_;
  if (punctured_ && in.gap_px > 2 * in.radius_px) {  // away from the cell: the next puncture may come
    *this = Puncture(recoil_px_);
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
  }
  if (!pushing_) {
    pushing_ = true;
    deepest_ = in.membrane_px;
    tip_at_deepest_ = in.tip_px;
  }
  // The needle pushes the membrane no faster than it moves itself: a place further ahead is a mistaken
  // contact point.
  double membrane = in.membrane_px;
  if (have_last_) {
    membrane =
        std::min(membrane, std::max(last_membrane_, deepest_) + std::max(0.0, in.tip_px - last_tip_) + 0.7);
  }
  if (membrane >= deepest_) {
    deepest_ = membrane;
    tip_at_deepest_ = in.tip_px;
  }
  const bool recoil = has_recoiled(in, membrane);
  punctured_ = punctured_ || recoil;
  const bool through = is_through_undented_membrane(in);
  punctured_ = punctured_ || through;
  have_last_ = true;
  last_ns_ = in.t_ns;
  last_membrane_ = membrane;
  last_tip_ = in.tip_px;
  return punctured_;
}

// Both signs of fig. 9: the membrane moves back in the picture, and further back than the needle was
// withdrawn. A punctured membrane gives up most of its dimple at once. A quarter of the dimple in two frames,
// or three quarters in one, is more than the scatter of the contact points.
bool Puncture::has_recoiled(const PunctureInput& in, double membrane_px) {
  const double back = deepest_ - membrane_px;
  const double needle_back = std::max(0.0, tip_at_deepest_ - in.tip_px);
  const double recoil = back - needle_back;
  const double dimple = std::max(0.0, deepest_ - (in.membrane_px - in.depth_px));
  recoil_frames_ = recoil > std::max(recoil_px_, 0.25 * dimple) ? recoil_frames_ + 1 : 0;
  return recoil_frames_ >= 2 || recoil > std::max(3 * recoil_px_, 0.75 * dimple);
}

// A tip far inside a membrane that is hardly dented is through it, whether or not the recoil was seen. One
// frame tells at the start, when no other came before; later three in a row do.
bool Puncture::is_through_undented_membrane(const PunctureInput& in) {
  const bool through = !punctured_ && -in.gap_px > 3 * in.radius_px && in.depth_px < -0.35 * in.gap_px;
  inside_frames_ = through ? inside_frames_ + 1 : 0;
  return inside_frames_ >= (frames_ < 3 ? 1 : 3);
}

namespace {
constexpr double kInnerRecoil_px = 3;  // the contour of a membrane that holds moves back by less
}

// While the membrane holds, its contour scatters by up to 5 px about the tip.
double InnerPuncture::least_behind_px(double radius_px) { return std::max(2 * radius_px, 6.0); }

bool InnerPuncture::update(bool outer_punctured, const std::optional<InnerOnNeedle>& seen, double radius_px) {
  if (!outer_punctured) {
    *this = {};
    return false;
  }
  bool gave_way = false;
  if (seen) {
    const double least = least_behind_px(radius_px);
    deepest_ = std::max(deepest_.value_or(seen->place_px), seen->place_px);
    // A tip that is seen too far ahead moves no membrane: it must have recoiled as well, or lie further back
    // than a tip is seen wrongly.
    const bool recoiled = *deepest_ - seen->place_px > kInnerRecoil_px;
    gave_way = seen->behind_tip_px > least && (recoiled || seen->behind_tip_px > 2 * least);
  }
  frames_ = gave_way ? frames_ + 1 : 0;
  punctured_ = punctured_ || frames_ >= 2;
  return punctured_;
}

}  // namespace punctum::vision
