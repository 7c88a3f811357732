#include "tools/punctum/run_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include "rt/station/run_end.hpp"
#include "tools/punctum/facts.hpp"
#include "tools/punctum/run_sentence.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/fault_advice.hpp"
#include "tools/shared/html.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kOpenEvents = 25;    // a longer list of events is folded
constexpr std::size_t kMostEvents = 2000;  // report.json has them all
constexpr std::size_t kMostCells = 200;
constexpr std::uintmax_t kLargestFrame = 4U << 20U;
constexpr std::uintmax_t kLargestScene = 1U << 20U;

constexpr const char* kStyle = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 1240px; margin: 1.5rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; margin: 0 0 .1rem; } h2 { font-size: 1.2rem; margin: 2rem 0 .4rem; border-top: 1px solid #ddd; padding-top: .9rem; }
.about { color: #666; margin: 0 0 .8rem; }
.outcome { border-left: 6px solid #888; background: #f4f4f4; padding: .7rem 1rem; margin: .8rem 0; }
.outcome b { font-size: 1.1rem; display: block; } .good { border-color: #2e8b57; background: #eef8f1; }
.fair { border-color: #d79a00; background: #fff8e5; } .bad { border-color: #c0392b; background: #fdeeee; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1.2rem; margin: .5rem 0; } dt { font-weight: 600; color: #555; } dd { margin: 0; overflow-wrap: anywhere; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: .87rem; margin: .5rem 0; }
th, td { padding: .18rem .7rem; text-align: left; border-bottom: 1px solid #e6e6e6; } th { background: #f7f7f7; font-weight: 600; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; } tr.all td { font-weight: 600; border-top: 2px solid #999; }
figure { margin: .8rem 0; } figure svg { max-width: 100%; height: auto; display: block; } figcaption { color: #555; font-size: .88rem; }
.frames { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: .8rem; } .frames figure { margin: 0; position: relative; } .frames span { position: absolute; right: .6rem; top: .5rem; color: #fff; background: #0009; padding: 0 .4rem; } .frames img { width: 100%; height: auto; display: block; }
pre { background: #f7f7f7; padding: .7rem; overflow-x: auto; font-size: .82rem; } summary { cursor: pointer; color: #0072b2; }
@media print { body { margin: 0; max-width: none; font-size: 10.5pt; } h2 { break-after: avoid; } figure, .outcome, tr { break-inside: avoid; }
.frames { grid-template-columns: 1fr 1fr; } .wide { overflow: visible; } * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
)";

std::string head(std::string_view title) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
         "content=\"width=device-width, initial-scale=1\">\n<title>" +
         escaped(title) + "</title>\n<style>" + kStyle + "</style>\n</head>\n<body>\n";
}

std::string read_small(const fs::path& path, std::uintmax_t largest) {
  std::error_code ec;
  if (!fs::is_regular_file(path, ec) || fs::file_size(path, ec) > largest || ec) {
    return {};
  }
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A number as text, or a dash.
std::string shown(const std::optional<double>& v, const char* unit = "", double scale = 1, int digits = 3) {
  if (!v) {
    return "-";
  }
  const std::string space = *unit != '\0' ? " " : "";
  return fmt::format("{:.{}g}{}{}", *v * scale, digits, space, unit);
}

std::string whole(const std::optional<double>& v) { return v ? fmt::format("{:.0f}", *v) : "-"; }

class Facts {
 public:
  void row(const char* what, const std::string& value) {
    if (!value.empty()) {
      text_ += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escaped(what), escaped(value));
    }
  }
  [[nodiscard]] std::string html() const { return text_.empty() ? "" : "<dl>\n" + text_ + "</dl>\n"; }

 private:
  std::string text_;
};

const char* kind_of(const std::string& outcome) {
  using rt::RunEnd;
  if (outcome == rt::name(RunEnd::done)) {
    return "good";
  }
  for (const RunEnd bad : {RunEnd::fault, RunEnd::core_died, RunEnd::cell_lost}) {
    if (outcome == rt::name(bad)) {
      return "bad";
    }
  }
  return "fair";
}

std::string outcome_html(const Json& facts) {
  const std::string outcome = text_in(facts, "outcome");
  std::string s = fmt::format("<div class=\"outcome {}\"><b>{}</b>{}</div>\n", kind_of(outcome),
                              escaped(outcome), escaped(run_sentence(facts)));
  for (const Json& f : list_in(facts, "faults")) {
    if (const auto fault = fault_named(text_in(f, "name"))) {
      const FaultAdvice& advice = kFaultAdvice[static_cast<std::size_t>(*fault)];
      s += fmt::format(
          "<div class=\"outcome bad\"><b>fault {} at {:.3f} s</b>Cause: {}. What to do: {}. It is cleared "
          "{}.</div>\n",
          escaped(rt::name(*fault)), number_in(f, "t_s").value_or(0), escaped(advice.cause),
          escaped(advice.next), escaped(clearing_condition(*fault)));
    }
  }
  if (flag_in(facts, "rebuilt")) {
    s += "<div class=\"outcome fair\"><b>rebuilt</b>The run left no report of its own. This one was made "
         "from its samples and events; what they do not tell is unknown: the times on the machine, lost "
         "samples, missed ticks, what each cell got.</div>\n";
  }
  for (const Json& n : list_in(facts, "not_kept")) {
    s +=
        fmt::format("<div class=\"outcome fair\"><b>not kept</b>{} from about {:.3f} s on: {}</div>\n",
                    escaped(text_in(n, "file")), number_in(n, "t_s").value_or(0), escaped(text_in(n, "why")));
  }
  return s;
}

std::string origin_html(const Json& facts) {
  const Json& machine = fact(facts, "machine");
  Facts f;
  f.row("begun", text_in(facts, "begun_at"));
  f.row("lasted", fmt::format("{:.1f} s, {}", number_in(facts, "seconds").value_or(0),
                              text_in(facts, "clock") == "virtual"
                                  ? "of virtual time" +
                                        (number_in(facts, "wall_s")
                                             ? fmt::format(" ({:.1f} s real)", *number_in(facts, "wall_s"))
                                             : std::string())
                                  : "real time"));
  f.row("program", text_in(facts, "program"));
  f.row("command", text_in(facts, "command_line"));
  f.row("scene",
        text_in(facts, "scene") +
            (text_in(facts, "scene_source").empty() ? "" : " (" + text_in(facts, "scene_source") + ")"));
  f.row("servo",
        number_in(facts, "rate_hz")
            ? fmt::format(
                  "{:g} Hz{}", *number_in(facts, "rate_hz"),
                  number_in(facts, "seed") ? fmt::format(", seed {:.0f}", *number_in(facts, "seed")) : "")
            : "");
  if (!text_in(machine, "name").empty()) {
    f.row("machine",
          fmt::format("{}: {}, {} cores, {}", text_in(machine, "name"), text_in(machine, "processor"),
                      whole(number_in(machine, "cores")), text_in(machine, "architecture")));
  }
  if (!text_in(machine, "kernel").empty()) {
    f.row("kernel",
          fmt::format("{} ({})", text_in(machine, "kernel"),
                      flag_in(machine, "real_time_kernel") ? "PREEMPT_RT" : "not a real-time kernel"));
  }
  std::string missing;
  for (const Json& r : list_in(facts, "rights")) {
    if (!flag_in(r, "got") && flag_in(r, "required")) {
      missing += (missing.empty() ? "" : ", ") + text_in(r, "name");
    }
  }
  if (text_in(facts, "clock") == "real" && fact(facts, "degraded").is_boolean()) {
    f.row("real-time rights", flag_in(facts, "degraded")
                                  ? "DEGRADED, the timing proves nothing; missing: " + missing
                                  : "all there");
  }
  return "<h2>What was run</h2>\n" + f.html();
}

struct KeyFrame {
  std::string what, file;
  double t_s = 0;
  long number = 0;
};

// Start, contact, puncture and end: of the pictures that there are, the first at or after each.
std::vector<KeyFrame> key_frames(const std::string& folder, const Json& facts) {
  std::map<long, fs::path> pictures;
  std::error_code ec;
  for (auto it = fs::directory_iterator(fs::path(folder) / "frames", ec);
       !ec && it != fs::directory_iterator(); it.increment(ec)) {
    const std::string stem = it->path().stem().string();
    const std::string ending = it->path().extension().string();
    if ((ending == ".png" || ending == ".jpg") && !stem.empty() && stem.size() <= 12 &&
        stem.find_first_not_of("0123456789") == std::string::npos) {
      pictures[std::stol(stem)] = it->path();
    }
  }
  std::vector<KeyFrame> all;
  CsvReader row(folder + "/obs.csv");
  while (row.next()) {
    const auto frame = row.number("frame"), t_s = row.number("t_s");
    if (!frame || !t_s || !(*frame >= 0 && *frame < 1e12)) {
      continue;
    }
    const auto found = pictures.find(static_cast<long>(*frame));
    if (found != pictures.end()) {
      all.push_back({std::string(row.text("phase")), found->second.string(), *t_s, found->first});
    }
  }
  std::vector<KeyFrame> chosen;
  const auto choose = [&](const char* what, double from_s) {
    for (const KeyFrame& k : all) {
      if (k.t_s >= from_s && (chosen.empty() || chosen.back().number < k.number)) {
        chosen.push_back({what, k.file, k.t_s, k.number});
        return;
      }
    }
  };
  if (all.empty()) {
    return chosen;
  }
  choose("start", all.front().t_s);
  for (const char* wanted : {"contact", "puncture"}) {
    for (const Json& p : list_in(facts, "phases")) {
      if (text_in(p, "name") == wanted) {
        choose(wanted, number_in(p, "start_s").value_or(0));
        break;
      }
    }
  }
  choose("end", all.back().t_s);
  return chosen;
}

std::string frames_html(const std::string& folder, const Json& facts) {
  std::string s;
  for (const KeyFrame& k : key_frames(folder, facts)) {
    const std::string bytes = read_small(k.file, kLargestFrame);
    if (bytes.empty()) {
      continue;
    }
    const std::string caption = fmt::format("{}: t = {:.3f} s, frame {}", k.what, k.t_s, k.number);
    s += fmt::format(
        "<figure><span>t = {:.3f} s</span><img alt=\"{}\" "
        "src=\"data:image/{};base64,{}\"><figcaption>{}</figcaption></figure>\n",
        k.t_s, escaped(caption), k.file.ends_with(".png") ? "png" : "jpeg", base64(bytes), escaped(caption));
  }
  if (s.empty()) {
    return {};
  }
  return "<h2>What the camera saw</h2>\n<p class=\"about\">Drawn in by vision: outer membrane green, inner "
         "cyan, "
         "undeformed circle dashed, needle yellow, tip red, contact points magenta, dimple orange, holding "
         "pipette "
         "blue.</p>\n<div class=\"frames\">\n" +
         s + "</div>\n";
}

std::string phases_text(const Json& facts) {
  std::string s;
  std::size_t n = 0;
  for (const Json& p : list_in(facts, "phases")) {
    if (++n > 14) {
      return s + " > ...";
    }
    s += fmt::format("{}{} {:.2f} s", s.empty() ? "" : " > ", text_in(p, "name"),
                     number_in(p, "start_s").value_or(0));
  }
  return s;
}

std::string measures_html(const Json& facts) {
  Facts f;
  const auto n = [&facts](const char* name) { return number_in(facts, name); };
  const bool rebuilt = flag_in(facts, "rebuilt");
  const auto known = [rebuilt](const std::optional<double>& v, const char* unit, double scale = 1) {
    return rebuilt && !v ? "unknown" : shown(v, unit, scale);
  };
  const Json& needle = fact(facts, "needle_at_end");
  f.row("phases begin at", phases_text(facts));
  f.row("needle at the end",
        text_in(needle, "in_words") +
            (text_in(needle, "known_from").empty() || text_in(needle, "known_from") == "nobody"
                 ? ""
                 : " (known from: " + text_in(needle, "known_from") + ")"));
  const Json& dose = fact(facts, "dose");
  const bool told = text_in(dose, "known_from") == "injector";
  f.row("dose",
        dose.is_object()
            ? fmt::format("{} given of {} asked{}", known(number_in(dose, "given_s"), "s"),
                          known(number_in(dose, "asked_s"), "s"), told ? " (known from: injector)" : "")
            : std::string());
  const Json& cells = fact(facts, "cells");
  if (number_in(cells, "tried").value_or(0) > 0) {
    f.row("cells", fmt::format("{} done, {} lost, {} tried", whole(number_in(cells, "done")),
                               whole(number_in(cells, "lost")), whole(number_in(cells, "tried"))));
    const auto delay = [&](const char* name, const char* what) {
      return n(name) ? after_or_before(n(name), what) : rebuilt ? "unknown" : std::string();
    };
    f.row("contact told", delay("contact_delay_ms", "the needle touched"));
    f.row("puncture told", delay("puncture_delay_ms", "the membrane gave way"));
    f.row("beside the axis", known(n("lateral_error_um"), "um where the membrane gave way"));
    f.row("peak needle force", shown(n("peak_force_N"), "uN", 1e6));
    f.row("force estimate", n("force_error_rms_N") ? fmt::format("{} rms error of {} rms true force",
                                                                 shown(n("force_error_rms_N"), "uN", 1e6),
                                                                 shown(n("true_force_rms_N"), "uN", 1e6))
                                                   : std::string());
    f.row("modulus", n("E_fit_kPa") ? fmt::format("{}, standard deviation {}", shown(n("E_fit_kPa"), "kPa"),
                                                  shown(n("E_fit_sd_kPa"), "kPa"))
                                    : std::string());
    f.row("deepest", shown(n("max_depth_um"), "um") + ", beyond the puncture " +
                         known(n("depth_beyond_puncture_um"), "um"));
    f.row("withdrawal", shown(n("withdrawal_s"), "s"));
  }
  f.row("peak force at the hand", shown(n("peak_hand_force_N"), "N"));
  f.row("tremor, tip / hand", n("tremor_ratio") ? shown(n("tremor_ratio"), "in 8-12 Hz") : std::string());
  if (n("observations").value_or(0) > 0) {
    f.row("vision", fmt::format("{} observations, {} times stale ({}), {} restarts{}",
                                whole(n("observations")), whole(n("stale_observations")),
                                shown(n("stale_s"), "s"), list_in(facts, "vision_restarts").size(),
                                n("pictures_unusable").value_or(0) > 0
                                    ? fmt::format(", {} pictures unusable", whole(n("pictures_unusable")))
                                    : std::string()));
  }
  std::string s = "<h2>What came of it</h2>\n" + f.html();
  const auto list = list_in(facts, "cell_list");
  if (list.size() < 2) {
    return s;
  }
  s += "<div class=\"wide\"><table>\n<tr><th>cell</th><th>came to</th><th>beside the axis [um]</th><th>peak "
       "force "
       "[uN]</th><th>deepest [um]</th><th>given [s]</th><th>asked [s]</th></tr>\n";
  for (std::size_t i = 0; i < std::min(list.size(), kMostCells); ++i) {
    const Json& c = list[i];
    const auto cell = [&c](const char* name, double scale = 1) {
      return "<td class=\"number\">" + shown(number_in(c, name), "", scale) + "</td>";
    };
    s += fmt::format("<tr><td class=\"number\">{:.0f}</td><td>{}</td>", number_in(c, "cell").value_or(0) + 1,
                     flag_in(c, "lost")   ? "lost"
                     : flag_in(c, "done") ? "done"
                                          : "not done") +
         cell("lateral_error_um") + cell("peak_force_N", 1e6) + cell("max_depth_um") + cell("injected_s") +
         cell("asked_s") + "</tr>\n";
  }
  return s + "</table></div>\n";
}

std::string histogram_html(const char* title, const Json& facts, const char* bins, const char* percentiles) {
  const Json& h = fact(facts, bins);
  TimesHistogram drawing{.title = title, .from_us = {}, .count = {}};
  for (const Json& v : list_in(h, "from_us")) {
    drawing.from_us.push_back(v.is_number() ? v.get<double>() : 0);
  }
  for (const Json& v : list_in(h, "count")) {
    drawing.count.push_back(v.is_number() ? v.get<double>() : 0);
  }
  if (drawing.from_us.empty()) {
    return {};
  }
  const Json& p = fact(facts, percentiles);
  drawing.over = number_in(h, "over").value_or(0);
  drawing.p50_us = number_in(p, "p50").value_or(0);
  drawing.p99_9_us = number_in(p, "p99_9").value_or(0);
  drawing.max_us = number_in(p, "max").value_or(0);
  return "<figure>" + svg(drawing) + "</figure>\n";
}

std::string timing_html(const Json& facts) {
  Facts f;
  const auto percentiles = [&facts](const char* name) {
    const Json& p = fact(facts, name);
    return number_in(p, "p50") ? fmt::format("p50 {}, p99 {}, p99.9 {}, longest {} us",
                                             whole(number_in(p, "p50")), whole(number_in(p, "p99")),
                                             whole(number_in(p, "p99_9")), whole(number_in(p, "max")))
                               : std::string();
  };
  const bool real = text_in(facts, "clock") == "real";
  f.row("ticks", number_in(facts, "ticks") ? fmt::format("{}, missed {}", whole(number_in(facts, "ticks")),
                                                         whole(number_in(facts, "missed")))
                                           : std::string());
  if (real) {
    f.row("wake-up after its release", percentiles("wake_us"));
  }
  f.row("one tick of work", percentiles("tick_us"));
  std::map<std::string, int> causes;
  for (const Json& late : fact(facts, "late_ticks")) {
    ++causes[text_in(late, "cause")];
  }
  std::string by_cause;
  for (const auto& [cause, count] : causes) {
    by_cause += fmt::format("{}{} by {}", by_cause.empty() ? "" : ", ", count, cause);
  }
  f.row("late ticks", by_cause);
  const Json& faults = fact(facts, "page_faults");
  if (number_in(faults, "minor")) {
    f.row("page faults", fmt::format("{} minor, {} major", whole(number_in(faults, "minor")),
                                     whole(number_in(faults, "major"))));
  }
  std::string s = "<h2>Timing</h2>\n" + f.html();
  if (!real) {
    s += "<p class=\"about\">The clock was virtual: it waits for everybody, so wake-ups tell nothing of this "
         "machine.</p>\n";
  } else {
    s += histogram_html("wake-up after its release", facts, "wake_histogram", "wake_us");
  }
  return s + histogram_html("one tick of work", facts, "tick_histogram", "tick_us");
}

std::string alarms_html(const Json& facts) {
  std::string s = "<h2>Alarms and events</h2>\n";
  Facts f;
  const Json& alarms = fact(facts, "alarms_s");
  if (alarms.is_object()) {
    for (const auto& [name, seconds] : alarms.items()) {
      f.row(name.c_str(), seconds.is_number() ? fmt::format("{:.3f} s in all", seconds.get<double>()) : "");
    }
  }
  if (f.html().empty()) {
    s += alarms.is_object() ? "<p class=\"about\">No alarm was raised.</p>\n"
                            : "<p class=\"about\">For how long alarms were raised is not known.</p>\n";
  } else {
    s += f.html();
  }
  const auto events = list_in(facts, "events");
  if (events.empty()) {
    return s;
  }
  const bool folded = events.size() > kOpenEvents;
  s += folded ? fmt::format("<details><summary>{} events</summary>\n", events.size()) : std::string();
  s += "<table>\n<tr><th>time [s]</th><th>event</th><th>what</th><th>by</th></tr>\n";
  for (std::size_t i = 0; i < std::min(events.size(), kMostEvents); ++i) {
    const Json& e = events[i];
    const bool cell = number_in(e, "cell") && number_in(e, "cell") > 0;
    s += fmt::format(
        "<tr><td class=\"number\">{:.3f}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        number_in(e, "t_s").value_or(0), escaped(text_in(e, "event")),
        escaped(text_in(e, "what") + (cell ? fmt::format(", cell {:.0f}", *number_in(e, "cell") + 1) : "")),
        escaped(text_in(e, "writer")));
  }
  s += "</table>\n";
  if (events.size() > kMostEvents) {
    s += "<p class=\"about\">report.json lists the others.</p>\n";
  }
  return s + (folded ? "</details>\n" : "");
}

std::string scene_html(const std::string& folder) {
  const std::string text = read_small(fs::path(folder) / "scene.toml", kLargestScene);
  return text.empty()
             ? std::string()
             : "<h2>Scene</h2>\n<details><summary>the whole scene as it ran (scene.toml)</summary>\n<pre>" +
                   escaped(text) + "</pre></details>\n";
}

// What a comparison shows of each run.
struct Compared {
  const char* title;
  const char* group;  // the object in report.json; null: the top
  const char* name;
  double scale;
  int digits;
};
constexpr Compared kCompared[] = {
    {"seconds", nullptr, "seconds", 1, 4},
    {"seed", nullptr, "seed", 1, 9},
    {"cells done", "cells", "done", 1, 9},
    {"cells lost", "cells", "lost", 1, 9},
    {"given [s]", "dose", "given_s", 1, 3},
    {"beside the axis [um]", nullptr, "lateral_error_um", 1, 3},
    {"contact told after it [ms], < 0: foreseen", nullptr, "contact_delay_ms", 1, 3},
    {"puncture told after it [ms]", nullptr, "puncture_delay_ms", 1, 3},
    {"peak force [uN]", nullptr, "peak_force_N", 1e6, 3},
    {"deepest [um]", nullptr, "max_depth_um", 1, 3},
    {"withdrawal [s]", nullptr, "withdrawal_s", 1, 3},
    {"force error [uN rms]", nullptr, "force_error_rms_N", 1e6, 3},
    {"tremor tip/hand", nullptr, "tremor_ratio", 1, 3},
    {"stale [s]", nullptr, "stale_s", 1, 3},
    {"missed ticks", nullptr, "missed", 1, 9},
    {"tick p99.9 [us]", "tick_us", "p99_9", 1, 3},
};

std::optional<double> value_of(const Json& facts, const Compared& c) {
  const auto v = number_in(c.group == nullptr ? facts : fact(facts, c.group), c.name);
  return v ? std::optional(*v * c.scale) : std::nullopt;
}

// A seed has no mean; a single value has no spread.
std::string mean_text(const std::vector<ComparedRun>& runs, const Compared& c) {
  double n = 0, mean = 0, m2 = 0;
  for (const ComparedRun& run : runs) {
    if (const auto v = value_of(run.facts, c)) {
      ++n;
      const double d = *v - mean;
      mean += d / n;
      m2 += d * (*v - mean);
    }
  }
  if (n < 2 || std::string_view(c.name) == "seed") {
    return {};
  }
  return fmt::format("{:.3g} ± {:.2g}", mean, std::sqrt(m2 / (n - 1)));
}

bool shown_at_all(const std::vector<ComparedRun>& runs, const Compared& c) {
  return std::any_of(runs.begin(), runs.end(),
                     [&c](const ComparedRun& run) { return value_of(run.facts, c).has_value(); });
}

// When the needle came to the cell; the start of the run where it never did.
double contact_s(const Json& facts) {
  for (const Json& p : list_in(facts, "phases")) {
    if (text_in(p, "name") == "contact") {
      return number_in(p, "start_s").value_or(0);
    }
  }
  return 0;
}

// The first curve of each run's panel: the true one where the truth is known.
TimeChart compared_chart(const std::vector<ComparedRun>& runs) {
  const bool at_contact =
      std::all_of(runs.begin(), runs.end(), [](const ComparedRun& r) { return contact_s(r.facts) > 0; });
  TimeChart chart;
  chart.title = "the runs compared over time";
  chart.time_label = at_contact ? "time after the first contact [s]" : "time [s]";
  const auto shift = [at_contact](const ComparedRun& r) { return at_contact ? contact_s(r.facts) : 0.0; };
  bool first = true;
  for (const ComparedRun& run : runs) {
    const double begin_s = run.chart.begin_s - shift(run), end_s = run.chart.end_s - shift(run);
    chart.begin_s = first ? begin_s : std::min(chart.begin_s, begin_s);
    chart.end_s = first ? end_s : std::max(chart.end_s, end_s);
    first = false;
  }
  for (const ComparedRun& run : runs) {
    for (std::size_t i = 0; i < run.chart.panels.size(); ++i) {
      const ChartPanel& from = run.chart.panels[i];
      if (from.curves.empty()) {
        continue;
      }
      auto into = std::find_if(chart.panels.begin(), chart.panels.end(),
                               [&from](const ChartPanel& p) { return p.y_label == from.y_label; });
      if (into == chart.panels.end()) {
        chart.panels.push_back({from.y_label, {}});
        into = chart.panels.end() - 1;
      }
      Curve curve(run.name, chart.begin_s, chart.end_s);
      for (const auto& stroke : from.curves.front().strokes()) {
        for (const Curve::Point& p : stroke) {
          curve.add(p.t_s - shift(run), p.value);
        }
        curve.add(0, std::nan(""));
      }
      into->curves.push_back(std::move(curve));
    }
  }
  return chart;
}

}  // namespace

std::string run_page(const std::string& folder, const Json& facts, const std::string& drawing) {
  const std::string scene = text_in(facts, "scene"), title = text_in(facts, "title");
  std::string s = head(fmt::format("punctum: {} {}", scene, text_in(facts, "begun_at")));
  s += fmt::format("<h1>{}</h1>\n<p class=\"about\">{}</p>\n", escaped(scene), escaped(title));
  s += outcome_html(facts) + origin_html(facts);
  if (!drawing.empty()) {
    s += "<h2>Force, depth, phases and alarms over time</h2>\n<figure>" + drawing + "</figure>\n";
  }
  s += frames_html(folder, facts) + measures_html(facts) + timing_html(facts) + alarms_html(facts) +
       scene_html(folder);
  return s +
         "<p class=\"about\">All numbers are in report.json, every recorded tick in samples.csv. What a "
         "simulated "
         "station measures is no measurement on cells.</p>\n</body>\n</html>\n";
}

std::string comparison_page(const std::vector<ComparedRun>& runs) {
  std::string s = head(fmt::format("punctum: {} runs compared", runs.size())) +
                  fmt::format(
                      "<h1>{} runs compared</h1>\n<div class=\"wide\"><table>\n<tr><th>run</th><th>scene</th>"
                      "<th>outcome</th>",
                      runs.size());
  std::vector<Compared> columns;
  for (const Compared& c : kCompared) {
    if (shown_at_all(runs, c)) {
      columns.push_back(c);
      s += "<th>" + escaped(c.title) + "</th>";
    }
  }
  s += "</tr>\n";
  for (const ComparedRun& run : runs) {
    s += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td>", escaped(run.name),
                     escaped(text_in(run.facts, "scene")), escaped(text_in(run.facts, "outcome")));
    for (const Compared& c : columns) {
      s += "<td class=\"number\">" + shown(value_of(run.facts, c), "", 1, c.digits) + "</td>";
    }
    s += "</tr>\n";
  }
  s += "<tr class=\"all\"><td>mean ± standard deviation</td><td></td><td></td>";
  for (const Compared& c : columns) {
    s += "<td class=\"number\">" + mean_text(runs, c) + "</td>";
  }
  s += "</tr>\n</table></div>\n";
  const TimeChart chart = compared_chart(runs);
  if (!chart.panels.empty()) {
    s += "<h2>The first curve of each run</h2>\n<figure>" + svg(chart) + "</figure>\n";
  }
  for (const ComparedRun& run : runs) {
    s += fmt::format("<div class=\"outcome {}\"><b>{}</b>{}</div>\n", kind_of(text_in(run.facts, "outcome")),
                     escaped(run.name), escaped(run_sentence(run.facts)));
  }
  return s + "</body>\n</html>\n";
}

std::string comparison_text(const std::vector<ComparedRun>& runs) {
  std::size_t longest = 3;
  for (const ComparedRun& run : runs) {
    longest = std::max(longest, run.name.size());
  }
  std::string s = fmt::format("{:<{}}  {:<18} {:>8} {:>6} {:>12} {:>10} {:>9}\n", "run", longest, "outcome",
                              "seconds", "cells", "beside [um]", "peak [uN]", "deep [um]");
  for (const ComparedRun& run : runs) {
    const auto n = [&run](const char* name) { return number_in(run.facts, name); };
    s += fmt::format("{:<{}}  {:<18} {:>8} {:>6} {:>12} {:>10} {:>9}\n", run.name, longest,
                     text_in(run.facts, "outcome"), shown(n("seconds"), "", 1, 4),
                     whole(number_in(fact(run.facts, "cells"), "done")), shown(n("lateral_error_um")),
                     shown(n("peak_force_N"), "", 1e6), shown(n("max_depth_um")));
  }
  return s;
}

}  // namespace punctum::tools
