// Topic scenes: what each built-in scene costs, and that a table which a scene leaves out costs nothing.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "tools/report/scene_costs.hpp"
#include "tools/report/topic.hpp"

namespace punctum::report {
namespace {

const std::set<std::string> kEffects = {"membrane",  "cone",     "axis",      "damping",
                                        "repulsive", "friction", "vibration", "forbidden"};

std::vector<std::string> effects_of(const tools::Scene& scene) {
  std::vector<std::string> effects;
  for (const auto& t : tools::tables(scene)) {
    if (t.present && kEffects.contains(t.name)) {
      effects.push_back(t.name);
    }
  }
  return effects;
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
    const auto effects = effects_of(c.scene);
    t.add({c.scene.name, c.processes.size(), threads, libraries.size(), opencv_among(libraries), locked_kB,
           effects.size(), fmt::format("{}", fmt::join(effects, " ")),
           c.ticks.empty() ? kNone : c.ticks.front().instructions,
           c.ticks.empty() ? kNone : c.ticks.back().instructions,
           c.scene.vision ? c.stages.far.per_frame() : 0.0, c.scene.vision ? c.stages.near.per_frame() : 0.0,
           c.ticks.empty() ? "" : c.ticks.front().fault});
  }
  return t;
}

Table processes_table(const std::vector<SceneCost>& costs) {
  Table t{"scenes_processes",
          {"scene", "process", "threads", "libraries", "opencv_libraries", "locked_kB", "most_resident_kB"}};
  for (const SceneCost& c : costs) {
    for (const Process& p : c.processes) {
      t.add({c.scene.name, p.name, p.threads, p.libraries.size(), opencv_among(p.libraries), p.locked_kB,
             p.resident_kB});
    }
  }
  return t;
}

Table removals_table(const std::vector<SceneCost>& costs) {
  Table t{"scenes_tables",
          {"scene", "removed", "instructions_before", "instructions_after", "saved", "fault"}};
  for (const SceneCost& c : costs) {
    for (std::size_t i = 0; i + 1 < c.ticks.size(); ++i) {
      t.add({c.scene.name, c.chain[i].name, c.ticks[i].instructions, c.ticks[i + 1].instructions, c.saved(i),
             c.ticks[i + 1].fault});
    }
  }
  return t;
}

Table steps_table(const std::vector<SceneCost>& costs) {
  Table t{"scenes_steps", {"scene", "step", "instructions_per_tick"}};
  for (const SceneCost& c : costs) {
    if (!c.ticks.empty()) {
      for (const auto& [step, instructions] : c.ticks.front().steps) {
        t.add({c.scene.name, step, instructions});
      }
    }
  }
  return t;
}

Table stages_table(const std::vector<SceneCost>& costs) {
  Table t{"scenes_stages",
          {"scene", "stage", "frames", "ran", "frames_far", "ran_far", "frames_near", "ran_near"}};
  for (const SceneCost& c : costs) {
    if (!c.scene.vision) {
      continue;
    }
    for (const auto& stage : kStages) {
      t.add({c.scene.name, stage, c.stages.all.frames, c.stages.all.of(stage), c.stages.far.frames,
             c.stages.far.of(stage), c.stages.near.frames, c.stages.near.of(stage)});
    }
  }
  return t;
}

// A panel of bars. Its parts appear in the order in which they are first added to.
Panel& bars(Figure& f, const std::string& title, const std::string& label, std::vector<std::string> names) {
  Panel& p = f.panels.emplace_back(Panel{.title = title, .x_label = label});
  p.bars = Bars{.names = std::move(names)};
  return p;
}
void add(Panel& p, const std::string& part, std::size_t bar, double length) {
  auto& parts = p.bars->parts;
  auto it = std::find_if(parts.begin(), parts.end(), [&](const Series& s) { return s.name == part; });
  if (it == parts.end()) {
    it = parts.insert(it, {.name = part, .y = std::vector<double>(p.bars->names.size(), 0.0)});
  }
  it->y[bar] += length;
}

Figure figure(const std::vector<SceneCost>& costs) {
  Figure f{.name = "scenes"};
  std::vector<std::string> scenes, near_and_far;
  for (const SceneCost& c : costs) {
    scenes.push_back(c.scene.name);
    if (!c.scene.vision) {
      continue;
    }
    near_and_far.push_back(c.scene.name + ", far");
    near_and_far.push_back(c.scene.name + ", near");
  }
  if (!costs.front().ticks.empty()) {
    Panel& tables = bars(f, "One tick of the servo, by table of the scene", "instructions per tick", scenes);
    for (std::size_t i = 0; i < costs.size(); ++i) {
      add(tables, "what every scene has", i, costs[i].ticks.back().instructions);
      for (std::size_t r = costs[i].chain.size(); r-- > 0;) {
        if (const double saved = costs[i].saved(r); saved > 0) {
          add(tables, costs[i].chain[r].name, i, saved);
        }
      }
    }
    Panel& steps = bars(f, "The same, by step", "instructions per tick", scenes);
    for (std::size_t i = 0; i < costs.size(); ++i) {
      double rest = costs[i].ticks.front().instructions;
      for (const auto& [step, instructions] : costs[i].ticks.front().steps) {
        add(steps, step, i, instructions);
        rest -= instructions;
      }
      add(steps, "between them", i, rest);
    }
  }
  if (!near_and_far.empty()) {
    Panel& stages =
        bars(f, "One frame of vision, far from the cell and at it", "stages per frame", near_and_far);
    std::size_t bar = 0;
    for (const SceneCost& c : costs) {
      if (!c.scene.vision) {
        continue;
      }
      for (const StageRuns* runs : {&c.stages.far, &c.stages.near}) {
        for (const auto& stage : kStages) {
          if (const auto n = runs->of(stage); n > 0) {
            add(stages, stage, bar, static_cast<double>(n) / static_cast<double>(runs->frames));
          }
        }
        ++bar;
      }
    }
  }
  Panel& libraries = bars(f, "Libraries mapped, by process", "libraries", scenes);
  for (std::size_t i = 0; i < costs.size(); ++i) {
    for (const Process& p : costs[i].processes) {
      add(libraries, p.name, i, static_cast<double>(p.libraries.size()));
    }
  }
  f.note =
      "Instructions: what callgrind counts below Servo::tick, over one recorded run per scene with devices "
      "that "
      "only copy; the tables are taken out one after the other, the last first.";
  return f;
}

std::string reading(const std::vector<SceneCost>& costs) {
  const auto of = [&costs](const std::string& name) {
    return std::find_if(costs.begin(), costs.end(), [&](const SceneCost& c) { return c.scene.name == name; });
  };
  const auto opencv = [](const SceneCost& c) {
    std::int64_t n = 0;
    for (const Process& p : c.processes) {
      n += opencv_among(p.libraries);
    }
    return n;
  };
  std::string text;
  for (const char* name : {"free", "icsi"}) {
    const auto c = of(name);
    if (c == costs.end()) {
      continue;
    }
    text += fmt::format("{}{} runs {} processes with {} OpenCV libraries", text.empty() ? "" : ", ", name,
                        c->processes.size(), opencv(*c));
    if (!c->ticks.empty()) {
      text += fmt::format(" and {:.0f} instructions per tick", c->ticks.front().instructions);
    }
  }
  std::size_t fell = 0, same = 0;
  std::vector<std::string> rose;
  for (const SceneCost& c : costs) {
    for (std::size_t i = 0; i + 1 < c.ticks.size(); ++i) {
      const double s = c.saved(i);
      fell += s > 0 ? 1 : 0;
      same += s == 0 ? 1 : 0;
      if (s < 0) {
        rose.push_back(fmt::format("{} of {}", c.chain[i].name, c.scene.name));
      }
    }
  }
  if (costs.front().ticks.empty()) {
    text += "; instructions were not counted: valgrind is not installed";
  } else {
    text += fmt::format(
        "; of {} tables taken out {} made the tick shorter and {} that are not in it left it as it was{}",
        fell + same + rose.size(), fell, same,
        rose.empty() ? std::string() : ", but longer without " + fmt::format("{}", fmt::join(rose, ", ")));
  }
  std::int64_t far = 0, contact = 0;
  for (const SceneCost& c : costs) {
    far += c.stages.far.frames;
    contact += c.stages.far.of("contact");
  }
  return text + fmt::format("; vision looked for contact in {} of {} frames far from the cell", contact, far);
}

}  // namespace

Result run_scenes(const Job& job) {
  const std::vector<SceneCost> costs = measure_scenes(job);
  return {.tables = {scenes_table(costs), processes_table(costs), removals_table(costs), steps_table(costs),
                     stages_table(costs)},
          .figures = {figure(costs)},
          .reading = reading(costs)};
}

}  // namespace punctum::report
