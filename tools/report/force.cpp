// Topic force: evaluations of eq. 5, error against run time; and the laws of the membrane against the
// large-deflection equations of the simulated cell, which none of the laws solves.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "hal/sim/plant/cell.hpp"
#include "hal/sim/plant/membrane_truth.hpp"
#include "rt/forces/large_deflection.hpp"
#include "rt/forces/membrane.hpp"
#include "tools/report/topic.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::report {
namespace {

using std::numbers::pi_v;

constexpr double kJustNoticeable = 0.08;  // relative difference of force that a hand can tell
constexpr double kNoDigit = 1;            // larger errors count as this

// ---- eq. 5, evaluated ----

struct Reference {
  double c_m, wd_m, a_m;
  long double force_N;
};
constexpr Reference kReference[] = {
#include "tools/report/force_reference.inc"
};
constexpr double kE_Pa = 35.3e3, kH_m = 4.6e-6, kNu = 0.5;

double narrowness(const Reference& r) { return (r.a_m - r.c_m) / r.a_m; }  // 1 - zeta

// The input of a method. The difference a - c is an input of its own, since rounding to float would leave
// only noise.
template <class Real>
struct Dimple {
  Real c, wd, a, reach;
  explicit Dimple(const Reference& r)
      : c(static_cast<Real>(r.c_m)),
        wd(static_cast<Real>(r.wd_m)),
        a(static_cast<Real>(r.a_m)),
        reach(static_cast<Real>(r.a_m - r.c_m)) {}
};

template <class Real>
Real times_shape(const Dimple<Real>& d, Real f) {
  const Real slope = d.wd / d.a;
  return 2 * pi_v<Real> * static_cast<Real>(kE_Pa) * static_cast<Real>(kH_m) * d.wd * (slope * slope) /
         (1 - static_cast<Real>(kNu)) * f;
}

template <class Real>
struct Printed {
  Real operator()(const Dimple<Real>& d) const {
    const Real z2 = (d.c / d.a) * (d.c / d.a);
    const Real log_z2 = std::log(z2);
    const Real N = 3 - 4 * z2 + z2 * z2 + 2 * log_z2;
    const Real D = 1 - z2 + log_z2;
    return times_shape(d, N / ((1 - z2) * D * D * D));
  }
};

template <class Real>
struct Stable {
  Real operator()(const Dimple<Real>& d) const {
    return rt::eq5(static_cast<Real>(kE_Pa), static_cast<Real>(kNu), static_cast<Real>(kH_m), d.wd, d.a,
                   rt::membrane_shape(d.c, d.reach).f);
  }
};

// Cubics through a table of f s^4 over the eighth root of 1 - s, s = (1-zeta^2)/(1+zeta^2): without a
// logarithm, and smooth at both ends.
template <class Real>
class Tabled {
 public:
  explicit Tabled(int knots) : last_(static_cast<Real>(knots - 1)) {
    for (int i = -1; i <= knots; ++i) {
      const double v = kLeast + (1 - kLeast) * std::clamp(i, 0, knots - 1) / (knots - 1);
      const double s = std::max(-std::expm1(8 * std::log(v)), 1e-15);
      const double rest = std::pow(v, 8);  // 1 - s
      const double zeta = std::sqrt(rest / (2 - rest));
      const double reach = 2 * s / ((1 + s) * (1 + zeta));
      g_.push_back(static_cast<Real>(rt::membrane_shape(zeta, reach).f * s * s * s * s));
    }
    // Beyond the ends the cubic through the last four knots continues.
    const std::size_t n = g_.size();
    g_[0] = 4 * g_[1] - 6 * g_[2] + 4 * g_[3] - g_[4];
    g_[n - 1] = 4 * g_[n - 2] - 6 * g_[n - 3] + 4 * g_[n - 4] - g_[n - 5];
  }
  Real operator()(const Dimple<Real>& d) const {
    const Real zeta = d.c / d.a;
    const Real by = 1 / (1 + zeta * zeta);
    const Real s = (d.reach / d.a) * (1 + zeta) * by;
    const Real v = std::sqrt(std::sqrt(std::sqrt(2 * zeta * zeta * by)));
    const Real at = (v - static_cast<Real>(kLeast)) / static_cast<Real>(1 - kLeast) * last_;
    const auto i = static_cast<std::size_t>(std::clamp(at, Real(0), last_ - 1));
    const Real x = at - static_cast<Real>(i);
    const Real* g = g_.data() + i;  // at -1, 0, 1, 2
    const Real value =
        g[1] + x / 6 *
                   (-2 * g[0] - 3 * g[1] + 6 * g[2] - g[3] +
                    x * (3 * (g[0] - 2 * g[1] + g[2]) + x * (g[3] - g[0] + 3 * (g[1] - g[2]))));
    const Real s2 = s * s;
    return times_shape(d, value / (s2 * s2));
  }

