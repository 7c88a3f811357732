#include "tools/punctum/run_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "tools/punctum/event_log.hpp"
#include "tools/punctum/run_sentence.hpp"
#include "tools/punctum/terminal.hpp"
#include "tools/scene/messages.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/fault_advice.hpp"
#include "tools/shared/station_values.hpp"

namespace punctum::tools {
namespace {

using Json = nlohmann::ordered_json;

Json number(const std::optional<double>& v, double scale = 1) {
  return v && std::isfinite(*v) ? Json(*v * scale) : Json(nullptr);
}

// Mean over the cells; null when no cell came to it.
Json mean(const Spread& s, double scale) { return s.n > 0 ? Json(s.mean * scale) : Json(nullptr); }

template <class H>
Json times(const H& h) {
  return {{"p50", h.percentile_us(0.5)},
          {"p99", h.percentile_us(0.99)},
          {"p99_9", h.percentile_us(0.999)},
          {"max", h.max_us()}};
}

// Of bins of 1 us those that are not empty.
Json bins(const rt::TimeHistogram& h) {
  Json from_us = Json::array(), count = Json::array();
  for (std::size_t k = 0; k < rt::TimeHistogram::kBins; ++k) {
    if (const std::uint64_t n = h.bin(k); n > 0) {
      from_us.push_back(k);
      count.push_back(n);
    }
  }
  return {{"from_us", from_us}, {"count", count}, {"over", h.overflow()}};
}

// For a terminal and for a file, whatever stands in the segment.
template <std::size_t N>
std::string text_of(const rt::Text<N>& text) {
  return printable(bounded(text), N);
}

std::vector<const rt::Right*> rights(const rt::CoreStatus& core) {
  std::vector<const rt::Right*> list;
  const auto n = std::min<std::uint64_t>(core.rights_count.load(), rt::kMaxRights);
  for (std::uint64_t i = 0; i < n; ++i) {
    list.push_back(&core.rights[i]);
  }
  return list;
}

// How long so many ticks of those that were told last.
double seconds_of(const Measures& m, std::uint64_t ticks) {
  return m.ticks > 0 ? static_cast<double>(ticks) * m.last_s / static_cast<double>(m.ticks) : 0;
}

// The core counts its own ticks, told or not.
double stale_s(const Measures& m, const rt::CoreStatus& core) {
  const std::uint64_t ticks = core.ticks.load();
  return ticks > 0 ? static_cast<double>(m.stale_ticks) * m.last_s / static_cast<double>(ticks) : 0;
}

// Peaks, sums and what single cells came to may lie in the samples that are missing.
}  // namespace

void forget_what_needs_every_sample(Json& j) {
  for (const char* measure : {"contact_delay_ms",
                              "puncture_delay_ms",
                              "puncture_inner_delay_ms",
                              "force_error_rms_N",
                              "force_error_mean_N",
                              "true_force_rms_N",
                              "E_fit_kPa",
                              "E_fit_sd_kPa",
                              "lateral_error_um",
                              "lateral_error_contact_um",
                              "peak_force_N",
                              "peak_hand_force_N",
                              "max_depth_um",
                              "depth_beyond_puncture_um",
                              "withdrawal_s",
                              "tremor_ratio",
                              "tremor_hand_um",
                              "tremor_tip_um",
                              "without_vision_s",
                              "alarms_s"}) {
    j[measure] = nullptr;
  }
  for (Json* group : {&j["cells"], &j["least_clearance_um"]}) {
    for (auto& [name, value] : group->items()) {
      value = nullptr;
    }
  }
  if (!j["dose"].is_null()) {
    j["dose"]["given_s"] = nullptr;
    j["dose"]["asked_s"] = nullptr;
  }
  j["cell_list"] = Json::array();
  j["phases"] = Json::array();
}

std::string in_words(const Whereabouts& needle) {
  const double um = needle.depth_m.value_or(0) * 1e6;
  switch (needle.where) {
    case Whereabouts::unknown:
      return "not known: nobody saw it at the end";
    case Whereabouts::no_cell:
      return "there is no cell in this scene";
    case Whereabouts::outside:
      return needle.depth_m && um < 0 ? fmt::format("outside the cell, {:.0f} um before its membrane", -um)
                                      : "outside the cell";
    case Whereabouts::touching:
      return needle.depth_m && um > 0 ? fmt::format("ON THE CELL, denting it by {:.1f} um", um)
                                      : "ON THE CELL";
    case Whereabouts::inside:
      return needle.depth_m ? fmt::format("INSIDE THE CELL, {:.1f} um past its membrane", um)
                            : "INSIDE THE CELL";
  }
  return {};
}

PicturesSeen read_pictures(const std::string& obs_csv) {
  CsvReader table(obs_csv);
  PicturesSeen seen;
  double sum = 0, sum95 = 0;
  while (table.next()) {
    ++seen.all;
    const bool found = table.number("outer_ok") == 1.0 || table.number("inner_ok") == 1.0 ||
                       table.number("tip_x_px") || table.number("holder_x_px");
    seen.empty += found ? 0 : 1;
    seen.unusable += table.text("phase").empty() ? 1 : 0;
    const auto rms_um = table.number("outer_rms_um");
    if (!rms_um || *rms_um < 0) {
      continue;
    }
    const double p95_um = table.number("outer_p95_um").value_or(0);
    ++seen.compared;
    sum += *rms_um * *rms_um;
    sum95 += p95_um > 0 ? p95_um * p95_um : 0;
  }
  if (seen.compared > 0) {
    seen.contour_rms_um = std::sqrt(sum / static_cast<double>(seen.compared));
    seen.contour_p95_um = std::sqrt(sum95 / static_cast<double>(seen.compared));
  }
  return seen;
}

std::string fault_text(rt::Fault fault, double t_s, bool coloured) {
  const FaultAdvice& advice = kFaultAdvice[static_cast<std::size_t>(fault)];
  return fmt::format(
      "{}\n  cause:       {}\n  what to do:  {}\n  cleared:     {}",
      painted(Colour::bad, fmt::format("FAULT {} at {:.3f} s", rt::name(fault), t_s), coloured), advice.cause,
      advice.next, clearing_condition(fault));
}

std::string missing_rights(const rt::CoreStatus& core) {
  std::string missing, advice;
  for (const auto* r : rights(core)) {
    if (r->got != 0) {
      continue;
    }
    if (r->required == 0) {
      advice += fmt::format("{}{}", advice.empty() ? "" : ", ", text_of(r->name));
      continue;
    }
    missing += fmt::format("\n  {:<18} {}", text_of(r->name), text_of(r->detail));
    if (const std::string remedy = text_of(r->remedy); !remedy.empty()) {
      missing += fmt::format("\n{:21}get it: {}", "", remedy);
    }
  }
  if (missing.empty()) {
    return missing;
  }
  std::string text =
      "DEGRADED: these real-time rights are missing, so the timing of this run proves nothing" + missing;
  if (!advice.empty()) {
    text += "\n  also advisable: " + advice + " (punctum check tells how)";
  }
  return text;
}

nlohmann::ordered_json report_facts(const Scene& scene, const RunResult& result, const Measures& m,
                                    const EventList& events, const rt::CoreStatus& core,
                                    const PicturesSeen& pictures) {
  Json j;
  j["outcome"] = rt::name(result.end);
  if (!result.detail.empty()) {
    j["outcome_detail"] = result.detail;
  }
  j["needle_at_end"] = {{"where", name(result.needle.where)},
                        {"depth_um", number(result.needle.depth_m, 1e6)},
                        {"known_from", name(result.needle.source)},
                        {"in_words", in_words(result.needle)}};
  j["dose"] = scene.servo.injector ? Json{{"asked_s", m.asked_s}, {"given_s", m.injected_s}} : Json(nullptr);
  j["not_kept"] = Json::array();
  for (const NotKept& n : result.not_kept) {
    j["not_kept"].push_back({{"file", n.file}, {"t_s", n.t_s}, {"why", n.why}});
  }
  j["scene"] = scene.name;
  j["clock"] = scene.clock == ClockKind::real ? "real" : "virtual";
  if (scene.sim) {
    j["seed"] = scene.sim->seed;
  }
  j["rate_hz"] = scene.servo.rate_Hz;
  j["seconds"] = m.last_s;
  j["wall_s"] = result.wall_s;
  j["phases"] = Json::array();
  for (const auto& p : m.phases) {
    j["phases"].push_back(
        {{"name", rt::name(p.phase)}, {"start_s", p.start_s}, {"end_s", p.end_s}, {"cell", p.cell}});
  }
  if (m.phase_count > m.phases.size()) {
    j["phases_not_listed"] = m.phase_count - m.phases.size();
  }

  j["ticks"] = core.ticks.load();
  j["missed"] = core.missed.load();
  j["worst_lateness_us"] = static_cast<double>(core.worst_lateness_ns.load()) * 1e-3;
  j["late_ticks"] = Json::array();
  for (const late::Explained& e : result.late.ticks) {
    j["late_ticks"].push_back(
        {{"t_s",
          1e-9 * static_cast<double>(e.tick.release_ns - static_cast<std::int64_t>(core.start_ns.load()))},
         {"wake_us", 1e-3 * static_cast<double>(e.tick.wake_ns - e.tick.release_ns)},
         {"end_us", 1e-3 * static_cast<double>(e.tick.end_ns - e.tick.release_ns)},
         {"missed", e.tick.missed},
         {"cause", late::name_of(e.verdict.cause)},
         {"what", e.verdict.what},
         {"proof", late::name_of(e.verdict.proof)}});
  }
  j["late_ticks_not_listed"] = result.late.more;
  j["wake_us"] = times(core.wake);
  j["tick_us"] = times(core.tick);  // everything of one tick, the simulated plant included
  j["slots_us"] = Json::object();
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(core.slot_count.load(), rt::kMaxSlots); ++i) {
    j["slots_us"][text_of(core.slots[i].name)] = times(core.slots[i].execution);
  }
  // Counted by the core when it ends: unknown of one that was killed.
  const auto counted = [&result](std::uint64_t n) {
    return result.end == rt::RunEnd::core_died ? Json(nullptr) : Json(n);
  };
  j["page_faults"] = {{"minor", counted(core.minor_faults.load())},
                      {"major", counted(core.major_faults.load())}};
  j["switches"] = {{"voluntary", counted(core.voluntary_switches.load())},
                   {"involuntary", counted(core.involuntary_switches.load())}};
  j["allocations"] = core.allocations_watched.load() != 0 ? Json(core.allocations.load()) : Json(nullptr);
  j["degraded"] = core.degraded.load() != 0;
  j["rights"] = Json::array();
  for (const auto* r : rights(core)) {
    j["rights"].push_back({{"name", text_of(r->name)},
                           {"got", r->got != 0},
                           {"required", r->required != 0},
                           {"detail", text_of(r->detail)},
                           {"remedy", text_of(r->remedy)}});
  }

