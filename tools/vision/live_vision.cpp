#include "tools/vision/live_vision.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "hal/ipc/segment.hpp"
#include "hal/recorded/modules.hpp"
#include "hal/recorded/picture.hpp"
#include "hal/recorded/recorded_camera.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/camera/sim_camera.hpp"
#include "hal/sim/virtual_clock.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/station/station.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/truth_observer.hpp"
#include "tools/shared/vision_lies.hpp"
#include "tools/vision/camera_opening.hpp"
#include "tools/vision/live_camera.hpp"
#include "tools/vision/live_stage.hpp"
#include "tools/vision/live_tracker.hpp"
#include "tools/vision/observation_csv.hpp"
#include "tools/vision/picture_file.hpp"
#include "tools/vision/picture_teller.hpp"
#include "tools/vision/truth_comparison.hpp"
#include "vision/overlay.hpp"

namespace punctum::tools {

namespace {

constexpr std::int64_t kFrameTimeout_ns = 100'000'000;
constexpr std::int64_t kLookAtCore_ns = 1'000'000;
// A camera that is unplugged is looked for so often; to plug one in takes a person longer.
constexpr std::int64_t kLookAgain_ns = 500'000'000;

using Opened = tl::expected<void, std::string>;  // the error is one line

std::atomic<sim::BenchClock*> waiting_clock{nullptr};
static_assert(std::atomic<sim::BenchClock*>::is_always_lock_free);

void on_stop_signal(int) noexcept {
  if (sim::BenchClock* clock = waiting_clock.load()) {
    clock->stop_waiting();
  }
}

// On another processor and behind the control core, where that is allowed.
void yield_to_core(const Scene& scene) {
  if (scene.vision_nice > 0) {
    (void)setpriority(PRIO_PROCESS, 0, scene.vision_nice);
  }
  if (scene.vision_cpu >= 0 && scene.vision_cpu < CPU_SETSIZE) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(scene.vision_cpu), &set);
    (void)sched_setaffinity(0, sizeof set, &set);
  }
}

// One vision process: the camera of a scene, what is made of its frames, and who gets it. Set up once, part
// by part; then one round per frame.
class LiveVision {
 public:
  explicit LiveVision(const LiveOptions& options) : options_(options) {}
  ~LiveVision() { waiting_clock = nullptr; }
  LiveVision(const LiveVision&) = delete;
  LiveVision& operator=(const LiveVision&) = delete;

  [[nodiscard]] Opened open();
  [[nodiscard]] ExitCode run();
  [[nodiscard]] bool opens_still() const { return opens_still_; }

 private:
  struct Seen {
    const vision::Result* result = nullptr;  // null: nobody looked at a picture
    rt::Observation observation;
    std::optional<rt::CellSurface> surface;  // where the scene asks for it
    TruthError error;
    std::optional<cv::Mat> picture;  // to be annotated
    double t_s = 0;                  // of the exposure, in the run
  };

  [[nodiscard]] Opened read_scene();
  [[nodiscard]] Opened join_station();
  [[nodiscard]] Opened join_bench(int descriptor);
  [[nodiscard]] Opened open_camera();
  [[nodiscard]] Opened open_live_camera();
  [[nodiscard]] Opened begin_tracker();
  [[nodiscard]] Opened open_files();

  [[nodiscard]] hal::Clock& clock() {
    return bench_clock_ ? static_cast<hal::Clock&>(*bench_clock_) : monotonic_;
  }
  [[nodiscard]] hal::Camera& camera() {
    return sim_camera_ ? static_cast<hal::Camera&>(*sim_camera_)
           : live_     ? static_cast<hal::Camera&>(*live_)
                       : static_cast<hal::Camera&>(*recorded_);
  }
  [[nodiscard]] bool plant_has_stopped() const { return bench_ && (*bench_)->finished.load() != 0; }
  void wait_for_core();
  void go_round();
  void wait_until(std::int64_t t_ns);
  void look_for_camera();
  void tell_silence(hal::Status status);
  [[nodiscard]] double time_to_play(hal::Frame& frame);
  void tell_unusable(const hal::Frame& frame, double t_s);
  [[nodiscard]] std::optional<vision::Point> stage_at(std::int64_t exposure_ns) const;
  [[nodiscard]] Seen look_at(const hal::Frame& frame);
  void publish(const hal::Frame& frame, const Seen& seen);
  void record(const hal::Frame& frame, const Seen& seen);
  void go_on_without(rt::ObservationSegment::NotKept what, const std::string& why);

