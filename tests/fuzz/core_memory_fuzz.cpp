// Any bytes in the memory of core and simulated devices, as a defective or hostile core leaves them:
// recorder, report and terminal read it in bounded time, and what they say is text.
#include <stdlib.h>

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "hal/sim/valid.hpp"
#include "hal/sim/world.hpp"
#include "tools/punctum/judge.hpp"
#include "tools/punctum/lab_report.hpp"
#include "tools/punctum/recorder.hpp"
#include "tools/punctum/run_report.hpp"
#include "tools/punctum/terminal.hpp"

namespace {

using namespace punctum;

[[noreturn]] void found(const char* what) {
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

// A station whose core has run for a while, to be spoilt and put in order again.
class Station {
 public:
  Station() {
    std::string name = (std::filesystem::temp_directory_path() / "punctum-memory-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      found("no folder for reports");
    }
    folder_ = name;
    for (std::uint64_t i = 0; i < 40; ++i) {
      rt::TelemetrySample sample;
      sample.tick = i;
      sample.t_s = 1e-3 * static_cast<double>(i);
      sim::Snapshot world;
      world.t_ns = static_cast<std::int64_t>(i) * 1'000'000;
      bench->snapshots.push(world);
      core->telemetry.push(sample);
      core->events.push({});
    }
    core->status.ticks.store(40);
  }
  ~Station() { std::filesystem::remove_all(folder_); }
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  void overwrite(bool of_bench, std::size_t place, std::span<const std::uint8_t> with) {
    auto* memory =
        of_bench ? reinterpret_cast<std::uint8_t*>(bench.get()) : reinterpret_cast<std::uint8_t*>(core.get());
    const std::size_t size = of_bench ? sizeof(sim::Bench) : sizeof(rt::CoreSegment);
    place %= size;
    const std::size_t count = std::min(with.size(), size - place);
    undo_.push_back({memory + place, {memory + place, memory + place + count}});
    std::memcpy(memory + place, with.data(), count);
  }
  void restore() {
    for (; !undo_.empty(); undo_.pop_back()) {
      std::memcpy(undo_.back().place, undo_.back().bytes.data(), undo_.back().bytes.size());
    }
  }
  [[nodiscard]] const std::string& folder() const { return folder_; }
  [[nodiscard]] const tools::Scene& scene() const { return scene_; }

  std::unique_ptr<rt::CoreSegment> core = std::make_unique<rt::CoreSegment>();
  std::unique_ptr<sim::Bench> bench = std::make_unique<sim::Bench>();

 private:
  struct Undo {
    std::uint8_t* place;
    std::vector<std::uint8_t> bytes;
  };
  std::vector<Undo> undo_;
  std::string folder_;
  tools::Scene scene_ = *tools::load_scene("icsi");
};

void expect_text(const std::string& text) {
  for (const char c : text) {
    if (c != '\n' && static_cast<unsigned char>(c) < 0x20) {
      found("a control character is said");
    }
  }
}

void read_all(Station& station) {
  const rt::CoreStatus& status = station.core->status;
  auto recorder =
      tools::Recorder::create(station.folder(), station.scene(), *station.core, station.bench.get(), 1);
  if (!recorder) {
    found(recorder.error().c_str());
  }
  for (int i = 0; i < 3; ++i) {
    if (recorder->drain() > rt::TelemetryRing::kSize) {
      found("a round takes more than the ring holds");
    }
  }
  recorder->finish();
  if (recorder->lost() > status.ticks.load()) {
    found("more samples are lost than there were");
  }
  tools::RunResult result;
  result.end = tools::judge({.core_exited = true, .has_task = true}, status, recorder->measures());
  result.samples_lost = recorder->lost();
  sim::Snapshot newest;
  const bool simulated = sim::newest_valid(*station.bench, newest);
  result.needle = recorder->measures().whereabouts(simulated ? &newest : nullptr);
  if (!tools::write_report_json(station.folder(),
                                tools::report_facts(station.scene(), result, recorder->measures(),
                                                    recorder->events(), status, {}))) {
    found("the report is not written");
  }
  std::ifstream report(station.folder() + "/report.json");
  if (!nlohmann::json::parse(report, nullptr, false).is_object()) {
    found("the report cannot be read");
  }
  expect_text(tools::summary(station.scene(), result, recorder->measures(), status, {}, false));
  expect_text(tools::progress_line(station.scene(), recorder->measures(), status, {}));
  expect_text(tools::missing_rights(status));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Station station;
  // Records: which memory, where, how many bytes, and they.
  for (std::span<const std::uint8_t> rest(data, size); rest.size() > 5;) {
    const std::size_t place = rest[1] + 256U * rest[2] + 65536U * rest[3];
    const std::size_t count = std::min<std::size_t>(rest[4], rest.size() - 5);
    if (count > 0) {
      station.overwrite(rest[0] % 2 == 1, place, rest.subspan(5, count));
    }
    rest = rest.subspan(5 + count);
  }
  read_all(station);
  station.restore();
  return 0;
}
