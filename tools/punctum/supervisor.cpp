#include "tools/punctum/supervisor.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <fstream>
#include <optional>
#include <thread>
#include <vector>

#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/sealed_text.hpp"
#include "hal/ipc/segment.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/valid.hpp"
#include "hal/sim/world.hpp"
#include "rt/station/station.hpp"
#include "tools/punctum/core_process.hpp"
#include "tools/punctum/judge.hpp"
#include "tools/punctum/recorder.hpp"
#include "tools/punctum/report_folder.hpp"
#include "tools/punctum/run_figure.hpp"
#include "tools/punctum/run_report.hpp"
#include "tools/punctum/terminal.hpp"
#include "tools/punctum/vision_process.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/station_values.hpp"
#include "tools/shared/stop_signal.hpp"

namespace punctum::tools {
namespace {

constexpr double kLongRun_s = 600;         // longer ones are recorded thinner, and without annotated frames
constexpr double kOpenEnded_s = 8 * 3600;  // what is recorded of a run without a limit at that density
constexpr double kRowsOfLongRun = 500'000;
constexpr double kSilent_s = 2;           // without a readable sample while the core ticks
constexpr std::uint64_t kBusyRound = 64;  // ticks drained in one round: there may be more already

// Letters, digits, '-' and '_' of the scene's name, and this process: two runs never meet.
std::string station_name(const Scene& scene) {
  std::string s;
  for (const char c : scene.name.substr(0, 40)) {
    s += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' ? c : '_';
  }
  return fmt::format("{}-{}", s.empty() ? "scene" : s, getpid());
}

bool is_long(const Scene& scene) { return scene.seconds > kLongRun_s || scene.seconds <= 0; }

std::uint64_t rows_every(const Scene& scene, const RunSettings& settings) {
  if (settings.samples_every > 0 || !is_long(scene)) {
    return std::max<std::uint64_t>(1, settings.samples_every);
  }
  const double seconds = scene.seconds > 0 ? scene.seconds : kOpenEnded_s;
  return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(seconds * scene.servo.rate_Hz) /
                                        static_cast<std::uint64_t>(kRowsOfLongRun));
}

static_assert(rt::kCommandWriters[0] == &rt::kParent);

// The segments of one run. The parent makes them all, and writes its own commands alone.
struct Segments {
  std::string station;
  hal::Rendezvous rendezvous;  // gives visitors what they may read
  hal::Shared<const rt::CoreSegment> core;
  std::vector<hal::Shared<rt::CommandSegment>> commands = {};  // in the order of kCommandWriters
  std::optional<hal::Shared<const rt::ObservationSegment>> observation = {};  // none: the scene has no vision
  std::optional<hal::Shared<sim::Bench>> bench = {};                          // none: nothing is simulated
  std::optional<hal::Shared<sim::CameraAnswers>> camera = {};                 // likewise
  std::optional<hal::Descriptor> bench_for_vision = {};                       // for reading
};

tl::expected<void, std::string> offer_to_readers(Segments& segments) {
  const auto offer = [&segments](const char* name,
                                 const hal::Segment& segment) -> tl::expected<void, std::string> {
    auto descriptor = segment.read_only_descriptor();
    if (!descriptor) {
      return tl::unexpected(descriptor.error());
    }
    segments.rendezvous.offer(name, std::move(*descriptor));
    return {};
  };
  // A queue of commands for whoever claims it first; the parent's own stays with the parent.
  for (std::size_t i = 0; i < rt::kCommandWriterCount; ++i) {
    if (rt::kCommandWriters[i] != &rt::kParent) {
      const int queue = segments.commands[i].segment().descriptor();
      segments.rendezvous.offer(command_segment(*rt::kCommandWriters[i]),
                                hal::Descriptor(fcntl(queue, F_DUPFD_CLOEXEC, 0)));
    }
  }
  auto offered = offer(kCoreSegment, segments.core.segment());
  if (offered && segments.observation) {
    offered = offer(kObservationSegment, segments.observation->segment());
  }
  if (offered && segments.bench) {
    offered = offer(kBenchSegment, segments.bench->segment());
  }
  if (offered && segments.camera) {
    offered = offer(kCameraSegment, segments.camera->segment());
  }
  return offered;
}

tl::expected<Segments, std::string> create_segments(const Scene& scene) {
  const std::string station = station_name(scene);
  const auto full_name = [&station](const std::string& segment) { return station + "." + segment; };
  auto rendezvous = hal::Rendezvous::open(station);
  if (!rendezvous) {
    return tl::unexpected(rendezvous.error());
  }
  auto core = hal::Shared<const rt::CoreSegment>::create(full_name(kCoreSegment));
  if (!core) {
    return tl::unexpected(core.error());
  }
  Segments all{.station = station, .rendezvous = std::move(*rendezvous), .core = std::move(*core)};
  for (const rt::CommandWriter* writer : rt::kCommandWriters) {
    auto commands = hal::Shared<rt::CommandSegment>::create(full_name(command_segment(*writer)));
    if (!commands) {
      return tl::unexpected(commands.error());
    }
    all.commands.push_back(std::move(*commands));
  }
  if (scene.vision) {
    auto observation = hal::Shared<const rt::ObservationSegment>::create(full_name(kObservationSegment));
    if (!observation) {
      return tl::unexpected(observation.error());
    }
    all.observation = std::move(*observation);
  }
  if (scene.sim) {
    auto bench = hal::Shared<sim::Bench>::create(full_name(kBenchSegment));
    if (!bench) {
      return tl::unexpected(bench.error());
    }
    all.bench = std::move(*bench);
    auto camera = hal::Shared<sim::CameraAnswers>::create(full_name(kCameraSegment));
    if (!camera) {
      return tl::unexpected(camera.error());
    }
    all.camera = std::move(*camera);
    auto for_reading = all.bench->segment().read_only_descriptor();
    if (!for_reading) {
      return tl::unexpected(for_reading.error());
    }
    all.bench_for_vision = std::move(*for_reading);
    (*all.bench)->virtual_time.store(scene.clock == ClockKind::virtual_time ? 1 : 0);
  }
  if (auto offered = offer_to_readers(all); !offered) {
    return tl::unexpected(offered.error());
  }
  return all;
}

// What the core gets: its own segments for writing; of commands it marks what it has taken.
HandedSegments for_core(const Segments& segments) {
  HandedSegments handed;
  handed.add(kCoreSegment, segments.core.segment().descriptor());
  for (std::size_t i = 0; i < rt::kCommandWriterCount; ++i) {
    handed.add(command_segment(*rt::kCommandWriters[i]), segments.commands[i].segment().descriptor());
  }
  if (segments.observation) {
    handed.add(kObservationSegment, segments.observation->segment().descriptor());
  }
  if (segments.bench) {
    handed.add(kBenchSegment, segments.bench->segment().descriptor());
    handed.add(kCameraSegment, segments.camera->segment().descriptor());
  }
  return handed;
}

HandedSegments for_vision(const Segments& segments) {
  HandedSegments handed;
  if (segments.observation) {
    handed.add(kObservationSegment, segments.observation->segment().descriptor());
  }
  if (segments.bench) {
    handed.add(kBenchSegment, segments.bench_for_vision->number());
    handed.add(kCameraSegment, segments.camera->segment().descriptor());
  }
  return handed;
}

std::vector<std::string> core_arguments(const Scene& scene, const hal::Descriptor& resolved,
                                        const HandedSegments& segments) {
  return {"--scene",    hal::inherited_path(resolved),
          "--segments", segments.text(),
          "--clock",    scene.clock == ClockKind::real ? "real" : "virtual"};
}

std::vector<std::string> vision_arguments(const Scene& scene, const hal::Descriptor& resolved,
                                          const std::string& folder, const HandedSegments& segments,
                                          bool frames) {
  std::vector<std::string> args{
      "live",  "--scene",          hal::inherited_path(resolved), "--segments", segments.text(),
      "--out", folder + "/obs.csv"};
  if (frames && !is_long(scene)) {
    args.insert(args.end(), {"--overlay", folder + "/frames"});
  }
  return args;
}

// What a child inherits: its segments, and the scene.
std::vector<int> inherited(const HandedSegments& segments, const hal::Descriptor& resolved) {
  std::vector<int> all = segments.descriptors();
  all.push_back(resolved.number());
  return all;
}

// One run, from the first process to the report.
class Run {
 public:
  // `resolved`: the scene as the children read it, from their parent and not from a file that others write.
  Run(const Scene& scene, const hal::Descriptor& resolved, const RunSettings& settings,
      const std::string& folder, Segments& segments, Recorder& recorder, Terminal& terminal)
      : scene_(scene),
        resolved_(resolved),
        settings_(settings),
        folder_(folder),
        segments_(segments),
        recorder_(recorder),
        terminal_(terminal),
        core_(*segments.core, segments.commands.front()->queue, scene.clock == ClockKind::real, terminal),
        vision_(vision_arguments(scene, resolved, folder, for_vision(segments), settings.frames),
                inherited(for_vision(segments), resolved), folder + "/vision.log", terminal) {}

