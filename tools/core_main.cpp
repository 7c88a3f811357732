// punctum-core: the control core and, for a simulated scene, its devices. Sets everything up, then runs the
// tick on this very thread. No OpenCV, no child processes; nothing allocates once the loop runs.
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/segment.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/virtual_clock.hpp"
#include "hal/sim/world.hpp"
#include "rt/control/servo.hpp"
#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/platform/allocation_trap.hpp"
#include "rt/platform/real_time_rights.hpp"
#include "rt/station/station.hpp"
#include "tools/scene.hpp"

namespace {

using namespace punctum;

constexpr int kDone = 0, kNotDone = 1, kBadInput = 2, kFault = 3;
constexpr double kWayOut_s = 10;  // after the time limit, to draw a needle out of the cell
constexpr double kGrace_s = 2;    // after that, for the forces to fade and the stage to rest
constexpr std::int64_t kStartAhead_ns = 800'000'000;
constexpr std::int64_t kSetUp_ns = 200'000'000;  // for rights, memory and the servo

std::atomic<int> signals{0};
std::atomic<bool> stop_now{false};
std::atomic<sim::VirtualClock*> waiting_clock{nullptr};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free &&
              std::atomic<sim::VirtualClock*>::is_always_lock_free);

// SIGTERM, or the death of the parent: a commanded stop. The third one ends the loop at once.
extern "C" void on_stop_signal(int) {
  if (signals.fetch_add(1) >= 2) stop_now.store(true);
  if (sim::VirtualClock* clock = waiting_clock.load()) clock->stop_waiting();
}

// The death of the parent becomes a stop signal. False: it has died already. (One that died before this
// program came to life is found out when the station is attached: the segment has no living owner then.)
bool stop_with_parent() {
  const pid_t parent = getppid();
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  return getppid() == parent;
}

// The plant of a simulated scene, the servo, and what ends the run: the slots of the executive.
class Core {
 public:
  Core() = default;
  Core(const Core&) = delete;
  Core& operator=(const Core&) = delete;

  void set_up(const tools::Scene& scene, sim::World& world, rt::Station& station, bool degraded) {
    world_ = &world;
    limit_ns_ = scene.seconds > 0 ? std::llround(scene.seconds * 1e9) : 0;
    servo_.emplace(scene.servo,
                   rt::Devices{world.hand(), &world.stage(), &world.estop(), world.injector(), world.vacuum(),
                               world.force_sensor()},
                   station, degraded);
  }

  rt::After step_plant(const rt::Tick& tick) noexcept {
    world_->step(tick.wake_ns);
    return rt::After::go_on;
  }

  rt::After tick_servo(const rt::Tick& tick) noexcept {
    if (signals.load(std::memory_order_relaxed) > 0) servo_->request_stop();
    if (first_) first_release_ns_ = tick.release_ns, first_ = false;
    const std::int64_t t_ns = tick.release_ns - first_release_ns_;
    if (limit_ns_ > 0 && t_ns >= limit_ns_) {
      limit_reached_ = true;
      servo_->request_end();
      const double past_s = 1e-9 * static_cast<double>(t_ns - limit_ns_);
      if (past_s >= kWayOut_s) servo_->request_end_here();
      if (past_s >= kWayOut_s + kGrace_s) return rt::After::end;
    }
    rt::TickInfo now;
    now.tick = tick.index;
    now.release_ns = tick.release_ns;
    now.start_ns = tick.wake_ns;
    now.period_s = static_cast<double>(tick.period_ns) * 1e-9;
    now.missed_in_window = tick.missed_in_window;
    servo_->tick(now);
    const bool stopped_at_limit = limit_reached_ && servo_->stop_stage() == rt::StopStage::stopped;
    return servo_->finished() || stopped_at_limit ? rt::After::end : rt::After::go_on;
  }

  [[nodiscard]] const rt::Servo& servo() const noexcept { return *servo_; }
  [[nodiscard]] bool limit_reached() const noexcept { return limit_reached_; }

 private:
  sim::World* world_ = nullptr;
  std::optional<rt::Servo> servo_;
  std::int64_t limit_ns_ = 0, first_release_ns_ = 0;
  bool first_ = true, limit_reached_ = false;
};

// Static: the loop touches no heap of its own and the pages are there from the start.
std::optional<sim::World> world;
Core core;
struct WorldEnd {
  WorldEnd() = default;
  WorldEnd(const WorldEnd&) = delete;
  WorldEnd& operator=(const WorldEnd&) = delete;
  ~WorldEnd() { world.reset(); }
};

int bad(const std::string& text) {
  fmt::print(stderr, "{}\n", text);
  return kBadInput;
}

struct Arguments {
  std::string scene, station, bench, clock;
};

tl::expected<Arguments, std::string> read_arguments(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i < argc; i += 2) {
    const std::string_view key = argv[i];
    std::string* into = key == "--scene"     ? &a.scene
                        : key == "--station" ? &a.station
                        : key == "--bench"   ? &a.bench
                        : key == "--clock"   ? &a.clock
                                             : nullptr;
    if (into == nullptr || i + 1 >= argc)
      return tl::unexpected(fmt::format(
          "{}: not understood, allowed: --scene FILE --station NAME --bench NAME [--clock real|virtual]",
          key));
    *into = argv[i + 1];
  }
  if (a.scene.empty() || a.station.empty())
    return tl::unexpected(
        std::string("--scene and --station are missing; `punctum run` starts this program"));
  if (!a.clock.empty() && a.clock != "real" && a.clock != "virtual")
    return tl::unexpected(fmt::format("--clock: {}: unknown, allowed: real or virtual", a.clock));
  return a;
}

