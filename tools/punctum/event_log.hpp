// What happened in a run, one row each, as report.json lists it. events.csv: tools/shared/event_words.hpp.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "rt/station/event.hpp"

namespace punctum::tools {

[[nodiscard]] nlohmann::ordered_json event_row(const rt::Event& e);  // of report.json
// From events.csv, as report.json lists them; empty where there is no such file.
[[nodiscard]] std::vector<nlohmann::ordered_json> read_events(const std::string& path);

}  // namespace punctum::tools
