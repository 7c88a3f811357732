// What the picture shows where the injection pipette is not. Once the pipette has come there, it is told from
// granules and specks by what it changes.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

class Backdrop {
 public:
  // Takes in what a frame shows far enough from the needle.
  void learn(const GradientField& field, const NeedlePose& needle);
  // Grey level of the smoothed picture, bilinear; picture coordinates. Empty where the needle was always
  // near.
  [[nodiscard]] std::optional<double> grey(const Point& p) const;

 private:
  cv::Mat mean_;  // CV_32F grey levels, the whole picture; less than 0: not seen without the needle
};

}  // namespace punctum::vision