  const LiveOptions& options_;
  std::optional<Scene> scene_;
  bool simulated_ = false;   // the camera
  bool truth_only_ = false;  // no picture is drawn or looked at
  std::optional<hal::Shared<rt::ObservationSegment>> station_;
  std::optional<hal::Shared<const rt::CoreSegment>>
      core_;  // moves what a camera sees; begins what is recorded
  std::optional<PictureTeller> pictures_;
  std::optional<hal::Shared<const sim::Bench>> bench_;
  std::optional<hal::Shared<sim::CameraAnswers>> answers_;
  rt::MonotonicClock monotonic_;
  std::optional<sim::BenchClock> bench_clock_;
  std::optional<sim::SimCamera> sim_camera_;
  std::optional<recorded::Camera> recorded_;
  std::shared_ptr<hal::LiveCamera> live_;
  bool opens_still_ = false;  // the camera, on a thread that uses this object
  std::int64_t last_picture_ns_ = 0;
  bool silent_ = false;                                   // and said to be
  std::optional<sim::ExposureTaker> in_place_of_camera_;  // so that virtual time knows vision is there
  int width_ = 0, height_ = 0;
  std::int64_t began_ns_ = 0;

  std::optional<LiveTracker> tracker_;
  std::optional<TruthComparison> comparison_;
  std::optional<VisionLiar> liar_;
  std::optional<sim::Truth> truth_before_;
  rt::Phase phase_before_ = rt::Phase::free;

  std::optional<ObservationCsv> csv_;
  bool overlays_ = false;
};

Opened LiveVision::open() {
  for (const auto step : {&LiveVision::read_scene, &LiveVision::join_station, &LiveVision::open_camera,
                          &LiveVision::begin_tracker, &LiveVision::open_files}) {
    if (auto opened = (this->*step)(); !opened) {
      return opened;
    }
  }
  began_ns_ = last_picture_ns_ = clock().now_ns();
  return {};
}

Opened LiveVision::read_scene() {
  auto scene = load_scene(options_.scene);
  if (!scene) {
    return tl::unexpected(scene.error());
  }
  scene_ = std::move(*scene);
  if (!scene_->vision) {
    return tl::unexpected(fmt::format("{}: it has no [vision]", options_.scene));
  }
  simulated_ = scene_->simulated_camera();
  if (!simulated_ && !scene_->recorded && !scene_->camera) {
    return tl::unexpected(fmt::format("{}: it names no camera", options_.scene));
  }
  truth_only_ = scene_->vision->method == vision::Method::truth;
  if (truth_only_ && !simulated_) {
    return tl::unexpected(std::string("vision.method = \"truth\" needs the simulated camera"));
  }
  return {};
}

Opened LiveVision::join_station() {
  const auto segments = HandedSegments::parse(options_.segments);
  if (!segments) {
    return tl::unexpected(segments.error());
  }
  stop_signal::watch({SIGTERM, SIGINT, SIGHUP, SIGQUIT}, on_stop_signal);
  yield_to_core(*scene_);
  auto observations = hal::Shared<rt::ObservationSegment>::claim(kObservationSegment,
                                                                 segments->descriptor(kObservationSegment));
  if (!observations) {
    return tl::unexpected(observations.error());
  }
  station_ = std::move(*observations);
  if (!stop_signal::watch_parent((*station_)->header.owner_pid)) {
    return tl::unexpected(std::string("the program that started vision has died"));
  }
  if (const int core = segments->descriptor(kCoreSegment);
      core >= 0 && (!scene_->devices.stage.empty() || scene_->recorded)) {
    auto attached = hal::Shared<const rt::CoreSegment>::attach(kCoreSegment, core);
    if (!attached) {
      return tl::unexpected(attached.error());
    }
    core_ = std::move(*attached);
  }
  auto pictures = PictureTeller::open(*segments, scene_->vision->pixel_m);
  if (!pictures) {
    return tl::unexpected(pictures.error());
  }
  pictures_ = std::move(*pictures);
  const int bench = segments->descriptor(kBenchSegment);
  if (!simulated_ && bench < 0) {
    return {};
  }
  auto attached = hal::Shared<const sim::Bench>::attach(kBenchSegment, bench);
  if (!attached) {
    return tl::unexpected(attached.error());
  }
  bench_ = std::move(*attached);
  auto answers =
      hal::Shared<sim::CameraAnswers>::attach(kCameraSegment, segments->descriptor(kCameraSegment));
  if (!answers) {
    return tl::unexpected(answers.error());
  }
  answers_ = std::move(*answers);
  bench_clock_.emplace(**bench_);
  waiting_clock = &*bench_clock_;
  return {};
}

