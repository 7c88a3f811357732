#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "hal/sim/virtual_clock.hpp"
#include "tests/support/local_bench.hpp"

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
  const auto bench = std::make_unique<LocalBench>();
  LockStep run;
  std::atomic<std::uint64_t> published{0};  // frame + 1
  std::thread vision([&] {
    ExposureTaker taker(*bench, bench->camera);
    BenchClock clock(*bench);
    taker.attach();
    Exposure e;
    while (true) {
      const hal::Status s = taker.next(e, 1'000'000'000);
      if (s == hal::Status::disconnected) {
        break;
      }
      if (s != hal::Status::ok) {
        continue;
      }
      run.taken.push_back(e.frame);
      std::this_thread::sleep_for(work);
      clock.sleep_until_ns(e.deliver_ns);
      published.store(e.frame + 1);
      taker.release();
    }
  });
  {
    VirtualClock clock(*bench, bench->camera);
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
  EXPECT_EQ(bench->camera.gave_up.load(), 0U);
  return run;
}

TEST(VirtualClock, delivers_an_observation_exactly_at_its_time) {
  const LockStep run = lock_step(400, 40'000'000, std::chrono::microseconds(0));
  for (std::size_t k = 1; k <= run.seen.size(); ++k) {
    // Frame 0 is exposed at tick 1, frame n at tick 40 n; each is seen 40 ticks later.
    const std::uint64_t expected = k < 41 ? 0 : k < 80 ? 1 : k / 40;
    EXPECT_EQ(run.seen[k - 1], expected) << "tick " << k;
  }
}

TEST(VirtualClock, gives_the_same_however_slow_the_camera_is) {
  const LockStep fast = lock_step(600, 55'000'000, std::chrono::microseconds(0));
  const LockStep slow = lock_step(600, 55'000'000, std::chrono::microseconds(3000));
  EXPECT_EQ(fast.seen, slow.seen);
  EXPECT_EQ(fast.taken, slow.taken);
}

TEST(VirtualClock, skips_the_same_frames_when_the_latency_is_longer_than_the_frames) {
  const LockStep fast = lock_step(800, 130'000'000, std::chrono::microseconds(0));
  const LockStep slow = lock_step(800, 130'000'000, std::chrono::microseconds(2000));
  EXPECT_EQ(fast.seen, slow.seen);
  EXPECT_GT(fast.taken.size(), 4U);
  for (std::size_t i = 1; i < fast.taken.size(); ++i) {
    EXPECT_GT(fast.taken[i], fast.taken[i - 1]);
  }
}

TEST(VirtualClock, waits_for_nobody_who_is_not_there) {
  const auto bench = std::make_unique<LocalBench>();
  VirtualClock clock(*bench, bench->camera, 5);
  EXPECT_EQ(clock.now_ns(), 5);
  expose(*bench, 0, 0, 0);
  for (int k = 1; k <= 100'000; ++k) {
    clock.sleep_until_ns(k * kTick_ns);
  }
  EXPECT_EQ(clock.now_ns(), 100'000 * kTick_ns);
}

TEST(VirtualClock, never_goes_back) {
  const auto bench = std::make_unique<LocalBench>();
  VirtualClock clock(*bench, bench->camera);
  clock.sleep_until_ns(100);
  clock.sleep_until_ns(50);
  EXPECT_EQ(clock.now_ns(), 100);
}

TEST(VirtualClock, stops_waiting_for_a_camera_that_hangs) {
  const auto bench = std::make_unique<LocalBench>();
  VirtualClock clock(*bench, bench->camera, 0, 50'000'000);
  ExposureTaker taker(*bench, bench->camera);
  taker.attach();
  expose(*bench, 0, 0, 0);
  const auto before = std::chrono::steady_clock::now();
  clock.sleep_until_ns(kTick_ns);
  const auto took = std::chrono::steady_clock::now() - before;
  EXPECT_GT(took, std::chrono::milliseconds(40));
  EXPECT_LT(took, std::chrono::seconds(5));
  EXPECT_EQ(bench->camera.gave_up.load(), 1U);
  EXPECT_EQ(bench->camera.pid.load(), 0U);
  // It was only late: it takes its place again.
  Exposure e;
  EXPECT_EQ(taker.next(e, 0), hal::Status::no_data);
  EXPECT_NE(bench->camera.pid.load(), 0U);
  expose(*bench, 1, kTick_ns, 0);
  EXPECT_EQ(taker.next(e, 0), hal::Status::ok);
  EXPECT_EQ(e.frame, 1U);
}

TEST(VirtualClock, goes_on_when_the_supervisor_detaches_a_dead_camera) {
  const auto bench = std::make_unique<LocalBench>();
  VirtualClock clock(*bench, bench->camera);
  bench->camera.pid.store(12345);
  expose(*bench, 0, 0, 0);
  std::thread supervisor([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    bench->camera.pid.store(0);
  });
  clock.sleep_until_ns(kTick_ns);
  supervisor.join();
  EXPECT_EQ(bench->camera.gave_up.load(), 0U);
}

TEST(VirtualClock, does_not_await_a_camera_for_ever) {
  const auto bench = std::make_unique<LocalBench>();
  VirtualClock clock(*bench, bench->camera, 0, 20'000'000);
  EXPECT_FALSE(clock.await_camera());
}

TEST(VirtualClock, loses_no_snapshot_of_an_attached_recorder) {
  const auto bench = std::make_unique<LocalBench>();
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
        if (taken % 1000 == 0) {
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
      }
      if (finished && !any) {
        break;
      }
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    EXPECT_EQ(taker.lost(), 0U);
  });
  {
    VirtualClock clock(*bench, bench->camera);
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

TEST(BenchClock, returns_when_the_plant_has_stopped) {
  const auto bench = std::make_unique<LocalBench>();
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

TEST(BenchClock, is_the_monotonic_clock_in_real_time) {
  const auto bench = std::make_unique<LocalBench>();
  BenchClock clock(*bench);
  const std::int64_t before = clock.now_ns();
  clock.sleep_until_ns(before + 5'000'000);
  EXPECT_GE(clock.now_ns() - before, 5'000'000);
}

TEST(ExposureTaker, takes_the_newest_in_real_time) {
  const auto bench = std::make_unique<LocalBench>();
  ExposureTaker taker(*bench, bench->camera);
  taker.attach();
  for (std::uint64_t n = 0; n < 5; ++n) {
    expose(*bench, n, static_cast<std::int64_t>(n) * kFrame_ns, 0);
  }
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
