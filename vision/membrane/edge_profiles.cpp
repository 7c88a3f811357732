#include "vision/membrane/edge_profiles.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <opencv2/core.hpp>

#include "vision/image/blurred_step.hpp"
#include "vision/image/dispatched.hpp"
#include "vision/image/edge_band.hpp"
#include "vision/image/median.hpp"

namespace punctum::vision {

namespace {

using LaneInts = int __attribute__((vector_size(kSideBySide * sizeof(int))));

// Of two pixels that lie side by side.
int both_at(const std::uint8_t* pixel) {
  std::uint16_t both = 0;
  std::memcpy(&both, pixel, sizeof both);
  return both;
}

// Rows along the normals of as many points, with coordinates in 2^16ths of a pixel.
struct RowsSampled {
  LaneInts x{}, y{}, dx{}, dy{};
};

// What no row shows is not seen, and 0. Tells how many samples are seen; their mean is taken off.
template <bool kMayBeCovered>
[[gnu::always_inline]] inline void sample_each(const cv::Mat& grey, const cv::Mat& covered,
                                               const RowsSampled& rows, std::size_t samples, Lanes* out,
                                               Lanes* seen, int* seen_of) {
  const std::uint8_t *pixels = grey.data, *hides = covered.data;
  const int stride = static_cast<int>(grey.step[0]), hides_stride = static_cast<int>(covered.step[0]);
  const int right = (grey.cols - 1) << 16, bottom = (grey.rows - 1) << 16;
  RowsSampled at = rows;
  LaneInts count{};
  Lanes sum{};
  for (std::size_t j = 0; j < samples; ++j, at.x += at.dx, at.y += at.dy) {
    const LaneInts within = (at.x >= 0) & (at.y >= 0) & (at.x < right) & (at.y < bottom);
    const LaneInts x = at.x & within, y = at.y & within;
    const LaneInts left = x >> 16, top = y >> 16, nearest_x = (x + 0x8000) >> 16,
                   nearest_y = (y + 0x8000) >> 16;
    LaneInts upper, lower, hidden{};
    for (int l = 0; l < static_cast<int>(kSideBySide); ++l) {
      const std::uint8_t* pixel = pixels + static_cast<std::ptrdiff_t>(top[l]) * stride + left[l];
      upper[l] = both_at(pixel);
      lower[l] = both_at(pixel + stride);
      if constexpr (kMayBeCovered) {
        hidden[l] = hides[static_cast<std::ptrdiff_t>(nearest_y[l]) * hides_stride + nearest_x[l]];
      }
    }
    const Lanes u = 0x1p-16F * __builtin_convertvector(x & 0xffff, Lanes),
                v = 0x1p-16F * __builtin_convertvector(y & 0xffff, Lanes);
    // The left one of two pixels is the lower byte.
    const Lanes upper_left = __builtin_convertvector(upper & 0xff, Lanes),
                upper_right = __builtin_convertvector(upper >> 8, Lanes),
                lower_left = __builtin_convertvector(lower & 0xff, Lanes),
                lower_right = __builtin_convertvector(lower >> 8, Lanes);
    const Lanes a = upper_left + u * (upper_right - upper_left),
                b = lower_left + u * (lower_right - lower_left);
    const LaneInts shown = within & (hidden == 0);
    const Lanes one = __builtin_convertvector(-shown, Lanes), value = one * (a + v * (b - a));
    out[j] = value;
    seen[j] = one;
    sum += value;
    count -= shown;
  }
  const Lanes many = __builtin_convertvector(count, Lanes),
              mean = sum / (many > 1.0F ? many : 1.0F + Lanes{});
  for (std::size_t j = 0; j < samples; ++j) {
    out[j] -= seen[j] * mean;
  }
  std::memcpy(seen_of, &count, sizeof count);
}

PUNCTUM_WIDE_LOOP void sample_rows(const cv::Mat& grey, const cv::Mat& covered, const RowsSampled& rows,
                                   std::size_t samples, Lanes* out, Lanes* seen, int* seen_of) {
  sample_each<true>(grey, covered, rows, samples, out, seen, seen_of);
}
PUNCTUM_WIDE_LOOP void sample_clear_rows(const cv::Mat& grey, const RowsSampled& rows, std::size_t samples,
                                         Lanes* out, Lanes* seen, int* seen_of) {
  sample_each<false>(grey, grey, rows, samples, out, seen, seen_of);
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
  constexpr double kOne = 1 << 16;
  const cv::Rect2d all(0, 0, picture.grey.cols - 1, picture.grey.rows - 1);
  for (std::size_t g = 0; g < groups; ++g) {
    RowsSampled rows;
    std::array<Point, 2 * kSideBySide> ends;
    ends.fill(contour[g * kSideBySide]);
    rows.x -= 1;  // a point beyond the last one, or outside of the picture: no sample is within it
    for (std::size_t l = 0; l < kSideBySide && g * kSideBySide + l < points; ++l) {
      const std::size_t i = g * kSideBySide + l;
      const Point along = contour[(i + 2) % points] - contour[(i + points - 2) % points];
      const double length = cv::norm(along);
      const Point n = normal[i] = length > 0 ? Point(along.y / length, -along.x / length) : Point(1, 0);
      const Point from = contour[i] + place_of(0) * n;
      ends[2 * l] = from;
      ends[2 * l + 1] = contour[i] + place_of(samples) * n;
      if (all.contains(contour[i])) {
        const auto lane = static_cast<int>(l);
        rows.x[lane] = static_cast<int>(from.x * kOne);
        rows.y[lane] = static_cast<int>(from.y * kOne);
        rows.dx[lane] = static_cast<int>(n.x * kStep_px * kOne);
        rows.dy[lane] = static_cast<int>(n.y * kStep_px * kOne);
      }
    }
    Lanes *out = grey.data() + g * samples, *shown = seen.data() + g * samples;
    int* many = seen_of.data() + g * kSideBySide;
    if (is_clear_about(picture.covered, ends)) {
      sample_clear_rows(picture.grey, rows, samples, out, shown, many);
    } else {
      sample_rows(picture.grey, picture.covered, rows, samples, out, shown, many);
    }
  }
}

void EdgeProfiles::move_nearby(const Contour& contour, const Vector<double>& soft, const Contour& face,
                               double height, double blur_px) {
  constexpr double kMoved_px = 0.7;      // what the two contours err by
  constexpr double kNotMoved_px = 0.05;  // less changes nothing
  constexpr double kApart = 2.5;
  Vector<double> at(points);
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
