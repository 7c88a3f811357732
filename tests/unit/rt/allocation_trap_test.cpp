// Every way to the heap is seen while the trap is armed, and none otherwise.
#include "rt/platform/allocation_trap.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/platform/real_time_rights.hpp"
#include "rt/station/station.hpp"

// Calling the heap by hand is the subject here. NOLINTBEGIN(cppcoreguidelines-no-malloc)
namespace punctum::rt {
namespace {

void* volatile kept = nullptr;  // what passes through it cannot be optimised away

class AllocationTrapTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!allocation_trap::available()) {
      GTEST_SKIP() << "no trap under a sanitizer";
    }
  }
  // Heap calls of the work, by the trap.
  static std::uint64_t calls(void (*work)()) {
    allocation_trap::arm(allocation_trap::On::allocation_count);
    work();
    return allocation_trap::disarm();
  }
};

TEST_F(AllocationTrapTest, counts_each_kind_of_call) {
  EXPECT_EQ(calls([] { kept = std::malloc(10); }), 1U);
  EXPECT_EQ(calls([] { kept = std::realloc(kept, 100000); }), 1U);
  EXPECT_EQ(calls([] { kept = ::reallocarray(kept, 10, 10); }), 1U);
  EXPECT_EQ(calls([] { std::free(kept); }), 1U);
  EXPECT_EQ(calls([] { kept = std::calloc(3, 5); }), 1U);
  EXPECT_EQ(calls([] { std::free(kept); }), 1U);
  EXPECT_EQ(calls([] { kept = std::aligned_alloc(64, 128); }), 1U);
  std::free(kept);
  EXPECT_EQ(calls([] { kept = ::memalign(64, 128); }), 1U);
  std::free(kept);
  EXPECT_EQ(calls([] {
              void* block = nullptr;
              if (::posix_memalign(&block, 256, 100) == 0) {
                kept = block;
              }
            }),
            1U);
  std::free(kept);
  EXPECT_EQ(calls([] { kept = ::valloc(10); }), 1U);
  std::free(kept);
  EXPECT_EQ(calls([] { kept = ::strdup("text"); }), 1U) << "glibc's own calls too";
  std::free(kept);
}

TEST_F(AllocationTrapTest, counts_new_delete_and_the_containers_on_them) {
  EXPECT_EQ(calls([] {
              kept = ::operator new(10);
              ::operator delete(kept);
            }),
            2U);
  EXPECT_EQ(calls([] {
              kept = ::operator new(64, std::align_val_t{64});
              ::operator delete(kept, std::align_val_t{64});
            }),
            2U);
  EXPECT_EQ(calls([] {
              std::vector<int> numbers(100);
              kept = numbers.data();
            }),
            2U);
}

TEST_F(AllocationTrapTest, work_without_heap_counts_nothing) {
  EXPECT_EQ(calls([] {
              double sum = 0;
              for (int i = 0; i < 1000; ++i) {
                sum += i;
              }
              kept = sum > 0 ? kept : nullptr;
              std::free(nullptr);
            }),
            0U);
}

TEST_F(AllocationTrapTest, watches_the_armed_thread_only) {
  std::thread other;
  allocation_trap::arm(allocation_trap::On::allocation_count);
  allocation_trap::disarm();
  std::atomic<bool> go{false};
  std::atomic<bool> done{false};
  other = std::thread([&] {
    while (!go) {
    }
    for (int i = 0; i < 100; ++i) {
      std::free(std::malloc(static_cast<std::size_t>(i) + 1));
    }
    done = true;
  });
  allocation_trap::arm(allocation_trap::On::allocation_count);
  go = true;
  while (!done) {
  }
  EXPECT_EQ(allocation_trap::disarm(), 0U);
  other.join();
}

TEST_F(AllocationTrapTest, blocks_are_real_and_aligned) {
  for (const std::size_t alignment : {16U, 64U, 4096U}) {
    void* block = nullptr;
    ASSERT_EQ(::posix_memalign(&block, alignment, 1000), 0);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(block) % alignment, 0U);
    std::memset(block, 7, 1000);
    block = std::realloc(block, 100000);
    EXPECT_EQ(static_cast<char*>(block)[999], 7);
    std::free(block);
  }
  void* block = nullptr;
  EXPECT_EQ(::posix_memalign(&block, 3, 10), EINVAL);
  EXPECT_EQ(::posix_memalign(&block, 0, 10), EINVAL);
}

TEST_F(AllocationTrapTest, aborts_with_one_line_when_asked_to) {
  EXPECT_DEATH(
      {
        allocation_trap::arm(allocation_trap::On::allocation_abort);
        kept = std::calloc(1, 10);
      },
      "heap call in the real-time loop: calloc");
}

// The real loop on the machine's clock.
TEST_F(AllocationTrapTest, the_executive_makes_no_heap_call_and_takes_no_page_fault) {
  struct Work {
    LocalStation* station;
    After run(const Tick& tick) noexcept {
      TelemetrySample sample;
      sample.tick = tick.index;
      station->core.telemetry.push(sample);
      return tick.index >= 300 ? After::end : After::go_on;
    }
  };
  auto station = std::make_unique<LocalStation>();
  prefault_writable(station.get(), sizeof(LocalStation));
  Work work{station.get()};
  MonotonicClock clock;
  const Slot slots[] = {slot<&Work::run>("work", work)};
  auto executive = std::make_unique<Executive>(clock, clock, ExecutiveConfig{.period_ns = 500'000}, slots,
                                               station->core.status);
  const std::atomic<bool> stop{false};
  const ThreadCounters before = read_thread_counters();
  allocation_trap::arm(allocation_trap::On::allocation_count);
  const Executive::Ended ended = executive->run(stop);
  const std::uint64_t allocations = allocation_trap::disarm();
  publish_counters(before, read_thread_counters(), allocations, allocation_trap::available(),
                   station->core.status);
  EXPECT_EQ(ended, Executive::Ended::by_slot);
  EXPECT_EQ(station->core.status.allocations.load(), 0U);
  EXPECT_EQ(station->core.status.major_faults.load(), 0U);
  EXPECT_LE(station->core.status.minor_faults.load(), 8U)
      << "memory is not locked here: code pages on first use";
  EXPECT_GE(station->core.status.ticks.load() + station->core.status.missed.load(), 301U);
  EXPECT_GE(station->core.status.voluntary_switches.load() + station->core.status.missed.load(), 200U)
      << "it sleeps every tick that it has not missed";
}

}  // namespace
}  // namespace punctum::rt
// NOLINTEND(cppcoreguidelines-no-malloc)
