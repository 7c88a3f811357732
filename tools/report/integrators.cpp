// Topic integrators: ways to step the plant's stiff and discontinuous motions, error against run time. The
// simulated handle and cell are stepped by closed forms between located events; here they meet the usual
// methods on the same problems.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hal/sim/cell.hpp"
#include "hal/sim/stage.hpp"
#include "tools/report/integration_problems.hpp"
#include "tools/report/topic.hpp"

namespace punctum::report {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr double kRounding = 1e-15;  // m, s: errors below it count as it
constexpr double kTick_s = 1e-3;     // no step is longer: the held force changes there
constexpr std::size_t kWall = 3;     // of kWallReference, for the figures: 1e4 N/m

struct Error {
  double x_m = kNothing, v_m_s = kNothing;
  double event_s = kNothing;  // largest; nothing when their number is wrong or they are not told
};

struct Run {
  std::string method{};
  bool located = true;
  bool single = false;  // float
  std::int64_t per_tick = 1;
  Error error{};
  Timed timed;
  bool shipped = false;
};

struct Truth {
  double x_m, v_m_s;
  std::vector<double> events_s;
};

template <class Real>
Error compare(const Motion<Real>& end, const EventLog& events, const Truth& truth) {
  Error e{std::abs(static_cast<double>(end.x) - truth.x_m),
          std::abs(static_cast<double>(end.v) - truth.v_m_s)};
  if (events.count != static_cast<std::int64_t>(truth.events_s.size())) return e;
  e.event_s = 0;
  for (std::size_t i = 0; i < truth.events_s.size(); ++i)
    e.event_s = std::max(e.event_s, std::abs(events.at_s[i] - truth.events_s[i]));
  return e;
}

template <class Law>
std::int64_t steps_of(std::int64_t per_tick) {
  return std::llround(Law::end_s / kTick_s) * per_tick;
}

// One method over its step.
template <class Method, class Real, class Law>
void add(std::vector<Run>& runs, const Law& law, const Truth& truth, bool located,
         const std::vector<std::int64_t>& per_tick) {
  for (const std::int64_t n : per_tick) {
    const auto whole = [law, located, steps = steps_of<Law>(n)](EventLog& events) {
      Law own = law;
      const auto end = located ? integrate<Real>(own, steps, step_located<Method, Real, Law>)
                               : integrate<Real>(own, steps, step_unlocated<Method, Real, Law>);
      events = own.events;
      return end;
    };
    EventLog events;
    const auto end = whole(events);
    runs.push_back({.method = Method::name,
                    .located = located,
                    .single = std::is_same_v<Real, float>,
                    .per_tick = n,
                    .error = compare(end, events, truth),
                    .timed = Timed([whole] {
                      EventLog unused;
                      return whole(unused).x;
                    })});
  }
}

template <template <class> class Law>
void add_usual(std::vector<Run>& runs, const Law<double>& law, const Law<float>& single, const Truth& truth,
               const std::vector<std::int64_t>& explicit_parts, const std::vector<std::int64_t>& parts) {
  for (const bool located : {true, false}) {
    add<ExplicitEuler, double>(runs, law, truth, located, explicit_parts);
    add<SemiImplicitEuler, double>(runs, law, truth, located, explicit_parts);
    add<RungeKutta4, double>(runs, law, truth, located, explicit_parts);
    add<ImplicitMidpoint, double>(runs, law, truth, located, parts);
    add<ExponentialRosenbrock, double>(runs, law, truth, located, parts);
  }
  add<ExplicitEuler, float>(runs, single, truth, true, explicit_parts);
  add<SemiImplicitEuler, float>(runs, single, truth, true, explicit_parts);
  add<RungeKutta4, float>(runs, single, truth, true, explicit_parts);
  add<ImplicitMidpoint, float>(runs, single, truth, true, parts);
  add<ExponentialRosenbrock, float>(runs, single, truth, true, parts);
}

// The handle as it is shipped: advance() finds its events by itself and does not tell them.
void add_closed_handle(std::vector<Run>& runs, const Truth& truth,
                       const std::vector<std::int64_t>& per_tick) {
  for (const std::int64_t n : per_tick) {
    const auto whole = [steps = steps_of<Handle<double>>(n)] {
      Handle<double> law;
      return integrate<double>(law, steps, [](const auto& l, double t, Motion<double> s, double h) {
        return ClosedForm::step(l, t, s, h);
      });
    };
    Error error = compare(whole(), EventLog{}, truth);
    error.event_s = kNothing;
    runs.push_back({.method = ClosedForm::name,
                    .per_tick = n,
                    .error = error,
                    .timed = Timed([whole] { return whole().x; }),
                    .shipped = n == 1});
  }
}

// The needle as it is shipped, whole: SimStage and Cell, in three dimensions, with all that the picture
// needs.
class WholeNeedle {
 public:
  using Law = Puncture<double>;
  explicit WholeNeedle(const sim::Cell& cell) : cell_(&cell), stage_(params(cell)) {
    hal::StageCommand to;
    to.tip_m = cell.centre_m({}) + sim::Vec3(cell.R_m() - Law::set_point_m, 0, 0);
    to.axis = -sim::Vec3::UnitX();
    stage_.enable(true);
    stage_.step(0, 0, true, sim::Failure::none);
    (void)stage_.command(to);
    start_ = stage_.state();
  }
  Motion<double> operator()(std::int64_t per_tick, EventLog& events) {
    const std::int64_t steps = steps_of<Law>(per_tick);
    const double h = Law::end_s / static_cast<double>(steps);
    sim::CellState cell;
    stage_.restore(start_);
    for (std::int64_t i = 0; i < steps; ++i) {
      const sim::StagePlantState before = stage_.state();
      stage_.step(i + 1, h, true, sim::Failure::none);
      cell.time_s = h * static_cast<double>(i);
      sim::TipMotion motion;
      motion.tip_begin_m = before.tip_m;
      motion.tip_end_m = stage_.state().tip_m;
      motion.left_m = (before.set_point_m.vec() - before.tip_m.vec()).norm();
      motion.knee_m = kSpeed_m_s * Law::lag_s;
      motion.lag_s = Law::lag_s;
      keep(cell_->step(cell, motion, h));
    }
    if (cell.contact) events.add(cell.first_contact_time_s);
    if (cell.outer.punctured) events.add(cell.outer.puncture_time_s);
    return {cell_->centre_m({}).x() + cell_->R_m() - stage_.state().tip_m.x, -stage_.state().velocity_m_s.x};
  }

