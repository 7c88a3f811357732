#include "tools/run_report.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <unordered_map>

#include "tools/child.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
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

std::vector<const rt::Right*> rights(const rt::CoreStatus& core) {
  std::vector<const rt::Right*> list;
  const auto n = std::min<std::uint64_t>(core.rights_count.load(), rt::kMaxRights);
  for (std::uint64_t i = 0; i < n; ++i) list.push_back(&core.rights[i]);
  return list;
}

double part_of_limit(const Measures& m, std::uint64_t ticks) {
  return m.ticks > 0 ? static_cast<double>(ticks) * m.last_s / static_cast<double>(m.ticks) : 0;
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::string cell;
  std::istringstream in(line);
  while (std::getline(in, cell, ',')) cells.push_back(cell);
  return cells;
}

// gnuplot's own quoting: a quote is doubled.
std::string in_single_quotes(const std::string& s) {
  std::string out;
  for (const char c : s) {
    if (c == '\'') out += c;
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out;
}

}  // namespace

const char* name(Outcome o) noexcept {
  switch (o) {
    case Outcome::done:
      return "done";
    case Outcome::cell_lost:
      return "cell lost";
    case Outcome::not_injected:
      return "not injected";
    case Outcome::time_limit:
      return "time limit";
    case Outcome::stopped:
      return "stopped";
    case Outcome::fault:
      return "fault";
    case Outcome::core_died:
      return "core died";
  }
  return "unknown";
}

std::optional<ContourError> read_contour_error(const std::string& obs_csv) {
  std::ifstream in(obs_csv);
  std::string line;
  if (!std::getline(in, line)) return std::nullopt;
  const auto head = split(line);
  const auto column = [&head](const char* wanted) {
    const auto it = std::find(head.begin(), head.end(), wanted);
    return it == head.end() ? -1 : static_cast<int>(it - head.begin());
  };
  const int rms = column("outer_rms_um"), p95 = column("outer_p95_um");
  if (rms < 0) return std::nullopt;
  ContourError e;
  double sum = 0, sum95 = 0;
  while (std::getline(in, line)) {
    const auto cells = split(line);
    const auto value = [&cells](int i) {
      if (i < 0 || static_cast<std::size_t>(i) >= cells.size() || cells[static_cast<std::size_t>(i)].empty())
        return -1.0;
      return std::strtod(cells[static_cast<std::size_t>(i)].c_str(), nullptr);
    };
    const double r = value(rms), p = value(p95);
    if (r < 0) continue;
    ++e.frames;
    sum += r * r;
    sum95 += p > 0 ? p * p : 0;
  }
  if (e.frames == 0) return std::nullopt;
  e.rms_um = std::sqrt(sum / static_cast<double>(e.frames));
  e.p95_um = std::sqrt(sum95 / static_cast<double>(e.frames));
  return e;
}

std::string missing_rights(const rt::CoreStatus& core) {
  std::string missing, advice;
  for (const auto* r : rights(core)) {
    if (r->got != 0) continue;
    if (r->required == 0) {
      advice += fmt::format("{}{}", advice.empty() ? "" : ", ", r->name.text);
      continue;
    }
    missing += fmt::format("\n  {:<18} {}", r->name.text, r->detail.text);
    if (r->remedy.text[0] != '\0') missing += fmt::format("\n{:21}get it: {}", "", r->remedy.text);
  }
  if (missing.empty()) return missing;
  std::string text =
      "DEGRADED: these real-time rights are missing, so the timing of this run proves nothing" + missing;
  if (!advice.empty()) text += "\n  also advisable: " + advice + " (punctum check tells how)";
  return text;
}

