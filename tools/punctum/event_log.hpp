// What happened in a run, one row each, as report.json lists it. events.csv: tools/shared/event_words.hpp.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "rt/station/event.hpp"

namespace punctum::tools {

[[nodiscard]] nlohmann::ordered_json event_row(const rt::Event& e);  // of report.json

struct EventTable {
  std::vector<nlohmann::ordered_json> list;  // as report.json lists them
  std::uint64_t unreadable = 0;              // rows that are damaged
  double unreadable_s = 0;                   // of the last row before the first of them
  std::uint64_t cut_off = 0;                 // rows in the middle of which the file ends
};
// Of events.csv; empty where there is no such file.
[[nodiscard]] EventTable read_events(const std::string& path);

}  // namespace punctum::tools
