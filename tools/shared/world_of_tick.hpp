// Which snapshot of the simulated world belongs to a tick of the core, and what is told of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hal/sim/bench.hpp"
#include "hal/sim/truth.hpp"
#include "rt/station/telemetry.hpp"
#include "tools/shared/sample_row.hpp"

namespace punctum::tools {

// The plant publishes before the core does: the snapshot of a tick is there, or it was overwritten. It is of
// the time at which the tick began, late by less than a period. Times of the run count from its first tick;
// where the first releases were missed, the plant began earlier.
class WorldOfTick {
 public:
  explicit WorldOfTick(std::int64_t period_ns) : period_ns_(period_ns) {}

  // Null: there is none. Samples come in their order; `next(snapshot)` gives the snapshots in theirs, and
  // false where there is none now.
  template <class Next>
  [[nodiscard]] const sim::Snapshot* operator()(const rt::TelemetrySample& s, const Next& next) {
    for (;;) {
      if (!pending_) {
        if (!next(world_)) {
          return nullptr;
        }
        tick_ = static_cast<std::uint64_t>((world_.t_ns - world_.start_ns) / period_ns_);
        const double first_tick_s =
            static_cast<double>(s.tick) * 1e-9 * static_cast<double>(period_ns_) - s.t_s;
        world_.start_ns += std::llround(1e9 * std::clamp(first_tick_s, 0.0, kLatestFirstTick_s));
      }
      pending_ = tick_ > s.tick;  // of a later tick: kept for that
      if (pending_) {
        return nullptr;
      }
      if (tick_ == s.tick) {
        return &world_;
      }
    }
  }

 private:
  static constexpr double kLatestFirstTick_s = 1e6;  // later than that is no start

  std::int64_t period_ns_;
  bool pending_ = false;  // world_ is of a tick whose sample has not come yet
  std::uint64_t tick_ = 0;
  sim::Snapshot world_;
};

// What samples.csv and recordings tell of it.
[[nodiscard]] inline RowTruth row_truth(const sim::SimConfig& config, const sim::Snapshot& world) {
  const hal::Vec3 tip = world.stage.tip_m;
  RowTruth truth{.tip_m = {tip.x(), tip.y(), tip.z()}, .cell = world.has_cell != 0};
  if (truth.cell) {
    const sim::Truth t = sim::truth_of(config, world);
    truth.axial_force_N = t.axial_force_N;
    truth.gap_m = t.gap_m;
    truth.wd_m = t.wd_m;
    truth.a_m = t.a_m;
    truth.contact = t.contact;
    truth.punctured = t.punctured;
    truth.lost = t.lost;
  }
  return truth;
}

}  // namespace punctum::tools
