#include "vision/pipettes/face_lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

namespace {

// A line beside the needle by its distance from the face of the pose, positive outside, at two distances
// behind the tip, and on in between and beyond.
constexpr double kNear_px = 20, kFar_px = 140;
constexpr double kFrom_px = 10, kTo_px = 170, kApart_px = 4;  // stations
constexpr double kStep_px = 0.25;
constexpr int kNearSteps = 16, kFarSteps = 20, kSteps = 26;  // to either side: tried, and looked at
constexpr std::size_t kPlaces = 2 * kSteps + 1;

struct FaceLine {
  double near = 0, far = 0;  // px
  double slope = 0;          // mean of the grey levels' change across the needle along it, per px
};

// At each station, and at each place across.
using Slopes = Vector<std::array<float, kPlaces>>;

Slopes slopes_beside(const GradientField& field, const NeedlePose& needle, double side) {
  Slopes slopes;
  slopes.reserve(static_cast<std::size_t>((kTo_px - kFrom_px) / kApart_px) + 1);
  const Point across(-needle.axis.y, needle.axis.x), step = side * kStep_px * across;
  std::array<float, kPlaces + GradientField::kAtOnce> gx{}, gy{};
  for (double s = kFrom_px; s <= kTo_px; s += kApart_px) {
    const Point from = needle.at(s, side * (needle.half_width_at(s) - kSteps * kStep_px));
    if (!field.contains(from, step, static_cast<int>(kPlaces))) {
      break;
    }
    field.gradients(from, step, static_cast<int>(kPlaces), gx.data(), gy.data());
    auto& here = slopes.emplace_back();
    for (std::size_t k = 0; k < kPlaces; ++k) {
      here[k] = gx[k] * static_cast<float>(across.x) + gy[k] * static_cast<float>(across.y);
    }
  }
  return slopes;
}

double mean_along(const Slopes& slopes, int near, int far) {
  const double turn = (far - near) / (kFar_px - kNear_px);
  double sum = 0, s = kFrom_px;
  for (const auto& here : slopes) {
    const double at = kSteps + near + turn * (s - kNear_px);
    sum += static_cast<double>(here[static_cast<std::size_t>(std::clamp(at + 0.5, 0.0, kPlaces - 1.0))]);
    s += kApart_px;
  }
  return sum / static_cast<double>(slopes.size());
}

// The line that the pose's face lies along, else the outermost one that is not much fainter than the
// strongest. Empty where nothing stands out.
std::optional<FaceLine> face_line(const Slopes& slopes, double least) {
  constexpr double kOfStrongest = 0.25, kSame_px = 1;
  constexpr std::size_t kNears = 2 * kNearSteps + 1, kFars = 2 * kFarSteps + 1;
  std::array<std::array<double, kFars>, kNears> mean{};
  double strongest = least;
  for (std::size_t i = 0; i < kNears; ++i) {
    for (std::size_t j = 0; j < kFars; ++j) {
      mean[i][j] = mean_along(slopes, static_cast<int>(i) - kNearSteps, static_cast<int>(j) - kFarSteps);
      strongest = std::max(strongest, std::abs(mean[i][j]));
    }
  }
  const auto is_peak = [&](std::size_t i, std::size_t j) {
    for (const std::size_t k : {i - 1, i, i + 1}) {
      for (const std::size_t l : {j - 1, j, j + 1}) {
        if (std::abs(mean[k][l]) > std::abs(mean[i][j])) {
          return false;
        }
      }
    }
    return true;
  };
  std::optional<FaceLine> outermost, of_pose;
  for (std::size_t i = 1; i + 1 < kNears; ++i) {
    for (std::size_t j = 1; j + 1 < kFars; ++j) {
      if (std::abs(mean[i][j]) <= std::max(least, kOfStrongest * strongest) || !is_peak(i, j)) {
        continue;
      }
      const FaceLine line{(static_cast<int>(i) - kNearSteps) * kStep_px,
                          (static_cast<int>(j) - kFarSteps) * kStep_px, mean[i][j]};
      if (std::abs(line.near) < kSame_px && std::abs(line.far) < kSame_px) {
        of_pose = {0, 0, line.slope};
      }
      if (!outermost || line.near + line.far > outermost->near + outermost->far) {
        outermost = line;
      }
    }
  }
  return of_pose ? of_pose : outermost;
}

}  // namespace

std::optional<NeedlePose> along_face_lines(const GradientField& field, double noise,
                                           const NeedlePose& needle) {
  constexpr std::size_t kFewest = 20;  // stations
  constexpr double kNoises = 4;
  constexpr double kWidens = 0.005, kAsWide_px = 1;
  const Slopes low_slopes = slopes_beside(field, needle, -1), high_slopes = slopes_beside(field, needle, 1);
  if (std::min(low_slopes.size(), high_slopes.size()) < kFewest) {
    return std::nullopt;
  }
  const double least =
      kNoises * field.noise_of_gradient(noise) / std::sqrt(static_cast<double>(low_slopes.size()));
  const auto low = face_line(low_slopes, least), high = face_line(high_slopes, least);
  // Light from one side: the light's path rises at one face, and falls at the other.
  if (!low || !high || low->slope * high->slope < 0) {
    return std::nullopt;
  }
  const auto at_tip = [](const FaceLine& line) {
    return line.near - (line.far - line.near) / (kFar_px - kNear_px) * kNear_px;
  };
  const auto turn = [](const FaceLine& line) { return (line.far - line.near) / (kFar_px - kNear_px); };
  NeedlePose found = needle;
  const Point across(-needle.axis.y, needle.axis.x);
  found.tip = needle.at(0, 0.5 * (at_tip(*high) - at_tip(*low)));
  found.axis -= 0.5 * (turn(*high) - turn(*low)) * across;
  found.axis *= 1 / cv::norm(found.axis);
  found.half_width += 0.5 * (at_tip(*high) + at_tip(*low));
  found.taper += 0.5 * (turn(*high) + turn(*low));
  const bool was_turned =
      found.taper > needle.taper + kWidens && std::abs(found.half_width - needle.half_width) < kAsWide_px;
  return was_turned ? std::optional(found) : std::nullopt;
}

}  // namespace punctum::vision
