#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tools/report/topic.hpp"

namespace punctum::report {
namespace {

bool dominates(const Work& a, const Work& b) {
  return a.error <= b.error && a.time.median_ns <= b.time.median_ns &&
         (a.error < b.error || a.time.median_ns < b.time.median_ns);
}

const Work* shipped_of(std::span<const Work> works) {
  const auto it = std::find_if(works.begin(), works.end(), [](const Work& w) { return w.shipped; });
  return it == works.end() ? nullptr : &*it;
}

std::string duration(double ns) {
  if (ns < 1e3) {
    return fmt::format("{:.3g} ns", ns);
  }
  if (ns < 1e6) {
    return fmt::format("{:.3g} us", ns * 1e-3);
  }
  return ns < 1e9 ? fmt::format("{:.3g} ms", ns * 1e-6) : fmt::format("{:.3g} s", ns * 1e-9);
}

std::string full_name(const Work& w) { return w.knob.empty() ? w.method : w.method + " (" + w.knob + ")"; }

}  // namespace

std::vector<Work> pareto_front(std::span<const Work> works) {
  std::vector<Work> front;
  for (const Work& w : works) {
    if (std::isfinite(w.error) &&
        std::none_of(works.begin(), works.end(), [&w](const Work& other) { return dominates(other, w); })) {
      front.push_back(w);
    }
  }
  std::sort(front.begin(), front.end(),
            [](const Work& a, const Work& b) { return a.time.median_ns < b.time.median_ns; });
  return front;
}

const Work* better_than(const Work& than, std::span<const Work> works, double noise) {
  const Work* best = nullptr;
  for (const Work& w : works) {
    if (w.error <= than.error && w.time.median_ns * (1 + noise) < than.time.median_ns &&
        (best == nullptr || w.time.median_ns < best->time.median_ns)) {
      best = &w;
    }
  }
  return best;
}

bool on_front(std::span<const Work> works, double noise) {
  const Work* shipped = shipped_of(works);
  return shipped != nullptr && better_than(*shipped, works, noise) == nullptr;
}

std::string front_sentence(std::span<const Work> works) {
  const Work* shipped = shipped_of(works);
  if (shipped == nullptr) {
    return "nothing of this is shipped";
  }
  const std::string what = fmt::format("{} errs by {:.2g} in {}", full_name(*shipped), shipped->error,
                                       duration(shipped->time.median_ns));
  const Work* better = better_than(*shipped, works);
  if (better == nullptr) {
    return what + " and is on the front";
  }
  return fmt::format("{} and is not on the front: {} errs by {:.2g} in {}", what, full_name(*better),
                     better->error, duration(better->time.median_ns));
}

Table work_table(const std::string& name, const std::string& error_column, std::span<const Work> works) {
  Table t{.name = name, .columns = {"method", "knob", error_column}};
  for (const auto& c : time_columns()) {
    t.columns.push_back(c);
  }
  t.columns.insert(t.columns.end(), {"on_front", "shipped"});
  t.shown = {"method", "knob", error_column, "median_ns", "p99_9_ns", "on_front", "shipped"};
  for (const Work& w : works) {
    const bool good = better_than(w, works) == nullptr;
    if (good || w.shipped) {
      t.shown_rows.push_back(t.rows.size());
    }
    Row row{w.method, w.knob, w.error};
    for (const auto& c : time_cells(w.time)) {
      row.push_back(c);
    }
    row.emplace_back(good);
    row.emplace_back(w.shipped);
    t.add(std::move(row));
  }
  return t;
}

Panel work_precision(const std::string& title, const std::string& error_label, std::span<const Work> works,
                     std::span<const Limit> limits) {
  Panel p{.title = title,
          .x_label = "median time per call [ns]",
          .y_label = error_label,
          .log_x = true,
          .log_y = true};
  constexpr double none = std::numeric_limits<double>::infinity();
  double smallest = none, fastest = none, slowest = 0;
  for (const Work& w : works) {
    if (w.error > 0) {
      smallest = std::min(smallest, w.error);
    }
    fastest = std::min(fastest, std::max(w.time.median_ns, 0.1));
    slowest = std::max(slowest, w.time.median_ns);
  }
  for (const Limit& l : limits) {
    if (l.error > 0) {
      smallest = std::min(smallest, l.error);
    }
  }
  const double edge = std::isfinite(smallest) ? smallest / 10 : 1e-17;
  if (std::any_of(works.begin(), works.end(), [](const Work& w) { return w.error == 0; })) {
    p.y_label += " (0: at the lower edge)";
  }
  const auto x = [](const Work& w) { return std::max(w.time.median_ns, 0.1); };
  const auto y = [edge](const Work& w) { return w.error > 0 ? w.error : edge; };

  if (const auto front = pareto_front(works); !front.empty()) {
    Series s{.name = "Pareto front", .style = Style::front};
    for (std::size_t i = 0; i < front.size(); ++i) {
      if (i > 0) {
        s.x.push_back(x(front[i]));
        s.y.push_back(y(front[i - 1]));
      }
      s.x.push_back(x(front[i]));
      s.y.push_back(y(front[i]));
    }
    p.series.push_back(std::move(s));
  }
  for (const Work& w : works) {
    auto s = std::find_if(p.series.begin(), p.series.end(),
                          [&w](const Series& other) { return other.name == w.method; });
    if (s == p.series.end()) {
      s = p.series.insert(p.series.end(), Series{.name = w.method, .style = Style::line_points});
    }
    if (!std::isfinite(w.error)) {
      continue;
    }
    s->x.push_back(x(w));
    s->y.push_back(y(w));
    if (w.shipped) {
      p.marks.push_back({x(w), y(w), "shipped"});
    }
  }
  for (const Limit& l : limits) {
    p.series.push_back(
        {.name = l.name, .x = {fastest, slowest}, .y = {l.error, l.error}, .style = Style::limit});
  }
  return p;
}

}  // namespace punctum::report
