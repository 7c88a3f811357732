#include "tools/report/scene_costs.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "tools/report/tick_tape.hpp"
#include "tools/report/watched_programs.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/shared/child.hpp"
#include "tools/shared/csv.hpp"
#ifdef PUNCTUM_VISION
#include "tools/report/simulated_frames.hpp"
#endif

namespace punctum::report {
namespace {

namespace fs = std::filesystem;
using tools::Scene;

constexpr double kRun_s = 30;         // a task has ended by then
constexpr double kInspected_s = 1.5;  // the core runs for so long
// Gaps well on either side of the one below which vision looks for contact.
constexpr double kFar_px = 15, kNear_px = 10;

// For the quick report: a fast operator and a slow camera perform the task in few ticks and frames.
std::vector<std::string> quick_overrides(const Scene& scene) {
  if (!scene.sim) {
    throw std::runtime_error(scene.name + ": no operator is simulated");
  }
  const auto& p = scene.sim->operator_params;
  std::vector<std::string> overrides{
      "scene.seconds=8",
      "sim.operator.reaction_s=0.05",
      "sim.operator.dwell_s=0.05",
      fmt::format("sim.operator.approach_s={}", std::max(0.25 * p.approach_s, 0.2)),
      fmt::format("sim.operator.indentation_speed_um_s={}", std::min(4e6 * p.indentation_speed_m_s, 500.0)),
      fmt::format("sim.operator.withdrawal_speed_um_s={}", std::min(3e6 * p.withdrawal_speed_m_s, 1000.0))};
  if (scene.simulated_camera()) {
    overrides.emplace_back("camera.fps=10");
  }
  return overrides;
}

// Overrides of a scene whose ticks and frames are counted.
std::vector<std::string> run_overrides(const Scene& scene, bool quick) {
  return quick ? quick_overrides(scene) : std::vector<std::string>{fmt::format("scene.seconds={}", kRun_s)};
}

bool has_rows(const fs::path& csv) {
  std::ifstream in(csv);
  std::string line;
  return std::getline(in, line) && std::getline(in, line);
}

// ---- instructions per tick ----

const tools::Table* table_named(const std::string& name) {
  for (const auto& t : tools::scene_tables()) {
    if (t.name == name) {
      return &t;
    }
  }
  return nullptr;
}

// Sets a flag of a settings table, for example "vision.inner", to false.
bool unset(Scene& scene, const std::string& key) {
  const auto dot = key.rfind('.');
  const tools::Table* table = dot == std::string::npos ? nullptr : table_named(key.substr(0, dot));
  if (table == nullptr || !table->there(scene)) {
    return false;
  }
  for (const auto& k : table->keys(scene)) {
    if (const auto* flag = std::get_if<tools::Flag>(&k.value);
        flag != nullptr && k.name == key.substr(dot + 1) && *flag->target) {
      *flag->target = false;
      return true;
    }
  }
  return false;
}

// The scene without a table, and without the tables that need it.
std::optional<Removal> without(const Scene& scene, const tools::Table& table) {
  Removal r{table.name, {table.name + "=off"}, scene};
  table.put(r.left, false);
  for (const auto& inner : tools::scene_tables()) {  // that went with it
    if (inner.name.starts_with(table.name + ".") && inner.kind == tools::Kind::thing && inner.there(scene)) {
      r.name += " + " + inner.name;
    }
  }
  while (const auto problem = tools::check_together(r.left)) {
    const tools::Table* needs_it = table_named(problem->key);
    if (needs_it != nullptr && needs_it->kind == tools::Kind::thing && needs_it->there(r.left)) {
      needs_it->put(r.left, false);
      r.name += " + " + needs_it->name;
      r.overrides.push_back(needs_it->name + "=off");
    } else if (unset(r.left, problem->key)) {
      r.overrides.insert(r.overrides.begin(), problem->key + "=false");
    } else {
      return std::nullopt;
    }
  }
  return r;
}

// The instructions that callgrind counted in Servo::tick and below. The steps are what it calls: the compiler
// makes the smaller ones a part of it.
TickCost read_callgrind(const fs::path& file, double ticks) {
  constexpr std::string_view kTick = "punctum::rt::Servo::tick", kCore = "punctum::rt::";
  TickCost cost;
  std::ifstream in(file);
  bool in_tick = false, cost_of_call = false;
  std::string called;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("fn=")) {
      in_tick = line.find(kTick) != std::string::npos;
    }
    if (line.starts_with("cfn=")) {
      called = line.substr(4);
    }
    if (line.starts_with("totals:")) {
      cost.instructions = std::strtod(line.c_str() + 7, nullptr) / ticks;
    }
    if (line.starts_with("calls=")) {
      cost_of_call = true;
    } else if (cost_of_call) {
      cost_of_call = false;
      if (in_tick && called.starts_with(kCore)) {
        const auto name = called.substr(kCore.size(), called.find('(') - kCore.size());
        cost.steps[name] += std::strtod(line.c_str() + line.find(' '), nullptr) / ticks;
      }
    }
  }
  return cost;
}

