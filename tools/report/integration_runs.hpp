// The problems of topic integrators, with every method and step that runs on them: errors and times.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "hal/sim/plant/cell.hpp"
#include "tools/report/topic.hpp"

namespace punctum::report {

inline constexpr double kRounding = 1e-15;  // m, s: smaller errors count as this
inline constexpr double kTick_s = 1e-3;     // no step is longer, since the held force changes there

// Of a whole problem.
template <class Law>
[[nodiscard]] std::int64_t steps_of(std::int64_t per_tick) {
  return std::llround(Law::end_s / kTick_s) * per_tick;
}

// At the end of a problem. NaN: not known.
struct IntegrationError {
  double x_m = std::nan(""), v_m_s = std::nan("");
  double event_s = std::nan("");  // the largest; NaN when the number of events is wrong
};

struct IntegrationRun {
  std::string method{};
  bool located = true;  // steps end on the events
  bool single = false;  // float
  std::int64_t per_tick = 1;
  IntegrationError error{};
  Timed timed;
  bool shipped = false;
};

enum class Measure : std::uint8_t { position, event };

struct IntegrationProblem {
  std::string name{}, title{};
  Measure measure = Measure::position;
  double end_s = 0;                     // simulated time
  std::shared_ptr<const void> owned{};  // what the runs refer to
  std::vector<IntegrationRun> runs{};
  std::vector<Work> works{};  // of runs, time per tick

  [[nodiscard]] double error_of(const IntegrationRun& r) const {
    const double e = measure == Measure::position ? r.error.x_m : r.error.event_s;
    return std::isfinite(e) ? std::max(e, kRounding) : std::numeric_limits<double>::infinity();
  }
};

// Handle, wall and puncture, in this order. `cell`: into which the needle goes.
[[nodiscard]] std::vector<IntegrationProblem> integration_problems(const sim::Cell& cell, bool quick);

// Fills in `works`: time per simulated millisecond.
void measure_times(IntegrationProblem& problem, double seconds, bool quick);

}  // namespace punctum::report
