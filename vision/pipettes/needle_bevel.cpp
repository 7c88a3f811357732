#include "vision/pipettes/needle_bevel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
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
constexpr std::size_t kLumenLanes = 2;               // of those, in the lumen
constexpr std::size_t kOneSide = kWithin + kClearLanes, kAllLanes = 2 * kOneSide;
constexpr double kShaftFrom_px = 6, kShaftTo_px = 51;  // behind the range: tell how the walls look
constexpr double kBehind_px = 14;                      // behind the range, compared with every end
// Half the thickness of the glass over the radius of its middle, in a usual capillary.
constexpr double kHalfOfWall = 0.17;
constexpr double kSteepestCut = 0.95;  // px along per px across
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

double step_of(double blurs) {
  static const OfBlurs kStep([](double z) { return 0.5 * blurred_step(z / std::numbers::sqrt2); });
  return kStep(blurs);
}

double bump_of(double blurs) {
  static const OfBlurs kBump([](double z) { return math::exp(-0.5 * z * z); });
  return kBump(blurs);
}

// Grey levels across the shaft from `from` to `to` px behind the tip, from its axis outwards, less their
// mean.
Vector<double> half_profile(const GradientField& field, const NeedlePose& needle, double from, double to,
                            double apart_px) {
  constexpr double kOutside_px = 6;
  const double half_width = needle.half_width_at(0.5 * (from + to));
  Vector<double> profile, along;
  for (double u = 0; u < half_width + kOutside_px; u += apart_px) {
    along.clear();
    for (double s = from; s < to; s += kRow_px) {
      const double v = u + needle.half_width_at(s) - half_width;
      along.push_back(0.5 * (field.grey(needle.at(s, v)) + field.grey(needle.at(s, -v))));
    }
    profile.push_back(median_of(along));
  }
  double mean = 0;
  for (const double grey : profile) {
    mean += grey / static_cast<double>(profile.size());
  }
  for (double& grey : profile) {
    grey -= mean;
  }
  return profile;
}

// What is left of the profile, grey levels squared, when two walls so far from the axis, a lumen between them
// and a level are taken off, each as strong as it fits best.
double unexplained(const Vector<double>& profile, double apart_px, double middle_px, double blur_px) {
  cv::Matx33d a = 1e-6 * cv::Matx33d::eye();
  cv::Vec3d g;
  double square = 0;
  for (std::size_t k = 0; k < profile.size(); ++k) {
    const double u = apart_px * static_cast<double>(k), low = (u - middle_px) / blur_px,
                 high = (u + middle_px) / blur_px;
    const cv::Vec3d shown(bump_of(low) + bump_of(high), step_of(high) - step_of(low), 1);
    a += shown * shown.t();
    g += profile[k] * shown;
    square += profile[k] * profile[k];
  }
  return square - g.dot(a.inv() * g);
}

struct CutEnd {
  double at = 0, tangent = 0, blur = 1.7;  // behind the tip of the pose, px; of the cut; px
};

// Weighted, of a quantity.
struct Moments {
  double weight = 0, sum = 0, squares = 0;

  void add(double w, double x) {
    weight += w;
    sum += w * x;
    squares += w * x * x;
  }
  [[nodiscard]] double mean() const { return sum / weight; }
  [[nodiscard]] double variance() const { return std::max(squares / weight - mean() * mean(), 0.0); }
};

// Walls that stop along an oblique line, and a line of glass of any strength along it. Where the blur is
// known, what is neither walls nor clear is a speck and tells nothing; else no speck tells more than the
// needle.
class CutModel {
 public:
  CutModel(const GradientField& field, const NeedlePose& needle, double noise, std::optional<double> blur_px,
           double back, double ahead);
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
    GlassRow grey;      // times the weight, without mean and slope
    GlassRow weight{};  // width of the lane, px; nearly none where there is a speck
    // Of the weights: mean place, sum, sum over the squares of the distance from that place.
    double middle = 0, weights = 0, tilts = 0;
  };
  void weigh_without_specks(Seen& row, double most) const;
  static void take_off_mean_and_slope(Seen& row);
  double half_width_, smooth_noise_, unit_;
  double square_ = 0, area_px2_ = 0;  // of what is seen, grey levels squared
  bool clear_ = false;
  Vector<Seen> rows_;
  GlassRow walls_{};
};