  int run();

 private:
  [[nodiscard]] double now_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
  }
  [[nodiscard]] const rt::CoreStatus& status() const { return segments_.core->status; }
  void watch_vision();
  void watch_recording();
  void tell_progress();
  Ended watch_until_the_core_ends();
  void judge_end(const Ended& core);
  void let_devices_come_to_rest();
  int report();

  const Scene& scene_;
  const hal::Descriptor& resolved_;
  const RunSettings& settings_;
  const std::string& folder_;
  Segments& segments_;
  Recorder& recorder_;
  Terminal& terminal_;
  CoreProcess core_;
  VisionProcess vision_;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  bool vision_was_refused_ = false;
  bool rights_told_ = false;
  double next_progress_s_ = 0;
  std::uint64_t recorded_ = 0, ticks_at_record_ = 0;  // when a sample last came
  double recorded_s_ = 0;
  RunResult result_;
};

int Run::run() {
  terminal_.say("{}: {} ({} Hz, {} clock, seed {})", scene_.name,
                scene_.title.empty() ? scene_.source : scene_.title, scene_.servo.rate_Hz,
                scene_.clock == ClockKind::real ? "real" : "virtual", scene_.sim ? scene_.sim->seed : 0);
  terminal_.say("report: {}", folder_);

  // Recorded frames play from the core's first tick on; a camera is there before it.
  const bool vision_follows_core = scene_.recorded && scene_.clock == ClockKind::real;
  if (scene_.vision && !vision_follows_core) {
    if (auto started = vision_.start(); !started) {
      terminal_.complain(started.error());
      return exit_bad_input;
    }
  }
  const HandedSegments handed = for_core(segments_);
  if (auto started = core_.start(core_arguments(scene_, resolved_, handed), folder_ + "/core.log",
                                 inherited(handed, resolved_));
      !started) {
    terminal_.complain(started.error());
    return exit_bad_input;
  }
  begun_ = std::chrono::steady_clock::now();
  const Ended core = watch_until_the_core_ends();
  recorder_.finish();
  terminal_.clear_progress();
  if (core.exited && core.code == exit_bad_input) {  // it has not begun
    terminal_.complain(fmt::format("punctum-core: {}", last_line(core_.log())));
    vision_.send(SIGTERM);
    vision_.end();
    return exit_bad_input;
  }
  judge_end(core);
  if (segments_.bench) {
    (*segments_.bench)->finished.store(1);  // a camera that still waits for the plant ends
  }
  vision_.end();
  return report();
}

