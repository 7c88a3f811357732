#include "tools/shared/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <thread>
#include <utility>

#include "tools/shared/child.hpp"
#include "tools/shared/whole_file.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kKeyLine = 18;
constexpr double kLongestDrawing_s = 120;

// Told apart by people of all colour visions, and by their points.
constexpr std::array<const char*, 9> kLines = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00",
                                               "#56b4e9", "#7a4a1e", "#222222", "#8c8c00"};
constexpr std::array<int, 9> kPoints = {7, 5, 9, 11, 13, 6, 4, 8, 10};
constexpr std::array<const char*, 5> kCategories = {"#a8dba8", "#fbd178", "#c0392b", "#5b8db8", "#c8c8c8"};
constexpr std::array<const char*, 7> kBands = {"#f4f4f4", "#fff3cc", "#ffe0b3", "#ffb3a7",
                                               "#cfe8cf", "#cfe0f5", "#ececec"};
constexpr std::size_t kMostBands = 200, kMostBandLabels = 40;
constexpr std::array<const char*, 4> kDashes = {"2", "4", "5", "3"};

// gnuplot's own quoting: a quote is doubled.
std::string quoted(const std::string& s) {
  std::string out = "'";
  for (const char c : s) {
    if (c == '\'') {
      out += c;
    }
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "'";
}

bool drawable(double v, bool log) { return std::isfinite(v) && (!log || v > 0); }

// A data block; a gap where a point cannot be drawn.
std::string block(const std::string& name, const Series& s, const Panel& p) {
  std::string data = name + " << EOD\n";
  for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i) {
    data += drawable(s.x[i], p.log_x) && drawable(s.y[i], p.log_y)
                ? fmt::format("{:.9g} {:.9g}\n", s.x[i], s.y[i])
                : "\n";
  }
  return data + "EOD\n";
}

bool has_points(const Series& s, const Panel& p) {
  for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i) {
    if (drawable(s.x[i], p.log_x) && drawable(s.y[i], p.log_y)) {
      return true;
    }
  }
  return false;
}

struct Edges {
  double low = 0, high = 0;
};

// Each value's cell ends half-way to its neighbours.
std::map<double, Edges> cells_of(std::vector<double> values, bool log) {
  std::erase_if(values, [log](double v) { return !drawable(v, log); });
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  const auto to = [log](double v) { return log ? std::log(v) : v; };
  const auto from = [log](double v) { return log ? std::exp(v) : v; };
  std::map<double, Edges> cells;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool alone = values.size() == 1;
    const double here = to(values[i]);
    const double below = i > 0 ? to(values[i - 1]) : alone ? here - 1 : 2 * here - to(values[i + 1]);
    const double above = i + 1 < values.size() ? to(values[i + 1]) : 2 * here - below;
    cells[values[i]] = {from((here + below) / 2), from((here + above) / 2)};
  }
  return cells;
}

struct Box {
  Edges x, y;
  double value = 0;
};

// Boxes end to end, one row per name. `reach`: how far to the right the series over them go.
std::string bars_script(const Bars& bars, double reach, int index, std::string& blocks, std::string& set) {
  constexpr std::array<const char*, 14> kParts = {"#b8b8b8", "#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                  "#e69f00", "#56b4e9", "#7a4a1e", "#222222", "#8c8c00",
                                                  "#5b3f9e", "#9fd7a8", "#f2b8a0", "#4d7c8a"};
  std::string plots;
  std::vector<double> ends(bars.names.size(), 0.0);
  const auto row = [&bars](std::size_t i) { return static_cast<double>(bars.names.size() - i); };
  for (std::size_t k = 0; k < bars.parts.size(); ++k) {
    const Series& part = bars.parts[k];
    const std::string name = fmt::format("$b{}_{}", index, k);
    blocks += name + " << EOD\n";
    for (std::size_t i = 0; i < std::min(ends.size(), part.y.size()); ++i) {
      if (!std::isfinite(part.y[i])) {
        continue;
      }
      blocks += fmt::format("{:.9g} {} {:.9g} {:.9g} {} {}\n", ends[i], row(i), ends[i], ends[i] + part.y[i],
                            row(i) - 0.36, row(i) + 0.36);
      ends[i] += part.y[i];
    }
    blocks += "EOD\n";
    plots += fmt::format(
        "{}{} using 1:2:3:4:5:6 with boxxyerror fillcolor rgb '{}' fillstyle solid noborder title {}",
        plots.empty() ? "" : ", \\\n  ", name, kParts[k % kParts.size()], quoted(part.name));
  }
  std::string tics;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", quoted(bars.names[i]), row(i));
  }
  const double longest = ends.empty() ? 0 : std::max(reach, *std::max_element(ends.begin(), ends.end()));
  set += fmt::format(
      "set ytics ({}) noenhanced scale 0\nset grid noytics\nset yrange [0.4:{}]\nset xrange [0:{:.9g}]\n",
      tics, static_cast<double>(ends.size()) + 0.6, longest > 0 ? 1.05 * longest : 1.0);
  return plots;
}

