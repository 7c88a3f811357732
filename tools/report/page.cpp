#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <numeric>

#include "tools/report/output.hpp"
#include "tools/shared/html.hpp"

namespace punctum::report {
namespace {

namespace fs = std::filesystem;
using tools::escaped;

constexpr std::size_t kShortTable = 30, kRowsOfLong = 8;
constexpr int kDigits = 4;

constexpr const char* kStyle = R"(
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 1280px; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem; } h2 { font-size: 1.35rem; margin: 3rem 0 .3rem; border-top: 1px solid #ddd; padding-top: 1.2rem; }
.about { color: #666; margin: 0 0 .6rem; } .reading { background: #eef5fb; border-left: 4px solid #0072b2; padding: .6rem .9rem; margin: .6rem 0 1.2rem; }
.failed { background: #fdeeee; border-left: 4px solid #c0392b; padding: .6rem .9rem; }
figure { margin: 1.2rem 0; } figure svg { max-width: 100%; height: auto; } figcaption { color: #555; font-size: .9rem; }
.wide { overflow-x: auto; margin: 1rem 0; } table { border-collapse: collapse; font-size: .85rem; }
caption { text-align: left; color: #555; padding-bottom: .3rem; } th, td { padding: .2rem .7rem; text-align: left; border-bottom: 1px solid #e6e6e6; white-space: nowrap; }
th { font-weight: 600; background: #f7f7f7; } tr.shipped { font-weight: 600; background: #eef5fb; } td.number { text-align: right; font-variant-numeric: tabular-nums; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1rem; font-size: .85rem; color: #555; } dt { font-weight: 600; } dd { margin: 0; overflow-wrap: anywhere; }
nav a { margin-right: 1rem; }
)";

std::string table_html(const Table& t) {
  std::vector<std::size_t> columns;
  for (std::size_t i = 0; i < t.columns.size(); ++i) {
    if (t.shown.empty() || std::find(t.shown.begin(), t.shown.end(), t.columns[i]) != t.shown.end()) {
      columns.push_back(i);
    }
  }
  std::vector<std::size_t> rows = t.shown_rows;
  if (rows.empty() || t.rows.size() <= kShortTable) {
    rows.resize(t.rows.size() <= kShortTable ? t.rows.size() : kRowsOfLong);
    std::iota(rows.begin(), rows.end(), std::size_t{0});
  }
  std::string what = t.name + ".csv";
  if (rows.size() < t.rows.size()) {
    what += fmt::format(", {} of {} rows", rows.size(), t.rows.size());
  }
  if (columns.size() < t.columns.size()) {
    what += fmt::format(", {} of {} columns", columns.size(), t.columns.size());
  }
  std::string s = "<div class=\"wide\"><table><caption>" + escaped(what) + "</caption>\n<tr>";
  for (const std::size_t c : columns) {
    s += "<th>" + escaped(t.columns[c]) + "</th>";
  }
  s += "</tr>\n";
  const auto shipped =
      static_cast<std::size_t>(std::find(t.columns.begin(), t.columns.end(), "shipped") - t.columns.begin());
  for (const std::size_t r : rows) {
    const bool bold = shipped < t.columns.size() && t.rows[r][shipped].text() == "1";
    s += bold ? "<tr class=\"shipped\">" : "<tr>";
    for (const std::size_t c : columns) {
      const Cell& cell = t.rows[r][c];
      const bool words = std::holds_alternative<std::string>(cell.value());
      s += (words ? "<td>" : "<td class=\"number\">") + escaped(cell.text(kDigits)) + "</td>";
    }
    s += "</tr>\n";
  }
  return s + "</table></div>\n";
}

// Only the <svg> element; what precedes it belongs to a separate file.
std::string figure_html(const Figure& f, const fs::path& out) {
  std::ifstream in(out / (f.name + ".svg"), std::ios::binary);
  const std::string svg{std::istreambuf_iterator<char>(in), {}};
  const auto begin = svg.find("<svg");
  const std::string drawing = begin == std::string::npos
                                  ? "<p class=\"failed\">" + escaped(f.name) + ".svg was not drawn</p>"
                                  : svg.substr(begin);
  return "<figure>" + drawing + "<figcaption>" + escaped(f.note) + "</figcaption></figure>\n";
}

}  // namespace

std::string page(std::span<const Finished> topics, const Provenance& from, const fs::path& out) {
  std::string s =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>punctum: error against run "
      "time</title>\n<style>";
  s += kStyle;
  s += "</style>\n</head>\n<body>\n<h1>Error against run time</h1>\n<p class=\"about\">What each method of "
       "the control "
       "firmware costs, how far it is from the truth, and where it stops being stable.</p>\n<dl>";
  for (const auto& [key, value] : {std::pair<const char*, std::string>{"machine", from.machine},
                                   {"compiler", from.compiler},
                                   {"flags", from.flags},
                                   {"commit", from.commit}}) {
    s += fmt::format("<dt>{}</dt><dd>{}</dd>", key, escaped(value));
  }
  s += "</dl>\n<nav>";
  for (const Finished& t : topics) {
    s += fmt::format("<a href=\"#{0}\">{0}</a>", escaped(t.topic));
  }
  s += "</nav>\n";
  for (const Finished& t : topics) {
    s += fmt::format("<section id=\"{0}\">\n<h2>{0}</h2>\n<p class=\"about\">{1}</p>\n", escaped(t.topic),
                     escaped(t.about));
    if (!t.error.empty()) {
      s += "<p class=\"failed\">failed: " + escaped(t.error) + "</p>\n";
    }
    if (!t.result.reading.empty()) {
      s += "<p class=\"reading\">" + escaped(t.result.reading) + "</p>\n";
    }
    for (const Figure& f : t.result.figures) {
      s += figure_html(f, out);
    }
    for (const Table& table : t.result.tables) {
      s += table_html(table);
    }
    s += "</section>\n";
  }
  return s +
         "<section>\n<h2>How times were taken</h2>\n<p>Methods run in turns, in batches long enough for the "
         "clock, each "
         "batch followed by the empty harness, which is subtracted (column overhead_ns). One batch gives its "
         "mean time "
         "per call; median, p99.9 and maximum are over batches, and over single calls where the column batch "
         "is 1. With "
         "fewer than 1000 batches p99.9 is the largest. Caches are warm. A shared or virtual machine ranks "
         "nothing "
         "that lies close together.</p>\n</section>\n</body>\n</html>\n";
}

}  // namespace punctum::report