int end_code(rt::CoreStatus& status, const tools::Scene& scene, rt::Executive::Ended ended) {
  using rt::ExitReason;
  ExitReason reason = ExitReason::command;
  int code = kNotDone;
  const rt::Fault fault = core.servo().fault();
  if (ended == rt::Executive::Ended::invalid) {
    reason = ExitReason::invalid_setup;
    code = kBadInput;
  } else if (fault != rt::Fault::none) {
    reason = fault == rt::Fault::command_stop ? ExitReason::command : ExitReason::latched_fault;
    code = kFault;
  } else if (core.servo().outcome() == rt::Outcome::done) {
    reason = ExitReason::task_done;
    code = kDone;
  } else if (core.limit_reached()) {
    reason = ExitReason::time_limit;
    code = scene.has_task() ? kNotDone : kDone;
  }
  status.exit_reason.store(static_cast<std::uint64_t>(reason), std::memory_order_release);
  return code;
}

int run(int argc, char** argv) {
  if (!stop_with_parent()) return bad("punctum-core: the program that started it has died");
  const auto arguments = read_arguments(argc, argv);
  if (!arguments) return bad(arguments.error());
  auto scene = tools::load_scene(arguments->scene);
  if (!scene) return bad(scene.error());
  if (!arguments->clock.empty())
    scene->clock = arguments->clock == "real" ? tools::ClockKind::real : tools::ClockKind::virtual_time;
  if (arguments->bench.empty()) return bad("--bench is missing: the devices of this scene are simulated");

  auto station = hal::Shared<rt::Station>::attach(arguments->station);
  if (!station) return bad(station.error());
  auto bench = hal::Shared<sim::Bench>::attach(arguments->bench);
  if (!bench) return bad(bench.error());
  if (signals.load() > 0) return kNotDone;  // stopped before anything has moved
  rt::CoreStatus& status = (*station)->core;
  status.pid.store(static_cast<std::uint64_t>(getpid()));

  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / scene->servo.rate_Hz));
  const bool real = scene->clock == tools::ClockKind::real;
  rt::MonotonicClock monotonic;
  std::optional<sim::VirtualClock> virtual_clock;
  if (real) {
    (*bench)->now_ns.store(monotonic.now_ns());
  } else {
    virtual_clock.emplace(**bench);
    waiting_clock = &*virtual_clock;
    if (signals.load() > 0) virtual_clock->stop_waiting();
  }
  hal::Clock& clock = real ? static_cast<hal::Clock&>(monotonic) : *virtual_clock;

  // The plant's time begins with the first tick. Its tables take a moment to solve, so they are made for a
  // start that lies ahead, and made again, further ahead, in the rare case that it has passed.
  std::int64_t start_ns = clock.now_ns() + period_ns;
  const WorldEnd world_end;  // before the bench is unmapped
  if (real) {
    for (std::int64_t ahead_ns = kStartAhead_ns;; ahead_ns *= 4) {
      start_ns = clock.now_ns() + ahead_ns;
      world.emplace(*scene->sim, bench->get(), start_ns);
      if (clock.now_ns() < start_ns - kSetUp_ns) break;
      world.reset();
    }
    (*bench)->finished.store(0);
  } else {
    world.emplace(*scene->sim, bench->get(), start_ns);
  }

  std::optional<rt::RealTimeRights> rights;
  bool degraded = false;
  if (real) {
    rt::RightsWanted wanted;
    wanted.priority = scene->core_priority;
    wanted.cpu = scene->core_cpu;
    rights.emplace(rt::RealTimeRights::acquire(wanted));
    rights->publish(status);
    degraded = rights->degraded();
    rt::prefault_writable(station->get(), sizeof(rt::Station));
    rt::prefault_writable(bench->get(), sizeof(sim::Bench));
  } else {
    if (scene->vision) (void)virtual_clock->await_camera();
    (void)virtual_clock->await_recorder();
  }
  core.set_up(*scene, *world, **station, degraded);

  const rt::Slot slots[] = {rt::slot<&Core::step_plant>("plant", core),
                            rt::slot<&Core::tick_servo>("servo", core)};
  rt::ExecutiveConfig config;
  config.period_ns = period_ns;
  config.start_ns = start_ns;
  config.overrun_window_ticks =
      static_cast<std::uint32_t>(std::clamp(scene->servo.overrun_window_s * scene->servo.rate_Hz, 1.0,
                                            static_cast<double>(rt::MissedWindow::kMaxTicks)));
  rt::Executive executive(clock, monotonic, config, slots, status);

  const rt::ThreadCounters before = rt::read_thread_counters();
  rt::allocation_trap::arm(rt::allocation_trap::On::allocation_count);
  const bool watched = rt::allocation_trap::armed();
  const auto ended = executive.run(stop_now);
  const std::uint64_t allocations = rt::allocation_trap::disarm();
  rt::publish_counters(before, rt::read_thread_counters(), allocations, watched, status);
  waiting_clock = nullptr;
  (*bench)->finished.store(1, std::memory_order_release);
  return end_code(status, *scene, ended);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "punctum-core: {}\n", e.what());
    return kBadInput;
  }
}