// One box per cell; neighbours of one category in a row become one.
std::vector<Box> boxes_of(const Map& map, const std::map<double, Edges>& x,
                          const std::map<double, Edges>& y) {
  std::map<std::pair<double, double>, double> grid;  // by row, then column
  for (std::size_t i = 0; i < map.value.size(); ++i) {
    if (x.contains(map.x[i]) && y.contains(map.y[i]) && std::isfinite(map.value[i])) {
      grid[{map.y[i], map.x[i]}] = map.value[i];
    }
  }
  std::vector<Box> boxes;
  double row = 0;
  for (const auto& [at, value] : grid) {
    const Edges column = x.at(at.second), line = y.at(at.first);
    const bool joins = !boxes.empty() && !map.categories.empty() && at.first == row &&
                       boxes.back().value == value && boxes.back().x.high == column.low;
    if (joins) {
      boxes.back().x.high = column.high;
    } else {
      boxes.push_back({column, line, value});
    }
    row = at.first;
  }
  return boxes;
}

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  [[nodiscard]] bool empty() const { return !(low <= high); }
  // Where v lies in it, 0 .. 1.
  [[nodiscard]] double part(double v, bool log) const {
    if (!(low < high)) {
      return 0;
    }
    return log ? std::log(v / low) / std::log(high / low) : (v - low) / (high - low);
  }
  void take(double v, bool log) {
    if (!drawable(v, log)) {
      return;
    }
    low = std::min(low, v);
    high = std::max(high, v);
  }
};

// A logarithmic axis ends a little beyond its data, not at the next power of ten; where powers of ten alone
// would say too little, 2 and 5 times them are there too.
std::string axis(const char* which, const std::string& label, bool log, const Range& data, bool ranged) {
  std::string s = fmt::format("set {0}label {1} noenhanced{2}\nset format {0} '%g'\n", which, quoted(label),
                              which[0] == 'x' ? " offset 0,0.4" : "");
  if (!log || data.empty()) {
    return s;
  }
  const double beyond = std::max(1.25, std::pow(data.high / data.low, 0.06));
  const double low = data.low / beyond, high = data.high * beyond;
  s += fmt::format("set logscale {}\n", which);
  if (!ranged) {
    s += fmt::format("set {}range [{:.9g}:{:.9g}]\n", which, low, high);
  }
  if (high / low > 200) {
    return s + fmt::format("set format {} '10^{{%T}}'\n", which);
  }
  std::string tics;
  for (double decade = std::pow(10, std::floor(std::log10(low))); decade <= high; decade *= 10) {
    for (const double step : {1.0, 2.0, 5.0}) {
      if (step * decade >= low && step * decade <= high) {
        tics += fmt::format("{}{:.9g}", tics.empty() ? "" : ", ", step * decade);
      }
    }
  }
  return s + fmt::format("set {}tics ({})\n", which, tics);
}

