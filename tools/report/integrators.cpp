// Topic integrators: ways to step the stiff and discontinuous motions of the plant, error against run time.
// The simulated handle and cell are stepped by closed forms between located events; here the usual methods
// meet them on the same problems.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "tools/report/integration_limits.hpp"
#include "tools/report/integration_methods.hpp"
#include "tools/report/integration_runs.hpp"

namespace punctum::report {

namespace {

// The runs that are drawn against time: with located events, in double; or in double and float, of the
// methods to which the precision matters most.
std::vector<Work> runs_against_time(const IntegrationProblem& p, bool beside_float) {
  std::vector<Work> out;
  for (std::size_t i = 0; i < p.runs.size(); ++i) {
    const IntegrationRun& r = p.runs[i];
    const bool compared = r.method == RungeKutta4::name || r.method == ImplicitMidpoint::name ||
                          r.method == ExponentialRosenbrock::name;
    if (r.located && p.works[i].error < 1e-2 && (beside_float ? compared : !r.single)) {
      out.push_back(p.works[i]);
    }
  }
  return out;
}

Panel against_time(const IntegrationProblem& p, std::span<const Work> works) {
  Panel panel = work_precision(
      p.title, p.measure == Measure::position ? "error of the last position [m]" : "error of the event [s]",
      works);
  panel.x_label = "median time per simulated millisecond [ns]";
  return panel;
}

// Order of convergence of the events: least squares of log error over log step, above rounding. The error of
// events that are not located scatters below one step.
double order_of(const IntegrationProblem& p, const std::string& method, bool located) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const IntegrationRun& r : p.runs) {
    if (r.method != method || r.located != located || r.single) {
      continue;
    }
    if (!(r.error.event_s > 1e-13 && r.error.event_s < 2e-3)) {
      continue;
    }
    const double x = -std::log(static_cast<double>(r.per_tick)), y = std::log(r.error.event_s);
    n += 1;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  return n >= 3 ? (n * sxy - sx * sy) / (n * sxx - sx * sx) : std::nan("");
}

constexpr std::array<const char*, 5> kUsual = {ExplicitEuler::name, SemiImplicitEuler::name,
                                               RungeKutta4::name, ImplicitMidpoint::name,
                                               ExponentialRosenbrock::name};

Panel located_or_not(const IntegrationProblem& p) {
  Panel panel{.title = p.title + ": events located, or not",
              .x_label = "step [s]",
              .y_label = "largest error of an event [s]",
              .log_x = true,
              .log_y = true};
  for (const char* method : {RungeKutta4::name, ImplicitMidpoint::name, ExponentialRosenbrock::name}) {
    for (const bool located : {true, false}) {
      Series s{.name = std::string(method) + (located ? "" : ", not located"), .style = Style::line_points};
      for (const IntegrationRun& r : p.runs) {
        if (r.method != method || r.located != located || r.single || !(r.error.event_s < 0.1)) {
          continue;
        }
        s.x.push_back(kTick_s / static_cast<double>(r.per_tick));
        s.y.push_back(std::max(r.error.event_s, kRounding));
      }
      panel.series.push_back(std::move(s));
    }
  }
  panel.series.push_back(
      {.name = "first order", .x = {1e-7, 1e-3}, .y = {1e-7, 1e-3}, .style = Style::limit});
  return panel;
}

void add_rows(Table& t, const IntegrationProblem& p) {
  for (std::size_t i = 0; i < p.runs.size(); ++i) {
    const IntegrationRun& r = p.runs[i];
    const Work& w = p.works[i];
    const bool good = std::isfinite(w.error) && better_than(w, p.works) == nullptr;
    if (good || r.shipped) {
      t.shown_rows.push_back(t.rows.size());
    }
    Row row{p.name,
            r.method,
            r.located,
            r.single ? "float" : "double",
            kTick_s / static_cast<double>(r.per_tick),
            r.error.x_m,
            r.error.v_m_s,
            r.error.event_s};
    for (const auto& c : time_cells(w.time)) {
      row.push_back(c);
    }
    row.emplace_back(good);
    row.emplace_back(r.shipped);
    t.add(std::move(row));
  }
}

std::string of_problem(const IntegrationProblem& p) {
  return fmt::format("{}: {}", p.name, front_sentence(p.works));
}

}  // namespace

Result run_integrators(const Job& job) {
  sim::CellParams one;
  one.spread = 0;
  one.inner = false;
  const sim::Cell cell(one, sim::NeedleParams{}, sim::HolderParams{}, 1, 0);

  job.progress.start("errors and times", 3);
  std::vector<IntegrationProblem> problems = integration_problems(cell, job.quick);
  for (IntegrationProblem& p : problems) {
    measure_times(p, job.quick ? 1.0 : 15.0, job.quick);
    job.progress.step();
  }
  job.progress.start("stiffness and energy", 2);
  const StiffnessSweep stiff = over_stiffness();
  job.progress.step();
  const EnergyDrift energy = energy_drift(job.quick ? 100'000 : 1'000'000);
  job.progress.step();

  Result result;
  Table all{.name = "integrators",
            .columns = {"problem", "method", "located", "real", "step_s", "position_error_m",
                        "velocity_error_m_s", "event_error_s"},
            .shown = {"problem", "method", "located", "real", "step_s", "position_error_m", "event_error_s",
                      "median_ns", "p99_9_ns", "on_front", "shipped"}};
  for (const auto& c : time_columns()) {
    all.columns.push_back(c);
  }
  all.columns.insert(all.columns.end(), {"on_front", "shipped"});
  Figure main{
      .name = "integrators",
      .note =
          "Time is of one simulated millisecond, the longest step there may be: the held force changes "
          "then. Every reference comes from elsewhere (matrix exponentials in 40 digits; an extrapolation "
          "of order 12 in long double). The quasi-static needle leaves out its own inertia, drag and "
          "bending: that is its error, whatever the step."};
  Figure events{
      .name = "integrators_events",
      .note = "Located: a step ends on the contact or puncture. Else it is noticed at the end of the step."};
  Figure floats{.name = "integrators_float", .note = "Float beside double; the plant is stepped in double."};
  Table orders{.name = "integrators_orders",
               .columns = {"problem", "method", "order_located", "order_not_located"}};
  for (const IntegrationProblem& p : problems) {
    add_rows(all, p);
    main.panels.push_back(against_time(p, runs_against_time(p, false)));
    floats.panels.push_back(against_time(p, runs_against_time(p, true)));
    for (const char* method : kUsual) {
      orders.add({p.name, method, order_of(p, method, true), order_of(p, method, false)});
    }
  }
  main.panels.push_back(stiff.panel);
  events.panels = {located_or_not(problems[1]), located_or_not(problems[2])};
  result.tables = {std::move(all), std::move(orders), stability_limits(), stiff.table, energy.table};
  result.figures = {std::move(main),
                    std::move(events),
                    {.name = "integrators_energy", .panels = {energy.panel}},
                    std::move(floats)};
  result.reading = fmt::format(
      "Per simulated millisecond, {}; {}; {}; without located contact RK4's order on the wall falls from "
      "{:.1f} to "
      "{:.1f}; after {} steps the closed form has lost or gained {:.1g} of the energy.",
      of_problem(problems[0]), of_problem(problems[1]), of_problem(problems[2]),
      order_of(problems[1], RungeKutta4::name, true), order_of(problems[1], RungeKutta4::name, false),
      job.quick ? 100'000 : 1'000'000, energy.shipped);
  return result;
}

}  // namespace punctum::report
