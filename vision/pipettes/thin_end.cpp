#include "vision/pipettes/thin_end.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/pipettes/glass.hpp"

namespace punctum::vision {

namespace {

constexpr double kRow_px = 0.5, kLane_px = 0.5, kEnd_px = 0.25;
constexpr double kAhead_px = 3, kBehind_px = 20;  // of the nearest and furthest end, the medium and the shaft
constexpr double kAside_px = 2.5;                 // beyond the outermost edges, where the blur ends
constexpr double kBeside_px = 8;                  // of the medium on either side are taken off
constexpr double kReach_px = 4;                   // of the end from the one that is followed
constexpr double kFirst_px = -kReach_px - kAhead_px;
constexpr auto kRows = static_cast<std::size_t>((2 * kReach_px + kAhead_px + kBehind_px) / kRow_px) + 1;
constexpr double kKnown_px = 0.45;
// Half the thickness of the glass over its outer radius, as of a usual capillary. A line across the lumen
// takes at most so much as walls of this length in radii.
constexpr double kHalfWall = 0.15, kMostLine = 1.5;
constexpr std::size_t kLines = 4;  // from none to that
constexpr std::array<double, 6> kBlurs_px{1.0, 1.3, 1.6, 2.0, 2.5, 3.1};

// Sums over the rows of products of what an end shows: step, step times place, line, and what is seen.
struct Products {
  double ss = 0, st = 0, tt = 0, sl = 0, tl = 0, ll = 0, sd = 0, td = 0, ld = 0;
};

// By how much the squares of what is seen fall when step and slope have their best strengths, and the line
// has `line` times that of the step.
double gain(const Products& p, double line) {
  const double aa = p.ss + line * (2 * p.sl + line * p.ll), at = p.st + line * p.tl, ad = p.sd + line * p.ld,
               both = std::max(aa * p.tt - at * at, 1e-9 * aa * p.tt);
  return (ad * ad * p.tt - 2 * ad * p.td * at + p.td * p.td * aa) / std::max(both, 1e-12);
}

}  // namespace

bool ThinEnd::add(const GradientField& field, const NeedlePose& followed, bool in_relief) {
  if (in_relief_ != in_relief) {
    forget();
  }
  in_relief_ = in_relief;
  if (frames_ == 0) {
    half_width_ = followed.half_width;
    taken_.assign(kRows, 0.0);
    unlike_.assign(kRows, 0.0);
  }
  const int inner = static_cast<int>(std::lround((half_width_ + kAside_px) / kLane_px)),
            outer = inner + static_cast<int>(kBeside_px / kLane_px);
  for (const double s : {kFirst_px, kFirst_px + kRow_px * (kRows - 1)}) {
    for (const int i : {-outer, outer}) {
      if (!field.shows(followed.at(s, i * kLane_px))) {
        return false;
      }
    }
  }
  const double part = 1.0 / ++frames_;
  for (std::size_t j = 0; j < kRows; ++j) {
    const double s = kFirst_px + kRow_px * static_cast<double>(j);
    double inside = 0, beside = 0, inside_unlike = 0, beside_unlike = 0;
    for (int i = -outer; i <= outer; ++i) {
      const double grey = field.grey(followed.at(s, i * kLane_px)), unlike = i < 0 ? -grey : i > 0 ? grey : 0;
      (std::abs(i) <= inner ? inside : beside) += grey;
      (std::abs(i) <= inner ? inside_unlike : beside_unlike) += unlike;
    }
    // A medium that is even, and one that grows across.
    const double even = (2 * inner + 1) / (2.0 * (outer - inner)),
                 grows = inner * (inner + 1.0) / (outer * (outer + 1.0) - inner * (inner + 1.0));
    taken_[j] += part * (kLane_px * (inside - beside * even) - taken_[j]);
    unlike_[j] += part * (kLane_px * (inside_unlike - beside_unlike * grows) - unlike_[j]);
  }
  return true;
}

std::optional<GlassEnd> ThinEnd::end(double noise) const {
  if (frames_ == 0) {
    return std::nullopt;
  }
  double square = 0;
  for (std::size_t j = 0; j < kRows; ++j) {
    square += taken_[j] * taken_[j] + (in_relief_ ? unlike_[j] * unlike_[j] : 0);
  }
  constexpr int kPerRow = static_cast<int>(kRow_px / kEnd_px);
  constexpr auto kEnds = static_cast<std::size_t>(2 * kReach_px / kEnd_px) + 1,
                 kShown = kEnds + kPerRow * (kRows - 1);
  Vector<double> gains(kBlurs_px.size() * kEnds * kLines), step(kShown), line(kShown);
  auto next = gains.begin();
  for (const double blur : kBlurs_px) {
    // The middle of the line lies half a wall behind the end; that of the light's slope at the end itself.
    const double radius = outer_radius_of_glass(half_width_, blur),
                 behind = in_relief_ ? 0 : kHalfWall * radius;
    const double furthest = kFirst_px - kReach_px;  // of the first row behind the last end
    for (std::size_t k = 0; k < kShown; ++k) {
      const double t = furthest + kEnd_px * static_cast<double>(k), z = (t - behind) / blur;
      step[k] = 0.5 * blurred_step(t / (std::numbers::sqrt2 * blur));
      line[k] = math::exp(-0.5 * z * z);
    }
    const double most = kMostLine * radius / (std::sqrt(2 * std::numbers::pi) * blur);
    for (std::size_t e = 0; e < kEnds; ++e) {
      Products p, sides;
      for (std::size_t j = 0; j < kRows; ++j) {
        const std::size_t k = e + kPerRow * j;
        const double place = furthest + kEnd_px * static_cast<double>(k), slope = step[k] * place;
        p.ss += step[k] * step[k];
        p.st += step[k] * slope;
        p.tt += slope * slope;
        p.sl += step[k] * line[k];
        p.tl += slope * line[k];
        p.ll += line[k] * line[k];
        p.sd += step[k] * taken_[j];
        p.td += slope * taken_[j];
        p.ld += line[k] * taken_[j];
        sides.sd += step[k] * unlike_[j];
        sides.td += slope * unlike_[j];
      }
      if (in_relief_) {
        sides.ss = p.ss;
        sides.st = p.st;
        sides.tt = p.tt;
        const Products lit_along{.ss = p.ll, .st = p.sl, .tt = p.ss, .sd = p.ld, .td = p.sd};
        next = std::fill_n(next, kLines, gain(sides, 0) + gain(lit_along, 0));
        continue;
      }
      for (std::size_t l = 0; l < kLines; ++l) {
        *next++ = gain(p, most * static_cast<double>(l) / (kLines - 1));
      }
    }
  }
  // Variance of a row, and of what the fit leaves: some rows are alike.
  constexpr double kAlike = 4;
  const double rows = static_cast<double>(kRows) * (in_relief_ ? 2 : 1);
  const double top = *std::max_element(gains.begin(), gains.end());
  const double within = half_width_ + kAside_px, across = 2 * within * (1 + within / kBeside_px);
  const double unit =
      std::max(noise * noise / frames_ * across / kRow_px, std::max(kAlike * (square - top) / rows, 1e-9));
  double sum = 0, sum_e = 0, sum_ee = 0, sum_blur = 0;
  for (std::size_t i = 0; i < gains.size(); ++i) {
    const double weight = math::exp((gains[i] - top) / (2 * unit)),
                 ahead = kEnd_px * static_cast<double>(i / kLines % kEnds) - kReach_px;
    sum += weight;
    sum_e += weight * ahead;
    sum_ee += weight * ahead * ahead;
    sum_blur += weight * kBlurs_px[i / (kLines * kEnds)];
  }
  const double mean = sum_e / sum, sd = std::sqrt(std::max(sum_ee / sum - mean * mean, 0.0));
  return sd <= kKnown_px && std::abs(mean) < kReach_px - 2 * kKnown_px
             ? std::optional(GlassEnd{mean, sd, sum_blur / sum})
             : std::nullopt;
}

}  // namespace punctum::vision