tl::expected<void, std::string> write_report(const std::string& path, const Scene& scene, const RunEnd& end,
                                             const Measures& m, const rt::CoreStatus& core,
                                             const std::optional<ContourError>& contour) {
  Json j;
  j["outcome"] = name(end.outcome);
  if (!end.outcome_detail.empty()) j["outcome_detail"] = end.outcome_detail;
  j["scene"] = scene.name;
  j["clock"] = scene.clock == ClockKind::real ? "real" : "virtual";
  if (scene.sim) j["seed"] = scene.sim->seed;
  j["rate_hz"] = scene.servo.rate_Hz;
  j["seconds"] = m.last_s;
  j["wall_s"] = end.wall_s;
  j["phases"] = Json::array();
  for (const auto& p : m.phases)
    j["phases"].push_back(
        {{"name", rt::name(p.phase)}, {"start_s", p.start_s}, {"end_s", p.end_s}, {"cell", p.cell}});
  if (m.phase_count > m.phases.size()) j["phases_not_listed"] = m.phase_count - m.phases.size();

  j["ticks"] = core.ticks.load();
  j["missed"] = core.missed.load();
  j["worst_lateness_us"] = static_cast<double>(core.worst_lateness_ns.load()) * 1e-3;
  j["wake_us"] = times(core.wake);
  j["tick_us"] = times(core.tick);  // everything of one tick, the simulated plant included
  j["slots_us"] = Json::object();
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(core.slot_count.load(), rt::kMaxSlots); ++i)
    j["slots_us"][core.slots[i].name.text] = times(core.slots[i].execution);
  // Counted by the core when it ends: unknown of one that was killed.
  const auto counted = [&end](std::uint64_t n) {
    return end.outcome == Outcome::core_died ? Json(nullptr) : Json(n);
  };
  j["page_faults"] = {{"minor", counted(core.minor_faults.load())},
                      {"major", counted(core.major_faults.load())}};
  j["switches"] = {{"voluntary", counted(core.voluntary_switches.load())},
                   {"involuntary", counted(core.involuntary_switches.load())}};
  j["allocations"] = core.allocations_watched.load() != 0 ? Json(core.allocations.load()) : Json(nullptr);
  j["degraded"] = core.degraded.load() != 0;
  j["rights"] = Json::array();
  for (const auto* r : rights(core))
    j["rights"].push_back({{"name", r->name.text},
                           {"got", r->got != 0},
                           {"required", r->required != 0},
                           {"detail", r->detail.text},
                           {"remedy", r->remedy.text}});

  // Against the truth. One number per run: the mean over its cells; peaks are the largest.
  j["contact_delay_ms"] = mean(m.contact_delay_s, 1e3);
  j["puncture_delay_ms"] = mean(m.puncture_delay_s, 1e3);
  j["puncture_inner_delay_ms"] = mean(m.inner_delay_s, 1e3);
  j["force_error_rms_N"] = number(m.force_error_rms_N());
  j["force_error_mean_N"] =
      m.force_ticks > 0 ? Json(m.force_error_sum / static_cast<double>(m.force_ticks)) : Json(nullptr);
  j["true_force_rms_N"] =
      m.force_ticks > 0 ? Json(std::sqrt(m.true_force2 / static_cast<double>(m.force_ticks))) : Json(nullptr);
  j["contour_error_um"] = contour ? Json{{"rms", contour->rms_um}, {"p95", contour->p95_um}} : Json(nullptr);
  j["lateral_error_um"] = mean(m.lateral_error_m, 1e6);
  j["lateral_error_contact_um"] = mean(m.lateral_contact_m, 1e6);
  const bool cell = scene.sim && scene.sim->cell;
  j["peak_force_N"] = cell ? Json(m.peak_force_N) : Json(nullptr);  // at the needle, true
  j["peak_hand_force_N"] = m.peak_hand_N;
  j["max_depth_um"] = cell ? Json(m.max_depth_m * 1e6) : Json(nullptr);
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
                {"without_injection", m.cells_without}};
  j["cell_list"] = Json::array();
  for (const auto& c : m.cells)
    j["cell_list"].push_back({{"cell", c.cell},
                              {"done", c.done},
                              {"lost", c.lost},
                              {"contact_delay_ms", number(c.contact_delay_s, 1e3)},
                              {"puncture_delay_ms", number(c.puncture_delay_s, 1e3)},
                              {"lateral_error_um", number(c.lateral_error_m, 1e6)},
                              {"lateral_error_contact_um", number(c.lateral_contact_m, 1e6)},
                              {"peak_force_N", c.peak_force_N},
                              {"max_depth_um", c.max_depth_m * 1e6},
                              {"depth_beyond_puncture_um", number(c.beyond_puncture_m, 1e6)},
                              {"withdrawal_s", number(c.withdrawal_s)},
                              {"injected_s", number(c.injected_s)}});

  j["observations"] = m.observations;
  j["stale_observations"] = m.stale_spells;  // times an observation became too old
  j["stale_s"] = part_of_limit(m, m.stale_ticks);
  j["vision_restarts"] = Json::array();
  for (const auto& r : end.vision_restarts) j["vision_restarts"].push_back({{"t_s", r.t_s}, {"why", r.why}});
  j["alarms_s"] = Json::object();
  for (std::size_t i = 0; i < std::size(rt::kAlarmNames); ++i)
    if (m.alarm_ticks[i] > 0) j["alarms_s"][rt::kAlarmNames[i]] = part_of_limit(m, m.alarm_ticks[i]);
  j["faults"] = Json::array();
  for (const auto& f : m.faults) j["faults"].push_back({{"name", rt::name(f.fault)}, {"t_s", f.t_s}});
  j["commands_refused"] = core.commands_refused.load();
  j["injected_energy_J"] = m.last.injected_energy_J;
  if (end.unattended) {
    const auto& u = *end.unattended;
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
  j["samples"] = {
      {"rows", end.rows}, {"every", end.rows_every}, {"lost", end.samples_lost}, {"gaps", m.gaps}};
  utsname system{};
  uname(&system);
  j["machine"] = {{"kernel", std::string(system.release) + " " + system.version},
                  {"architecture", system.machine}};
  std::ofstream out(path);
  out << j.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
  if (!out.flush()) return tl::unexpected(path + ": cannot be written");
  return {};
}

