#include "tools/punctum/event_log.hpp"

#include <nlohmann/json.hpp>

#include "tools/shared/csv.hpp"
#include "tools/shared/event_words.hpp"

namespace punctum::tools {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

Json event_row(const rt::Event& e) {
  const EventWords words = words_of(e);
  Json row = {{"t_s", e.t_s}, {"tick", e.tick}, {"event", words.event}, {"what", words.what}};
  if (words.cell) {
    row["cell"] = *words.cell;
  }
  if (words.is_command) {
    row["value"] = words.value ? Json(*words.value) : Json(nullptr);
    if (!words.target.empty()) {
      row["target"] = words.target;
    }
    row["writer"] = words.writer.empty() ? Json(e.writer) : Json(words.writer);
  }
  return row;
}

std::vector<Json> read_events(const std::string& path) {
  std::vector<Json> events;
  CsvReader line(path);
  while (line.next()) {
    const auto t_s = line.number("t_s"), tick = line.number("tick");
    if (!t_s || !tick || !(*tick >= 0 && *tick < 1e18)) {
      continue;
    }
    Json row = {{"t_s", *t_s},
                {"tick", static_cast<std::uint64_t>(*tick)},
                {"event", line.text("event")},
                {"what", line.text("what")}};
    for (const char* name : {"cell", "value"}) {
      if (const auto v = line.number(name)) {
        row[name] = *v;
      }
    }
    for (const char* name : {"target", "writer"}) {
      if (!line.text(name).empty()) {
        row[name] = line.text(name);
      }
    }
    events.push_back(std::move(row));
  }
  return events;
}

}  // namespace punctum::tools
