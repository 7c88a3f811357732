// How obliquely the injection pipette is cut, and where a glass that is cut so ends.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_end.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

// By how much further back the glass ends, per px across the axis; near 0 where an end at right angles
// explains the picture as well.
struct Bevel {
  double tangent = 0;
  double sd = 0;
  double radius = 0;  // outer, of the glass there, px, where light from one side shows it; else 0
  // Of a sharp point whose glass was fitted: ahead of the end that the cut tells, and beside the axis, px;
  // else 0.
  double point_ahead = 0, point_aside = 0;
};

// The outermost glass, as certain as it would be if the cut were known, and the cut.
struct CutGlass {
  GlassEnd end;
  Bevel bevel;
};

// Both at once, where the blur is known, in bright field and in relief. By likelihood, with an end as above:
// the means over all ends and cuts, each as likely as it explains the picture. Specks tell nothing. Empty
// where the walls do not stand out; an end at the border of the range is one that lies further on.
[[nodiscard]] std::optional<CutGlass> cut_of_glass(const GradientField& field, double noise,
                                                   const NeedlePose& needle, double blur_px, double back,
                                                   double ahead);

// Coarsely, for every end within kReach_px of the tip of the pose and every cut: log likelihood over no
// needle, twice, of what granules leave.
struct LikelyEnds {
  static constexpr int kReach_px = 12;
  static constexpr std::size_t kCuts = 5;
  [[nodiscard]] static constexpr double tangent(std::size_t cut) {
    return 0.3 * (static_cast<double>(cut) - 2);
  }
  std::array<std::array<double, 2 * kReach_px + 1>, kCuts>
      gain{};  // of ends from ahead to behind, 1 px apart
};
[[nodiscard]] std::optional<LikelyEnds> likely_ends(const GradientField& field, double noise,
                                                    const NeedlePose& needle, double blur_px);

// Where a glass ends whose cut is known: the middle of its end, within `reach` px of the tip of the pose.
[[nodiscard]] std::optional<GlassEnd> end_of_known_cut(const GradientField& field, double noise,
                                                       const NeedlePose& needle, const Bevel& bevel,
                                                       double blur_px, double reach);

}  // namespace punctum::vision
