#include "vision/events/contact.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "hal/math/elementary.hpp"
#include "vision/image/components.hpp"

namespace punctum::vision {

namespace {

// Label of the component with the largest count, from 1 on. 0 when all counts are 0.
int largest_label(const Vector<int>& count) {
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
  Vector<int> needle(all.box.size(), 0), cell(all.box.size(), 0);
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
  draw_mask(needle_pixels, std::span(&polygon, 1));
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

bool ContactTest::update(double gap_px, double sd_px, double speed_px) {
  constexpr double kChanges = 0.05;  // probability that the state changes in a frame: a visit takes some 20
  constexpr double kSystematic_px = 0.2;  // by which the tip and the outline may be off alike in all frames
  constexpr double kFarthest = 4;         // standard deviations: what is further off is as certain
  const bool due = last_gap_px_ < speed_px;  // touching is then as likely as not
  last_gap_px_ = gap_px;
  const double odds = math::exp(log_odds_), begins = due ? 0.5 : kChanges;
  const double before = math::log((begins + (1 - kChanges) * odds) / (1 - begins + kChanges * odds));
  // While apart any gap > 0 is as likely as another, while touching any < 0; both scatter as the measurement
  // does. The ratio of the likelihoods is then that of the normal distribution function at -z and at z. Its
  // logarithm is this cubic, within 6 % up to kFarthest (Bowling et al. 2009).
  const double z = std::clamp(gap_px / math::hypot(sd_px, kSystematic_px), -kFarthest, kFarthest);
  log_odds_ = before - (1.5976 + 0.07056 * z * z) * z;
  return log_odds_ > 0;
}

}  // namespace punctum::vision
