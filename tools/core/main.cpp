// punctum-core: the control core and its devices. Sets everything up, then runs the tick on this very thread.
// No OpenCV, no child processes; nothing allocates once the loop runs.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/ipc/segment.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/virtual_clock.hpp"
#include "rt/control/servo.hpp"
#include "rt/executive/executive.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/platform/allocation_trap.hpp"
#include "rt/platform/real_time_rights.hpp"
#include "rt/station/station.hpp"
#include "tools/core/assembly.hpp"
#include "tools/core/input_tape.hpp"
#include "tools/core/shut_down.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/version.hpp"

namespace {

using namespace punctum;
namespace stop_signal = tools::stop_signal;

constexpr double kTimeToWithdraw_s = 10;  // after the time limit, to draw a needle out of the cell
constexpr double kTimeToRest_s = 2;       // after that, for the forces to fade and the stage to rest
constexpr std::int64_t kSetUp_ns =
    200'000'000;                     // from the devices' start to the first tick, beside their own
constexpr int kSignalsToInsist = 3;  // this many end the loop at once; the first is a commanded stop

constexpr const char* kHelp =
    "The control core: reads hand and stage, computes the force, moves the needle, at the rate of the "
    "scene.\n"
    "`punctum run` starts it and gives it its segments of shared memory; nobody starts it by hand.\n"
    "Usage: punctum-core --scene FILE --segments NAME=DESCRIPTOR,... --clock real|virtual\n"
    "\n"
    "Options:\n"
    "  -h,--help                   this help\n"
    "  --version                   version and commit\n"
    "  --scene FILE                the resolved scene\n"
    "  --segments NAME=DESCRIPTOR,...  inherited segments of the station\n"
    "  --clock real|virtual        whose time it keeps\n"
    "\n"
    "Examples:\n"
    "  punctum run icsi\n"
    "      starts this program as it should be\n"
    "\n"
    "Exit codes:\n"
    "  0  the task ended well\n"
    "  1  it ended without a fault, but is not done\n"
    "  2  bad input: nothing has moved\n"
    "  3  a latched fault\n";

std::atomic<bool> end_loop{false};
std::atomic<sim::VirtualClock*> waiting_clock{nullptr};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<sim::VirtualClock*>::is_always_lock_free);

void on_stop_signal(int count) NONBLOCKING {
  if (count >= kSignalsToInsist) {
    end_loop.store(true);
  }
  if (sim::VirtualClock* clock = waiting_clock.load()) {
    clock->stop_waiting();
  }
}

// The simulated plant, if there is one, the servo, and what ends the run: the slots of the executive.
class Core {
 public:
  Core() = default;
  Core(const Core&) = delete;
  Core& operator=(const Core&) = delete;

  // `inputs`: what the servo is given is written there; null: nobody records it.
  void set_up(const tools::Scene& scene, tools::Assembly& assembly, rt::Station& station, bool degraded,
              rt::InputRing* inputs) {
    world_ = assembly.world();
    limit_ns_ = scene.seconds > 0 ? std::llround(scene.seconds * 1e9) : 0;
    if (inputs == nullptr) {
      servo_.emplace(scene.servo, assembly.devices(), station, degraded);
      return;
    }
    tape_.emplace(assembly.devices(), station.observation, degraded, *inputs);
    station.observation = tape_->observation();
    servo_.emplace(scene.servo, tape_->devices(), station, degraded);
  }

  rt::After step_plant(const rt::Tick& tick) NONBLOCKING {
    world_->step(tick.wake_ns);
    return rt::After::go_on;
  }

