// The common shape of an edge as one or two blurred steps, and a halo where there is one.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "vision/membrane/edge_shape.hpp"

namespace punctum::vision {

// Unknown are the place of the own step, the blur, and the places of the others against it; for given ones,
// level and heights follow by linear least squares.
class BlurredSteps {
 public:
  // shape: grey levels, from edge.inside px within the contour outwards.
  BlurredSteps(const std::vector<double>& shape, const EdgeShape& edge)
      : shape_(shape), edge_(edge), halo_(bright_outside(shape, edge)) {}

  struct Fit {
    double own = 0;  // where the own step lies, px from the contour
    double blur_px = 0, nearby_height = 0;
    bool halo = false;
  };
  // Empty when no such steps explain the shape.
  [[nodiscard]] std::optional<Fit> fit();

 private:
  static constexpr int kUnknown = 4;  // own place; blur; places of the nearby step and of the halo against it
  [[nodiscard]] static bool bright_outside(const std::vector<double>& shape, const EdgeShape& edge);
  [[nodiscard]] bool free(int k) const {
    return k < 2 || (k == 2 && edge_.nearby && edge_.nearby->tolerance_px > 0) || (k == 3 && halo_);
  }
  double residuals(const cv::Vec4d& x, std::vector<double>& out);
  [[nodiscard]] cv::Vec4d step(const cv::Vec4d& x, double damping);

  const std::vector<double>& shape_;
  const EdgeShape& edge_;
  bool halo_;
  std::vector<double> now_, ahead_;
  cv::Vec4d heights_;  // of the last residuals: level, own step, nearby step, halo
};

}  // namespace punctum::vision
