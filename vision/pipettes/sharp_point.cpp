#include "vision/pipettes/sharp_point.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <numbers>
#include <opencv2/core.hpp>
#include <tuple>

#include "hal/math/elementary.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/glass.hpp"

namespace punctum::vision {

namespace {

constexpr double kBore = 0.65;       // of the outer radius; of usual capillaries 0.58 to 0.72
constexpr double kBefore_px = 0.55;  // the part of the blur that acts before the contrast
constexpr int kFine = 2;             // samples of the path per px
constexpr int kMargin_px = 6;        // round what is compared: the blur reaches so far
constexpr int kAhead_px = 7, kBehind_px = 9, kBeside_px = 6;  // of the end, what is compared

// Of the glass and of the light.
enum Parameter : int { kEnd, kAxis, kRadius, kTangent, kRoll, kGain, kLight, kTurn, kParameters };
using Parameters = cv::Vec<double, kParameters>;

struct Range {
  Parameters least, most;
};

// Rows along the needle, from ahead to behind, and lanes across it, 1 px apart.
struct Grid {
  int first_row, rows, beside;
  [[nodiscard]] int lanes() const { return 2 * beside + 1; }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(rows * lanes()); }
};

// x (27 + x^2) / (27 + 9 x^2) for a hyperbolic tangent.
float limited(float x) {
  const float clamped = std::max(std::min(x, 3.0F), -3.0F), square = clamped * clamped;
  return clamped * (27 + square) / (27 + 9 * square);
}

// One half of a Gaussian, its middle first; all of it has the sum 1.
template <std::size_t kReach>
std::array<float, kReach + 1> half_gaussian(double sigma) {
  std::array<double, kReach + 1> half{};
  double sum = 0;
  for (std::size_t k = 0; k <= kReach; ++k) {
    half[k] = math::exp(-0.5 * static_cast<double>(k * k) / (sigma * sigma));
    sum += (k == 0 ? 1 : 2) * half[k];
  }
  std::array<float, kReach + 1> out{};
  std::transform(half.begin(), half.end(), out.begin(),
                 [sum](double h) { return static_cast<float>(h / sum); });
  return out;
}

// The picture of a glass that ends so, smoothed as the field is, without what is straight across.
class LitGlass {
 public:
  LitGlass(const Grid& grid, double taper, double sigma_px)
      : grid_(grid),
        taper_(taper),
        fine_rows_(kFine * (grid.rows + 2 * kMargin_px)),
        fine_lanes_(kFine * (grid.lanes() + 2 * kMargin_px)),
        before_(half_gaussian<kBeforeReach>(kFine * kBefore_px)),
        blur_(half_gaussian<kBlurReach>(kFine * math::hypot(kLens_px, sigma_px))),
        path_(fine_size()),
        other_(fine_size()) {}

  void draw(const Parameters& p, Vector<double>& out) {
    trace(p);
    smooth_path();
    light(p);
    blur(out);
    take_off_straight(grid_, out);
  }

  static void take_off_straight(const Grid& grid, Vector<double>& picture) {
    const double lanes = grid.lanes(), beside = grid.beside, squares = lanes * (lanes * lanes - 1) / 12;
    for (int i = 0; i < grid.rows; ++i) {
      double* const row = picture.data() + static_cast<std::ptrdiff_t>(i) * grid.lanes();
      double mean = 0, slope = 0;
      for (int j = 0; j < grid.lanes(); ++j) {
        mean += row[j];
        slope += row[j] * (j - beside);
      }
      for (int j = 0; j < grid.lanes(); ++j) {
        row[j] -= mean / lanes + slope / squares * (j - beside);
      }
    }
  }

 private:
  static constexpr std::size_t kBeforeReach = 4, kBlurReach = 10;
  [[nodiscard]] std::size_t fine_size() const { return static_cast<std::size_t>(fine_rows_ * fine_lanes_); }
  [[nodiscard]] float* row(Vector<float>& of, int i) const {
    return of.data() + static_cast<std::ptrdiff_t>(i) * fine_lanes_;
  }

