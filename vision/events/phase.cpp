#include "vision/events/phase.hpp"

#include <limits>

namespace punctum::vision {

namespace {

constexpr double kSpeedGain = 0.4;         // weight of a new frame
constexpr double kWithdrawing_px = -0.15;  // per frame
constexpr double kIndentation_um = 3;      // deeper is more than a contact
constexpr double kClear_um = 10;           // further outside, the needle has left the cell
constexpr double kNextApproach_um = 5;     // nearer than this, the next insertion begins

}  // namespace

void TipMotion::update(const NeedlePose& needle) {
  if (last && needle.ok) {
    speed += kSpeedGain * ((needle.tip - *last).dot(needle.axis) - speed);
  }
  last = needle.ok ? std::optional<Point>(needle.tip) : std::nullopt;
  axis = needle.axis;
}

rt::Phase next_phase(rt::Phase last, const PhaseInput& now) {
  const double gap = now.gap_px.value_or(std::numeric_limits<double>::infinity());
  if (last == rt::Phase::puncture || last == rt::Phase::withdrawal) {
    if (gap > kClear_um * now.um_px) {
      return rt::Phase::clear;
    }
    return now.tip_speed < kWithdrawing_px ? rt::Phase::withdrawal : last;
  }
  if (now.punctured) {
    return rt::Phase::puncture;
  }
  if (now.contact) {
    return now.wd_px > kIndentation_um * now.um_px ? rt::Phase::indentation : rt::Phase::contact;
  }
  return last == rt::Phase::clear && gap >= kNextApproach_um * now.um_px ? last : rt::Phase::free;
}

}  // namespace punctum::vision
