#include "tools/punctum/time_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tools/shared/html.hpp"

namespace punctum::tools {
namespace {

constexpr double kWidth = 1240, kLeft = 78, kRight = 16, kTop = 30, kPanel = 190, kGap = 34, kLane = 17;
constexpr double kPlot = kWidth - kLeft - kRight;
constexpr std::size_t kMostBands = 400, kMostLabels = 40, kMostInstants = 60;

// Told apart by people of all colour visions.
constexpr std::array<const char*, 9> kLines = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00",
                                               "#56b4e9", "#7a4a1e", "#222222", "#8c8c00"};
constexpr std::array<const char*, 7> kBands = {"#f8f8f8", "#fff8e0", "#ffeed6", "#ffe1dc",
                                               "#e2f2e2", "#e7f0fb", "#f2f2f2"};

struct Range {
  double low = 0, high = 1;
};

// 1, 2 or 5 times a power of ten, so that there are about `wanted` steps.
double step_of(double length, double wanted) {
  const double raw = length / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double part = raw / power;
  return power * (part <= 1 ? 1 : part <= 2 ? 2 : part <= 5 ? 5 : 10);
}

std::vector<double> ticks_of(const Range& r, double wanted) {
  const double step = step_of(r.high - r.low, wanted);
  std::vector<double> ticks;
  for (double k = std::ceil(r.low / step - 1e-9); k * step <= r.high + 1e-9 * step; ++k) {
    ticks.push_back(k * step);
  }
  return ticks;
}

std::string number_text(double v, double step) {
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  const std::string s = fmt::format("{:.{}f}", v, digits);
  return std::abs(v) < step * 1e-6 ? fmt::format("{:.{}f}", 0.0, digits) : s;
}

std::string text(double x, double y, const char* anchor, std::string_view words, const char* more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     escaped(words));
}

std::string line(double x1, double y1, double x2, double y2, const char* colour, const char* more = "") {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"{}/>\n", x1,
                     y1, x2, y2, colour, more);
}

std::string box(double x, double y, double width, double height, const char* fill,
                std::string_view title = {}) {
  const std::string head =
      fmt::format("<rect x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.1f}\" fill=\"{}\"", x, y,
                  width, height, fill);
  return title.empty() ? head + "/>\n" : head + "><title>" + escaped(title) + "</title></rect>\n";
}

std::string open_svg(double height, std::string_view title) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" width=\"{:.0f}\" "
      "height=\"{:.0f}\" "
      "role=\"img\" font-family=\"system-ui, sans-serif\" font-size=\"12\" "
      "fill=\"#222\">\n<title>{}</title>\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      kWidth, height, kWidth, height, escaped(title));
}

class Drawing {
 public:
  explicit Drawing(const TimeChart& c) : c_(c) { length_s_ = c.end_s > c.begin_s ? c.end_s - c.begin_s : 1; }

  std::string text_of() {
    double y = kTop + (c_.instants.empty() ? 0 : 24);
    const double first = y;
    std::string body;
    for (const ChartPanel& panel : c_.panels) {
      body += panel_at(panel, y);
      y += kPanel + kGap;
    }
    double bottom = y - 8;  // below the key of the last panel
    if (!c_.lanes.empty()) {
      body += lanes_at(y - 6);
      bottom = y - 6 + kLane * static_cast<double>(c_.lanes.size());
    }
    body += time_axis(bottom) + instants(first, bottom);
    return open_svg(bottom + 42, c_.title) + body + "</svg>\n";
  }

 private:
  [[nodiscard]] double x(double t_s) const {
    return kLeft + kPlot * std::clamp((t_s - c_.begin_s) / length_s_, 0.0, 1.0);
  }

  // The phases; their names in the first panel, a row lower where they would cover each other.
  [[nodiscard]] std::string bands(double y, double height, bool named) const {
    std::string s;
    double free_from = 0;
    int row = 0;
    for (std::size_t i = 0; i < std::min(c_.bands.size(), kMostBands); ++i) {
      const PhaseBand& b = c_.bands[i];
      s += box(x(b.from_s), y, std::max(0.4, x(b.to_s) - x(b.from_s)), height,
               kBands[static_cast<std::size_t>(b.colour) % kBands.size()], b.label);
      if (!named || b.label.empty() || i >= kMostLabels) {
        continue;
      }
      row = x(b.from_s) < free_from ? (row + 1) % 3 : 0;
      const double width = 6.6 * static_cast<double>(b.label.size()) + 6;
      const double at = std::min(x(b.from_s) + 3, kWidth - kRight - width);
      labels_ += text(at, y + 14 + 14 * row, "start", b.label, " fill=\"#555\" font-size=\"11\"");
      free_from = at + width;
    }
    return s;
  }

