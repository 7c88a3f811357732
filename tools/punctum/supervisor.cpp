#include "tools/punctum/supervisor.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "hal/browser/fingers.hpp"
#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/sealed_text.hpp"
#include "hal/ipc/segment.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/valid.hpp"
#include "hal/sim/world.hpp"
#include "rt/station/picture.hpp"
#include "rt/station/station.hpp"
#include "tools/punctum/console_process.hpp"
#include "tools/punctum/core_process.hpp"
#include "tools/punctum/disk_space.hpp"
#include "tools/punctum/judge.hpp"
#include "tools/punctum/kernel_watchdog.hpp"
#include "tools/punctum/lab_report.hpp"
#include "tools/punctum/provenance.hpp"
#include "tools/punctum/record_process.hpp"
#include "tools/punctum/recorder.hpp"
#include "tools/punctum/report_folder.hpp"
#include "tools/punctum/run_report.hpp"
#include "tools/punctum/service_manager.hpp"
#include "tools/punctum/terminal.hpp"
#include "tools/punctum/vision_process.hpp"
#include "tools/scene/messages.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/station_values.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/whole_file.hpp"
#include "tools/shared/witness.hpp"

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
  return std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::ceil(seconds * scene.servo.rate_Hz / kRowsOfLongRun)));
}

