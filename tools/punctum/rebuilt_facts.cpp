#include "tools/punctum/rebuilt_facts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rt/station/core_status.hpp"
#include "rt/station/run_end.hpp"
#include "rt/station/telemetry.hpp"
#include "tools/punctum/event_log.hpp"
#include "tools/punctum/facts.hpp"
#include "tools/punctum/measures.hpp"
#include "tools/punctum/not_kept.hpp"
#include "tools/punctum/run_report.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/fault_advice.hpp"

namespace punctum::tools {
namespace {

using Json = nlohmann::ordered_json;

// The numbers of a row, and whether all that were asked for could be read. A column that the table does not
// have is 0.
class RowNumbers {
 public:
  explicit RowNumbers(const CsvReader& row) : row_(row) {}

  double number(const char* column) {
    const auto v = row_.number(column);
    read_ = read_ && (v || !row_.has(column));
    return v.value_or(0);
  }
  std::uint32_t count(const char* column, std::uint32_t most = UINT32_MAX) {
    const double v = number(column);
    const bool is_one = v >= 0 && v <= static_cast<double>(most);
    read_ = read_ && is_one;
    return is_one ? static_cast<std::uint32_t>(v) : 0;
  }
  [[nodiscard]] bool all_read() const { return read_; }

 private:
  const CsvReader& row_;
  bool read_ = true;
};

std::optional<rt::Phase> phase_named(std::string_view name) {
  for (int i = 0; i < rt::kPhases; ++i) {
    if (name == rt::name(static_cast<rt::Phase>(i))) {
      return static_cast<rt::Phase>(i);
    }
  }
  return std::nullopt;
}

// Nothing if the row was cut off or is damaged.
std::optional<rt::TelemetrySample> sample_of(const CsvReader& row, double rate_Hz) {
  const auto t_s = row.number("t_s"), fz = row.number("fz_N");
  const auto phase = phase_named(row.text("phase"));
  const std::string_view named = row.text("fault");
  const auto fault = named == rt::name(rt::Fault::none) ? rt::Fault::none : fault_named(named);
  if (!row.is_whole() || !t_s || !fz || !phase || !fault || !(*t_s >= 0 && *t_s < 1e9)) {
    return std::nullopt;
  }
  RowNumbers of(row);
  rt::TelemetrySample s;
  s.t_s = *t_s;
  s.tick = static_cast<std::uint64_t>(std::llround(*t_s * rate_Hz));
  s.phase = *phase;
  s.fault = *fault;
  s.alarms = of.count("alarms");
  s.buttons = of.count("buttons");
  s.cell = of.count("cell");
  s.force_N[0] = of.number("fx_N"), s.force_N[1] = of.number("fy_N"), s.force_N[2] = *fz;
  s.wd_m = of.number("wd_m");
  s.tip_force_N = of.number("tip_force_N");
  s.obs_age_s = of.number("obs_age_s");
  s.obs_gap_m = of.number("obs_gap_m");
  s.injected_energy_J = of.number("injected_energy_J");
  s.injector_open = static_cast<std::uint8_t>(of.count("injector_open", 1));
  return of.all_read() ? std::optional(s) : std::nullopt;
}

// What the samples have of the simulated truth.
struct Truth {
  bool any = false;
  double peak_force_N = 0, max_depth_m = 0, error2 = 0, true2 = 0;
  std::uint64_t compared = 0;
  std::optional<double> gap_m;
  bool contact = false, punctured = false, lost = false;

  void take(const CsvReader& row, const rt::TelemetrySample& s) {
    gap_m = row.number("true_gap_m");
    const auto force = row.number("true_force_N");
    if (!gap_m || !force) {
      return;
    }
    any = true;
    contact = row.number("true_contact") == 1.0;
    punctured = row.number("true_punctured") == 1.0;
    lost = lost || row.number("true_lost") == 1.0;
    if (contact) {
      max_depth_m = std::max(max_depth_m, -*gap_m);
      peak_force_N = std::max(peak_force_N, *force);
    }
    if (contact && !punctured && (s.phase == rt::Phase::contact || s.phase == rt::Phase::indentation)) {
      error2 += (s.tip_force_N - *force) * (s.tip_force_N - *force);
      true2 += *force * *force;
      ++compared;
    }
  }
  // inner: the cell has two membranes, and the rows tell when the inner one gave way.
  [[nodiscard]] Whereabouts needle(const Whereabouts& believed, bool inner) const {
    if (!any || !gap_m || (inner && contact && !punctured)) {
      return believed;
    }
    const bool inside = punctured && *gap_m < 0;
    return {.where = inside    ? Whereabouts::inside
                     : contact ? Whereabouts::touching
                               : Whereabouts::outside,
            .source = Whereabouts::truth,
            .depth_m = -*gap_m};
  }
};

// How late the core's phases told of contact and puncture, as Measures has it. Rows may be some ticks apart:
// what came about between two of them came at a time that is not known.
struct Delays {
  Spread contact_s, inner_s;
  struct OfCell {
    std::optional<double> contact_s, puncture_s, told_contact_s, told_puncture_s;
    bool in_contact = false, punctured = false, counted = false;
  } now;
  rt::TelemetrySample last;
  bool any = false;

