#include "vision/pipettes/shaft_blur.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "vision/image/kept_vector.hpp"
#include "vision/image/median.hpp"
#include "vision/pipettes/glass.hpp"
#include "vision/pipettes/of_blurs.hpp"

namespace punctum::vision {

namespace {

// Grey levels across the shaft from `from` to `to` px behind the tip, from its axis outwards, less their
// mean: the mean of both sides, or, with sign -1, half of what one side has more than the other.
Vector<double> half_profile(const GradientField& field, const NeedlePose& needle, double from, double to,
                            double apart_px, double sign) {
  constexpr double kOutside_px = 6, kAlong_px = 1;
  const double half_width = needle.half_width_at(0.5 * (from + to));
  Vector<double> profile, along;
  for (double u = 0; u < half_width + kOutside_px; u += apart_px) {
    along.clear();
    for (double s = from; s < to; s += kAlong_px) {
      const double v = u + needle.half_width_at(s) - half_width;
      along.push_back(0.5 * (field.grey(needle.at(s, v)) + sign * field.grey(needle.at(s, -v))));
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
  // Out of focus a lumen looks like a wider blur. In focus it covers several lanes.
  constexpr double kNoLumen = 1;  // as surely as one place of the profile tells it
  cv::Matx33d a = cv::Matx33d::diag({1e-6, kNoLumen, 1e-6});
  cv::Vec3d g;
  double square = 0;
  for (std::size_t k = 0; k < profile.size(); ++k) {
    const double u = apart_px * static_cast<double>(k), low = (u - middle_px) / blur_px,
                 high = (u + middle_px) / blur_px;
    const cv::Vec3d shown(kBumpOfBlurs(low) + kBumpOfBlurs(high), kStepOfBlurs(high) - kStepOfBlurs(low), 1);
    a += shown * shown.t();
    g += profile[k] * shown;
    square += profile[k] * profile[k];
  }
  return square - g.dot(a.inv() * g);
}

}  // namespace

std::optional<double> blur_of_shaft(const GradientField& field, const NeedlePose& needle, double back) {
  constexpr double kApart_px = 0.5, kUnexplained = 0.2;
  constexpr double kUnequal = 0.5;  // the difference of both sides over what they have in common, squared
  // What it is tried with, and the least that a needle in focus has.
  constexpr double kLeast_px = 1.2, kMost_px = 4.8, kBlurStep_px = 0.1, kMiddleStep_px = 0.25,
                   kSharpest_px = 1.4;
  const double from = back + kShaftFrom_px, to = back + kShaftTo_px;
  const double half_width = needle.half_width_at(0.5 * (from + to));
  const Vector<double> profile = half_profile(field, needle, from, to, kApart_px, 1),
                       difference = half_profile(field, needle, from, to, kApart_px, -1);
  double least = 0, in_common = 0, apart = 0;
  for (std::size_t k = 0; k < profile.size(); ++k) {
    least += kUnexplained * profile[k] * profile[k];
    in_common += profile[k] * profile[k];
    apart += difference[k] * difference[k];
  }
  if (apart > kUnequal * in_common) {
    return std::nullopt;
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

}  // namespace punctum::vision