// Rectangles behind the lines. A label that would cover the one before it stands a row lower.
std::string bands_script(const std::vector<Band>& bands) {
  const double from = bands.front().from, length = bands.back().to - bands.front().from;
  std::string s = fmt::format("set lmargin 10\nset xrange [{:.9g}:{:.9g}]\n", from, bands.back().to);
  double free_from = from;
  int row = 0;
  for (std::size_t i = 0; i < std::min(bands.size(), kMostBands); ++i) {
    const Band& b = bands[i];
    s += fmt::format(
        "set object {} rectangle from first {:.9g}, graph 0 to first {:.9g}, graph 1 behind fillcolor rgb "
        "'{}' fillstyle solid noborder\n",
        i + 1, b.from, b.to, kBands[static_cast<std::size_t>(b.colour) % kBands.size()]);
    if (b.label.empty() || i >= kMostBandLabels) {
      continue;
    }
    row = b.from < free_from ? (row + 1) % 3 : 0;
    const bool room = b.from < from + 0.94 * length;
    s += fmt::format("set label {} {} at first {:.9g}, graph {:.3f} {} noenhanced font ',9' front\n", i + 1,
                     quoted(b.label), b.from + (room ? 0.003 : -0.003) * length, 0.94 - 0.07 * row,
                     room ? "left" : "right");
    free_from = b.from + 0.085 * length;
  }
  return s;
}

// key_width: what gnuplot is to add to its own idea of a letter's width.
// The gnuplot script of one panel, in three parts: blocks of data, settings, and what is plotted.
class PanelScript {
 public:
  PanelScript(const Panel& panel, int index) : p_(panel), index_(index) {}

  std::string text(double key_width) {
    set_key_and_title(key_width);
    if (!p_.bands.empty()) {
      set_ += bands_script(p_.bands);
    }
    if (p_.map) {
      draw_map(*p_.map);
    }
    if (p_.bars && !p_.bars->parts.empty()) {
      draw_bars(*p_.bars);
    }
    draw_series();
    draw_marks();
    const bool ranged = p_.map || p_.bars;
    set_ += axis("x", p_.x_label, p_.log_x, x_, ranged) + axis("y", p_.y_label, p_.log_y, y_, ranged);
    if (plots_.empty()) {  // the panel says so itself
      set_ +=
          "set label 'nothing could be drawn' at graph 0.5,0.5 center\nset xrange [0:1]\nset yrange "
          "[0:1]\nunset logscale\n";
      plots_ = "plot NaN notitle";
    }
    return blocks_ + set_ + plots_ + "\n";
  }

 private:
  void plot(const std::string& what) { plots_ += (plots_.empty() ? "plot " : ", \\\n  ") + what; }
  // Over a scale of colours, which is dark in places.
  [[nodiscard]] bool on_scale() const { return p_.map && p_.map->categories.empty(); }

  void set_key_and_title(double key_width) {
    std::size_t longest = 0;
    for (const Series& s : p_.series) {
      longest = std::max(longest, s.name.size());
    }
    set_ =
        "reset\nset encoding utf8\nset grid lc rgb '#e4e4e4'\nset border lc rgb '#777777'\n"
        "set tics textcolor rgb '#222222'\n" +
        fmt::format(
            "set key outside below center horizontal Left reverse samplen 2 width {:.1f} noenhanced font "
            "',11' title ' '\n",
            key_width * static_cast<double>(longest));
    set_ += fmt::format("set title {} noenhanced font ',13'\n", quoted(p_.title));
  }

  void draw_map(const Map& map) {
    const auto columns = cells_of(map.x, p_.log_x), lines = cells_of(map.y, p_.log_y);
    for (const auto& [at, e] : columns) {
      x_.take(e.low, false), x_.take(e.high, false);
    }
    for (const auto& [at, e] : lines) {
      y_.take(e.low, false), y_.take(e.high, false);
    }
    const auto boxes = boxes_of(map, columns, lines);
    for (std::size_t c = 0; c < std::max<std::size_t>(1, map.categories.size()); ++c) {
      draw_boxes(map, boxes, c);
    }
    if (map.categories.empty()) {
      set_ += fmt::format(
          "set palette defined (0 '#30224d', 1 '#31688e', 2 '#35b779', 3 '#fde725')\nset cblabel {} "
          "noenhanced\n",
          quoted(map.value_label));
      if (map.log_value) {
        set_ += "set logscale cb\nset format cb '10^{%T}'\n";
      }
    }
    set_ += fmt::format("set xrange [{:.9g}:{:.9g}]\nset yrange [{:.9g}:{:.9g}]\nset grid front\n", x_.low,
                        x_.high, y_.low, y_.high);
  }

