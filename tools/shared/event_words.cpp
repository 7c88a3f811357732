#include "tools/shared/event_words.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <iterator>

#include "rt/forces/list.hpp"

namespace punctum::tools {
namespace {

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

EventWords words_of(const rt::Event& e) {
  const bool known = e.kind < static_cast<std::uint64_t>(rt::kEventKinds);
  EventWords words;
  words.event = known ? rt::name(static_cast<rt::Event::Kind>(e.kind)) : "unknown";
  words.what = subject(e);
  words.is_command = e.kind == rt::Event::command || e.kind == rt::Event::command_refused;
  if (e.kind == rt::Event::phase) {
    words.cell = e.value;
  }
  if (words.is_command) {
    words.value = std::isfinite(e.value) ? std::optional(e.value) : std::nullopt;
    words.target =
        e.what == rt::Command::effect_gain && e.target < rt::effect_count ? rt::effect_name(e.target) : "";
    words.writer = e.writer < rt::kCommandWriterCount ? rt::kCommandWriters[e.writer]->name : "";
  }
  return words;
}

std::string event_line(const rt::Event& e) {
  const EventWords w = words_of(e);
  const auto number = [](const std::optional<double>& v) {
    return v ? fmt::format("{}", *v) : std::string();
  };
  const std::string writer = w.is_command && w.writer.empty() ? std::to_string(e.writer) : w.writer;
  return fmt::format("{:.6f},{},{},{},{},{},{},{}\n", e.t_s, e.tick, w.event, w.what, number(w.cell),
                     number(w.value), w.target, writer);
}

}  // namespace punctum::tools
