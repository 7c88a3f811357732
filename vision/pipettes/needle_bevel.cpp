#include "vision/pipettes/needle_bevel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/core.hpp>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/image/median.hpp"

namespace punctum::vision {

namespace {

constexpr double kRow_px = 1;                        // along the needle
constexpr std::size_t kWithin = 5, kClearLanes = 3;  // lanes on one side: of the glass, beside it
constexpr std::size_t kOneSide = kWithin + kClearLanes, kAllLanes = 2 * kOneSide;
constexpr double kShaftFrom_px = 6, kShaftTo_px = 51;  // behind the range: tell how the walls look
constexpr double kBehind_px = 14;                      // behind the range, compared with every end
// Half the thickness of the glass over the radius of its middle, in a usual capillary.
constexpr double kHalfOfWall = 0.17;
using GlassRow = std::array<double, kAllLanes>;

double lane_at(std::size_t lane, double half_width) {
  const std::size_t i = lane % kOneSide;
  const double u = i < kWithin ? half_width * (static_cast<double>(i) + 0.5) / kWithin
                               : half_width + static_cast<double>(i - kWithin) + 0.5;
  return lane < kOneSide ? -u : u;
}

double lane_width(std::size_t lane, double half_width) {
  return lane % kOneSide < kWithin ? half_width / kWithin : 1;
}

// A table of a function of the distance in blurs.
class OfBlurs {
 public:
  template <typename Function>
  explicit OfBlurs(Function of) {
    for (int k = 0; k < kCount; ++k) {
      values_[static_cast<std::size_t>(k)] = of((k - kZero) / kPerBlur);
    }
  }
  [[nodiscard]] double operator()(double blurs) const {
    const int k = static_cast<int>(blurs * kPerBlur + kZero + 0.5);
    return values_[static_cast<std::size_t>(std::clamp(k, 0, kCount - 1))];
  }

 private:
  static constexpr int kZero = 160, kCount = 2 * kZero + 1;
  static constexpr double kPerBlur = 32;
  std::array<double, kCount> values_{};
};

struct CutEnd {
  double at = 0, tangent = 0, blur = 1.7;  // behind the tip of the pose, px; of the cut; px
};

// Walls that stop along an oblique line, and a line of glass of any strength along it.
class CutModel {
 public:
  CutModel(const GradientField& field, const NeedlePose& needle, double noise, double back, double ahead);
  [[nodiscard]] bool stands_out() const noexcept { return clear_; }
  // Log likelihood over no needle, twice.
  [[nodiscard]] double gain(const CutEnd& end) const;
  // What specks and granules leave of the picture, over what the noise alone would, at least 1.
  [[nodiscard]] double misfit(double gain) const {
    return std::max(1.0, (square_ - gain * unit_) / (area_px2_ * smooth_noise_ * smooth_noise_));
  }

