// The mean of the last samples of a path. What every sample obeys, a convex region or a bound on the
// velocity, the mean obeys too; its velocity changes by no more than the samples' velocity can differ, spread
// over the window.
#pragma once

#include <array>
#include <cstddef>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"

namespace punctum::rt {

class MovingAverage {
 public:
  static constexpr std::size_t kMost = 1024;  // samples

  explicit MovingAverage(std::size_t samples) NONBLOCKING : samples_(samples) {}

  [[nodiscard]] std::size_t samples() const NONBLOCKING { return samples_; }

  // All samples are `at`. They are written when the next one comes, however often it restarts until then.
  void restart(const hal::Vec3& at) NONBLOCKING {
    origin_ = at;
    sum_.setZero();
    at_rest_ = true;
  }

  // After a step: the path had no part along `normal` (unit), and has led to `to` instead of the mean `from`.
  void flatten(const hal::Vec3& from, const hal::Vec3& to, const hal::Vec3& normal) NONBLOCKING {
    sum_.setZero();
    for (std::size_t i = 0; i < samples_; ++i) {  // at most kMost rounds
      const hal::Vec3 off = origin_ + past_[i] - from;
      past_[i] = to - origin_ + off - normal.dot(off) * normal;
      sum_ += past_[i];
    }
  }

  [[nodiscard]] hal::Vec3 step(const hal::Vec3& sample) NONBLOCKING {
    if (at_rest_) {
      for (std::size_t i = 0; i < samples_; ++i) {  // at most kMost rounds
        past_[i].setZero();
      }
      at_rest_ = false;
    }
    sum_ += (sample - origin_) - past_[next_];
    past_[next_] = sample - origin_;
    next_ = next_ + 1 < samples_ ? next_ + 1 : 0;
    if (next_ == 0) {  // the sum is made anew, so that rounding does not add up
      sum_.setZero();
      for (std::size_t i = 0; i < samples_; ++i) {  // at most kMost rounds
        sum_ += past_[i];
      }
    }
    return origin_ + sum_ / static_cast<double>(samples_);
  }

 private:
  std::size_t samples_;  // 1 .. kMost
  std::size_t next_ = 0;
  bool at_rest_ = false;  // `past_` is not written yet
  hal::Vec3 origin_ = hal::Vec3::Zero();
  hal::Vec3 sum_ = hal::Vec3::Zero();
  std::array<hal::Vec3, kMost> past_{};
};

}  // namespace punctum::rt