std::string summary(const Scene& scene, const RunEnd& end, const Measures& m, const rt::CoreStatus& core,
                    const std::optional<ContourError>& contour) {
  std::string s;
  const auto line = [&s](const char* what, const std::string& text) {
    s += fmt::format("{:<16}{}\n", what, text);
  };
  line("outcome", fmt::format("{}{} after {:.1f} s{}", name(end.outcome),
                              end.outcome_detail.empty() ? "" : " (" + end.outcome_detail + ")", m.last_s,
                              scene.clock == ClockKind::virtual_time
                                  ? fmt::format(" of virtual time, {:.1f} s real", end.wall_s)
                                  : ""));
  if (scene.servo.phases) {
    std::string text;
    const std::size_t shown = std::min<std::size_t>(m.phases.size(), 14);
    for (std::size_t i = 0; i < shown; ++i)
      text +=
          fmt::format("{}{} {:.1f}", i > 0 ? " > " : "", rt::name(m.phases[i].phase), m.phases[i].start_s);
    if (m.phase_count > shown) text += fmt::format(" > ... {} in all", m.phase_count);
    line("phases", text + " s");
  }
  if (scene.sim && scene.sim->cell) {
    line("cells", fmt::format("{} done, {} lost, {}{} tried", m.cells_done, m.cells_lost,
                              m.cells_without > 0 ? fmt::format("{} got nothing, ", m.cells_without) : "",
                              m.cell_count));
    const auto value = [](const Spread& v, double scale, const char* unit) {
      if (v.n == 0) return std::string("-");
      return v.n == 1 ? fmt::format("{:.3g} {}", v.mean * scale, unit)
                      : fmt::format("{:.3g} +- {:.2g} {}", v.mean * scale, v.deviation() * scale, unit);
    };
    line("entry", fmt::format("lateral error {}, contact seen after {}, puncture after {}",
                              value(m.lateral_error_m, 1e6, "um"), value(m.contact_delay_s, 1e3, "ms"),
                              value(m.puncture_delay_s, 1e3, "ms")));
    line("needle", fmt::format("peak force {:.1f} uN, depth {:.1f} um, beyond the puncture {}, withdrawal {}",
                               m.peak_force_N * 1e6, m.max_depth_m * 1e6,
                               value(m.beyond_puncture_m, 1e6, "um"), value(m.withdrawal_s, 1, "s")));
    if (const auto e = m.force_error_rms_N())
      line("force estimate",
           fmt::format("error {:.2f} uN rms of {:.2f} uN rms true force", *e * 1e6,
                       std::sqrt(m.true_force2 / static_cast<double>(m.force_ticks)) * 1e6));
  }
  if (const auto r = m.tremor_ratio()) line("tremor", fmt::format("tip / hand {:.3f} in 8-12 Hz", *r));
  if (scene.vision)
    line("vision", fmt::format("{} observations, {} times stale ({:.2f} s), {} restarts{}", m.observations,
                               m.stale_spells, part_of_limit(m, m.stale_ticks), end.vision_restarts.size(),
                               contour ? fmt::format(", outer contour {:.2f} um rms", contour->rms_um) : ""));
  line("ticks",
       fmt::format("{} at {} Hz, missed {}{}", core.ticks.load(), scene.servo.rate_Hz, core.missed.load(),
                   core.allocations_watched.load() != 0
                       ? fmt::format(", allocations {}", core.allocations.load())
                       : std::string()));
  if (scene.clock == ClockKind::real)
    line("timing",
         fmt::format(
             "wake-up p50 {:.0f} p99.9 {:.0f} max {:.0f} us; tick p50 {:.0f} p99.9 {:.0f} max {:.0f} us; "
             "page faults {}",
             core.wake.percentile_us(0.5), core.wake.percentile_us(0.999), core.wake.max_us(),
             core.tick.percentile_us(0.5), core.tick.percentile_us(0.999), core.tick.max_us(),
             end.outcome == Outcome::core_died
                 ? "not known"
                 : fmt::format("{} + {}", core.minor_faults.load(), core.major_faults.load())));
  std::string alarms;
  for (std::size_t i = 0; i < std::size(rt::kAlarmNames); ++i)
    if (part_of_limit(m, m.alarm_ticks[i]) >= 0.005 && (1U << i) != rt::alarm_degraded)
      alarms += fmt::format("{}{} {:.2f} s", alarms.empty() ? "" : ", ", rt::kAlarmNames[i],
                            part_of_limit(m, m.alarm_ticks[i]));
  if (!alarms.empty()) line("alarms", alarms);
  for (std::size_t i = 0; i < std::min<std::size_t>(m.faults.size(), 5); ++i)
    line("fault", fmt::format("{} at {:.3f} s", rt::name(m.faults[i].fault), m.faults[i].t_s));
  if (end.samples_lost > 0)
    line("recording", fmt::format("{} samples were overrun before they were read", end.samples_lost));
  if (end.rows_every > 1)
    line("samples.csv", fmt::format("one row for {} ticks, and every change of phase", end.rows_every));
  return s;
}

