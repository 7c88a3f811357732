// What each built-in scene costs, and that what it leaves out costs nothing: processes and their libraries as
// the kernel shows them, instructions per tick as valgrind counts them, vision's stages as its frames tell.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "tools/child.hpp"
#include "tools/report/tick_tape.hpp"
#include "tools/report/topic.hpp"
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

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kTape_s = 15;       // of a scene without a task
constexpr double kPatience_s = 300;  // for one program
constexpr auto kLook = std::chrono::milliseconds(20);
// Gaps on either side of what vision takes for "far from the cell".
constexpr double kFar_px = 15, kNear_px = 10;

// A person in a hurry: the whole task in little time, for the quick report.
const std::vector<std::string> kHurry = {"operator.approach_s=0.6", "operator.reaction_s=0.05",
                                         "operator.dwell_s=0.05", "operator.indentation_speed_um_s=60",
                                         "operator.withdrawal_speed_um_s=80"};

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

// ---- processes, as /proc shows them ----

struct Process {
  std::string name{};
  std::size_t threads = 0;
  std::set<std::string> libraries{};
  double locked_kB = 0, resident_kB = 0;
  [[nodiscard]] std::int64_t opencv() const {
    return std::count_if(libraries.begin(), libraries.end(),
                         [](const std::string& l) { return l.find("libopencv") != std::string::npos; });
  }
};
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

// One thing less: the tables that go, and the overrides that take them out.
struct Removal {
  std::string name;
  std::vector<std::string> overrides;
  Scene left;
};

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

// One table after the other, always the one that takes the fewest others with it, until none is left.
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

struct TickCost {
  double instructions = kNone;          // per tick
  std::map<std::string, double> steps;  // of it, by step of the tick, where it is a function of its own
  std::string fault;                    // the servo's own, "none" if all went well
};

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

const std::vector<std::string> kStages = {"prepare", "holder", "needle",  "erase",  "start",
                                          "outer",   "inner",  "measure", "contact"};

struct StageRuns {
  std::int64_t frames = 0;
  std::map<std::string, std::int64_t> ran;
  [[nodiscard]] double per_frame() const {
    double sum = 0;
    for (const auto& [stage, n] : ran) sum += static_cast<double>(n);
    return frames > 0 ? sum / static_cast<double>(frames) : kNone;
  }
};
struct Stages {
  StageRuns far, near;  // of the cell; frames between, and those without a gap, count for neither
  StageRuns all;
};

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

struct SceneCost {
  Scene scene;
  std::vector<Process> processes{};
  std::vector<Removal> chain{};
  std::vector<TickCost> ticks{};  // as it is, then after each removal; empty without valgrind
  Stages stages{};
};

const std::set<std::string> kEffects = {"membrane",  "cone",     "axis",     "damping",
                                        "repulsive", "friction", "vibration"};

std::vector<std::string> effects_of(const Scene& scene) {
  std::vector<std::string> effects;
  for (const auto& t : tools::tables(scene))
    if (t.present && kEffects.contains(t.name)) effects.push_back(t.name);
  return effects;
}

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

// All scenes run at once, for a second of real time, and are looked at meanwhile.
void measure_processes(std::vector<SceneCost>& costs, const Workshop& workshop, const fs::path& frames,
                       Progress& progress) {
  std::vector<Program> programs;
  for (const SceneCost& c : costs) {
    const fs::path report = workshop / (c.scene.name + "-real");
    std::vector<std::string> overrides{"scene.seconds=1"};
    if (c.scene.recorded) overrides.push_back("camera.frames=" + frames.string());
    // 1: the second was over before the task.
    programs.push_back({"punctum",
                        run_args(c.scene, report, "real", overrides),
                        workshop / (c.scene.name + "-real.log"),
                        {0, 1}});
  }
  std::vector<Processes> seen(costs.size());
  run_all(
      programs, programs.size(), [&seen](std::size_t i, pid_t pid) { look_at_family(pid, seen[i]); },
      &progress);
  for (std::size_t i = 0; i < costs.size(); ++i)
    for (auto& [pid, process] : seen[i]) costs[i].processes.push_back(std::move(process));
}

void count_instructions(std::vector<SceneCost>& costs, const Workshop& workshop, bool quick,
                        std::size_t at_once, Progress& progress) {
  std::vector<Program> programs;
  for (SceneCost& c : costs) {
    const std::string name = c.scene.name;
    auto told = c.scene;
    if (quick) {
      const auto hurried = tools::load_scene(c.scene.recorded ? "icsi" : name, kHurry);
      if (!hurried) throw std::runtime_error(hurried.error());
      told = *hurried;
    }
    const double longest_s = told.recorded || told.has_task() ? told.seconds : quick ? 2 : kTape_s;
    const std::string tape = (workshop / (name + ".tape")).string();
    if (const auto written = write_tape(tape, record_ticks(told, longest_s)); !written)
      throw std::runtime_error(written.error());
    c.chain = take_apart(c.scene);
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
      programs.push_back({"punctum",
                          run_args(c.scene, report, "virtual", quick ? kHurry : std::vector<std::string>{}),
                          log,
                          {0, 1}});
      read.emplace_back(&c, report / "obs.csv");
    }
  }
  run_all(programs, at_once, {}, &progress);
  for (const auto& [c, csv] : read) c->stages = read_stages(csv, c->scene.vision->pixel_m * 1e6);
}