 private:
  static constexpr double kLeast = 0.03;  // of v; there zeta is 6e-7
  Real last_;
  std::vector<Real> g_;
};

struct Method {
  std::string name, knob;
  double narrowest = 1e-9;  // smallest 1 - zeta that it is evaluated at
  double worst = 0;
  Reference where{};
  Timed timed;
  bool shipped = false;
};

template <class Real, class Law>
Method method(const std::string& name, const std::string& knob, double narrowest, const Law& law) {
  constexpr std::size_t kWalk = 512;
  std::vector<Dimple<Real>> walk;
  double worst = 0;
  Reference where{};
  for (const Reference& r : kReference) {
    if (narrowness(r) < narrowest) {
      continue;
    }
    walk.emplace_back(r);
    const auto force = static_cast<long double>(law(walk.back()));
    double error = static_cast<double>(std::abs(force - r.force_N) / r.force_N);
    if (!(error < kNoDigit)) {
      error = kNoDigit;
    }
    if (error > worst) {
      worst = error;
      where = r;
    }
  }
  const std::size_t n = walk.size();
  while (walk.size() < kWalk) {
    walk.push_back(walk[walk.size() % n]);
  }
  walk.resize(kWalk, walk.front());
  return {.name = name,
          .knob = knob,
          .narrowest = narrowest,
          .worst = worst,
          .where = where,
          .timed = Timed([walk = std::move(walk), law](std::size_t i) { return law(walk[i % kWalk]); })};
}

template <class Real>
void add_methods(std::vector<Method>& methods, const std::string& real, bool quick) {
  for (const double narrowest : {1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-9}) {
    const std::string knob = fmt::format("1-zeta down to {:g}", narrowest);
    methods.push_back(method<Real>("as printed, " + real, knob, narrowest, Printed<Real>{}));
    methods.push_back(method<Real>("stable form, " + real, knob, narrowest, Stable<Real>{}));
  }
  for (int knots = 16; knots <= 16384; knots *= quick ? 8 : 4) {
    methods.push_back(
        method<Real>("table of cubics, " + real, fmt::format("{} knots", knots), 1e-9, Tabled<Real>(knots)));
  }
}

// ---- the laws against the large-deflection equations ----

constexpr int kFine = 256;  // intervals of half a meridian; the force is right to 1e-8

// The cell of a built-in scene, and the parameters of its laws.
struct SceneCell {
  std::string name;
  rt::MembraneParams params;
  double dimple_scale = 0;
  sim::MembraneShape shape;
  double R_m = 0, Eh_N_m = 0, puncture_m = 0;
};
SceneCell cell_of(const std::string& scene_name) {
  const auto scene = tools::load_scene(scene_name, {});
  if (!scene) {
    throw std::runtime_error(scene.error());
  }
  if (!scene->sim || !scene->sim->cell || !scene->servo.membrane || !scene->servo.local_model) {
    throw std::runtime_error(scene_name + ": it has no simulated cell or no membrane law");
  }
  sim::CellParams one = *scene->sim->cell;
  one.spread = 0;
  const sim::Cell cell(one, scene->sim->needle, scene->sim->holder, 1, 0);
  return {.name = scene_name,
          .params = *scene->servo.membrane,
          .dimple_scale = scene->servo.local_model->dimple_scale,
          .shape = cell.table(sim::Membrane::outer).shape(),
          .R_m = cell.R_m(),
          .Eh_N_m = cell.outer_Eh_N_m(),
          .puncture_m = cell.puncture_depth_m()};
}

struct Law {
  std::string name;
  bool shipped = false;
  // seen_a_m: half-width of the dimple that vision without error would see.
  std::function<double(const SceneCell&, double wd_m, double seen_a_m)> force_N;
};
double by_law(const SceneCell& cell, rt::MembraneParams::Law law, double wd_m) {
  rt::MembraneParams params = cell.params;
  params.law = law;
  return rt::membrane_law(params, wd_m, cell.R_m, cell.dimple_scale).force_N;
}
std::vector<Law> laws() {
  using Which = rt::MembraneParams::Law;
  return {{"paper, a at 1 % of the depth", false,
           [](const SceneCell& c, double wd_m, double a_m) {
             const auto& p = c.params;
             return rt::membrane_force(p.E_Pa, p.nu, p.h_m, p.c_m, wd_m, a_m);
           }},
          {"paper, fitted closure a(w)", false,
           [](const SceneCell& c, double wd_m, double) { return by_law(c, Which::paper, wd_m); }},
          {"large deflection", true,
           [](const SceneCell& c, double wd_m, double) { return by_law(c, Which::large_deflection, wd_m); }}};
}

struct Fit {
  double square = 0, true_square = 0, worst = 0, worst_at_m = 0;
  int points = 0;
  void add(double force_N, double truth_N, double wd_m) {
    square += std::pow(force_N - truth_N, 2);
    true_square += truth_N * truth_N;
    ++points;
    const double error = std::abs(force_N / truth_N - 1);
    if (!(error > worst)) {
      return;
    }
    worst = error;
    worst_at_m = wd_m;
  }
  [[nodiscard]] double rms() const { return std::sqrt(square / true_square); }
};

Panel error_panel(const std::string& title, const std::string& x_label) {
  return {.title = title, .x_label = x_label, .y_label = "relative error of force", .log_y = true};
}
void draw_noticeable(Panel& panel, double from, double to) {
  panel.series.push_back({.name = "just noticeable, 8 %",
                          .x = {from, to},
                          .y = {kJustNoticeable, kJustNoticeable},
                          .style = Style::limit});
}

struct Compared {
  Panel panel;
  std::vector<Fit> fits;
};
Compared compare(const SceneCell& cell, const std::vector<Law>& all, int depths, Progress& progress) {
  Compared out{error_panel(cell.name + ": laws against the simulated cell", "depth of the dimple [um]"),
               std::vector<Fit>(all.size())};
  for (const Law& law : all) {
    out.panel.series.push_back({.name = law.name});
  }
  sim::MembraneSolution x;
  for (int k = 1; k <= depths; ++k) {
    const double wd_m = 1.15 * cell.puncture_m * k / depths;
    if (!sim::solve_membrane(cell.shape, wd_m / cell.R_m, kFine, x)) {
      break;
    }
    const double truth_N = x.force * cell.Eh_N_m * cell.R_m;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double force_N = all[i].force_N(cell, wd_m, x.half_width * cell.R_m);
      if (wd_m <= cell.puncture_m) {
        out.fits[i].add(force_N, truth_N, wd_m);
      }
      out.panel.series[i].x.push_back(wd_m * 1e6);
      out.panel.series[i].y.push_back(std::max(std::abs(force_N / truth_N - 1), 1e-5));
    }
    progress.step();
  }
  draw_noticeable(out.panel, 0, 1.15e6 * cell.puncture_m);
  out.panel.marks.push_back({cell.puncture_m * 1e6, kJustNoticeable, "gives way"});
  return out;
}