  void take(const rt::TelemetrySample& s, bool contact, bool punctured) {
    const bool none_missing = any && s.tick == last.tick + 1;
    if (any && s.cell != last.cell) {
      now = {};
    }
    if (any && s.phase == rt::Phase::contact && last.phase == rt::Phase::free) {
      now.told_contact_s = s.t_s;
    }
    if (s.phase == rt::Phase::puncture && !now.told_puncture_s) {
      now.told_puncture_s = s.t_s;
    }
    if (contact && !now.in_contact) {
      now.contact_s = none_missing ? std::optional(s.t_s) : std::nullopt;
    }
    now.in_contact = contact;
    if (punctured && !now.punctured) {
      now.punctured = true;
      now.puncture_s = none_missing ? std::optional(s.t_s) : std::nullopt;
      if (now.contact_s && now.told_contact_s) {
        contact_s.add(*now.told_contact_s - *now.contact_s);
      }
    }
    if (now.puncture_s && now.told_puncture_s && !now.counted) {
      now.counted = true;
      inner_s.add(*now.told_puncture_s - *now.puncture_s);
    }
    last = s;
    any = true;
  }
};

constexpr double kApart_s =
    1;  // by which either table may be behind the other, both being written now and then

// Rows that are missing between others, s.
struct Hole {
  double from_s = 0, to_s = 0;
};

// Distances of two rows that are far more than the usual one.
class Holes {
 public:
  void take(std::uint64_t tick, double t_s) {
    constexpr double kLeast_s = 0.1;
    if (any_) {
      const std::uint64_t apart = tick - last_tick_;
      least_ = std::min(least_, apart);
      if (t_s - last_s_ > kLeast_s) {
        wide_.push_back({{last_s_, t_s}, apart});
      }
    }
    any_ = true;
    last_tick_ = tick;
    last_s_ = t_s;
  }
  // In the order of time.
  [[nodiscard]] std::vector<Hole> all() const {
    constexpr std::uint64_t kUsual = 20;
    std::vector<Hole> holes;
    for (const Wide& w : wide_) {
      if (w.ticks > kUsual * least_) {
        holes.push_back(w.hole);
      }
    }
    return holes;
  }

 private:
  struct Wide {
    Hole hole;
    std::uint64_t ticks = 0;
  };
  bool any_ = false;
  std::uint64_t last_tick_ = 0, least_ = UINT64_MAX / 100;
  double last_s_ = 0;
  std::vector<Wide> wide_;
};

NotKept told(const std::vector<Hole>& holes) {
  const auto length_s = [](const Hole& h) { return h.to_s - h.from_s; };
  const Hole& longest = *std::max_element(
      holes.begin(), holes.end(), [&](const Hole& a, const Hole& b) { return length_s(a) < length_s(b); });
  const std::string after = fmt::format("its rows go on at {:.3f} s: ", longest.to_s);
  if (holes.size() == 1) {
    return {"samples.csv", longest.from_s, after + "its only hole"};
  }
  double sum_s = 0;
  for (const Hole& h : holes) {
    sum_s += length_s(h);
  }
  return {
      "samples.csv", longest.from_s,
      after + fmt::format("the longest of its {} holes, which are {:.3f} s together", holes.size(), sum_s)};
}

std::string so_many_rows(std::uint64_t n) { return n == 1 ? "1 row" : fmt::format("{} rows", n); }

// Rows of a table that has been damaged: what they told is missing, however short the time.
struct Damage {
  std::uint64_t unreadable = 0, not_rising = 0;
  double unreadable_s = 0, not_rising_s = 0;  // after which the first of them stands
  bool at_end = false;                        // no row after it can be read

