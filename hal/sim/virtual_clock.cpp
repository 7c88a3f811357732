#include "hal/sim/virtual_clock.hpp"

#include <time.h>

#include <cerrno>

#include "hal/sim/waiting.hpp"

namespace punctum::sim {
namespace {

// An exposure that is due by t has not been delivered by the camera.
bool exposure_is_due(const Bench& bench, const CameraAnswers& camera, std::int64_t t_ns) NONBLOCKING {
  const std::uint64_t exposed = bench.exposed.load(std::memory_order_relaxed);  // written by this thread
  const std::uint64_t delivered = camera.delivered.load(std::memory_order_acquire);
  std::uint64_t i = exposed > kExposures ? exposed - kExposures : 0;
  for (i = delivered > i ? delivered : i; i < exposed; ++i) {
    if (bench.deliver_ns[i % kExposures].load(std::memory_order_relaxed) <= t_ns) {
      return true;
    }
  }
  return false;
}

}  // namespace

VirtualClock::VirtualClock(Bench& bench, CameraAnswers& camera, std::int64_t start_ns,
                           std::int64_t bail_out_ns) noexcept
    : bench_(bench), camera_(camera), bail_out_ns_(bail_out_ns) {
  bench_.now_ns.store(start_ns, std::memory_order_release);
  bench_.virtual_time.store(1, std::memory_order_release);
}

VirtualClock::~VirtualClock() { bench_.finished.store(1, std::memory_order_release); }

std::int64_t VirtualClock::now_ns() const NONBLOCKING {
  return bench_.now_ns.load(std::memory_order_relaxed);
}

void VirtualClock::sleep_until_ns(std::int64_t t_ns) noexcept {
  if (t_ns > now_ns()) {
    bench_.now_ns.store(t_ns, std::memory_order_release);
  }
  Waiting for_camera(bail_out_ns_);
  while (!stop_.load(std::memory_order_relaxed) && camera_.pid.load(std::memory_order_acquire) != 0 &&
         exposure_is_due(bench_, camera_, t_ns)) {
    if (!for_camera.pause()) {
      camera_.pid.store(0, std::memory_order_release);
      camera_.gave_up.fetch_add(1, std::memory_order_relaxed);
    }
  }
  Waiting for_recorder(bail_out_ns_);
  while (!stop_.load(std::memory_order_relaxed) &&
         bench_.recorder_attached.load(std::memory_order_acquire) != 0 &&
         bench_.snapshots.head() - bench_.recorder_cursor.load(std::memory_order_acquire) >= kMostAhead) {
    if (!for_recorder.pause()) {
      bench_.recorder_attached.store(0, std::memory_order_release);
      bench_.recorder_gave_up.fetch_add(1, std::memory_order_relaxed);
    }
  }
}

bool VirtualClock::await_camera() noexcept {
  Waiting waiting(bail_out_ns_);
  while (camera_.pid.load(std::memory_order_acquire) == 0) {
    if (stop_.load(std::memory_order_relaxed) || !waiting.pause()) {
      return false;
    }
  }
  return true;
}

bool VirtualClock::await_recorder() noexcept {
  Waiting waiting(bail_out_ns_);
  while (bench_.recorder_attached.load(std::memory_order_acquire) == 0) {
    if (stop_.load(std::memory_order_relaxed) || !waiting.pause()) {
      return false;
    }
  }
  return true;
}

std::int64_t BenchClock::now_ns() const NONBLOCKING {
  if (bench_.virtual_time.load(std::memory_order_relaxed) == 0) {
    return real_now_ns();
  }
  return bench_.now_ns.load(std::memory_order_acquire);
}

void BenchClock::sleep_until_ns(std::int64_t t_ns) noexcept {
  if (bench_.virtual_time.load(std::memory_order_relaxed) == 0) {
    timespec t{};
    t.tv_sec = t_ns / 1'000'000'000;
    t.tv_nsec = t_ns % 1'000'000'000;
    while (!stop_.load(std::memory_order_relaxed) &&
           clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
    }
    return;
  }
  Waiting waiting(INT64_MAX / 4);
  while (bench_.now_ns.load(std::memory_order_acquire) < t_ns && !stop_.load(std::memory_order_relaxed) &&
         bench_.finished.load(std::memory_order_acquire) == 0 && waiting.pause()) {
  }
}

}  // namespace punctum::sim
