// What each built-in scene costs, measured: its processes as the kernel shows them, the instructions of one
// tick as valgrind counts them, the stages of vision as its frames tell.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tools/report/topic.hpp"
#include "tools/scene.hpp"

namespace punctum::report {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// The most of everything that a process was seen to have.
struct Process {
  std::string name{};
  std::size_t threads = 0;
  std::set<std::string> libraries{};
  double locked_kB = 0, resident_kB = 0;
};
[[nodiscard]] std::int64_t opencv_among(const std::set<std::string>& libraries);

// One thing less: the table that goes, with those that cannot be without it, and the overrides that do it.
struct Removal {
  std::string name;
  std::vector<std::string> overrides;
  tools::Scene left;
};

// Tables taken out one after the other, always the one that takes the fewest others with it, the last first,
// until none is left.
[[nodiscard]] std::vector<Removal> take_apart(const tools::Scene& scene);

struct TickCost {
  double instructions = kNone;            // per tick
  std::map<std::string, double> steps{};  // of it, by step of the tick, where it is a function of its own
  std::string fault{};                    // what the servo latched; "none" if all went well
};

inline const std::vector<std::string> kStages = {"prepare", "holder", "needle",  "erase",  "start",
                                                 "outer",   "inner",  "measure", "contact"};
struct StageRuns {
  std::int64_t frames = 0;
  std::map<std::string, std::int64_t> ran{};  // by stage, in frames
  [[nodiscard]] std::int64_t of(const std::string& stage) const;
  [[nodiscard]] double per_frame() const;
};
// Far from the cell and at it; frames between, and those in which either is not seen, count in `all` only.
struct Stages {
  StageRuns far, near, all;
};

struct SceneCost {
  tools::Scene scene;
  std::vector<Process> processes{};
  std::vector<Removal> chain{};   // empty without valgrind
  std::vector<TickCost> ticks{};  // as it is, then after each removal
  Stages stages{};

  [[nodiscard]] double saved(std::size_t removal) const {
    return ticks[removal].instructions - ticks[removal + 1].instructions;
  }
};

// Of all built-in scenes that this build can run. Starts `punctum`, and valgrind where it is installed. A
// quick measurement takes only `icsi` apart table by table, the others at one go.
[[nodiscard]] std::vector<SceneCost> measure_scenes(const Job& job);

}  // namespace punctum::report