  rt::After tick_servo(const rt::Tick& tick) NONBLOCKING {
    std::uint32_t asked = 0;
    if (stop_signal::count() > 0) {
      servo_->request_stop();
      asked |= rt::InputSample::stop;
    }
    if (first_) {
      first_release_ns_ = tick.release_ns;
      first_ = false;
    }
    const std::int64_t t_ns = tick.release_ns - first_release_ns_;
    if (limit_ns_ > 0 && t_ns >= limit_ns_) {
      limit_reached_ = true;
      servo_->request_end();
      asked |= rt::InputSample::end;
      const double past_s = 1e-9 * static_cast<double>(t_ns - limit_ns_);
      if (past_s >= kTimeToWithdraw_s) {
        servo_->request_end_here();
        asked |= rt::InputSample::end_here;
      }
      if (past_s >= kTimeToWithdraw_s + kTimeToRest_s) {
        return rt::After::end;
      }
    }
    const rt::TickInfo now = tick.info();
    if (tape_) {
      tape_->begin(now, asked);
    }
    servo_->tick(now);
    if (tape_) {
      tape_->end();
    }
    const bool stopped_at_limit = limit_reached_ && servo_->stop_stage() == rt::StopStage::stopped;
    return servo_->finished() || stopped_at_limit ? rt::After::end : rt::After::go_on;
  }

  [[nodiscard]] const rt::Servo& servo() const NONBLOCKING { return *servo_; }
  [[nodiscard]] bool limit_reached() const NONBLOCKING { return limit_reached_; }

 private:
  sim::World* world_ = nullptr;
  std::optional<tools::InputTape> tape_;
  std::optional<rt::Servo> servo_;
  std::int64_t limit_ns_ = 0, first_release_ns_ = 0;
  bool first_ = true, limit_reached_ = false;
};

// Static: the servo is large, and its pages are there from the start.
Core core;

int bad(const std::string& text) {
  tools::complain(text);
  return tools::exit_bad_input;
}

struct Arguments {
  std::string scene, clock;
  tools::HandedSegments segments;
};

tl::expected<Arguments, std::string> read_arguments(int argc, char** argv) {
  Arguments a;
  std::string segments;
  for (int i = 1; i < argc; i += 2) {
    const std::string_view key = argv[i];
    std::string* into = key == "--scene"      ? &a.scene
                        : key == "--segments" ? &segments
                        : key == "--clock"    ? &a.clock
                                              : nullptr;
    if (into == nullptr || i + 1 >= argc) {
      return tl::unexpected(fmt::format(
          "{}: not understood, allowed: --scene FILE --segments NAME=DESCRIPTOR,... [--clock real|virtual]",
          key));
    }
    *into = argv[i + 1];
  }
  if (a.scene.empty() || segments.empty()) {
    return tl::unexpected(
        std::string("--scene and --segments are missing; `punctum run` starts this program"));
  }
  auto handed = tools::HandedSegments::parse(segments);
  if (!handed) {
    return tl::unexpected(handed.error());
  }
  a.segments = std::move(*handed);
  if (!a.clock.empty() && a.clock != "real" && a.clock != "virtual") {
    return tl::unexpected(fmt::format("--clock: {}: unknown, allowed: real or virtual", a.clock));
  }
  return a;
}

rt::RunEnd run_end(const tools::Scene& scene, rt::Executive::Ended ended) {
  const rt::Fault fault = core.servo().fault();
  if (ended == rt::Executive::Ended::invalid) {
    return rt::RunEnd::invalid_setup;
  }
  if (fault != rt::Fault::none) {
    return fault == rt::Fault::command_stop ? rt::RunEnd::stopped : rt::RunEnd::fault;
  }
  if (core.servo().outcome() == rt::RunEnd::done) {
    return rt::RunEnd::done;
  }
  if (core.limit_reached()) {
    return scene.has_task() ? rt::RunEnd::time_limit : rt::RunEnd::done;
  }
  return rt::RunEnd::stopped;
}

