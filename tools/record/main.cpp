// punctum-record: writes what a station tells into an MCAP file.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <exception>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/segment.hpp"
#include "tools/record/station_recorder.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/record_progress.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/version.hpp"

namespace {

using namespace punctum;
using namespace punctum::tools;

struct Options {
  std::string station, segments, scene, out;
};

// The segments of a station, mapped for reading.
struct Mapped {
  std::optional<hal::Joined> joined;  // holds the descriptors
  std::string scene;                  // path
  std::optional<hal::Shared<const rt::CoreSegment>> core;
  std::optional<hal::Shared<const rt::ObservationSegment>> observation;
  std::optional<hal::Shared<const sim::Bench>> bench;
  std::optional<hal::Shared<const rt::InputSegment>> inputs;
  std::optional<hal::Shared<const rt::PictureSegment>> pictures;
  std::optional<hal::Shared<RecordProgress>> progress;  // for writing; none: nobody waits for this recorder
};

template <class T>
tl::expected<void, std::string> map(const char* name, int descriptor,
                                    std::optional<hal::Shared<const T>>& into) {
  if (descriptor < 0) {
    return {};
  }
  auto segment = hal::Shared<const T>::attach(name, descriptor);
  if (!segment) {
    return tl::unexpected(segment.error());
  }
  into = std::move(*segment);
  return {};
}

tl::expected<Mapped, std::string> map_station(const Options& options) {
  Mapped m;
  HandedSegments handed;
  if (options.segments.empty()) {
    auto joined = hal::Joined::join(options.station);
    if (!joined) {
      return tl::unexpected(joined.error());
    }
    m.joined = std::move(*joined);
  } else {
    auto parsed = HandedSegments::parse(options.segments);
    if (!parsed) {
      return tl::unexpected("--segments: " + parsed.error());
    }
    handed = std::move(*parsed);
  }
  const auto descriptor = [&](const char* name) {
    return m.joined ? m.joined->descriptor(name) : handed.descriptor(name);
  };
  const int scene = descriptor(kSceneText);
  if (scene < 0) {
    return tl::unexpected("the station " + options.station + " does not tell its scene");
  }
  m.scene = fmt::format("/proc/self/fd/{}", scene);
  if (descriptor(kCoreSegment) < 0) {
    return tl::unexpected("the station " + options.station + " has no segment of a core");
  }
  auto mapped = map(kCoreSegment, descriptor(kCoreSegment), m.core);
  if (mapped) {
    mapped = map(kObservationSegment, descriptor(kObservationSegment), m.observation);
  }
  if (mapped) {
    mapped = map(kBenchSegment, descriptor(kBenchSegment), m.bench);
  }
  if (mapped) {
    mapped = map(kInputSegment, descriptor(kInputSegment), m.inputs);
  }
  if (mapped) {
    mapped = map(kPictureSegment, descriptor(kPictureSegment), m.pictures);
  }
  if (mapped && handed.descriptor(kProgressSegment) >= 0) {
    auto progress = hal::Shared<RecordProgress>::claim(kProgressSegment, handed.descriptor(kProgressSegment));
    if (!progress) {
      return tl::unexpected(progress.error());
    }
    m.progress = std::move(*progress);
  }
  if (!mapped) {
    return tl::unexpected(mapped.error());
  }
  return m;
}

bool is_gone(std::uint64_t pid) {
  return pid != 0 && pid < (1U << 30U) && ::kill(static_cast<pid_t>(pid), 0) != 0 && errno == ESRCH;
}

// Whether to go on: a core whose parent has died, as this program's has, stops by itself, and how it does so
// is a part of the run.
class GoOn {
 public:
  [[nodiscard]] bool operator()() {
    constexpr std::chrono::seconds kStops{5};
    const int asked = stop_signal::count();
    if (asked == 0) {
      return true;
    }
    if (!stop_signal::parent_has_died() || asked > 1) {
      return false;
    }
    const auto now = std::chrono::steady_clock::now();
    until_ = std::min(until_, now + kStops);
    return now < until_;
  }

