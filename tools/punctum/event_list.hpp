// The events of a run as its report lists them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt/station/event.hpp"

namespace punctum::tools {

// An alarm may flicker for hours: it must push no fault and no command out of the list.
struct EventList {
  static constexpr std::size_t kMostAlarms = 1000;
  static constexpr std::size_t kMostOthers = 10'000;

  void add(const rt::Event& event) {
    const bool alarm = event.kind == rt::Event::alarm_on || event.kind == rt::Event::alarm_off;
    std::size_t& count = alarm ? alarms : others;
    if (count >= (alarm ? kMostAlarms : kMostOthers)) {
      ++not_listed;
      return;
    }
    ++count;
    list.push_back(event);
  }

  std::vector<rt::Event> list;
  std::size_t alarms = 0, others = 0;
  std::uint64_t not_listed = 0;
  std::uint64_t lost = 0;  // overwritten before they were read
};

}  // namespace punctum::tools