  // Against the truth. One number per run: the mean over its cells; peaks are the largest.
  j["contact_delay_ms"] = mean(m.contact_delay_s, 1e3);
  j["puncture_delay_ms"] = mean(m.puncture_delay_s, 1e3);
  j["puncture_inner_delay_ms"] = mean(m.inner_delay_s, 1e3);
  j["force_error_rms_N"] = number(m.force_error_rms_N());
  j["force_error_mean_N"] =
      m.force_ticks > 0 ? Json(m.force_error_sum / static_cast<double>(m.force_ticks)) : Json(nullptr);
  j["true_force_rms_N"] =
      m.force_ticks > 0 ? Json(std::sqrt(m.true_force2 / static_cast<double>(m.force_ticks))) : Json(nullptr);
  j["E_fit_kPa"] = mean(m.E_fit_Pa, 1e-3);
  j["E_fit_sd_kPa"] = mean(m.E_fit_sd_Pa, 1e-3);
  j["contour_error_um"] = pictures.compared > 0
                              ? Json{{"rms", pictures.contour_rms_um}, {"p95", pictures.contour_p95_um}}
                              : Json(nullptr);
  j["lateral_error_um"] = mean(m.lateral_error_m, 1e6);
  j["lateral_error_contact_um"] = mean(m.lateral_contact_m, 1e6);
  const bool cell = scene.sim && scene.sim->cell;
  j["peak_force_N"] = cell ? Json(m.peak_force_N) : Json(nullptr);  // at the needle, true
  j["peak_hand_force_N"] = m.peak_hand_N;
  j["max_depth_um"] = cell ? Json(m.max_depth_m * 1e6) : Json(nullptr);
  j["least_clearance_um"] = {{"floor", number(m.least_floor_m, 1e6)},
                             {"holder", number(m.least_holder_m, 1e6)}};
  j["depth_beyond_puncture_um"] = mean(m.beyond_puncture_m, 1e6);
  j["withdrawal_s"] = mean(m.withdrawal_s, 1);
  j["tremor_ratio"] = number(m.tremor_ratio());
  j["tremor_hand_um"] = m.tremor_ticks > 0
                            ? Json(std::sqrt(m.tremor_hand2 / static_cast<double>(m.tremor_ticks)) * 1e6)
                            : Json(nullptr);
  j["tremor_tip_um"] = m.tremor_ticks > 0
                           ? Json(std::sqrt(m.tremor_tip2 / static_cast<double>(m.tremor_ticks)) * 1e6)
                           : Json(nullptr);
  j["cells"] = {{"tried", m.cell_count},
                {"done", m.cells_done},
                {"lost", m.cells_lost},
                {"without_injection", m.cells_without_injection},
                {"injected_in_part", m.cells_underdosed}};
  j["cell_list"] = Json::array();
  for (const auto& c : m.cells) {
    j["cell_list"].push_back({{"cell", c.cell},
                              {"done", c.done},
                              {"lost", c.lost},
                              {"contact_delay_ms", number(c.contact_delay_s, 1e3)},
                              {"puncture_delay_ms", number(c.puncture_delay_s, 1e3)},
                              {"lateral_error_um", number(c.lateral_error_m, 1e6)},
                              {"lateral_error_contact_um", number(c.lateral_contact_m, 1e6)},
                              {"peak_force_N", c.peak_force_N},
                              {"max_depth_um", c.max_depth_m * 1e6},
                              {"E_fit_kPa", c.E_fit_Pa > 0 ? Json(c.E_fit_Pa * 1e-3) : Json(nullptr)},
                              {"E_fit_sd_kPa", c.E_fit_Pa > 0 ? Json(c.E_fit_sd_Pa * 1e-3) : Json(nullptr)},
                              {"depth_beyond_puncture_um", number(c.beyond_puncture_m, 1e6)},
                              {"withdrawal_s", number(c.withdrawal_s)},
                              {"injected_s", number(c.injected_s)},
                              {"asked_s", c.asked_s}});
  }

