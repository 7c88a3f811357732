#include "tools/punctum/run_figure.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "rt/forces/list.hpp"
#include "rt/station/phase.hpp"
#include "tools/punctum/facts.hpp"
#include "tools/shared/csv.hpp"

namespace punctum::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kShortest_s = 0.01;  // an alarm that came and went within it was flickering

// A curve, and the column that it shows, scaled.
struct Source {
  Curve curve;
  std::string column;
  double scale = 1;
  bool always = false;  // also where it is zero all along
  bool seen = false;    // it differs from zero somewhere
};

// An effect that is not in the scene is zero all along, and not shown.
ChartPanel panel(const char* y_label, std::vector<Source>& sources) {
  ChartPanel p{.y_label = y_label, .curves = {}};
  for (Source& s : sources) {
    if (!s.curve.empty() && (s.seen || s.always)) {
      p.curves.push_back(std::move(s.curve));
    }
  }
  return p;
}

int colour_of(const std::string& phase) {
  for (int i = 0; i < rt::kPhases; ++i) {
    if (phase == rt::name(static_cast<rt::Phase>(i))) {
      return i;
    }
  }
  return 0;
}

void add_phases(const Json& facts, TimeChart& chart) {
  const std::vector<Json> phases = list_in(facts, "phases");
  for (const Json& p : phases) {
    const std::string name = text_in(p, "name");
    chart.bands.push_back({number_in(p, "start_s").value_or(0), number_in(p, "end_s").value_or(0),
                           phases.size() > 1 ? name : "", colour_of(name)});
  }
}

// Faults, their reset, commands and the end as marks; alarms as lanes, from when they came to when they went.
void add_events(const Json& facts, TimeChart& chart) {
  std::map<std::string, Lane> lanes;
  std::map<std::string, double> open;
  const auto close = [&](const std::string& alarm, double at_s) {
    if (const auto it = open.find(alarm); it != open.end()) {
      Lane& lane = lanes[alarm];
      lane.name = alarm;
      if (!lane.spans.empty() && it->second - lane.spans.back().to_s < kShortest_s) {
        lane.spans.back().to_s = at_s;
      } else {
        lane.spans.push_back({it->second, at_s});
      }
      open.erase(it);
    }
  };
  for (const Json& e : list_in(facts, "events")) {
    const std::string kind = text_in(e, "event"), what = text_in(e, "what");
    const double t_s = number_in(e, "t_s").value_or(0);
    if (kind == "alarm_on") {
      open.emplace(what, t_s);
    } else if (kind == "alarm_off") {
      close(what, t_s);
    } else if (kind == "fault") {
      chart.instants.push_back({t_s, "fault: " + what, true});
    } else if (kind == "fault_cleared") {
      chart.instants.push_back({t_s, "cleared: " + what});
    } else if (kind == "command" || kind == "command_refused") {
      chart.instants.push_back({t_s, (kind == "command" ? "" : "refused: ") + what});
    }
  }
  while (!open.empty()) {
    close(open.begin()->first, chart.end_s);
  }
  for (const Json& r : list_in(facts, "vision_restarts")) {
    chart.instants.push_back({number_in(r, "t_s").value_or(0), "vision restarted"});
  }
  std::sort(chart.instants.begin(), chart.instants.end(),
            [](const Instant& a, const Instant& b) { return a.t_s < b.t_s; });
  for (auto& [name, lane] : lanes) {
    if (name != "degraded") {  // true of the whole run, and said in words
      chart.lanes.push_back(std::move(lane));
    }
  }
}

}  // namespace

TimeChart chart_of_run(const std::string& folder, const Json& facts) {
  TimeChart chart;
  chart.title = text_in(facts, "scene") + ": force, depth, phases, alarms and events over time";
  chart.end_s = number_in(facts, "seconds").value_or(0);
  const auto source = [&chart](const char* name, const char* column, double scale, bool always = true) {
    return Source{Curve(name, chart.begin_s, chart.end_s), column, scale, always};
  };
  std::vector<Source> force, needle, depth, hand, tip;
  for (std::size_t i = 0; i < rt::effect_count; ++i) {
    const std::string column = std::string(rt::effect_name(i)) + "_N";
    force.push_back(source(rt::effect_name(i), column.c_str(), 1, false));
  }
  needle.push_back(source("true", "true_force_N", 1e6));
  needle.push_back(source("core's estimate", "tip_force_N", 1e6, false));
  needle.push_back(source("sensor", "sensor_N", 1e6, false));
  depth.push_back(source("tip past the undeformed membrane, true", "true_gap_m", -1e6));
  depth.push_back(source("dimple, true", "true_wd_m", 1e6));
  depth.push_back(source("dimple, core", "wd_m", 1e6, false));
  for (const char* axis : {"x", "y", "z"}) {
    hand.push_back(source(axis, (std::string(axis) + "_m").c_str(), 1e3));
    tip.push_back(source(axis, ("tip_" + std::string(axis) + "_m").c_str(), 1e6));
  }
  Curve total("force at the hand", chart.begin_s, chart.end_s);
  CsvReader row(folder + "/samples.csv");
  bool any = false;
  double last_s = -std::numeric_limits<double>::infinity();
  while (row.next()) {
    const auto t_s = row.number("t_s");
    const auto fx = row.number("fx_N"), fy = row.number("fy_N"), fz = row.number("fz_N");
    if (!row.is_whole() || !fx || !fy || !fz || !t_s || !(*t_s > last_s)) {
      continue;  // cut off by a crash, or damaged
    }
    any = true;
    last_s = *t_s;
    total.add(*t_s, std::hypot(*fx, *fy, *fz));
    for (std::vector<Source>* panel_sources : {&force, &needle, &depth, &hand, &tip}) {
      for (Source& s : *panel_sources) {
        const auto v = row.number(s.column);
        s.seen = s.seen || (v && *v != 0);
        s.curve.add(*t_s, v ? *v * s.scale : std::numeric_limits<double>::quiet_NaN());
      }
    }
  }
  if (!any) {
    return chart;
  }
  ChartPanel first = panel("at the hand [N]", force);
  first.curves.insert(first.curves.begin(), std::move(total));
  chart.panels.push_back(std::move(first));
  ChartPanel needle_panel = panel("needle force [uN]", needle), depth_panel = panel("depth [um]", depth);
  if (needle_panel.curves.empty() && depth_panel.curves.empty()) {
    chart.panels.push_back(panel("hand [mm]", hand));
    chart.panels.push_back(panel("needle tip [um]", tip));
  } else {
    chart.panels.push_back(std::move(needle_panel));
    chart.panels.push_back(std::move(depth_panel));
  }
  add_phases(facts, chart);
  add_events(facts, chart);
  return chart;
}

}  // namespace punctum::tools