  std::string panel_at(const ChartPanel& p, double y) {
    labels_.clear();
    std::string s = bands(y, kPanel, y < kTop + 30);
    Range r{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (const Curve& curve : p.curves) {
      for (const auto& stroke : curve.strokes()) {
        for (const Curve::Point& point : stroke) {
          r.low = std::min(r.low, point.value);
          r.high = std::max(r.high, point.value);
        }
      }
    }
    const bool any = r.low <= r.high;
    if (!any) {
      r = {0, 1};
    }
    r.low = std::min(r.low, 0.0), r.high = std::max(r.high, 0.0);
    const double length = r.high > r.low ? r.high - r.low : 1;
    r.high += (labels_.empty() ? 0.06 : 0.2) * length;
    r.low -= r.low < 0 ? 0.06 * length : 0;
    const auto at = [&](double v) { return y + kPanel * (r.high - v) / (r.high - r.low); };
    const double step = step_of(r.high - r.low, 5);
    for (const double v : ticks_of(r, 5)) {
      s += line(kLeft, at(v), kLeft + kPlot, at(v), v == 0 ? "#999" : "#ddd") +
           text(kLeft - 6, at(v) + 4, "end", number_text(v, step));
    }
    s +=
        fmt::format("<text transform=\"translate(16 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                    y + kPanel / 2, escaped(p.y_label));
    std::size_t n = 0;
    double key = kLeft + 4;
    for (const Curve& curve : p.curves) {
      if (curve.empty()) {
        continue;
      }
      const char* const colour = kLines[n++ % kLines.size()];
      for (const auto& stroke : curve.strokes()) {
        s += fmt::format(
            "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\" stroke-linejoin=\"round\" points=\"",
            colour);
        for (const Curve::Point& point : stroke) {
          s += fmt::format("{:.1f},{:.1f} ", x(point.t_s), at(point.value));
        }
        s += "\"/>\n";
      }
      if (!curve.name.empty()) {
        s += line(key, y + kPanel + 12, key + 18, y + kPanel + 12, colour, " stroke-width=\"2.5\"") +
             text(key + 23, y + kPanel + 16, "start", curve.name);
        key += 42 + 6.9 * static_cast<double>(curve.name.size());
      }
    }
    if (!any) {
      s += text(kLeft + kPlot / 2, y + kPanel / 2, "middle", "nothing was recorded", " fill=\"#777\"");
    }
    return s + labels_ +
           fmt::format(
               "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
               "stroke=\"#888\"/>\n",
               kLeft, y, kPlot, kPanel);
  }

  [[nodiscard]] std::string lanes_at(double y) const {
    std::string s;
    for (const Lane& lane : c_.lanes) {
      s += line(kLeft, y + kLane, kLeft + kPlot, y + kLane, "#e4e4e4");
      for (const Lane::Span& span : lane.spans) {
        s += box(x(span.from_s), y + 3, std::max(1.5, x(span.to_s) - x(span.from_s)), kLane - 6, "#e69f00",
                 fmt::format("{}, {:.3f} s to {:.3f} s", lane.name, span.from_s, span.to_s));
      }
      s += text(kLeft + 4, y + kLane - 4, "start", lane.name,
                " font-size=\"11\" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\"");
      y += kLane;
    }
    return s;
  }

  [[nodiscard]] std::string time_axis(double bottom) const {
    const Range r{c_.begin_s, c_.begin_s + length_s_};
    const double step = step_of(length_s_, 12);
    std::string s = line(kLeft, bottom, kLeft + kPlot, bottom, "#888");
    for (const double t : ticks_of(r, 12)) {
      s += line(x(t), bottom, x(t), bottom + 5, "#888") +
           text(x(t), bottom + 18, "middle", number_text(t, step));
    }
    return s + text(kLeft + kPlot / 2, bottom + 35, "middle", c_.time_label);
  }

  // Marks through all panels; those that would cover the one before stay without a label (hovering tells).
  [[nodiscard]] std::string instants(double first, double bottom) const {
    std::string s;
    double free_from = 0;
    for (std::size_t i = 0; i < std::min(c_.instants.size(), kMostInstants); ++i) {
      const Instant& e = c_.instants[i];
      const char* const colour = e.bad ? "#c0392b" : "#5b3f9e";
      s += fmt::format(
          "<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{0:.1f}\" y2=\"{2:.1f}\" stroke=\"{3}\" "
          "stroke-dasharray=\"4 "
          "3\"><title>{4:.3f} s: {5}</title></line>\n",
          x(e.t_s), first - 6, bottom, colour, e.t_s, escaped(e.label));
      const double width = 6.6 * static_cast<double>(e.label.size()) + 8;
      const bool room = x(e.t_s) + width < kWidth;
      const double from = room ? x(e.t_s) : x(e.t_s) - width;
      if (from >= free_from) {
        s += text(x(e.t_s), first - 11, room ? "start" : "end", e.label,
                  e.bad ? " fill=\"#c0392b\" font-weight=\"600\"" : " fill=\"#5b3f9e\"");
        free_from = from + width;
      }
    }
    return s;
  }

  const TimeChart& c_;
  double length_s_ = 1;
  mutable std::string labels_;
};

}  // namespace

Curve::Curve(std::string name_, double begin_s, double end_s)
    : name(std::move(name_)),
      begin_s_(begin_s),
      per_s_(end_s > begin_s ? static_cast<double>(kColumns) / (end_s - begin_s) : 0) {}

void Curve::add(double t_s, double value) {
  if (!std::isfinite(value) || !std::isfinite(t_s)) {
    gap_ = true;
    return;
  }
  const double at = std::clamp((t_s - begin_s_) * per_s_, 0.0, static_cast<double>(kColumns));
  const auto index = static_cast<std::size_t>(at);
  if (columns_.empty() || columns_.back().index != index || gap_) {
    columns_.push_back({index, {t_s, value}, {t_s, value}, gap_ && !columns_.empty()});
    gap_ = false;
    return;
  }
  Column& c = columns_.back();
  c.low = value < c.low.value ? Point{t_s, value} : c.low;
  c.high = value > c.high.value ? Point{t_s, value} : c.high;
}

std::vector<std::vector<Curve::Point>> Curve::strokes() const {
  std::vector<std::vector<Point>> all;
  for (const Column& c : columns_) {
    if (all.empty() || c.gap_before) {
      all.emplace_back();
    }
    const bool low_first = c.low.t_s <= c.high.t_s;
    all.back().push_back(low_first ? c.low : c.high);
    if (c.low.t_s != c.high.t_s) {
      all.back().push_back(low_first ? c.high : c.low);
    }
  }
  return all;
}

std::string svg(const TimeChart& chart) { return Drawing(chart).text_of(); }

// Bars over a linear axis of time, with a logarithmic axis of how often: the rare late ones are the point.
std::string svg(const TimesHistogram& h) {
  constexpr double kHeight = 210, kHigh = 130, kBars = 80;
  double all = h.over, most = 1, last_us = 0;
  for (std::size_t i = 0; i < std::min(h.from_us.size(), h.count.size()); ++i) {
    all += h.count[i];
    last_us = std::max(last_us, h.from_us[i] + 1);
  }
  const double width_us = std::max(1.0, std::ceil(last_us / kBars));
  const auto bars = static_cast<std::size_t>(std::ceil(std::max(1.0, last_us) / width_us));
  std::vector<double> bar(bars, 0.0);
  for (std::size_t i = 0; i < std::min(h.from_us.size(), h.count.size()); ++i) {
    bar[std::min(bars - 1, static_cast<std::size_t>(h.from_us[i] / width_us))] += h.count[i];
  }
  for (const double n : bar) {
    most = std::max(most, n);
  }
  const double top = std::ceil(std::log10(most) + 1e-9) + 0.15;
  const double base = kTop + kHigh;
  const Range r{0, width_us * static_cast<double>(bars)};
  const auto x = [&r](double us) { return kLeft + kPlot * std::min(1.0, us / r.high); };
  // A count of one has a height, too.
  const auto y = [&](double n) {
    return n > 0 ? base - kHigh * (std::log10(n) + 0.15) / (top + 0.15) : base;
  };
  std::string s = open_svg(kHeight, h.title) + text(kLeft, 18, "start", h.title, " font-weight=\"600\"");
  for (double decade = 0; decade <= top; ++decade) {
    const double n = std::pow(10.0, decade);
    s += line(kLeft, y(n), kLeft + kPlot, y(n), "#ddd") +
         text(kLeft - 6, y(n) + 4, "end", fmt::format("{:.0f}", n));
  }
  for (std::size_t i = 0; i < bars; ++i) {
    if (bar[i] > 0) {
      const double from = width_us * static_cast<double>(i);
      s += box(x(from), y(bar[i]), std::max(0.5, kPlot / static_cast<double>(bars) - 0.6), base - y(bar[i]),
               "#5b8db8", fmt::format("{:g} to {:g} us: {:.0f}", from, from + width_us, bar[i]));
    }
  }
  const double step = step_of(r.high, 12);
  for (const double us : ticks_of(r, 12)) {
    s += line(x(us), base, x(us), base + 5, "#888") + text(x(us), base + 18, "middle", number_text(us, step));
  }
  s += line(kLeft, base, kLeft + kPlot, base, "#888");
  s += text(kLeft + kPlot / 2, base + 35, "middle",
            h.over > 0 ? fmt::format("time [us]; {:.0f} longer ones beyond this axis", h.over) : "time [us]");
  for (const auto& [us, label] : {std::pair{h.p50_us, "p50"}, {h.p99_9_us, "p99.9"}}) {
    if (us > 0 && us <= r.high) {
      s += line(x(us), kTop - 4, x(us), base, "#c0392b", " stroke-dasharray=\"4 3\"") +
           text(x(us) + (x(us) > kWidth - 140 ? -4 : 4), label[1] == '5' ? kTop + 8 : kTop + 22,
                x(us) > kWidth - 140 ? "end" : "start", fmt::format("{} {:.0f} us", label, us),
                " fill=\"#c0392b\"");
    }
  }
  return s + text(kWidth - kRight, 18, "end", fmt::format("{:.0f} ticks, longest {:.0f} us", all, h.max_us)) +
         "</svg>\n";
}

}  // namespace punctum::tools
