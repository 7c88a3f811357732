#include "vision/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <string>

#include "rt/station/telemetry.hpp"

namespace punctum::vision {

namespace {

const cv::Scalar kGreen(60, 230, 60), kCyan(255, 230, 40), kWhite(240, 240, 240), kYellow(0, 230, 255),
    kRed(40, 40, 255), kMagenta(255, 60, 255), kOrange(0, 140, 255), kBlue(255, 120, 40),
    kGrey(120, 120, 120);

// An enlarged picture that is drawn on in the coordinates of the small one.
class Canvas {
 public:
  explicit Canvas(const cv::Mat& grey) {
    const double longer = std::max(grey.cols, grey.rows);
    scale_ = longer > 1200 ? 1 : std::clamp(static_cast<int>(std::ceil(900 / longer)), 1, 4);
    cv::cvtColor(grey, picture_, cv::COLOR_GRAY2BGR);
    if (scale_ > 1) {
      cv::resize(picture_, picture_, cv::Size(), scale_, scale_, cv::INTER_CUBIC);
    }
  }
  void line(const Point& a, const Point& b, const cv::Scalar& colour, int width = 1) {
    cv::line(picture_, at(a), at(b), colour, width, cv::LINE_AA, kShift);
  }
  void closed(const Contour& c, const cv::Scalar& colour, bool dashed = false) {
    for (std::size_t i = 0; i < c.size(); ++i) {
      if (!dashed || (i / 3) % 2 == 0) {
        line(c[i], c[(i + 1) % c.size()], colour);
      }
    }
  }
  void circle(const Point& p, double r_px, const cv::Scalar& colour, int width) {  // r: on the screen
    cv::circle(picture_, at(p), static_cast<int>(std::lround(r_px * (1 << kShift))), colour, width,
               cv::LINE_AA, kShift);
  }
  void text(const std::string& s, const cv::Scalar& colour) {  // below the last text
    const double font = std::clamp(picture_.cols / 1100.0, 0.35, 1.0);
    next_text_y_ += next_text_y_ == 0 ? static_cast<int>(22 * font) + 4 : static_cast<int>(26 * font) + 4;
    put(s, cv::Point(6, next_text_y_), font, colour);
  }
  // A round length of about a fifth of the picture, at its lower right.
  void scale_bar(double um_per_px) {
    const double um = round_length(um_per_px * picture_.cols / scale_ / 5);
    const int length = static_cast<int>(std::lround(um / um_per_px * scale_));
    const double font = std::clamp(picture_.cols / 1100.0, 0.35, 1.0);
    const int right = picture_.cols - 16, y = picture_.rows - 14, high = std::max(3, picture_.cols / 250);
    cv::rectangle(picture_, {right - length - 1, y - 1}, {right + 1, y + high + 1}, cv::Scalar(0, 0, 0),
                  cv::FILLED);
    cv::rectangle(picture_, {right - length, y}, {right, y + high}, kWhite, cv::FILLED);
    char label[32];
    std::snprintf(label, sizeof label, "%g um", um);
    put(label, cv::Point(right - length, y - 8), font, kWhite);
  }
  [[nodiscard]] const cv::Mat& picture() const { return picture_; }

