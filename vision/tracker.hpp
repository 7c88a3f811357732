// The paper's vision loop, one frame at a time: what a frame shows of pipettes and cell. It allocates memory
// while something is searched, and is not for the real-time core.
#pragma once

#include <memory>
#include <optional>

#include "hal/devices.hpp"
#include "vision/result.hpp"

namespace punctum::vision {

class Tracker {
 public:
  // width, height: of the frames. Where they are finer than the scene needs they are binned, and what they
  // show is told in their pixels all the same.
  Tracker(const VisionConfig& config, int width, int height);
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  // To be called before the first frame. The circle replaces the Hough transform; the template (CV_8U)
  // replaces the one that is cut from the first frame.
  void seed_circle(const Circle& circle);
  void holder_template(const cv::Mat& pattern);

  // No frame was seen for a while: nothing is where it was, and everything is looked for anew in the next
  // one. Only the needle is still the same one, if its shaft lies where the stage then tells its tip.
  void after_gap();

  // stage: where the encoders of the manipulator have the needle's tip at the exposure, px; it may be off by
  // any constant, which is learnt. The result is valid until the next call. No pixels make it throw. A frame
  // of another size or without contrast gives a verdict and changes nothing else.
  const Result& process(const hal::Frame& frame, const std::optional<Point>& stage = std::nullopt);

 private:
  struct Impl;
  struct Binned;
  std::unique_ptr<Impl> impl_;
  std::unique_ptr<Binned> binned_;  // null: every pixel is looked at
};

}  // namespace punctum::vision
