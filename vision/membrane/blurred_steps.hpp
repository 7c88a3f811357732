// The common shape of an edge as one or two blurred steps, and a halo where there is one.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "vision/image/kept_vector.hpp"
#include "vision/membrane/edge_shape.hpp"

namespace punctum::vision {

// Unknown are the place of the own step, the blur, and the places of the others against it; for given ones,
// level and heights follow by linear least squares.
class BlurredSteps {
 public:
  // shape: grey levels, from edge.inside px within the contour outwards.
  BlurredSteps(const Vector<double>& shape, const EdgeShape& edge)
      : shape_(shape), edge_(edge), halo_(bright_outside(shape, edge)) {}

  struct Fit {
    double own = 0;  // where the own step lies, px from the contour
    double blur_px = 0, nearby_height = 0;
    bool halo = false;
    cv::Vec4d unknowns;
  };
  // Empty when no such steps explain the shape. last: of the frame before, to begin with.
  [[nodiscard]] std::optional<Fit> fit(const std::optional<cv::Vec4d>& last = std::nullopt);

 private:
  static constexpr int kUnknown = 4;  // own place; blur; places of the nearby step and of the halo against it
  [[nodiscard]] static bool bright_outside(const Vector<double>& shape, const EdgeShape& edge);
  [[nodiscard]] bool free(int k) const {
    return k < 2 || (k == 2 && edge_.nearby && edge_.nearby->tolerance_px > 0) || (k == 3 && halo_);
  }
  [[nodiscard]] std::optional<Fit> fit_from(cv::Vec4d x);
  double residuals(const cv::Vec4d& x, Vector<double>& out);
  [[nodiscard]] cv::Vec4d step(const cv::Vec4d& x, double damping);

  const Vector<double>& shape_;
  const EdgeShape& edge_;
  bool halo_;
  Vector<double> now_, ahead_;
  std::array<Vector<double>, kUnknown> ahead_of_;  // each of the unknowns
  Vector<cv::Vec4d> column_;
  cv::Vec4d heights_;  // of the last residuals: level, own step, nearby step, halo
};

}  // namespace punctum::vision
