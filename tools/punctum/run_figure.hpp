// Force, depth, phases, alarms and events of a run over its time.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/punctum/time_chart.hpp"

namespace punctum::tools {

// From FOLDER/samples.csv and the facts of report.json. A chart without panels: nothing was recorded.
[[nodiscard]] TimeChart chart_of_run(const std::string& folder, const nlohmann::ordered_json& facts);

}  // namespace punctum::tools