Ended Run::watch_until_the_core_ends() {
  for (Ended ended;;) {
    const std::uint64_t taken = recorder_.drain();
    if (core_.ended(ended)) {
      return ended;
    }
    segments_.rendezvous.serve();
    watch_vision();
    watch_recording();
    core_.watch(now_s(), stop_signal::count());
    tell_progress();
    if (taken < kBusyRound) {
      std::this_thread::sleep_for(std::chrono::microseconds(scene_.clock == ClockKind::real ? 2000 : 100));
    }
  }
}

void Run::watch_vision() {
  if (!scene_.vision) {
    return;
  }
  if (!vision_.was_started() && status().started.load() != 0) {
    if (auto started = vision_.start(); !started) {
      terminal_.complain(started.error());
      vision_was_refused_ = true;
      stop_signal::request();
    }
  }
  const double run_s = recorder_.measures().last_s;
  switch (vision_.watch(now_s(), run_s)) {
    case VisionProcess::News::none:
      break;
    case VisionProcess::News::frames_ended:
      if (scene_.recorded) {
        terminal_.say("{:8.3f} s  the recorded frames have ended", run_s);
        core_.ask(rt::Command::end);
      }
      break;
    case VisionProcess::News::given_up:
      if (segments_.bench) {
        (*segments_.camera)->pid.store(0);  // virtual time waits for it no longer
      }
      break;
    case VisionProcess::News::refused:
      vision_was_refused_ = true;
      stop_signal::request();
      break;
  }
}

