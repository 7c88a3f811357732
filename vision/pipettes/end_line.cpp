#include "vision/pipettes/end_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "vision/image/kept_vector.hpp"
#include "vision/image/parabola.hpp"

namespace punctum::vision {

namespace {

constexpr int kSamples = 4;         // of each stretch across the needle
constexpr int kEnded_px = 5;        // ahead of the line little is left of the walls
constexpr double kWallsLeft = 0.3;  // of their difference
constexpr int kHalf_px = 8;         // along the needle: beyond that nothing is left of the line
// The line is stronger than what the walls have in common, or all of a thin needle has, by so much; than
// their difference; and than the noise of a row.
constexpr double kOfWalls = 2, kOfWallsInRelief = 1, kOfUnlike = 0.2, kNoises = 6;
constexpr double kLeft = 0.2,
                 kEven = 0.35;       // of the line: what is left beside it, and how unlike its halves are
constexpr double kNoisesLeft = 3.5;  // of a row, that either may be more
// A line goes on to the outside of the needle, and is thin: a speck is round.
constexpr double kAcross = 0.5, kLeftOfThick = 0.5;
constexpr int kThick_px = 5;
constexpr double kSteepest = 0.2;  // px along per px of the half-width: of a blunt end

// Across the needle, grey levels.
struct Row {
  double low, high;  // both halves of the needle, over what lies beside it
  double rim;        // both, near its outside
  double walls;      // over what lies beside them and between them
  double unlike;     // half of what one wall has over the other
  double apart;      // by which one side of the needle differs from the other