Opened LiveVision::open_camera() {
  if (simulated_) {
    sim_camera_.emplace(*scene_->sim, **bench_, **answers_,
                        truth_only_ ? sim::SimCamera::Picture::none : sim::SimCamera::Picture::drawn);
    width_ = sim_camera_->width();
    height_ = sim_camera_->height();
    liar_.emplace(scene_->sim->seed);
    return {};
  }
  if (scene_->camera) {
    return open_live_camera();
  }
  auto opened = recorded::Camera::open(scene_->recorded->frames, scene_->recorded->fps);
  if (!opened) {
    return tl::unexpected(opened.error());
  }
  recorded_ = std::move(*opened);
  width_ = recorded_->width();
  height_ = recorded_->height();
  if (bench_) {
    in_place_of_camera_.emplace(**bench_, **answers_);
    in_place_of_camera_->attach();
  }
  return {};
}

Opened LiveVision::open_live_camera() {
  auto made = make_live_camera(*scene_, clock());
  if (!made) {
    return tl::unexpected(made.error());
  }
  live_ = std::move(*made);
  const auto opened = open_unless_stopped(
      live_, std::chrono::nanoseconds(kFrameTimeout_ns), [] {}, [] { return stop_signal::count() > 0; });
  opens_still_ = !opened;
  if (!opened) {
    return tl::unexpected(std::string("a signal asked it to stop while it opened the camera"));
  }
  if (!*opened) {
    return *opened;
  }
  for (const std::string& note : live_->notes()) {
    complain(note);
  }
  width_ = scene_->camera->width;
  height_ = scene_->camera->height;
  return {};
}

Opened LiveVision::begin_tracker() {
  const vision::VisionConfig& config = *scene_->vision;
  cv::Mat holder_template;
  if (config.holder && !config.holder->template_path.empty()) {
    const auto picture = recorded::read_picture(config.holder->template_path);
    if (!picture) {
      return tl::unexpected(picture.error());
    }
    holder_template =
        cv::Mat(picture->height, picture->width, CV_8U, const_cast<std::uint8_t*>(picture->pixels.data()))
            .clone();
  }
  tracker_.emplace(config, width_, height_, holder_template, clock());
  comparison_.emplace(config, width_, height_);
  return {};
}

// A run needs no table and no pictures: what cannot be written there keeps nobody from seeing.
Opened LiveVision::open_files() {
  if (!options_.out.empty()) {
    if (auto opened = ObservationCsv::open(options_.out, true, simulated_)) {
      csv_ = std::move(*opened);
    } else {
      go_on_without(rt::ObservationSegment::observations, opened.error());
    }
  }
  if (!options_.overlay.empty()) {
    std::error_code error;
    std::filesystem::create_directories(options_.overlay, error);
    overlays_ = !error;
    if (error) {
      go_on_without(rt::ObservationSegment::frames, fmt::format("{}: {}", options_.overlay, error.message()));
    } else {
      (void)recorded::load_pictures();  // it takes longer than a frame
    }
  }
  return {};
}

// Recorded pictures play from the core's first tick on.
void LiveVision::wait_for_core() {
  while (core_ && scene_->clock == ClockKind::real && (*core_)->status.started.load() == 0 &&
         stop_signal::count() == 0) {
    go_round();
    clock().sleep_until_ns(clock().now_ns() + kLookAtCore_ns);
  }
  began_ns_ = clock().now_ns();
}

