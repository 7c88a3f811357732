// What must be true of a run in which vision paused: an injection that lasts so long that no pause outlasts
// it.
#pragma once

#include <algorithm>

#include "tests/support/programs.hpp"

namespace punctum::e2e {

inline constexpr double kPause_s = 5;

// The needle stays in the cell for a while, and is drawn back slowly.
inline std::vector<std::string> slow_injection(std::vector<std::string> more) {
  std::vector<std::string> args{"run",   "icsi",
                                "--set", "sim.operator.dwell_s=7",
                                "--set", "sim.operator.withdrawal_speed_um_s=6",
                                "--set", "injector.max_open_s=8"};
  args.insert(args.end(), more.begin(), more.end());
  return args;
}

// While the newest observation is older than the core takes for sight, the needle may only be drawn back.
// Returns for how many rows that was so.
inline std::size_t expect_no_advance_while_stale(const Table& samples) {
  std::size_t stale = 0;
  double deepest_m = 0;
  bool before = false;
  for (std::size_t i = 0; i < samples.rows.size(); ++i) {
    const bool now = (static_cast<unsigned>(samples.number(i, "alarms")) & rt::alarm_vision_stale) != 0;
    const double inward_m = -samples.number(i, "cmd_x_m");
    if (now && before) {
      EXPECT_LE(inward_m, deepest_m + 0.2e-6) << samples.text(i, "t_s");
    }
    deepest_m = now && before ? std::max(deepest_m, inward_m) : inward_m;
    before = now;
    stale += now ? 1 : 0;
  }
  return stale;
}

// In the second after from_s both pipettes and both membranes are seen, and are where the simulation has
// them.
inline void expect_everything_found(const Table& obs, double from_s) {
  int seen = 0;
  for (std::size_t i = 0; i < obs.rows.size(); ++i) {
    const double t_s = obs.number(i, "t_s");
    if (t_s < from_s || t_s > from_s + 1) {
      continue;
    }
    EXPECT_EQ(obs.text(i, "verdict"), "ok") << t_s;
    EXPECT_EQ(obs.text(i, "inner_ok"), "1") << t_s;
    EXPECT_LT(obs.number(i, "outer_rms_um"), 0.8) << t_s;  // a pixel
    EXPECT_LT(obs.number(i, "inner_rms_um"), 0.8) << t_s;
    EXPECT_LT(std::abs(obs.number(i, "tip_error_um")), 2.5) << t_s;
    ++seen;
  }
  EXPECT_GT(seen, 5) << "of the second after " << from_s << " s";
}

}  // namespace punctum::e2e
