// The rows of samples.csv: one per tick, the same text wherever they are written.
#pragma once

#include <string>

#include "rt/station/telemetry.hpp"

namespace punctum::tools {

// What a row tells of the simulated world.
struct RowTruth {
  double tip_m[3] = {};
  bool cell = false;  // the rest is of it
  double axial_force_N = 0, gap_m = 0, wd_m = 0, a_m = 0;
  bool contact = false, punctured = false, lost = false;
};

[[nodiscard]] std::string sample_columns();  // with the line end
// A row in place of what `out` held; null: nothing is simulated.
void write_sample_row(const rt::TelemetrySample& s, const RowTruth* truth, std::string& out);

}  // namespace punctum::tools
