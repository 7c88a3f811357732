#include "tools/vision/live_vision.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <vector>

#include "hal/ipc/segment.hpp"
#include "hal/recorded/picture.hpp"
#include "hal/recorded/recorded_camera.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/camera/sim_camera.hpp"
#include "hal/sim/virtual_clock.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "rt/station/station.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/truth_observer.hpp"
#include "tools/shared/vision_lies.hpp"
#include "tools/vision/observation_csv.hpp"
#include "vision/image/polyline.hpp"
#include "vision/overlay.hpp"
#include "vision/tracker.hpp"

namespace punctum::tools {

namespace {

constexpr std::int64_t kFrameTimeout_ns = 100'000'000;

std::atomic<sim::BenchClock*> waiting_clock{nullptr};
static_assert(std::atomic<sim::BenchClock*>::is_always_lock_free);

void on_stop_signal(int) noexcept {
  if (sim::BenchClock* clock = waiting_clock.load()) {
    clock->stop_waiting();
  }
}

int bad(const std::string& text) {
  fmt::print(stderr, "{}\n", text);
  return exit_bad_input;
}

// What was seen against what is so.
class TruthComparison {
 public:
  TruthComparison(const vision::VisionConfig& config, int width, int height)
      : um_(config.pixel_m * 1e6), pixel_m_(config.pixel_m), middle_((width - 1) / 2.0, (height - 1) / 2.0) {}

  [[nodiscard]] TruthError compare(const vision::Result& r, const sim::SimCamera& camera) {
    TruthError e;
    const sim::Truth& t = camera.truth();
    if (r.needle.ok) {
      const vision::Point d = r.needle.tip - pixel(t.tip_m.x(), t.tip_m.y());
      vision::Point axis(t.axis.x(), t.axis.y());
      axis *= 1 / std::max(cv::norm(axis), 1e-9);
      e.tip_um = d.dot(axis) * um_;
      e.tip_lateral_um = axis.cross(d) * um_;
    }
    if (!t.cell) {
      return e;
    }
    if (r.outer.ok && !camera.outer().empty()) {
      std::vector<double> d = distances(r.outer.contour, camera.outer());
      e.outer_rms_um = rms(d);
      e.outer_max_um = *std::max_element(d.begin(), d.end());
      const auto p95 = d.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(d.size() - 1));
      std::nth_element(d.begin(), p95, d.end());
      e.outer_p95_um = *p95;
    }
    if (r.inner.ok && !camera.inner().empty()) {
      e.inner_rms_um = rms(distances(r.inner.contour, camera.inner()));
    }
    if (r.gap_px) {
      e.gap_um = *r.gap_px * um_ - t.gap_m * 1e6;
    }
    if (r.wd_px) {
      e.wd_um = *r.wd_px * um_ - t.wd_m * 1e6;
    }
    if (r.a_px && t.wd_m > 0) {
      e.a_um = *r.a_px * um_ - t.a_m * 1e6;
    }
    return e;
  }

 private:
  [[nodiscard]] vision::Point pixel(double x_m, double y_m) const {
    return {x_m / pixel_m_ + middle_.x, y_m / pixel_m_ + middle_.y};
  }
  [[nodiscard]] std::vector<double> distances(const vision::Contour& seen,
                                              std::span<const std::array<double, 2>> truth) {
    vision::Contour contour;
    for (const auto& p : truth) {
      contour.push_back(pixel(p[0], p[1]));
    }
    const vision::Polyline line(std::move(contour), true);
    std::vector<double> d;
    d.reserve(seen.size());
    for (const vision::Point& p : seen) {
      d.push_back(line.distance(p) * um_);
    }
    return d;
  }
  [[nodiscard]] static double rms(const std::vector<double>& d) {
    double ss = 0;
    for (const double x : d) {
      ss += x * x;
    }
    return std::sqrt(ss / static_cast<double>(d.size()));
  }