CutModel::CutModel(const GradientField& field, const NeedlePose& needle, double noise,
                   std::optional<double> blur_px, double back, double ahead)
    : half_width_(needle.half_width),
      smooth_noise_(std::max(noise, 0.3) / (2 * field.sigma * std::sqrt(std::numbers::pi))) {
  constexpr double kMargin_px = 6;  // the blur of the end reaches so far
  constexpr double kLeast_grey = 1.5, kMost_noises = 0.25;
  constexpr double kOfWallsMost = 1.6;  // of the strongest wall, what a speck may tell
  // What the smoothing leaves of the noise in what is about as wide, and in an end of that blur: it is a peak
  // across, a slope along.
  double smoothed = 0.6;
  if (blur_px) {
    const double blur2 = *blur_px * *blur_px, of_noise = blur2 / (blur2 + field.sigma * field.sigma);
    smoothed = of_noise * of_noise;
  }
  unit_ = std::max(noise * noise, 0.1) * smoothed / kRow_px;
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
      rows_.push_back({.s = s, .half_width = w, .grey = grey});
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
  const double at_most = blur_px ? std::numeric_limits<double>::infinity() : kOfWallsMost * most;
  for (Seen& row : rows_) {
    if (blur_px) {
      weigh_without_specks(row, most);
    } else {
      for (std::size_t i = 0; i < kAllLanes; ++i) {
        row.weight[i] = lane_width(i, row.half_width);
      }
    }
    take_off_mean_and_slope(row);
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      const double grey = std::clamp(row.grey[i], -at_most, at_most);
      square_ += row.weight[i] * grey * grey;
      area_px2_ += row.weight[i];
      row.grey[i] = row.weight[i] * grey;
    }
  }
}

// What is neither the walls nor clear is a speck, wherever the needle ends. most: of the walls, grey levels.
void CutModel::weigh_without_specks(Seen& row, double most) const {
  constexpr double kNoises = 4, kOfWalls = 0.3, kOfSpeck = 1e-3;
  const double tolerance = kNoises * smooth_noise_ + kOfWalls * most;
  Vector<double> clear;  // beside the walls and between them
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    if (i % kOneSide >= kWithin || i % kOneSide < kLumenLanes) {
      clear.push_back(row.grey[i]);
    }
  }
  const double level = median_of(clear);
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double grey = row.grey[i] - level;
    const bool speck =
        grey < std::min(walls_[i], 0.0) - tolerance || grey > std::max(walls_[i], 0.0) + tolerance;
    row.weight[i] = (speck ? kOfSpeck : 1) * lane_width(i, row.half_width);
  }
}

void CutModel::take_off_mean_and_slope(Seen& row) {
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    row.weights += row.weight[i];
    row.middle += row.weight[i] * lane_at(i, row.half_width);
  }
  row.middle /= row.weights;
  double mean = 0, slope = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double tilt = lane_at(i, row.half_width) - row.middle;
    row.tilts += row.weight[i] * tilt * tilt;
    mean += row.weight[i] * row.grey[i];
    slope += row.weight[i] * tilt * row.grey[i];
  }
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    row.grey[i] -= mean / row.weights + slope / row.tilts * (lane_at(i, row.half_width) - row.middle);
  }
}

double CutModel::gain(const CutEnd& end) const {
  constexpr double kStrength = 0.25,
                   kPerPx = 0.01;  // usual deviations of the walls' strength from the shaft's
  const double middle = std::max(half_width_ - end.blur, 0.6 * half_width_);
  const double line_behind = kHalfOfWall * middle, lumen = middle - line_behind;
  GlassRow line{};
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double u = lane_at(i, half_width_);
    line[i] = step_of((lumen - u) / end.blur) - step_of((-lumen - u) / end.blur);
  }
  // Walls; the same times the distance from the end; line.
  cv::Matx33d a = cv::Matx33d::zeros();
  cv::Vec3d g;
  for (const Seen& row : rows_) {
    double x0 = 0, x1 = 0, l0 = 0, l1 = 0, xx = 0, xl = 0, ll = 0, xy = 0, ly = 0;
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      const double u = lane_at(i, row.half_width), w = row.weight[i], tilt = u - row.middle;
      const double behind = row.s - end.at - end.tangent * u;
      const double x = walls_[i] * step_of(behind / end.blur);
      const double l = line[i] * bump_of((behind - line_behind) / end.blur);
      x0 += w * x;
      x1 += w * tilt * x;
      l0 += w * l;
      l1 += w * tilt * l;
      xx += w * x * x;
      xl += w * x * l;
      ll += w * l * l;
      xy += x * row.grey[i];
      ly += l * row.grey[i];
    }
    xx -= x0 * x0 / row.weights + x1 * x1 / row.tilts;
    xl -= x0 * l0 / row.weights + x1 * l1 / row.tilts;
    ll -= l0 * l0 / row.weights + l1 * l1 / row.tilts;
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

// Ends from..to px behind the tip of the pose, and cuts, with what is between two of them.
struct EndsAndCuts {
  double from, to, apart, cut_from, cut_to, cut_apart;
};