// Of each variant of a scene; `tick-cost` writes one file of counts per variant.
std::vector<TickCost> read_costs(const fs::path& counts, const fs::path& log, std::size_t variants) {
  std::vector<TickCost> costs;
  std::istringstream output(read_text(log));
  for (std::size_t i = 0; i < variants; ++i) {
    double ticks = 0;
    std::string fault;
    if (!(output >> ticks >> fault)) {
      throw std::runtime_error(log.string() + ": not understood");
    }
    costs.push_back(read_callgrind(fmt::format("{}.{}", counts.string(), i + 1), ticks));
    costs.back().fault = fault;
    if (!(costs.back().instructions > 0)) {
      throw std::runtime_error("callgrind has not seen Servo::tick");
    }
  }
  return costs;
}

// ---- vision's stages ----

Stages read_stages(const fs::path& obs_csv, double pixel_um) {
  tools::CsvReader table(obs_csv.string());
  if (!table.has("gap_um")) {
    throw std::runtime_error(obs_csv.string() + ": not understood");
  }
  Stages out;
  while (table.next()) {
    std::vector<StageRuns*> into{&out.all};
    if (const auto gap_um = table.number("gap_um")) {
      const double gap_px = *gap_um / pixel_um;
      if (gap_px > kFar_px) {
        into.push_back(&out.far);
      }
      if (gap_px < kNear_px) {
        into.push_back(&out.near);
      }
    }
    for (StageRuns* runs : into) {
      ++runs->frames;
      for (const auto& stage : kStages) {
        runs->ran[stage] += table.text(stage + "_us").empty() ? 0 : 1;
      }
    }
  }
  return out;
}

// ---- the topic ----

bool vision_is_there() { return !tools::find_program("punctum-vision").empty(); }

// Frames of one injection, for the scene that plays a folder.
void draw_frames([[maybe_unused]] const fs::path& folder, [[maybe_unused]] bool quick) {
#ifdef PUNCTUM_VISION
  InjectionPlan plan;
  if (quick) {
    plan.approach_m_s *= 3;
    plan.indentation_m_s *= 3;
    plan.inside_s = 0.1;
  }
  const SimulatedInjection injection = simulate_injection(plan);
  fs::create_directories(folder);
  for (std::size_t i = 0; i < injection.pixels.size(); ++i) {
    std::ofstream out(folder / fmt::format("{:04}.pgm", i), std::ios::binary);
    out << fmt::format("P5 {} {} 255\n", injection.lens.width, injection.lens.height);
    out.write(reinterpret_cast<const char*>(injection.pixels[i].data()),
              static_cast<std::streamsize>(injection.pixels[i].size()));
  }
#endif
}

std::vector<std::string> run_args(const Scene& scene, const fs::path& report, const std::string& clock,
                                  const std::vector<std::string>& overrides) {
  std::vector<std::string> args{"run",           scene.name,    "--clock",     clock,    "--report",
                                report.string(), "--no-figure", "--no-frames", "--quiet"};
  for (const auto& o : overrides) {
    args.insert(args.end(), {"--set", o});
  }
  return args;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  return fmt::format("{}", fmt::join(words, between));
}

