// Nothing on the heap, no page fault and a shallow stack in every tick of whole simulated injections: with
// every force effect, and with each failure that a simulated device can have (hal/sim/failures.hpp) during
// the indentation and in the cell; and of a servo that latches what no single device of them causes. The
// linker puts this file's function in the place of Servo::tick; it watches, and calls it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/sim/failures.hpp"
#include "rt/platform/allocation_trap.hpp"
#include "rt/platform/real_time_rights.hpp"
#include "tests/support/servo_bench.hpp"
#include "tools/report/tick_tape.hpp"

namespace punctum::rt {
namespace {

constexpr std::size_t kStack = 1 << 20;     // of the thread that ticks
constexpr std::size_t kPainted = 24 << 10;  // below a tick
constexpr std::size_t kOwn = 1 << 10;       // of what watches
constexpr std::uint64_t kPaint = 0x5aa5'c33c'9669'f00fULL;

struct Watched {
  std::uint64_t ticks = 0, heap_calls = 0, page_faults = 0;
  std::size_t deepest = 0;  // bytes of stack
  std::set<Fault> faults;
  std::set<Phase> phases;
};
Watched watched;

enum class Plant : std::uint8_t { nothing, heap, page, deep };
Plant plant = Plant::nothing;
void* volatile kept = nullptr;

[[gnu::noinline]] void misbehave() {
  if (plant == Plant::heap) {
    kept = std::malloc(16);
    std::free(kept);
  }
  if (plant == Plant::page) {
    void* fresh = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    *static_cast<volatile char*>(fresh) = 1;
    ::munmap(fresh, 4096);
  }
  if (plant == Plant::deep) {
    std::array<volatile char, 9000> large;
    std::fill(large.begin(), large.end(), char{1});
  }
}

// Code and constants are read from the disk before, as the core's are by mlockall.
void populate_code() {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t from = 0, to = 0;
    char dash = 0;
    std::string rights;
    if (std::istringstream(line) >> std::hex >> from >> dash >> to >> rights && rights[0] == 'r' &&
        line.find('/') != std::string::npos) {
      constexpr int kPopulateRead = 22;  // MADV_POPULATE_READ, of kernels since 5.14
      (void)::madvise(reinterpret_cast<void*>(from), to - from, kPopulateRead);
    }
  }
}

void* call(void* work) {
  (*static_cast<std::function<void()>*>(work))();
  return nullptr;
}

// On a thread with a stack that is there from the start.
Watched watch(std::function<void()> work) {
  populate_code();
  watched = {};
  void* stack =
      ::mmap(nullptr, kStack, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  EXPECT_EQ(pthread_attr_setstack(&attributes, stack, kStack), 0);
  pthread_t thread{};
  EXPECT_EQ(pthread_create(&thread, &attributes, call, &work), 0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
  ::munmap(stack, kStack);
  return watched;
}

// An operator in a hurry punctures after 1.9 s, and injects nothing; one with time injects after 8 s.
tools::Scene whole_scene(bool hurried) {
  std::vector<std::string> overrides{"scene.seconds=12",
                                     "sim.operator.dwell_s=0.2",
                                     "sim.operator.approach_s=0.2",
                                     "sim.operator.withdrawal_speed_um_s=400",
                                     "force_sensor=on",
                                     "repulsive=on",
                                     "friction=on",
                                     "vibration=on"};
  if (hurried) {
    overrides.insert(overrides.end(),
                     {"sim.operator.reaction_s=0.05", "sim.operator.indentation_speed_um_s=200"});
  }
  auto scene = tools::load_scene("icsi", overrides);
  if (!scene) {
    throw std::runtime_error(scene.error());
  }
#define PUNCTUM_EFFECT(name, Class) EXPECT_TRUE(scene->servo.name.has_value()) << #name;
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
  return *scene;
}

void expect_nothing(const Watched& w) {
  EXPECT_EQ(w.heap_calls, 0U);
  EXPECT_EQ(w.page_faults, 0U);
  EXPECT_LT(w.deepest, kPainted - 64) << "the paint does not reach so far";
}

TEST(WatchedTicks, an_injection_with_every_effect_touches_no_heap_and_no_new_page) {
  ASSERT_TRUE(allocation_trap::available());
  const tools::Scene scene = whole_scene(false);
  const Watched w = watch([&] { (void)report::record_ticks(scene, 30); });
  expect_nothing(w);
  EXPECT_EQ(w.phases.size(), 7U) << "phases";
  std::printf("%llu ticks, stack %zu bytes\n", static_cast<unsigned long long>(w.ticks), w.deepest);
}

TEST(WatchedTicks, nor_does_one_with_any_failure_of_a_device) {
  using sim::Channel;
  using sim::Device;
  using sim::Failure;
  const tools::Scene whole = whole_scene(true);
  std::size_t runs = 0, deepest = 0;
  std::uint64_t ticks = 0;
  std::set<Fault> faults;
  for (const Device device :
       {Device::hand, Device::stage, Device::estop, Device::injector, Device::vacuum, Device::force_sensor}) {
    for (int k = 1; k <= static_cast<int>(sim::kLastFailure); ++k) {
      for (int c = 0; c <= static_cast<int>(sim::kLastChannel); ++c) {
        const auto kind = static_cast<Failure>(k);
        const auto channel = static_cast<Channel>(c);
        if (!sim::can_have(device, kind) || !sim::can_concern(device, kind, channel)) {
          continue;
        }
        for (const double at_s : {1.7, 2.1}) {
          tools::Scene scene = whole;
          scene.sim->failures[0] = {.device = device,
                                    .kind = kind,
                                    .at_s = at_s,
                                    .for_s = 0.3,
                                    .channel = channel,
                                    .component = sim::Component::all,
                                    .size = kind == Failure::sparse || kind == Failure::repeat ? 3 : 30e-6,
                                    .every_s = 0.05};
          scene.sim->failure_count = 1;
          const Watched w = watch([&] { (void)report::record_ticks(scene, 2.6); });
          expect_nothing(w);
          ASSERT_FALSE(HasFailure()) << "device " << static_cast<int>(device) << ", failure " << k
                                     << ", channel " << c << ", at " << at_s << " s";
          ++runs;
          ticks += w.ticks;
          deepest = std::max(deepest, w.deepest);
          faults.insert(w.faults.begin(), w.faults.end());
        }
      }
    }
  }
  faults.erase(Fault::none);
  std::printf("%zu runs, %llu ticks, %zu different faults, stack %zu bytes\n", runs,
              static_cast<unsigned long long>(ticks), faults.size(), deepest);
  EXPECT_GT(runs, 150U);
  for (const Fault fault : {Fault::estop, Fault::estop_lost, Fault::hand_lost, Fault::hand_invalid,
                            Fault::stage_lost, Fault::stage_fault, Fault::stage_following, Fault::tip_force,
                            Fault::vacuum_lost, Fault::injector_open}) {
    EXPECT_TRUE(faults.count(fault)) << name(fault);
  }
}

// The other faults, but for not_finite: no input of a device is known to make a force that is no number.
TEST(WatchedTicks, nor_does_a_stop_for_what_takes_more_than_one_device) {
  using test::Bench;
  struct Case {
    Fault latched;
    std::function<void(Bench&)> happens;
  };
  const auto contacts = [](Bench& b, bool closed_a, bool closed_b) {
    b.estop.state.contact_a_closed = closed_a;
    b.estop.state.contact_b_closed = closed_b;
  };
  const std::vector<Case> cases{
      {Fault::estop_discrepancy, [&](Bench& b) { contacts(b, false, true); }},
      {Fault::overrun, [](Bench& b) { b.missed = 21; }},
      {Fault::command_stop, [](Bench& b) { b.servo->request_stop(); }},
      {Fault::stage_not_stopping,
       [&](Bench& b) {
         contacts(b, false, false);
         b.stage.ignores_stop = true;
       }},
      {Fault::stage_not_enabled, [](Bench&) {}},
      {Fault::enabling_released, [](Bench& b) { b.enabling.hold(false); }},
      {Fault::enabling_fault, [](Bench& b) { b.enabling.state = {.contact_a_closed = true}; }},
  };
  for (const Case& c : cases) {
    std::uint64_t latched = 0;
    const Watched w = watch([&] {
      ServoConfig config = test::icsi();
      config.real_actuators = true;
      config.enabling.emplace();
      Bench b(config, true, true);
      b.stage.readings.reserve(10'000);  // the fake's own book-keeping
      b.stage.commanded.reserve(10'000);
      b.stage.never_enables = c.latched == Fault::stage_not_enabled;
      b.run(0.1);
      b.enabling.hold(true);
      b.run(1);
      EXPECT_EQ(b.servo->fault(), Fault::none) << name(c.latched);
      c.happens(b);
      b.run(b.stage.never_enables ? 5 : 1);
      latched = b.station->core.status.faults_latched.load();
    });
    expect_nothing(w);
    EXPECT_NE(latched >> static_cast<int>(c.latched) & 1U, 0U) << name(c.latched);
  }
}

TEST(WatchedTicks, what_is_planted_is_seen) {
  const tools::Scene scene = whole_scene(true);
  const auto with = [&](Plant what) {
    plant = what;
    const Watched w = watch([&] { (void)report::record_ticks(scene, 0.1); });
    plant = Plant::nothing;
    return w;
  };
  const Watched clean = with(Plant::nothing);
  EXPECT_EQ(with(Plant::heap).heap_calls, 2 * clean.ticks);
  EXPECT_EQ(with(Plant::page).page_faults, clean.ticks);
  EXPECT_GE(with(Plant::deep).deepest, 9000U);
  EXPECT_LT(clean.deepest, 9000U);
}

}  // namespace

extern "C" void __real__ZN7punctum2rt5Servo4tickERKNS0_8TickInfoE(Servo* servo, const TickInfo& now) noexcept;

// In the place of Servo::tick.
extern "C" [[gnu::noinline]] void __wrap__ZN7punctum2rt5Servo4tickERKNS0_8TickInfoE(
    Servo* servo, const TickInfo& now) noexcept {
  auto* here = static_cast<std::uint64_t*>(__builtin_frame_address(0));
  auto* const top = reinterpret_cast<volatile std::uint64_t*>(here) - kOwn / 8;
  auto* const bottom = top - kPainted / 8;
  if (watched.ticks == 0) {  // as the core does with what its loop writes; here it came from the heap
    prefault_writable(servo, sizeof *servo);
  }
  const ThreadCounters before = read_thread_counters();
  for (auto* at = bottom; at != top; ++at) {
    *at = kPaint;
  }
  allocation_trap::arm(allocation_trap::On::allocation_count);
  if (plant != Plant::nothing) {
    misbehave();
  }
  __real__ZN7punctum2rt5Servo4tickERKNS0_8TickInfoE(servo, now);
  auto* at = bottom;
  while (at != top && *at == kPaint) {
    ++at;
  }
  watched.heap_calls += allocation_trap::disarm();
  const ThreadCounters after = read_thread_counters();
  watched.page_faults += after.minor_faults + after.major_faults - before.minor_faults - before.major_faults;
  watched.deepest =
      std::max(watched.deepest, static_cast<std::size_t>(reinterpret_cast<volatile char*>(here) -
                                                         reinterpret_cast<volatile char*>(at)));
  ++watched.ticks;
  watched.faults.insert(servo->fault());
  watched.phases.insert(servo->phase());
}

}  // namespace punctum::rt
