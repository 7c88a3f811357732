// A microscope of the tests' own, drawn from optical thickness: a cell, a holding pipette and a bevelled
// needle are bodies of glass and gel, and the picture is their absorption (bright field) or the slope of
// their thickness in one direction (relief, as in Hoffman's modulation or DIC: an edge is bright on one side
// of the cell and dark on the other). Out of focus a point is a disc with a bright ring. Shares nothing with
// the station's camera.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

namespace punctum::vision::test {

struct Microscope {
  unsigned seed = 1;
  bool relief = false;
  double relief_deg = 40;             // direction of the light's slope
  double noise = 5;                   // grey levels
  double focus_px = 0;                // radius of the disc that a point becomes; 0: in focus
  double needle_deg = 0;              // of its axis against the holding pipette's
  double gap_px = 40;                 // from the tip to the outer membrane at rest; < 0: beyond it
  double dimple_px = 0;               // by which the outer membrane is pushed in on the needle's axis
  unsigned shot = 0;                  // of the same scene, each with noise of its own
  int impurities = 12, on_shaft = 0;  // specks anywhere, and on the needle's walls
  double turned_deg = 0;              // of the whole picture
  cv::Point2d moved = {0, 0};
  bool mirrored = false;
  bool cell = true, needle = true, holder = true;
};

struct Truth {
  std::vector<cv::Point2d> outer, inner;  // geometric edges
  cv::Point2d tip, axis;                  // the outermost glass; unit, out of the tip
  cv::Point2d mouth;                      // middle of the holding pipette's face
};

struct Drawn {
  cv::Mat picture;  // CV_8U
  Truth truth;
};

class DrawnMicroscope {
 public:
  static constexpr int kW = 727, kH = 485;
  static constexpr double kPixel_um = 0.825;

  explicit DrawnMicroscope(const Microscope& m) : m_(m), random_(m.seed) {
    centre_ = {kW / 2.0 + between(-12, 12), kH / 2.0 + between(-8, 8)};
    radius_ = between(66, 80);
    zona_ = between(5, 7);
    space_ = between(4, 8);
    outer_chord_ = ChordInFocus(radius_);
    lumen_chord_ = ChordInFocus(radius_ - zona_);
    inner_chord_ = ChordInFocus(radius_ - zona_ - space_);
    for (Wave& w : waves_) {
      w = {between(-1.2, 1.2), between(0, 2 * CV_PI)};
    }
    const double t = m.needle_deg * CV_PI / 180;
    axis_ = {-std::cos(t), std::sin(t)};
    const cv::Point2d aimed = centre_ + cv::Point2d(0, between(-5, 5));
    tip_ = aimed - (radius_at_rest(std::atan2(-axis_.y, -axis_.x)) + m.gap_px) * axis_;
    pushed_at_ = tip_ + m.gap_px * axis_ - centre_;
    needle_half_ = between(4.2, 5.5);
    taper_ = between(0.012, 0.03);
    bevel_ = between(-0.7, 0.7);
    dimple_half_ = radius_ * (0.2 + 0.1 * bevel_ * bevel_) + 0.5 * m.dimple_px;
    mouth_ = {centre_.x - outer_radius(CV_PI) + 1.5, centre_.y + between(-3, 3)};
  }

