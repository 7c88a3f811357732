// A hand that is moved by something which knows ways and speeds and no place: a mouse, a stick, a pointer on
// a page. It follows a point with a lag of kLag_s, never faster than its speed, whatever moves the point. The
// point is never further ahead than the hand goes in kAhead_s at that speed; what is beyond is forgotten. So
// the position is continuous, and at rest a tenth of a second after the fingers are.
#pragma once

#include <algorithm>
#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"

namespace punctum::hal {

class HandFollower {
 public:
  static constexpr double kLag_s = 0.02;
  static constexpr double kAhead_s =
      0.04;  // more than comes at once from a device that reports 50 times a second
  static constexpr double kReach_m = 1;  // from the origin
  static constexpr double kLongest_s =
      0.05;  // between two readings; in a longer gap the hand goes no further

  explicit HandFollower(double speed_m_s) : speed_m_s_(speed_m_s) {}

  // The point, along one axis: a way, or from now on a speed.
  void move(std::size_t axis, double way_m) NONBLOCKING {
    ahead_m_[static_cast<Eigen::Index>(axis)] += way_m;
  }
  void steer(std::size_t axis, double speed_m_s) NONBLOCKING {
    steered_m_s_[static_cast<Eigen::Index>(axis)] = speed_m_s;
  }

  // Where the hand is now; times go forward.
  [[nodiscard]] Vec3 at(std::int64_t now_ns) NONBLOCKING {
    constexpr double kThere_m = 1e-8;
    const double since_s = begun_ ? 1e-9 * static_cast<double>(now_ns - at_ns_) : 0;
    const double dt_s = std::clamp(since_s, 0.0, kLongest_s);
    begun_ = true;
    at_ns_ = now_ns;
    for (int i = 0; i < 3; ++i) {
      ahead_m_[i] = std::clamp(ahead_m_[i] + dt_s * steered_m_s_[i], -kReach_m, kReach_m);
    }
    Vec3 gap_m = ahead_m_ - at_m_;
    const double most_m = speed_m_s_ * kAhead_s;
    if (const double length_m = gap_m.norm(); length_m > most_m) {
      gap_m *= most_m / length_m;
      ahead_m_ = at_m_ + gap_m;
    }
    const double length_m = gap_m.norm();
    const double step_m = std::min(length_m * dt_s / (kLag_s + dt_s), speed_m_s_ * dt_s);
    at_m_ = length_m < kThere_m ? ahead_m_ : Vec3(at_m_ + gap_m * (step_m / length_m));
    return at_m_;
  }

 private:
  double speed_m_s_;
  Vec3 ahead_m_ = Vec3::Zero();  // where the hand is going
  Vec3 at_m_ = Vec3::Zero();
  Vec3 steered_m_s_ = Vec3::Zero();  // of `ahead_m_`
  std::int64_t at_ns_ = 0;
  bool begun_ = false;
};

}  // namespace punctum::hal
