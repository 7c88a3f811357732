// Pictures in memory that stays.
#pragma once

#include <opencv2/core.hpp>

namespace punctum::vision {

// As a vector of kept_vector.hpp; of a usual picture's size at most.
[[nodiscard]] cv::Mat kept_picture(const cv::Size& size, int type);

// For pictures of a part whose size changes from frame to frame.
class KeptMemory {
 public:
  // In memory for a picture of size `whole`, so that later parts of it need no other.
  [[nodiscard]] cv::Mat part(const cv::Size& whole, const cv::Size& size, int type) {
    memory_.create(1, whole.area(), type);
    return memory_.colRange(0, size.area()).reshape(0, size.height);
  }

 private:
  cv::Mat memory_;
};

}  // namespace punctum::vision
