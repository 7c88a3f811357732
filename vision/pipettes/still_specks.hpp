// Specks in the medium on the needle's way, on the sensor or in the dish, as long as they lie still: an end
// of the needle that comes to one looks as if it were somewhere else.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "vision/image/components.hpp"
#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

class StillSpecks {
 public:
  // The frame's grey levels (CV_8U) without the light that they take or add. Where there are none, the same
  // picture.
  [[nodiscard]] const cv::Mat& without(const cv::Mat& grey);
  // Of the frame that was asked for last, what lies ahead of the needle, `free_px` of medium; field: of the
  // picture without those that are known. noise: grey levels.
  void learn(const GradientField& field, double noise, const NeedlePose& needle, double free_px);

 private:
  struct Speck {
    cv::Rect box;               // with a margin of medium
    Vector<float> light;        // that it lets through, of what is beside it; row by row of the box
    Vector<std::uint8_t> part;  // 1: it, and its blur
    float grey = 0;             // beside it
    int frames = 0;             // that `light` is the mean of
    int missed = 0;             // frames in a row that did not show it
  };

  [[nodiscard]] bool look_at(Speck& speck, double noise) const;
  void find_new(const GradientField& field, double noise, const NeedlePose& needle, double free_px);
  // One component, of a part of the picture that begins at `origin`.
  template <class Ahead>
  void add(const Components& found, std::size_t component, const cv::Point& origin, const Ahead& is_ahead,
           double noise);

  Vector<Speck> specks_;
  cv::Mat frame_, without_;
  int frames_ = 0;
};

}  // namespace punctum::vision