  [[nodiscard]] double core() const { return 0.5 * (low + high); }
};

// Its taper may end before it does.
double half_width_at(const NeedlePose& needle, double s) {
  constexpr double kNarrowest = 0.6;
  return std::max(needle.half_width + needle.taper * s, kNarrowest * needle.half_width);
}

// `s` px behind the tip. Empty beside the picture.
std::optional<Row> row_at(const GradientField& field, const NeedlePose& needle, double s) {
  constexpr double kBeside_px = 3, kBesideTo_px = 6, kCore = 0.7, kLumen = 0.4, kRim = 0.85, kRimTo = 0.6;
  constexpr double kWallTo_px = 1, kWallFrom_px = 3;  // inside of the outer flank
  const double w = half_width_at(needle, s), far = w + kBesideTo_px;
  if (!field.area.contains(needle.at(s, far)) || !field.area.contains(needle.at(s, -far))) {
    return std::nullopt;
  }
  const auto mean = [&](double from, double to) {
    double sum = 0;
    for (int i = 0; i < kSamples; ++i) {
      sum += field.grey(needle.at(s, from + (to - from) * i / (kSamples - 1))) / kSamples;
    }
    return sum;
  };
  const double left = mean(-far, -w - kBeside_px), right = mean(w + kBeside_px, far),
               medium = 0.5 * (left + right), lumen = mean(-kLumen * w, kLumen * w),
               low_wall = mean(-w + kWallTo_px, -w + kWallFrom_px),
               high_wall = mean(w - kWallFrom_px, w - kWallTo_px);
  return Row{mean(-kCore * w, 0) - medium,
             mean(0, kCore * w) - medium,
             0.5 * (mean(-kRim * w, -kRimTo * w) + mean(kRimTo * w, kRim * w)) - medium,
             0.5 * (low_wall + high_wall - medium - lumen),
             0.5 * (low_wall - high_wall),
             std::abs(left - right)};
}

struct Walls {
  double contrast, unlike;  // what they have in common, or all of a thin needle has; half of their difference
};

// Over a stretch of the shaft.
Walls walls_from(const GradientField& field, const NeedlePose& needle, double from) {
  constexpr int kStretch_px = 10;
  double walls = 0, unlike = 0, core = 0;
  for (int i = 0; i < kStretch_px; ++i) {
    if (const auto row = row_at(field, needle, from + i)) {
      walls += row->walls / kStretch_px;
      unlike += row->unlike / kStretch_px;
      core += row->core() / kStretch_px;
    }
  }
  return {std::max(std::abs(walls), std::abs(core)), std::abs(unlike)};
}

// What the smoothing leaves of the noise in a mean across the needle.
double noise_of_row(const GradientField& field, double noise) {
  return std::max(noise, 0.5) / (2 * field.sigma * std::sqrt(std::numbers::pi)) / std::sqrt(kSamples / 2.0);
}

// Each px from `from` px ahead of the tip on.
Vector<Row> rows_ahead(const GradientField& field, const NeedlePose& needle, double from, double to) {
  Vector<Row> rows;
  rows.reserve(static_cast<std::size_t>(to - from) + 1);
  for (double ahead = from; ahead <= to; ++ahead) {
    const auto row = row_at(field, needle, -ahead);
    if (!row) {
      break;
    }
    rows.push_back(*row);
  }
  return rows;
}

// rows: of which the first lies `from` px ahead of the tip.
EndLine line_at(const Vector<Row>& rows, std::size_t i, double from, double row_noise) {
  const double before = std::abs(rows[i - 1].core()), top = std::abs(rows[i].core()),
               after = std::abs(rows[i + 1].core());
  const double curvature = std::max(2 * top - before - after, 1e-3);
  return {from + static_cast<double>(i) + vertex_offset(before, top, after), rows[i].core(),
          row_noise / curvature};
}

bool is_peak(const Vector<Row>& rows, std::size_t i) {
  const double top = std::abs(rows[i].core());
  return top >= std::abs(rows[i - 1].core()) && top >= std::abs(rows[i + 1].core());
}

// By which the line lies further ahead at one half of the needle than at the other, px. The walls end there,
// too, spread as far as the line is.
double slant(const Vector<Row>& rows, std::size_t i) {
  constexpr std::size_t kSpread_px = 5;
  const Row& shaft = rows[i - kHalf_px];
  const double of_walls = shaft.low - shaft.high;
  double whole = 0, passed = 0, across = 0, squares = 0;
  for (std::size_t k = i - kSpread_px; k <= i + kSpread_px; ++k) {
    whole += rows[k].core();
  }
  for (std::size_t k = i - kSpread_px; k <= i + kSpread_px; ++k) {
    passed += rows[k].core();
    const double steep = 0.5 * (rows[k + 1].core() - rows[k - 1].core());
    across += (rows[k].low - rows[k].high - of_walls * (1 - passed / whole)) * steep;
    squares += steep * steep;
  }
  return across / std::max(squares, 1e-9);
}

// Specks and edges of a cell are bright on one side and dark on the other, or go on beside the needle. The
// shaft behind it shows what it shows of itself, and half of that at the end.
bool is_alone(const Vector<Row>& rows, std::size_t i, double row_noise) {
  const Row& shaft = rows[i - kHalf_px];
  const double line = rows[i].core() - 0.5 * shaft.core(),
               most = kLeft * std::abs(line) + kNoisesLeft * row_noise;
  const double uneven = rows[i].low - rows[i].high - 0.5 * (shaft.low - shaft.high);
  if (line * rows[i].core() < 0 || std::abs(uneven) > kEven * std::abs(line) + kNoisesLeft * row_noise) {
    return false;
  }
  if (std::copysign(1.0, line) * (rows[i].rim - 0.5 * shaft.rim) <
          kAcross * std::abs(line) - kNoisesLeft * row_noise ||
      std::min(std::abs(rows[i - kThick_px].core() - shaft.core()), std::abs(rows[i + kThick_px].core())) >
          kLeftOfThick * std::abs(line)) {
    return false;
  }
  const double walls_left = kWallsLeft * std::abs(shaft.unlike) + kNoisesLeft * row_noise;
  for (std::size_t k = i - kHalf_px; k <= i + kHalf_px; ++k) {
    const bool beyond = k == i - kHalf_px || k == i + kHalf_px;
    const double along = std::copysign(1.0, line) * (rows[k].core() - (k < i ? shaft.core() : 0));
    const bool walls_go_on = k >= i + kEnded_px && std::abs(rows[k].unlike) > walls_left;
    if (rows[k].apart > most || along < -most || (beyond && along > most) || walls_go_on) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::optional<EndLine> end_line(const GradientField& field, double noise, const NeedlePose& needle,
                                double from, double to, bool in_relief) {
  const double of_row = noise_of_row(field, noise), first = from - kHalf_px;
  const Walls walls = walls_from(field, needle, kHalf_px - std::min(from, 0.0));
  const double least = std::max({(in_relief ? kOfWallsInRelief : kOfWalls) * walls.contrast,
                                 kOfUnlike * walls.unlike, kNoises * of_row});
  const Vector<Row> rows = rows_ahead(field, needle, first, to + kHalf_px);
  for (std::size_t i = kHalf_px; i + kHalf_px < rows.size(); ++i) {
    if (std::abs(rows[i].core()) > least && is_peak(rows, i) && is_alone(rows, i, of_row) &&
        std::abs(slant(rows, i)) < kSteepest * needle.half_width) {
      return line_at(rows, i, first, of_row);
    }
  }
  return std::nullopt;
}

std::optional<EndLine> end_line_again(const GradientField& field, double noise, const NeedlePose& needle,
                                      double strength, double reach) {
  constexpr double kLeast = 0.5;  // of its strength
  const Vector<Row> rows = rows_ahead(field, needle, -reach, reach);
  std::optional<std::size_t> best;
  for (std::size_t i = 1; i + 1 < rows.size(); ++i) {
    const double along = std::copysign(1.0, strength) * rows[i].core();
    if (is_peak(rows, i) && along > kLeast * std::abs(strength) &&
        (!best || along > std::abs(rows[*best].core()))) {
      best = i;
    }
  }
  return best ? std::optional(line_at(rows, *best, -reach, noise_of_row(field, noise))) : std::nullopt;
}

void go_to_end_of_fading_walls(const GradientField& field, double noise, NeedlePose& needle) {
  constexpr double kFrom_px = 8, kTo_px = 150;
  constexpr double kNear_px = 2, kFar_px = 50, kFades = 0.6;
  if (walls_from(field, needle, kNear_px).contrast > kFades * walls_from(field, needle, kFar_px).contrast) {
    return;
  }
  if (const auto line = end_line(field, noise, needle, kFrom_px, kTo_px, false)) {
    const double half_width = half_width_at(needle, -line->ahead);
    needle.tip += line->ahead * needle.axis;
    needle.half_width = half_width;
  }
}

}  // namespace punctum::vision
