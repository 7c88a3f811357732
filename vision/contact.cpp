#include "vision/contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "vision/dimple.hpp"

namespace punctum::vision {

namespace {

constexpr double kBesideEdge_px = 2.5;  // outside the needle's edge the membrane is free of the needle's blur
constexpr double kContourReach_px = 5;  // contact points lie so near the contour

// Grey levels per px along the needle's axis, > 0 for a membrane's outer face of that polarity.
double face_strength(double along_axis, Polarity polarity) {
  return polarity == Polarity::any            ? std::abs(along_axis)
         : polarity == Polarity::brighter_out ? -along_axis
                                              : along_axis;
}

}  // namespace

Classes merge_classes(const cv::Mat& binary, const cv::Mat& needle_pixels, const cv::Mat& cell_pixels,
                      int dilation_px) {
  Classes out;
  if (binary.empty() || needle_pixels.size() != binary.size() || cell_pixels.size() != binary.size()) {
    return out;
  }
  cv::Mat grown, labels;
  if (dilation_px > 0) {
    const cv::Mat column = cv::Mat::ones(dilation_px + 1, 1, CV_8U);
    cv::dilate(binary, grown, column, cv::Point(0, dilation_px / 2), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
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
  const auto largest = [](const std::vector<int>& count) {
    int best = 0;
    for (std::size_t i = 1; i < count.size(); ++i) {
      if (count[i] > 0 && (best == 0 || count[i] > count[static_cast<std::size_t>(best)])) {
        best = static_cast<int>(i);
      }
    }
    return best;
  };
  out.needle = largest(needle);
  out.cell = largest(cell);
  out.merged = out.needle > 0 && out.needle == out.cell;
  return out;
}

bool needle_merges_with_cell(const ClearedPicture& picture, const NeedleFix& needle, const Contour& outer,
                             int dilation_px) {
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
  return merge_classes(picture.strong, needle_pixels, cell_pixels, dilation_px).merged;
}

bool touches(const std::optional<double>& gap_px, bool merged, bool touched_before) {
  constexpr double kBegins_px = 0.35, kEnds_px = 1.0, kWithoutDoubt_px = -1;
  if (!gap_px) {
    return merged;
  }
  return *gap_px < (touched_before ? kEnds_px : kBegins_px) && (merged || *gap_px < kWithoutDoubt_px);
}

MembraneOnNeedle membrane_on_needle(const ClearedPicture& picture, const NeedleFix& needle,
                                    const Contour& outer, Polarity polarity, double level) {
  MembraneOnNeedle out;
  std::array<std::optional<double>, 2>
      crossing;  // of the contour with the lines beside the edges, behind tip
  const Point across(-needle.axis.y, needle.axis.x);
  for (std::size_t side = 0; side < 2; ++side) {
    const double u = (side == 0 ? -1 : 1) * (needle.half_width + kBesideEdge_px);
    if (const auto e = entry_point(outer, needle.tip + u * across, needle.axis)) {
      crossing[side] = -(*e - needle.tip).dot(needle.axis);
    }
  }
  if (!crossing[0] && !crossing[1]) {
    return out;
  }
  const double floor = std::max(picture.edge_floor(), 0.3 * level);
  out.points =
      contact_points(picture.field, needle, polarity, floor, kBesideEdge_px, 0, crossing, kContourReach_px);
  double sum = 0;
  int count = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    if (!crossing[side]) {
      out.points.point[side].reset();
    } else {
      sum += out.points.point[side] ? out.points.behind_tip[side] : *crossing[side];
      ++count;
    }
  }
  out.behind_tip = sum / count;
  return out;
}

double membrane_ahead_of_tip(const GradientField& field, const NeedleFix& needle, Polarity polarity,
                             double level) {
  constexpr double kStep = 0.25, kBehind = 2.0, kAhead = 3.5;  // px
  std::vector<double> e;
  for (double s = -kBehind; s <= kAhead; s += kStep) {
    double sum = 0;
    for (const double u : {-0.4, -0.2, 0.0, 0.2, 0.4}) {
      sum +=
          face_strength(field.gradient(needle.at(-s, u * needle.half_width)).dot(needle.axis) / 5, polarity);
    }
    e.push_back(sum);
  }
  const auto top = std::max_element(e.begin() + 1, e.end() - 1);
  const std::size_t i = static_cast<std::size_t>(top - e.begin());
  if (*top < 0.35 * level || *top < e[i - 1] || *top < e[i + 1]) {
    return 0;
  }
  const double curve = e[i - 1] - 2 * *top + e[i + 1];
  const double offset = curve < -1e-12 ? std::clamp(0.5 * (e[i - 1] - e[i + 1]) / curve, -0.5, 0.5) : 0;
  return -kBehind + (static_cast<double>(i) + offset) * kStep;
}

}  // namespace punctum::vision