// The corrected law at random places in the whole box of its calibration.
struct Box {
  Panel panel;
  double rms = 0, worst = 0;
};
Box over_the_box(int places, Progress& progress) {
  constexpr int kDepths = 15;
  const auto &low = rt::kDeflectionMin, &high = rt::kDeflectionMax;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> u(0, 1);
  const auto draw = [&](double a, double b) { return a + (b - a) * u(random); };
  std::array<std::vector<double>, kDepths> errors;
  Box box{error_panel("large deflection: anywhere in its calibration", "depth over the cell's radius"), 0, 0};
  double square = 0;
  int n = 0;
  for (int i = 0; i < places; ++i) {
    rt::DeflectionInput at;
    at.c = std::exp(draw(std::log(low.c), std::log(high.c)));
    at.seat = draw(low.seat, high.seat);
    at.nu = draw(low.nu, high.nu);
    at.prestrain = draw(low.prestrain, high.prestrain);
    sim::MembraneSolution x;
    for (int k = 0; k < kDepths; ++k) {
      at.w = high.w * std::pow((k + 1.0) / kDepths, 1.5);
      if (!sim::solve_membrane({at.c, at.seat, at.nu, at.prestrain}, at.w, 64, x)) {
        break;
      }
      const double error = std::abs(rt::large_deflection(at).force / x.force - 1);
      errors[static_cast<std::size_t>(k)].push_back(error);
      square += error * error;
      box.worst = std::max(box.worst, error);
      ++n;
    }
    progress.step();
  }
  box.rms = std::sqrt(square / n);
  for (const auto& [name, part] : {std::pair{"worst", 1.0}, {"95 of 100", 0.95}, {"median", 0.5}}) {
    Series s{.name = name};
    for (int k = 0; k < kDepths; ++k) {
      auto& e = errors[static_cast<std::size_t>(k)];
      if (e.empty()) {
        continue;
      }
      std::sort(e.begin(), e.end());
      s.x.push_back(high.w * std::pow((k + 1.0) / kDepths, 1.5));
      s.y.push_back(std::max(e[static_cast<std::size_t>(part * static_cast<double>(e.size() - 1))], 1e-5));
    }
    box.panel.series.push_back(std::move(s));
  }
  draw_noticeable(box.panel, 0, high.w);
  return box;
}

