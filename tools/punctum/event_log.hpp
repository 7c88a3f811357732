// events.csv: what happened in a run, one row each, written as it comes; and the same rows in report.json.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "rt/station/event.hpp"

namespace punctum::tools {

inline constexpr const char* kEventColumns = "t_s,tick,event,what,cell,value,target,writer\n";

[[nodiscard]] nlohmann::ordered_json event_row(const rt::Event& e);  // of report.json
[[nodiscard]] std::string event_line(const rt::Event& e);            // of events.csv
// From events.csv, as report.json lists them; empty where there is no such file.
[[nodiscard]] std::vector<nlohmann::ordered_json> read_events(const std::string& path);

}  // namespace punctum::tools