// The segments of the station as the core maps them.
struct StationSegments {
  hal::Shared<rt::CoreSegment> core;
  std::vector<hal::Shared<rt::CommandSegment>> commands = {};  // in the order of kCommandWriters
  std::optional<hal::Shared<const rt::ObservationSegment>> observation = {};  // none: the scene has no vision
  std::optional<hal::Shared<sim::Bench>> bench = {};                          // none: nothing is simulated
  std::optional<hal::Shared<sim::CameraAnswers>> camera = {};                 // likewise
  std::optional<hal::Shared<rt::InputSegment>> inputs = {};                   // none: nobody records them
  std::optional<hal::Shared<const browser::FingersSegment>> fingers = {};     // none: no page moves the hand
};

tl::expected<StationSegments, std::string> attach_station(const tools::HandedSegments& handed,
                                                          const tools::Scene& scene) {
  // First of all: from here on no second core is accepted.
  auto claimed =
      hal::Shared<rt::CoreSegment>::claim(tools::kCoreSegment, handed.descriptor(tools::kCoreSegment));
  if (!claimed) {
    return tl::unexpected(claimed.error());
  }
  StationSegments segments{.core = std::move(*claimed)};
  for (const rt::CommandWriter* writer : rt::kCommandWriters) {
    const std::string commands = tools::command_segment(*writer);
    auto attached = hal::Shared<rt::CommandSegment>::attach(commands, handed.descriptor(commands));
    if (!attached) {
      return tl::unexpected(attached.error());
    }
    segments.commands.push_back(std::move(*attached));
  }
  if (scene.vision) {
    auto observation = hal::Shared<const rt::ObservationSegment>::attach(
        tools::kObservationSegment, handed.descriptor(tools::kObservationSegment));
    if (!observation) {
      return tl::unexpected(observation.error());
    }
    segments.observation = std::move(*observation);
  }
  if (scene.sim) {
    auto bench =
        hal::Shared<sim::Bench>::attach(tools::kBenchSegment, handed.descriptor(tools::kBenchSegment));
    if (!bench) {
      return tl::unexpected(bench.error());
    }
    segments.bench = std::move(*bench);
    auto camera = hal::Shared<sim::CameraAnswers>::attach(tools::kCameraSegment,
                                                          handed.descriptor(tools::kCameraSegment));
    if (!camera) {
      return tl::unexpected(camera.error());
    }
    segments.camera = std::move(*camera);
  }
  if (const int descriptor = handed.descriptor(tools::kInputSegment); descriptor >= 0) {
    auto inputs = hal::Shared<rt::InputSegment>::claim(tools::kInputSegment, descriptor);
    if (!inputs) {
      return tl::unexpected(inputs.error());
    }
    segments.inputs = std::move(*inputs);
  }
  if (const int descriptor = handed.descriptor(tools::kFingersSegment); descriptor >= 0) {
    auto fingers = hal::Shared<const browser::FingersSegment>::attach(tools::kFingersSegment, descriptor);
    if (!fingers) {
      return tl::unexpected(fingers.error());
    }
    segments.fingers = std::move(*fingers);
  }
  return segments;
}

// The scene that the parent hands over, on the clock that it names.
tl::expected<tools::Scene, std::string> scene_to_run(const Arguments& arguments) {
  auto scene = tools::load_scene(arguments.scene);
  if (!scene) {
    return scene;
  }
  if (!arguments.clock.empty()) {
    scene->clock = arguments.clock == "real" ? tools::ClockKind::real : tools::ClockKind::virtual_time;
  }
  if (scene->clock == tools::ClockKind::virtual_time && (!scene->sim || tools::any_real(scene->devices))) {
    return tl::unexpected(
        std::string("--clock virtual: the scene has real devices, which do not wait for it, allowed: real"));
  }
  return scene;
}

bool in_real_time(const tools::Scene& scene) { return scene.clock == tools::ClockKind::real; }