// Each as likely as it explains the picture; and the likeliest. radius: of the glass, px.
CutGlass mean_of(const CutModel& model, const EndsAndCuts& tried, double blur_px, double radius,
                 CutEnd& best) {
  struct Likely {
    CutEnd end;
    double gain;
  };
  Vector<Likely> ends;
  double most = -1e18;
  for (int k = static_cast<int>(std::ceil(tried.cut_from / tried.cut_apart));
       k * tried.cut_apart <= tried.cut_to; ++k) {
    for (double at = tried.from; at <= tried.to; at += tried.apart) {
      const CutEnd end{at, k * tried.cut_apart, blur_px};
      ends.push_back({end, model.gain(end)});
      if (ends.back().gain > most) {
        most = ends.back().gain;
        best = end;
      }
    }
  }
  // A granule is about as wide as a wall, and not drawn anew in every pixel as noise is: over an end its sum
  // varies so many times as much as that of noise that leaves as much.
  constexpr double kOfGranules = 4;
  const double misfit = 1 + kOfGranules * (model.misfit(most) - 1);
  // Of the end, of the cut, and of the end where the cut is known.
  Moments outermost, tangents, of_cut;
  double where_cut_is_known = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto& [end, gain] = ends[i];
    // Before anything is seen, a needle is as likely cut at right angles as anyhow up to the steepest.
    const double before = tried.cut_apart / (2 * kSteepestCut) + (end.tangent == 0 ? 1 : 0);
    const double weight = before * math::exp(0.5 * (gain - most) / misfit);
    const double place = std::abs(end.tangent) * radius - end.at;
    outermost.add(weight, place);
    tangents.add(weight, end.tangent);
    of_cut.add(weight, place);
    if (i + 1 == ends.size() || ends[i + 1].end.tangent != end.tangent) {
      where_cut_is_known += of_cut.weight * of_cut.variance();
      of_cut = {};
    }
  }
  const double with_cut = outermost.variance() - tangents.variance() * radius * radius;
  return {{outermost.mean(), std::sqrt(std::max(with_cut, where_cut_is_known / outermost.weight)), blur_px},
          {tangents.mean(), std::sqrt(tangents.variance())}};
}

}  // namespace

double outer_radius_of_glass(double half_width, double blur) {
  return (1 + kHalfOfWall) * std::max(half_width - blur, 0.6 * half_width);
}

std::optional<Bevel> bevel_of_glass(const GradientField& field, double noise, const NeedlePose& needle,
                                    double back, double ahead) {
  const CutModel model(field, needle, noise, std::nullopt, back, ahead);
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

std::optional<double> blur_of_shaft(const GradientField& field, const NeedlePose& needle, double back) {
  constexpr double kApart_px = 0.5, kUnexplained = 0.2;
  // What it is tried with, and the least that a needle in focus has.
  constexpr double kLeast_px = 1.2, kMost_px = 4.8, kBlurStep_px = 0.1, kMiddleStep_px = 0.25,
                   kSharpest_px = 1.4;
  const double from = back + kShaftFrom_px, to = back + kShaftTo_px;
  const double half_width = needle.half_width_at(0.5 * (from + to));
  const Vector<double> profile = half_profile(field, needle, from, to, kApart_px);
  double least = 0;
  for (const double grey : profile) {
    least += kUnexplained * grey * grey;
  }
  std::optional<double> best;
  for (double blur = kLeast_px; blur < kMost_px; blur += kBlurStep_px) {
    for (double middle = 0.5 * half_width; middle < half_width; middle += kMiddleStep_px) {
      if (const double rest = unexplained(profile, kApart_px, middle, blur); rest < least) {
        least = rest;
        const double wall = 2 * kHalfOfWall * middle;  // its thickness spreads it, too, but only across
        best = std::sqrt(std::max(blur * blur - wall * wall / 12, 0.0));
      }
    }
  }
  return best && *best > kSharpest_px ? best : std::nullopt;
}

std::optional<CutGlass> cut_of_glass(const GradientField& field, double noise, const NeedlePose& needle,
                                     double blur_px, double back, double ahead) {
  const CutModel model(field, needle, noise, blur_px, back, ahead);
  if (!model.stands_out()) {
    return std::nullopt;
  }
  CutEnd best{0, 0, blur_px};
  double most = -1e18;
  for (double at = -ahead; at <= back; at += 1) {
    for (const double tangent : {-0.6, -0.3, 0.0, 0.3, 0.6}) {
      const CutEnd end{at, tangent, blur_px};
      if (const double gain = model.gain(end); gain > most) {
        most = gain;
        best = end;
      }
    }
  }
  constexpr double kEdge_px = 1.5;  // of the range
  if (best.at < -ahead + kEdge_px || best.at > back - kEdge_px) {
    return CutGlass{{-best.at, back + ahead, blur_px}, {}};
  }
  // Ends far from the best one may be as likely: in noise the likelihood falls off in straight lines, not as
  // a parabola. Where they are not, it is sharp.
  constexpr double kBeyond_px = 2, kSharp_px2 = 1,
                   kReach_px = 1;  // of the range; variance; round the best end
  constexpr double kReachOfCut = 0.16;
  const double radius = outer_radius_of_glass(needle.half_width, blur_px);
  const EndsAndCuts all{-ahead - kBeyond_px, back + kBeyond_px, 0.5, -kSteepestCut, kSteepestCut, 0.1};
  CutGlass found = mean_of(model, all, blur_px, radius, best);
  if (const double of_cut = found.bevel.sd * radius;
      found.end.sd * found.end.sd + of_cut * of_cut < kSharp_px2) {
    const EndsAndCuts near{best.at - kReach_px,        best.at + kReach_px,        0.1,
                           best.tangent - kReachOfCut, best.tangent + kReachOfCut, 0.02};
    found = mean_of(model, near, blur_px, radius, best);
  }
  return found;
}

}  // namespace punctum::vision