  j["observations"] = m.observations;
  j["stale_observations"] = m.stale_spells;  // times an observation became too old
  j["stale_s"] = stale_s(m, core);
  j["without_vision_s"] = seconds_of(m, m.blind_ticks);
  j["pictures_unusable"] = pictures.unusable;
  j["vision_restarts"] = Json::array();
  for (const auto& r : result.vision_restarts) {
    j["vision_restarts"].push_back({{"t_s", r.t_s}, {"why", r.why}});
  }
  j["alarms_s"] = Json::object();
  for (std::size_t i = 0; i < std::size(rt::kAlarmNames); ++i) {
    if (m.alarm_ticks[i] > 0) {
      j["alarms_s"][rt::kAlarmNames[i]] = seconds_of(m, m.alarm_ticks[i]);
    }
  }
  j["faults"] = Json::array();
  for (const auto& f : m.faults) {
    j["faults"].push_back({{"name", rt::name(f.fault)}, {"t_s", f.t_s}});
  }
  j["commands_refused"] = core.commands_refused.load();
  j["events"] = Json::array();
  for (const rt::Event& e : events.list) {
    j["events"].push_back(event_row(e));
  }
  j["events_not_listed"] = events.not_listed + events.lost;
  j["injected_energy_J"] = m.last.injected_energy_J;
  if (result.unattended) {
    const auto& u = *result.unattended;
    const auto when = [](double s) { return s < 0 ? Json(nullptr) : Json(s); };
    j["unattended"] = {{"safe", u.safe},
                       {"relay_opened_s", when(u.relay_opened_s)},
                       {"stage_at_rest_s", when(u.stage_at_rest_s)},
                       {"stage_moved_um", u.stage_moved_m * 1e6},
                       {"gate_shut_s", when(u.gate_shut_s)},
                       {"hand_force_off_s", when(u.hand_force_off_s)},
                       {"vacuum_kept", u.vacuum_kept},
                       {"cell_held", u.cell_held}};
  }
  j["samples"] = {{"rows", result.rows},
                  {"every", result.rows_every},
                  {"lost", result.samples_lost},
                  {"gaps", m.gaps},
                  {"unusable", result.samples_unusable}};
  if (result.silent_from_s) {
    j["samples"]["silent_from_s"] = *result.silent_from_s;
  }
  for (const auto& [name, histogram] :
       {std::pair{"wake_histogram", &core.wake}, std::pair{"tick_histogram", &core.tick}}) {
    j[name] = bins(*histogram);
  }
  if (result.samples_lost > 0) {
    forget_what_needs_every_sample(j);
  }
  j["sentence"] = run_sentence(j);
  return j;
}

