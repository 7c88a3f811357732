// Runs a planted violation in a slot of the executive, and prints what the allocation trap and the thread's
// counters say of the loop. Its standard output belongs to the plant.
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "rt/executive/executive.hpp"
#include "rt/platform/allocation_trap.hpp"
#include "rt/platform/real_time_rights.hpp"
#include "tests/unit/rt/planted_violations.hpp"

// By name, so that callgrind can collect in here alone.
extern "C" [[gnu::noinline]] void planted_work(punctum::rt::Material& m) NONBLOCKING {
  punctum::rt::plant(m);
}

namespace punctum::rt {
namespace {

constexpr std::size_t kTicks = 200;
constexpr std::size_t kPage = 4096;

// Every sleep ends at once.
class ImmediateClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const NONBLOCKING override { return now_ns_; }
  void sleep_until_ns(std::int64_t t_ns) noexcept override { now_ns_ = t_ns; }

 private:
  std::int64_t now_ns_ = 0;
};

class SleepingDevice final : public UnknownDevice {
 public:
  void write(double) noexcept override { ::usleep(50); }
};

std::array<double*, kTicks> blocks;
std::byte* pages = nullptr;
void* volatile kept = nullptr;

struct Work {
  Material material;
  After run(const Tick& tick) NONBLOCKING {
    material.tick = tick.index;
    material.block = blocks[tick.index];
    material.fresh_page = pages + tick.index * kPage;
    planted_work(material);
    return tick.index + 1 == kTicks ? After::end : After::go_on;
  }
};

int run() {
  for (double*& block : blocks) {
    block = new double(1);
  }
  void* mapped = ::mmap(nullptr, kTicks * kPage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (mapped == MAP_FAILED) {
    return 1;
  }
  ::madvise(mapped, kTicks * kPage, MADV_NOHUGEPAGE);
  pages = static_cast<std::byte*>(mapped);

  SleepingDevice device;
  Work work;
  work.material.size = 16;
  work.material.wanted = 1;
  work.material.text = "longer than the characters that a string holds by itself";
  work.material.device = &device;
  work.material.callback = [](double) noexcept { kept = std::malloc(64); };

  ImmediateClock clock;
  const auto status = std::make_unique<CoreStatus>();
  const Slot slots[] = {slot<&Work::run>("planted", work)};
  const auto executive = std::make_unique<Executive>(clock, clock, ExecutiveConfig{}, slots, *status);
  const std::atomic<bool> stop{false};

  const ThreadCounters before = read_thread_counters();
  allocation_trap::arm(allocation_trap::On::allocation_count);
  const Executive::Ended ended = executive->run(stop);
  const std::uint64_t allocations = allocation_trap::disarm();
  const ThreadCounters after = read_thread_counters();
  std::fprintf(stderr, "ticks %zu heap_calls %llu page_faults %llu sleeps %llu\n", kTicks,
               static_cast<unsigned long long>(allocations),
               static_cast<unsigned long long>(after.minor_faults + after.major_faults - before.minor_faults -
                                               before.major_faults),
               static_cast<unsigned long long>(after.voluntary_switches - before.voluntary_switches));
  return ended == Executive::Ended::by_slot ? 0 : 1;
}

}  // namespace
}  // namespace punctum::rt

int main() { return punctum::rt::run(); }