// All scenes run at once, in real time, and are inspected until all their processes have run for a while.
void measure_processes(std::vector<SceneCost>& costs, const TemporaryFolder& folder, const fs::path& frames,
                       Progress& progress) {
  using Clock = std::chrono::steady_clock;
  struct Seen {
    Processes processes;
    std::optional<Clock::time_point> core_since;
    bool ended = false;
  };
  std::vector<Program> programs;
  for (const SceneCost& c : costs) {
    std::vector<std::string> overrides;
    if (c.scene.recorded) {
      overrides.push_back("camera.frames=" + frames.string());
    }
    // 1: it was stopped before its task ended. 3: the machine stalled for longer than the relay waits for the
    // heartbeat, and the station stopped as it must; its processes and libraries are the same.
    programs.push_back({"punctum",
                        run_args(c.scene, folder / (c.scene.name + "-real"), "real", overrides),
                        folder / (c.scene.name + "-real.log"),
                        {0, 1, 3}});
  }
  std::vector<Seen> seen(costs.size());
  run_all(
      programs, programs.size(),
      [&](std::size_t i, pid_t pid) {
        Seen& s = seen[i];
        if (s.ended) {
          return;
        }
        inspect_with_children(pid, s.processes);
        const bool core = std::any_of(s.processes.begin(), s.processes.end(),
                                      [](const auto& p) { return p.second.name == "punctum-core"; });
        if (core && !s.core_since) {
          s.core_since = Clock::now();
        }
        const bool long_enough =
            s.core_since && Clock::now() - *s.core_since > std::chrono::duration<double>(kInspected_s);
        const bool has_frames =
            !costs[i].scene.vision || has_rows(folder / (costs[i].scene.name + "-real") / "obs.csv");
        if (!long_enough || !has_frames) {
          return;
        }
        s.ended = true;
        kill(pid, SIGTERM);
      },
      &progress);
  for (std::size_t i = 0; i < costs.size(); ++i) {
    for (auto& [pid, process] : seen[i].processes) {
      costs[i].processes.push_back(std::move(process));
    }
  }
}

// The whole chain as one removal.
Removal combined(const std::vector<Removal>& chain) {
  Removal all{"everything", {}, chain.back().left};
  for (const Removal& r : chain) {
    all.overrides.insert(all.overrides.end(), r.overrides.begin(), r.overrides.end());
  }
  return all;
}

void count_instructions(std::vector<SceneCost>& costs, const TemporaryFolder& folder, bool quick,
                        std::size_t at_once, Progress& progress) {
  std::vector<Program> programs;
  for (SceneCost& c : costs) {
    const std::string name = c.scene.name;
    const auto loaded = tools::load_scene(name, run_overrides(c.scene, quick));
    if (!loaded) {
      throw std::runtime_error(loaded.error());
    }
    const std::string tape = (folder / (name + ".tape")).string();
    if (const auto written = write_tape(tape, record_ticks(*loaded, loaded->seconds)); !written) {
      throw std::runtime_error(written.error());
    }
    c.chain = take_apart(c.scene);
    if (quick && name != "icsi") {
      c.chain = {combined(c.chain)};
    }
    std::vector<std::string> args{"-q",
                                  "--tool=callgrind",
                                  "--compress-strings=no",
                                  "--callgrind-out-file=" + (folder / (name + ".counts")).string(),
                                  "--toggle-collect=punctum::rt::Servo::tick*",
                                  "--dump-after=punctum::report::run_variant*",
                                  tools::find_program("punctum-tick-cost"),
                                  tape,
                                  name,
                                  ""};
    std::vector<std::string> overrides;
    for (const Removal& r : c.chain) {
      overrides.insert(overrides.end(), r.overrides.begin(), r.overrides.end());
      args.push_back(joined(overrides, ","));
    }
    programs.push_back({"valgrind", std::move(args), folder / (name + "-ticks.log")});
  }
  run_all(programs, at_once, {}, &progress);
  for (SceneCost& c : costs) {
    c.ticks = read_costs(folder / (c.scene.name + ".counts"), folder / (c.scene.name + "-ticks.log"),
                         c.chain.size() + 1);
  }
}

