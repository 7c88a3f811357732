#include "vision/membrane/edge_profiles.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <opencv2/core.hpp>

#include "vision/image/blurred_step.hpp"
#include "vision/image/median.hpp"

namespace punctum::vision {

namespace {

// Between four pixels, the first of which is given; u and v: 2^12ths of a pixel.
float between_pixels(const std::uint8_t* first, int stride, int u, int v) {
  const std::uint8_t* next = first + stride;
  const int top = (first[0] << 12) + u * (first[1] - first[0]);
  const int bottom = (next[0] << 12) + u * (next[1] - next[0]);
  return static_cast<float>((top << 10) + v * ((bottom - top) >> 2)) * 0x1p-22F;
}

}  // namespace

EdgeProfiles::EdgeProfiles(const ClearedPicture& picture, const Contour& contour, double inside_px,
                           double outside_px)
    : points(contour.size()),
      samples(static_cast<std::size_t>((inside_px + outside_px) / kStep_px) + 1),
      groups((points + kSideBySide - 1) / kSideBySide),
      inside(inside_px),
      normal(points),
      grey(groups * samples),
      seen(groups * samples),
      seen_of(groups * kSideBySide) {
  // In variables of their own, with coordinates in 2^16ths of a pixel: this is where the time goes.
  constexpr double kOne = 1 << 16;
  const cv::Mat& m = picture.grey;
  const std::uint8_t *pixels = m.data, *hides = picture.covered.data;
  const int stride = static_cast<int>(m.step[0]), hides_stride = static_cast<int>(picture.covered.step[0]);
  const int right = (m.cols - 1) << 16, bottom = (m.rows - 1) << 16;
  const cv::Rect2d all(0, 0, m.cols - 1, m.rows - 1);
  const double length = place_of(samples - 1) - place_of(0);
  for (std::size_t i = 0; i < points; ++i) {
    const Point along = contour[(i + 2) % points] - contour[(i + points - 2) % points];
    const double l = cv::norm(along);
    const Point n = normal[i] = l > 0 ? Point(along.y / l, -along.x / l) : Point(1, 0);
    const Point from = contour[i] + place_of(0) * n;
    if (!all.contains(contour[i])) {
      continue;
    }
    const bool within = all.contains(from) && all.contains(from + length * n);
    const int dx = static_cast<int>(n.x * kStep_px * kOne), dy = static_cast<int>(n.y * kStep_px * kOne);
    int x = static_cast<int>(from.x * kOne), y = static_cast<int>(from.y * kOne), count = 0;
    const std::size_t lane = i % kSideBySide, first = i / kSideBySide * samples;
    for (std::size_t j = 0; j < samples; ++j, x += dx, y += dy) {
      if ((within || (x >= 0 && y >= 0 && x < right && y < bottom)) &&
          hides[((y + 0x8000) >> 16) * hides_stride + ((x + 0x8000) >> 16)] == 0) {
        const std::uint8_t* pixel = pixels + (y >> 16) * stride + (x >> 16);
        grey[first + j][lane] = between_pixels(pixel, stride, (x & 0xffff) >> 4, (y & 0xffff) >> 4);
        seen[first + j][lane] = 1;
        ++count;
      }
    }
    seen_of[i] = count;
  }
  take_off_means();
}

void EdgeProfiles::take_off_means() {
  for (std::size_t g = 0; g < groups; ++g) {
    Lanes *out = grey.data() + g * samples, sum{}, count{};
    const Lanes* known = seen_in(g);
    for (std::size_t j = 0; j < samples; ++j) {
      sum += out[j];
      count += known[j];
    }
    const Lanes mean = sum / (count > 1.0F ? count : 1.0F + Lanes{});
    for (std::size_t j = 0; j < samples; ++j) {
      out[j] -= known[j] * mean;
    }
  }
}

void EdgeProfiles::move_nearby(const Contour& contour, const std::vector<double>& soft, const Contour& face,
                               double height, double blur_px) {
  constexpr double kMoved_px = 0.7;      // what the two contours err by
  constexpr double kNotMoved_px = 0.05;  // less changes nothing
  constexpr double kApart = 2.5;
  std::vector<double> at(points);
  for (std::size_t i = 0; i < points; ++i) {
    at[i] = (face[i] - contour[i]).dot(normal[i]);
  }
  const double usual = median_of(at), spread = blur_px * std::numbers::sqrt2;
  if (usual < kApart * blur_px) {  // the picture does not tell the two apart
    return;
  }
  for (std::size_t i = 0; i < points; ++i) {
    const double off = at[i] - usual, by = soft[i] * off * off * off / (kMoved_px * kMoved_px + off * off);
    for (std::size_t j = 0; j < samples && std::abs(by) > kNotMoved_px; ++j) {
      const double s = place_of(j) - at[i];
      const double more = height * (blurred_step((s + by) / spread) - blurred_step(s / spread));
      grey[i / kSideBySide * samples + j][i % kSideBySide] += static_cast<float>(more);
    }
  }
}

}  // namespace punctum::vision
