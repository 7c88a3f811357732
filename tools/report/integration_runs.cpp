#include "tools/report/integration_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "hal/sim/plant/stage.hpp"
#include "tools/report/integration_problems.hpp"

namespace punctum::report {

namespace {

constexpr std::size_t kWall = 3;  // of kWallReference: 1e4 N/m

struct Truth {
  double x_m, v_m_s;
  std::vector<double> events_s;
};

template <class Real>
IntegrationError compare(const Motion<Real>& end, const EventLog& events, const Truth& truth) {
  IntegrationError e{std::abs(static_cast<double>(end.x) - truth.x_m),
                     std::abs(static_cast<double>(end.v) - truth.v_m_s)};
  if (events.count != static_cast<std::int64_t>(truth.events_s.size())) {
    return e;
  }
  e.event_s = 0;
  for (std::size_t i = 0; i < truth.events_s.size(); ++i) {
    e.event_s = std::max(e.event_s, std::abs(events.at_s[i] - truth.events_s[i]));
  }
  return e;
}

// One method over its step.
template <class Method, class Real, class Law>
void add(std::vector<IntegrationRun>& runs, const Law& law, const Truth& truth, bool located,
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
void add_usual(std::vector<IntegrationRun>& runs, const Law<double>& law, const Law<float>& single,
               const Truth& truth, const std::vector<std::int64_t>& explicit_parts,
               const std::vector<std::int64_t>& parts) {
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

// The shipped handle: sim::advance() locates its events by itself and does not report them.
void add_closed_handle(std::vector<IntegrationRun>& runs, const Truth& truth,
                       const std::vector<std::int64_t>& per_tick) {
  for (const std::int64_t n : per_tick) {
    const auto whole = [steps = steps_of<Handle<double>>(n)] {
      Handle<double> law;
      return integrate<double>(law, steps, [](const auto& l, double t, Motion<double> s, double h) {
        return ClosedForm::step(l, t, s, h);
      });
    };
    IntegrationError error = compare(whole(), EventLog{}, truth);
    error.event_s = std::nan("");
    runs.push_back({.method = ClosedForm::name,
                    .per_tick = n,
                    .error = error,
                    .timed = Timed([whole] { return whole().x; }),
                    .shipped = n == 1});
  }
}

// The whole shipped needle: SimStage and Cell, in three dimensions, with all that the picture needs.
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
    if (cell.contact) {
      events.add(cell.first_contact_time_s);
    }
    if (cell.outer.punctured) {
      events.add(cell.outer.puncture_time_s);
    }
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

std::vector<std::int64_t> powers(std::int64_t to, std::int64_t factor, std::int64_t from = 1) {
  std::vector<std::int64_t> out;
  for (std::int64_t n = from; n <= to; n *= factor) {
    out.push_back(n);
  }
  return out;
}

IntegrationProblem handle_problem(bool quick) {
  IntegrationProblem p{
      .name = "handle", .title = "handle: stops, turns, sticks, breaks away", .end_s = Handle<double>::end_s};
  const Truth truth{kHandleReference.x_m, kHandleReference.v_m_s, kHandleReference.events_s};
  const auto parts = powers(quick ? 64 : 256, quick ? 4 : 2);
  add_usual<Handle>(p.runs, {}, {}, truth, parts, parts);
  add_closed_handle(p.runs, truth, powers(16, 4));
  return p;
}

IntegrationProblem wall_problem(bool quick) {
  const Reference& r = kWallReference[kWall];
  IntegrationProblem p{.name = "wall",
                       .title = fmt::format("handle against a wall of {:g} N/m", r.stiffness_N_m),
                       .end_s = Wall<double>::end_s};
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

// The force of the membrane in three kinds of numbers. The laws refer to it.
struct Forces {
  explicit Forces(const sim::Cell& c) : cell(&c), exact(c), twice(c), single(c) {}
  const sim::Cell* cell;
  MembraneForce<long double> exact;
  MembraneForce<double> twice;
  MembraneForce<float> single;
};

IntegrationProblem puncture_problem(bool quick, const sim::Cell& cell) {
  const auto owned = std::make_shared<const Forces>(cell);
  const Forces& forces = *owned;
  IntegrationProblem p{.name = "puncture",
                       .title = "needle through a membrane",
                       .measure = Measure::event,
                       .end_s = Puncture<double>::end_s,
                       .owned = owned};
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

std::string full_name(const IntegrationRun& r) {
  return r.method + (r.located ? "" : ", not located") + (r.single ? " (float)" : "");
}

std::string step_text(std::int64_t per_tick) {
  return fmt::format("h = {:.3g} ms", kTick_s * 1e3 / static_cast<double>(per_tick));
}

}  // namespace

std::vector<IntegrationProblem> integration_problems(const sim::Cell& cell, bool quick) {
  return {handle_problem(quick), wall_problem(quick), puncture_problem(quick, cell)};
}

void measure_times(IntegrationProblem& p, double seconds, bool quick) {
  std::vector<Timed> timed;
  for (const IntegrationRun& r : p.runs) {
    timed.push_back(r.timed);
  }
  const auto times = time_interleaved(
      timed, {.batches = quick ? 15 : 1000, .batch_us = quick ? 5.0 : 20.0, .seconds = seconds});
  const double ticks = p.end_s / kTick_s;
  for (std::size_t i = 0; i < p.runs.size(); ++i) {
    const IntegrationRun& r = p.runs[i];
    CallTime t = times[i];
    for (double* ns : {&t.median_ns, &t.p99_9_ns, &t.max_ns, &t.overhead_ns}) {
      *ns /= ticks;
    }
    p.works.push_back({.method = full_name(r),
                       .knob = step_text(r.per_tick),
                       .error = p.error_of(r),
                       .time = t,
                       .shipped = r.shipped});
  }
}

}  // namespace punctum::report