  // Of one category, or all where there are none.
  void draw_boxes(const Map& map, const std::vector<Box>& boxes, std::size_t category) {
    const std::string name = fmt::format("$m{}_{}", index_, category);
    std::string data;
    for (const Box& b : boxes) {
      if (map.categories.empty() || b.value == static_cast<double>(category)) {
        data += fmt::format("{:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g}\n", b.x.low, b.y.low, b.x.low,
                            b.x.high, b.y.low, b.y.high, b.value);
      }
    }
    if (data.empty()) {
      return;
    }
    blocks_ += name + " << EOD\n" + data + "EOD\n";
    if (map.categories.empty()) {
      plot(fmt::format(
          "{} using 1:2:3:4:5:6:7 with boxxyerror fillcolor palette fillstyle solid noborder notitle", name));
    } else {
      plot(fmt::format(
          "{} using 1:2:3:4:5:6 with boxxyerror fillcolor rgb '{}' fillstyle solid noborder title {}", name,
          kCategories[category % kCategories.size()], quoted(map.categories[category])));
    }
  }

  void draw_bars(const Bars& bars) {
    double reach = 0;
    for (const Series& s : p_.series) {
      for (const double v : s.x) {
        reach = std::max(reach, v);
      }
    }
    plot(bars_script(bars, reach, index_, blocks_, set_));
  }

  void draw_series() {
    for (const Series& s : p_.series) {
      for (const double v : s.x) {
        x_.take(v, p_.log_x);
      }
      for (const double v : s.y) {
        y_.take(v, p_.log_y);
      }
      if (!has_points(s, p_)) {
        continue;
      }
      const std::string name = fmt::format("$s{}_{}", index_, id_++);
      blocks_ += block(name, s, p_);
      const std::string title = s.name.empty() ? "notitle" : "title " + quoted(s.name);
      plot(fmt::format("{} with {} {}", name, look_of(s.style), title));
    }
  }

  // The next colour or dash.
  std::string look_of(Style style) {
    const std::size_t c = colour_ % kLines.size();
    switch (style) {
      case Style::limit:
        return fmt::format("lines dashtype {} lw 1.6 lc rgb '{}'", kDashes[dash_++ % kDashes.size()],
                           on_scale() ? "#b8b8b8" : "#444444");
      case Style::front:
        return "lines lw 8 lc rgb '#dcdcdc'";
      case Style::points:
        ++colour_;
        return fmt::format("points pt {} ps 0.7 lc rgb '{}'", kPoints[c], kLines[c]);
      case Style::line_points:
        ++colour_;
        return fmt::format("linespoints pt {} ps 0.8 lw 1.6 lc rgb '{}'", kPoints[c], kLines[c]);
      case Style::line:
        ++colour_;
        return fmt::format("lines lw 1.8 lc rgb '{}'", kLines[c]);
    }
    return {};
  }

  void draw_marks() {
    const char* const ink = on_scale() ? "#ffffff" : "#000000";
    const auto can_be_drawn = [this](const Mark& m) {
      return drawable(m.x, p_.log_x) && drawable(m.y, p_.log_y);
    };
    for (const Mark& m : p_.marks) {
      if (!can_be_drawn(m)) {
        continue;
      }
      x_.take(m.x, p_.log_x);
      y_.take(m.y, p_.log_y);
      const std::string name = fmt::format("$k{}_{}", index_, id_++);
      blocks_ += fmt::format("{} << EOD\n{:.9g} {:.9g}\nEOD\n", name, m.x, m.y);
      plot(fmt::format("{} with points pt 6 ps 2.2 lw 2.2 lc rgb '{}' notitle", name, ink));
    }
    for (const Mark& m : p_.marks) {
      if (m.label.empty() || !can_be_drawn(m)) {
        continue;
      }
      const bool room = x_.part(m.x, p_.log_x) < 0.8;
      set_ += fmt::format(
          "set label {} at {:.9g},{:.9g} {} offset char {},0.9 front noenhanced font ',11' textcolor rgb "
          "'{}'\n",
          quoted(m.label), m.x, m.y, room ? "left" : "right", room ? 1.2 : -1.2, ink);
    }
  }