 private:
  static constexpr int kShift = 4;
  // 1, 2 or 5 times a power of ten, not above it.
  static double round_length(double v) {
    const double power = std::pow(10.0, std::floor(std::log10(v)));
    return power * (v < 2 * power ? 1 : v < 5 * power ? 2 : 5);
  }
  void put(const std::string& s, const cv::Point& at, double font, const cv::Scalar& colour) {
    for (const auto& [c, width] : {std::pair{cv::Scalar(0, 0, 0), 3}, std::pair{colour, 1}}) {
      cv::putText(picture_, s, at, cv::FONT_HERSHEY_SIMPLEX, font, c, width, cv::LINE_AA);
    }
  }
  // The centre of pixel 0 is at (scale - 1) / 2 of the enlarged picture.
  [[nodiscard]] cv::Point at(const Point& p) const {
    const auto fixed_point = [this](double v) {
      return static_cast<int>(std::lround(std::clamp((v + 0.5) * scale_ - 0.5, -2e4, 2e4) * (1 << kShift)));
    };
    return {fixed_point(p.x), fixed_point(p.y)};
  }
  cv::Mat picture_;
  int scale_ = 1;
  int next_text_y_ = 0;
};

void draw_holder(Canvas& canvas, const HolderPose& holder) {
  const cv::Rect2d& b = holder.box;
  const Point last(b.x + b.width - 1, b.y + b.height - 1);
  canvas.closed({{b.x, b.y}, {last.x, b.y}, last, {b.x, last.y}}, kBlue);
  canvas.circle(holder.mouth, 4, kBlue, 2);
}

void draw_needle(Canvas& canvas, const NeedlePose& n) {
  canvas.line(n.at(-12, 0), n.at(60, 0), kYellow);
  for (const double side : {-1.0, 1.0}) {
    canvas.line(n.at(0, side * n.half_width), n.at(80, side * n.half_width_at(80)), kYellow);
  }
  canvas.line(n.point() + Point(0, -4), n.point() + Point(0, 4), kRed, 2);
  canvas.line(n.point() + Point(-4, 0), n.point() + Point(4, 0), kRed, 2);
}

void draw_membranes(Canvas& canvas, const Result& result) {
  if (result.undeformed) {
    canvas.closed(circle_contour(*result.undeformed, 240), kWhite, true);
  }
  canvas.closed(result.outer.contour, result.outer.ok ? kGreen : kGrey);
  canvas.closed(result.inner.contour, result.inner.ok ? kCyan : kGrey);
  for (const Point& p : result.outer.nodes) {
    canvas.circle(p, 2, kGreen, cv::FILLED);
  }
  for (const Point& p : result.inner.nodes) {
    canvas.circle(p, 2, kCyan, cv::FILLED);
  }
}

void draw_indentation(Canvas& canvas, const Result& result) {
  if (result.entry && result.wd_px && *result.wd_px > 0) {
    canvas.line(*result.entry, *result.entry + *result.wd_px * result.needle.axis, kOrange, 2);
    canvas.circle(*result.entry, 4, kOrange, 1);
  }
  for (const auto& p : result.points.point) {
    if (p) {
      canvas.circle(*p, 4, kMagenta, 2);
    }
  }
}

std::string measures_of(const Result& result, double um) {
  char text[240];
  const auto in_um = [um](const std::optional<double>& v) { return v ? *v * um : 0.0; };
  std::snprintf(text, sizeof text, "#%llu %s%s%s  gap %.2f wd %.2f a %.2f R %.2f um",
                static_cast<unsigned long long>(result.frame), rt::name(result.phase),
                result.contact ? " contact" : "", result.punctured ? " punctured" : "", in_um(result.gap_px),
                in_um(result.wd_px), in_um(result.a_px), result.undeformed ? result.undeformed->r * um : 0.0);
  return text;
}

}  // namespace

cv::Mat draw_overlay(const cv::Mat& grey, const Result& result, const VisionConfig& config) {
  Canvas canvas(grey);
  if (result.holder.ok) {
    draw_holder(canvas, result.holder);
  }
  draw_membranes(canvas, result);
  if (result.needle.ok) {
    draw_needle(canvas, result.needle);
  }
  draw_indentation(canvas, result);
  canvas.text(measures_of(result, config.pixel_m * 1e6), kWhite);
  canvas.text(result.verdict, result.verdict == "ok" ? kGreen : kWhite);
  if (config.pixel_m > 0) {
    canvas.scale_bar(config.pixel_m * 1e6);
  }
  return canvas.picture();
}

}  // namespace punctum::vision