tl::expected<std::string, std::string> draw_figure(const std::string& folder, const Scene& scene,
                                                   const Measures& m, std::uint64_t rows) {
  if (find_program("gnuplot").empty())
    return tl::unexpected(std::string("gnuplot is not installed (package gnuplot-nox)"));
  if (m.ticks < 2) return tl::unexpected(std::string("nothing was recorded"));
  const auto col = [](const char* column) { return fmt::format("(column('{}'))", column); };
  const std::string x = col("t_s") + ":";
  const std::uint64_t every = std::max<std::uint64_t>(1, rows / 6000);
  const double t_end = std::max(m.last_s, 1e-3);
  const bool membrane = scene.servo.membrane.has_value(), cell = scene.sim && scene.sim->cell;

  std::string bands;
  static constexpr const char* colours[rt::kPhases] = {"#f4f4f4", "#fff3cc", "#ffe0b3", "#ffb3a7",
                                                       "#cfe8cf", "#cfe0f5", "#ececec"};
  const std::size_t drawn = std::min<std::size_t>(m.phases.size(), 200);
  int id = 0;
  for (std::size_t i = 0; i < drawn; ++i) {
    const auto& p = m.phases[i];
    bands += fmt::format(
        "set object {} rectangle from first {:.6f}, graph 0 to first {:.6f}, graph 1 behind fillcolor rgb "
        "'{}' "
        "fillstyle solid noborder\n",
        ++id, p.start_s, p.end_s, colours[static_cast<int>(p.phase)]);
  }
  std::string labels;
  double free_from = -1;
  int row = 0;
  for (std::size_t i = 0; scene.servo.phases && i < std::min<std::size_t>(drawn, 40); ++i) {
    const auto& p = m.phases[i];
    row = p.start_s < free_from ? (row + 1) % 3 : 0;
    const bool last = p.start_s > 0.94 * t_end;  // no room to its right
    labels += fmt::format("set label {} '{}' at first {:.6f}, graph {:.3f} {} font ',9' front\n", i + 1,
                          rt::name(p.phase), p.start_s + (last ? -0.003 : 0.003) * t_end, 0.94 - 0.07 * row,
                          last ? "right" : "left");
    free_from = p.start_s + t_end * 0.085;
  }

  const std::string file = folder + "/figure.gp";
  std::ofstream out(file);
  out << "# gnuplot figure.gp\n"
      << "set datafile separator ','\nset datafile columnheaders\n"
      << "set terminal pngcairo size 1300,1000 font 'sans,10' background rgb 'white'\n"
      << "set output 'figure.png'\n"
      << "set multiplot layout 3,1 title '" << in_single_quotes(scene.name)
      << ": force, depth and phases' noenhanced font ',13'\n"
      << "set grid lc rgb '#bbbbbb'\nset key outside right center width -2 samplen 2\nset lmargin 10\nset "
         "rmargin 26\n"
      << fmt::format("set xrange [0:{:.6f}]\n", t_end) << bands << labels;
  const std::string data = fmt::format("'samples.csv' every {} using ", every);
  out << "set ylabel 'at the hand [N]'\n"
      << "plot " << data << x
      << "(sqrt(column('fx_N')**2+column('fy_N')**2+column('fz_N')**2)) with lines lw 2 lc rgb '#222222' "
         "title 'force'";
  if (membrane)
    out << ", " << data << x << col("membrane_N") << " with lines lc rgb '#c0392b' title 'membrane'";
  if (scene.servo.cone)
    out << ", " << data << x << col("cone_N") << " with lines lc rgb '#2980b9' title 'cone'";
  if (scene.servo.axis)
    out << ", " << data << x << col("axis_N") << " with lines lc rgb '#16a085' title 'axis'";
  if (scene.servo.damping)
    out << ", " << data << x << col("damping_N") << " with lines lc rgb '#8e44ad' title 'damping'";
  out << "\nunset label\n";
  if (membrane || cell) {
    out << "set ylabel 'needle force [uN]'\nplot ";
    if (cell)
      out << data << x << "(column('true_force_N')*1e6) with lines lw 2 lc rgb '#999999' title 'true'";
    if (membrane)
      out << (cell ? ", " : "") << data << x
          << "(column('tip_force_N')*1e6) with lines lc rgb '#c0392b' title 'estimate'";
    out << "\nset ylabel 'depth [um]'\nset xlabel 'time [s]'\nplot ";
    if (cell)
      out << data << x << "(-column('true_gap_m')*1e6) with lines lw 2 lc rgb '#999999' title 'tip, true', ";
    if (cell)
      out << data << x << "(column('true_wd_m')*1e6) with lines lw 2 lc rgb '#77aadd' title 'dimple, true', ";
    out << data << x << "(column('wd_m')*1e6) with lines lc rgb '#c0392b' title 'core'\n";
  } else {
    out << "set ylabel 'hand [mm]'\nplot " << data << x << "(column('x_m')*1e3) with lines title 'x', "
        << data << x << "(column('y_m')*1e3) with lines title 'y', " << data << x
        << "(column('z_m')*1e3) with lines title 'z'\n"
        << "set ylabel 'needle tip [um]'\nset xlabel 'time [s]'\nplot " << data << x
        << "(column('tip_x_m')*1e6) with lines title 'x', " << data << x
        << "(column('tip_y_m')*1e6) with lines title 'y', " << data << x
        << "(column('tip_z_m')*1e6) with lines title 'z'\n";
  }
  out << "unset multiplot\n";
  if (!out.flush()) return tl::unexpected(file + ": cannot be written");
  out.close();
  const std::string command = fmt::format("cd '{}' && gnuplot figure.gp >gnuplot.log 2>&1", [&folder] {
    std::string q;
    for (const char c : folder) q += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return q;
  }());
  const int status = std::system(command.c_str());
  std::error_code ec;
  if (status != 0 || !fs::exists(folder + "/figure.png", ec))
    return tl::unexpected("gnuplot: " + last_line(folder + "/gnuplot.log"));
  fs::remove(folder + "/gnuplot.log", ec);
  return folder + "/figure.png";
}

}  // namespace punctum::tools
