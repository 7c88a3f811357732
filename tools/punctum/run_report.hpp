// report.json and the summary of a run on the screen.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/sim/world.hpp"
#include "rt/station/core_status.hpp"
#include "rt/station/run_end.hpp"
#include "tools/punctum/event_list.hpp"
#include "tools/punctum/measures.hpp"
#include "tools/punctum/vision_process.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

// What vision itself measured against the truth, from its table of observations.
struct ContourError {
  double rms_um = 0, p95_um = 0;
  std::uint64_t frames = 0;
};
[[nodiscard]] std::optional<ContourError> read_contour_error(const std::string& obs_csv);

struct RunResult {
  rt::RunEnd end = rt::RunEnd::done;
  std::string detail;  // of a fault or of the death of the core
  double wall_s = 0;
  std::uint64_t rows = 0, rows_every = 1, samples_lost = 0;
  std::uint64_t samples_unusable = 0;   // they named what does not exist
  std::optional<double> silent_from_s;  // the core ticked, but none of its samples could be read any more
  std::vector<Restart> vision_restarts;
  std::optional<sim::UnattendedEnd> unattended;  // what the devices did after the death of the core
};

[[nodiscard]] tl::expected<void, std::string> write_report(const std::string& path, const Scene& scene,
                                                           const RunResult& result, const Measures& m,
                                                           const EventList& events,
                                                           const rt::CoreStatus& core,
                                                           const std::optional<ContourError>& contour);
[[nodiscard]] std::string summary(const Scene& scene, const RunResult& result, const Measures& m,
                                  const rt::CoreStatus& core, const std::optional<ContourError>& contour);
// The rights the core did not get, and how to get them; empty when it has all it needs.
[[nodiscard]] std::string missing_rights(const rt::CoreStatus& core);

}  // namespace punctum::tools
