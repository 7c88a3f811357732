// The stage's following error as the core sees it: from the set-points it sent itself and the tip it reads,
// whatever the drive says of its own. A drive that hangs, encoders that stand still and a needle that moves
// by itself all show here.
#pragma once

#include <algorithm>
#include <array>

#include "hal/devices.hpp"

namespace punctum::rt {

class FollowingCheck {
 public:
  // A reading may be reading_age_s old: the tip is compared with where it was sent within that time.
  explicit FollowingCheck(double reading_age_s) noexcept : age_s_(reading_age_s) {}

  void restart() noexcept { count_ = 0; }

  void sent(const hal::Vec3& set_point_m) noexcept {
    if (count_ == 0 || now_s_ - begun_s_[newest_] >= age_s_ / kPast) {
      newest_ = (newest_ + 1) % kPoints;
      count_ = std::min(count_ + 1, kPoints);
      begun_s_[newest_] = now_s_;
    }
    path_[newest_] = set_point_m;
  }
  // Once per tick.
  void step(double elapsed_s) noexcept { now_s_ += elapsed_s; }

  // From the tip to the nearest point of the path it was sent along; 0 before anything was sent.
  [[nodiscard]] double error_m(const hal::Vec3& tip_m) const noexcept {
    if (count_ == 0) return 0;
    double nearest = (tip_m - point(0)).norm();
    for (std::size_t ago = 1; ago < count_; ++ago) {
      // It was sent away from the point before so long ago; the last set-point it may be coming from still.
      if (ago > 1 && now_s_ - begun_s_[place(ago - 1)] > age_s_) break;
      const hal::Vec3 way = point(ago) - point(ago - 1);
      const double length2 = way.squaredNorm();
      const double along =
          length2 > 0 ? std::clamp((tip_m - point(ago - 1)).dot(way) / length2, 0.0, 1.0) : 0.0;
      nearest = std::min(nearest, (tip_m - point(ago - 1) - along * way).norm());
    }
    return nearest;
  }

 private:
  static constexpr std::size_t kPast = 16;
  static constexpr std::size_t kPoints = kPast + 2;

  [[nodiscard]] std::size_t place(std::size_t ago) const noexcept {
    return (newest_ + kPoints - ago) % kPoints;
  }
  [[nodiscard]] const hal::Vec3& point(std::size_t ago) const noexcept { return path_[place(ago)]; }

  double age_s_;
  double now_s_ = 0;
  std::array<hal::Vec3, kPoints> path_{};
  std::array<double, kPoints> begun_s_{};  // when it was sent towards the point
  std::size_t newest_ = 0;
  std::size_t count_ = 0;
};

}  // namespace punctum::rt
