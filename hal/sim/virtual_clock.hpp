// Virtual time, which advances only when everybody attached is ready, and its view by the other programs.
#pragma once

#include <atomic>
#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/bench.hpp"

namespace punctum::sim {

// The core's side: the owner of time. sleep_until_ns() moves time to t and then waits, and waits only there:
// until every exposure due by t has been delivered, while a camera is attached, and until the recorder is
// within kMostAhead ticks, while one is attached. Each wait ends after bail_out_ns of real time; whoever was
// waited for then counts as detached.
class VirtualClock final : public hal::Clock {
 public:
  static constexpr std::int64_t kBailOut_ns = 10'000'000'000;

  VirtualClock(Bench& bench, CameraAnswers& camera, std::int64_t start_ns = 0,
               std::int64_t bail_out_ns = kBailOut_ns) noexcept;
  ~VirtualClock();  // tells the others that time has ended
  VirtualClock(const VirtualClock&) = delete;
  VirtualClock& operator=(const VirtualClock&) = delete;

  [[nodiscard]] std::int64_t now_ns() const NONBLOCKING override;
  void sleep_until_ns(std::int64_t t_ns) noexcept override;

  // Before the first tick: waits, bounded, until a camera (and a recorder) has attached. False: none came.
  bool await_camera() noexcept;
  bool await_recorder() noexcept;

  // From a signal handler: every wait ends.
  void stop_waiting() NONBLOCKING { stop_.store(true, std::memory_order_relaxed); }

 private:
  Bench& bench_;
  CameraAnswers& camera_;
  std::int64_t bail_out_ns_;
  std::atomic<bool> stop_{false};
};

// The other programs' side: reads the time of the bench and waits for a time to come. In real time it is
// CLOCK_MONOTONIC. sleep_until_ns() also returns when the plant has stopped, or when stop_waiting() was
// called from a signal handler or another thread.
class BenchClock final : public hal::Clock {
 public:
  explicit BenchClock(const Bench& bench) NONBLOCKING : bench_(bench) {}
  [[nodiscard]] std::int64_t now_ns() const NONBLOCKING override;
  void sleep_until_ns(std::int64_t t_ns) noexcept override;
  void stop_waiting() NONBLOCKING { stop_.store(true, std::memory_order_relaxed); }

 private:
  const Bench& bench_;
  std::atomic<bool> stop_{false};
};

}  // namespace punctum::sim
