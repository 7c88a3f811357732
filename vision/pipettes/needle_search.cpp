#include "vision/pipettes/needle_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "vision/pipettes/border_section.hpp"
#include "vision/pipettes/end_line.hpp"
#include "vision/pipettes/face_lines.hpp"
#include "vision/pipettes/faint_wall.hpp"
#include "vision/pipettes/needle_walls.hpp"
#include "vision/pipettes/wide_tube.hpp"

namespace punctum::vision {

namespace {

constexpr double kWidest_radii = 10;  // of its radius at the tip: its whole width at the border
// Where the walls go on so far behind what lies across the needle, it does not end there; so often.
constexpr double kAcross_px = 60, kLump_px = 14, kAcrossAveraged_px = 12;
constexpr int kAcross = 8;

// Through which it does not enter.
std::optional<Border> other_border(Side side) {
  return side == Side::automatic ? std::nullopt
                                 : std::optional(side == Side::right ? Border::left : Border::right);
}

// One wall of a holding pipette looks like a needle.
bool is_wall_of_wide_tube(const GradientField& field, const TubeTrace& tube, double noise) {
  constexpr double kNarrowest_px = 20, kWidest = 0.6;  // of the picture
  constexpr double kAside = 0.35, kOutside = 1.2, kTimesAsWide = 1.5, kParallel = 0.12;
  const Border border = entered_from(tube.axis) == Side::right ? Border::right : Border::left;
  const auto wide = trace_wide_tube(field, border, kNarrowest_px, kWidest * field.area.height, noise);
  if (!wide || wide->half_width < kTimesAsWide * tube.half_width ||
      std::abs(tube.axis.cross(wide->axis)) > kParallel) {
    return false;
  }
  const double aside = std::abs((tube.root - wide->root).cross(wide->axis)) / wide->half_width;
  return aside > kAside && aside < kOutside;
}

// Mean change of grey across the two outer faces. Those of two equal walls have opposite senses; in relief
// contrast they need not.
std::array<double, 2> faces(const GradientField& field, const NeedlePose& needle) {
  const Point across(-needle.axis.y, needle.axis.x);
  std::array<double, 2> out{};
  constexpr int kStations = 30;
  for (int i = 0; i < kStations; ++i) {
    const double s = 10 + 2 * i, w = needle.half_width_at(s);
    out[0] += field.gradient(needle.at(s, -w)).dot(across) / kStations;
    out[1] += field.gradient(needle.at(s, w)).dot(across) / kStations;
  }
  return out;
}

// As in relief, or where what was taken for both walls is one of them.
bool walls_differ(const GradientField& field, const NeedlePose& needle) {
  constexpr double kUnequal = 2;
  const auto [low, high] = faces(field, needle);
  return needle.half_width < kLeastLumen_px || std::abs(low) > kUnequal * std::abs(high) ||
         std::abs(high) > kUnequal * std::abs(low);
}

// It may hold on to the inner face of one wall, so that both faces have the same sense, or to those of both,
// so that it is bright as a lumen is. Then there are faces further out, of the opposite sense.
void look_further_out(const GradientField& field, double noise, double radius_px, NeedlePose& needle,
                      double& straight) {
  // Half the distance of the faces of a wall, and where they are looked for: sharp and out of focus. There
  // the inner face is twice as strong, and must not be seen again.
  struct Wall {
    double half_px, reach_px;
  };
  constexpr std::array<Wall, 2> kWalls = {{{1.5, kWallReach_px}, {2.5, 2}}};
  constexpr double kAsStrong = 0.6, kAsInner = 0.35;
  const auto [low, high] = faces(field, needle);
  const bool one = low * high > 0, both = low > 0 && high < 0;
  const double weaker = std::min(std::abs(low), std::abs(high));
  const NeedlePose before = needle;
  double most = kStraightWalls;
  const auto try_wider = [&](double by_low, double by_high, double reach) {
    NeedlePose wider = before;
    wider.tip = before.at(0, by_high - by_low);
    wider.half_width += by_low + by_high;
    const double s = fit_walls(field, noise, radius_px, wider, kLongestWall_px, reach);
    const auto [lower, higher] = faces(field, wider);
    const double weakest = std::min(std::abs(lower), std::abs(higher));
    if (s > most && wider.half_width > before.half_width + kWalls[0].half_px / 2 &&
        (one ? lower * higher < 0 && weakest > kAsStrong * weaker
             : lower < 0 && higher > 0 && weakest > kAsInner * weaker)) {
      needle = wider;
      straight = most = s;
    }
  };
  for (const auto& [by, reach] : kWalls) {
    if (one) {
      try_wider(by, 0, reach);
      try_wider(0, by, reach);
    } else if (both) {
      try_wider(by, by, reach);
    }
  }
}

}  // namespace

void NeedleSearch::begin_anew() {
  sections_looked_at_ = tubes_tried_ = 0;
  trace_.reset();
  tubes_.clear();
  walls_tried_.reset();
  too_wide_ = false;
}

bool NeedleSearch::advance(const GradientField& field, double noise) {
  return trace_next_border(field, noise) || (found_tube() && fit_walls_further(field, noise));
}

std::optional<NeedlePose> NeedleSearch::take_straight(const GradientField& field, double noise) {
  const TubeTrace& tube = tubes_[tubes_tried_];
  NeedlePose needle;
  const double straight = lie_between_walls(field, noise, tube, needle);
  walls_tried_.reset();
  const bool too_wide = needle.half_width > widest_half_width();
  too_wide_ = too_wide_ || (too_wide && straight >= kStraightWalls);
  if (straight < kStraightWalls || too_wide || is_wall_of_wide_tube(field, tube, noise)) {
    return std::nullopt;
  }
  return needle;
}

// False when all borders were traced before. Through the upper and the lower one enters what is too steep for
// the others.
bool NeedleSearch::trace_next_border(const GradientField& field, double noise) {
  if (trace_) {
    if (!trace_->advance(field)) {
      return true;
    }
    const auto t = trace_->tube(field);
    trace_.reset();
    if (t && t->edge_share > 0.5 && t->similarity > 0.5 && t->length > 12 &&
        (side_ == Side::automatic || side_ == entered_from(t->axis))) {
      // What looks like itself over a short length only is hardly a needle.
      constexpr double kLong = 3;  // half-widths
      const auto like = [](const TubeTrace& tube) {
        return tube.edge_share * tube.similarity * std::min(1.0, tube.length / (kLong * tube.half_width));
      };
      const auto less = [&](const TubeTrace& other) { return like(other) < like(*t); };
      tubes_.insert(std::find_if(tubes_.begin(), tubes_.end(), less), *t);
    }
    return true;
  }
  constexpr std::array kBorders = {Border::right, Border::left, Border::upper, Border::lower};
  // With all its edges first: in relief one wall may be faint.
  if (sections_looked_at_ == 2 * kBorders.size()) {
    return false;
  }
  const Border border = kBorders[sections_looked_at_ / 2];
  const bool without_specks = sections_looked_at_++ % 2 == 1;
  if (border == other_border(side_)) {
    return true;
  }
  const auto crossing = narrow_tube_at_border(field, border, 3, std::max(22.0, kWidest_radii * radius_px_),
                                              noise, without_specks);
  if (crossing && !(without_specks && crossing->half_width >= section_half_width_)) {
    trace_.emplace(*crossing);
  }
  section_half_width_ = crossing ? crossing->half_width : 0;
  return true;
}

// The width of what was traced is not certain. False when all was tried.
bool NeedleSearch::fit_walls_further(const GradientField& field, double noise) {
  // Noise may have hidden the walls near the end; a speck beside a wall draws the tube aside.
  constexpr double kReaches[] = {kWallReach_px, kWallReachAtStart_px};
  constexpr double kSurely = 0.9;
  const TubeTrace& tube = tubes_[tubes_tried_];
  NeedlePose traced;
  traced.axis = tube.axis;
  traced.half_width = tube.end_half_width;
  traced.taper = std::clamp((tube.half_width - tube.end_half_width) / std::max(tube.length, 1.0), 0.0, 0.2);
  const double length = walls_tried_ && walls_tried_->reaches % 2 == 1 ? tube.sure_length : tube.length;
  traced.tip = tube.root + length * tube.axis;
  if (!walls_tried_) {
    walls_tried_ = {traced, -1, 0};
  }
  if (walls_tried_->reaches == 2 * std::size(kReaches)) {
    return false;
  }
  const double reach = kReaches[walls_tried_->reaches++ / 2];
  for (const double wider : {1.0, 0.7, 0.5}) {
    NeedlePose tried = traced;
    tried.half_width *= wider;
    const double s = walls_tried_->straight < kSurely
                         ? fit_walls(field, noise, radius_px_, tried, kLongestWall_px, reach)
                         : 0;
    if (s > walls_tried_->straight) {
      walls_tried_->straight = s;
      walls_tried_->needle = tried;
    }
  }
  return true;
}

// As the tube was traced, and up to where its walls end. Returns the share of the stations that are straight.
double NeedleSearch::lie_between_walls(const GradientField& field, double noise, const TubeTrace& tube,
                                       NeedlePose& needle) const {
  const double back = std::min(30.0, 0.5 * tube.length);
  needle = walls_tried_->needle;
  double straight = walls_tried_->straight;
  look_further_out(field, noise, radius_px_, needle, straight);
  const auto go_to_end = [&] {
    put_at_end_of_walls(field, noise, back, 25, needle);
    for (int k = 0;
         k < kAcross && walls_go_on(field, noise, needle, kLump_px, kAcross_px, kAcrossAveraged_px); ++k) {
      needle.tip += kAcross_px * needle.axis;
      needle.half_width -= kAcross_px * needle.taper;
      (void)fit_walls(field, noise, radius_px_, needle, kLongestWall_px);
      put_at_end_of_walls(field, noise, kAcross_px + 15, 25, needle);
    }
  };
  go_to_end();
  for (int round = 0; round < 2; ++round) {
    straight = fit_walls(field, noise, radius_px_, needle, kLongestWall_px);
    put_at_end_of_walls(field, noise, back, 10, needle);
  }
  if (const auto between =
          walls_differ(field, needle) ? with_faint_wall(field, noise, radius_px_, needle) : std::nullopt;
      between && between->half_width <= widest_half_width()) {
    needle = *between;
    NeedlePose fitted = needle;
    if (const double s = fit_walls(field, noise, radius_px_, fitted, kLongestWall_px); s >= kStraightWalls) {
      needle = fitted;
      straight = s;
    }
    go_to_end();
    put_at_end_of_walls(field, noise, back, 10, needle);
  }
  if (const auto wider = with_outer_line(field, noise, needle)) {
    constexpr double kWidth_px = 1;  // a faint line is seen at few stations, but tells the width
    NeedlePose fitted = *wider;
    const double s = fit_walls(field, noise, radius_px_, fitted, kLongestWall_px);
    if (s >= kStraightWalls || (needle.half_width >= kLeastLumen_px &&
                                std::abs(fitted.half_width - wider->half_width) <= kWidth_px)) {
      needle = fitted;
      straight = std::max(straight, s);
      put_at_end_of_walls(field, noise, back, 10, needle);
    }
  }
  if (const auto along = along_face_lines(field, noise, needle)) {
    needle = *along;
    put_at_end_of_walls(field, noise, back, 10, needle);
  }
  go_to_end_of_fading_walls(field, noise, needle);
  return straight;
}

}  // namespace punctum::vision
