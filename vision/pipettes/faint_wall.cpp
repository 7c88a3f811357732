#include "vision/pipettes/faint_wall.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "vision/image/kept_vector.hpp"
#include "vision/image/median.hpp"
#include "vision/pipettes/needle_walls.hpp"

namespace punctum::vision {

namespace {

constexpr double kFrom_px = 10, kTo_px = 154, kApart_px = 3;  // stations behind the tip
constexpr int kAside_px = 30;                                 // of the pose, a pixel apart
constexpr int kBeside_px = 5;  // from the middle of a line, what it is compared with
constexpr int kPlaces = 2 * kAside_px + 1;
constexpr int kSteepest = 12;   // steps to either side of the pose's axis
constexpr double kTurn = 0.01;  // px across per px along

// A line along the needle: its place across the pose at the distance s behind the tip.
struct Line {
  double at_middle = 0, slope = 0;
  double contrast = 0;  // grey levels over what lies beside it

  [[nodiscard]] double at(double s) const { return at_middle + slope * (s - 0.5 * (kFrom_px + kTo_px)); }
};

// Grey levels across the pose at each station, a pixel apart.
constexpr int kWide = kPlaces + 2 * kBeside_px;
using Rows = Vector<std::array<double, kWide>>;

Rows rows_across(const GradientField& field, const NeedlePose& needle) {
  Rows rows;
  const Point across(-needle.axis.y, needle.axis.x);
  std::array<float, kWide + GradientField::kAtOnce> grey{};
  for (double s = kFrom_px; s <= kTo_px; s += kApart_px) {
    const Point from = needle.at(s, -kAside_px - kBeside_px);
    if (!field.contains(from, across, kWide)) {
      break;
    }
    field.greys(from, across, kWide, grey.data());
    std::copy_n(grey.begin(), kWide, rows.emplace_back().begin());
  }
  return rows;
}

// Between what lies on either side of the line there is nothing but that.
void erase(const Line& line, Rows& rows) {
  constexpr int kHalf_px = 5;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double u = line.at(kFrom_px + kApart_px * static_cast<double>(i));
    const long middle = std::lround(u) + kAside_px + kBeside_px;
    const auto first = static_cast<std::size_t>(std::clamp(middle - kHalf_px, 0L, kWide - 1L)),
               last = static_cast<std::size_t>(std::clamp(middle + kHalf_px, 0L, kWide - 1L));
    const double step =
        (rows[i][last] - rows[i][first]) / static_cast<double>(std::max<std::size_t>(last - first, 1));
    for (std::size_t k = first + 1; k < last; ++k) {
      rows[i][k] = rows[i][first] + step * static_cast<double>(k - first);
    }
  }
}

// How much brighter each place is than what lies beside it.
using Band = Vector<std::array<double, kPlaces>>;

Band lines_of(const Rows& rows) {
  Band band(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < kPlaces; ++k) {
      band[i][k] = rows[i][k + kBeside_px] - 0.5 * (rows[i][k] + rows[i][k + 2 * kBeside_px]);
    }
  }
  return band;
}

std::size_t place_of(const Line& line, std::size_t station) {
  const double u = line.at(kFrom_px + kApart_px * static_cast<double>(station));
  return static_cast<std::size_t>(std::clamp(std::lround(u) + kAside_px, 0L, kPlaces - 1L));
}

// Its contrast is a mean; no station counts for more than `most` grey levels.
Line line_along(const Band& band, int middle, int slope, double most) {
  Line line{static_cast<double>(middle), slope * kTurn};
  for (std::size_t i = 0; i < band.size(); ++i) {
    line.contrast += std::clamp(band[i][place_of(line, i)], -most, most) / static_cast<double>(band.size());
  }
  return line;
}

// The median along it.
double contrast_of(const Line& line, const Band& band) {
  Vector<double> along;
  along.reserve(band.size());
  for (std::size_t i = 0; i < band.size(); ++i) {
    along.push_back(band[i][place_of(line, i)]);
  }
  return along.empty() ? 0 : median_of(along);
}

