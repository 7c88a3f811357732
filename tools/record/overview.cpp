#include "tools/record/overview.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <set>
#include <string_view>

#include "tools/record/recording_reader.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/event_words.hpp"
#include "tools/shared/figure.hpp"
#include "tools/shared/whole_file.hpp"

namespace punctum::tools {
namespace {

constexpr const char* kPicture = "runs.svg";

double length(const v1::Vector& v) { return std::hypot(v.x(), v.y(), v.z()); }

bool pushes(v1::Phase phase) { return phase == v1::PHASE_CONTACT || phase == v1::PHASE_INDENTATION; }

// Reads a run's facts off its messages.
class Reading {
 public:
  explicit Reading(RunFacts& facts) : facts_(facts) {}

  void operator()(const v1::Scene& s) {
    const std::string_view text = s.toml();
    const std::string_view first = text.substr(0, text.find('\n'));
    if (first.starts_with("# ") && first.ends_with(kResolvedScene)) {
      facts_.scene = first.substr(2, first.size() - 2 - kResolvedScene.size());
    }
    if (const auto scene = parse_scene(text, "its scene")) {
      facts_.seed = scene->seed;
    }
  }
  void operator()(const v1::Telemetry& t) {
    ++ticks_;
    facts_.seconds = t.t_s();
    facts_.hand_force_N = std::max(facts_.hand_force_N, length(t.force_n()));
    cells_.insert(t.cell());
    constexpr double kNoneMissing_s = 0.05;
    if (pushes(t.phase()) && !pushes(before_)) {
      const bool seen = t.phase() == v1::PHASE_CONTACT && ticks_ > 1 && t.t_s() - before_s_ < kNoneMissing_s;
      touched_s_ = seen ? std::optional(t.t_s()) : std::nullopt;
    }
    if (t.phase() == v1::PHASE_PUNCTURE && before_ == v1::PHASE_INDENTATION) {
      facts_.punctures.push_back(last_);
    }
    if (t.phase() == v1::PHASE_INDENTATION) {
      last_ = {.t_s = t.t_s(),
               .pressed_s = touched_s_ ? std::optional(t.t_s() - *touched_s_) : std::nullopt,
               .depth_m = t.wd_m(),
               .needle_force_N = t.tip_force_n()};
    }
    if (t.injector_open()) {
      injected_.insert(t.cell());
    }
    before_ = t.phase();
    before_s_ = t.t_s();
  }
  void operator()(const v1::Truth& t) {
    if (!facts_.lost_cells) {
      facts_.lost_cells = 0;
    }
    *facts_.lost_cells += t.lost() && !was_lost_ ? 1 : 0;
    was_lost_ = t.lost();
  }
  void operator()(const v1::Event& e) {
    rt::Event event;
    from_wire(e, event);
    const EventWords words = words_of(event);
    if (words.event == "fault" && facts_.first_fault.empty()) {
      facts_.first_fault = words.what;
    } else if (words.event == "ended") {
      facts_.end = words.what;
    }
  }
  void operator()(const v1::Status& s) {
    facts_.missed_ticks = s.missed();
    from_wire(s.wake(), wake_);
    if (wake_.max_us() > 0) {  // under the virtual clock nobody is woken
      facts_.wake_p999_us = wake_.percentile_us(0.999);
      facts_.wake_max_us = wake_.max_us();
    }
  }
  void operator()(const v1::Loss& l) { facts_.lost_messages = lost_messages(l); }

  // False: there was no tick.
  [[nodiscard]] bool finish() {
    facts_.cells = cells_.size();
    facts_.injected = injected_.size();
    return ticks_ > 0;
  }

 private:
  RunFacts& facts_;
  rt::TimeHistogram wake_;
  RunFacts::Puncture last_;
  std::set<std::uint32_t> cells_, injected_;
  std::uint64_t ticks_ = 0;
  double before_s_ = 0;
  std::optional<double> touched_s_;  // nothing: no tick tells
  v1::Phase before_ = v1::PHASE_FREE;
  bool was_lost_ = false;
};

// Of those that are known.
template <typename Value>
std::optional<double> mean(const std::vector<RunFacts::Puncture>& all, Value RunFacts::Puncture::* what) {
  double sum = 0, known = 0;
  for (const auto& one : all) {
    const std::optional<double> value = one.*what;
    sum += value.value_or(0);
    known += value ? 1 : 0;
  }
  return known > 0 ? std::optional(sum / known) : std::nullopt;
}

// Its cells in the order of kColumns; an empty one is not known.
constexpr std::array kColumns = {"recording",   "scene",    "seed",      "seconds",      "cells",
                                 "injected",    "lost",     "pressed_s", "depth_um",     "needle_uN",
                                 "hand_N",      "fault",    "end",       "missed_ticks", "wake_p999_us",
                                 "wake_max_us", "not_told", "whole"};
using Cells = std::array<std::string, kColumns.size()>;
Cells cells_of(const RunFacts& r) {
  const auto known = [](const auto& value) {
    return value ? fmt::format("{:.10g}", static_cast<double>(*value)) : std::string();
  };
  const auto of_punctures = [&r](auto what, double unit) {
    const auto value = mean(r.punctures, what);
    return value ? fmt::format("{:.4g}", *value / unit) : std::string();
  };
  return {r.recording,
          r.scene,
          known(r.seed),
          fmt::format("{:.4g}", r.seconds),
          std::to_string(r.cells),
          std::to_string(r.injected),
          known(r.lost_cells),
          of_punctures(&RunFacts::Puncture::pressed_s, 1),
          of_punctures(&RunFacts::Puncture::depth_m, 1e-6),
          of_punctures(&RunFacts::Puncture::needle_force_N, 1e-6),
          fmt::format("{:.3g}", r.hand_force_N),
          r.first_fault,
          r.end,
          std::to_string(r.missed_ticks),
          known(r.wake_p999_us),
          known(r.wake_max_us),
          std::to_string(r.lost_messages),
          r.ends.empty() ? "yes" : "no"};
}

// A cell of a table of comma-separated values.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) {
    return text;
  }
  std::string all = "\"";
  for (const char c : text) {
    all += c == '"' ? "\"\"" : std::string(1, c);
  }
  return all + '"';
}

