#include "vision/membrane/membrane_recoil.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/dispatched.hpp"

namespace punctum::vision {

namespace {

constexpr double kFromEntry_px = -8, kPlace_px = 0.5;  // along the needle
constexpr double kFirstLane_px = 2.5, kLastLane = 6;   // off its edge; off its axis, half-widths
constexpr double kIndependent_px = 3.5;                // the smoothing makes one of so much
constexpr double kChanges = 0.05;               // variance of what changes otherwise, squared usual edges
constexpr double kSurest = 30;                  // log odds
constexpr std::array kDimples{3.0, 5.0, 18.0};  // half-widths of the needle; the last logarithmic

// Of lanes, from one side of the needle to the other; px from its axis.
double off_axis(std::size_t lane, std::size_t one_side, double half_width) {
  const double near = half_width + kFirstLane_px, far = kLastLane * half_width;
  const double share = static_cast<double>(lane % one_side) / static_cast<double>(one_side - 1);
  return (lane < one_side ? -1 : 1) * (near + share * (far - near));
}

// Of what the membrane moves on the tip, u half-widths beside it.
double share_of_motion(double width, double u) {
  if (u >= width) {
    return 0;
  }
  const double f = 1 - u * u / (width * width);
  return width == kDimples.back() ? 1 - math::log(u) / math::log(width) : f * f;
}

constexpr std::size_t kAtOnce = 8;
using EightFloats = float __attribute__((vector_size(kAtOnce * sizeof(float))));

struct Compared {
  float squares = 0, places = 0;
};

// Two pictures of a lane, each with what it shows.
PUNCTUM_WIDE_LOOP void compare_lane(const float* last, const float* last_seen, const float* now,
                                    const float* now_seen, std::size_t places, Compared& out) {
  EightFloats squares{}, both{};
  for (std::size_t q = 0; q < places; q += kAtOnce) {
    EightFloats a, b, seen_a, seen_b;
    std::memcpy(&a, last + q, sizeof a);
    std::memcpy(&b, now + q, sizeof b);
    std::memcpy(&seen_a, last_seen + q, sizeof seen_a);
    std::memcpy(&seen_b, now_seen + q, sizeof seen_b);
    const EightFloats seen = seen_a * seen_b, off = b - a;
    squares += seen * off * off;
    both += seen;
  }
  for (std::size_t l = 0; l < kAtOnce; ++l) {
    out.squares += squares[l];
    out.places += both[l];
  }
}

}  // namespace

void MembraneRecoil::look(const ClearedPicture& picture, const NeedlePose& needle, const Point& entry,
                          double below_px) {
  const Point step = kPlace_px * needle.axis, across(-needle.axis.y, needle.axis.x);
  std::array<float, kPlaces + GradientField::kAtOnce> gx, gy;
  now_ = 1 - now_;
  for (std::size_t k = 0; k < kLanes; ++k) {
    Lane& lane = lanes_[now_][k];
    lane.seen.fill(0);
    const Point from =
        entry + kFromEntry_px * needle.axis + off_axis(k, kOneSide, needle.half_width) * across;
    if (!picture.field.contains(from, step, static_cast<int>(kPlaces))) {
      continue;
    }
    picture.field.gradients(from, step, static_cast<int>(kPlaces), gx.data(), gy.data());
    for (std::size_t q = 0; q < kPlaces; ++q) {
      lane.slope[kMost + q] =
          gx[q] * static_cast<float>(needle.axis.x) + gy[q] * static_cast<float>(needle.axis.y);
      const bool beyond = kFromEntry_px + static_cast<double>(q) * kPlace_px > below_px;
      lane.seen[kMost + q] = beyond || picture.hidden(from + static_cast<double>(q) * step) ? 0 : 1;
    }
  }
}

// noise: of the slope, grey levels per px. A shift that leaves too little to compare is as good as any.
void MembraneRecoil::compare(double noise, Unlike& unlike) const {
  constexpr float kEnough = 0.5;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const Lane &before = last()[k], &after = now()[k];
    float places = 0;
    for (const float seen : before.seen) {
      places += seen;
    }
    for (std::size_t shift = 0; shift <= 2 * kMost; ++shift) {
      Compared lane;
      compare_lane(before.slope.data() + kMost, before.seen.data() + kMost, after.slope.data() + shift,
                   after.seen.data() + shift, kPlaces, lane);
      unlike[k][shift] = lane.places > kEnough * places ? lane.squares / lane.places * places
                                                        : static_cast<float>(2 * noise * noise) * places;
    }
  }
}

std::optional<double> MembraneRecoil::update(const ClearedPicture& picture, const NeedlePose& needle,
                                             const Point& entry, std::optional<double> carried_px,
                                             double moved_px, double level, double below_px) {
  // By which it may go back and go on, in a frame.
  constexpr double kBack_px = 12, kOn_px = 3, kReach_px = kPlace_px * (kMost - 1);
  // It follows a tip that goes back, which is seen less exactly while it is fast.
  constexpr double kLetsGo_px = 1, kFollows = 1.5;
  look(picture, needle, entry, below_px);
  const double entry_moved = (entry - std::exchange(entry_, entry)).dot(needle.axis);
  // Of all that is beside the needle, against the entry.
  const double together =
      std::clamp(carried_px.value_or(entry_moved) - entry_moved, -kReach_px / 2, kReach_px / 2);
  moved_px -= carried_px.value_or(0);
  const double taken_from = kFollows * std::min(moved_px, 0.0) - kLetsGo_px;
  if (!std::exchange(seen_, true) || taken_from <= -kReach_px) {
    return std::nullopt;
  }
  const double noise = picture.gradient_noise, hw = needle.half_width;
  Unlike unlike;
  compare(noise, unlike);
  const double from = std::max(std::min(moved_px, 0.0) - kBack_px, -kReach_px),
               to = std::min(std::max(moved_px, 0.0) + kOn_px, kReach_px);
  double stays = std::numeric_limits<double>::max(), goes_back = stays;
  for (const double width : kDimples) {
    std::array<double, kLanes> share;
    for (std::size_t k = 0; k < kLanes; ++k) {
      share[k] = share_of_motion(width, std::abs(off_axis(k, kOneSide, hw)) / hw);
    }
    for (double by = from; by <= to; by += kPlace_px) {
      double sum = 0;
      for (std::size_t k = 0; k < kLanes; ++k) {
        const double px = std::clamp(together + by * share[k], -kReach_px, kReach_px);
        const double shift = static_cast<double>(kMost) + px / kPlace_px;
        const std::size_t whole = static_cast<std::size_t>(shift);
        const double part = shift - static_cast<double>(whole);
        sum += (1 - part) * static_cast<double>(unlike[k][whole]) +
               part * static_cast<double>(unlike[k][whole + 1]);
      }
      double& least = by < taken_from ? goes_back : stays;
      least = std::min(least, sum);
    }
  }
  const double lane_px = (kLastLane - 1) * hw / kOneSide;
  const double independent = kPlace_px / kIndependent_px * std::min(1.0, lane_px / kIndependent_px);
  const double odds =
      independent * (stays - goes_back) / (2 * (2 * noise * noise + kChanges * level * level));
  return std::clamp(odds, -kSurest, kSurest);
}

}  // namespace punctum::vision
