// An event of the core in words, as events.csv and report.json have it.
#pragma once

#include <optional>
#include <string>

#include "rt/station/event.hpp"

namespace punctum::tools {

struct EventWords {
  std::string event;            // "unknown" where this program knows no word
  std::string what;             // what it is about; a number likewise
  std::optional<double> cell;   // of a phase
  bool is_command = false;      // the rest is of one
  std::optional<double> value;  // nothing: not a finite number
  std::string target;           // the force effect that it is for
  std::string writer;           // whose it is; empty: unknown, see Event::writer
};
[[nodiscard]] EventWords words_of(const rt::Event& e);

inline constexpr const char* kEventColumns = "t_s,tick,event,what,cell,value,target,writer\n";
[[nodiscard]] std::string event_line(const rt::Event& e);  // of events.csv

}  // namespace punctum::tools
