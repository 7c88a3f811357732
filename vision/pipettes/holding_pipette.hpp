// Holding pipette: normalised correlation (eq. 1) in a window round its last position.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>

#include "vision/config.hpp"
#include "vision/image/gradient.hpp"
#include "vision/image/registration.hpp"
#include "vision/pipettes/tube_trace.hpp"

namespace punctum::vision {

struct HolderPose {
  bool ok = false;
  Point mouth;            // centre of the mouth
  double sd = 0;          // of the mouth, px; 0: eq. 1 does not tell it
  double score = 0;       // eq. 1
  double similarity = 0;  // the same with both means removed
  cv::Rect2d box;         // where the template lies
  std::string reason;     // when not ok
};

// The face of the holding pipette, against which the outer membrane lies.
struct HolderFace {
  Point mouth;            // its centre
  Point axis;             // unit, out of the mouth
  double half_width = 0;  // px
};

// Its tube, where it enters through one of these borders. height: of the picture; R_max: of a cell that it
// can hold; both in px. noise: grey levels.
[[nodiscard]] std::optional<TubeTrace> find_holder_tube(const GradientField& field,
                                                        std::span<const Side> sides, double height,
                                                        double R_max, double noise);

class HoldingPipette {
 public:
  explicit HoldingPipette(const HolderVision& config) : config_(config) {}

  // The template is a given picture, or is cut round the end of the tube that was found at the border.
  [[nodiscard]] bool has_template() const noexcept { return !template_.empty(); }
  void use_template(const cv::Mat& pattern);  // CV_8U; its middle is taken for the mouth
  // Returns why no template could be cut; empty when one was.
  [[nodiscard]] std::string cut_template(const cv::Mat& grey, const TubeTrace& tube, double noise);

  // Searches the window round the last position; the whole picture when no position is known.
  [[nodiscard]] HolderPose find(const cv::Mat& grey);
  // The place that eq. 1 told, more finely.
  void refine(const cv::Mat& grey, HolderPose& holder);

 private:
  HolderVision config_;
  cv::Mat template_;
  Registration registration_;
  Point mouth_in_template_;
  std::optional<Point> last_;  // top left corner of the template
  int lost_ = 0;               // frames in a row
  struct {
    std::optional<Point> last;
    int lost = 0;
  } before_;  // it was found in this frame
};

}  // namespace punctum::vision