// ---- what it comes to ----

double saved(const SceneCost& c, std::size_t removal) {
  return c.ticks[removal].instructions - c.ticks[removal + 1].instructions;
}

Table scenes_table(const std::vector<SceneCost>& costs) {
  Table t{"scenes",
          {"scene", "processes", "threads", "libraries", "opencv_libraries", "locked_kB", "effects",
           "effect_names", "instructions_per_tick", "instructions_bare", "stages_far_per_frame",
           "stages_near_per_frame", "fault"}};
  for (const SceneCost& c : costs) {
    std::size_t threads = 0;
    std::set<std::string> libraries;
    double locked_kB = 0;
    for (const Process& p : c.processes) {
      threads += p.threads;
      libraries.insert(p.libraries.begin(), p.libraries.end());
      locked_kB += p.locked_kB;
    }
    const auto opencv = std::count_if(libraries.begin(), libraries.end(), [](const std::string& l) {
      return l.find("libopencv") != std::string::npos;
    });
    const auto effects = effects_of(c.scene);
    t.add({c.scene.name, c.processes.size(), threads, libraries.size(), opencv, locked_kB, effects.size(),
           joined(effects, " "), c.ticks.empty() ? kNone : c.ticks.front().instructions,
           c.ticks.empty() ? kNone : c.ticks.back().instructions,
           c.scene.vision ? c.stages.far.per_frame() : 0.0, c.scene.vision ? c.stages.near.per_frame() : 0.0,
           c.ticks.empty() ? "" : c.ticks.front().fault});
  }
  return t;
}

Table processes_table(const std::vector<SceneCost>& costs) {
  Table t{"scenes_processes",
          {"scene", "process", "threads", "libraries", "opencv_libraries", "locked_kB", "most_resident_kB"}};
  for (const SceneCost& c : costs)
    for (const Process& p : c.processes)
      t.add({c.scene.name, p.name, p.threads, p.libraries.size(), p.opencv(), p.locked_kB, p.resident_kB});
  return t;
}

Table removals_table(const std::vector<SceneCost>& costs) {
  Table t{"scenes_tables",
          {"scene", "removed", "instructions_before", "instructions_after", "saved", "fault"}};
  for (const SceneCost& c : costs)
    for (std::size_t i = 0; i + 1 < c.ticks.size(); ++i)
      t.add({c.scene.name, c.chain[i].name, c.ticks[i].instructions, c.ticks[i + 1].instructions, saved(c, i),
             c.ticks[i + 1].fault});
  return t;
}

Table steps_table(const std::vector<SceneCost>& costs) {
  Table t{"scenes_steps", {"scene", "step", "instructions_per_tick"}};
  for (const SceneCost& c : costs)
    if (!c.ticks.empty())
      for (const auto& [step, instructions] : c.ticks.front().steps)
        t.add({c.scene.name, step, instructions});
  return t;
}

Table stages_table(const std::vector<SceneCost>& costs) {
  Table t{"scenes_stages",
          {"scene", "stage", "frames", "ran", "frames_far", "ran_far", "frames_near", "ran_near"}};
  for (const SceneCost& c : costs) {
    if (!c.scene.vision) continue;
    const auto ran = [](const StageRuns& r, const std::string& stage) {
      const auto it = r.ran.find(stage);
      return it == r.ran.end() ? 0 : it->second;
    };
    for (const auto& stage : kStages)
      t.add({c.scene.name, stage, c.stages.all.frames, ran(c.stages.all, stage), c.stages.far.frames,
             ran(c.stages.far, stage), c.stages.near.frames, ran(c.stages.near, stage)});
  }
  return t;
}

// Each part's share of every bar.
using Parts = std::vector<std::pair<std::string, std::vector<double>>>;
Panel bars(const std::string& title, const std::string& label, std::vector<std::string> names, Parts parts) {
  Panel p{.title = title, .x_label = label};
  p.bars = Bars{.names = std::move(names)};
  for (auto& [name, heights] : parts) p.bars->parts.push_back({.name = name, .y = std::move(heights)});
  return p;
}