// The line with the most contrast of those that `may_be`.
template <typename MayBe>
Line strongest(const Band& band, double most, MayBe may_be) {
  Line best;
  for (int middle = -kAside_px; middle <= kAside_px; ++middle) {
    for (int slope = -kSteepest; slope <= kSteepest; ++slope) {
      const Line line{static_cast<double>(middle), slope * kTurn};
      if (!may_be(line)) {
        continue;
      }
      if (const Line seen = line_along(band, middle, slope, most);
          std::abs(seen.contrast) > std::abs(best.contrast)) {
        best = seen;
      }
    }
  }
  return best;
}

}  // namespace

std::optional<NeedlePose> with_faint_wall(const GradientField& field, double noise, double radius,
                                          const NeedlePose& needle) {
  constexpr std::size_t kFewest = 20;  // stations
  constexpr double kNoises = 6, kMostNoises = 4, kOneSided = 1.6, kFaint = 0.35;
  constexpr double kOfOneWall_px = 3.5, kAlike = 0.7, kAlone = 4;
  constexpr double kNearest_px = 7, kSteepestTaper = 0.1;  // of the lines' middles
  constexpr double kHalfOfLine_px = 2.2;
  Rows rows = rows_across(field, needle);
  Band band = lines_of(rows);
  if (band.size() < kFewest) {
    return std::nullopt;
  }
  const double smooth_noise = std::max(noise, 0.5) / (2 * field.sigma * std::sqrt(std::numbers::pi));
  const double of_place = smooth_noise * std::sqrt(1.5);
  const double least = kNoises * of_place / std::sqrt(static_cast<double>(band.size()));
  const double reach = needle.half_width_at(kTo_px) + kBeside_px;
  const Line wall =
      strongest(band, 1e9, [&](const Line& line) { return std::abs(line.at(kTo_px)) <= reach; });
  erase(wall, rows);
  band = lines_of(rows);
  const double length = kTo_px - kFrom_px;
  // Specks tell little at first; then as much as the line that was found.
  const auto beside = [&](double side) {
    const auto may_be = [&](const Line& line) {
      const double near = side * (line.at(kFrom_px) - wall.at(kFrom_px)),
                   far = side * (line.at(kTo_px) - wall.at(kTo_px));
      return near >= kNearest_px && near <= 2 * (2 * radius + 1) && far >= near &&
             far - near <= 2 * kSteepestTaper * length && std::abs(line.at(kTo_px)) <= kAside_px &&
             std::abs(line.at(kFrom_px)) <= kAside_px;
    };
    double most = kMostNoises * of_place;
    Line line = strongest(band, most, may_be);
    const double usual = std::abs(contrast_of(line, band));
    if (usual > 0.5 * most) {
      line = strongest(band, 1.5 * usual, may_be);
    }
    return line;
  };
  const Line low = beside(-1), high = beside(1);
  const Line& other = std::abs(low.contrast) > std::abs(high.contrast) ? low : high;
  const Line& opposite = &other == &low ? high : low;
  const double share = other.contrast / wall.contrast;
  const bool faint =
      std::abs(share) <= kFaint && std::abs(other.contrast) >= kOneSided * std::abs(opposite.contrast);
  // Both faces of one wall look like a thin needle; the other wall is then about as strong.
  const bool alike = needle.half_width < kOfOneWall_px && share > kAlike && share < 1 / kAlike &&
                     std::abs(other.contrast) >= kAlone * std::abs(opposite.contrast);
  if (std::abs(other.contrast) < least || !(faint || alike)) {
    return std::nullopt;
  }
  const Point across(-needle.axis.y, needle.axis.x);
  NeedlePose found = needle;
  found.tip = needle.at(0, 0.5 * (wall.at(0) + other.at(0)));
  found.axis -= 0.5 * (wall.slope + other.slope) * across;
  found.axis *= 1 / cv::norm(found.axis);
  found.half_width = 0.5 * std::abs(wall.at(0) - other.at(0)) + kHalfOfLine_px;
  found.taper = 0.5 * std::abs(wall.slope - other.slope);
  return found;
}

