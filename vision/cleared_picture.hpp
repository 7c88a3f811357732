// A picture made ready for the membranes: its gradient, and what pipettes and impurities hide of it.
#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hal/devices.hpp"
#include "vision/gradient.hpp"
#include "vision/membrane_edge.hpp"
#include "vision/pipette_mask.hpp"

namespace punctum::vision {

// The mouth of the holding pipette, against which the outer membrane lies.
struct HolderFace {
  Point mouth;            // its centre
  Point axis;             // unit, out of the mouth
  double half_width = 0;  // px
};

struct ClearedPicture {
  cv::Mat grey;               // CV_8U, the whole picture
  GradientField field;        // of the part that is worked on
  double noise = 0;           // grey levels
  double gradient_noise = 0;  // grey levels per px
  std::optional<HolderFace> holder_face;

  cv::Mat covered;  // CV_8U, the whole picture: 255 = pipette or impurity
  cv::Mat strong;   // CV_8U, field.area: 255 = strong gradient, pipettes included, impurities taken out
  cv::Mat edge;     // CV_32F, field.area: Sobel magnitude, 0 where covered

  // A copy of the frame, which must have this size. Says why it cannot be worked on, or nothing.
  [[nodiscard]] std::string take(const hal::Frame& frame, int width, int height);
  void take_gradient(const cv::Rect& area);  // of grey, whose noise is known

  // What was covered before is not any more.
  void cover(const std::vector<Polygon>& pipettes);
  // Covers what is strong, smaller than max_side px and away from the membranes, and makes `strong` and
  // `edge`. Strong: above `threshold`, grey levels per px. Returns how many there are; none without a
  // membrane.
  int cover_impurities(const std::vector<Contour>& membranes, double threshold, double max_side);

  [[nodiscard]] double edge_floor() const noexcept { return 3 * gradient_noise; }  // less is no edge
  [[nodiscard]] bool hidden(const Point& p) const;                       // covered, or outside the picture
  [[nodiscard]] std::function<double(const Point&)> visibility() const;  // for EdgeBand; refers to this

  // A membrane pressed against the holding pipette: behind its face nothing of it can be, and along the face,
  // whose own dark line hides it, nothing is seen of it. expected: its radius per angle of the band.
  void keep_off_holder(EdgeBand& band, const std::vector<double>& expected) const;
};

}  // namespace punctum::vision
