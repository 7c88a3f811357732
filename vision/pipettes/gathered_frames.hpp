// The last frames, and their mean: what stands still in them shows through the noise.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>

#include "vision/image/contour.hpp"
#include "vision/image/gradient.hpp"

namespace punctum::vision {

class GatheredFrames {
 public:
  static constexpr int kMost = 8;

  // grey: CV_8U, of the same size as those before. moved: what is looked for has moved by, px, since the
  // frame before, where that is known.
  void add(const cv::Mat& grey, const std::optional<Point>& moved);
  void forget() noexcept { count_ = 0; }
  [[nodiscard]] int count() const noexcept { return count_; }
  // Of all frames but the first.
  [[nodiscard]] bool motion_known() const noexcept { return motion_known_; }

  // By which what is looked for has moved since the frame of that age, as far as that is known. Age 0: the
  // last.
  [[nodiscard]] Point way(int age) const;

  // Of one of them.
  [[nodiscard]] const GradientField& one(int age, const cv::Rect& area, double sigma_px);
  // Of the whole picture: what stands still. noise: of the mean, grey levels.
  [[nodiscard]] const GradientField& at_rest(double sigma_px);
  [[nodiscard]] double noise() const noexcept { return noise_; }
  [[nodiscard]] double noise_of_one() const noexcept { return noise_ * std::sqrt(count_); }
  // What moves by so many px per frame, besides what is known, at the place where the last frame has it. To
  // the nearest pixel, so that a frame's noise stays its own.
  [[nodiscard]] const GradientField& moving(const cv::Rect& area, const Point& per_frame, double sigma_px);

 private:
  void average(const cv::Rect& area, const std::array<cv::Point, kMost>& behind);
  [[nodiscard]] std::size_t slot(int age) const {
    return static_cast<std::size_t>((last_ + kMost - age) % kMost);
  }

  std::array<cv::Mat, kMost> frames_;
  std::array<Point, kMost> moved_;
  cv::Mat mean_, sum_;  // sum_: of a row
  GradientField at_rest_, part_;
  double noise_ = 0;
  int count_ = 0, last_ = 0;
  bool motion_known_ = true;
};

}  // namespace punctum::vision