  [[nodiscard]] bool any() const { return unreadable + not_rising > 0; }
  void tell(std::vector<NotKept>& not_kept) const {
    if (unreadable > 0) {
      not_kept.push_back({"samples.csv", unreadable_s, so_many_rows(unreadable) + " cannot be read"});
    }
    if (not_rising > 0) {
      not_kept.push_back(
          {"samples.csv", not_rising_s, so_many_rows(not_rising) + " left out: their times do not rise"});
    }
  }
};

std::optional<rt::RunEnd> run_end_named(const std::string& name) {
  for (int i = 0; i < rt::kRunEnds; ++i) {
    if (name == rt::name(static_cast<rt::RunEnd>(i))) {
      return static_cast<rt::RunEnd>(i);
    }
  }
  return std::nullopt;
}

bool is_fault(const Json& event) {
  const std::string what = text_in(event, "what");
  return text_in(event, "event") == "fault" && what != rt::name(rt::Fault::command_stop);
}

// What the run came to, as judge() has it: the core's word, and what rows and events tell beside it.
rt::RunEnd judged(rt::RunEnd said, const Scene& scene, const Measures& measures, bool lost,
                  bool dose_is_known, const Json& events) {
  using rt::RunEnd;
  if (said != RunEnd::done && said != RunEnd::stopped && said != RunEnd::time_limit) {
    return said;
  }
  const RunEnd well =
      std::any_of(events.begin(), events.end(), is_fault) ? RunEnd::after_fault : RunEnd::done;
  const rt::Phase phase = measures.last.phase;
  if (!scene.has_task()) {
    return phase == rt::Phase::free || phase == rt::Phase::clear ? well : said;
  }
  if (said == RunEnd::stopped) {
    return said;
  }
  if (lost) {
    return RunEnd::cell_lost;
  }
  if (said == RunEnd::done && dose_is_known && measures.cells_without_injection > 0) {
    return RunEnd::not_injected;
  }
  if (said == RunEnd::done && dose_is_known && measures.cells_underdosed > 0) {
    return RunEnd::underdosed;
  }
  return said == RunEnd::done ? well : said;
}

double last_time(const Json& events) {
  double last_s = 0;
  for (const Json& e : events) {
    last_s = std::max(last_s, number_in(e, "t_s").value_or(0));
  }
  return last_s;
}

bool may_inject(const rt::TelemetrySample& s) {
  return s.phase == rt::Phase::puncture || s.phase == rt::Phase::injection;
}

// As the core and the injector told it: what came out of it is in no row.
Json told_dose(const Measures& measures, bool is_known) {
  const auto known = [is_known](double s) { return is_known ? Json(s) : Json(nullptr); };
  return {{"asked_s", known(measures.asked_s)},
          {"given_s", known(measures.injected_s)},
          {"known_from", is_known ? "injector" : "nobody"}};
}

Json mean_ms(const Spread& s) { return s.n > 0 ? Json(s.mean * 1e3) : Json(nullptr); }

}  // namespace

Json rebuilt_facts(const std::string& folder) {
  const auto loaded = load_scene(folder + "/scene.toml");
  Scene scene = loaded ? *loaded : Scene{};
  if (!loaded) {
    scene.name = std::filesystem::path(folder).filename().string();
  }
  Scene without_truth = scene;  // a dose that the simulated world knows is in no row
  if (without_truth.sim) {
    without_truth.sim->cell.reset();
  }
  Measures measures(without_truth);
  Truth truth;
  Delays delays;
  CsvReader row(folder + "/samples.csv");
  Holes holes;
  Damage damage;
  std::uint64_t rows = 0, cut_off = 0;
  double apart_s = 0;  // at most, of two rows while the injector may have been open
  while (row.next()) {
    const auto sample = sample_of(row, scene.servo.rate_Hz);
    if (!sample && row.is_cut_off()) {
      ++cut_off;
      continue;
    }
    if (!sample) {
      damage.unreadable_s = damage.unreadable++ == 0 ? measures.last_s : damage.unreadable_s;
      damage.at_end = true;
      continue;
    }
    if (rows > 0 && !(sample->t_s > measures.last.t_s)) {
      damage.not_rising_s = damage.not_rising++ == 0 ? measures.last_s : damage.not_rising_s;
      continue;
    }
    damage.at_end = false;
    if (rows > 0 && (may_inject(*sample) || may_inject(measures.last))) {
      apart_s = std::max(apart_s, sample->t_s - measures.last.t_s);
    }
    holes.take(sample->tick, sample->t_s);
    measures.tick(*sample, nullptr);
    truth.take(row, *sample);
    if (truth.any) {
      delays.take(*sample, truth.contact, truth.punctured);
    }
    ++rows;
  }
  measures.finish();
  const EventTable event_table = read_events(folder + "/events.csv");
  const Json events = event_table.list;
  const double told_s = last_time(events);
  const bool cut = told_s > measures.last_s + kApart_s;
  const bool inner = scene.sim && scene.sim->cell && scene.sim->cell->inner;
  RunResult result;
  result.rows = rows;
  if (cut) {
    result.not_kept.push_back(
        {"samples.csv", measures.last_s, fmt::format("its rows end here, the events at {:.3f} s", told_s)});
  } else if (!damage.at_end) {
    result.needle = truth.needle(measures.whereabouts(), inner);
  }
  const std::vector<Hole> missing = holes.all();
  if (!missing.empty()) {
    result.not_kept.push_back(told(missing));
  }
  damage.tell(result.not_kept);
  if (event_table.unreadable > 0) {
    result.not_kept.push_back(
        {"events.csv", event_table.unreadable_s, so_many_rows(event_table.unreadable) + " cannot be read"});
  }
  const bool all_rows = !cut && missing.empty() && !damage.any();
  const auto no_core = std::make_unique<rt::CoreStatus>();
  Json j = report_facts(scene, result, measures, EventList{}, *no_core, read_pictures(folder + "/obs.csv"));
  j["rebuilt"] = true;
  j["outcome"] = "unknown";
  j["outcome_detail"] = rows > 0
                            ? fmt::format("the recording ends in phase {}", rt::name(measures.last.phase))
                            : "nothing was recorded";
  j["events"] = events;
  const bool dose_is_known = rows > 0 && row.has("injector_open") && row.has("buttons") && all_rows &&
                             apart_s < CellMeasures::kDoseTolerance_s;
  for (const Json& e : events) {
    if (text_in(e, "event") == "ended") {
      const auto said = run_end_named(text_in(e, "what"));
      j["outcome"] = said ? rt::name(judged(*said, scene, measures, truth.lost, dose_is_known, events))
                          : text_in(e, "what");
      j["outcome_detail"] = measures.faults.empty() ? "" : rt::name(measures.faults.back().fault);
    }
  }
  // Nobody is left to ask.
  for (const char* unknown : {"wall_s",
                              "missed",
                              "ticks",
                              "worst_lateness_us",
                              "wake_us",
                              "tick_us",
                              "slots_us",
                              "page_faults",
                              "switches",
                              "allocations",
                              "degraded",
                              "rights",
                              "cells",
                              "observations",
                              "stale_s",
                              "without_vision_s",
                              "commands_refused",
                              "wake_histogram",
                              "tick_histogram",
                              "tremor_ratio",
                              "tremor_hand_um",
                              "tremor_tip_um",
                              "late_ticks",
                              "late_ticks_not_listed"}) {
    j[unknown] = nullptr;
  }
  j["cell_list"] = Json::array();
  if (scene.servo.injector) {
    j["dose"] = told_dose(measures, dose_is_known);
  }
  // Of two membranes the rows tell when the inner one gave way.
  j["contact_delay_ms"] = mean_ms(delays.contact_s);
  j["puncture_delay_ms"] = inner ? Json(nullptr) : mean_ms(delays.inner_s);
  j["puncture_inner_delay_ms"] = mean_ms(delays.inner_s);
  j["samples"] = {{"rows", rows},
                  {"cut_off", cut_off},
                  {"unreadable", damage.unreadable},
                  {"not_rising", damage.not_rising},
                  {"every", nullptr},
                  {"lost", nullptr},
                  {"gaps", nullptr}};
  j["event_rows"] = {
      {"rows", events.size()}, {"cut_off", event_table.cut_off}, {"unreadable", event_table.unreadable}};
  if (truth.any) {
    j["peak_force_N"] = truth.peak_force_N;
    j["max_depth_um"] = truth.max_depth_m * 1e6;
    if (truth.compared > 0 && !inner) {
      const auto n = static_cast<double>(truth.compared);
      j["force_error_rms_N"] = std::sqrt(truth.error2 / n);
      j["true_force_rms_N"] = std::sqrt(truth.true2 / n);
    }
    j["cells"] = {{"tried", measures.last.cell + 1}, {"lost", truth.lost ? Json(1) : Json(nullptr)}};
  }
  if (!all_rows) {
    forget_what_needs_every_sample(j);
  }
  if (cut) {
    j["seconds"] = told_s;
  }
  return j;
}

}  // namespace punctum::tools
