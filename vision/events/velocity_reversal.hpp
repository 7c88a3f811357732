// The paper's test of a puncture: until it, the membrane at the needle moves with the needle; at it, against
// the needle (fig. 9).
#pragma once

#include <cstdint>
#include <optional>

#include "vision/image/contour.hpp"

namespace punctum::vision {

struct MembraneAtNeedle {
  std::int64_t t_ns = 0;
  Point membrane;  // mean of the two contact points
  Point tip;
  Point axis;  // of the needle, unit, into the cell
};

class VelocityReversal {
 public:
  // least_px: motion of the membrane between two frames, against the needle, that is a reversal.
  explicit VelocityReversal(double least_px) : least_px_(least_px) {}

  // now: empty where needle or contact points are not seen. True from the puncture until the tip is outside
  // the membrane and the classes have parted.
  bool update(bool contact, const std::optional<MembraneAtNeedle>& now);
  // 0 unless this frame and one before it show the membrane at the needle.
  [[nodiscard]] double membrane_velocity_px_s() const noexcept { return velocity_px_s_; }

 private:
  double least_px_;
  std::optional<MembraneAtNeedle> last_;
  double pushed_px_ = 0;  // by the needle since they touch
  double velocity_px_s_ = 0;
  bool punctured_ = false;
};

}  // namespace punctum::vision
