#include "vision/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

namespace punctum::vision {

cv::Mat draw_overlay(const cv::Mat& grey, const Result& result, const VisionConfig& config) {
  cv::Mat out;
  const double longer = std::max(grey.cols, grey.rows);
  const int scale = longer > 1200 ? 1 : std::clamp(static_cast<int>(std::ceil(900 / longer)), 1, 4);
  cv::cvtColor(grey, out, cv::COLOR_GRAY2BGR);
  if (scale > 1) {
    cv::resize(out, out, cv::Size(), scale, scale, cv::INTER_CUBIC);
  }
  constexpr int kShift = 4;
  // Pixel centres are at integers: the middle of pixel 0 is at (scale - 1) / 2 of the enlarged picture.
  const auto at = [&](const Point& p) {
    const double x = std::clamp((p.x + 0.5) * scale - 0.5, -2e4, 2e4),
                 y = std::clamp((p.y + 0.5) * scale - 0.5, -2e4, 2e4);
    return cv::Point(static_cast<int>(std::lround(x * (1 << kShift))),
                     static_cast<int>(std::lround(y * (1 << kShift))));
  };
  const auto line = [&](const Point& a, const Point& b, const cv::Scalar& colour, int width = 1) {
    cv::line(out, at(a), at(b), colour, width, cv::LINE_AA, kShift);
  };
  const auto closed = [&](const Contour& c, const cv::Scalar& colour, bool dashed) {
    for (std::size_t i = 0; i < c.size(); ++i) {
      if (!dashed || (i / 3) % 2 == 0) {
        line(c[i], c[(i + 1) % c.size()], colour, 1);
      }
    }
  };
  const auto dot = [&](const Point& p, double r, const cv::Scalar& colour, int width) {
    cv::circle(out, at(p), static_cast<int>(std::lround(r * (1 << kShift))), colour, width, cv::LINE_AA,
               kShift);
  };
  const cv::Scalar green(60, 230, 60), cyan(255, 230, 40), white(240, 240, 240), yellow(0, 230, 255),
      red(40, 40, 255), magenta(255, 60, 255), orange(0, 140, 255), blue(255, 120, 40), faded(120, 120, 120);
  if (result.holder.ok) {
    const cv::Rect2d& b = result.holder.box;
    const Point c[4] = {{b.x, b.y},
                        {b.x + b.width - 1, b.y},
                        {b.x + b.width - 1, b.y + b.height - 1},
                        {b.x, b.y + b.height - 1}};
    for (int i = 0; i < 4; ++i) {
      line(c[i], c[(i + 1) % 4], blue);
    }
    dot(result.holder.mouth, 4, blue, 2);
  }
  if (result.undeformed) {
    closed(circle_contour(*result.undeformed, 240), white, true);
  }
  closed(result.outer.contour, result.outer.ok ? green : faded, false);
  closed(result.inner.contour, result.inner.ok ? cyan : faded, false);
  for (const Point& p : result.outer.nodes) {
    dot(p, 2, green, cv::FILLED);
  }
  for (const Point& p : result.inner.nodes) {
    dot(p, 2, cyan, cv::FILLED);
  }
  if (result.needle.ok) {
    const NeedleFix& n = result.needle;
    line(n.at(-12, 0), n.at(60, 0), yellow);
    for (const double side : {-1.0, 1.0}) {
      line(n.at(0, side * n.half_width), n.at(80, side * n.half_width_at(80)), yellow);
    }
    line(n.tip + Point(0, -4), n.tip + Point(0, 4), red, 2);
    line(n.tip + Point(-4, 0), n.tip + Point(4, 0), red, 2);
  }
  if (result.entry && result.wd_px && *result.wd_px > 0) {
    line(*result.entry, *result.entry + *result.wd_px * result.needle.axis, orange, 2);
    dot(*result.entry, 4, orange, 1);
  }
  for (const auto& p : result.points.point) {
    if (p) {
      dot(*p, 4, magenta, 2);
    }
  }
  const double um = config.pixel_m * 1e6;
  char text[240];
  const auto num = [&](const std::optional<double>& v) { return v ? *v * um : 0.0; };
  std::snprintf(text, sizeof text, "#%llu %s%s%s  gap %.2f wd %.2f a %.2f R %.2f um",
                static_cast<unsigned long long>(result.frame), rt::name(result.phase),
                result.contact ? " contact" : "", result.punctured ? " punctured" : "", num(result.gap_px),
                num(result.wd_px), num(result.a_px), result.undeformed ? result.undeformed->r * um : 0.0);
  const double font = std::clamp(out.cols / 1100.0, 0.35, 1.0);
  int y = static_cast<int>(22 * font) + 4;
  for (const std::string& s : {std::string(text), result.verdict}) {
    cv::putText(out, s, cv::Point(6, y), cv::FONT_HERSHEY_SIMPLEX, font, cv::Scalar(0, 0, 0), 3, cv::LINE_AA);
    cv::putText(out, s, cv::Point(6, y), cv::FONT_HERSHEY_SIMPLEX, font, s == "ok" ? green : white, 1,
                cv::LINE_AA);
    y += static_cast<int>(26 * font) + 4;
  }
  return out;
}

}  // namespace punctum::vision