  [[nodiscard]] Drawn draw() {
    constexpr int kFine = 3;
    cv::Mat thickness(kH * kFine, kW * kFine, CV_32F), dark(thickness.size(), CV_32F);
    for (int y = 0; y < thickness.rows; ++y) {
      float* const thick = thickness.ptr<float>(y);
      float* const absorbed = dark.ptr<float>(y);
      for (int x = 0; x < thickness.cols; ++x) {
        const Body body = at(as_drawn({(x + 0.5) / kFine - 0.5, (y + 0.5) / kFine - 0.5}));
        thick[x] = static_cast<float>(body.thickness);
        absorbed[x] = static_cast<float>(body.dark);
      }
    }
    cv::Mat light = m_.relief ? slope_of(thickness, kFine) - 0.25 * dark : cv::Mat(-dark);
    cv::resize(light, light, {kW, kH}, 0, 0, cv::INTER_AREA);
    add_specks(light);
    if (m_.focus_px > 0) {
      cv::filter2D(light, light, -1, ring(m_.focus_px), {-1, -1}, 0, cv::BORDER_REPLICATE);
    }
    cv::GaussianBlur(light, light, {0, 0}, 1.1);
    Drawn out;
    out.picture.create(kH, kW, CV_8U);
    std::normal_distribution<double> noise(0, 1);
    const double uneven = between(-0.05, 0.05);
    if (m_.shot > 0) {
      random_.seed(m_.seed + 100'003 * m_.shot);
    }
    for (int y = 0; y < kH; ++y) {
      for (int x = 0; x < kW; ++x) {
        const double g =
            (kGrey + static_cast<double>(light.at<float>(y, x))) * (1 + uneven * (2.0 * x / kW - 1));
        out.picture.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(g + m_.noise * noise(random_));
      }
    }
    for (int k = 0; k < kPoints; ++k) {
      const double t = 2 * CV_PI * k / kPoints;
      const cv::Point2d d(std::cos(t), std::sin(t));
      out.truth.outer.push_back(as_seen(centre_ + outer_radius(t) * d));
      out.truth.inner.push_back(as_seen(centre_ + inner_radius(t) * d));
    }
    out.truth.tip = as_seen(tip_);
    out.truth.axis = as_seen(tip_ + axis_) - out.truth.tip;
    out.truth.mouth = as_seen(mouth_);
    return out;
  }

 private:
  static constexpr double kGrey = 150;
  static constexpr int kPoints = 720;
  struct Wave {
    double height, phase;
  };
  struct Body {
    double thickness = 0, dark = 0;  // px of glass; grey levels
  };

  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  [[nodiscard]] double radius_at_rest(double t) const {
    double r = radius_;
    for (int k = 0; k < 3; ++k) {
      r += waves_[k].height * std::cos((k + 2) * t + waves_[k].phase);
    }
    return r;
  }
  // A pit, flat where the needle pushes.
  [[nodiscard]] double pushed(double t, double depth) const {
    const double along = radius_ * std::remainder(t - std::atan2(pushed_at_.y, pushed_at_.x), 2 * CV_PI);
    const double x = std::max(0.0, std::abs(along) - needle_half_) / dimple_half_;
    return depth / ((1 + x * x) * std::sqrt(1 + x * x));
  }
  [[nodiscard]] double outer_radius(double t) const { return radius_at_rest(t) - pushed(t, m_.dimple_px); }
  // The space between them gives half of its width before the inner one is pushed, too.
  [[nodiscard]] double inner_radius(double t) const {
    return radius_at_rest(t) - zona_ - space_ - pushed(t, std::max(0.0, m_.dimple_px - 0.5 * space_));
  }

  // Of a ball: what the light crosses at distance u from its middle.
  static double chord(double r, double u) { return u < r ? 2 * std::sqrt(r * r - u * u) : 0; }

  // The same by a lens of aperture 0.4: what is above and below the focus is blurred. A table round the usual
  // radius.
  class ChordInFocus {
   public:
    ChordInFocus() = default;
    explicit ChordInFocus(double radius) {
      constexpr double kSpread = 0.16, kSharpest_px = 0.15;  // px per px of height; a part of a pixel
      constexpr int kSlices = 200;
      for (std::size_t i = 0; i < values_.size(); ++i) {
        const double u = radius + kFrom + kStep * static_cast<double>(i);
        for (int k = 0; k < kSlices; ++k) {
          const double angle = (k + 0.5) * CV_PI / 2 / kSlices, z = radius * std::sin(angle);
          const double edge = radius * std::cos(angle) - u, spread = std::hypot(kSpread * z, kSharpest_px);
          values_[i] += radius * std::cos(angle) * CV_PI / 2 / kSlices *
                        std::erfc(-edge / (spread * std::numbers::sqrt2));
        }
      }
    }
    [[nodiscard]] double at(double r, double u) const {
      const double place = (u - r - kFrom) / kStep;
      if (place < 0) {
        return chord(r, u);
      }
      const auto i = static_cast<std::size_t>(std::min(place, static_cast<double>(kCount) - 2));
      const double part = std::min(place - static_cast<double>(i), 1.0);
      return values_[i] + part * (values_[i + 1] - values_[i]);
    }

   private:
    static constexpr double kFrom = -40, kTo = 25, kStep = 0.25;
    static constexpr std::size_t kCount = static_cast<std::size_t>((kTo - kFrom) / kStep) + 1;
    std::array<double, kCount> values_{};
  };

  [[nodiscard]] Body at(const cv::Point2d& p) const {
    Body body;
    const cv::Point2d q = p - centre_;
    const double u = cv::norm(q);
    if (m_.cell && u < radius_ + 25) {
      const double t = std::atan2(q.y, q.x), outer = outer_radius(t), lumen = outer - zona_,
                   inner = inner_radius(t);
      body.thickness +=
          0.5 * (outer_chord_.at(outer, u) - lumen_chord_.at(lumen, u)) + 0.35 * inner_chord_.at(inner, u);
      body.dark += u < inner ? 33 + granules(q) : u < lumen ? 7 : u < outer ? 30 : 0;
      body.thickness += u < inner ? 0.15 * granules(q) : 0;
    }
    if (m_.needle) {
      const double s = (tip_ - p).dot(axis_), v = (p - tip_).cross(axis_),
                   half = needle_half_ + taper_ * std::max(s, 0.0);
      // Cut obliquely: one side ends further back.
      if (std::abs(v) < half && s > bevel_ * v + std::abs(bevel_) * needle_half_) {
        const double lumen = 0.72 * half;
        body.thickness += 0.5 * (chord(half, v) - chord(lumen, v));
        body.dark += std::abs(v) > lumen ? 46 : -6;
      }
    }
    if (m_.holder) {
      const double s = mouth_.x - p.x, v = std::abs(p.y - mouth_.y), round = 12 - s;
      // Fire-polished: the rim is round.
      const double half = kHolder - (round > 0 ? 12 - std::sqrt(std::max(0.0, 144 - round * round)) : 0);
      const double lumen = kMouth + (s > 8 ? std::min(12.0, 0.5 * (s - 8)) : 0);
      if (s > 0 && v < half && !(m_.cell && u < outer_radius(std::atan2(q.y, q.x)))) {
        const bool wall = v > lumen, rim = v > half - 4 || (v > lumen && v < lumen + 3) || (wall && s < 2);
        body.thickness += wall ? 0.4 * std::min({half - v, v - lumen, 8.0}) : 0;
        body.dark += rim ? 48 : wall ? -10 : 4;
      }
    }
    return body;
  }

  // Of the ooplasm, about +-6.
  [[nodiscard]] static double granules(const cv::Point2d& q) {
    return 3 * std::sin(0.61 * q.x + 0.9 * std::sin(0.23 * q.y)) +
           3 * std::sin(0.57 * q.y + std::sin(0.31 * q.x));
  }

  [[nodiscard]] cv::Mat slope_of(const cv::Mat& thickness, int fine) const {
    constexpr double kShear_px = 1.5, kGain = 13;
    const double t = m_.relief_deg * CV_PI / 180;
    const auto shifted = [&](double by) {
      const cv::Matx23d shift(1, 0, by * std::cos(t), 0, 1, by * std::sin(t));
      cv::Mat out;
      cv::warpAffine(thickness, out, shift, thickness.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
      return out;
    };
    cv::Mat slope = (shifted(fine * kShear_px / 2) - shifted(-fine * kShear_px / 2)) * kGain;
    cv::max(slope, -90.0, slope);
    cv::min(slope, 90.0, slope);
    return slope;
  }

  // Geometric optics: an even disc, and a brighter edge of it.
  static cv::Mat ring(double radius) {
    const int n = static_cast<int>(std::ceil(radius)) + 1;
    cv::Mat kernel(2 * n + 1, 2 * n + 1, CV_32F);
    for (int y = -n; y <= n; ++y) {
      for (int x = -n; x <= n; ++x) {
        const double r = std::hypot(x, y);
        kernel.at<float>(y + n, x + n) =
            static_cast<float>(std::clamp(radius + 0.5 - r, 0.0, 1.0) * (r > radius - 1 ? 1.6 : 1));
      }
    }
    return kernel / cv::sum(kernel)[0];
  }

  void add_specks(cv::Mat& light) {
    const auto speck = [&](const cv::Point2d& p) {
      const double r = between(1.2, 5), grey = between(0, 1) < 0.7 ? -between(15, 60) : between(15, 40);
      cv::Mat one = cv::Mat::zeros(light.size(), CV_32F);
      cv::ellipse(one,
                  cv::RotatedRect(p, cv::Size2f(static_cast<float>(2 * r), static_cast<float>(1.4 * r)),
                                  static_cast<float>(between(0, 180))),
                  cv::Scalar(grey), cv::FILLED, cv::LINE_8);
      light += one;
    };
    for (int k = 0; k < m_.impurities; ++k) {
      speck({between(5, kW - 5), between(5, kH - 5)});
    }
    for (int k = 0; k < m_.on_shaft; ++k) {
      const double s = between(15, 150), side = between(0, 1) < 0.5 ? -1 : 1;
      speck(as_seen(tip_ - s * axis_ + side * (needle_half_ + taper_ * s) * cv::Point2d(-axis_.y, axis_.x)));
    }
  }

  [[nodiscard]] cv::Point2d as_seen(const cv::Point2d& drawn) const {
    const cv::Point2d p = turned(drawn, m_.turned_deg) + m_.moved;
    return m_.mirrored ? cv::Point2d(kW - 1 - p.x, p.y) : p;
  }
  [[nodiscard]] cv::Point2d as_drawn(cv::Point2d seen) const {
    if (m_.mirrored) {
      seen.x = kW - 1 - seen.x;
    }
    return turned(seen - m_.moved, -m_.turned_deg);
  }
  static cv::Point2d turned(const cv::Point2d& p, double degrees) {
    const cv::Point2d middle(kW / 2.0, kH / 2.0), q = p - middle;
    const double c = std::cos(degrees * CV_PI / 180), s = std::sin(degrees * CV_PI / 180);
    return middle + cv::Point2d(c * q.x - s * q.y, s * q.x + c * q.y);
  }

  static constexpr double kHolder = 46, kMouth = 14;  // half-widths, px
  Microscope m_;
  std::mt19937 random_;
  cv::Point2d centre_, tip_, axis_, mouth_, pushed_at_;
  ChordInFocus outer_chord_, lumen_chord_, inner_chord_;
  double radius_ = 0, zona_ = 0, space_ = 0, needle_half_ = 0, taper_ = 0, bevel_ = 0, dimple_half_ = 1;
  Wave waves_[3] = {};
};

}  // namespace punctum::vision::test