std::string summary(const Scene& scene, const RunResult& result, const Measures& m,
                    const rt::CoreStatus& core, const PicturesSeen& pictures, bool coloured) {
  std::string s;
  const auto line = [&s](const char* what, const std::string& text) {
    s += fmt::format("{:<16}{}\n", what, text);
  };
  const Colour mood = exit_code(result.end) == exit_done    ? Colour::good
                      : exit_code(result.end) == exit_fault ? Colour::bad
                                                            : Colour::warning;
  line("outcome", fmt::format("{}{} after {:.1f} s{}", painted(mood, rt::name(result.end), coloured),
                              result.detail.empty() ? "" : " (" + result.detail + ")", m.last_s,
                              scene.clock == ClockKind::virtual_time
                                  ? fmt::format(" of virtual time, {:.1f} s real", result.wall_s)
                                  : ""));
  line("needle now", in_words(result.needle));
  const bool all_read = result.samples_lost == 0;
  if (scene.servo.phases && all_read) {
    std::string text;
    const std::size_t shown = std::min<std::size_t>(m.phases.size(), 14);
    for (std::size_t i = 0; i < shown; ++i) {
      text +=
          fmt::format("{}{} {:.1f}", i > 0 ? " > " : "", rt::name(m.phases[i].phase), m.phases[i].start_s);
    }
    if (m.phase_count > shown) {
      text += fmt::format(" > ... {} in all", m.phase_count);
    }
    line("phases", text + " s");
  }
  if (scene.sim && scene.sim->cell) {
    line("cells",
         fmt::format(
             "{} done, {} lost, {}{} tried", m.cells_done, m.cells_lost,
             (m.cells_without_injection > 0 ? fmt::format("{} got nothing, ", m.cells_without_injection)
                                            : "") +
                 (m.cells_underdosed > 0 ? fmt::format("{} got too little, ", m.cells_underdosed) : ""),
             m.cell_count));
    if (scene.servo.injector && all_read) {
      line("dose", fmt::format("{:.2f} s of {:.2f} s asked", m.injected_s, m.asked_s));
    }
    const auto value = [](const Spread& v, double scale, const char* unit) {
      return v.n == 1 ? fmt::format("{:.3g} {}", v.mean * scale, unit)
                      : fmt::format("{:.3g} +- {:.2g} {}", v.mean * scale, v.deviation() * scale, unit);
    };
    // What no cell came to is not told of.
    const auto told = [&line](const char* of, const Spread& v, const char* what) {
      if (v.n > 0) {
        line(of, "told " + after_or_before(v.mean * 1e3, what) +
                     (v.n > 1 ? fmt::format(" (+- {:.2g} ms)", v.deviation() * 1e3) : ""));
      }
    };
    if (m.lateral_error_m.n > 0) {
      line("entry", fmt::format("lateral error {}", value(m.lateral_error_m, 1e6, "um")));
    }
    told("contact", m.contact_delay_s, "the needle touched");
    told("puncture", m.puncture_delay_s, "the membrane gave way");
    std::string needle =
        fmt::format("peak force {:.1f} uN, depth {:.1f} um", m.peak_force_N * 1e6, m.max_depth_m * 1e6);
    for (const auto& [what, v, scale, unit] :
         {std::tuple{"beyond the puncture", &m.beyond_puncture_m, 1e6, "um"},
          std::tuple{"withdrawal", &m.withdrawal_s, 1.0, "s"}}) {
      needle += v->n > 0 ? fmt::format(", {} {}", what, value(*v, scale, unit)) : "";
    }
    line("needle", needle);
    if (const auto e = m.force_error_rms_N()) {
      line("force estimate",
           fmt::format("error {:.2f} uN rms of {:.2f} uN rms true force", *e * 1e6,
                       std::sqrt(m.true_force2 / static_cast<double>(m.force_ticks)) * 1e6));
    }
    if (m.E_fit_Pa.n > 0) {
      line("modulus", fmt::format("{} by the force sensor, standard deviation {}; the scene has {:.1f} kPa",
                                  value(m.E_fit_Pa, 1e-3, "kPa"), value(m.E_fit_sd_Pa, 1e-3, "kPa"),
                                  scene.servo.membrane ? scene.servo.membrane->E_Pa * 1e-3 : 0.0));
    }
  }
  for (const auto& [what, least_m] :
       {std::pair{"dish floor", m.least_floor_m}, std::pair{"holding pipette", m.least_holder_m}}) {
    if (least_m && *least_m < 0) {
      line("collision", fmt::format("the needle was {:.1f} um in the {}", -*least_m * 1e6, what));
    }
  }
  if (const auto r = m.tremor_ratio()) {
    line("tremor", fmt::format("tip / hand {:.3f} in 8-12 Hz", *r));
  }
  if (scene.vision) {
    line("vision", fmt::format("{} observations, {} times stale ({:.2f} s), {} restarts{}{}", m.observations,
                               m.stale_spells, stale_s(m, core), result.vision_restarts.size(),
                               pictures.unusable > 0 ? fmt::format(", {} of {} pictures unusable",
                                                                   pictures.unusable, pictures.all)
                                                     : "",
                               pictures.compared > 0
                                   ? fmt::format(", outer contour {:.2f} um rms", pictures.contour_rms_um)
                                   : ""));
  }
  line("ticks",
       fmt::format("{} at {} Hz, missed {}{}", core.ticks.load(), scene.servo.rate_Hz, core.missed.load(),
                   core.allocations_watched.load() != 0
                       ? fmt::format(", allocations {}", core.allocations.load())
                       : std::string()));
  if (scene.clock == ClockKind::real) {
    line("timing",
         fmt::format(
             "wake-up p50 {:.0f} p99.9 {:.0f} max {:.0f} us; tick p50 {:.0f} p99.9 {:.0f} max {:.0f} us; "
             "page faults {}",
             core.wake.percentile_us(0.5), core.wake.percentile_us(0.999), core.wake.max_us(),
             core.tick.percentile_us(0.5), core.tick.percentile_us(0.999), core.tick.max_us(),
             result.end == rt::RunEnd::core_died
                 ? "not known"
                 : fmt::format("{} + {}", core.minor_faults.load(), core.major_faults.load())));
  }
  std::string alarms;
  for (std::size_t i = 0; i < std::size(rt::kAlarmNames); ++i) {
    if (seconds_of(m, m.alarm_ticks[i]) >= 0.005 && (1U << i) != rt::alarm_degraded) {
      alarms += fmt::format("{}{} {:.2f} s", alarms.empty() ? "" : ", ", rt::kAlarmNames[i],
                            seconds_of(m, m.alarm_ticks[i]));
    }
  }
  if (!alarms.empty() && all_read) {
    line("alarms", alarms);
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(m.faults.size(), 5); ++i) {
    line("fault",
         painted(Colour::bad, fmt::format("{} at {:.3f} s", rt::name(m.faults[i].fault), m.faults[i].t_s),
                 coloured));
  }
  if (result.end == rt::RunEnd::fault && !m.faults.empty()) {
    line("what to do", kFaultAdvice[static_cast<std::size_t>(m.faults.back().fault)].next);
  }
  for (const NotKept& n : result.not_kept) {
    line("not kept", fmt::format("{} from about {:.3f} s on: {}", n.file, n.t_s, n.why));
  }
  if (result.samples_lost > 0) {
    line("not whole", fmt::format("{} samples of {} were overwritten before they were read: what the run "
                                  "came to above is that of the others",
                                  result.samples_lost, core.ticks.load()));
  }
  if (result.samples_unusable > 0) {
    line("recording", fmt::format("{} samples were not usable", result.samples_unusable));
  }
  if (result.silent_from_s) {
    line("recording", fmt::format("no samples came from {:.3f} s on", *result.silent_from_s));
  }
  if (result.rows_every > 1) {
    line("samples.csv", fmt::format("one row for {} ticks, and every change of phase", result.rows_every));
  }
  return s;
}

}  // namespace punctum::tools