ExitCode LiveVision::run() {
  if (recorded_) {
    wait_for_core();
  }
  while (stop_signal::count() == 0 && !(recorded_ && plant_has_stopped())) {
    go_round();
    hal::Frame frame;
    const hal::Status status = camera().next(frame, kFrameTimeout_ns);
    tell_silence(status);
    if (status == hal::Status::no_data) {
      continue;
    }
    if (status == hal::Status::disconnected) {
      if (recorded_ || plant_has_stopped()) {
        return exit_done;
      }
      if (live_) {
        look_for_camera();
        if (opens_still_) {
          break;
        }
        continue;
      }
      complain("the camera is gone");
      return exit_not_done;  // a restart may help
    }
    const double t_s = time_to_play(frame);
    if (status == hal::Status::fault) {
      tell_unusable(frame, t_s);
      continue;
    }
    Seen seen = look_at(frame);
    seen.t_s = t_s;
    publish(frame, seen);
    record(frame, seen);
  }
  if (live_) {
    const hal::CameraCounts& n = live_->counts();
    complain(fmt::format("the camera gave {} pictures; {} were lost, {} skipped for newer ones, {} unusable",
                         n.delivered, n.lost, n.skipped, n.unusable));
  }
  if (plant_has_stopped()) {
    return exit_done;
  }
  complain("a signal asked it to stop before the run had ended");
  return exit_not_done;
}

