#include "vision/pipettes/round_end.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "vision/image/median.hpp"
#include "vision/image/parabola.hpp"
#include "vision/pipettes/glass.hpp"

namespace punctum::vision {

namespace {

constexpr double kPlace_px = 0.5;
constexpr double kFrom_px = -2, kMedium_px = 4;  // of the tip; the last of the reach, which show the medium
constexpr auto kPlaces = static_cast<std::size_t>((RoundEnd::kReach_px - kFrom_px) / kPlace_px) + 1;
constexpr auto kMedium = static_cast<std::size_t>(kMedium_px / kPlace_px);
constexpr std::array kMiddle = {-0.2, -0.1, 0.0, 0.1,
                                0.2};  // half-widths: further aside the end has gone back
// The walls, behind what bends together.
constexpr double kWallsFrom_px = 10, kWallsTo_px = 30, kWall = 0.8, kBeside = 2;

double mean_across(const GradientField& field, const NeedlePose& needle, double s, double u) {
  return 0.5 * (field.grey(needle.at(s, u)) + field.grey(needle.at(s, -u)));
}

}  // namespace

bool RoundEnd::add(const GradientField& field, const NeedlePose& needle) {
  constexpr double kFirst_px = 6, kThen_px = 8;  // that it has moved by
  if (!field.shows(needle.at(-kReach_px, 0)) || !field.shows(needle.at(kWallsTo_px, 0))) {
    return false;
  }
  if (first_.frames == 0) {
    from_ = needle.tip;
  }
  const double moved = cv::norm(needle.tip - from_);
  if (moved < kFirst_px) {
    first_.add(field, needle);
  } else if (moved > kThen_px) {
    then_.add(field, needle);
  }
  return true;
}

std::optional<double> RoundEnd::ahead() const {
  constexpr double kSame_px = 0.75;
  const auto before = first_.line(), after = then_.line();
  return before && after && std::abs(*before - *after) < kSame_px
             ? std::optional(0.5 * (*before + *after) + kHalfOfWall * then_.half_width)
             : std::nullopt;
}

void RoundEnd::Mean::add(const GradientField& field, const NeedlePose& needle) {
  across.resize(kPlaces, 0.0);
  const double part = 1.0 / ++frames;
  half_width = needle.half_width;
  double sum = 0;
  int stations = 0;
  for (double s = kWallsFrom_px; s <= kWallsTo_px; s += 2) {
    const double w = needle.half_width_at(s);
    sum += mean_across(field, needle, s, kBeside * w) - mean_across(field, needle, s, kWall * w);
    ++stations;
  }
  walls += part * (sum / stations - walls);
  for (std::size_t k = 0; k < kPlaces; ++k) {
    double grey = 0;
    for (const double u : kMiddle) {
      grey += field.grey(needle.at(-(kFrom_px + kPlace_px * static_cast<double>(k)), u * half_width)) /
              static_cast<double>(kMiddle.size());
    }
    across[k] += part * (grey - across[k]);
  }
}

std::optional<double> RoundEnd::Mean::line() const {
  constexpr int kLeastFrames = 4;
  constexpr double kDark = 0.12,
                   kClear = 4;  // of what the walls are darker by; times what the medium scatters
  constexpr double kNearest_px = 1, kMost = 1.8;  // ahead; half-widths ahead
  if (frames < kLeastFrames || walls <= 0) {
    return std::nullopt;
  }
  const Vector<double> medium(across.end() - kMedium, across.end());
  const double level = median_of(medium);
  double scatter = 0;
  for (const double grey : medium) {
    scatter = std::max(scatter, std::abs(grey - level));
  }
  const double least = std::max(kDark * walls, kClear * scatter);
  for (std::size_t k = kPlaces - kMedium; k-- > 1;) {
    if (level - across[k] > least && across[k] <= across[k + 1] && across[k] <= across[k - 1]) {
      const double line = kFrom_px + kPlace_px * (static_cast<double>(k) +
                                                  vertex_offset(-across[k - 1], -across[k], -across[k + 1]));
      if (line < kNearest_px || line > kMost * half_width) {
        return std::nullopt;
      }
      return line;
    }
  }
  return std::nullopt;
}

}  // namespace punctum::vision