 private:
  struct Seen {
    double s, half_width;
    GlassRow grey;  // times the width of the lane, without mean and slope
  };
  double half_width_, smooth_noise_, unit_;
  double square_ = 0, area_px2_ = 0;  // of what is seen, grey levels squared
  bool clear_ = false;
  Vector<Seen> rows_;
  GlassRow walls_{};
};

CutModel::CutModel(const GradientField& field, const NeedlePose& needle, double noise, double back,
                   double ahead)
    : half_width_(needle.half_width),
      smooth_noise_(std::max(noise, 0.3) / (2 * field.sigma * std::sqrt(std::numbers::pi))) {
  constexpr double kMargin_px = 6;   // the blur of the end reaches so far
  constexpr double kSmoothed = 0.6;  // what the smoothing leaves of the noise in what is about as wide
  constexpr double kLeast_grey = 1.5, kMost_noises = 0.25;
  unit_ = std::max(noise * noise, 0.1) * kSmoothed / kRow_px;
  std::array<Vector<double>, kAllLanes> shaft;
  Vector<GlassRow> greys;
  for (double s = -ahead - kMargin_px; s <= back + kShaftTo_px; s += kRow_px) {
    GlassRow grey{};
    const double w = needle.half_width + needle.taper * s;
    bool whole = true;
    for (std::size_t i = 0; i < kAllLanes && whole; ++i) {
      const Point p = needle.at(s, lane_at(i, w));
      whole = p.x > field.area.x + 1 && p.y > field.area.y + 1 && p.x < field.area.x + field.area.width - 2 &&
              p.y < field.area.y + field.area.height - 2;
      grey[i] = field.grey(p);
    }
    if (!whole) {
      break;
    }
    if (s >= back + kShaftFrom_px) {
      // Against what is clear on either side.
      const double low = 0.5 * (grey[kOneSide - 1] + grey[kOneSide - 2]),
                   high = 0.5 * (grey[kAllLanes - 1] + grey[kAllLanes - 2]);
      const double far = 0.5 * (lane_at(kAllLanes - 1, w) + lane_at(kAllLanes - 2, w));
      for (std::size_t i = 0; i < kAllLanes; ++i) {
        shaft[i].push_back(grey[i] - 0.5 * (low + high) - 0.5 * (high - low) / far * lane_at(i, w));
      }
    }
    if (s <= back + kBehind_px) {
      rows_.push_back({s, w, grey});
    }
  }
  constexpr std::size_t kFewest = 12;
  if (shaft[0].size() < kFewest) {
    return;
  }
  double square = 0, most = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    walls_[i] = median_of(shaft[i]);
    square += walls_[i] * walls_[i] / kAllLanes;
    most = std::max(most, std::abs(walls_[i]));
  }
  clear_ = square > kLeast_grey * kLeast_grey && square > kMost_noises * kMost_noises * noise * noise;
  for (Seen& row : rows_) {
    double m0 = 0, m2 = 0, r0 = 0, r1 = 0;
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      const double u = lane_at(i, row.half_width), w = lane_width(i, row.half_width);
      m0 += w;
      m2 += w * u * u;
      r0 += w * row.grey[i];
      r1 += w * u * row.grey[i];
    }
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      const double u = lane_at(i, row.half_width), w = lane_width(i, row.half_width);
      // A speck may tell no more than the needle itself.
      const double grey = std::clamp(row.grey[i] - r0 / m0 - r1 / m2 * u, -1.6 * most, 1.6 * most);
      row.grey[i] = w * grey;
      square_ += w * grey * grey;
      area_px2_ += w;
    }
  }
}

double CutModel::gain(const CutEnd& end) const {
  static const OfBlurs step([](double z) { return 0.5 * blurred_step(z / 1.4142135623730951); });
  static const OfBlurs bump([](double z) { return math::exp(-0.5 * z * z); });
  constexpr double kStrength = 0.25,
                   kPerPx = 0.01;  // usual deviations of the walls' strength from the shaft's
  const double middle = std::max(half_width_ - end.blur, 0.6 * half_width_);
  const double line_behind = kHalfOfWall * middle, lumen = middle - line_behind;
  GlassRow line{};
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double u = lane_at(i, half_width_);
    line[i] = step((lumen - u) / end.blur) - step((-lumen - u) / end.blur);
  }
  // Walls; the same times the distance from the end; line.
  cv::Matx33d a = cv::Matx33d::zeros();
  cv::Vec3d g;
  for (const Seen& row : rows_) {
    double m0 = 0, m2 = 0, x0 = 0, x1 = 0, l0 = 0, l1 = 0, xx = 0, xl = 0, ll = 0, xy = 0, ly = 0;
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      const double u = lane_at(i, row.half_width), w = lane_width(i, row.half_width);
      const double behind = row.s - end.at - end.tangent * u;
      const double x = walls_[i] * step(behind / end.blur);
      const double l = line[i] * bump((behind - line_behind) / end.blur);
      m0 += w;
      m2 += w * u * u;
      x0 += w * x;
      x1 += w * u * x;
      l0 += w * l;
      l1 += w * u * l;
      xx += w * x * x;
      xl += w * x * l;
      ll += w * l * l;
      xy += x * row.grey[i];
      ly += l * row.grey[i];
    }
    xx -= x0 * x0 / m0 + x1 * x1 / m2;
    xl -= x0 * l0 / m0 + x1 * l1 / m2;
    ll -= l0 * l0 / m0 + l1 * l1 / m2;
    const double from_end = std::max(0.0, row.s - end.at);
    a += cv::Matx33d(xx, from_end * xx, xl, from_end * xx, from_end * from_end * xx, from_end * xl, xl,
                     from_end * xl, ll);
    g += cv::Vec3d(xy, from_end * xy, ly);
  }
  const double sure = unit_ / (kStrength * kStrength);
  a(0, 0) += sure;
  g[0] += sure;
  a(1, 1) += unit_ / (kPerPx * kPerPx);
  a(2, 2) += 1e-3 * unit_;
  return g.dot(a.inv() * g) / unit_;
}

}  // namespace