Figure figure(const std::vector<SceneCost>& costs) {
  Figure f{.name = "scenes"};
  std::vector<std::string> names;
  for (const SceneCost& c : costs) names.push_back(c.scene.name);
  const auto part = [](Parts& parts, const std::string& name, std::size_t bars_) -> std::vector<double>& {
    for (auto& [n, heights] : parts)
      if (n == name) return heights;
    return parts.emplace_back(name, std::vector<double>(bars_, 0.0)).second;
  };

  if (!costs.empty() && !costs.front().ticks.empty()) {
    Parts parts;
    part(parts, "what every scene has", costs.size());
    for (std::size_t i = 0; i < costs.size(); ++i) {
      const SceneCost& c = costs[i];
      for (std::size_t r = c.chain.size(); r-- > 0;)
        if (saved(c, r) > 0) part(parts, c.chain[r].name, costs.size())[i] += saved(c, r);
      part(parts, "what every scene has", costs.size())[i] = c.ticks.back().instructions;
    }
    f.panels.push_back(bars("One tick of the servo, by table", "instructions per tick", names, parts));
  }

  Parts stages;
  std::vector<std::string> stage_bars;
  for (const SceneCost& c : costs) {
    if (!c.scene.vision) continue;
    stage_bars.push_back(c.scene.name + ", far");
    stage_bars.push_back(c.scene.name + ", near");
  }
  std::size_t bar = 0;
  for (const SceneCost& c : costs) {
    if (!c.scene.vision) continue;
    for (const StageRuns* runs : {&c.stages.far, &c.stages.near}) {
      for (const auto& stage : kStages)
        if (const auto it = runs->ran.find(stage); it != runs->ran.end() && runs->frames > 0)
          part(stages, stage, stage_bars.size())[bar] =
              static_cast<double>(it->second) / static_cast<double>(runs->frames);
      ++bar;
    }
  }
  if (!stage_bars.empty())
    f.panels.push_back(
        bars("One frame of vision, far from the cell and at it", "stages per frame", stage_bars, stages));

  Parts libraries, locked;
  for (std::size_t i = 0; i < costs.size(); ++i)
    for (const Process& p : costs[i].processes) {
      part(libraries, p.name, costs.size())[i] += static_cast<double>(p.libraries.size());
      part(locked, p.name, costs.size())[i] += p.locked_kB / 1024;
    }
  f.panels.push_back(bars("Libraries mapped, by process", "libraries", names, libraries));
  f.panels.push_back(bars("Locked memory, by process", "locked memory (MiB)", names, locked));
  f.note =
      "Instructions: callgrind's count below Servo::tick on one recorded run per scene, devices that only "
      "copy; "
      "tables are taken out one after the other, from the last to the first.";
  return f;
}

std::string reading(const std::vector<SceneCost>& costs) {
  const auto of = [&costs](const std::string& name) {
    return std::find_if(costs.begin(), costs.end(), [&](const SceneCost& c) { return c.scene.name == name; });
  };
  const auto opencv = [](const SceneCost& c) {
    std::int64_t n = 0;
    for (const Process& p : c.processes) n += p.opencv();
    return n;
  };
  std::string text;
  for (const char* name : {"free", "icsi"}) {
    const auto c = of(name);
    if (c == costs.end()) continue;
    text += fmt::format("{}{} runs {} processes with {} OpenCV libraries", text.empty() ? "" : ", ", name,
                        c->processes.size(), opencv(*c));
    if (!c->ticks.empty())
      text += fmt::format(" and {:.0f} instructions per tick", c->ticks.front().instructions);
  }
  std::size_t fell = 0, same = 0;
  std::vector<std::string> rose;
  for (const SceneCost& c : costs)
    for (std::size_t i = 0; i + 1 < c.ticks.size(); ++i) {
      const double s = saved(c, i);
      fell += s > 0 ? 1 : 0;
      same += s == 0 ? 1 : 0;
      if (s < 0) rose.push_back(fmt::format("{} of {}", c.chain[i].name, c.scene.name));
    }
  if (costs.front().ticks.empty())
    text += "; instructions were not counted: valgrind is not installed";
  else
    text += fmt::format(
        "; of {} tables taken out {} made the tick shorter and {} that are not in it left it as it was{}",
        fell + same + rose.size(), fell, same,
        rose.empty() ? "" : ", but longer without " + joined(rose, ", "));
  std::int64_t far = 0, contact = 0;
  for (const SceneCost& c : costs) {
    far += c.stages.far.frames;
    const auto it = c.stages.far.ran.find("contact");
    contact += it == c.stages.far.ran.end() ? 0 : it->second;
  }
  return text + fmt::format("; vision looked for contact in {} of {} frames far from the cell", contact, far);
}

}  // namespace

Result run_scenes(const Job& job) {
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

  return {.tables = {scenes_table(costs), processes_table(costs), removals_table(costs), steps_table(costs),
                     stages_table(costs)},
          .figures = {figure(costs)},
          .reading = reading(costs)};
}

}  // namespace punctum::report
