#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "hal/sim/virtual_clock.hpp"

namespace punctum::sim {
namespace {

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr std::int64_t kFrame_ns = 40'000'000;

// What the plant does at a frame's time.
void expose(Bench& bench, std::uint64_t frame, std::int64_t t_ns, std::int64_t latency_ns) {
  Exposure e;
  e.frame = frame;
  e.exposure_ns = t_ns;
  e.deliver_ns = t_ns + latency_ns;
  const std::uint64_t i = bench.exposed.load();
  bench.deliver_ns[i % kExposures].store(e.deliver_ns);
  bench.exposures.push(e);
  bench.exposed.store(i + 1);
}

// One core of `ticks` ticks and one camera that takes `work` per frame; returns, tick by tick, the newest
// frame whose observation the core saw.
struct LockStep {
  std::vector<std::uint64_t> seen;
  std::vector<std::uint64_t> taken;
};
LockStep lock_step(int ticks, std::int64_t latency_ns, std::chrono::microseconds work) {
  const auto bench = std::make_unique<Bench>();
  LockStep run;
  std::atomic<std::uint64_t> published{0};  // frame + 1
  std::thread vision([&] {
    ExposureTaker taker(*bench);
    BenchClock clock(*bench);
    taker.attach();
    Exposure e;
    while (true) {
      const hal::Status s = taker.next(e, 1'000'000'000);
      if (s == hal::Status::disconnected) break;
      if (s != hal::Status::ok) continue;
      run.taken.push_back(e.frame);
      std::this_thread::sleep_for(work);
      clock.sleep_until_ns(e.deliver_ns);
      published.store(e.frame + 1);
      taker.release();
    }
  });
  {
    VirtualClock clock(*bench);
    EXPECT_TRUE(clock.await_camera());
    std::uint64_t frame = 0;
    for (int k = 1; k <= ticks; ++k) {
      clock.sleep_until_ns(k * kTick_ns);
      run.seen.push_back(published.load());
      if (k * kTick_ns >= static_cast<std::int64_t>(frame) * kFrame_ns) {
        expose(*bench, frame, k * kTick_ns, latency_ns);
        ++frame;
      }
    }
  }
  vision.join();
  EXPECT_EQ(bench->camera_gave_up.load(), 0U);
  return run;
}

TEST(VirtualClock, DeliversAnObservationExactlyAtItsTime) {
  const LockStep run = lock_step(400, 40'000'000, std::chrono::microseconds(0));
  for (std::size_t k = 1; k <= run.seen.size(); ++k) {
    // Frame 0 is exposed at tick 1, frame n at tick 40 n; each is seen 40 ticks later.
    const std::uint64_t expected = k < 41 ? 0 : k < 80 ? 1 : k / 40;
    EXPECT_EQ(run.seen[k - 1], expected) << "tick " << k;
  }
}

TEST(VirtualClock, GivesTheSameHoweverSlowTheCameraIs) {
  const LockStep fast = lock_step(600, 55'000'000, std::chrono::microseconds(0));
  const LockStep slow = lock_step(600, 55'000'000, std::chrono::microseconds(3000));
  EXPECT_EQ(fast.seen, slow.seen);
  EXPECT_EQ(fast.taken, slow.taken);
}

TEST(VirtualClock, SkipsTheSameFramesWhenTheLatencyIsLongerThanTheFrames) {
  const LockStep fast = lock_step(800, 130'000'000, std::chrono::microseconds(0));
  const LockStep slow = lock_step(800, 130'000'000, std::chrono::microseconds(2000));
  EXPECT_EQ(fast.seen, slow.seen);
  EXPECT_GT(fast.taken.size(), 4U);
  for (std::size_t i = 1; i < fast.taken.size(); ++i) EXPECT_GT(fast.taken[i], fast.taken[i - 1]);
}

TEST(VirtualClock, WaitsForNobodyWhoIsNotThere) {
  const auto bench = std::make_unique<Bench>();
  VirtualClock clock(*bench, 5);
  EXPECT_EQ(clock.now_ns(), 5);
  expose(*bench, 0, 0, 0);
  for (int k = 1; k <= 100'000; ++k) clock.sleep_until_ns(k * kTick_ns);
  EXPECT_EQ(clock.now_ns(), 100'000 * kTick_ns);
}

TEST(VirtualClock, NeverGoesBack) {
  const auto bench = std::make_unique<Bench>();
  VirtualClock clock(*bench);
  clock.sleep_until_ns(100);
  clock.sleep_until_ns(50);
  EXPECT_EQ(clock.now_ns(), 100);
}

TEST(VirtualClock, StopsWaitingForACameraThatHangs) {
  const auto bench = std::make_unique<Bench>();
  VirtualClock clock(*bench, 0, 50'000'000);
  ExposureTaker taker(*bench);
  taker.attach();
  expose(*bench, 0, 0, 0);
  const auto before = std::chrono::steady_clock::now();
  clock.sleep_until_ns(kTick_ns);
  const auto took = std::chrono::steady_clock::now() - before;
  EXPECT_GT(took, std::chrono::milliseconds(40));
  EXPECT_LT(took, std::chrono::seconds(5));
  EXPECT_EQ(bench->camera_gave_up.load(), 1U);
  EXPECT_EQ(bench->camera_pid.load(), 0U);
  // It was only late: it takes its place again.
  Exposure e;
  EXPECT_EQ(taker.next(e, 0), hal::Status::no_data);
  EXPECT_NE(bench->camera_pid.load(), 0U);
  expose(*bench, 1, kTick_ns, 0);
  EXPECT_EQ(taker.next(e, 0), hal::Status::ok);
  EXPECT_EQ(e.frame, 1U);
}

TEST(VirtualClock, GoesOnWhenTheSupervisorDetachesADeadCamera) {
  const auto bench = std::make_unique<Bench>();
  VirtualClock clock(*bench);
  bench->camera_pid.store(12345);
  expose(*bench, 0, 0, 0);
  std::thread supervisor([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    bench->camera_pid.store(0);
  });
  clock.sleep_until_ns(kTick_ns);
  supervisor.join();
  EXPECT_EQ(bench->camera_gave_up.load(), 0U);
}

TEST(VirtualClock, DoesNotAwaitACameraForEver) {
  const auto bench = std::make_unique<Bench>();
  VirtualClock clock(*bench, 0, 20'000'000);
  EXPECT_FALSE(clock.await_camera());
}

TEST(VirtualClock, LosesNoSnapshotOfAnAttachedRecorder) {
  const auto bench = std::make_unique<Bench>();
  std::uint64_t taken = 0;
  bool in_order = true;
  std::atomic<bool> attached{false};
  std::thread recorder([&] {
    SnapshotTaker taker(*bench);
    taker.attach();
    attached.store(true);
    Snapshot s;
    while (true) {
      const bool finished = bench->finished.load() != 0;
      bool any = false;
      while (taker.next(s)) {
        any = true;
        in_order = in_order && s.tick == ++taken;
        if (taken % 1000 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      if (finished && !any) break;
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    EXPECT_EQ(taker.lost(), 0U);
  });
  {
    VirtualClock clock(*bench);
    EXPECT_TRUE(clock.await_recorder());
    Snapshot s;
    for (int k = 1; k <= 30'000; ++k) {
      clock.sleep_until_ns(k * kTick_ns);
      s.tick = static_cast<std::uint64_t>(k);
      bench->snapshots.push(s);
    }
  }
  recorder.join();
  EXPECT_EQ(taken, 30'000U);
  EXPECT_TRUE(in_order);
}

TEST(BenchClock, ReturnsWhenThePlantHasStopped) {
  const auto bench = std::make_unique<Bench>();
  bench->virtual_time.store(1);
  BenchClock clock(*bench);
  std::thread core([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    bench->finished.store(1);
  });
  clock.sleep_until_ns(1'000'000'000'000);
  core.join();
  EXPECT_EQ(clock.now_ns(), 0);
}

TEST(BenchClock, IsTheMonotonicClockInRealTime) {
  const auto bench = std::make_unique<Bench>();
  BenchClock clock(*bench);
  const std::int64_t before = clock.now_ns();
  clock.sleep_until_ns(before + 5'000'000);
  EXPECT_GE(clock.now_ns() - before, 5'000'000);
}

TEST(ExposureTaker, TakesTheNewestInRealTime) {
  const auto bench = std::make_unique<Bench>();
  ExposureTaker taker(*bench);
  taker.attach();
  for (std::uint64_t n = 0; n < 5; ++n) expose(*bench, n, static_cast<std::int64_t>(n) * kFrame_ns, 0);
  Exposure e;
  ASSERT_EQ(taker.next(e, 0), hal::Status::ok);
  EXPECT_EQ(e.frame, 4U);
  taker.release();
  EXPECT_EQ(taker.next(e, 0), hal::Status::no_data);
  EXPECT_EQ(taker.next(e, 2'000'000), hal::Status::no_data);
  bench->finished.store(1);
  EXPECT_EQ(taker.next(e, 0), hal::Status::disconnected);
}

}  // namespace
}  // namespace punctum::sim