  // Of the light through the glass, from above to below.
  void trace(const Parameters& p) {
    const double across = math::cos(p[kRoll]), height = math::sin(p[kRoll]);
    for (int i = 0; i < fine_rows_; ++i) {
      const double s = grid_.first_row - kMargin_px + static_cast<double>(i) / kFine, behind = s - p[kEnd];
      const double radius = p[kRadius] + taper_ * std::max(behind - 2 * p[kRadius] * p[kTangent], 0.0);
      float* const out = row(path_, i);
      const auto first = static_cast<float>(-kMargin_px - grid_.beside - p[kAxis] - p[kTurn] * s),
                 cut = static_cast<float>((p[kRadius] - behind / p[kTangent]) / height),
                 per_px = static_cast<float>(across / height), outer = static_cast<float>(radius * radius),
                 bore = static_cast<float>(kBore * kBore) * outer;
      const auto chord = [](float square, float lowest) {
        const float half = std::sqrt(std::max(square, 0.0F));
        return half - std::max(std::min(lowest, half), -half);
      };
      for (int j = 0; j < fine_lanes_; ++j) {
        const float y = first + static_cast<float>(j) * (1.0F / kFine), lowest = cut - y * per_px;
        out[j] = chord(outer - y * y, lowest) - chord(bore - y * y, lowest);
      }
    }
  }

  // At the ends of a row there is no glass. Behind the last one and before the first, what is there goes on.
  void smooth_path() {
    constexpr int kReach = kBeforeReach;
    for (int i = 0; i < fine_rows_; ++i) {
      const float* const in = row(path_, i);
      float* const out = row(other_, i);
      for (int j = kReach; j < fine_lanes_ - kReach; ++j) {
        float sum = before_[0] * in[j];
        for (int k = 1; k <= kReach; ++k) {
          sum += before_[static_cast<std::size_t>(k)] * (in[j - k] + in[j + k]);
        }
        out[j] = sum;
      }
    }
    for (int i = 0; i < fine_rows_; ++i) {
      float* const out = row(path_, i);
      std::copy_n(row(other_, i), fine_lanes_, out);
      std::for_each(out, out + fine_lanes_, [this](float& v) { v *= before_[0]; });
      for (int k = 1; k <= kReach; ++k) {
        const float* const up = row(other_, std::max(i - k, 0));
        const float* const down = row(other_, std::min(i + k, fine_rows_ - 1));
        for (int j = 0; j < fine_lanes_; ++j) {
          out[j] += before_[static_cast<std::size_t>(k)] * (up[j] + down[j]);
        }
      }
    }
  }

  void light(const Parameters& p) {
    const auto along = static_cast<float>(math::cos(p[kLight])),
               across = static_cast<float>(math::sin(p[kLight]));
    const auto gain = static_cast<float>(0.5 * kFine * p[kGain]), per_gain = static_cast<float>(1 / p[kGain]);
    for (int i = 0; i < fine_rows_; ++i) {
      const float* const up = row(path_, std::max(i - 1, 0));
      const float* const down = row(path_, std::min(i + 1, fine_rows_ - 1));
      const float* const here = row(path_, i);
      float* const out = row(other_, i);
      for (int j = 1; j < fine_lanes_ - 1; ++j) {
        const float slope = along * (down[j] - up[j]) + across * (here[j + 1] - here[j - 1]);
        out[j] = limited(gain * slope) * per_gain;
      }
    }
  }

  void blur(Vector<double>& out) {
    constexpr int kReach = kBlurReach;
    static_assert(kReach <= kFine * kMargin_px);
    for (int r = 0; r < grid_.rows; ++r) {
      const int i = kFine * (r + kMargin_px);
      float* const sum = row(path_, 0);
      for (int j = 0; j < fine_lanes_; ++j) {
        sum[j] = blur_[0] * row(other_, i)[j];
      }
      for (int k = 1; k <= kReach; ++k) {
        const float *const up = row(other_, i - k), *const down = row(other_, i + k);
        for (int j = 0; j < fine_lanes_; ++j) {
          sum[j] += blur_[static_cast<std::size_t>(k)] * (up[j] + down[j]);
        }
      }
      for (int l = 0; l < grid_.lanes(); ++l) {
        const int j = kFine * (l + kMargin_px);
        float value = blur_[0] * sum[j];
        for (int k = 1; k <= kReach; ++k) {
          value += blur_[static_cast<std::size_t>(k)] * (sum[j - k] + sum[j + k]);
        }
        out[static_cast<std::size_t>(r * grid_.lanes() + l)] = static_cast<double>(value);
      }
    }
  }

  Grid grid_;
  double taper_;
  int fine_rows_, fine_lanes_;
  std::array<float, kBeforeReach + 1> before_;
  std::array<float, kBlurReach + 1> blur_;
  Vector<float> path_, other_;
};

double dot(const Vector<double>& a, const Vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += a[i] * b[i];
  }
  return sum;
}

