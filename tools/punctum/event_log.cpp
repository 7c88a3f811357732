#include "tools/punctum/event_log.hpp"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "tools/shared/csv.hpp"
#include "tools/shared/event_words.hpp"

namespace punctum::tools {
namespace {

using Json = nlohmann::ordered_json;

// Nothing if the row was cut off or is damaged.
std::optional<Json> event_of(const CsvReader& line) {
  const auto t_s = line.number("t_s"), tick = line.number("tick");
  if (!line.is_whole() || !t_s || !tick || !(*tick >= 0 && *tick < 1e18)) {
    return std::nullopt;
  }
  Json row = {{"t_s", *t_s},
              {"tick", static_cast<std::uint64_t>(*tick)},
              {"event", line.text("event")},
              {"what", line.text("what")}};
  for (const char* name : {"cell", "value"}) {
    if (const auto v = line.number(name)) {
      row[name] = *v;
    } else if (!line.text(name).empty()) {
      return std::nullopt;
    }
  }
  for (const char* name : {"target", "writer"}) {
    if (!line.text(name).empty()) {
      row[name] = line.text(name);
    }
  }
  return row;
}

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

EventTable read_events(const std::string& path) {
  EventTable events;
  double last_s = 0;
  CsvReader line(path);
  while (line.next()) {
    if (auto row = event_of(line)) {
      last_s = row->at("t_s").get<double>();
      events.list.push_back(std::move(*row));
    } else if (line.is_cut_off()) {
      ++events.cut_off;
    } else {
      events.unreadable_s = events.unreadable++ == 0 ? last_s : events.unreadable_s;
    }
  }
  return events;
}

}  // namespace punctum::tools