  const Panel& p_;
  int index_;
  std::string blocks_, set_, plots_;
  Range x_, y_;
  std::size_t colour_ = 0, dash_ = 0, id_ = 0;  // the next one
};

}  // namespace

namespace {

// By its last bytes.
bool is_whole_picture(const fs::path& picture) {
  std::ifstream in(picture, std::ios::binary);
  constexpr std::streamoff kTail = 12;
  in.seekg(-kTail, std::ios::end);
  const std::string tail{std::istreambuf_iterator<char>(in), {}};
  return tail.find(picture.extension() == ".png" ? "IEND" : "</svg>") != std::string::npos;
}

}  // namespace

std::string gnuplot_script(const Figure& figure, const fs::path& picture) {
  const int panels = static_cast<int>(figure.panels.size());
  const int columns = std::clamp(figure.columns, 1, std::max(panels, 1));
  const int rows = (panels + columns - 1) / columns;
  std::size_t most = 0;
  for (const Panel& p : figure.panels) {
    most = std::max(
        most, p.series.size() + (p.map ? p.map->categories.size() : 0) + (p.bars ? p.bars->parts.size() : 0));
  }
  const int height = rows * (figure.panel_height + kKeyLine * static_cast<int>(most / 2));
  const bool png = picture.extension() == ".png";
  const std::string kind =
      png ? "pngcairo enhanced font 'sans,10'"
          : fmt::format("svg enhanced font 'sans-serif,12' name {}", quoted(figure.name));
  std::string s = fmt::format(
      "set terminal {} size {},{} background rgb 'white'\nset output {}\nset multiplot layout {},{}\n", kind,
      columns * figure.panel_width, height, quoted(picture.string()), rows, columns);
  for (int i = 0; i < panels; ++i) {
    s += PanelScript(figure.panels[static_cast<std::size_t>(i)], i).text(png ? 0.15 : -0.15);
  }
  return s + "unset multiplot\nset output\n";
}

tl::expected<void, std::string> draw(const Figure& figure, const fs::path& picture) {
  fs::path script = picture, log = picture;
  script.replace_extension(".gp");
  log.replace_extension(".log");
  std::error_code ec;
  fs::remove(picture, ec);
  fs::remove(log, ec);
  if (figure.panels.empty()) {
    return tl::unexpected(figure.name + ": a figure without panels");
  }
  if (find_program("gnuplot").empty()) {
    return tl::unexpected(std::string("gnuplot is not installed (package gnuplot-nox)"));
  }
  const auto made = begin_unfinished(picture);
  if (!made) {
    return tl::unexpected(made.error());
  }
  const fs::path& part = *made;
  const auto fail = [&part](const std::string& why) {
    std::error_code ignored;
    fs::remove(part, ignored);
    return tl::unexpected(why);
  };
  if (auto written = write_whole(script, gnuplot_script(figure, part), Sync::later); !written) {
    return fail(written.error());
  }
  auto gnuplot = Child::start("gnuplot", {script.string()}, log.string());
  if (!gnuplot) {
    return fail(gnuplot.error());
  }
  Ended how;
  const auto limit = std::chrono::steady_clock::now() + std::chrono::duration<double>(kLongestDrawing_s);
  while (!gnuplot->ended(how)) {
    if (std::chrono::steady_clock::now() > limit) {
      return fail(fmt::format("gnuplot: not ready with {} after {} s", script.string(), kLongestDrawing_s));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (!how.exited || how.code != 0) {
    return fail(fmt::format("gnuplot {}: {}, {}", script.string(), how.text(), last_line(log.string())));
  }
  if (!is_whole_picture(part)) {  // gnuplot does not notice a full disk
    return fail(picture.string() + ": cannot be written: it is not complete");
  }
  fs::remove(script, ec);
  fs::remove(log, ec);
  return put_in_place(part, picture);
}

}  // namespace punctum::tools
