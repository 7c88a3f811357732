#include "vision/events/velocity_reversal.hpp"

#include <algorithm>

namespace punctum::vision {

bool VelocityReversal::update(bool contact, const std::optional<MembraneAtNeedle>& now) {
  velocity_px_s_ = 0;
  if (!now) {
    return punctured_;
  }
  const bool outside = (now->membrane - now->tip).dot(now->axis) > 0;
  if (!contact && outside) {
    *this = VelocityReversal(least_px_);
    return false;
  }
  if (last_ && now->t_ns > last_->t_ns) {
    const double moved = (now->membrane - last_->membrane).dot(now->axis);
    const double relative = (now->tip - last_->tip).dot(now->axis) - moved;
    velocity_px_s_ = moved / (static_cast<double>(now->t_ns - last_->t_ns) * 1e-9);
    // A membrane that follows a needle that withdraws has not given way.
    punctured_ = punctured_ || (pushed_px_ > least_px_ && moved < -least_px_ && relative > least_px_);
    pushed_px_ = std::max(0.0, pushed_px_ + moved);
  }
  last_ = now;
  return punctured_;
}

}  // namespace punctum::vision