bool has_pictures(const Scene& scene) {
  return scene.vision && scene.vision->method != vision::Method::truth;
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
  std::optional<hal::Shared<const rt::InputSegment>> inputs = {};             // none: the run is not recorded
  std::optional<hal::Shared<const rt::PictureSegment>> pictures = {};         // none: likewise the pictures
  std::optional<hal::Shared<const browser::FingersSegment>> fingers = {};     // none: no page moves the hand
  std::optional<hal::Shared<const rt::ViewSegment>> view = {};      // none: vision looks at no picture
  std::optional<hal::Shared<const rt::ViewerSegment>> viewer = {};  // likewise
  std::optional<hal::Descriptor> core_for_vision = {}, bench_for_vision = {}, viewer_for_vision = {},
                                 fingers_for_core = {};  // for reading
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
  const auto offer_for_writing = [&segments](const std::string& name, const hal::Segment& segment) {
    segments.rendezvous.offer(name, hal::Descriptor(fcntl(segment.descriptor(), F_DUPFD_CLOEXEC, 0)));
  };
  // A queue of commands for whoever claims it first; the parent's own stays with the parent.
  for (std::size_t i = 0; i < rt::kCommandWriterCount; ++i) {
    if (rt::kCommandWriters[i] != &rt::kParent) {
      offer_for_writing(command_segment(*rt::kCommandWriters[i]), segments.commands[i].segment());
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
  if (offered && segments.inputs) {
    offered = offer(kInputSegment, segments.inputs->segment());
  }
  if (offered && segments.pictures) {
    offered = offer(kPictureSegment, segments.pictures->segment());
  }
  if (offered && segments.view) {
    offered = offer(kViewSegment, segments.view->segment());
    offer_for_writing(kViewerSegment, segments.viewer->segment());
  }
  if (segments.fingers) {
    offer_for_writing(kFingersSegment, segments.fingers->segment());
  }
  return offered;
}

tl::expected<Segments, std::string> create_segments(const Scene& scene, const RunSettings& settings) {
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
    auto for_reading = all.core.segment().read_only_descriptor();
    if (!for_reading) {
      return tl::unexpected(for_reading.error());
    }
    all.core_for_vision = std::move(*for_reading);
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
  if (settings.record) {
    auto inputs = hal::Shared<const rt::InputSegment>::create(full_name(kInputSegment));
    if (!inputs) {
      return tl::unexpected(inputs.error());
    }
    all.inputs = std::move(*inputs);
  }
  if (settings.pictures) {
    auto pictures = hal::Shared<const rt::PictureSegment>::create(full_name(kPictureSegment));
    if (!pictures) {
      return tl::unexpected(pictures.error());
    }
    all.pictures = std::move(*pictures);
  }
  if (scene.devices.haptic == kBrowser) {
    auto fingers = hal::Shared<const browser::FingersSegment>::create(full_name(kFingersSegment));
    if (!fingers) {
      return tl::unexpected(fingers.error());
    }
    auto for_reading = fingers->segment().read_only_descriptor();
    if (!for_reading) {
      return tl::unexpected(for_reading.error());
    }
    all.fingers = std::move(*fingers);
    all.fingers_for_core = std::move(*for_reading);
  }
  if (has_pictures(scene)) {
    auto view = hal::Shared<const rt::ViewSegment>::create(full_name(kViewSegment));
    auto viewer = hal::Shared<const rt::ViewerSegment>::create(full_name(kViewerSegment));
    if (!view || !viewer) {
      return tl::unexpected(view ? viewer.error() : view.error());
    }
    auto for_reading = viewer->segment().read_only_descriptor();
    if (!for_reading) {
      return tl::unexpected(for_reading.error());
    }
    all.view = std::move(*view);
    all.viewer = std::move(*viewer);
    all.viewer_for_vision = std::move(*for_reading);
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
  if (segments.inputs) {
    handed.add(kInputSegment, segments.inputs->segment().descriptor());
  }
  if (segments.fingers) {
    handed.add(kFingersSegment, segments.fingers_for_core->number());
  }
  return handed;
}

HandedSegments for_vision(const Segments& segments) {
  HandedSegments handed;
  if (segments.observation) {
    handed.add(kObservationSegment, segments.observation->segment().descriptor());
    handed.add(kCoreSegment, segments.core_for_vision->number());
  }
  if (segments.bench) {
    handed.add(kBenchSegment, segments.bench_for_vision->number());
    handed.add(kCameraSegment, segments.camera->segment().descriptor());
  }
  if (segments.pictures) {
    handed.add(kPictureSegment, segments.pictures->segment().descriptor());
  }
  if (segments.view) {
    handed.add(kViewSegment, segments.view->segment().descriptor());
    handed.add(kViewerSegment, segments.viewer_for_vision->number());
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
      const ReportFolder& report_folder, Segments& segments, Recorder& recorder, SpaceReserve& reserve,
      Terminal& terminal)
      : scene_(scene),
        resolved_(resolved),
        settings_(settings),
        report_folder_(report_folder),
        folder_(report_folder.folder),
        reserve_(reserve),
        segments_(segments),
        recorder_(recorder),
        terminal_(terminal),
        core_(*segments.core, segments.commands.front()->queue, scene.clock == ClockKind::real, terminal),
        vision_(vision_arguments(scene, resolved, folder_, for_vision(segments), settings.frames),
                inherited(for_vision(segments), resolved), folder_ + "/vision.log",
                segments.observation ? &(*segments.observation)->rounds : nullptr,
                scene.clock == ClockKind::real, terminal),
        console_(segments.station, folder_ + "/console.log", terminal) {}

  int run();

 private:
  [[nodiscard]] double now_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
  }
  [[nodiscard]] const rt::CoreStatus& status() const { return segments_.core->status; }
  void watch_vision();
  [[nodiscard]] tl::expected<void, std::string> start_recording();
  [[nodiscard]] std::uint64_t may_take() const;
  void note_recording(const std::string& why);
  void tell_faults();
  void watch_recording();
  void tell_progress();
  void tell_what_is_not_kept();
  [[nodiscard]] int refuse(const std::string& why);
  [[nodiscard]] int leave_nothing();
  [[nodiscard]] bool vision_has_its_camera();
  Ended watch_until_the_core_ends();
  void judge_end(const Ended& core);
  void let_devices_come_to_rest();
  int report();

  const Scene& scene_;
  const hal::Descriptor& resolved_;
  const RunSettings& settings_;
  const ReportFolder& report_folder_;
  std::string folder_;
  SpaceReserve& reserve_;
  Segments& segments_;
  Recorder& recorder_;
  Terminal& terminal_;
  CoreProcess core_;
  VisionProcess vision_;
  RecordProcess record_;
  ConsoleProcess console_;
  KernelWatchdog watchdog_;
  ServiceManager service_manager_;
  std::optional<late::Witness> witness_;  // of a core in real time
  const std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  bool frames_are_over_ = false, stop_for_good_ = false;
  bool rights_told_ = false;
  std::size_t faults_told_ = 0;
  double next_progress_s_ = 0;
  std::size_t recorder_failures_ = 0;                 // told so far
  std::uint64_t vision_does_not_keep_ = 0;            // likewise
  std::uint64_t recorded_ = 0, ticks_at_record_ = 0;  // when a sample last came
  double recorded_s_ = 0;
  RunResult result_;
  const nlohmann::ordered_json begun_facts_ = provenance(scene_);
};

int Run::run() {
  terminal_.say("{}: {} ({} Hz, {} clock, seed {})", printable(scene_.name),
                printable(scene_.title.empty() ? scene_.source : scene_.title, 200), scene_.servo.rate_Hz,
                scene_.clock == ClockKind::real ? "real" : "virtual", scene_.sim ? scene_.sim->seed : 0);
  terminal_.say("report: {}{}", folder_,
                report_folder_.replaces.empty()
                    ? ""
                    : fmt::format(" (takes the place of {} once it is whole)", report_folder_.replaces));
  if (!report_folder_.note.empty()) {
    terminal_.say("{}", report_folder_.note);
  }
  if (scene_.clock == ClockKind::real) {
    terminal_.say("station: {}", segments_.station);
  }
  (void)write_begun(folder_, begun_facts_);

  if (settings_.record) {
    if (auto started = start_recording(); !started) {
      return refuse(started.error());
    }
  }
  if (scene_.vision) {
    if (auto started = vision_.start(); !started) {
      return refuse(started.error());
    }
    if (!vision_has_its_camera()) {
      return leave_nothing();
    }
    if (stop_signal::count() > 0) {
      terminal_.complain("stopped before the core had started");
      (void)leave_nothing();
      return exit_not_done;
    }
  }
  if (scene_.watchdog) {  // not before: nobody feeds it while a camera is opened, which takes its time
    if (auto armed = watchdog_.arm(*scene_.watchdog); !armed) {
      return refuse(armed.error());
    }
  }
  const HandedSegments handed = for_core(segments_);
  if (auto started = core_.start(core_arguments(scene_, resolved_, handed), folder_ + "/core.log",
                                 inherited(handed, resolved_));
      !started) {
    return refuse(started.error());
  }
  if (settings_.console) {
    if (auto started = console_.start(); !started) {
      terminal_.complain(started.error());
    }
  }
  const Ended core = watch_until_the_core_ends();
  watchdog_.disarm();
  service_manager_.stopping();
  if (witness_) {
    result_.late = witness_->end();
  }
  recorder_.finish();
  tell_faults();
  terminal_.clear_progress();
  if (core.exited && core.code == exit_bad_input) {  // it has not begun
    return refuse(fmt::format("punctum-core: {}", last_line(core_.log())));
  }
  judge_end(core);
  if (segments_.bench) {
    (*segments_.bench)->finished.store(1);  // a camera that still waits for the plant ends
  }
  vision_.end();
  note_recording(record_.end());
  console_.end();
  tell_what_is_not_kept();
  return report();
}

// It has not begun: nothing has moved, and there is nothing to keep.
int Run::refuse(const std::string& why) {
  terminal_.complain(why);
  return leave_nothing();
}

int Run::leave_nothing() {
  vision_.end(true);
  record_.abandon();
  reserve_.give_back();
  discard(report_folder_);
  return exit_bad_input;
}

// Waits for vision to open camera and files; false: it refused one of them. One that dies or hangs keeps no
// core from starting.
bool Run::vision_has_its_camera() {
  while ((*segments_.observation)->rounds.load(std::memory_order_relaxed) == 0 && stop_signal::count() == 0) {
    switch (vision_.watch(now_s(), 0)) {
      case VisionProcess::News::refused:
        return false;
      case VisionProcess::News::none:
        break;
      case VisionProcess::News::frames_ended:
      case VisionProcess::News::given_up:
        return true;
    }
    if (!vision_.restarts().empty()) {
      return true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

Ended Run::watch_until_the_core_ends() {
  for (Ended ended;;) {
    const std::uint64_t taken = recorder_.drain(may_take());
    if (core_.ended(ended)) {
      return ended;
    }
    if (const auto pid = static_cast<int>(status().pid.load());
        pid != 0 && !witness_ && scene_.clock == ClockKind::real) {
      witness_.emplace(status(), pid, pid, false);
    }
    if (witness_) {
      witness_->look();
    }
    segments_.rendezvous.serve();
    watchdog_.feed(status().ticks.load(), now_s());
    service_manager_.ticks(status().ticks.load(), now_s());
    watch_vision();
    console_.watch();
    note_recording(record_.watch());
    watch_recording();
    core_.watch(now_s(), stop_signal::count());
    tell_what_is_not_kept();
    tell_progress();
    if (taken < kBusyRound) {
      std::this_thread::sleep_for(std::chrono::microseconds(scene_.clock == ClockKind::real ? 2000 : 100));
    }
  }
}

tl::expected<void, std::string> Run::start_recording() {
  auto added = record_.add(kCoreSegment, segments_.core.segment());
  if (added && segments_.observation) {
    added = record_.add(kObservationSegment, segments_.observation->segment());
  }
  if (added && segments_.bench) {
    added = record_.add(kBenchSegment, segments_.bench->segment());
  }
  if (added) {
    added = record_.add(kInputSegment, segments_.inputs->segment());
  }
  if (added && segments_.pictures) {
    added = record_.add(kPictureSegment, segments_.pictures->segment());
  }
  if (added) {
    added = record_.tell_progress(segments_.station);
  }
  return added ? record_.start(segments_.station, resolved_, folder_) : added;
}

// In virtual time the core waits for the recorder, and the recorder for the recording, unless that was waited
// for in vain.
std::uint64_t Run::may_take() const {
  const bool waits = scene_.clock == ClockKind::virtual_time && record_.is_running() &&
                     (*segments_.bench)->recorder_gave_up.load() == 0;
  return waits ? record_.taken() : UINT64_MAX;
}

void Run::note_recording(const std::string& why) {
  if (!why.empty()) {
    terminal_.complain(fmt::format("{} is not whole: {}", RecordProcess::kFile, why));
    const double told_s = static_cast<double>(record_.whole_until()) / scene_.servo.rate_Hz;
    result_.not_kept.push_back({RecordProcess::kFile, std::min(told_s, recorder_.measures().last_s), why});
  }
}

void Run::watch_vision() {
  if (!scene_.vision) {
    return;
  }
  const double run_s = recorder_.measures().last_s;
  switch (vision_.watch(now_s(), run_s)) {
    case VisionProcess::News::none:
      break;
    case VisionProcess::News::frames_ended:
      if (scene_.recorded) {
        terminal_.say("{:8.3f} s  the recorded frames have ended", run_s);
        core_.ask(rt::Command::end);
        frames_are_over_ = true;
      }
      break;
    case VisionProcess::News::given_up:
      if (segments_.bench) {
        (*segments_.camera)->pid.store(0);  // virtual time waits for it no longer
      }
      break;
    case VisionProcess::News::refused:
      stop_signal::request();
      break;
  }
  // A core that has stopped waits for a reset, and for no end. Without pictures there is nothing to go on
  // for.
  if (frames_are_over_ && !stop_for_good_ && status().fault.load() != 0) {
    stop_for_good_ = true;
    core_.ask(rt::Command::stop);
  }
}

// At once: whoever stands at the station may still make room, or end the run.
void Run::tell_what_is_not_kept() {
  const auto tell = [this](const NotKept& n) {
    terminal_.complain(
        fmt::format("{:.3f} s: {} is not kept from here on: {}; the run goes on", n.t_s, n.file, n.why));
    result_.not_kept.push_back(n);
  };
  const std::vector<NotKept>& failures = recorder_.not_kept();
  for (; recorder_failures_ < failures.size(); ++recorder_failures_) {
    tell(failures[recorder_failures_]);
  }
  if (!segments_.observation) {
    return;
  }
  const std::uint64_t now = (*segments_.observation)->not_kept.load() & ~vision_does_not_keep_;
  for (const auto& [what, file] : {std::pair{rt::ObservationSegment::observations, "obs.csv"},
                                   {rt::ObservationSegment::frames, "frames"}}) {
    if ((now & what) != 0) {
      tell({file, recorder_.measures().last_s, "vision could not write it"});
    }
  }
  vision_does_not_keep_ |= now;
}

// As each is latched: what it means and what to do.
void Run::tell_faults() {
  for (const auto& faults = recorder_.measures().faults; faults_told_ < faults.size(); ++faults_told_) {
    const Measures::Fault& f = faults[faults_told_];
    terminal_.say("{}", fault_text(f.fault, f.t_s, terminal_.coloured()));
  }
}

// Samples that stop coming although the core ticks: the recording would end without a word.
void Run::watch_recording() {
  const std::uint64_t recorded = recorder_.measures().ticks;
  const std::uint64_t ticks = status().ticks.load();
  if (recorded != recorded_ || ticks == ticks_at_record_ || recorder_.position() >= may_take()) {
    recorded_ = recorded;
    ticks_at_record_ = ticks;
    recorded_s_ = now_s();
  } else if (!result_.silent_from_s && now_s() > recorded_s_ + kSilent_s) {
    result_.silent_from_s = recorder_.measures().last_s;
    terminal_.complain(
        fmt::format("the core ticks, but none of its samples could be read for {:.0f} s: the recording "
                    "has a gap from "
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
        terminal_.say("{}", painted(Colour::warning, text, terminal_.coloured()));
      }
    }
  }
  tell_faults();
  if (settings_.quiet || now_s() < next_progress_s_) {
    return;
  }
  next_progress_s_ = now_s() + terminal_.progress_every_s();
  const Measures& m = recorder_.measures();
  if (m.ticks > 0) {
    terminal_.progress(progress_line(scene_, m, core, terminal_.line_style()));
  }
}

void Run::judge_end(const Ended& core) {
  const RunFacts facts{
      .core_exited = core.exited,
      .stop_was_asked = core_.stop_was_asked(),
      .vision_over = vision_.over(),
      .has_task = scene_.has_task(),
      .has_vision = scene_.vision.has_value(),
      .found_nothing = !scene_.has_task() && read_pictures(folder_ + "/obs.csv").show_nothing(),
      .samples_lost = recorder_.lost() > 0};
  result_.end = judge(facts, status(), recorder_.measures());
  result_.wall_s = now_s();
  if (result_.end == rt::RunEnd::fault) {
    const auto fault = fault_in(status().fault.load());
    result_.detail = fault ? rt::name(*fault) : "unknown";
  }
  const Measures& m = recorder_.measures();
  if (result_.end == rt::RunEnd::after_fault && !m.faults.empty()) {
    result_.detail = fmt::format("{} at {:.3f} s", rt::name(m.faults.front().fault), m.faults.front().t_s);
  }
  if (result_.end == rt::RunEnd::underdosed) {
    result_.detail = fmt::format("{:.2f} s of {:.2f} s asked", m.injected_s, m.asked_s);
  }
  if (result_.end == rt::RunEnd::core_died) {
    result_.detail = core.text();
    terminal_.complain(
        fmt::format("the control core {} at {:.3f} s", core.text(), recorder_.measures().last_s));
    recorder_.keep_last_seconds();
    let_devices_come_to_rest();
  }
  // While its devices are shut down, or left to themselves, the plant goes on.
  sim::Snapshot newest;
  const bool simulated = segments_.bench && sim::newest_valid(**segments_.bench, newest);
  result_.needle = recorder_.measures().whereabouts(simulated ? &newest : nullptr);
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
      "the devices without it: relay opened {}, stage at rest {} ({:.1f} um further), injector gate shut "
      "{}, "
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
  const PicturesSeen pictures = read_pictures(folder_ + "/obs.csv");
  reserve_.give_back();
  const auto facts = [&] {
    return whole_facts(begun_facts_,
                       report_facts(scene_, result_, m, recorder_.events(), status(), pictures));
  };
  auto written = write_report_json(folder_, facts());
  if (auto page = write_report_page(folder_, facts(), settings_.figure); !page) {
    terminal_.complain(page.error());
    result_.not_kept.push_back({"report.html", m.last_s, page.error()});
    written = write_report_json(folder_, facts());  // it tells that, too
  }
  if (!written) {
    terminal_.complain(written.error());
  }
  std::string folder = folder_;
  if (written && !report_folder_.replaces.empty()) {
    if (auto moved = take_place(report_folder_)) {
      folder = *moved;
    } else {
      terminal_.complain(moved.error());
      written = tl::unexpected(moved.error());
    }
  }
  const std::string places = written ? fmt::format("report          {}/report.html\n", folder) : "";
  terminal_.print("\n" + summary(scene_, result_, m, status(), pictures, terminal_.coloured()) + places);
  const bool complete =
      written && result_.not_kept.empty() && recorder_.unusable() == 0 && !result_.silent_from_s;
  const ExitCode code = exit_code(result_.end);
  return code == exit_done && !(complete && result_.vision_restarts.empty()) ? exit_not_done : code;
}

}  // namespace

int run_scene(const Scene& scene, const RunSettings& settings) {
  // Before anything exists that an end would leave behind.
  stop_signal::watch({SIGINT, SIGTERM, SIGHUP, SIGQUIT});
  signal(SIGPIPE, SIG_IGN);
  // The needle would go on without anybody who writes down what it does, or takes the stop.
  for (const int suspends : {SIGTSTP, SIGTTIN, SIGTTOU}) {
    signal(suspends, SIG_IGN);
  }
  Terminal terminal;
  const auto refuse = [&terminal](const std::string& why) {
    terminal.complain(why);
    return exit_bad_input;
  };
  if (settings.console && find_program(kConsoleProgram).empty()) {
    return refuse(
        fmt::format("--console: {} is not there, neither beside this program nor in PATH", kConsoleProgram));
  }
  if (settings.pictures && (!settings.record || !has_pictures(scene))) {
    return refuse(settings.record ? "--pictures: vision looks at none in this scene"
                                  : "--pictures: goes into the recording, which --record asks for");
  }
  const auto report = prepare_report_folder(scene, settings.report, settings.overwrite);
  if (!report) {
    return refuse(report.error());
  }
  const std::string& folder = report->folder;
  const auto refuse_and_leave_nothing = [&](const std::string& why) {
    discard(*report);
    return refuse(why);
  };
  const std::uint64_t every = rows_every(scene, settings);
  const ExpectedRecording expected{.seconds = scene.seconds > 0 ? scene.seconds : kOpenEnded_s,
                                   .rows_every = every,
                                   .frames = settings.frames && !is_long(scene),
                                   .every_tick = settings.record,
                                   .pictures = settings.pictures};
  const auto space = look_for_space(folder, bytes_written(scene, expected));
  if (!space) {
    return refuse_and_leave_nothing(space.error());
  }
  if (!space->empty()) {
    terminal.complain(*space);
  }
  if (scene.vision && settings.frames && is_long(scene)) {
    terminal.say("a run that may be longer than {:.0f} min keeps no annotated frames", kLongRun_s / 60);
  }
  if (const std::string& warning = report->lock.not_held(); !warning.empty()) {
    terminal.complain(warning);
  }
  const std::string text = to_toml(scene);
  if (auto written = write_whole(folder + "/scene.toml", text); !written) {
    return refuse_and_leave_nothing(written.error());
  }
  SpaceReserve reserve(folder);
  const auto resolved = hal::seal_text("scene", text);
  if (!resolved) {
    return refuse_and_leave_nothing(resolved.error());
  }
  auto segments = create_segments(scene, settings);
  if (!segments) {
    return refuse_and_leave_nothing(segments.error());
  }
  segments->rendezvous.offer(kSceneText, hal::Descriptor(fcntl(resolved->number(), F_DUPFD_CLOEXEC, 0)));
  auto recorder = Recorder::create(folder, scene, *segments->core,
                                   segments->bench ? segments->bench->get() : nullptr, every);
  if (!recorder) {
    return refuse_and_leave_nothing(recorder.error());
  }
  recorder->keep_room(room_for_samples(folder, scene, expected));
  if (stop_signal::count() > 0) {
    terminal.complain("stopped before anything was started");
    reserve.give_back();
    discard(*report);
    return exit_not_done;
  }
  Run run(scene, *resolved, settings, *report, *segments, *recorder, reserve, terminal);
  return run.run();
}

}  // namespace punctum::tools