Figure figure_of(const std::vector<RunFacts>& runs) {
  Series depth{.style = Style::points}, force = depth, hand = depth,
                                        typical{.name = "p99.9", .style = Style::points},
                                        worst{.name = "longest", .style = Style::points};
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const RunFacts& r = runs[i];
    const double number = static_cast<double>(i + 1);
    const auto put = [number](Series& s, double y) {
      s.x.push_back(number);
      s.y.push_back(y);
    };
    for (const auto& p : r.punctures) {
      put(depth, p.depth_m * 1e6);
      put(force, p.needle_force_N * 1e6);
    }
    put(hand, r.hand_force_N);
    if (r.wake_p999_us) {
      put(typical, *r.wake_p999_us);
      put(worst, *r.wake_max_us);
    }
  }
  const double end = static_cast<double>(runs.size() + 1);
  const auto panel = [end](const char* title, const char* unit, std::vector<Series> series,
                           bool log_y = false) {
    std::erase_if(series, [](const Series& s) { return s.x.empty(); });
    if (!series.empty()) {  // from the same least value over all runs, so that panels can be compared
      const double least = log_y ? 1 : 0;
      series.push_back({.x = {0, end}, .y = {least, least}, .style = Style::limit});
    }
    return Panel{.title = title,
                 .x_label = "run, in the order of the table",
                 .y_label = unit,
                 .log_y = log_y,
                 .series = std::move(series)};
  };
  Figure figure{.name = "runs", .note = "One point for each cell above, for each run below."};
  for (Panel& one : std::array{panel("Depth of the dimple at the puncture", "um", {depth}),
                               panel("Force at the needle at the puncture", "uN", {force}),
                               panel("Largest force to the hand", "N", {hand}),
                               panel("Wake-up of the core", "us", {typical, worst}, true)}) {
    if (!one.series.empty()) {
      figure.panels.push_back(std::move(one));
    }
  }
  return figure;
}

}  // namespace

tl::expected<RunFacts, std::string> facts_of(const std::string& recording) {
  auto reader = RecordingReader::open(recording);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  RunFacts facts;
  facts.recording = recording;
  Reading reading(facts);
  facts.ends = reader->read_all(reading);
  if (!reading.finish()) {
    return tl::unexpected(recording + ": holds no tick" + (facts.ends.empty() ? "" : "; " + facts.ends));
  }
  return facts;
}

std::string overview_table(const std::vector<RunFacts>& runs) {
  std::vector<Cells> rows = {{}};
  std::copy(kColumns.begin(), kColumns.end(), rows.front().begin());
  for (const RunFacts& r : runs) {
    rows.push_back(cells_of(r));
  }
  std::array<std::size_t, kColumns.size()> widths{};
  for (const Cells& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], std::max<std::size_t>(row[i].size(), 1));
    }
  }
  std::string text;
  for (const Cells& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      fmt::format_to(std::back_inserter(line), "{:<{}}  ", row[i].empty() ? "-" : row[i], widths[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + '\n';
  }
  return text;
}

tl::expected<void, std::string> write_overview(const std::vector<RunFacts>& runs, const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec) {
    return tl::unexpected(folder + ": cannot be made: " + ec.message());
  }
  const fs::path table = fs::path(folder) / "runs.csv", cells = fs::path(folder) / "punctures.csv",
                 picture = fs::path(folder) / kPicture;
  for (const fs::path& path : {table, cells, picture, fs::path(picture).replace_extension(".gp"),
                               fs::path(picture).replace_extension(".log")}) {
    if (is_there(path)) {
      return tl::unexpected(path.string() + ": is there already; an export replaces nothing");
    }
  }
  std::string lines = fmt::format("{}\n", fmt::join(kColumns, ","));
  std::string each = "recording,t_s,pressed_s,depth_um,needle_uN\n";
  for (const RunFacts& r : runs) {
    Cells row = cells_of(r);
    std::transform(row.begin(), row.end(), row.begin(), quoted);
    fmt::format_to(std::back_inserter(lines), "{}\n", fmt::join(row, ","));
    for (const auto& p : r.punctures) {
      fmt::format_to(std::back_inserter(each), "{},{:.9g},{},{:.9g},{:.9g}\n", quoted(r.recording), p.t_s,
                     p.pressed_s ? fmt::format("{:.9g}", *p.pressed_s) : "", p.depth_m * 1e6,
                     p.needle_force_N * 1e6);
    }
  }
  if (auto written = write_whole(table, lines); !written) {
    return written;
  }
  auto written = write_whole(cells, each);
  if (!written) {
    fs::remove(table, ec);
  }
  return written;
}

tl::expected<void, std::string> draw_overview(const std::vector<RunFacts>& runs, const std::string& folder) {
  return draw(figure_of(runs), std::filesystem::path(folder) / kPicture);
}

}  // namespace punctum::tools
