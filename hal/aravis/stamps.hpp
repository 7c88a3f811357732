// What GenICam cameras say of their frames: a time on a clock of their own, and a number that may wrap.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace punctum::aravis {

// The camera's clock onto the station's. A frame arrives some time after its stamp: the least of these times
// within the last ten seconds tells how far apart the clocks are; the rest is jitter. So a time is late by
// the transfer of the fastest frame, and by less than 1 ms if the clocks drift by less than 100 ppm. A least
// time far below all others is of a stamp that jumped ahead, until a second frame says the same.
class CameraClock {
 public:
  static constexpr std::int64_t kWindow_ns = 5'000'000'000;
  static constexpr std::int64_t kRestart_ns = 1'000'000'000;  // no frame takes as long: its clock was set
  static constexpr std::int64_t kAlone_ns = 20'000'000;       // half a frame at 25 Hz

  [[nodiscard]] std::int64_t on_station_ns(std::int64_t stamp_ns, std::int64_t arrival_ns) {
    const std::int64_t apart_ns = arrival_ns - stamp_ns;
    if (!begun_ || std::abs(apart_ns - between_ns_) > kRestart_ns) {
      begun_ = true;
      now_ = before_ = {};
      window_began_ns_ = arrival_ns;
    }
    if (arrival_ns - window_began_ns_ > kWindow_ns) {
      before_ = now_;
      now_ = {};
      window_began_ns_ = arrival_ns;
    }
    now_.take(apart_ns);
    Least both = before_;
    both.take(now_.first_ns);
    both.take(now_.second_ns);
    between_ns_ = both.believed_ns();
    return stamp_ns + between_ns_;
  }

 private:
  struct Least {  // and the one after it
    static constexpr std::int64_t kNone_ns = std::numeric_limits<std::int64_t>::max();
    std::int64_t first_ns = kNone_ns, second_ns = kNone_ns;

    void take(std::int64_t apart_ns) {
      second_ns = std::min(second_ns, std::max(first_ns, apart_ns));
      first_ns = std::min(first_ns, apart_ns);
    }
    [[nodiscard]] std::int64_t believed_ns() const {
      return second_ns != kNone_ns && second_ns - first_ns > kAlone_ns ? second_ns : first_ns;
    }
  };
  bool begun_ = false;
  Least now_, before_;  // of this window, and of the one before
  std::int64_t between_ns_ = 0, window_began_ns_ = 0;
};

// How long ago something was that the library noted on the wall clock. For a while after the wall clock was
// set nobody can tell: then what arrives counts as of now, which is late, but never early.
class WallClock {
 public:
  static constexpr std::int64_t kSet_ns = 1'000'000, kDoubt_ns = 1'000'000'000;

  [[nodiscard]] std::int64_t ago_ns(std::int64_t then_wall_ns, std::int64_t now_wall_ns,
                                    std::int64_t now_station_ns) {
    const std::int64_t apart_ns = now_wall_ns - now_station_ns;
    if (begun_ && std::abs(apart_ns - apart_ns_) > kSet_ns) {
      doubted_until_ns_ = now_station_ns + kDoubt_ns;
    }
    begun_ = true;
    apart_ns_ = apart_ns;
    return now_station_ns < doubted_until_ns_ ? 0 : std::max<std::int64_t>(now_wall_ns - then_wall_ns, 0);
  }

 private:
  bool begun_ = false;
  std::int64_t apart_ns_ = 0, doubted_until_ns_ = std::numeric_limits<std::int64_t>::min();
};

// Frames that lie between two of these numbers. GigE Vision 1 counts 1 .. 65535 and leaves out 0; others do
// not wrap. A camera that starts anew has lost none that it knows of.
[[nodiscard]] constexpr std::uint64_t frames_between(std::uint64_t before, std::uint64_t now) {
  constexpr std::uint64_t kLast = 65535, kMostLost = 10000;
  if (now > before) {
    return now - before - 1;
  }
  const bool wrapped = before <= kLast && now >= 1 && now + kLast - before <= kMostLost;
  return wrapped && now != before ? now + kLast - before - 1 : 0;
}

}  // namespace punctum::aravis
