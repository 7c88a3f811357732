#include "vision/membrane/edge_pattern.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "vision/image/parabola.hpp"

namespace punctum::vision {

void EdgePattern::learn(const ClearedPicture& picture, const Contour& contour) {
  count_ = 0;
  power_ = 0;
  for (int i = 0; i < kMost; ++i) {
    const Point& at = contour[static_cast<std::size_t>(i) * contour.size() / kMost];
    if (!picture.hidden(at)) {
      const Point gradient = picture.field.gradient(at);
      places_[static_cast<std::size_t>(count_++)] = {at, gradient};
      power_ += gradient.dot(gradient);
    }
  }
  const double noise = 2 * count_ * picture.gradient_noise * picture.gradient_noise;
  expected_ = power_ > 0 ? 1 - noise / power_ : 0;
}

double EdgePattern::likeness(const GradientField& field, const Point& by) const {
  double both = 0, seen = 0;
  for (int i = 0; i < count_; ++i) {
    const Place& place = places_[static_cast<std::size_t>(i)];
    const Point now = field.gradient(place.at + by);
    both += now.dot(place.gradient);
    seen += now.dot(now);
  }
  return seen > 0 ? both / std::sqrt(seen * power_) : 0;
}

Point EdgePattern::between_pixels(const GradientField& field, const Point& best) const {
  const double most = likeness(field, best);
  const auto along = [&](const Point& step) {
    return vertex_offset(likeness(field, best - step), most, likeness(field, best + step));
  };
  return best + Point(along({1, 0}), along({0, 1}));
}

std::optional<Point> EdgePattern::nearby(const GradientField& field) const {
  constexpr double kAlike = 0.8;  // of what is expected
  constexpr int kSide = 2 * kNear_px + 1;
  double most = kAlike * expected_;
  std::optional<Point> best;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Point by(i % kSide - kNear_px, i / kSide - kNear_px);
    if (const double there = likeness(field, by); there > most) {
      most = there;
      best = by;
    }
  }
  if (!best || std::max(std::abs(best->x), std::abs(best->y)) == kNear_px) {
    return std::nullopt;
  }
  return between_pixels(field, *best);
}

// Between two steps the edge may look less alike than somewhere else on a step: all that are nearly as alike
// as the best are looked at again.
std::optional<Point> EdgePattern::anywhere(const GradientField& field) const {
  constexpr int kStep_px = 2, kSide = 2 * kReach_px / kStep_px + 1;
  constexpr double kAlike = 0.5, kNearly = 0.7;
  std::array<double, kSide * kSide> coarse;
  const auto shift_of = [](std::size_t i) {
    return Point(static_cast<int>(i % kSide) * kStep_px - kReach_px,
                 static_cast<int>(i / kSide) * kStep_px - kReach_px);
  };
  for (std::size_t i = 0; i < coarse.size(); ++i) {
    coarse[i] = likeness(field, shift_of(i));
  }
  const double nearly = kNearly * *std::max_element(coarse.begin(), coarse.end());
  double most = kAlike;
  std::optional<Point> best;
  for (std::size_t i = 0; i < coarse.size(); ++i) {
    for (int near = 0; near < 9 && coarse[i] > nearly; ++near) {
      const Point by = shift_of(i) + Point(near % 3 - 1, near / 3 - 1);
      if (const double there = likeness(field, by); there > most) {
        most = there;
        best = by;
      }
    }
  }
  return best ? std::optional(between_pixels(field, *best)) : std::nullopt;
}

}  // namespace punctum::vision
