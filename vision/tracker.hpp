// Frame -> what is seen: the paper's vision loop, one frame at a time. Not for the real-time core: allocates.
#pragma once

#include <memory>

#include "hal/devices.hpp"
#include "vision/result.hpp"

namespace punctum::vision {

class Tracker {
 public:
  Tracker(const VisionConfig& config, int width, int height);
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  // Before the first frame. The circle replaces the Hough transform, the template what is cut at the start
  // (CV_8U).
  void seed_circle(const Circle& circle);
  void holder_template(const cv::Mat& pattern);

  // The result stays valid until the next call. Never throws on any pixels; a frame of another size or
  // without contrast gives a verdict and leaves what was followed as it was.
  const Result& process(const hal::Frame& frame);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace punctum::vision
