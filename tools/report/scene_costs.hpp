// What each built-in scene costs: its processes as the kernel shows them, the instructions of one tick as
// valgrind counts them, and the stages of vision that ran on its frames.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tools/report/topic.hpp"
#include "tools/report/watched_programs.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::report {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

[[nodiscard]] std::int64_t opencv_among(const std::set<std::string>& libraries);

// A table that is taken out of a scene, with those that need it, and the overrides that do so.
struct Removal {
  std::string name;
  std::vector<std::string> overrides;
  tools::Scene left;
};

// Tables that are taken out one after the other until none is left: always the one that takes the fewest
// others with it, of several the last.
[[nodiscard]] std::vector<Removal> take_apart(const tools::Scene& scene);

struct TickCost {
  double instructions = kNone;            // per tick
  std::map<std::string, double> steps{};  // of it, by step of the tick, where it is a function of its own
  std::string fault{};                    // that the servo latched; "none"
};

inline const std::vector<std::string> kStages = {"prepare", "holder", "needle",  "erase",  "start",
                                                 "outer",   "inner",  "measure", "contact"};
struct StageRuns {
  std::int64_t frames = 0;
  std::map<std::string, std::int64_t> ran{};  // by stage, in frames
  [[nodiscard]] std::int64_t of(const std::string& stage) const;
  [[nodiscard]] double per_frame() const;
};
// Frames with the needle far from the cell, and near it. Frames between the two, and those that do not show
// both, count in `all` only.
struct Stages {
  StageRuns far, near, all;
};

struct SceneCost {
  tools::Scene scene;
  std::vector<Process> processes{};
  std::vector<Removal> chain{};   // empty without valgrind
  std::vector<TickCost> ticks{};  // of the whole scene, then after each removal
  Stages stages{};

  [[nodiscard]] double saved(std::size_t removal) const {
    return ticks[removal].instructions - ticks[removal + 1].instructions;
  }
};

// Of all built-in scenes that this build can run. Starts `punctum`, and valgrind where it is installed. In a
// quick measurement only `icsi` is taken apart table by table, the others in one step.
[[nodiscard]] std::vector<SceneCost> measure_scenes(const Job& job);

}  // namespace punctum::report