double outer_radius_of_glass(double half_width, double blur) {
  return (1 + kHalfOfWall) * std::max(half_width - blur, 0.6 * half_width);
}

std::optional<Bevel> bevel_of_glass(const GradientField& field, double noise, const NeedlePose& needle,
                                    double back, double ahead) {
  const CutModel model(field, needle, noise, back, ahead);
  if (!model.stands_out()) {
    return std::nullopt;
  }
  constexpr std::array kBlurs_px = {1.4, 1.7, 2.1, 2.6, 3.2, 4.0};
  constexpr double kSteepest = 0.9;
  CutEnd best;
  double most = -1e18;
  const auto take = [&](const CutEnd& end) {
    const double gain = model.gain(end);
    if (gain > most) {
      most = gain;
      best = end;
    }
  };
  const auto refine = [&](double from_step, bool turn) {
    for (double step = from_step; step > 0.2; step /= 2) {
      for (int round = 0; round < 2; ++round) {
        const CutEnd from = best;
        for (const double blur : kBlurs_px) {
          take({from.at, from.tangent, blur});
        }
        for (const double sign : {-1.0, 1.0}) {
          take({best.at + sign * 0.5 * step, best.tangent, best.blur});
          if (turn) {
            take({best.at, std::clamp(best.tangent + sign * 0.2 * step, -kSteepest, kSteepest), best.blur});
          }
        }
      }
    }
    return most;
  };
  const auto begin_with = [&](const CutEnd& end) {
    best = end;
    most = model.gain(end);
  };
  for (double at = -ahead; at <= back; at += 1.5) {
    for (const double tangent : {-0.5, 0.0, 0.5}) {
      take({at, tangent, 2.1});
    }
  }
  const double with_cut = refine(1, true);
  const CutEnd cut = best;
  // More is there than a needle's end: a speck, say.
  constexpr double kMisfitMost = 4;
  const double misfit = model.misfit(with_cut);
  if (misfit > kMisfitMost || std::abs(cut.tangent) >= kSteepest) {
    return std::nullopt;
  }
  begin_with({cut.at, 0, cut.blur});
  const double straight = refine(1, false);
  // How fast the likelihood falls, when the end follows.
  constexpr double kApart = 0.15;
  double curvature = 0;
  for (const double sign : {-1.0, 1.0}) {
    begin_with({cut.at, cut.tangent + sign * kApart, cut.blur});
    curvature += (with_cut - refine(0.5, false)) / (kApart * kApart);
  }
  const double variance = 2 * misfit / std::max(curvature, 1e-3);
  // Before anything is seen, a needle is as likely cut at right angles as anyhow up to the steepest.
  const double times_as_likely = math::exp(std::min(0.5 * (with_cut - straight) / misfit, 50.0)) *
                                 std::sqrt(2 * CV_PI * variance) / (2 * kSteepest);
  const double oblique = times_as_likely / (1 + times_as_likely);
  return Bevel{oblique * cut.tangent,
               std::sqrt(oblique * variance + oblique * (1 - oblique) * cut.tangent * cut.tangent)};
}

}  // namespace punctum::vision
