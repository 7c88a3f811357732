// Holding pipette: normalised correlation (eq. 1) in a window round its last position.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>

#include "vision/config.hpp"
#include "vision/pipette_trace.hpp"

namespace punctum::vision {

struct HolderFix {
  bool ok = false;
  Point mouth;          // centre of its mouth
  double score = 0;     // eq. 1
  double likeness = 0;  // the same with means removed
  cv::Rect2d box;       // where the template lies
  std::string why;      // when not ok
};

// Its tube, where it enters through one of these borders. height: of the picture, R_max: of a cell it can
// hold; px. noise: grey levels.
[[nodiscard]] std::optional<TubeTrace> find_holder_tube(const GradientField& field,
                                                        std::span<const Side> sides, double height,
                                                        double R_max, double noise);

class HoldingPipette {
 public:
  explicit HoldingPipette(const HolderVision& config) : config_(config) {}

  // The template: a given picture, or cut round the end of the tube found at the border. Says why not.
  [[nodiscard]] bool has_template() const noexcept { return !template_.empty(); }
  void use_template(const cv::Mat& pattern);  // CV_8U; the mouth is taken as its middle
  [[nodiscard]] std::string cut_template(const cv::Mat& grey, const TubeTrace& tube, double noise);

  // Moving window; the whole picture when the place is not known yet.
  [[nodiscard]] HolderFix find(const cv::Mat& grey);

 private:
  HolderVision config_;
  cv::Mat template_;
  Point mouth_in_template_;
  std::optional<Point> last_;  // top left corner of the template
  int lost_ = 0;
};

}  // namespace punctum::vision
