// report.json, the summary on the screen and the figure of a run.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/sim/world.hpp"
#include "rt/station/station.hpp"
#include "tools/measures.hpp"
#include "tools/scene.hpp"

namespace punctum::tools {

enum class Outcome : std::uint8_t { done, cell_lost, not_injected, time_limit, stopped, fault, core_died };
[[nodiscard]] const char* name(Outcome o) noexcept;

struct Restart {
  double t_s = 0;
  std::string why;
};

// What vision itself measured against the truth, from its table of observations.
struct ContourError {
  double rms_um = 0, p95_um = 0;
  std::uint64_t frames = 0;
};
[[nodiscard]] std::optional<ContourError> read_contour_error(const std::string& obs_csv);

struct RunEnd {
  Outcome outcome = Outcome::done;
  std::string outcome_detail;
  double wall_s = 0;
  std::uint64_t rows = 0, rows_every = 1, samples_lost = 0;
  std::vector<Restart> vision_restarts;
  std::optional<sim::UnattendedEnd> unattended;  // after the death of the core
};

[[nodiscard]] tl::expected<void, std::string> write_report(const std::string& path, const Scene& scene,
                                                           const RunEnd& end, const Measures& m,
                                                           const rt::CoreStatus& core,
                                                           const std::optional<ContourError>& contour);
[[nodiscard]] std::string summary(const Scene& scene, const RunEnd& end, const Measures& m,
                                  const rt::CoreStatus& core, const std::optional<ContourError>& contour);
// The rights the core did not get, and how to get them; empty when it has all it needs.
[[nodiscard]] std::string missing_rights(const rt::CoreStatus& core);

// Force, depth and phases over time into FOLDER/figure.png, by gnuplot. The error says why there is none.
[[nodiscard]] tl::expected<std::string, std::string> draw_figure(const std::string& folder,
                                                                 const Scene& scene, const Measures& m,
                                                                 std::uint64_t rows);

}  // namespace punctum::tools