// The time of the station: of this machine, or the bench's own, which a signal may wake from waiting.
class StationClock {
 public:
  StationClock(const tools::Scene& scene, StationSegments& segments) {
    if (!in_real_time(scene)) {
      virtual_.emplace(**segments.bench, **segments.camera);
      waiting_clock = &*virtual_;
      if (stop_signal::count() > 0) {
        virtual_->stop_waiting();
      }
    } else if (segments.bench) {
      (*segments.bench)->now_ns.store(monotonic_.now_ns());
    }
  }
  ~StationClock() { waiting_clock = nullptr; }
  StationClock(const StationClock&) = delete;
  StationClock& operator=(const StationClock&) = delete;

  [[nodiscard]] hal::Clock& now() {
    return virtual_ ? static_cast<hal::Clock&>(*virtual_) : static_cast<hal::Clock&>(monotonic_);
  }
  // For durations on this machine, in either kind of time.
  [[nodiscard]] rt::MonotonicClock& monotonic() { return monotonic_; }

  // In virtual time, before the first tick: camera and recorder are there, or it was waited for them in vain.
  void await_others(bool vision) {
    if (virtual_ && vision) {
      (void)virtual_->await_camera();
    }
    if (virtual_) {
      (void)virtual_->await_recorder();
    }
  }
  // The shut-down waits for nobody.
  void wait_no_more() {
    if (virtual_) {
      virtual_->stop_waiting();
    }
  }

 private:
  rt::MonotonicClock monotonic_;
  std::optional<sim::VirtualClock> virtual_;
};

// Priority, processor and memory for this thread, and every page of the segments in place.
rt::RealTimeRights become_real_time(const tools::Scene& scene, const StationSegments& segments) {
  rt::RightsWanted wanted;
  wanted.priority = scene.core_priority;
  wanted.cpu = scene.core_cpu;
  auto rights = rt::RealTimeRights::acquire(wanted);
  rights.publish(segments.core->status);
  rt::prefault_writable(segments.core.get(), sizeof(rt::CoreSegment));
  for (const auto& commands : segments.commands) {
    rt::prefault_writable(commands.get(), sizeof(rt::CommandSegment));
  }
  if (segments.observation) {
    rt::prefault(segments.observation->get(), sizeof(rt::ObservationSegment));
  }
  if (segments.bench) {
    rt::prefault_writable(segments.bench->get(), sizeof(sim::Bench));
  }
  if (segments.inputs) {
    rt::prefault_writable(segments.inputs->get(), sizeof(rt::InputSegment));
  }
  return rights;
}

rt::ExecutiveConfig executive_config(const tools::Scene& scene, std::int64_t period_ns,
                                     std::int64_t start_ns) {
  rt::ExecutiveConfig config;
  config.period_ns = period_ns;
  config.start_ns = start_ns;
  config.overrun_window_ticks =
      static_cast<std::uint32_t>(std::lround(scene.servo.overrun_window_s * scene.servo.rate_Hz));
  return config;
}

// The loop itself, from the first tick to the last; nothing in it allocates, which is counted.
rt::Executive::Ended run_loop(rt::Executive& executive, rt::CoreStatus& status) {
  const rt::ThreadCounters before = rt::read_thread_counters();
  rt::allocation_trap::arm(rt::allocation_trap::On::allocation_count);
  const bool watched = rt::allocation_trap::armed();
  const auto ended = executive.run(end_loop);
  const std::uint64_t allocations = rt::allocation_trap::disarm();
  rt::publish_counters(before, rt::read_thread_counters(), allocations, watched, status);
  return ended;
}

// The last event, and the word on which the parent waits.
void publish_end(rt::CoreSegment& segment, rt::RunEnd end) {
  rt::Event last;
  last.tick = segment.status.tick_index.load();
  last.t_s = core.servo().sample().t_s;
  last.kind = rt::Event::ended;
  last.what = static_cast<std::uint64_t>(end);
  segment.events.push(last);
  segment.status.run_end.store(static_cast<std::uint64_t>(end), std::memory_order_release);
}