// Whoever watches vision sees that it does not hang.
void LiveVision::go_round() {
  hal::Word& rounds = (*station_)->rounds;
  rounds.store(rounds.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

void LiveVision::wait_until(std::int64_t t_ns) {
  const bool virtual_time = bench_ && (*bench_)->virtual_time.load() != 0;
  for (std::int64_t now_ns = clock().now_ns();
       !virtual_time && t_ns - now_ns > kFrameTimeout_ns && stop_signal::count() == 0 && !plant_has_stopped();
       now_ns = clock().now_ns()) {
    go_round();
    clock().sleep_until_ns(now_ns + kFrameTimeout_ns);
  }
  clock().sleep_until_ns(t_ns);
}

// Until it is back, or the run has ended. Meanwhile observations age, as the core expects of a lost camera.
void LiveVision::look_for_camera() {
  complain(live_->last_error() + "; looking for it");
  const std::int64_t gone_ns = clock().now_ns();
  std::string why;
  while (stop_signal::count() == 0 && !plant_has_stopped()) {
    // It closes what is left of it first. Either may take seconds, and nobody shall believe that this hangs.
    const auto opened = open_unless_stopped(
        live_, std::chrono::nanoseconds(kFrameTimeout_ns), [this] { go_round(); },
        [this] { return stop_signal::count() > 0 || plant_has_stopped(); });
    opens_still_ = !opened;
    if (!opened) {
      return;
    }
    if (*opened) {
      complain(fmt::format("the camera is back after {:.1f} s",
                           static_cast<double>(clock().now_ns() - gone_ns) * 1e-9));
      return;
    }
    if (why != opened->error()) {
      why = opened->error();
      complain(why);
    }
    wait_until(clock().now_ns() + kLookAgain_ns);
    go_round();
  }
}

// Once, when a plugged camera has given no picture for longer than the tracker bridges; and when it has one
// again.
void LiveVision::tell_silence(hal::Status status) {
  if (!live_) {
    return;
  }
  const std::int64_t now_ns = clock().now_ns();
  const std::int64_t since_ns = now_ns - last_picture_ns_;
  const auto exposure_ns = static_cast<std::int64_t>(scene_->camera->exposure_s * 1e9);
  if (status == hal::Status::ok) {
    if (silent_) {
      complain(fmt::format("the camera gives pictures again, after {:.1f} s without",
                           static_cast<double>(since_ns) * 1e-9));
    }
    silent_ = false;
    last_picture_ns_ = now_ns;
  } else if (!silent_ && since_ns > LiveTracker::kLongestGap_ns + 2 * exposure_ns) {
    silent_ = true;
    complain(fmt::format("the camera has given no {}picture for {:.1f} s",
                         status == hal::Status::fault ? "usable " : "",
                         static_cast<double>(since_ns) * 1e-9));
  }
}

// Recorded pictures are shown at their own pace. Returns when this one was taken, in seconds of the run.
double LiveVision::time_to_play(hal::Frame& frame) {
  const std::int64_t start_ns = simulated_ ? sim_camera_->snapshot().start_ns : began_ns_;
  if (recorded_) {
    frame.exposure_ns += began_ns_;
    frame.deliver_ns = 0;
    wait_until(frame.exposure_ns);
  }
  return static_cast<double>(frame.exposure_ns - start_ns) * 1e-9;
}

void LiveVision::tell_unusable(const hal::Frame& frame, double t_s) {
  if (csv_) {
    csv_->row(frame.sequence, t_s, 0,
              recorded_ ? recorded_->last_error()
              : live_   ? live_->last_error()
                        : "the camera delivered no usable picture");
  }
  camera().release(frame);
}

// In pixels, but for what the two frames are apart.
std::optional<vision::Point> LiveVision::stage_at(std::int64_t exposure_ns) const {
  const auto tip_m = core_ && !recorded_ ? stage_tip_at(**core_, exposure_ns) : std::nullopt;
  return tip_m ? std::optional<vision::Point>(*tip_m / scene_->vision->pixel_m) : std::nullopt;
}

LiveVision::Seen LiveVision::look_at(const hal::Frame& frame) {
  Seen seen;
  if (truth_only_) {
    seen.observation = observe_truth(sim_camera_->truth(), frame.sequence, frame.exposure_ns, truth_before_);
    truth_before_ = sim_camera_->truth();
    return seen;
  }
  const int restarts = tracker_->restarts();
  seen.result = &tracker_->process(frame, stage_at(frame.exposure_ns));
  if (tracker_->restarts() != restarts) {
    complain(fmt::format("frame {}: the first one for more than {:.1f} s, started anew", frame.sequence,
                         static_cast<double>(LiveTracker::kLongestGap_ns) * 1e-9));
  }
  seen.observation = vision::to_observation(*seen.result, *scene_->vision, width_, height_);
  if (scene_->vision->surface) {
    seen.surface = vision::to_surface(*seen.result, *scene_->vision, width_, height_);
  }
  if (simulated_) {
    seen.error = comparison_->compare(*seen.result, *sim_camera_);
  }
  if (overlays_ && (frame.sequence % kOverlayEvery == 0 || seen.result->phase != phase_before_)) {
    seen.picture = cv::Mat(height_, width_, CV_8U, const_cast<std::uint8_t*>(frame.pixels),
                           static_cast<std::size_t>(frame.stride))
                       .clone();
  }
  phase_before_ = seen.result->phase;
  return seen;
}

// The frame goes back to its camera.
void LiveVision::publish(const hal::Frame& frame, const Seen& seen) {
  if (frame.deliver_ns > 0) {
    wait_until(frame.deliver_ns);
  }
  if (pictures_) {
    pictures_->tell(frame, seen.result, monotonic_.now_ns());
  }
  if (seen.surface) {
    (*station_)->surface.push(*seen.surface);
  }
  const auto told = liar_ ? liar_->tell(sim_camera_->snapshot(), seen.observation)
                          : std::optional<rt::Observation>(seen.observation);
  if (told) {
    (*station_)->slot.push(*told);
  }
  camera().release(frame);
}

void LiveVision::record(const hal::Frame& frame, const Seen& seen) {
  if (seen.result == nullptr) {
    return;
  }
  if (csv_) {
    csv_->row(*seen.result, *scene_->vision, seen.t_s, cv::Point(0, 0), simulated_ ? &seen.error : nullptr);
    if (!csv_->flush()) {
      go_on_without(rt::ObservationSegment::observations,
                    fmt::format("{}: {}", options_.out, csv_->failure()));
      csv_.reset();
    }
  }
  if (seen.picture) {
    const auto written = write_picture(fmt::format("{}/{:06}.jpg", options_.overlay, frame.sequence),
                                       vision::draw_overlay(*seen.picture, *seen.result, *scene_->vision));
    if (!written) {
      go_on_without(rt::ObservationSegment::frames, written.error());
      overlays_ = false;
    }
  }
}

void LiveVision::go_on_without(rt::ObservationSegment::NotKept what, const std::string& why) {
  hal::Word& not_kept = (*station_)->not_kept;
  not_kept.store(not_kept.load(std::memory_order_relaxed) | what, std::memory_order_relaxed);
  complain(why + "; going on without it");
}

}  // namespace

int live(const LiveOptions& options) {
  LiveVision vision(options);
  const auto opened = vision.open();
  if (!opened) {
    complain(opened.error());
  }
  const ExitCode code = opened ? vision.run() : vision.opens_still() ? exit_not_done : exit_bad_input;
  if (vision.opens_still()) {
    std::_Exit(code);  // nothing is taken apart under the thread that opens the camera; all rows are written
  }
  return code;
}

}  // namespace punctum::tools
