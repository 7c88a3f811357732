#include "vision/pipettes/steep_glass.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <opencv2/core.hpp>
#include <optional>

#include "hal/math/elementary.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/image/median.hpp"
#include "vision/image/parabola.hpp"
#include "vision/pipettes/robust_line.hpp"

namespace punctum::vision {

namespace {

constexpr int kCell_px = 16;  // by which the blurred shaft is looked at
// Growth of the half-width per px. What grows less is in focus over much of its length; glass is not drawn
// out to more. Out of focus a face seems to lie further out.
constexpr double kLeastTaper = 0.07, kMostTaper = 0.36, kMostUnsharp = 0.5;
constexpr double kAhead_px = 100, kBack_px = 120;  // the end lies so near where the lines of equal grey meet
constexpr double kNoises = 8;                      // a change of grey in a single place that is none of noise

struct Cell {
  Point at, light;  // px; unit, to where it is brighter
};

Vector<double> mean_of_cells(const GradientField& field, int w, int h) {
  Vector<double> mean(static_cast<std::size_t>(w * h), 0.0);
  for (int y = 0; y < h * kCell_px; ++y) {
    const float* row = field.smooth.ptr<float>(y);
    double* cell = mean.data() + static_cast<std::ptrdiff_t>(y / kCell_px) * w;
    for (int x = 0; x < w; ++x, row += kCell_px) {
      float sum = 0;
      for (int k = 0; k < kCell_px; ++k) {
        sum += row[k];
      }
      cell[x] += static_cast<double>(sum) / (kCell_px * kCell_px);
    }
  }
  return mean;
}

Vector<Cell> cells_that_slope(const GradientField& field, double noise) {
  constexpr double kUneven_grey = 1.5;  // the light varies by less from cell to cell
  const int w = field.area.width / kCell_px, h = field.area.height / kCell_px;
  const double least = std::max(kUneven_grey, kNoises * noise / kCell_px);
  const Vector<double> mean = mean_of_cells(field, w, h);
  Vector<Cell> out;
  out.reserve(mean.size());
  for (int y = 1; y + 1 < h; ++y) {
    for (int x = 1; x + 1 < w; ++x) {
      const double* here = mean.data() + static_cast<std::ptrdiff_t>(y) * w + x;
      const Point slope(0.5 * (here[1] - here[-1]), 0.5 * (here[w] - here[-w]));
      if (const double size = math::hypot(slope.x, slope.y); size > least) {
        out.push_back({kCell_px * Point(x + 0.5, y + 0.5), 1 / size * slope});
      }
    }
  }
  return out;
}

// Where most of the lines of equal grey meet, of those with the light on either side as many.
Point where_lines_meet(const Vector<Cell>& cells, const cv::Size& picture) {
  constexpr int kNearest = 3;  // cells: nearer ones meet anywhere
  const int w = picture.width / kCell_px, h = picture.height / kCell_px;
  std::array<Vector<int>, 2> lines;
  for (std::size_t side = 0; side < 2; ++side) {
    lines[side].resize(static_cast<std::size_t>(w * h), 0);
    for (const Cell& c : cells) {
      const Point along = side == 0 ? Point(-c.light.y, c.light.x) : Point(c.light.y, -c.light.x);
      Point p = 1.0 / kCell_px * c.at + kNearest * along;
      for (; p.x >= 0 && p.y >= 0 && p.x < w && p.y < h; p += along) {
        ++lines[side][static_cast<std::size_t>(static_cast<int>(p.y) * w + static_cast<int>(p.x))];
      }
    }
  }
  int most = -1;
  Point best;
  for (int y = 1; y + 1 < h; ++y) {
    for (int x = 1; x + 1 < w; ++x) {
      int sum = 0;
      for (int k = 0; k < 9; ++k) {
        const auto near = static_cast<std::size_t>((y + k / 3 - 1) * w + x + k % 3 - 1);
        sum += std::min(lines[0][near], lines[1][near]);
      }
      if (sum > most) {
        most = sum;
        best = kCell_px * Point(x + 0.5, y + 0.5);
      }
    }
  }
  return best;
}

// The cells whose lines of equal grey run through the tip of the pose; its axis is then their middle.
Vector<Cell> cells_towards(NeedlePose& needle, const Vector<Cell>& cells) {
  constexpr double kPast_px = 2 * kCell_px,
                   kNearest_px = 3 * kCell_px;  // the direction errs by a cell in two
  Vector<Cell> out;
  out.reserve(cells.size());
  Point sum;
  for (const Cell& c : cells) {
    const Point way = needle.tip - c.at;
    const double far = math::hypot(way.x, way.y);
    if (far > kNearest_px && std::abs(way.dot(c.light)) < kPast_px) {
      out.push_back(c);
      sum += 1 / far * way;
    }
  }
  const double size = math::hypot(sum.x, sum.y);
  needle.axis = size > 0 ? 1 / size * sum : needle.axis;
  return out;
}

// Of the outer faces, behind which it is brighter: turns the axis into their middle and sets the taper. False
// where they are not seen on both sides all the way to the border.
bool lie_on_shaft(const Vector<Cell>& cells, const cv::Rect& area, NeedlePose& needle) {
  // Of the parts of the shaft most show both faces; a speck or a corner without light may hide one.
  constexpr double kPart_px = 64, kMostly = 0.8;
  constexpr std::size_t kParts = 64, kFewest = 2;
  std::array<double, 2> slope{}, count{};
  std::array<std::array<bool, kParts>, 2> seen{};
  const Point across(-needle.axis.y, needle.axis.x);
  for (const Cell& c : cells) {
    const double s = (needle.tip - c.at).dot(needle.axis), u = (c.at - needle.tip).dot(across);
    if (s > 0 && std::abs(u) > kLeastTaper * s && std::abs(u) < kMostUnsharp * s &&
        u * c.light.dot(across) > 0) {
      const std::size_t side = u > 0 ? 1 : 0;
      slope[side] += u / s;
      ++count[side];
      seen[side][std::min(kParts - 1, static_cast<std::size_t>(s / kPart_px))] = true;
    }
  }
  std::size_t parts = 0, both = 0;
  for (std::size_t k = 1; k < kParts && area.contains(needle.at(kPart_px * static_cast<double>(k + 1), 0));
       ++k) {
    ++parts;
    both += seen[0][k] && seen[1][k] ? 1 : 0;
  }
  if (parts < kFewest || static_cast<double>(both) < kMostly * static_cast<double>(parts)) {
    return false;
  }
  const double low = slope[0] / count[0], high = slope[1] / count[1];
  needle.taper = (high - low) / 2;
  needle.axis -= (low + high) / 2 * across;
  needle.axis *= 1 / math::hypot(needle.axis.x, needle.axis.y);
  return true;
}

// Puts the tip where the glass meets the first clear medium, between its walls. False where there is none.
bool go_to_clear_medium(const GradientField& field, double noise_floor, NeedlePose& needle) {
  constexpr int kRows = static_cast<int>(kBack_px + kAhead_px) + 1, kClear_px = 24, kEnd_px = 24;
  // kBeside_px: the wider the strip, the more may cross it. kAsClear: what is blurred so much beside the
  // glass is none of it.
  constexpr double kBeside_px = 12, kAsClear = 0.04;
  std::array<double, kRows> steepest{}, sum{}, moment{};  // squares of the slope across the needle
  for (std::size_t k = 0; k < kRows; ++k) {
    const double s = kBack_px - static_cast<double>(k), wide = kBeside_px + needle.taper * (s + kAhead_px);
    for (double u = -wide; u <= wide; u += 1) {
      const Point g = field.gradient(needle.at(s, u));
      steepest[k] = std::max(steepest[k], g.dot(g));
      sum[k] += g.dot(g);
      moment[k] += u * g.dot(g);
    }
  }
  const double floor =
      std::max(noise_floor, kAsClear * std::sqrt(*std::max_element(steepest.begin(), steepest.end())));
  int end = 0, clear = 0;
  for (; end < kRows && clear < kClear_px; ++end) {
    clear = steepest[static_cast<std::size_t>(end)] < floor * floor ? clear + 1 : 0;
  }
  end -= clear;
  if (clear < kClear_px || end < kEnd_px) {
    return false;
  }
  const auto near_end = [&](const auto& v) {
    return std::accumulate(v.begin() + end - kEnd_px, v.begin() + end, 0.0);
  };
  needle.tip = needle.at(kBack_px - end, near_end(moment) / near_end(sum));
  return true;
}

// Where the highest of them is, in steps. Empty where that is the first or the last one, or below the floor.
std::optional<double> top_of(const Vector<double>& g, double floor) {
  const auto k = std::max_element(g.begin(), g.end());
  if (k == g.begin() || k + 1 == g.end() || *k < floor) {
    return std::nullopt;
  }
  return static_cast<double>(k - g.begin()) + vertex_offset(k[-1], k[0], k[1]);
}

struct OuterFace {
  double u, steep, blur;  // across, px; grey levels per px; px, with that of the field
};

// The steepest one on a side of the axis, -1 or 1.
std::optional<OuterFace> steepest_face(const GradientField& field, double floor, const NeedlePose& needle,
                                       double s, int side) {
  constexpr double kStep_px = 0.5, kBeside_px = 12;
  const Point outwards = side * Point(-needle.axis.y, needle.axis.x);
  Vector<double> g(static_cast<std::size_t>((kBeside_px + kMostUnsharp * s) / kStep_px));
  for (std::size_t k = 0; k < g.size(); ++k) {
    g[k] = field.gradient(needle.at(s, side * kStep_px * static_cast<double>(k))).dot(outwards);
  }
  const auto top = top_of(g, floor);
  if (!top) {
    return std::nullopt;
  }
  const auto steepest = std::max_element(g.begin(), g.end());
  const auto falls = [](double x) { return x <= 0; };
  const auto to = std::find_if(steepest, g.end(), falls);
  const auto from = std::find_if(std::make_reverse_iterator(steepest), g.rend(), falls).base();
  // As if it were that of a wide body.
  const double blur =
      kStep_px * std::accumulate(from, to, 0.0) / (*steepest * std::sqrt(2 * std::numbers::pi));
  return OuterFace{side * kStep_px * *top, *steepest, blur};
}

// Between the two walls. False where they are not straight, not about as strong, or not in focus.
bool lie_on_outer_faces(const GradientField& field, double floor, NeedlePose& needle) {
  // Nearer the end they are rounded; further back they are out of focus. That they are sharp next to it tells
  // that it is in focus: with a blur of twice the field's the end is uncertain by the needle's radius.
  constexpr double kFrom_px = 8, kTo_px = 48, kEvery_px = 2, kSharpTo_px = 24;
  constexpr std::size_t kFewest = 18;  // of 21
  constexpr double kOff_px = 1, kBlurMost_px = 2, kUnequal = 2;
  Vector<double> along, weight, blur;
  std::array<Vector<double>, 2> place, steep;
  for (double s = kFrom_px; s <= kTo_px; s += kEvery_px) {
    const auto low = steepest_face(field, floor, needle, s, -1),
               high = steepest_face(field, floor, needle, s, 1);
    if (!low || !high) {
      continue;
    }
    along.push_back(s);
    weight.push_back(1);
    place[0].push_back(low->u);
    place[1].push_back(high->u);
    steep[0].push_back(low->steep);
    steep[1].push_back(high->steep);
    if (s <= kSharpTo_px) {
      blur.push_back(std::max(low->blur, high->blur));
    }
  }
  if (along.size() < kFewest) {
    return false;
  }
  const RobustLine low = fit_robust_line(along, place[0], weight, kOff_px),
                   high = fit_robust_line(along, place[1], weight, kOff_px);
  const Point across(-needle.axis.y, needle.axis.x);
  needle.tip += (low.line.offset + high.line.offset) / 2 * across;
  needle.half_width = (high.line.offset - low.line.offset) / 2;
  needle.taper = (high.line.slope - low.line.slope) / 2;
  needle.axis -= (low.line.slope + high.line.slope) / 2 * across;
  needle.axis *= 1 / math::hypot(needle.axis.x, needle.axis.y);
  const double weaker = std::min(median_of(steep[0]), median_of(steep[1])),
               stronger = std::max(median_of(steep[0]), median_of(steep[1]));
  return std::max(low.rms, high.rms) < kOff_px && median_of(blur) < kBlurMost_px &&
         stronger < kUnequal * weaker;
}

// Puts the tip where it becomes brighter most steeply, on average over most of the width.
bool go_to_face(const GradientField& field, double floor, NeedlePose& needle) {
  constexpr double kStep_px = 0.5, kBackMost_px = 16, kAheadMost_px = 8, kOfWidth = 0.8;
  constexpr int kLanes = 8;  // to either side
  Vector<double> g;
  g.reserve(static_cast<std::size_t>((kBackMost_px + kAheadMost_px) / kStep_px) + 1);
  for (double s = kBackMost_px; s >= -kAheadMost_px; s -= kStep_px) {
    double sum = 0;
    for (int k = -kLanes; k <= kLanes; ++k) {
      const double u = kOfWidth * k / kLanes * (needle.half_width + needle.taper * s);
      sum += field.gradient(needle.at(s, u)).dot(needle.axis);
    }
    g.push_back(sum / (2 * kLanes + 1));
  }
  const auto top = top_of(g, floor);
  if (!top) {
    return false;
  }
  const double ahead = kStep_px * *top - kBackMost_px;
  needle.tip += ahead * needle.axis;
  needle.half_width -= ahead * needle.taper;
  return true;
}

}  // namespace

std::optional<NeedlePose> steep_glass(const GradientField& field, double noise) {
  if (field.area.size() != field.picture) {
    return std::nullopt;
  }
  const Vector<Cell> cells = cells_that_slope(field, noise);
  const double floor = kNoises * field.noise_of_gradient(noise);
  NeedlePose out;
  out.tip = where_lines_meet(cells, field.picture);
  const Vector<Cell> shaft = cells_towards(out, cells);
  for (int round = 0; round < 2; ++round) {
    if (!lie_on_shaft(shaft, field.area, out)) {
      return std::nullopt;
    }
  }
  if (!go_to_clear_medium(field, floor, out)) {
    return std::nullopt;
  }
  // The first of the faces are those of fringes ahead of the end.
  bool sharp = false;
  for (int round = 0; round < 3; ++round) {
    sharp = lie_on_outer_faces(field, floor, out);
    if (!go_to_face(field, floor, out)) {
      return std::nullopt;
    }
  }
  return sharp && out.taper > kLeastTaper && out.taper < kMostTaper ? std::optional(out) : std::nullopt;
}

}  // namespace punctum::vision
