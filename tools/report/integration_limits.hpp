// Limits of the integration methods: stability, stiffness of a wall, drift of the energy.
#pragma once

#include <cmath>
#include <cstdint>

#include "tools/report/topic.hpp"

namespace punctum::report {

// Largest stable w h per method and damping ratio, beside the published one.
[[nodiscard]] Table stability_limits();

struct StiffnessSweep {
  Table table{.name = "integrators_stiffness", .columns = {"method", "stiffness_N_m", "wh", "error_m"}};
  Panel panel{.title = "wall, h = 1 ms, contact located",
              .x_label = "stiffness of the wall [N/m]",
              .y_label = "error of the last position [m]",
              .log_x = true,
              .log_y = true};
};
[[nodiscard]] StiffnessSweep over_stiffness();

struct EnergyDrift {
  Table table{.name = "integrators_energy", .columns = {"method", "steps", "relative_energy_error"}};
  Panel panel{.title = "energy of an undamped body bouncing on a wall of 10 kN/m, h = 0.25 ms",
              .x_label = "steps",
              .y_label = "energy gained or lost, of the initial",
              .log_x = true,
              .log_y = true};
  double shipped = std::nan("");  // of the closed form, after all steps
};
[[nodiscard]] EnergyDrift energy_drift(std::int64_t steps);

}  // namespace punctum::report