void count_stages(std::vector<SceneCost>& costs, const TemporaryFolder& folder, const fs::path& frames,
                  bool quick, std::size_t at_once, Progress& progress) {
  std::vector<Program> programs;
  std::vector<std::pair<SceneCost*, fs::path>> read;
  for (SceneCost& c : costs) {
    if (!c.scene.vision) {
      continue;
    }
    const fs::path report = folder / (c.scene.name + "-virtual"),
                   log = folder / (c.scene.name + "-virtual.log");
    if (c.scene.recorded) {
      const fs::path out = folder / "recorded.csv";
      programs.push_back(
          {"punctum-vision",
           {"track", "--frames", frames.string(), "--scene", c.scene.name, "--out", out.string()},
           log});
      read.emplace_back(&c, out);
    } else {
      programs.push_back(
          {"punctum", run_args(c.scene, report, "virtual", run_overrides(c.scene, quick)), log, {0, 1}});
      read.emplace_back(&c, report / "obs.csv");
    }
  }
  run_all(programs, at_once, {}, &progress);
  for (const auto& [c, csv] : read) {
    c->stages = read_stages(csv, c->scene.vision->pixel_m * 1e6);
  }
}

}  // namespace

std::int64_t opencv_among(const std::set<std::string>& libraries) {
  return std::count_if(libraries.begin(), libraries.end(),
                       [](const std::string& l) { return l.find("libopencv") != std::string::npos; });
}

std::int64_t StageRuns::of(const std::string& stage) const {
  const auto it = ran.find(stage);
  return it == ran.end() ? 0 : it->second;
}

double StageRuns::per_frame() const {
  double sum = 0;
  for (const auto& [stage, n] : ran) {
    sum += static_cast<double>(n);
  }
  return frames > 0 ? sum / static_cast<double>(frames) : kNone;
}

std::vector<Removal> take_apart(const Scene& scene) {
  std::vector<Removal> chain;
  for (;;) {
    const Scene& now = chain.empty() ? scene : chain.back().left;
    std::optional<Removal> next;
    for (const auto& t : tools::scene_tables()) {
      if (t.kind != tools::Kind::thing || !t.there(now)) {
        continue;
      }
      auto r = without(now, t);
      if (r && (!next || r->overrides.size() <= next->overrides.size())) {
        next = std::move(r);
      }
    }
    if (!next) {
      return chain;
    }
    chain.push_back(std::move(*next));
  }
}

std::vector<SceneCost> measure_scenes(const Job& job) {
  const TemporaryFolder folder;
  std::vector<SceneCost> costs;
  for (const auto name : tools::builtin_names()) {
    auto scene = tools::load_scene(name);
    if (!scene) {
      throw std::runtime_error(scene.error());
    }
    if (scene->needs_hardware() || (scene->vision && !vision_is_there())) {
      continue;  // not in virtual time; built without OpenCV
    }
    costs.push_back({.scene = std::move(*scene)});
  }
  const std::size_t at_once = std::max(1U, std::thread::hardware_concurrency());
  const auto n = static_cast<std::int64_t>(costs.size());

  job.progress.start("processes", n);
  const fs::path frames = folder / "pictures";
  draw_frames(frames, job.quick);
  measure_processes(costs, folder, frames, job.progress);
  if (!tools::find_program("valgrind").empty()) {
    job.progress.start("instructions", n);
    count_instructions(costs, folder, job.quick, at_once, job.progress);
  }
  job.progress.start("stages of vision", n);
  count_stages(costs, folder, frames, job.quick, at_once, job.progress);
  return costs;
}

}  // namespace punctum::report