 private:
  std::chrono::steady_clock::time_point until_ = std::chrono::steady_clock::time_point::max();
};

// Until the core has ended or died, somebody says stop, or nothing can be written any more.
void record(StationRecorder& recorder, const rt::CoreStatus& core, ClockKind clock,
            RecordProgress* progress) {
  constexpr std::chrono::milliseconds kBetweenRounds{2}, kBetweenLooks{200};
  constexpr std::uint64_t kBusyRound = 64;
  GoOn go_on;
  for (auto next_look = std::chrono::steady_clock::now(); go_on() && !recorder.core_has_ended();) {
    const std::uint64_t from = recorder.position();
    const std::uint64_t taken = recorder.drain();
    if (progress != nullptr) {
      if (recorder.loss().telemetry() > 0 && progress->lost_from.load(std::memory_order_relaxed) == 0) {
        progress->lost_from.store(from + 1, std::memory_order_release);
      }
      progress->taken.store(recorder.position(), std::memory_order_release);
    }
    if (!recorder.failure().empty()) {
      return;
    }
    if (const auto now = std::chrono::steady_clock::now(); now >= next_look) {
      next_look = now + kBetweenLooks;
      if (is_gone(core.pid.load(std::memory_order_relaxed))) {
        return;
      }
    }
    if (taken < kBusyRound) {
      std::this_thread::sleep_for(clock == ClockKind::real ? std::chrono::microseconds(kBetweenRounds)
                                                           : std::chrono::microseconds(100));
    }
  }
}

std::string summary(const std::string& file, const StationRecorder& r) {
  std::string text = fmt::format("{}: {} ticks, {} observations, {} events, {:.1f} MB\n", file,
                                 r.count(Stream::telemetry), r.count(Stream::observation),
                                 r.count(Stream::event), static_cast<double>(r.bytes()) * 1e-6);
  for (const auto& [from_s, what] :
       {std::pair{r.ticks_from_s(), "ticks"}, {r.observations_from_s(), "observations"}}) {
    if (from_s) {
      text += fmt::format("{} from {:.3f} s of the run on: the recorder came later than those before\n", what,
                          *from_s);
    }
  }
  const v1::Loss lost = r.loss();
  std::vector<std::string> overwritten;
  for (const auto& [n, what] : {std::pair{lost.telemetry(), "ticks"},
                                {lost.truth(), "states of the simulated world"},
                                {lost.observations(), "observations"},
                                {lost.surfaces(), "surfaces"},
                                {lost.events(), "events"},
                                {lost.inputs(), "inputs of ticks"},
                                {lost.pictures(), "pictures"}}) {
    if (n > 0) {
      overwritten.push_back(fmt::format("{} {}", n, what));
    }
  }
  if (lost.unusable() > 0) {
    text += fmt::format("lost: {} samples named what does not exist\n", lost.unusable());
  }
  if (!overwritten.empty()) {
    text += fmt::format("lost, overwritten before they were read: {}\n", fmt::join(overwritten, ", "));
  }
  return text;
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app{"Records a running station into an MCAP file: telemetry, what vision found, events, status.",
               "punctum-record"};
  set_help_style(app);
  app.set_version_flag("--version", version_line("punctum-record"), "version and commit");
  app.footer(help_footer(
      {{"punctum run icsi --record", "the whole run, into recording.mcap of its report"},
       {"punctum-record --station icsi-4711 --out moment.mcap",
        "a station that runs, from some seconds ago until Ctrl-C"},
       {"punctum-export moment.mcap --csv tables", "what was recorded, as tables"}},
      {{exit_done, "all that the station told since the times that are said is in the file"},
       {exit_not_done, "something is not: it was overwritten before it was read, or the disk was full"},
       {exit_bad_input, "bad input, or no such station"}}));
  app.add_option("--station", options.station, "its name, as `punctum run` says it")->type_name("NAME");
  app.add_option("--segments", options.segments,
                 "inherited segments of the station (`punctum run --record` starts this)")
      ->type_name("NAME=DESCRIPTOR,...");
  app.add_option("--out", options.out, "the recording; refused where there is one")
      ->required()
      ->type_name("FILE.mcap");
  if (const auto code = parse_command_line(app, argc, argv)) {
    return *code;
  }
  const auto refuse = [](const std::string& why) {
    complain("punctum-record: " + why);
    return exit_bad_input;
  };
  if (options.station.empty() && options.segments.empty()) {
    return refuse("which station? Allowed: --station NAME");
  }
  stop_signal::watch({SIGINT, SIGTERM, SIGHUP, SIGQUIT});
  signal(SIGPIPE, SIG_IGN);
  const auto mapped = map_station(options);
  if (!mapped) {
    return refuse(mapped.error());
  }
  if (!options.segments.empty()) {
    (void)stop_signal::watch_parent((*mapped->core)->header.owner_pid);
  }
  std::ifstream file(mapped->scene);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto scene = parse_scene(text, "the scene of the station");
  if (!scene) {
    return refuse(scene.error());
  }
  const RecordedStation recorded{.name = options.station,
                                 .scene = text,
                                 .core = **mapped->core,
                                 .observation = mapped->observation ? mapped->observation->get() : nullptr,
                                 .bench = mapped->bench ? mapped->bench->get() : nullptr,
                                 .inputs = mapped->inputs ? mapped->inputs->get() : nullptr,
                                 .pictures = mapped->pictures ? &(*mapped->pictures)->ring : nullptr,
                                 .from_the_first_tick = !options.segments.empty()};
  auto recorder = StationRecorder::create(options.out, recorded, *scene);
  if (!recorder) {
    return refuse(recorder.error());
  }
  record(**recorder, recorded.core.status, scene->clock,
         mapped->progress ? mapped->progress->get() : nullptr);
  (*recorder)->finish();
  if (mapped->progress &&
      ((*recorder)->core_has_ended() || is_gone(recorded.core.status.pid.load(std::memory_order_relaxed)))) {
    (*mapped->progress)->ended.store(1, std::memory_order_release);
  }
  say(summary(options.out, **recorder));
  if (const std::string& failure = (*recorder)->failure(); !failure.empty()) {
    complain("punctum-record: " + options.out + ": it ends here: " + failure);
  }
  const bool whole = (*recorder)->failure().empty() && (*recorder)->lost_nothing();
  return whole ? exit_done : exit_not_done;
}

}  // namespace

int main(int argc, char** argv) {
  punctum::tools::start_program();
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    punctum::tools::complain(std::string("punctum-record: ") + e.what());
    return punctum::tools::exit_bad_input;
  }
}
