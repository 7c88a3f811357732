// Where the membrane meets the injection pipette, by the grey level along the pipette's edges (fig. 5).
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "vision/membrane/cleared_picture.hpp"
#include "vision/membrane/edge_shape.hpp"

namespace punctum::vision {

// One point on each edge of the needle: left and right, seen along its axis.
struct ContactPoints {
  std::array<std::optional<Point>, 2> point;
  std::array<double, 2> behind_tip{};  // distance behind the tip, px; where there is a point
};

struct MembraneOnNeedle {
  ContactPoints points;
  // px, mean of both sides; by the contour where no point is seen. Empty where the contour does not cross the
  // needle.
  std::optional<double> behind_tip;
};

// level: usual edge along the membrane, grey levels per px.
[[nodiscard]] MembraneOnNeedle membrane_on_needle(const ClearedPicture& picture, const NeedlePose& needle,
                                                  const Contour& outer, Polarity polarity, double level);

// While the needle pushes, the membrane lies on its end and blurs into the ends of the walls. Across the
// mouth of the lumen both are seen: the needle's end as it looked with nothing ahead of it, and near the
// outermost glass the membrane as it looks round the cell, with its halo and its inner face.
class TipOnMembrane {
 public:
  // With nothing within kClearAhead_px ahead of the tip.
  static constexpr double kClearAhead_px = 5.5;
  void learn(const GradientField& field, const NeedlePose& needle);

  static constexpr double kUsualBlur_px = 1.3;  // of a membrane in focus
  struct Tip {
    double ahead = 0;        // of the tip of the pose: the outermost glass, px
    double sd = 0;           // px
    double membrane = 0;     // ahead of the outermost glass, px
    double membrane_sd = 0;  // of its place in the picture, px
    double gone_odds = 0;    // log odds that it lies there, far behind the tip, and not on it
  };
  // Empty before anything was learnt. 0 where the tip lies far from where the pose has it, which is then its
  // deviation; 0, 0 where what is seen is no membrane on it, which then draws no end aside. noise: grey
  // levels. membrane: where its shape is not known, it is a step.
  [[nodiscard]] std::optional<Tip> ahead(const GradientField& field, double noise, const EdgeLearnt& membrane,
                                         const NeedlePose& needle) const;

 private:
  static constexpr double kStep_px = 0.25, kBack_px = 12, kAhead_px = 4;
  static constexpr std::size_t kPlaces = static_cast<std::size_t>((kBack_px + kAhead_px) / kStep_px) + 1;
  static constexpr double kFrom_px = 8, kTo_px = 3;  // of the tip: what is compared
  // A membrane on the tip may seem so far from the outermost glass; one that went back, so far behind it.
  static constexpr double kOffGlass_px = 1.5, kGone_px = 8;
  static constexpr std::size_t kOffGlass = static_cast<std::size_t>(2 * kOffGlass_px / kStep_px) + 1,
                               kGone = static_cast<std::size_t>((kGone_px - kOffGlass_px) / kStep_px);
  static constexpr std::size_t kCompared = static_cast<std::size_t>((kFrom_px + kTo_px) / kStep_px) + 1;
  // Grey levels along the axis, from behind.
  using Membrane = std::array<double, kCompared + kOffGlass + kGone - 1>;
  [[nodiscard]] static Membrane membrane_along(const EdgeLearnt& membrane, const NeedlePose& needle,
                                               double smoothed_px);
  std::array<double, kPlaces> grey_{};  // along the axis, from behind; mean over the frames
  int frames_ = 0;
};

}  // namespace punctum::vision
