// Does the stage go where it is sent? Judged from the set-points that the core sent and the tip that it
// reads, whatever the drive reports itself: a drive that hangs, encoders that stand still and a needle that
// moves by itself all show here.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"

namespace punctum::rt {

class FollowingCheck {
 public:
  // A reading may be reading_age_s old: the tip is compared with the path it was sent along within that time.
  explicit FollowingCheck(double reading_age_s) NONBLOCKING : age_s_(reading_age_s) {}

  void restart() NONBLOCKING { count_ = 0; }

  void sent(const hal::Vec3& set_point_m) NONBLOCKING {
    if (count_ == 0 || since_s(newest_) >= age_s_ / kPast) {
      newest_ = newest_ + 1 < kPoints ? newest_ + 1 : 0;
      count_ = std::min(count_ + 1, kPoints);
      begun_ns_[newest_] = now_ns_;
    }
    path_[newest_] = set_point_m;
  }
  // Once per tick.
  void step(double elapsed_s) NONBLOCKING {
    now_ns_ += static_cast<std::int64_t>(std::clamp(elapsed_s, 0.0, kLongest_s) * 1e9 + 0.5);
  }

  // The tip is within `limit_m` of the path it was sent along; true before anything was sent.
  [[nodiscard]] bool follows(const hal::Vec3& tip_m, double limit_m) const NONBLOCKING {
    if (count_ == 0 || (tip_m - point(0)).norm() <= limit_m) {
      return true;
    }
    for (std::size_t ago = 1; ago < count_; ++ago) {  // at most kPoints rounds
      // The point before was left longer ago than a reading may be old: the tip cannot come from there any
      // more.
      if (ago > 1 && since_s(place(ago - 1)) > age_s_) {
        break;
      }
      const hal::Vec3 segment = point(ago) - point(ago - 1);
      const double length2 = segment.squaredNorm();
      const double along =
          length2 > 0 ? std::clamp((tip_m - point(ago - 1)).dot(segment) / length2, 0.0, 1.0) : 0.0;
      if ((tip_m - point(ago - 1) - along * segment).norm() <= limit_m) {
        return true;
      }
    }
    return false;
  }

 private:
  static constexpr double kLongest_s = 1000;  // of a tick: the path is forgotten by then anyway
  static constexpr std::size_t kPast = 16;
  static constexpr std::size_t kPoints = kPast + 2;

  [[nodiscard]] std::size_t place(std::size_t ago) const NONBLOCKING {
    return newest_ >= ago ? newest_ - ago : newest_ + kPoints - ago;
  }
  [[nodiscard]] const hal::Vec3& point(std::size_t ago) const NONBLOCKING { return path_[place(ago)]; }

  [[nodiscard]] double since_s(std::size_t place) const NONBLOCKING {
    return 1e-9 * static_cast<double>(now_ns_ - begun_ns_[place]);
  }

  double age_s_;
  std::int64_t now_ns_ = 0;  // a sum of seconds would lose its resolution over days
  std::array<hal::Vec3, kPoints> path_{};
  std::array<std::int64_t, kPoints> begun_ns_{};  // when the tip was first sent towards the point
  std::size_t newest_ = 0;
  std::size_t count_ = 0;
};

}  // namespace punctum::rt
