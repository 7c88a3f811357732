#include "vision/events/puncture.hpp"

#include <algorithm>
#include <utility>

namespace punctum::vision {

namespace {
constexpr double kDecides =
    13.8;                        // log of a million: in so many frames a membrane that holds may be mistaken
constexpr double kOneFrame = 9;  // at most by the contact points of one frame, which may be mistaken ones
constexpr double kLearnt = 0.2;  // of a frame, of the membrane's share of the tip's depth
constexpr double kLittle_px2 = 4;         // as much counts the usual share as a frame with the tip 2 px deep
constexpr double kRefocusedFrames = 0.5;  // as much counts one in which the focus has changed
constexpr double kTaken = 3;              // log odds against a recoil, from which contact points are mistaken
constexpr double kFree = 5;  // by the picture beside the needle, which says it with log odds of 3 or more
}  // namespace

bool Puncture::update(const PunctureInput& in) {
  velocity_ = 0;
  ++frames_;
  if (has_left(in) && punctured_) {  // the next puncture may come
    *this = Puncture(recoil_px_);
  }
  if (in.contact && in.recoil > 0) {
    evidence_ += in.recoil;
    punctured_ = punctured_ || evidence_ > kDecides;
  }
  if (!in.contact || !in.points) {
    have_last_ = false;
    inside_frames_ = 0;
    if (!in.contact) {  // a frame that shows no contact points changes nothing
      evidence_ = 0;
      places_ = 0;
    }
    return punctured_;
  }
  if (have_last_ && in.t_ns > last_ns_) {
    const double dt = static_cast<double>(in.t_ns - last_ns_) * 1e-9;
    velocity_ = (in.membrane_px - last_membrane_) / dt;
  }
  weigh_recoil(in);
  const bool through = is_through_undented_membrane(in);
  punctured_ = punctured_ || evidence_ > kDecides || through;
  have_last_ = true;
  last_ns_ = in.t_ns;
  last_membrane_ = in.membrane_px;
  return punctured_;
}

bool Puncture::has_left(const PunctureInput& in) {
  constexpr int kFrames = 12;
  if (!in.gap_px) {
    ++unseen_frames_;
    return false;
  }
  const bool was_away = std::exchange(unseen_frames_, 0) >= kFrames;
  outside_frames_ = *in.gap_px > in.radius_px ? outside_frames_ + 1 : 0;
  return *in.gap_px > 2 * in.radius_px || outside_frames_ >= kFrames || (outside_frames_ > 0 && was_away);
}

// Both signs of fig. 9: the membrane goes back in the picture, and it is not where the tip would have it. A
// membrane that holds lies at the same share of the tip's depth from frame to frame; a punctured one gives up
// a quarter of that at least.
void Puncture::weigh_recoil(const PunctureInput& in) {
  if (in.refocused) {
    evidence_ = 0;
    places_ = 0;
    tip_square_ = kRefocusedFrames * in.tip_px * in.tip_px;
    tip_membrane_ = kRefocusedFrames * in.tip_px * in.membrane_px;
    share_ = (tip_membrane_ + kUsualShare * kLittle_px2) / (tip_square_ + kLittle_px2);
    return;
  }
  const double pushed = share_ * in.tip_px;
  const double least = std::max(recoil_px_, 0.25 * pushed);
  const double off = pushed - in.membrane_px;
  const auto known = std::min(places_, before_.size());
  const double deepest =
      known > 0 ? *std::max_element(before_.begin(), before_.begin() + static_cast<std::ptrdiff_t>(known))
                : in.membrane_px;
  const double recoil = std::min(off, deepest - in.membrane_px);
  const double ratio = least * (recoil - 0.5 * least) / (in.sd_px * in.sd_px);
  evidence_ = std::max(0.0, evidence_ + std::clamp(ratio, -kOneFrame, in.recoil < -kTaken ? 0 : kOneFrame));
  if (in.free && ratio > 0) {
    evidence_ += kFree;
  }
  before_[places_++ % before_.size()] = in.membrane_px;
  if (evidence_ == 0) {
    const double seen = pushed - std::clamp(off, -2 * in.sd_px, 2 * in.sd_px);
    tip_square_ += kLearnt * (in.tip_px * in.tip_px - tip_square_);
    tip_membrane_ += kLearnt * (in.tip_px * seen - tip_membrane_);
    share_ = (tip_membrane_ + kUsualShare * kLittle_px2) / (tip_square_ + kLittle_px2);
  }
}

// A tip far inside a membrane that is hardly dented is through it, whether or not the recoil was seen. One
// frame tells at the start, when no other came before; later three in a row do.
bool Puncture::is_through_undented_membrane(const PunctureInput& in) {
  constexpr int kTakenFrames = 12;
  const double inside_px = -in.gap_px.value_or(0);
  const bool through =
      !punctured_ && !in.unsharp && inside_px > 3 * in.radius_px && in.depth_px < 0.35 * inside_px;
  inside_frames_ = through ? inside_frames_ + 1 : 0;
  return inside_frames_ >= (frames_ < 3 ? 1 : in.recoil < -kTaken ? kTakenFrames : 3);
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
