// Topic elementary: the elementary functions of hal/math beside the C library's, error and time.
#include "hal/math/elementary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tools/report/topic.hpp"

namespace punctum::report {

Result run_elementary(const Job& job);

namespace {

using Call = double (*)(double, double);
using Truth = long double (*)(long double, long double);

// A function of one argument ignores the second. Arguments are uniform between their ends: what the core and
// the simulated plant ask for, or around it.
struct Function {
  const char* name;
  Call ours, c_library;
  Truth truth;
  double low, high;
  double second_low = 0, second_high = 0;
};

template <double ours(double) noexcept, double c_library(double), long double truth(long double)>
Function one(const char* name, double low, double high) {
  return {name,
          [](double x, double) { return ours(x); },
          [](double x, double) { return c_library(x); },
          [](long double x, long double) { return truth(x); },
          low,
          high};
}
template <double ours(double, double) noexcept, double c_library(double, double),
          long double truth(long double, long double)>
Function two(const char* name, double low, double high, double second_low, double second_high) {
  return {name,
          [](double x, double y) { return ours(x, y); },
          [](double x, double y) { return c_library(x, y); },
          [](long double x, long double y) { return truth(x, y); },
          low,
          high,
          second_low,
          second_high};
}

std::vector<Function> functions() {
  return {one<math::sin, ::sin, ::sinl>("sin", -10, 10),
          one<math::cos, ::cos, ::cosl>("cos", -10, 10),
          one<math::tan, ::tan, ::tanl>("tan", -10, 10),
          one<math::asin, ::asin, ::asinl>("asin", -1, 1),
          one<math::acos, ::acos, ::acosl>("acos", -1, 1),
          one<math::atan, ::atan, ::atanl>("atan", -3, 3),
          two<math::atan2, ::atan2, ::atan2l>("atan2", -1, 1, -1, 1),
          one<math::exp, ::exp, ::expl>("exp", -20, 5),
          one<math::expm1, ::expm1, ::expm1l>("expm1", -1, 1),
          one<math::log, ::log, ::logl>("log", 0.01, 10),
          one<math::log1p, ::log1p, ::log1pl>("log1p", -0.9, 3),
          one<math::log10, ::log10, ::log10l>("log10", 0.01, 10),
          two<math::pow, ::pow, ::powl>("pow", 0.01, 10, -5, 5),
          one<math::tanh, ::tanh, ::tanhl>("tanh", -3, 3),
          one<math::atanh, ::atanh, ::atanhl>("atanh", -0.99, 0.99),
          one<math::cbrt, ::cbrt, ::cbrtl>("cbrt", 0, 100),
          two<math::hypot, ::hypot, ::hypotl>("hypot", -1, 1, -1, 1)};
}

// In units of the last place of a double as large as the truth.
double error_ulp(double value, long double truth) {
  const long double error = (static_cast<long double>(value) - truth);
  return static_cast<double>(std::scalbn(std::abs(error), 52 - std::ilogb(truth)));
}

struct Errors {
  double worst_ulp = 0, worst_at = 0, square = 0;
  std::int64_t points = 0;
  void add(double error, double at) {
    square += error * error;
    ++points;
    if (error > worst_ulp) {
      worst_ulp = error;
      worst_at = at;
    }
  }
  [[nodiscard]] double rms_ulp() const { return std::sqrt(square / static_cast<double>(points)); }
};

struct Measured {
  Errors error;
  CallTime time;
};

struct Arguments {
  std::vector<double> first, second;
};
Arguments arguments(const Function& f, std::size_t count) {
  std::mt19937_64 random(23);
  const auto draw = [&random](double low, double high) {
    return low + (high - low) * std::generate_canonical<double, 53>(random);
  };
  Arguments a;
  for (std::size_t i = 0; i < count; ++i) {
    a.first.push_back(draw(f.low, f.high));
    a.second.push_back(draw(f.second_low, f.second_high));
  }
  return a;
}

Errors errors(const Function& f, Call call, const Arguments& at) {
  Errors e;
  for (std::size_t i = 0; i < at.first.size(); ++i) {
    const double x = at.first[i], y = at.second[i];
    const long double truth = f.truth(static_cast<long double>(x), static_cast<long double>(y));
    if (truth != 0) {
      e.add(error_ulp(call(x, y), truth), x);
    }
  }
  return e;
}

Timed timed(Call call, const Arguments& at) {
  return Timed([call, at, mask = at.first.size() - 1](std::size_t i) {
    return call(at.first[i & mask], at.second[i & mask]);
  });
}

// A bar for ours, a point for the C library's, a row for each function.
Panel panel(const std::string& title, const std::string& label, const std::vector<Function>& all,
            std::span<const Measured> ours, std::span<const Measured> theirs,
            double (*value)(const Measured&)) {
  Panel p{.title = title, .x_label = label};
  Series bar{.name = "punctum"}, point{.name = "C library", .style = Style::points};
  p.bars.emplace();
  for (std::size_t i = 0; i < all.size(); ++i) {
    p.bars->names.emplace_back(all[i].name);
    bar.y.push_back(value(ours[i]));
    point.x.push_back(value(theirs[i]));
    point.y.push_back(static_cast<double>(all.size() - i));
  }
  p.bars->parts.push_back(std::move(bar));
  p.series.push_back(std::move(point));
  return p;
}

}  // namespace

Result run_elementary(const Job& job) {
  const std::vector<Function> all = functions();
  std::vector<Measured> ours(all.size()), theirs(all.size());
  job.progress.start("errors and times", static_cast<std::int64_t>(all.size()));
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Function& f = all[i];
    const Arguments many = arguments(f, job.quick ? 20'000 : 1'000'000), few = arguments(f, 4096);
    ours[i].error = errors(f, f.ours, many);
    theirs[i].error = errors(f, f.c_library, many);
    const Timed both[] = {timed(f.ours, few), timed(f.c_library, few)};
    const std::vector<CallTime> times =
        time_interleaved(both, {.batches = job.quick ? 50 : 1000, .seconds = job.quick ? 0.1 : 2.0});
    ours[i].time = times[0];
    theirs[i].time = times[1];
    job.progress.step();
  }

  Table table{.name = "elementary",
              .columns = {"function", "library", "low", "high", "second_low", "second_high", "points",
                          "worst_error_ulp", "worst_at", "rms_error_ulp"}};
  for (const std::string& c : time_columns()) {
    table.columns.push_back(c);
  }
  table.columns.emplace_back("shipped");
  table.shown = {"function",        "library",       "low",       "high",
                 "worst_error_ulp", "rms_error_ulp", "median_ns", "shipped"};
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const bool shipped : {true, false}) {
      const Function& f = all[i];
      const Measured& m = shipped ? ours[i] : theirs[i];
      Row row{f.name,
              shipped ? "punctum" : "C library",
              f.low,
              f.high,
              f.second_low,
              f.second_high,
              m.error.points,
              m.error.worst_ulp,
              m.error.worst_at,
              m.error.rms_ulp()};
      for (Cell& c : time_cells(m.time)) {
        row.push_back(std::move(c));
      }
      row.emplace_back(shipped);
      table.shown_rows.push_back(table.rows.size());
      table.add(std::move(row));
    }
  }

  const auto rows = static_cast<double>(all.size());
  const auto time = [](const Measured& m) { return m.time.median_ns; };
  const auto worst = [](const Measured& m) { return m.error.worst_ulp; };
  Figure figure{.name = "elementary",
                .note =
                    "Arguments are uniform over the interval in the table. The truth is the C library's long "
                    "double. The bits of ours are the same on every machine; the C library's depend on the "
                    "processor."};
  figure.panels.push_back(panel("Time of a call", "median time per call [ns]", all, ours, theirs, time));
  figure.panels.push_back(panel("Error", "worst error [units of the last place]", all, ours, theirs, worst));
  figure.panels.back().series.push_back(
      {.name = "correctly rounded", .x = {0.5, 0.5}, .y = {0.4, rows + 0.6}, .style = Style::limit});

  std::size_t most = 0, slowest = 0;
  const auto ratio = [&](std::size_t i) { return time(ours[i]) / std::max(time(theirs[i]), 0.1); };
  double log_ratio = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    most = worst(ours[i]) > worst(ours[most]) ? i : most;
    slowest = ratio(i) > ratio(slowest) ? i : slowest;
    log_ratio += std::log(ratio(i)) / rows;
  }
  Result result;
  result.tables.push_back(std::move(table));
  result.figures.push_back(std::move(figure));
  result.reading = fmt::format(
      "No function errs by more than {:.2f} units of the last place ({}; the C library's by {:.2f}). In the "
      "geometric mean a call takes {:.2f} times the C library's time, at worst {:.1f} times ({}, {:.0f} ns).",
      worst(ours[most]), all[most].name, worst(theirs[most]), std::exp(log_ratio), ratio(slowest),
      all[slowest].name, time(ours[slowest]));
  return result;
}

}  // namespace punctum::report
