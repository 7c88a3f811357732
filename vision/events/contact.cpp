#include "vision/events/contact.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "vision/image/components.hpp"

namespace punctum::vision {

namespace {

// Label of the component with the largest count, from 1 on. 0 when all counts are 0.
int largest_label(const std::vector<int>& count) {
  const auto best = std::max_element(count.begin(), count.end());
  return best != count.end() && *best > 0 ? static_cast<int>(best - count.begin()) + 1 : 0;
}

void add_pixels(const std::uint8_t* from, int n, std::uint8_t* to) {
  for (int x = 0; x < n; ++x) {
    to[x] |= from[x];
  }
}

// By an element one pixel wide and `rows` high.
cv::Mat dilated_upright(const cv::Mat& binary, int rows) {
  cv::Mat out = cv::Mat::zeros(binary.size(), CV_8U);
  const int below = rows / 2, above = rows - 1 - below;
  for (int y = 0; y < binary.rows; ++y) {
    for (int i = std::max(0, y - above); i <= std::min(binary.rows - 1, y + below); ++i) {
      add_pixels(binary.ptr(i), binary.cols, out.ptr(y));
    }
  }
  return out;
}

int set_pixels(const cv::Mat& mask, const PixelRun& run) {
  const std::uint8_t* row = mask.ptr(run.y);
  return static_cast<int>(std::count_if(row + run.from, row + run.to, [](std::uint8_t v) { return v > 0; }));
}

}  // namespace

Classes merge_classes(const cv::Mat& binary, const cv::Mat& needle_pixels, const cv::Mat& cell_pixels,
                      int rows) {
  Classes out;
  if (binary.empty() || needle_pixels.size() != binary.size() || cell_pixels.size() != binary.size()) {
    return out;
  }
  const Components all = components_of(rows > 1 ? dilated_upright(binary, rows) : binary);
  std::vector<int> needle(all.box.size(), 0), cell(all.box.size(), 0);
  for (const PixelRun& run : all.runs) {
    needle[run.component] += set_pixels(needle_pixels, run);
    cell[run.component] += set_pixels(cell_pixels, run);
  }
  out.needle = largest_label(needle);
  out.cell = largest_label(cell);
  out.merged = out.needle > 0 && out.needle == out.cell;
  return out;
}

bool needle_merges_with_cell(const ClearedPicture& picture, const NeedlePose& needle, const Contour& outer,
                             int rows) {
  const Point offset(picture.field.area.x, picture.field.area.y);
  cv::Mat needle_pixels = cv::Mat::zeros(picture.strong.size(), CV_8U), cell_pixels = needle_pixels.clone();
  Polygon polygon = needle_polygon(needle, picture.grey.size(), 1.5, 0.5);
  for (Point& p : polygon) {
    p -= offset;
  }
  draw_mask(needle_pixels, {polygon});
  for (const Point& p : outer) {
    if (!picture.hidden(p)) {
      const Point q = p - offset;
      cv::circle(cell_pixels,
                 cv::Point(static_cast<int>(std::lround(q.x)), static_cast<int>(std::lround(q.y))), 1,
                 cv::Scalar(255), cv::FILLED);
    }
  }
  return merge_classes(picture.strong, needle_pixels, cell_pixels, rows).merged;
}

namespace {

constexpr double kBegin_px = 0.35, kEnd_px = 1.0;
constexpr double kCertain_px = -1;  // so far inside they touch whatever the labels say

}  // namespace

bool merging_decides(const std::optional<double>& gap_px) {
  return !gap_px || (*gap_px >= kCertain_px && *gap_px < kEnd_px);
}

bool touches(const std::optional<double>& gap_px, bool merged, bool touched_before) {
  if (!gap_px) {
    return merged;
  }
  return *gap_px < (touched_before ? kEnd_px : kBegin_px) && (merged || *gap_px < kCertain_px);
}

}  // namespace punctum::vision