 private:
  static sim::StageParams params(const sim::Cell& cell) {
    sim::StageParams p;
    p.start_m = cell.centre_m({}) + sim::Vec3(cell.R_m() - Law::start_m, 0, 0);
    p.lag_s = Law::lag_s;
    p.velocity_max_m_s = kSpeed_m_s;
    p.resolution_m = 0;
    p.registration_m.setZero();
    return p;
  }
  static constexpr double kSpeed_m_s = 0.01;  // never reached
  const sim::Cell* cell_;
  sim::SimStage stage_;
  sim::StagePlantState start_;
};

// ---- tables and figures ----

enum class Measure : std::uint8_t { position, event };

struct Problem {
  std::string name{}, title{};
  Measure measure = Measure::position;
  std::vector<Run> runs{};
  std::vector<Work> works{};  // of runs, time per tick

  [[nodiscard]] double error_of(const Run& r) const {
    const double e = measure == Measure::position ? r.error.x_m : r.error.event_s;
    return std::isfinite(e) ? std::max(e, kRounding) : std::numeric_limits<double>::infinity();
  }
};

std::string full_name(const Run& r) {
  return r.method + (r.located ? "" : ", not located") + (r.single ? " (float)" : "");
}

std::string step_text(std::int64_t per_tick) {
  return fmt::format("h = {:.3g} ms", kTick_s * 1e3 / static_cast<double>(per_tick));
}

void measure_times(Problem& p, double seconds, bool quick, double end_s) {
  std::vector<Timed> timed;
  for (const Run& r : p.runs) timed.push_back(r.timed);
  const auto times = time_interleaved(
      timed, {.batches = quick ? 15 : 1000, .batch_us = quick ? 5.0 : 20.0, .seconds = seconds});
  const double ticks = end_s / kTick_s;
  for (std::size_t i = 0; i < p.runs.size(); ++i) {
    const Run& r = p.runs[i];
    CallTime t = times[i];
    for (double* ns : {&t.median_ns, &t.p99_9_ns, &t.max_ns, &t.overhead_ns}) *ns /= ticks;
    p.works.push_back({.method = full_name(r),
                       .knob = step_text(r.per_tick),
                       .error = p.error_of(r),
                       .time = t,
                       .shipped = r.shipped});
  }
}

// What is drawn against time: located. In double; or, of what gains most by the number's length, in both.
std::vector<Work> drawn(const Problem& p, bool beside_float) {
  std::vector<Work> out;
  for (std::size_t i = 0; i < p.runs.size(); ++i) {
    const Run& r = p.runs[i];
    const bool compared = r.method == RungeKutta4::name || r.method == ImplicitMidpoint::name ||
                          r.method == ExponentialRosenbrock::name;
    if (r.located && p.works[i].error < 1e-2 && (beside_float ? compared : !r.single))
      out.push_back(p.works[i]);
  }
  return out;
}

Panel against_time(const Problem& p, std::span<const Work> works) {
  Panel panel = work_precision(
      p.title, p.measure == Measure::position ? "error of the last position [m]" : "error of the event [s]",
      works);
  panel.x_label = "median time per simulated millisecond [ns]";
  return panel;
}

// Order of convergence of the events: least squares of log error over log step, above rounding. Where they
// are not located the error is a saw's tooth, at most a step.
double order_of(const Problem& p, const std::string& method, bool located) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const Run& r : p.runs) {
    if (r.method != method || r.located != located || r.single) continue;
    if (!(r.error.event_s > 1e-13 && r.error.event_s < 2e-3)) continue;
    const double x = -std::log(static_cast<double>(r.per_tick)), y = std::log(r.error.event_s);
    n += 1;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  return n >= 3 ? (n * sxy - sx * sy) / (n * sxx - sx * sx) : kNothing;
}