  double um_, pixel_m_;
  vision::Point middle_;
};

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

}  // namespace

int live(const LiveOptions& options) {
  const auto scene = load_scene(options.scene);
  if (!scene) {
    return bad(scene.error());
  }
  if (!scene->vision) {
    return bad(fmt::format("{}: it has no [vision]", options.scene));
  }
  const vision::VisionConfig& config = *scene->vision;
  const bool simulated = !scene->recorded && scene->simulated_camera();
  if (!simulated && !scene->recorded) {
    return bad(fmt::format("{}: it names no camera", options.scene));
  }
  const auto segments = HandedSegments::parse(options.segments);
  if (!segments) {
    return bad(segments.error());
  }
  stop_signal::watch({SIGTERM, SIGINT, SIGHUP, SIGQUIT}, on_stop_signal);
  yield_to_core(*scene);

  auto observations = hal::Shared<rt::ObservationSegment>::claim(kObservationSegment,
                                                                 segments->descriptor(kObservationSegment));
  if (!observations) {
    return bad(observations.error());
  }
  if (!stop_signal::watch_parent((*observations)->header.owner_pid)) {
    return bad("the program that started vision has died");
  }
  std::optional<hal::Shared<const sim::Bench>> bench;
  std::optional<hal::Shared<sim::CameraAnswers>> answers;
  if (const int descriptor = segments->descriptor(kBenchSegment); simulated || descriptor >= 0) {
    auto attached = hal::Shared<const sim::Bench>::attach(kBenchSegment, descriptor);
    if (!attached) {
      return bad(attached.error());
    }
    bench = std::move(*attached);
    auto own = hal::Shared<sim::CameraAnswers>::attach(kCameraSegment, segments->descriptor(kCameraSegment));
    if (!own) {
      return bad(own.error());
    }
    answers = std::move(*own);
  }
  rt::MonotonicClock monotonic;
  std::optional<sim::BenchClock> bench_clock;
  if (bench) {
    bench_clock.emplace(**bench);
    waiting_clock = &*bench_clock;
  }
  hal::Clock& clock = bench_clock ? static_cast<hal::Clock&>(*bench_clock) : monotonic;

  const bool truth_only = config.method == vision::Method::truth;
  if (truth_only && !simulated) {
    return bad("vision.method = \"truth\" needs the simulated camera");
  }
  std::optional<sim::SimCamera> sim_camera;
  std::optional<recorded::Camera> recorded_camera;
  std::optional<sim::ExposureTaker> in_place_of_camera;  // so that virtual time knows vision is there
  int width = 0, height = 0;
  if (simulated) {
    sim_camera.emplace(*scene->sim, **bench, **answers,
                       truth_only ? sim::SimCamera::Picture::none : sim::SimCamera::Picture::drawn);
    width = sim_camera->width();
    height = sim_camera->height();
  } else {
    auto opened = recorded::Camera::open(scene->recorded->frames, scene->recorded->fps);
    if (!opened) {
      return bad(opened.error());
    }
    recorded_camera = std::move(*opened);
    width = recorded_camera->width();
    height = recorded_camera->height();
    if (bench) {
      in_place_of_camera.emplace(**bench, **answers);
      in_place_of_camera->attach();
    }
  }
  hal::Camera& camera =
      sim_camera ? static_cast<hal::Camera&>(*sim_camera) : static_cast<hal::Camera&>(*recorded_camera);

  vision::Tracker tracker(config, width, height);
  if (config.holder && !config.holder->template_path.empty()) {
    const auto picture = recorded::read_picture(config.holder->template_path);
    if (!picture) {
      return bad(picture.error());
    }
    tracker.holder_template(
        cv::Mat(picture->height, picture->width, CV_8U, const_cast<std::uint8_t*>(picture->pixels.data())));
  }
  std::optional<ObservationCsv> csv;
  if (!options.out.empty()) {
    auto opened = ObservationCsv::open(options.out, true, simulated);
    if (!opened) {
      return bad(opened.error());
    }
    csv = std::move(*opened);
  }
  bool overlays = !options.overlay.empty();
  if (overlays) {
    std::error_code error;
    std::filesystem::create_directories(options.overlay, error);
    overlays = !error;
  }
  TruthComparison comparison(config, width, height);
  std::optional<VisionLiar> liar;
  if (simulated) {
    liar.emplace(scene->sim->seed);
  }
  std::optional<sim::Truth> truth_before;
  rt::Phase phase_before = rt::Phase::free;
  const std::int64_t began_ns = clock.now_ns();
  ExitCode code = exit_done;

  while (stop_signal::count() == 0) {
    hal::Frame frame;
    const hal::Status status = camera.next(frame, kFrameTimeout_ns);
    if (status == hal::Status::no_data) {
      continue;
    }
    if (status == hal::Status::disconnected) {
      const bool ended = recorded_camera || (*bench)->finished.load() != 0;
      if (!ended) {
        fmt::print(stderr, "the camera is gone\n");
        code = exit_not_done;  // a restart may help
      }
      break;
    }
    const std::int64_t start_ns = simulated ? sim_camera->snapshot().start_ns : began_ns;
    if (!simulated) {  // recorded pictures are shown at their own pace
      frame.exposure_ns += began_ns;
      frame.deliver_ns = 0;
      clock.sleep_until_ns(frame.exposure_ns);
    }
    const double t_s = static_cast<double>(frame.exposure_ns - start_ns) * 1e-9;
    if (status == hal::Status::fault) {
      if (csv) {
        csv->row(frame.sequence, t_s, 0,
                 recorded_camera ? recorded_camera->last_error() : "the camera delivered no usable picture");
      }
      camera.release(frame);
      continue;
    }
    const vision::Result* seen = nullptr;
    rt::Observation observation;
    if (truth_only) {
      observation = observe_truth(sim_camera->truth(), frame.sequence, frame.exposure_ns, truth_before);
      truth_before = sim_camera->truth();
    } else {
      seen = &tracker.process(frame);
      observation = vision::to_observation(*seen, config, width, height);
    }
    TruthError error;
    if (simulated && seen != nullptr) {
      error = comparison.compare(*seen, *sim_camera);
    }
    std::optional<cv::Mat> picture;
    if (overlays && seen != nullptr && (frame.sequence % kOverlayEvery == 0 || seen->phase != phase_before)) {
      picture = cv::Mat(height, width, CV_8U, const_cast<std::uint8_t*>(frame.pixels),
                        static_cast<std::size_t>(frame.stride))
                    .clone();
    }
    if (frame.deliver_ns > 0) {
      clock.sleep_until_ns(frame.deliver_ns);
    }
    const auto told =
        liar ? liar->tell(sim_camera->snapshot(), observation) : std::optional<rt::Observation>(observation);
    if (told) {
      (*observations)->slot.push(*told);
    }
    camera.release(frame);

    if (seen == nullptr) {
      continue;
    }
    phase_before = seen->phase;
    if (csv) {
      csv->row(*seen, config, t_s, cv::Point(0, 0), simulated ? &error : nullptr);
      if (!csv->flush()) {
        fmt::print(stderr, "{}: not complete, is the disk full? Going on without it\n", options.out);
        csv.reset();
      }
    }
    if (picture) {
      bool written = false;
      try {
        written = cv::imwrite(fmt::format("{}/{:06}.png", options.overlay, frame.sequence),
                              vision::draw_overlay(*picture, *seen, config));
      } catch (const cv::Exception&) {
        written = false;
      }
      if (!written) {
        fmt::print(stderr, "{}: cannot be written; going on without overlays\n", options.overlay);
        overlays = false;
      }
    }
  }
  waiting_clock = nullptr;
  return code;
}

}  // namespace punctum::tools
