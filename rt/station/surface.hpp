// The membranes' surfaces as vision reconstructs them from one picture. Plain data, lives in shared memory;
// the core does not read it.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::rt {

// A NURBS surface of degree 3 from the pole at the needle to the far one, and 2 round the axis; knots clamped
// and equally spaced along, 0 0 0 1 1 2 2 3 3 4 4 4 round. A control point along stands for nine round:
// middle + along * radius in the picture's plane, across * depth out of it, where (along, across, weight) are
// those of the rational circle (vision/surface/membrane_net.hpp).
struct MembraneSurface {
  static constexpr int kControlPoints = 32;

  // middle x, y; radius x, y; depth. Metres, microscope frame (hal/devices.hpp).
  double control_m[kControlPoints][5] = {};
};

struct CellSurface {
  enum Flag : std::uint64_t { outer_ok = 1U << 0, inner_ok = 1U << 1 };

  std::uint64_t frame = 0;       // as in the observation of the same picture
  std::int64_t exposure_ns = 0;  // station clock
  std::uint64_t flags = 0;       // which of the two were reconstructed
  MembraneSurface outer, inner;

  [[nodiscard]] bool has(Flag f) const NONBLOCKING { return (flags & f) != 0; }
};

}  // namespace punctum::rt