// ---- times ----

std::vector<Method> all_methods(bool quick) {
  std::vector<Method> methods;
  add_methods<double>(methods, "double", quick);
  add_methods<float>(methods, "float", quick);
  for (Method& m : methods) {
    m.shipped = m.name == "stable form, double" && m.narrowest == 1e-9 && m.knob[0] == '1';
  }
  return methods;
}

// One time per method of eq. 5, then those of the two laws of a tick: the paper's, the large deflection. In a
// tick a law also gives stiffness, energy, stress and pressure.
auto times_of(const std::vector<Method>& methods, const SceneCell& cell, const Job& job) {
  std::vector<double> depths(256);
  for (std::size_t i = 0; i < depths.size(); ++i) {
    depths[i] = cell.puncture_m * static_cast<double>(i + 1) / static_cast<double>(depths.size());
  }
  std::vector<Timed> timed;
  for (const Method& m : methods) {
    timed.push_back(m.timed);
  }
  for (const auto law : {rt::MembraneParams::Law::paper, rt::MembraneParams::Law::large_deflection}) {
    rt::MembraneParams params = cell.params;
    params.law = law;
    timed.emplace_back([params, depths, cell](std::size_t i) {
      return rt::membrane_law(params, depths[i % depths.size()], cell.R_m, cell.dimple_scale).force_N;
    });
  }
  job.progress.start("times", 1);
  auto times =
      time_interleaved(timed, {.batches = job.quick ? 200 : 1000, .seconds = job.quick ? 2.0 : 20.0});
  job.progress.step();
  return times;
}

