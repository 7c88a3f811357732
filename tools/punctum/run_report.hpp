// The facts of report.json and the summary of a run on the screen.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hal/sim/world.hpp"
#include "rt/station/core_status.hpp"
#include "rt/station/run_end.hpp"
#include "tools/punctum/event_list.hpp"
#include "tools/punctum/measures.hpp"
#include "tools/punctum/not_kept.hpp"
#include "tools/punctum/vision_process.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/witness.hpp"

namespace punctum::tools {

// What vision's table of observations tells of a run.
struct PicturesSeen {
  std::uint64_t all = 0;
  std::uint64_t unusable = 0;  // could not be read, had another size, or are of one grey
  std::uint64_t empty = 0;     // showed neither pipettes nor membranes; the unusable ones are among them
  // By vision itself, against the truth; of pictures in which it could.
  std::uint64_t compared = 0;
  double contour_rms_um = 0, contour_p95_um = 0;

  [[nodiscard]] bool show_nothing() const { return 2 * empty > all; }
};
[[nodiscard]] PicturesSeen read_pictures(const std::string& obs_csv);

// Of a run whose samples have a hole, or end before it does.
void forget_what_needs_every_sample(nlohmann::ordered_json& facts);

// What a run came to, beside its measures. The dose, asked and given, stands there with each cell.
struct RunResult {
  rt::RunEnd end = rt::RunEnd::done;
  std::string detail;  // of a fault or of the death of the core
  Whereabouts needle;  // at the end, after the devices have come to rest
  double wall_s = 0;
  std::vector<NotKept> not_kept;  // in the order of time
  late::Explanations late;        // ticks that missed a release, each with its cause
  std::uint64_t rows = 0, rows_every = 1, samples_lost = 0;
  std::uint64_t samples_unusable = 0;   // they named what does not exist
  std::optional<double> silent_from_s;  // the core ticked, but none of its samples could be read any more
  std::vector<Restart> vision_restarts;
  std::optional<sim::UnattendedEnd> unattended;  // what the devices did after the death of the core
};

// All of report.json but what was run and where, which lab_report.hpp adds.
[[nodiscard]] nlohmann::ordered_json report_facts(const Scene& scene, const RunResult& result,
                                                  const Measures& m, const EventList& events,
                                                  const rt::CoreStatus& core, const PicturesSeen& pictures);
// "inside the cell, 23.1 um past its membrane", "outside the cell", ...
[[nodiscard]] std::string in_words(const Whereabouts& needle);
[[nodiscard]] std::string summary(const Scene& scene, const RunResult& result, const Measures& m,
                                  const rt::CoreStatus& core, const PicturesSeen& pictures, bool coloured);
// A fault as it is latched: its cause, what to do, and what clears it.
[[nodiscard]] std::string fault_text(rt::Fault fault, double t_s, bool coloured);
// The rights the core did not get, and how to get them; empty when it has all it needs.
[[nodiscard]] std::string missing_rights(const rt::CoreStatus& core);

}  // namespace punctum::tools
