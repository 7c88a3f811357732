#include "tools/jitter/picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

namespace punctum::jitter {
namespace {

constexpr double kNone = 0.5;      // on the logarithmic axis, below a single one
constexpr double kFirst_us = 0.5;  // where the bin from 0 begins on it

// The outline of the bins from the first to the last that holds something.
tools::Series outline(std::string name, const Distribution& d) {
  tools::Series s{.name = std::move(name), .x = {}, .y = {}, .style = tools::Style::line};
  const auto filled = [](std::uint64_t n) { return n > 0; };
  const auto first = std::find_if(d.count.begin(), d.count.end(), filled);
  const auto last = std::find_if(d.count.rbegin(), d.count.rend(), filled).base();
  const auto add = [&s](double x_us, double y) {
    s.x.push_back(std::max(x_us, kFirst_us));
    s.y.push_back(y);
  };
  for (auto bin = first; bin < last; ++bin) {
    const auto from = static_cast<double>(bin - d.count.begin());
    const double count = std::max(static_cast<double>(*bin), kNone);
    if (bin == first) {
      add(from, kNone);
    }
    add(from, count);
    add(from + 1, count);
  }
  if (!s.x.empty()) {
    add(s.x.back(), kNone);
  }
  if (d.longer > 0) {  // of these only their number and the longest are known
    add(d.max_us, kNone);
    add(d.max_us, static_cast<double>(d.longer));
  }
  return s;
}

tools::Panel histogram(std::string title, std::vector<tools::Series> series) {
  return {.title = std::move(title),
          .x_label = "time, us",
          .y_label = "how often, in bins of 1 us",
          .log_x = true,
          .log_y = true,
          .series = std::move(series)};
}

}  // namespace

tools::Figure picture_of(const Result& r) {
  tools::Figure figure{.name = "jitter", .columns = 2};
  figure.panels.push_back(
      histogram(fmt::format("{:.0f} Hz, {} ticks, {} releases missed", r.rate_Hz, r.ticks, r.missed),
                {outline("wake-up", r.wake), outline("tick", r.tick)}));
  if (r.slots.size() > 1) {
    std::vector<tools::Series> slots;
    for (const auto& [name, times] : r.slots) {
      slots.push_back(outline("slot " + name, times));
    }
    figure.panels.push_back(histogram("what each tick does", std::move(slots)));
  }
  if (!r.answered.empty()) {
    figure.panels.push_back(histogram(r.answered, {outline("answer", r.answer)}));
  }
  if (r.parts.size() > 1) {
    std::vector<tools::Series> over_time;
    for (const auto& [name, part] :
         {std::pair("p50", 0.5), std::pair("p99", 0.99), std::pair("latest", 1.0)}) {
      tools::Series s{.name = name, .x = {}, .y = {}, .style = tools::Style::line_points};
      for (std::size_t i = 0; i < r.parts.size(); ++i) {
        if (r.parts[i].entries() > 0) {
          s.x.push_back((static_cast<double>(i) + 0.5) * r.seconds / static_cast<double>(r.parts.size()));
          s.y.push_back(std::max(r.parts[i].quantile_us(part), kFirst_us));
        }
      }
      over_time.push_back(std::move(s));
    }
    figure.panels.push_back({.title = "over the measurement",
                             .x_label = "time since the first tick, s",
                             .y_label = "wake-up, us",
                             .log_y = true,
                             .series = std::move(over_time)});
  }
  figure.note = r.machine.substr(0, r.machine.find("; boot line"));
  figure.note += r.work.empty() ? "" : "; each tick: " + r.work;
  figure.note += r.load.empty() ? "" : "; under load";
  figure.note += r.degraded ? "; WITHOUT real-time rights" : "";
  return figure;
}

}  // namespace punctum::jitter
