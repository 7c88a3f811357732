// A picture made ready for the membranes: its gradient, and what pipettes and impurities hide of it.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "hal/devices.hpp"
#include "vision/image/closed_path.hpp"
#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/holding_pipette.hpp"
#include "vision/pipettes/pipette_mask.hpp"

namespace punctum::vision {

struct ClearedPicture {
  cv::Mat grey;               // CV_8U, the whole picture
  GradientField field;        // of the area that is searched
  double noise = 0;           // grey levels
  double gradient_noise = 0;  // grey levels per px
  std::optional<HolderFace> holder_face;

  cv::Mat covered;  // CV_8U, the whole picture: 255 = pipette or impurity
  cv::Mat strong;   // CV_8U, field.area: 255 = strong gradient, with the pipettes, without the impurities

  // Why the frame is no picture of this size; empty when it is one.
  [[nodiscard]] static std::string lacking(const hal::Frame& frame, int width, int height);
  // The frame, which must have this size; `grey` lies on its pixels. Returns why it cannot be used; empty
  // when it can.
  [[nodiscard]] std::string load(const hal::Frame& frame, int width, int height);
  void compute_gradient(const cv::Rect& area);  // after load()

  // Covers the pipettes, and nothing else.
  void cover(const Vector<Polygon>& pipettes);
  // Covers what is strong, smaller than max_side px and away from the membranes, and sets `strong`.
  // Strong: above `threshold`, grey levels per px. Returns the number of impurities; 0 without
  // membranes.
  int cover_impurities(const Vector<Contour>& membranes, double threshold, double max_side);

  [[nodiscard]] double edge_floor() const noexcept { return 3 * gradient_noise; }  // less is no edge
  [[nodiscard]] double snake_floor() const noexcept {
    return 4 * gradient_noise;
  }  // its spread where it is flat
  [[nodiscard]] bool hidden(const Point& p) const {  // covered, or outside the picture
    const int x = static_cast<int>(p.x + 0.5), y = static_cast<int>(p.y + 0.5);
    return x < 0 || y < 0 || x >= covered.cols || y >= covered.rows || covered.ptr(y)[x] > 0;
  }

  // For a membrane that is pressed against the holding pipette. Behind the face of the pipette the membrane
  // cannot be; along the face it is not visible, because of the dark line of the face. expected: radius of
  // the membrane per angle of the band.
  // In relief the place of the face is uncertain, and its shadow is wide.
  void exclude_holder(EdgeBand& band, const Vector<double>& expected, bool relief = false) const;
  // In relief the holding pipette, thick and out of focus, casts a shadow far before its mouth: 1 for each
  // point of a contour that lies in it. Empty without a pipette.
  [[nodiscard]] Vector<std::uint8_t> in_shadow_of_holder(const Contour& contour) const;

 private:
  void find_strong(double threshold);
  void cover_rows(const cv::Range& rows);

  cv::Range rows_covered_{0, 0};  // those of `covered` that are not all 0 lie in it
  cv::Mat open_;                  // CV_8U, field.area: 255 = strong gradient that is not covered
  KeptMemory kept_strong_, kept_open_;
};

}  // namespace punctum::vision