// Where each method of eq. 5 errs most.
Table worst_table(const std::vector<Method>& methods) {
  Table worst{.name = "force_worst",
              .columns = {"method", "knob", "worst_relative_error", "zeta", "one_minus_zeta", "wd_over_a"}};
  for (const Method& m : methods) {
    if (m.narrowest == 1e-9) {
      worst.add({m.name, m.knob, m.worst, m.where.c_m / m.where.a_m, narrowness(m.where),
                 m.where.wd_m / m.where.a_m});
    }
  }
  return worst;
}

}  // namespace

Result run_force(const Job& job) {
  const std::array<SceneCell, 2> cells = {cell_of("icsi"), cell_of("zebrafish")};
  const std::vector<Method> methods = all_methods(job.quick);
  const auto times = times_of(methods, cells[0], job);

  std::vector<Work> works;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const Method& m = methods[i];
    works.push_back({m.name, m.knob, m.worst, times[i], m.shipped});
  }
  Figure figure{.name = "force",
                .note =
                    "Error of eq. 5 is the worst of 600 dimples against 60 digits of the printed formula by "
                    "mpmath; 1 = no digit is right. The laws are compared with a large-deflection membrane "
                    "solved for each depth; a cell is undeformed at 0 and gives way at the mark."};
  const Limit half_ulp[] = {{"rounding of double", 1.1e-16}, {"rounding of float", 6e-8}};
  figure.panels.push_back(work_precision("eq. 5, evaluated", "worst relative error", works, half_ulp));

  Table law_table{.name = "force_laws",
                  .columns = {"cell", "law", "relative_error_rms", "worst_relative_error", "worst_at_wd_m",
                              "true_force_rms_N", "puncture_wd_m", "tick_median_ns", "shipped"}};
  const auto all = laws();
  const int points = job.quick ? 24 : 120, places = job.quick ? 60 : 600;
  job.progress.start("laws against the large-deflection equations", 2 * points + places);
  std::vector<Fit> of_oocyte;
  for (const SceneCell& cell : cells) {
    Compared compared = compare(cell, all, points, job.progress);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Fit& f = compared.fits[i];
      // The law with a measured half-width is evaluated by vision, not in the tick.
      const double tick_ns =
          i == 0 ? std::numeric_limits<double>::quiet_NaN() : times[methods.size() + i - 1].median_ns;
      law_table.add({cell.name, all[i].name, f.rms(), f.worst, f.worst_at_m,
                     std::sqrt(f.true_square / f.points), cell.puncture_m, tick_ns, all[i].shipped});
    }
    if (&cell == &cells[0]) {
      of_oocyte = std::move(compared.fits);
    }
    figure.panels.push_back(std::move(compared.panel));
  }
  Box box = over_the_box(places, job.progress);
  figure.panels.push_back(std::move(box.panel));

  Result result;
  result.tables = {work_table("force", "worst_relative_error", works), worst_table(methods),
                   std::move(law_table)};
  result.figures = {std::move(figure)};
  const auto to_hand = [](double error) { return error < kJustNoticeable ? "below" : "above"; };
  result.reading = fmt::format(
      "Eq. 5: {}. Against the simulated oocyte the shipped law errs by {:.1f} % rms, {} what a hand can tell "
      "(8 %), in {:.0f} ns a tick, and by {:.1f} % rms ({:.1f} % at worst) anywhere in its calibration; the "
      "paper's law with its fitted closure errs by {:.0f} %, {} it, in {:.0f} ns.",
      front_sentence(works), 100 * of_oocyte[2].rms(), to_hand(of_oocyte[2].rms()),
      times[methods.size() + 1].median_ns, 100 * box.rms, 100 * box.worst, 100 * of_oocyte[1].rms(),
      to_hand(of_oocyte[1].rms()), times[methods.size()].median_ns);
  return result;
}

}  // namespace punctum::report
