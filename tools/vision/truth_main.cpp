// punctum-vision of a build without OpenCV: it observes the truth of the simulated world and draws no
// picture. Enough for runs with vision.method = "truth".
#include <signal.h>

#include <atomic>
#include <exception>
#include <optional>
#include <string>
#include <string_view>

#include "hal/ipc/segment.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/camera/sim_camera.hpp"
#include "hal/sim/virtual_clock.hpp"
#include "rt/station/station.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/truth_observer.hpp"
#include "tools/shared/version.hpp"
#include "tools/shared/vision_lies.hpp"

namespace {

using namespace punctum;
namespace stop_signal = tools::stop_signal;

constexpr std::int64_t kFrameTimeout_ns = 100'000'000;

std::atomic<sim::BenchClock*> waiting_clock{nullptr};
static_assert(std::atomic<sim::BenchClock*>::is_always_lock_free);

void on_stop_signal(int) noexcept {
  if (sim::BenchClock* clock = waiting_clock.load()) {
    clock->stop_waiting();
  }
}

int bad(const std::string& text) {
  tools::complain("punctum-vision: " + text);
  return tools::exit_bad_input;
}

// The value of an option; of the others that `punctum run` gives there is no use here.
std::string option(int argc, char** argv, std::string_view name) {
  for (int i = 2; i + 1 < argc; i += 2) {
    if (argv[i] == name) {
      return argv[i + 1];
    }
  }
  return {};
}

int observe(sim::SimCamera& camera, sim::BenchClock& clock, const sim::Bench& bench,
            rt::ObservationSegment& station, tools::VisionLiar liar) {
  std::optional<sim::Truth> truth_before;
  while (stop_signal::count() == 0) {
    station.rounds.store(station.rounds.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    hal::Frame frame;
    const hal::Status status = camera.next(frame, kFrameTimeout_ns);
    if (status == hal::Status::disconnected) {
      return bench.finished.load() != 0 ? tools::exit_done : tools::exit_not_done;
    }
    if (status == hal::Status::no_data) {
      continue;
    }
    if (status == hal::Status::ok) {
      const auto told = liar.tell(camera.snapshot(), tools::observe_truth(camera.truth(), frame.sequence,
                                                                          frame.exposure_ns, truth_before));
      truth_before = camera.truth();
      if (frame.deliver_ns > 0) {
        clock.sleep_until_ns(frame.deliver_ns);
      }
      if (told) {
        station.slot.push(*told);
      }
    }
    camera.release(frame);
  }
  return bench.finished.load() != 0 ? tools::exit_done : tools::exit_not_done;
}

int run(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--version") {
    tools::say(tools::version_line("punctum-vision") + "\n");
    return tools::code_after_words(tools::exit_done);
  }
  if (argc == 2 && (std::string_view(argv[1]) == "--help" || std::string_view(argv[1]) == "-h")) {
    tools::say(
        "Vision of a build without OpenCV: observes the truth of the simulated world.\n"
        "Usage: punctum-vision live --scene FILE --segments NAME=DESCRIPTOR,...\n\n"
        "Examples:\n  punctum run icsi --set vision.method=truth\n      starts this program as it should "
        "be\n\n"
        "Exit codes:\n  0  the run has ended\n  1  the camera was lost\n  2  bad input\n");
    return tools::exit_done;
  }
  if (argc < 2 || std::string_view(argv[1]) != "live") {
    return bad("this build has no OpenCV, allowed: live --scene FILE --segments NAME=DESCRIPTOR,...");
  }
  const auto scene = tools::load_scene(option(argc, argv, "--scene"));
  if (!scene) {
    return bad(scene.error());
  }
  if (!scene->vision || scene->vision->method != vision::Method::truth || !scene->simulated_camera()) {
    return bad("this build has no OpenCV, allowed: a simulated camera and vision.method = \"truth\"");
  }
  stop_signal::watch({SIGTERM, SIGINT, SIGHUP, SIGQUIT}, on_stop_signal);
  const auto segments = tools::HandedSegments::parse(option(argc, argv, "--segments"));
  if (!segments) {
    return bad(segments.error());
  }
  auto observations = hal::Shared<rt::ObservationSegment>::claim(
      tools::kObservationSegment, segments->descriptor(tools::kObservationSegment));
  if (!observations) {
    return bad(observations.error());
  }
  if (!stop_signal::watch_parent((*observations)->header.owner_pid)) {
    return bad("the program that started it has died");
  }
  auto bench =
      hal::Shared<const sim::Bench>::attach(tools::kBenchSegment, segments->descriptor(tools::kBenchSegment));
  if (!bench) {
    return bad(bench.error());
  }
  auto answers = hal::Shared<sim::CameraAnswers>::attach(tools::kCameraSegment,
                                                         segments->descriptor(tools::kCameraSegment));
  if (!answers) {
    return bad(answers.error());
  }
  sim::BenchClock clock(**bench);
  waiting_clock = &clock;
  sim::SimCamera camera(*scene->sim, **bench, **answers, sim::SimCamera::Picture::none);
  const int code = observe(camera, clock, **bench, **observations, tools::VisionLiar(scene->sim->seed));
  waiting_clock = nullptr;
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  tools::start_program();
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    return bad(e.what());
  }
}