// Levenberg and Marquardt's way; how bright the picture is, is told by each drawing itself.
class Fit {
 public:
  // usual, deviations: before anything is seen; 0: anything is as likely. noise: of the picture, grey levels.
  Fit(LitGlass& glass, const Vector<double>& seen, const Parameters& usual, const Parameters& deviations,
      const Range& range, double noise)
      : glass_(glass), seen_(seen), usual_(usual), range_(range), drawn_(seen.size()), left_(seen.size()) {
    for (int k = 0; k < kParameters; ++k) {
      sure_[k] = deviations[k] > 0 ? noise * noise / (deviations[k] * deviations[k]) : 0;
    }
    for (Vector<double>& column : slopes_) {
      column.resize(seen.size());
    }
  }

  struct Found {
    Parameters at;
    double left2;             // squared, of what is seen
    double unlikely = 0;      // the same, with what is unusual
    double end_variance = 0;  // for a variance of 1 of each sample
  };
  [[nodiscard]] Found from(const Parameters& start, int steps) {
    Found best{start, misses(start, left_)};
    best.unlikely = best.left2 + unusual(start);
    double damping = 0.01;
    for (int step = 0; step < steps; ++step) {
      const bool further = improve(best, damping);
      if (!further) {
        break;
      }
    }
    return best;
  }

 private:
  double misses(const Parameters& p, Vector<double>& left) {
    glass_.draw(p, drawn_);
    const double square = dot(drawn_, drawn_), brightness = square > 0 ? dot(drawn_, seen_) / square : 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      left[i] = brightness * drawn_[i] - seen_[i];
    }
    return dot(left, left);
  }

  [[nodiscard]] double unusual(const Parameters& p) const {
    double sum = 0;
    for (int k = 0; k < kParameters; ++k) {
      sum += sure_[k] * (p[k] - usual_[k]) * (p[k] - usual_[k]);
    }
    return sum;
  }

  // One step; false where there is none, or it gains nothing any more.
  bool improve(Found& best, double& damping) {
    constexpr std::array<double, kParameters> kApart = {0.05, 0.05, 0.05, 0.03, 0.03, 0.02, 0.03, 0.002};
    constexpr int kTries = 6;
    constexpr double kGains = 1e-4;
    for (int k = 0; k < kParameters; ++k) {
      Parameters beside = best.at;
      const double apart = kApart[static_cast<std::size_t>(k)];
      beside[k] += apart;
      Vector<double>& column = slopes_[static_cast<std::size_t>(k)];
      (void)misses(beside, column);
      for (std::size_t i = 0; i < column.size(); ++i) {
        column[i] = (column[i] - left_[i]) / apart;
      }
    }
    using Normal = cv::Matx<double, kParameters, kParameters>;
    Normal a;
    Parameters b;
    for (int k = 0; k < kParameters; ++k) {
      for (int l = 0; l <= k; ++l) {
        a(k, l) = a(l, k) = dot(slopes_[static_cast<std::size_t>(k)], slopes_[static_cast<std::size_t>(l)]);
      }
      b[k] = -dot(slopes_[static_cast<std::size_t>(k)], left_) - sure_[k] * (best.at[k] - usual_[k]);
      a(k, k) += sure_[k];
    }
    const auto damped = [&](double by) {
      Normal m = a;
      for (int k = 0; k < kParameters; ++k) {
        m(k, k) += by * (a(k, k) + 1e-9);
      }
      return m;
    };
    best.end_variance = damped(1e-6).inv(cv::DECOMP_LU)(kEnd, kEnd);
    Vector<double> left(left_.size());
    for (int i = 0; i < kTries; ++i, damping *= 4) {
      Parameters next = best.at + damped(damping).solve(b, cv::DECOMP_LU);
      for (int k = 0; k < kParameters; ++k) {
        next[k] = std::clamp(next[k], range_.least[k], range_.most[k]);
      }
      const double left2 = misses(next, left), unlikely = left2 + unusual(next);
      if (unlikely < best.unlikely) {
        const bool gains = best.unlikely - unlikely > kGains * best.unlikely;
        best.at = next;
        best.left2 = left2;
        best.unlikely = unlikely;
        left_.swap(left);
        damping = std::max(damping / 4, 1e-5);
        return gains;
      }
    }
    return false;
  }

  LitGlass& glass_;
  const Vector<double>& seen_;
  Parameters usual_, sure_;
  Range range_;
  Vector<double> drawn_, left_;
  std::array<Vector<double>, kParameters> slopes_;
};