// With every device open: takes the rights, starts the devices, runs the loop, and shuts down.
int control(const tools::Scene& scene, StationSegments& segments, StationClock& clock,
            tools::Assembly& assembly) {
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / scene.servo.rate_Hz));
  std::optional<rt::RealTimeRights> rights;
  if (in_real_time(scene)) {
    rights.emplace(become_real_time(scene, segments));
  }
  clock.await_others(scene.vision.has_value());
  const std::int64_t set_up_ns = in_real_time(scene) ? kSetUp_ns + assembly.longest_start_ns() : period_ns;
  const std::int64_t start_ns = clock.now().now_ns() + set_up_ns;
  // From here on every way out of this function, an exception too, goes through it.
  tools::ShutDown shut_down(assembly.devices(), clock.now(), period_ns,
                            std::llround(scene.servo.estop.power_off_after_s * 1e9));
  if (const auto started = assembly.start(start_ns); !started) {
    return bad(started.error());
  }
  shut_down.started(assembly.world());
  static const rt::Devices devices = assembly.devices();
  tools::shut_down_when_spinning(devices);
  if (!rt::drop_capabilities()) {
    return bad("its capabilities cannot be given up");
  }

  std::vector<rt::CommandInput> commands;
  for (std::size_t i = 0; i < rt::kCommandWriterCount; ++i) {
    commands.push_back({&segments.commands[i]->queue, rt::kCommandWriters[i]->role});
  }
  rt::Station station{*segments.core, segments.observation ? &(*segments.observation)->slot : nullptr,
                      commands};
  core.set_up(scene, assembly, station, rights && rights->degraded(),
              segments.inputs ? &(*segments.inputs)->ring : nullptr);
  std::vector<rt::Slot> slots;
  if (assembly.world() != nullptr) {
    slots.push_back(rt::slot<&Core::step_plant>("plant", core));
  }
  slots.push_back(rt::slot<&Core::tick_servo>("servo", core));
  rt::CoreStatus& status = segments.core->status;
  rt::Executive executive(clock.now(), clock.monotonic(), executive_config(scene, period_ns, start_ns), slots,
                          status);

  const auto ended = run_loop(executive, status);
  clock.wait_no_more();
  shut_down.run();
  rt::leave_real_time();
  const rt::RunEnd end = run_end(scene, ended);
  publish_end(*segments.core, end);
  return tools::exit_code(end);
}

int run(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--version") {
    tools::say(tools::version_line("punctum-core") + "\n");
    return tools::code_after_words(tools::exit_done);
  }
  if (argc == 2 && (std::string_view(argv[1]) == "--help" || std::string_view(argv[1]) == "-h")) {
    tools::say(kHelp);
    return tools::code_after_words(tools::exit_done);
  }
  stop_signal::watch({SIGTERM, SIGINT, SIGHUP, SIGQUIT}, on_stop_signal);
  const auto arguments = read_arguments(argc, argv);
  if (!arguments) {
    return bad(arguments.error());
  }
  const auto scene = scene_to_run(*arguments);
  if (!scene) {
    return bad(scene.error());
  }
  auto segments = attach_station(arguments->segments, *scene);
  if (!segments) {
    return bad(segments.error());
  }
  if (!stop_signal::watch_parent(segments->core->header.owner_pid)) {
    return bad("the program that started it has died");
  }
  if (stop_signal::count() > 0) {
    return tools::exit_not_done;  // stopped before anything has moved
  }
  segments->core->status.pid.store(static_cast<std::uint64_t>(getpid()));
  StationClock clock(*scene, *segments);
  const auto assembly =
      tools::Assembly::open({*scene, clock.now(), segments->bench ? segments->bench->get() : nullptr,
                             segments->fingers ? segments->fingers->get() : nullptr});
  if (!assembly) {
    return bad(assembly.error());
  }
  return control(*scene, *segments, clock, **assembly);
}

}  // namespace

int main(int argc, char** argv) {
  tools::start_program();
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    tools::complain(std::string("punctum-core: ") + e.what());
    return tools::exit_bad_input;
  }
}
