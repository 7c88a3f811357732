#include "vision/events/contact.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace punctum::vision {

namespace {

// Label with the largest count; the background, label 0, does not count. 0 when all counts are 0.
int largest_label(const std::vector<int>& count) {
  int best = 0;
  for (std::size_t i = 1; i < count.size(); ++i) {
    if (count[i] > 0 && (best == 0 || count[i] > count[static_cast<std::size_t>(best)])) {
      best = static_cast<int>(i);
    }
  }
  return best;
}

}  // namespace

Classes merge_classes(const cv::Mat& binary, const cv::Mat& needle_pixels, const cv::Mat& cell_pixels,
                      int rows) {
  Classes out;
  if (binary.empty() || needle_pixels.size() != binary.size() || cell_pixels.size() != binary.size()) {
    return out;
  }
  cv::Mat grown, labels;
  if (rows > 1) {
    const cv::Mat column = cv::Mat::ones(rows, 1, CV_8U);
    cv::dilate(binary, grown, column, cv::Point(0, (rows - 1) / 2), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  } else {
    grown = binary;
  }
  const int n = cv::connectedComponents(grown, labels, 8, CV_32S);
  std::vector<int> needle(static_cast<std::size_t>(n), 0), cell(static_cast<std::size_t>(n), 0);
  for (int y = 0; y < labels.rows; ++y) {
    const int* l = labels.ptr<int>(y);
    const std::uint8_t *a = needle_pixels.ptr(y), *b = cell_pixels.ptr(y);
    for (int x = 0; x < labels.cols; ++x) {
      needle[static_cast<std::size_t>(l[x])] += a[x] > 0;
      cell[static_cast<std::size_t>(l[x])] += b[x] > 0;
    }
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

bool touches(const std::optional<double>& gap_px, bool merged, bool touched_before) {
  constexpr double kBegin_px = 0.35, kEnd_px = 1.0;
  constexpr double kCertain_px = -1;  // so far inside they touch whatever the labels say
  if (!gap_px) {
    return merged;
  }
  return *gap_px < (touched_before ? kEnd_px : kBegin_px) && (merged || *gap_px < kCertain_px);
}

}  // namespace punctum::vision
