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

#include "tools/child.hpp"
#include "tools/report/tick_tape.hpp"
#include "tools/scene_keys.hpp"
#ifdef PUNCTUM_VISION
#include "tools/report/simulated_frames.hpp"
#endif

namespace punctum::report {
namespace {

namespace fs = std::filesystem;
using tools::Child;
using tools::Ended;
using tools::Scene;

constexpr double kRun_s = 30;        // a task is over by then
constexpr double kSeen_s = 1.5;      // the core runs for so long while it is looked at
constexpr double kPatience_s = 300;  // for one program
constexpr auto kLook = std::chrono::milliseconds(20);
// Gaps on either side of what vision takes for "far from the cell".
constexpr double kFar_px = 15, kNear_px = 10;

// A person in a hurry under a slow camera: the whole task in few ticks and frames, for the quick report.
std::vector<std::string> hurry(const Scene& scene) {
  const auto& p = scene.sim->person;
  std::vector<std::string> overrides{
      "scene.seconds=8",
      "operator.reaction_s=0.05",
      "operator.dwell_s=0.05",
      fmt::format("operator.approach_s={}", std::max(0.25 * p.approach_s, 0.2)),
      fmt::format("operator.indentation_speed_um_s={}", std::min(4e6 * p.indentation_speed_m_s, 500.0)),
      fmt::format("operator.withdrawal_speed_um_s={}", std::min(3e6 * p.withdrawal_speed_m_s, 1000.0))};
  if (scene.simulated_camera()) overrides.emplace_back("camera.fps=10");
  return overrides;
}
// How a scene is run for its ticks and frames.
std::vector<std::string> manner(const Scene& scene, bool quick) {
  return quick ? hurry(scene) : std::vector<std::string>{fmt::format("scene.seconds={}", kRun_s)};
}

// ---- programs ----

struct Program {
  std::string name;
  std::vector<std::string> args;
  fs::path log;
  std::vector<int> good_codes{0};
};

// A folder of its own that is gone afterwards.
class Workshop {
 public:
  Workshop() {
    std::string name = (fs::temp_directory_path() / "punctum-scenes-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": cannot be made");
    folder_ = name;
  }
  ~Workshop() {
    std::error_code ec;
    fs::remove_all(folder_, ec);
  }
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;
  [[nodiscard]] fs::path operator/(const std::string& name) const { return folder_ / name; }

 private:
  fs::path folder_;
};

// All of them, at most `at_once` at a time. look(i, pid) is called now and then while program i runs.
void run_all(const std::vector<Program>& programs, std::size_t at_once,
             const std::function<void(std::size_t, pid_t)>& look = {}, Progress* progress = nullptr) {
  struct Running {
    std::size_t index;
    Child child;
    std::chrono::steady_clock::time_point until;
  };
  std::vector<Running> running;
  std::size_t next = 0;
  while (next < programs.size() || !running.empty()) {
    while (next < programs.size() && running.size() < at_once) {
      auto child = Child::start(programs[next].name, programs[next].args, programs[next].log.string());
      if (!child) throw std::runtime_error(child.error());
      running.push_back(
          {next++, std::move(*child),
           std::chrono::steady_clock::now() + std::chrono::seconds(static_cast<std::int64_t>(kPatience_s))});
    }
    for (auto r = running.begin(); r != running.end();) {
      const Program& p = programs[r->index];
      if (look) look(r->index, r->child.pid());
      Ended how;
      if (!r->child.ended(how)) {
        if (std::chrono::steady_clock::now() > r->until)
          throw std::runtime_error(fmt::format("{}: not ready after {} s", p.name, kPatience_s));
        ++r;
        continue;
      }
      const auto& good = p.good_codes;
      if (!how.exited || std::find(good.begin(), good.end(), how.code) == good.end())
        throw std::runtime_error(fmt::format("{} {}: {}, {}", p.name, p.args.size() > 1 ? p.args[1] : "",
                                             how.text(), tools::last_line(p.log.string())));
      if (progress != nullptr) progress->step();
      r = running.erase(r);
    }
    std::this_thread::sleep_for(kLook);
  }
}

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

bool has_rows(const fs::path& csv) {
  std::ifstream in(csv);
  std::string line;
  return std::getline(in, line) && std::getline(in, line);
}

// ---- processes, as /proc shows them ----

using Processes = std::map<pid_t, Process>;

pid_t parent_of(pid_t pid) {
  const std::string stat = read_text(fmt::format("/proc/{}/stat", pid));
  const auto close = stat.rfind(')');  // the name before it may contain anything
  return close == std::string::npos || close + 4 >= stat.size()
             ? 0
             : static_cast<pid_t>(std::atoi(stat.c_str() + close + 4));
}

// What the process is, the most of everything it was seen to have.
void look_at(pid_t pid, Processes& seen) {
  const fs::path proc = fmt::format("/proc/{}", pid);
  std::string name = read_text(proc / "comm");
  if (name.empty()) return;
  name.pop_back();
  Process& p = seen[pid];
  if (p.name != name) p = {.name = name};  // it has become another program
  std::error_code ec;
  std::size_t threads = 0;
  for (auto it = fs::directory_iterator(proc / "task", ec); !ec && it != fs::directory_iterator();
       it.increment(ec))
    ++threads;
  p.threads = std::max(p.threads, threads);
  std::istringstream maps(read_text(proc / "maps"));
  for (std::string line; std::getline(maps, line);)
    if (const auto path = line.find('/');
        path != std::string::npos && line.find(".so", path) != std::string::npos)
      p.libraries.insert(line.substr(path));
  std::istringstream status(read_text(proc / "status"));
  const auto kB = [](const std::string& line) {
    return std::strtod(line.c_str() + line.find(':') + 1, nullptr);
  };
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmLck:")) p.locked_kB = std::max(p.locked_kB, kB(line));
    if (line.starts_with("VmHWM:")) p.resident_kB = std::max(p.resident_kB, kB(line));
  }
}

void look_at_family(pid_t parent, Processes& seen) {
  look_at(parent, seen);
  std::error_code ec;
  for (auto it = fs::directory_iterator("/proc", ec); !ec && it != fs::directory_iterator(); it.increment(ec))
    if (const pid_t pid = std::atoi(it->path().filename().c_str()); pid > 0 && parent_of(pid) == parent)
      look_at(pid, seen);
}

// ---- instructions per tick ----

const tools::Table* table_named(const std::string& name) {
  for (const auto& t : tools::scene_tables())
    if (t.name == name) return &t;
  return nullptr;
}

// A flag of a settings table, "vision.inner", put to false.
bool unset(Scene& scene, const std::string& key) {
  const auto dot = key.rfind('.');
  const tools::Table* table = dot == std::string::npos ? nullptr : table_named(key.substr(0, dot));
  if (table == nullptr || !table->there(scene)) return false;
  for (const auto& k : table->keys(scene))
    if (const auto* flag = std::get_if<tools::Flag>(&k.value);
        flag != nullptr && k.name == key.substr(dot + 1) && *flag->target) {
      *flag->target = false;
      return true;
    }
  return false;
}

// The scene without a table, and without what cannot be there without it.
std::optional<Removal> without(const Scene& scene, const tools::Table& table) {
  Removal r{table.name, {table.name + "=off"}, scene};
  table.put(r.left, false);
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

// What callgrind counted below Servo::tick.
TickCost read_callgrind(const fs::path& file, double ticks) {
  constexpr std::string_view kTick = "punctum::rt::Servo::tick", kServo = "punctum::rt::Servo::";
  TickCost cost;
  std::ifstream in(file);
  bool in_tick = false, cost_of_call = false;
  std::string called;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("fn=")) in_tick = line.find(kTick) != std::string::npos;
    if (line.starts_with("cfn=")) called = line.substr(4);
    if (line.starts_with("totals:")) cost.instructions = std::strtod(line.c_str() + 7, nullptr) / ticks;
    if (line.starts_with("calls=")) {
      cost_of_call = true;
    } else if (cost_of_call) {
      cost_of_call = false;
      if (in_tick && called.starts_with(kServo)) {
        const auto name = called.substr(kServo.size(), called.find('(') - kServo.size());
        cost.steps[name] += std::strtod(line.c_str() + line.find(' '), nullptr) / ticks;
      }
    }
  }
  return cost;
}

// Of each variant of a scene; `tick-cost` writes one file of counts per variant.
std::vector<TickCost> read_costs(const fs::path& counts, const fs::path& log, std::size_t variants) {
  std::vector<TickCost> costs;
  std::istringstream said(read_text(log));
  for (std::size_t i = 0; i < variants; ++i) {
    double ticks = 0;
    std::string fault;
    if (!(said >> ticks >> fault)) throw std::runtime_error(log.string() + ": not understood");
    costs.push_back(read_callgrind(fmt::format("{}.{}", counts.string(), i + 1), ticks));
    costs.back().fault = fault;
    if (!(costs.back().instructions > 0)) throw std::runtime_error("callgrind has not seen Servo::tick");
  }
  return costs;
}

// ---- vision's stages ----

Stages read_stages(const fs::path& obs_csv, double pixel_um) {
  std::ifstream in(obs_csv);
  std::string line, cell;
  const auto split = [&cell](const std::string& text) {
    std::vector<std::string> cells;
    for (std::istringstream s(text); std::getline(s, cell, ',');) cells.push_back(cell);
    return cells;
  };
  std::getline(in, line);
  std::map<std::string, std::size_t> column;
  for (const auto& name : split(line)) column.emplace(name, column.size());
  Stages out;
  while (std::getline(in, line)) {
    const auto cells = split(line);
    const auto text = [&](const std::string& name) {
      const std::size_t i = column.at(name);
      return i < cells.size() ? cells[i] : std::string();
    };
    std::vector<StageRuns*> into{&out.all};
    if (const std::string gap = text("gap_um"); !gap.empty()) {
      const double gap_px = std::strtod(gap.c_str(), nullptr) / pixel_um;
      if (gap_px > kFar_px) into.push_back(&out.far);
      if (gap_px < kNear_px) into.push_back(&out.near);
    }
    for (StageRuns* runs : into) {
      ++runs->frames;
      for (const auto& stage : kStages) runs->ran[stage] += text(stage + "_us").empty() ? 0 : 1;
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
  for (const auto& o : overrides) args.insert(args.end(), {"--set", o});
  return args;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  return fmt::format("{}", fmt::join(words, between));
}

// All scenes run at once, in real time, and are looked at until they are fully there.
void measure_processes(std::vector<SceneCost>& costs, const Workshop& workshop, const fs::path& frames,
                       Progress& progress) {
  using Clock = std::chrono::steady_clock;
  struct Seen {
    Processes processes;
    std::optional<Clock::time_point> core_since;
    bool over = false;
  };
  std::vector<Program> programs;
  for (const SceneCost& c : costs) {
    std::vector<std::string> overrides;
    if (c.scene.recorded) overrides.push_back("camera.frames=" + frames.string());
    // 1: it was stopped before its task was done.
    programs.push_back({"punctum",
                        run_args(c.scene, workshop / (c.scene.name + "-real"), "real", overrides),
                        workshop / (c.scene.name + "-real.log"),
                        {0, 1}});
  }
  std::vector<Seen> seen(costs.size());
  run_all(
      programs, programs.size(),
      [&](std::size_t i, pid_t pid) {
        Seen& s = seen[i];
        if (s.over) return;
        look_at_family(pid, s.processes);
        const bool core = std::any_of(s.processes.begin(), s.processes.end(),
                                      [](const auto& p) { return p.second.name == "punctum-core"; });
        if (core && !s.core_since) s.core_since = Clock::now();
        const bool long_enough =
            s.core_since && Clock::now() - *s.core_since > std::chrono::duration<double>(kSeen_s);
        const bool sees =
            !costs[i].scene.vision || has_rows(workshop / (costs[i].scene.name + "-real") / "obs.csv");
        if (!long_enough || !sees) return;
        s.over = true;
        kill(pid, SIGTERM);
      },
      &progress);
  for (std::size_t i = 0; i < costs.size(); ++i)
    for (auto& [pid, process] : seen[i].processes) costs[i].processes.push_back(std::move(process));
}

Removal at_one_go(const std::vector<Removal>& chain) {
  Removal all{"everything", {}, chain.back().left};
  for (const Removal& r : chain)
    all.overrides.insert(all.overrides.end(), r.overrides.begin(), r.overrides.end());
  return all;
}

void count_instructions(std::vector<SceneCost>& costs, const Workshop& workshop, bool quick,
                        std::size_t at_once, Progress& progress) {
  std::vector<Program> programs;
  for (SceneCost& c : costs) {
    const std::string name = c.scene.name;
    const auto told = tools::load_scene(name, manner(c.scene, quick));
    if (!told) throw std::runtime_error(told.error());
    const std::string tape = (workshop / (name + ".tape")).string();
    if (const auto written = write_tape(tape, record_ticks(*told, told->seconds)); !written)
      throw std::runtime_error(written.error());
    c.chain = take_apart(c.scene);
    if (quick && name != "icsi") c.chain = {at_one_go(c.chain)};
    std::vector<std::string> args{"-q",
                                  "--tool=callgrind",
                                  "--compress-strings=no",
                                  "--callgrind-out-file=" + (workshop / (name + ".counts")).string(),
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
    programs.push_back({"valgrind", std::move(args), workshop / (name + "-ticks.log")});
  }
  run_all(programs, at_once, {}, &progress);
  for (SceneCost& c : costs)
    c.ticks = read_costs(workshop / (c.scene.name + ".counts"), workshop / (c.scene.name + "-ticks.log"),
                         c.chain.size() + 1);
}

void count_stages(std::vector<SceneCost>& costs, const Workshop& workshop, const fs::path& frames, bool quick,
                  std::size_t at_once, Progress& progress) {
  std::vector<Program> programs;
  std::vector<std::pair<SceneCost*, fs::path>> read;
  for (SceneCost& c : costs) {
    if (!c.scene.vision) continue;
    const fs::path report = workshop / (c.scene.name + "-virtual"),
                   log = workshop / (c.scene.name + "-virtual.log");
    if (c.scene.recorded) {
      const fs::path out = workshop / "recorded.csv";
      programs.push_back(
          {"punctum-vision",
           {"track", "--frames", frames.string(), "--scene", c.scene.name, "--out", out.string()},
           log});
      read.emplace_back(&c, out);
    } else {
      programs.push_back(
          {"punctum", run_args(c.scene, report, "virtual", manner(c.scene, quick)), log, {0, 1}});
      read.emplace_back(&c, report / "obs.csv");
    }
  }
  run_all(programs, at_once, {}, &progress);
  for (const auto& [c, csv] : read) c->stages = read_stages(csv, c->scene.vision->pixel_m * 1e6);
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
  for (const auto& [stage, n] : ran) sum += static_cast<double>(n);
  return frames > 0 ? sum / static_cast<double>(frames) : kNone;
}

std::vector<Removal> take_apart(const Scene& scene) {
  std::vector<Removal> chain;
  for (;;) {
    const Scene& now = chain.empty() ? scene : chain.back().left;
    std::optional<Removal> next;
    for (const auto& t : tools::scene_tables()) {
      if (t.kind != tools::Kind::thing || !t.there(now)) continue;
      auto r = without(now, t);
      if (r && (!next || r->overrides.size() <= next->overrides.size())) next = std::move(r);
    }
    if (!next) return chain;
    chain.push_back(std::move(*next));
  }
}

std::vector<SceneCost> measure_scenes(const Job& job) {
  const Workshop workshop;
  std::vector<SceneCost> costs;
  for (const auto name : tools::builtin_names()) {
    auto scene = tools::load_scene(name);
    if (!scene) throw std::runtime_error(scene.error());
    if (scene->vision && !vision_is_there()) continue;  // built without OpenCV
    costs.push_back({.scene = std::move(*scene)});
  }
  const std::size_t at_once = std::max(1U, std::thread::hardware_concurrency());
  const auto n = static_cast<std::int64_t>(costs.size());

  job.progress.start("processes", n);
  const fs::path frames = workshop / "pictures";
  draw_frames(frames, job.quick);
  measure_processes(costs, workshop, frames, job.progress);
  if (!tools::find_program("valgrind").empty()) {
    job.progress.start("instructions", n);
    count_instructions(costs, workshop, job.quick, at_once, job.progress);
  }
  job.progress.start("stages of vision", n);
  count_stages(costs, workshop, frames, job.quick, at_once, job.progress);
  return costs;
}

}  // namespace punctum::report
