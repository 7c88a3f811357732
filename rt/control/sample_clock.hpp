// Which samples of a device are new, judged by the time that each sample carries.
//
// A device with a rate of its own repeats its newest sample, with its time, until it has the next one: that
// is no error, the sample only ages. A time that cannot be true is not believed and its sample is not taken:
// a time ahead of the station's clock, a time before the newest sample, a sample that is older than the
// time-out when it arrives. A device with a wrong clock is therefore silent, and its time-out says so.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "hal/realtime.hpp"

namespace punctum::rt {

inline constexpr double kRounding_s = 1e-9;  // of a sum of the ticks' times

enum class SampleIs : std::uint8_t { fresh, repeated, untimely };

class SampleClock {
 public:
  explicit SampleClock(double timeout_s) NONBLOCKING
      : longest_s_(timeout_s + kRounding_s),
        timeout_ns_(static_cast<std::int64_t>(timeout_s * 1e9 + 0.5)) {}

  // Once per tick, before its reading.
  void step(double elapsed_s) NONBLOCKING {
    silent_s_ = std::min(silent_s_ + elapsed_s, kLongest_s);
    if (silent_s_ > longest_s_) {
      begun_ = false;  // the device begins anew, whatever its clock said before
    }
  }

  // A fresh sample counts as the newest one from here on.
  [[nodiscard]] SampleIs take(std::int64_t sample_ns, std::int64_t now_ns) NONBLOCKING {
    const bool later = sample_ns >= newest_ns_ + kNearest_ns;
    was_older_s_ = later ? 0 : grown_older_s(sample_ns, now_ns);
    if (sample_ns > now_ns + kAhead_ns || sample_ns < now_ns - timeout_ns_) {
      return SampleIs::untimely;
    }
    // A device that has been silent for too long begins anew, but not with the sample that it had.
    if (!later && (begun_ || sample_ns == newest_ns_)) {
      return sample_ns < newest_ns_ ? SampleIs::untimely : SampleIs::repeated;
    }
    newest_ns_ = sample_ns;
    begun_ = true;
    silent_s_ = 0;
    age_at_arrival_s_ = std::max(1e-9 * static_cast<double>(now_ns - sample_ns), 0.0);
    return SampleIs::fresh;
  }

  // Of the newest sample; before the first one, the time that was waited for it.
  [[nodiscard]] double age_s() const NONBLOCKING { return age_at_arrival_s_ + silent_s_; }
  [[nodiscard]] bool timed_out() const NONBLOCKING { return age_s() > longest_s_; }

 private:
  // By how much a repeated sample is older than it was counted.
  [[nodiscard]] double grown_older_s(std::int64_t sample_ns, std::int64_t now_ns) NONBLOCKING {
    if (!begun_ || sample_ns != newest_ns_) {
      return 0;
    }
    const double older_s = 1e-9 * static_cast<double>(now_ns - sample_ns) - age_s();
    // It arrived when the clock was wrong: two readings in a row say that it is older.
    age_at_arrival_s_ += std::max(0.0, std::min(older_s, was_older_s_));
    return older_s;
  }

  // A device takes its sample after the tick has read the clock and before the tick reads the device: at most
  // a tick of the slowest servo ahead.
  static constexpr std::int64_t kAhead_ns = 1'000'000;
  // Two samples nearer than this, less than half a tick at 8 kHz, are one: a velocity between them would be
  // the rounding of their times.
  static constexpr std::int64_t kNearest_ns = 50'000;
  static constexpr double kLongest_s = 1e6;

  double longest_s_;  // the time-out
  std::int64_t timeout_ns_;
  double silent_s_ = 0;  // since the newest sample arrived
  double age_at_arrival_s_ = 0;
  double was_older_s_ = 0;  // than it was counted, on the tick before
  std::int64_t newest_ns_ = std::numeric_limits<std::int64_t>::min();
  bool begun_ = false;
};

}  // namespace punctum::rt
