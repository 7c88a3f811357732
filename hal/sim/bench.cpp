#include "hal/sim/bench.hpp"

#include <unistd.h>

#include "hal/sim/valid.hpp"
#include "hal/sim/virtual_clock.hpp"
#include "hal/sim/waiting.hpp"

namespace punctum::sim {

void ExposureTaker::attach() noexcept {
  next_ = bench_.exposed.load(std::memory_order_acquire);
  answers_.delivered.store(next_, std::memory_order_release);
  answers_.pid.store(static_cast<std::uint64_t>(getpid()), std::memory_order_release);
  attached_ = true;
  taken_ = false;
}

void ExposureTaker::detach() noexcept {
  if (!attached_) {
    return;
  }
  auto mine = static_cast<std::uint64_t>(getpid());
  answers_.pid.compare_exchange_strong(mine, 0);
  attached_ = false;
}

hal::Status ExposureTaker::next(Exposure& out, std::int64_t timeout_ns) noexcept {
  if (taken_) {
    release();
  }
  // The clock may have stopped waiting for this camera: it is late, not gone.
  if (!attached_ || answers_.pid.load(std::memory_order_acquire) == 0) {
    attach();
  }
  Waiting waiting(timeout_ns);
  for (;;) {
    const bool finished = bench_.finished.load(std::memory_order_acquire) != 0;
    const std::uint64_t exposed = bench_.exposed.load(std::memory_order_acquire);
    if (exposed > next_) {
      if (bench_.virtual_time.load(std::memory_order_relaxed) == 0) {
        next_ = exposed - 1;
      }
      const bool whole = bench_.exposures.read(next_, out) == hal::Read::ok;
      if (whole && valid(out)) {
        deliver_ns_ = out.deliver_ns;
        taken_ = true;
        return hal::Status::ok;
      }
      // Of no use: the one after it. Overwritten meanwhile: continue with the newest.
      next_ = whole ? next_ + 1 : exposed - 1;
      answers_.delivered.store(next_, std::memory_order_release);
    } else if (exposed < next_) {
      next_ = exposed;  // the count was not true
    } else if (finished) {
      return hal::Status::disconnected;
    }
    if (!waiting.pause()) {
      return hal::Status::no_data;
    }
  }
}

void ExposureTaker::release() noexcept {
  if (!taken_) {
    return;
  }
  taken_ = false;
  // In virtual time the plant stands still from here until `delivered` moves, so what is taken next does
  // not depend on how fast any program ran.
  if (bench_.virtual_time.load(std::memory_order_relaxed) != 0) {
    BenchClock(bench_).sleep_until_ns(deliver_ns_);
  }
  const std::uint64_t exposed = bench_.exposed.load(std::memory_order_acquire);
  next_ = exposed > next_ + 1 ? exposed - 1 : next_ + 1;
  answers_.delivered.store(next_, std::memory_order_release);
}

void SnapshotTaker::attach() noexcept {
  follower_ = hal::Follower(bench_.snapshots, bench_.snapshots.head());
  bench_.recorder_cursor.store(follower_.position(), std::memory_order_release);
  bench_.recorder_attached.store(1, std::memory_order_release);
  attached_ = true;
}

void SnapshotTaker::detach() noexcept {
  if (!attached_) {
    return;
  }
  bench_.recorder_attached.store(0, std::memory_order_release);
  attached_ = false;
}

bool SnapshotTaker::next(Snapshot& out) noexcept {
  bool usable = false;
  for (std::uint64_t i = 0; !usable && i < kSnapshots && follower_.next(out) == hal::Read::ok; ++i) {
    usable = valid(out);
    bench_.recorder_cursor.store(follower_.position(), std::memory_order_release);
  }
  return usable;
}

}  // namespace punctum::sim