// Samples that stop coming although the core ticks: the recording would end without a word.
void Run::watch_recording() {
  const std::uint64_t recorded = recorder_.measures().ticks;
  const std::uint64_t ticks = status().ticks.load();
  if (recorded != recorded_ || ticks == ticks_at_record_) {
    recorded_ = recorded;
    ticks_at_record_ = ticks;
    recorded_s_ = now_s();
  } else if (!result_.silent_from_s && now_s() > recorded_s_ + kSilent_s) {
    result_.silent_from_s = recorder_.measures().last_s;
    terminal_.complain(fmt::format(
        "the core ticks, but none of its samples could be read for {:.0f} s: the recording has a gap from "
        "{:.3f} s on",
        kSilent_s, *result_.silent_from_s));
  }
}

void Run::tell_progress() {
  const rt::CoreStatus& core = status();
  if (!rights_told_ && core.started.load() != 0) {
    rights_told_ = true;
    if (core.degraded.load() != 0 && scene_.clock == ClockKind::real) {
      if (const std::string text = missing_rights(core); !text.empty()) {
        terminal_.say("{}", text);
      }
    }
  }
  if (settings_.quiet || now_s() < next_progress_s_) {
    return;
  }
  next_progress_s_ = now_s() + terminal_.progress_every_s();
  const Measures& m = recorder_.measures();
  if (m.ticks > 0) {
    terminal_.progress(progress_line(scene_, m.last, core));
  }
}

void Run::judge_end(const Ended& core) {
  const RunFacts facts{.core_exited = core.exited,
                       .stop_was_asked = core_.stop_was_asked(),
                       .vision_over = vision_.over(),
                       .has_task = scene_.has_task()};
  result_.end = judge(facts, status(), recorder_.measures());
  result_.wall_s = now_s();
  if (result_.end == rt::RunEnd::fault) {
    const auto fault = fault_in(status().fault.load());
    result_.detail = fault ? rt::name(*fault) : "unknown";
  }
  if (result_.end == rt::RunEnd::core_died) {
    result_.detail = core.text();
    terminal_.complain(
        fmt::format("the control core {} at {:.3f} s", core.text(), recorder_.measures().last_s));
    recorder_.keep_last_seconds();
    let_devices_come_to_rest();
  }
}

