// The core's last words to its devices.
#include "tools/core/shut_down.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>

#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/platform/real_time_rights.hpp"
#include "tests/support/fake_devices.hpp"

namespace punctum::tools {
namespace {

using hal::Status;
using hal::Vec3;

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::int64_t kLongest_ns = 500'000'000;

// Every sleep moves the fakes on by a period.
struct Station {
  rt::test::FakeHand hand;
  rt::test::FakeStage stage{Vec3::Zero()};
  rt::test::FakeEstop estop;
  rt::test::FakeInjector injector;
  struct PassingClock final : hal::Clock {
    explicit PassingClock(Station& s) : station(s) {}
    [[nodiscard]] std::int64_t now_ns() const noexcept override { return t_ns; }
    void sleep_until_ns(std::int64_t until_ns) noexcept override {
      station.stage.step(1e-9 * static_cast<double>(until_ns - t_ns));
      EXPECT_EQ(station.estop.enable_line, station.stage.on);
      if (!station.stage.on && !off_since_ns) {
        off_since_ns = t_ns;
      }
      t_ns = until_ns;
    }
    Station& station;
    std::int64_t t_ns = 0;
    std::optional<std::int64_t> off_since_ns;  // when the drive's power went
  } clock{*this};

  Station() {
    stage.on = true;
    hand.force = Vec3(1, 2, 3);
    injector.open = true;
    estop.enable_line = true;
  }
  [[nodiscard]] rt::Devices devices() {
    rt::Devices all{hand};
    all.stage = &stage;
    all.estop = &estop;
    all.injector = &injector;
    return all;
  }
  void expect_off() const {
    EXPECT_EQ(hand.force, Vec3::Zero());
    EXPECT_FALSE(injector.open);
    EXPECT_GE(stage.quick_stops, 1);
    EXPECT_FALSE(stage.on);
    EXPECT_FALSE(estop.enable_line);
  }
};

TEST(ShutDown, leaves_no_force_no_open_gate_and_no_drive_power) {
  Station s;
  ShutDown(s.devices(), s.clock, kPeriod_ns, kLongest_ns).run();
  s.expect_off();
}

TEST(ShutDown, comes_with_an_exception_of_the_set_up_too) {
  Station s;
  try {
    const ShutDown shut_down(s.devices(), s.clock, kPeriod_ns, kLongest_ns);
    throw std::runtime_error("set-up");
  } catch (const std::runtime_error&) {
  }
  s.expect_off();
}

TEST(ShutDown, stops_force_and_motion_at_once_and_the_drive_loses_power_only_when_it_stands) {
  Station s;
  s.stage.speed = Vec3(1e-3, 0, 0);
  s.stage.status = Status::no_data;  // its standstill is unknown
  ShutDown shut_down(s.devices(), s.clock, kPeriod_ns, kLongest_ns);
  shut_down.run();
  s.expect_off();
  ASSERT_TRUE(s.clock.off_since_ns);
  EXPECT_EQ(*s.clock.off_since_ns, kLongest_ns) << "unknown standstill: as late as allowed";

  Station still;
  ShutDown(still.devices(), still.clock, kPeriod_ns, kLongest_ns).run();
  ASSERT_TRUE(still.clock.off_since_ns);
  EXPECT_EQ(*still.clock.off_since_ns, kPeriod_ns) << "it braked for one period";
}

TEST(ShutDown, happens_once) {
  Station s;
  {
    ShutDown shut_down(s.devices(), s.clock, kPeriod_ns, kLongest_ns);
    shut_down.run();
    s.hand.force = Vec3(1, 0, 0);
    shut_down.run();
    EXPECT_EQ(s.hand.force.x(), 1);
  }
  EXPECT_EQ(s.hand.force.x(), 1);
}

TEST(ShutDown, of_a_station_with_a_hand_alone_is_a_force_of_zero) {
  rt::test::FakeHand hand;
  hand.force = Vec3(0, 1, 0);
  Station s;
  ShutDown(rt::Devices{hand}, s.clock, kPeriod_ns, kLongest_ns).run();
  EXPECT_EQ(hand.force, Vec3::Zero());
}

TEST(ShutDown, waits_for_nothing_within_a_signal_handler) {
  Station s;
  stop_and_power_off(s.devices());
  s.expect_off();
  EXPECT_EQ(s.clock.t_ns, 0);
}

rt::After spin(void*, const rt::Tick&) NONBLOCKING {
  for (;;) {
    asm volatile("");
  }
}

// Needs the right to SCHED_FIFO; without it there is nothing to watch: no spinning keeps others away.
TEST(ShutDown, comes_when_a_tick_spins_at_real_time_priority_and_the_process_ends) {
  void* memory = mmap(nullptr, sizeof(Station), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  auto* station = new (memory) Station;
  const pid_t core = fork();
  if (core == 0) {
    const auto rights = rt::RealTimeRights::acquire({.priority = 2});
    rlimit limit{};
    getrlimit(RLIMIT_RTTIME, &limit);
    if (limit.rlim_cur > 1'000'000 || limit.rlim_max > 5'000'000) {
      _exit(2);  // nothing would end it
    }
    if (sched_getscheduler(0) != (SCHED_FIFO | SCHED_RESET_ON_FORK)) {
      _exit(3);
    }
    const rt::Devices devices = station->devices();
    shut_down_when_spinning(devices);
    rt::MonotonicClock clock;
    auto status = std::make_unique<rt::CoreStatus>();
    const rt::Slot slots[] = {{.name = "spin", .run = spin}};
    const std::atomic<bool> stop{false};
    (void)rt::Executive(clock, clock, {}, slots, *status).run(stop);
    _exit(4);
  }
  int how = 0;
  waitpid(core, &how, 0);
  if (WIFEXITED(how) && WEXITSTATUS(how) == 3) {
    munmap(memory, sizeof(Station));
    GTEST_SKIP() << "no right to SCHED_FIFO";
  }
  EXPECT_TRUE(WIFSIGNALED(how) && WTERMSIG(how) == SIGXCPU) << how;
  station->expect_off();
  munmap(memory, sizeof(Station));
}

}  // namespace
}  // namespace punctum::tools
