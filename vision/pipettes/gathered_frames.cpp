#include "vision/pipettes/gathered_frames.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "vision/image/dispatched.hpp"
#include "vision/image/noise.hpp"

namespace punctum::vision {

namespace {

PUNCTUM_WIDE_LOOP void add_row(const std::uint8_t* row, int n, std::uint16_t* sum) {
  for (int x = 0; x < n; ++x) {
    sum[x] = static_cast<std::uint16_t>(sum[x] + row[x]);
  }
}

PUNCTUM_WIDE_LOOP void divide_row(const std::uint16_t* sum, int n, float by, std::uint8_t* out) {
  const float share = 1 / by;
  for (int x = 0; x < n; ++x) {
    out[x] = static_cast<std::uint8_t>(static_cast<float>(sum[x]) * share + 0.5F);
  }
}

}  // namespace

void GatheredFrames::add(const cv::Mat& grey, const std::optional<Point>& moved) {
  if (mean_.size() != grey.size()) {
    for (cv::Mat& m : frames_) {
      m.create(grey.size(), CV_8U);
    }
    mean_.create(grey.size(), CV_8U);
    sum_.create(1, grey.cols, CV_16U);
    count_ = 0;
  }
  motion_known_ = count_ == 0 || (motion_known_ && moved);
  last_ = (last_ + 1) % kMost;
  count_ = std::min(count_ + 1, kMost);
  grey.copyTo(frames_[slot(0)]);
  moved_[slot(0)] = moved.value_or(Point());
}

Point GatheredFrames::way(int age) const {
  Point sum;
  for (int since = 0; motion_known_ && since < age; ++since) {
    sum += moved_[slot(since)];
  }
  return sum;
}

const GradientField& GatheredFrames::one(int age, const cv::Rect& area, double sigma_px) {
  part_.compute(frames_[slot(age)], area, sigma_px);
  return part_;
}

const GradientField& GatheredFrames::at_rest(double sigma_px) {
  const cv::Rect whole({0, 0}, mean_.size());
  average(whole, {});
  noise_ = noise_level(mean_);
  at_rest_.compute(mean_, whole, sigma_px);
  return at_rest_;
}

const GradientField& GatheredFrames::moving(const cv::Rect& area, const Point& per_frame, double sigma_px) {
  std::array<cv::Point, kMost> behind;
  for (int age = 0; age < count_; ++age) {
    const Point so_far = way(age) + age * per_frame;
    behind[static_cast<std::size_t>(age)] = {static_cast<int>(std::lround(so_far.x)),
                                             static_cast<int>(std::lround(so_far.y))};
  }
  constexpr int kSmoothing_px = 4;
  average({area.x - kSmoothing_px, area.y - kSmoothing_px, area.width + 2 * kSmoothing_px,
           area.height + 2 * kSmoothing_px},
          behind);
  part_.compute(mean_, area, sigma_px);
  return part_;
}

// behind: where each frame, by its age, has what is in the last one.
void GatheredFrames::average(const cv::Rect& area, const std::array<cv::Point, kMost>& behind) {
  const cv::Rect within = area & cv::Rect({0, 0}, mean_.size());
  auto* const sum = sum_.ptr<std::uint16_t>();
  for (int y = within.y; y < within.y + within.height; ++y) {
    std::fill_n(sum, within.width, std::uint16_t{0});
    for (int age = 0; age < count_; ++age) {
      const auto& [dx, dy] = behind[static_cast<std::size_t>(age)];
      const cv::Mat& frame = frames_[slot(age)];
      const std::uint8_t* const row = frame.ptr(std::clamp(y - dy, 0, frame.rows - 1));
      // Beyond the border, as at it.
      const int left = within.x - dx, right = left + within.width;
      const int from = std::clamp(left, 0, frame.cols), to = std::clamp(right, from, frame.cols);
      for (int x = left; x < from; ++x) {
        sum[x - left] = static_cast<std::uint16_t>(sum[x - left] + row[0]);
      }
      add_row(row + from, to - from, sum + (from - left));
      for (int x = std::max(to, left); x < right; ++x) {
        sum[x - left] = static_cast<std::uint16_t>(sum[x - left] + row[frame.cols - 1]);
      }
    }
    divide_row(sum, within.width, static_cast<float>(count_), mean_.ptr(y) + within.x);
  }
}

}  // namespace punctum::vision