// The core is dead: what the simulated devices do by themselves.
void Run::let_devices_come_to_rest() {
  if (!segments_.bench || !scene_.sim) {
    return;
  }
  if ((*segments_.bench)->snapshots.head() == 0) {
    terminal_.say("it had not begun: no device was switched on");
    return;
  }
  if (sim::Snapshot newest; !sim::newest_valid(**segments_.bench, newest)) {
    terminal_.complain("what it left of the simulated devices is not usable: their state is not known");
    return;
  }
  result_.unattended = sim::run_unattended(*scene_.sim, **segments_.bench);
  const auto& u = *result_.unattended;
  const auto when = [](double s) {
    return s < 0 ? std::string("not") : fmt::format("after {:.0f} ms", s * 1e3);
  };
  terminal_.say(
      "the devices without it: relay opened {}, stage at rest {} ({:.1f} um further), injector gate shut {}, "
      "hand force off {}, holding vacuum {}: {}",
      when(u.relay_opened_s), when(u.stage_at_rest_s), u.stage_moved_m * 1e6, when(u.gate_shut_s),
      when(u.hand_force_off_s), u.vacuum_kept ? "kept" : "LOST", u.safe ? "safe" : "NOT SAFE");
}

int Run::report() {
  const Measures& m = recorder_.measures();
  result_.vision_restarts = vision_.restarts();
  result_.rows = recorder_.rows();
  result_.rows_every = recorder_.every();
  result_.samples_lost = recorder_.lost();
  result_.samples_unusable = recorder_.unusable();
  const auto contour = read_contour_error(folder_ + "/obs.csv");
  const std::string path = folder_ + "/report.json";
  bool complete = true;
  std::string places;
  if (auto written = write_report(path, scene_, result_, m, recorder_.events(), status(), contour);
      !written) {
    terminal_.complain(written.error());
    complete = false;
  } else {
    places = fmt::format("report          {}\n", path);
  }
  if (recorder_.write_failed()) {
    terminal_.complain(fmt::format("{}: samples are not complete, is the disk full?", folder_));
    complete = false;
  }
  complete = complete && recorder_.unusable() == 0 && !result_.silent_from_s;
  if (settings_.figure) {
    if (auto drawn = draw_run(folder_, scene_, m, result_.rows); !drawn) {
      terminal_.complain(fmt::format("no figure: {}", drawn.error()));
    } else {
      places = fmt::format("figure          {}\n", *drawn) + places;
    }
  }
  terminal_.print("\n" + summary(scene_, result_, m, status(), contour) + places);
  if (vision_was_refused_) {
    return exit_bad_input;
  }
  const ExitCode code = exit_code(result_.end);
  return code == exit_done && !complete ? exit_not_done : code;
}

tl::expected<void, std::string> write_resolved(const std::string& scene, const std::string& folder) {
  std::ofstream out(folder + "/scene.toml");
  out << scene;
  if (!out.flush()) {
    return tl::unexpected(fmt::format("{}/scene.toml: cannot be written", folder));
  }
  return {};
}

}  // namespace

int run_scene(const Scene& scene, const RunSettings& settings) {
  // Before anything exists that an end would leave behind.
  stop_signal::watch({SIGINT, SIGTERM, SIGHUP, SIGQUIT});
  signal(SIGPIPE, SIG_IGN);
  Terminal terminal;
  const auto refuse = [&terminal](const std::string& why) {
    terminal.complain(why);
    return exit_bad_input;
  };
  const auto folder = prepare_report_folder(scene, settings.report);
  if (!folder) {
    return refuse(folder.error());
  }
  if (const std::string& warning = folder->lock.not_held(); !warning.empty()) {
    terminal.complain(warning);
  }
  const std::string text = to_toml(scene);
  if (auto written = write_resolved(text, folder->path); !written) {
    return refuse(written.error());
  }
  const auto resolved = hal::seal_text("scene", text);
  if (!resolved) {
    return refuse(resolved.error());
  }
  auto segments = create_segments(scene);
  if (!segments) {
    return refuse(segments.error());
  }
  auto recorder =
      Recorder::create(folder->path, scene, *segments->core,
                       segments->bench ? segments->bench->get() : nullptr, rows_every(scene, settings));
  if (!recorder) {
    return refuse(recorder.error());
  }
  if (stop_signal::count() > 0) {
    terminal.complain("stopped before anything was started");
    return exit_not_done;
  }
  Run run(scene, *resolved, settings, folder->path, *segments, *recorder, terminal);
  return run.run();
}

}  // namespace punctum::tools
