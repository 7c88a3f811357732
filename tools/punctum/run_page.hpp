// report.html: everything a lab keeps of a run, on one page that needs nothing beside itself, no network and
// no script.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/punctum/time_chart.hpp"

namespace punctum::tools {

// From the facts of report.json; FOLDER gives the frames and the scene's text. An empty drawing: none was
// made.
[[nodiscard]] std::string run_page(const std::string& folder, const nlohmann::ordered_json& facts,
                                   const std::string& drawing);

struct ComparedRun {
  std::string name;  // of its folder
  nlohmann::ordered_json facts;
  TimeChart chart;
};
// One table with a row per run, and their curves in one drawing.
[[nodiscard]] std::string comparison_page(const std::vector<ComparedRun>& runs);
// The same table for a terminal.
[[nodiscard]] std::string comparison_text(const std::vector<ComparedRun>& runs);

}  // namespace punctum::tools