constexpr std::array<const char*, 5> kUsual = {ExplicitEuler::name, SemiImplicitEuler::name,
                                               RungeKutta4::name, ImplicitMidpoint::name,
                                               ExponentialRosenbrock::name};

Panel located_or_not(const Problem& p) {
  Panel panel{.title = p.title + ": events located, or not",
              .x_label = "step [s]",
              .y_label = "largest error of an event [s]",
              .log_x = true,
              .log_y = true};
  for (const char* method : {RungeKutta4::name, ImplicitMidpoint::name, ExponentialRosenbrock::name}) {
    for (const bool located : {true, false}) {
      Series s{.name = std::string(method) + (located ? "" : ", not located"), .style = Style::line_points};
      for (const Run& r : p.runs) {
        if (r.method != method || r.located != located || r.single || !(r.error.event_s < 0.1)) continue;
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

// ---- stability ----

// Largest wh at which the method's own step does not grow a linear oscillator of damping ratio zeta; infinity
// when there is none.
template <class Method>
double stable_wh(double zeta) {
  struct Oscillator {
    double zeta;
    [[nodiscard]] double a(double, Motion<double> s) const { return -s.x - 2 * zeta * s.v; }
    [[nodiscard]] Slopes<double> slopes(double, Motion<double>) const { return {-1, -2 * zeta, 0}; }
  };
  const auto radius = [&](double h) {
    const Oscillator law{zeta};
    const auto p = Method::step(law, 0.0, Motion<double>{1, 0}, h),
               q = Method::step(law, 0.0, Motion<double>{0, 1}, h);
    const double half = (p.x + q.v) / 2, det = p.x * q.v - q.x * p.v, square = half * half - det;
    return square < 0 ? std::sqrt(det) : std::abs(half) + std::sqrt(square);
  };
  constexpr double slack = 1 + 1e-12;
  if (radius(1e6) <= slack) return std::numeric_limits<double>::infinity();
  double low = 0, high = 1e6;
  for (double h = 1e-3; h < 1e6; h *= 1.01) {
    if (radius(h) > slack) {
      high = h;
      break;
    }
    low = h;
  }
  if (low == 0) return 0;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (radius(middle) > slack ? high : low) = middle;
  }
  return low;
}

Table limits_table() {
  Table t{.name = "integrators_limits", .columns = {"method", "zeta", "stable_wh", "published_wh"}};
  constexpr double none = std::numeric_limits<double>::infinity();
  const auto text = [](double wh) { return std::isinf(wh) ? Cell("unlimited") : Cell(wh); };
  for (const double zeta : {0.0, 0.05, 0.2, 0.7}) {
    t.add({ExplicitEuler::name, zeta, text(stable_wh<ExplicitEuler>(zeta)), 2 * zeta});
    t.add({SemiImplicitEuler::name, zeta, text(stable_wh<SemiImplicitEuler>(zeta)),
           2 * (std::sqrt(1 + zeta * zeta) - zeta)});
    t.add({RungeKutta4::name, zeta, text(stable_wh<RungeKutta4>(zeta)), 2 * std::numbers::sqrt2});
    t.add({ImplicitMidpoint::name, zeta, text(stable_wh<ImplicitMidpoint>(zeta)), text(none)});
    t.add({ExponentialRosenbrock::name, zeta, text(stable_wh<ExponentialRosenbrock>(zeta)), text(none)});
  }
  return t;
}

// ---- stiffness ----

struct Sweep {
  Table table{.name = "integrators_stiffness", .columns = {"method", "stiffness_N_m", "wh", "error_m"}};
  Panel panel{.title = "wall, h = 1 ms, contact located",
              .x_label = "stiffness of the wall [N/m]",
              .y_label = "error of the last position [m]",
              .log_x = true,
              .log_y = true};
};

template <class Method>
void sweep(Sweep& out) {
  Series s{.name = Method::name, .style = Style::line_points};
  for (const Reference& r : kWallReference) {
    Wall<double> law{r.stiffness_N_m};
    const auto end =
        integrate<double>(law, steps_of<Wall<double>>(1), step_located<Method, double, Wall<double>>);
    const double error = std::max(std::abs(end.x - r.x_m), kRounding);
    out.table.add({Method::name, r.stiffness_N_m,
                   std::sqrt(r.stiffness_N_m / Wall<double>::mass_kg) * kTick_s,
                   std::isfinite(error) ? error : kNothing});
    s.x.push_back(r.stiffness_N_m);
    s.y.push_back(std::min(error, 1e3));
  }
  out.panel.series.push_back(std::move(s));
}

Sweep over_stiffness() {
  Sweep out;
  sweep<ExplicitEuler>(out);
  sweep<SemiImplicitEuler>(out);
  sweep<RungeKutta4>(out);
  sweep<ImplicitMidpoint>(out);
  sweep<ExponentialRosenbrock>(out);
  sweep<ClosedForm>(out);
  constexpr double zeta = 0.05;
  for (const auto& [name, wh] : {std::pair{"explicit Euler's limit", 2 * zeta},
                                 {"semi-implicit Euler's", 2 * (std::sqrt(1 + zeta * zeta) - zeta)},
                                 {"RK4's", 2 * std::numbers::sqrt2}}) {
    const double K = Wall<double>::mass_kg * wh * wh / (kTick_s * kTick_s);
    out.panel.series.push_back({.name = name, .x = {K, K}, .y = {1e-15, 1e0}, .style = Style::limit});
  }
  const Series& closed = out.panel.series[5];
  out.panel.marks.push_back({closed.x[2], closed.y[2], "shipped"});
  return out;
}

// ---- energy ----

struct Drift {
  Table table{.name = "integrators_energy", .columns = {"method", "steps", "relative_energy_error"}};
  Panel panel{.title = "energy of an undamped body bouncing on a wall of 10 kN/m, h = 0.25 ms",
              .x_label = "steps",
              .y_label = "energy gained or lost, of the initial",
              .log_x = true,
              .log_y = true};
  double shipped = kNothing;  // after all steps
};

template <class Method>
void drift(Drift& out, std::int64_t steps) {
  Wall<double> law{.stiffness_N_m = 1e4, .handle_Ns_m = 0, .wall_Ns_m = 0};
  constexpr double h = 0.25e-3;
  Motion<double> s = Wall<double>::start;
  const double start = law.energy_J(s);
  Series line{.name = Method::name, .style = Style::line_points};
  std::int64_t next = 1;
  for (std::int64_t i = 1; i <= steps; ++i) {
    s = step_located<Method>(law, 0.0, s, h);
    if (i != next && i != steps) continue;
    next = std::max(next + 1, next * 178 / 100);
    const double error = std::abs(law.energy_J(s) / start - 1);
    out.table.add({Method::name, i, error});
    if (!(error < 1e3)) break;
    line.x.push_back(static_cast<double>(i));
    line.y.push_back(std::max(error, 1e-16));
    if (std::is_same_v<Method, ClosedForm> && i == steps) out.shipped = error;
  }
  out.panel.series.push_back(std::move(line));
}

Drift energy_drift(std::int64_t steps) {
  Drift out;
  drift<ExplicitEuler>(out, steps);
  drift<SemiImplicitEuler>(out, steps);
  drift<RungeKutta4>(out, steps);
  drift<ImplicitMidpoint>(out, steps);
  drift<ExponentialRosenbrock>(out, steps);
  drift<ClosedForm>(out, steps);
  out.panel.series.push_back({.name = "wanted: 1e-6 after 1e6 steps",
                              .x = {1, static_cast<double>(steps)},
                              .y = {1e-6, 1e-6},
                              .style = Style::limit});
  const Series& closed = out.panel.series[5];
  out.panel.marks.push_back({closed.x[closed.x.size() / 2], closed.y[closed.y.size() / 2], "shipped"});
  return out;
}

// ---- problems ----

std::vector<std::int64_t> powers(std::int64_t to, std::int64_t factor, std::int64_t from = 1) {
  std::vector<std::int64_t> out;
  for (std::int64_t n = from; n <= to; n *= factor) out.push_back(n);
  return out;
}

Problem handle_problem(bool quick) {
  Problem p{.name = "handle", .title = "handle: stops, turns, sticks, breaks away"};
  const Truth truth{kHandleReference.x_m, kHandleReference.v_m_s, kHandleReference.events_s};
  const auto parts = powers(quick ? 64 : 256, quick ? 4 : 2);
  add_usual<Handle>(p.runs, {}, {}, truth, parts, parts);
  add_closed_handle(p.runs, truth, powers(16, 4));
  return p;
}

Problem wall_problem(bool quick) {
  const Reference& r = kWallReference[kWall];
  Problem p{.name = "wall", .title = fmt::format("handle against a wall of {:g} N/m", r.stiffness_N_m)};
  const Truth truth{r.x_m, r.v_m_s, r.events_s};
  const Wall<double> law{r.stiffness_N_m};
  const Wall<float> single{static_cast<float>(r.stiffness_N_m)};
  const auto parts = powers(quick ? 256 : 1024, quick ? 4 : 2);
  add_usual<Wall>(p.runs, law, single, truth, parts, parts);
  const std::size_t first = p.runs.size();
  add<ClosedForm, double>(p.runs, law, truth, true, powers(16, 4));
  p.runs[first].shipped = true;
  return p;
}

// The forces must outlive what is returned.
struct Forces {
  explicit Forces(const sim::Cell& c) : cell(&c), exact(c), twice(c), single(c) {}
  const sim::Cell* cell;
  MembraneForce<long double> exact;
  MembraneForce<double> twice;
  MembraneForce<float> single;
};

Problem puncture_problem(bool quick, const Forces& forces) {
  Problem p{.name = "puncture", .title = "needle through a membrane", .measure = Measure::event};
  const double at_m = forces.cell->puncture_depth_m();
  Puncture<long double> exact{&forces.exact, static_cast<long double>(at_m)};
  const auto end =
      integrate<long double>(exact, 16'000, step_located<Extrapolated, long double, Puncture<long double>>);
  const Truth truth{
      static_cast<double>(end.x), static_cast<double>(end.v), {exact.events.at_s[0], exact.events.at_s[1]}};
  const Puncture<double> law{&forces.twice, at_m};
  const Puncture<float> single{&forces.single, static_cast<float>(at_m)};
  add_usual<Puncture>(p.runs, law, single, truth, powers(quick ? 2048 : 8192, quick ? 4 : 2, 512),
                      powers(quick ? 256 : 4096, 4));
  const std::size_t first = p.runs.size();
  add<QuasiStatic, double>(p.runs, law, truth, true, powers(16, 4));
  p.runs[first].shipped = true;
  for (const std::int64_t n : powers(16, 4)) {
    auto whole = [needle = WholeNeedle(*forces.cell), n](EventLog& events) mutable {
      return needle(n, events);
    };
    EventLog events;
    const auto reached = whole(events);
    p.runs.push_back({.method = "quasi-static, whole stage and cell",
                      .per_tick = n,
                      .error = compare(reached, events, truth),
                      .timed = Timed([whole]() mutable {
                        EventLog unused;
                        return whole(unused).x;
                      })});
  }
  return p;
}

void add_rows(Table& t, const Problem& p) {
  for (std::size_t i = 0; i < p.runs.size(); ++i) {
    const Run& r = p.runs[i];
    const Work& w = p.works[i];
    const bool good = std::isfinite(w.error) && better_than(w, p.works) == nullptr;
    if (good || r.shipped) t.shown_rows.push_back(t.rows.size());
    Row row{p.name,
            r.method,
            r.located,
            r.single ? "float" : "double",
            kTick_s / static_cast<double>(r.per_tick),
            r.error.x_m,
            r.error.v_m_s,
            r.error.event_s};
    for (const auto& c : time_cells(w.time)) row.push_back(c);
    row.emplace_back(good);
    row.emplace_back(r.shipped);
    t.add(std::move(row));
  }
}

std::string of_problem(const Problem& p) { return fmt::format("{}: {}", p.name, front_sentence(p.works)); }

}  // namespace

Result run_integrators(const Job& job) {
  sim::CellParams one;
  one.spread = 0;
  one.inner = false;
  const sim::Cell cell(one, sim::NeedleParams{}, sim::HolderParams{}, 1, 0);
  const Forces forces(cell);

  job.progress.start("errors and times", 3);
  std::vector<Problem> problems;
  problems.push_back(handle_problem(job.quick));
  problems.push_back(wall_problem(job.quick));
  problems.push_back(puncture_problem(job.quick, forces));
  const std::array<double, 3> ends = {Handle<double>::end_s, Wall<double>::end_s, Puncture<double>::end_s};
  for (std::size_t i = 0; i < problems.size(); ++i) {
    measure_times(problems[i], job.quick ? 1.0 : 15.0, job.quick, ends[i]);
    job.progress.step();
  }
  job.progress.start("stiffness and energy", 2);
  const Sweep stiff = over_stiffness();
  job.progress.step();
  const Drift energy = energy_drift(job.quick ? 100'000 : 1'000'000);
  job.progress.step();

  Result result;
  Table all{.name = "integrators",
            .columns = {"problem", "method", "located", "real", "step_s", "position_error_m",
                        "velocity_error_m_s", "event_error_s"},
            .shown = {"problem", "method", "located", "real", "step_s", "position_error_m", "event_error_s",
                      "median_ns", "p99_9_ns", "on_front", "shipped"}};
  for (const auto& c : time_columns()) all.columns.push_back(c);
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
  for (const Problem& p : problems) {
    add_rows(all, p);
    main.panels.push_back(against_time(p, drawn(p, false)));
    floats.panels.push_back(against_time(p, drawn(p, true)));
    for (const char* method : kUsual)
      orders.add({p.name, method, order_of(p, method, true), order_of(p, method, false)});
  }
  main.panels.push_back(stiff.panel);
  events.panels = {located_or_not(problems[1]), located_or_not(problems[2])};
  result.tables = {std::move(all), std::move(orders), limits_table(), stiff.table, energy.table};
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
