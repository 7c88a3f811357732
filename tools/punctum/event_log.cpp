#include "tools/punctum/event_log.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "rt/forces/list.hpp"
#include "rt/station/command.hpp"
#include "rt/station/station.hpp"
#include "tools/punctum/facts.hpp"
#include "tools/shared/csv.hpp"

namespace punctum::tools {
namespace {

using Json = nlohmann::ordered_json;

// What an event is about, in words; a number where this program knows no word.
std::string subject(const rt::Event& e) {
  const auto named = [&e](auto limit, auto text) {
    return e.what < static_cast<std::uint64_t>(limit) ? std::string(text(e.what)) : std::to_string(e.what);
  };
  switch (e.kind) {
    case rt::Event::fault:
    case rt::Event::fault_cleared:
      return named(rt::kFaults, [](auto n) { return rt::name(static_cast<rt::Fault>(n)); });
    case rt::Event::alarm_on:
    case rt::Event::alarm_off:
      return named(std::size(rt::kAlarmNames), [](auto n) { return rt::kAlarmNames[n]; });
    case rt::Event::phase:
      return named(rt::kPhases, [](auto n) { return rt::name(static_cast<rt::Phase>(n)); });
    case rt::Event::command:
    case rt::Event::command_refused:
      return named(rt::kCommandKinds, [](auto n) { return rt::name(static_cast<rt::Command::Kind>(n)); });
    case rt::Event::ended:
      return named(rt::kRunEnds, [](auto n) { return rt::name(static_cast<rt::RunEnd>(n)); });
    default:
      return std::to_string(e.what);
  }
}

}  // namespace

Json event_row(const rt::Event& e) {
  const bool known = e.kind < static_cast<std::uint64_t>(rt::kEventKinds);
  Json row = {{"t_s", e.t_s},
              {"tick", e.tick},
              {"event", known ? rt::name(static_cast<rt::Event::Kind>(e.kind)) : "unknown"},
              {"what", subject(e)}};
  if (e.kind == rt::Event::phase) {
    row["cell"] = e.value;
  }
  if (e.kind == rt::Event::command || e.kind == rt::Event::command_refused) {
    row["value"] = std::isfinite(e.value) ? Json(e.value) : Json(nullptr);
    if (e.what == rt::Command::effect_gain && e.target < rt::effect_count) {
      row["target"] = rt::effect_name(e.target);
    }
    row["writer"] =
        e.writer < rt::kCommandWriterCount ? Json(rt::kCommandWriters[e.writer]->name) : Json(e.writer);
  }
  return row;
}

std::string event_line(const rt::Event& e) {
  const Json row = event_row(e);
  const auto number = [&row](const char* name) {
    const auto v = number_in(row, name);
    return v ? fmt::format("{}", *v) : std::string();
  };
  const Json& writer = fact(row, "writer");
  return fmt::format("{:.6f},{},{},{},{},{},{},{}\n", e.t_s, e.tick, text_in(row, "event"),
                     text_in(row, "what"), number("cell"), number("value"), text_in(row, "target"),
                     writer.is_string() ? writer.get<std::string>() : number("writer"));
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