std::optional<NeedlePose> with_outer_line(const GradientField& field, double noise,
                                          const NeedlePose& needle) {
  constexpr int kFewest = 20;  // stations
  constexpr double kMost_px = 100;
  constexpr int kOfWall_px = 3, kMedium_px = 8;  // from the outer face, inward and outward
  constexpr int kNear_px = 1, kFar_px = 5;       // beyond the face, where the line is looked for
  constexpr double kNoises = 6, kOfWalls = 0.08, kOneSided = 2, kOuter = 1.5;
  constexpr double kAlike = 0.75, kOfAlike = 0.5;
  constexpr int kParts = 4;        // of the stations; the furthest is out of focus
  constexpr double kOfLine = 0.3;  // of its strength, in each part
  constexpr double kHalfOfLine_px = 1.8;
  const double outside = kMedium_px + 1;
  int stations = 0;
  const auto station = [&](int i) { return kFrom_px + kApart_px * i; };
  for (; station(stations) <= kMost_px; ++stations) {
    const double s = station(stations), w = needle.half_width_at(s) + outside;
    if (!field.area.contains(needle.at(s, w)) || !field.area.contains(needle.at(s, -w))) {
      break;
    }
  }
  if (stations < kFewest) {
    return std::nullopt;
  }
  // The median along the needle, of all stations or some, at half-widths and px from its axis.
  Vector<double> along;
  const auto grey_of = [&](int first, int end, double half_widths, double px) {
    along.clear();
    for (int i = first; i < end; ++i) {
      const double s = station(i);
      along.push_back(field.grey(needle.at(s, half_widths * needle.half_width_at(s) + px)));
    }
    return median_of(along);
  };
  const auto grey_at = [&](double half_widths, double px) { return grey_of(0, stations, half_widths, px); };
  const double medium = 0.5 * (grey_at(-1, -kMedium_px) + grey_at(1, kMedium_px));
  double across = 0;  // grey levels over the medium
  for (double at = -0.9; at < 1; at += 0.2) {
    across += grey_at(at, 0) - medium;
  }
  struct Side {
    double wall = 0, line = 0;
    int at = 0;  // px beyond the face
  };
  const auto look = [&](int side) {
    Side seen;
    for (int d = -kOfWall_px; d <= kFar_px; ++d) {
      const double grey = grey_at(side, side * d) - medium;
      if (d < 0) {
        seen.wall = std::abs(grey) > std::abs(seen.wall) ? grey : seen.wall;
      } else if (d >= kNear_px && grey * seen.wall < 0 && std::abs(grey) > std::abs(seen.line)) {
        seen.line = grey;
        seen.at = d;
      }
    }
    return seen;
  };
  const Side low = look(-1), high = look(1);
  const bool is_low = std::abs(low.line) > std::abs(high.line);
  const Side &found = is_low ? low : high, &other = is_low ? high : low;
  const double smooth_noise = std::max(noise, 0.5) / (2 * field.sigma * std::sqrt(std::numbers::pi));
  const double walls = std::max(std::abs(low.wall), std::abs(high.wall));
  // Beside two walls that are alike, as in bright field, a fainter line is their fringe.
  const bool alike = low.wall * high.wall > kAlike * walls * walls;
  const double least = std::max(kNoises * smooth_noise / std::sqrt(static_cast<double>(stations)),
                                (alike ? kOfAlike : kOfWalls) * walls);
  // As far as the light's path rises across the needle it falls again: what is missing of that is a wall,
  // more of the same a fringe.
  const bool is_one = std::abs(found.line) > std::max(least, kOneSided * std::abs(other.line)) &&
                      found.line * across < 0,
             are_both = needle.half_width < kLeastLumen_px && std::abs(found.line) > kOuter * walls &&
                        std::abs(other.line) > least && found.line * other.line < 0;
  if (!is_one && !are_both) {
    return std::nullopt;
  }
  // It shows all along the needle near its tip; granules beside that, or a membrane, in one place.
  for (int part = 0; part < kParts - 1; ++part) {
    const int first = part * stations / kParts, end = (part + 1) * stations / kParts, side = is_low ? -1 : 1;
    const double line =
        grey_of(first, end, side, side * found.at) - grey_of(first, end, side, side * kMedium_px);
    if (line * found.line < kOfLine * found.line * found.line) {
      return std::nullopt;
    }
  }
  const double by_found = found.at + kHalfOfLine_px, by_other = are_both ? other.at + kHalfOfLine_px : 0,
               by_low = is_low ? by_found : by_other, by_high = is_low ? by_other : by_found;
  NeedlePose wider = needle;
  wider.tip = needle.at(0, 0.5 * (by_high - by_low));
  wider.half_width += 0.5 * (by_low + by_high);
  return wider;
}

}  // namespace punctum::vision