// The best of the starts after a few steps, and after some more.
std::optional<SharpPoint> best_from(const GradientField& field, double noise, const NeedlePose& needle,
                                    double side, std::initializer_list<Parameters> starts, int tries,
                                    int steps) {
  constexpr double kDegree = std::numbers::pi / 180;
  const double end = (*starts.begin())[kEnd], radius = (*starts.begin())[kRadius],
               tangent = (*starts.begin())[kTangent];
  const Grid grid{.first_row = static_cast<int>(std::floor(end)) - kAhead_px,
                  .rows = kAhead_px + kBehind_px + static_cast<int>(std::ceil(2 * radius * tangent)),
                  .beside = static_cast<int>(std::ceil(radius)) + kBeside_px};
  Vector<double> seen(grid.size());
  for (int i = 0; i < grid.rows; ++i) {
    for (int j = 0; j < grid.lanes(); ++j) {
      const Point p = needle.at(grid.first_row + i, side * (j - grid.beside));
      if (!(p.x > field.area.x + 1 && p.y > field.area.y + 1 && p.x < field.area.x + field.area.width - 2 &&
            p.y < field.area.y + field.area.height - 2)) {
        return std::nullopt;
      }
      seen[static_cast<std::size_t>(i * grid.lanes() + j)] = field.grey(p);
    }
  }
  LitGlass::take_off_straight(grid, seen);

  LitGlass glass(grid, needle.taper, field.sigma);
  const Range range{{end - 6, -2.5, 0.7 * radius, 0.5, 0.02, 0.05, -30 * kDegree, -0.03},
                    {end + 6, 2.5, 1.4 * radius, 3, 0.8, 3, 210 * kDegree, 0.03}};
  Fit fit(glass, seen, {end, 0, radius, tangent, 0, 0.6, 0, 0},
          {0, 0.7, 0.1 * radius, 0.5, 0.35, 0.6, 0, 0.01}, range, noise);
  std::optional<Fit::Found> best;
  for (const Parameters& start : starts) {
    const auto found = fit.from(start, tries);
    if (!best || found.unlikely < best->unlikely) {
      best = found;
    }
  }
  best = fit.from(best->at, steps);
  const Parameters& p = best->at;
  // Neighbours err alike: of the smoothed noise so many are as one.
  const double alike = 4 * std::numbers::pi * field.sigma * field.sigma;
  const double roll = math::cos(p[kRoll]);
  SharpPoint point{
      .ahead = -p[kEnd],
      .aside = side * (p[kAxis] + p[kTurn] * p[kEnd] + p[kRadius] * roll),
      .sd = std::sqrt(best->end_variance * best->left2 / static_cast<double>(seen.size()) * alike),
      .tangent = -side * p[kTangent] * roll,
      .radius = p[kRadius],
      .explained = 1 - best->left2 / dot(seen, seen)};
  std::copy_n(p.val, kParameters, point.glass.begin());
  return point;
}

}  // namespace

std::optional<SharpPoint> sharp_point(const GradientField& field, double noise, const NeedlePose& needle,
                                      const CutGlass& cut) {
  constexpr int kTries = 3, kSteps = 12;
  constexpr double kUsualRoll = 0.25, kUsualGain = 0.6, kDegree = std::numbers::pi / 180;
  const double radius =
      cut.bevel.radius > 0 ? cut.bevel.radius : radius_in_relief(needle.half_width, field.sigma);
  const auto lit_from = [&](double degrees) {
    return Parameters(-cut.end.ahead, 0, radius, std::abs(cut.bevel.tangent), kUsualRoll, kUsualGain,
                      degrees * kDegree, 0);
  };
  return best_from(field, noise, needle, cut.bevel.tangent > 0 ? -1 : 1,
                   {lit_from(40), lit_from(90), lit_from(140)}, kTries, kSteps);
}

std::optional<SharpPoint> sharp_point_again(const GradientField& field, double noise,
                                            const NeedlePose& needle, const SharpPoint& before) {
  constexpr int kSteps = 2;
  static_assert(kParameters == std::tuple_size_v<decltype(SharpPoint::glass)>);
  return best_from(field, noise, needle, before.tangent > 0 ? -1 : 1, {Parameters(before.glass.data())}, 0,
                   kSteps);
}

}  // namespace punctum::vision
