// Pictures and contours, as the tests of vision need them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <span>

#include "hal/devices.hpp"
#include "vision/image/contour.hpp"

namespace punctum::vision::test {

// The picture as a camera of 25 frames a second gives it; it must outlive the frame.
inline hal::Frame frame_of(const cv::Mat& picture, std::uint64_t sequence = 0) {
  hal::Frame frame;
  frame.pixels = picture.data;
  frame.width = picture.cols;
  frame.height = picture.rows;
  frame.stride = static_cast<int>(picture.step);
  frame.sequence = sequence;
  frame.exposure_ns = static_cast<std::int64_t>(sequence) * 40'000'000;
  return frame;
}

// From the nearest point of a closed contour, px.
inline double distance(const Point& p, std::span<const Point> closed) {
  double nearest2 = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < closed.size(); ++i) {
    const Point a = closed[i], d = closed[(i + 1) % closed.size()] - a;
    const double t = std::clamp((p - a).dot(d) / std::max(d.dot(d), 1e-12), 0.0, 1.0);
    const Point e = a + t * d - p;
    nearest2 = std::min(nearest2, e.dot(e));
  }
  return std::sqrt(nearest2);
}

// The points of one contour from the other one, which is closed: the largest distance, px, and the mean
// square.
inline double furthest(std::span<const Point> from, std::span<const Point> closed) {
  double most = 0;
  for (const Point& p : from) {
    most = std::max(most, distance(p, closed));
  }
  return most;
}
inline double mean_square(std::span<const Point> from, std::span<const Point> closed) {
  double sum = 0;
  for (const Point& p : from) {
    const double off = distance(p, closed);
    sum += off * off;
  }
  return sum / static_cast<double>(from.size());
}

}  // namespace punctum::vision::test
