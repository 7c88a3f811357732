// Topic vision: what the contours, the tip and the dimple cost to see, and how well they are seen, on
// simulated frames whose truth is known.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>

#include "rt/forces/membrane.hpp"
#include "tools/report/polyline.hpp"
#include "tools/report/real_frames.hpp"
#include "tools/report/simulated_frames.hpp"
#include "tools/report/topic.hpp"
#include "vision/tracker.hpp"

namespace punctum::report {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

// ---- methods ----

// Sees one frame after the other; what it returns stays valid until the next call.
using Eye = std::function<const vision::Result&(const hal::Frame&)>;

struct Method {
  std::string name;
  std::string knob;  // "nodes {}"
  std::vector<double> values, quick_values;
  std::function<Eye(vision::VisionConfig, double, int width, int height)> make;  // for one injection
  int every = 1;  // frames; more for what sees each frame by itself
  double shipped = kNothing;
  bool whole = true;  // sees all that is asked for, and so may be compared
};

Eye tracker(const vision::VisionConfig& config, int width, int height) {
  auto eye = std::make_shared<vision::Tracker>(config, width, height);
  return [eye](const hal::Frame& frame) -> const vision::Result& { return eye->process(frame); };
}

// One row per method: another way to see is one row more.
std::vector<Method> methods() {
  using vision::VisionConfig;
  const VisionConfig shipped;
  return {
      {"greedy snake",
       "{} nodes",
       {8, 16, 32, 64, 128},
       {16, 64},
       [](VisionConfig c, double nodes, int w, int h) {
         c.refine = false;
         c.snake.nodes = static_cast<int>(nodes);
         return tracker(c, w, h);
       }},
      {"greedy snake (64 nodes)",
       "search +-{} px",
       {1, 2, 4},
       {},
       [](VisionConfig c, double radius, int w, int h) {
         c.refine = false;
         c.snake.nodes = 64;
         c.snake.radius_px = static_cast<int>(radius);
         return tracker(c, w, h);
       }},
      {"closed path",
       "{} angles",
       {128, 192, 256, 384, 512},
       {128, 256, 512},
       [](VisionConfig c, double angles, int w, int h) {
         c.contour_points = static_cast<int>(angles);
         return tracker(c, w, h);
       },
       1,
       static_cast<double>(shipped.contour_points)},
      {"closed path (finer snake)",
       "{} nodes",
       {32, 64, 128},
       {64},
       [](VisionConfig c, double nodes, int w, int h) {
         c.snake.nodes = static_cast<int>(nodes);
         return tracker(c, w, h);
       }},
      {"closed path (outer only)",
       "{} angles",
       {256},
       {256},
       [](VisionConfig c, double angles, int w, int h) {
         c.inner = false;
         c.contour_points = static_cast<int>(angles);
         return tracker(c, w, h);
       },
       1,
       kNothing,
       false},
      {"closed path (started anew)",
       "{} angles",
       {256},
       {256},
       [](const VisionConfig& config, double angles, int w, int h) -> Eye {
         VisionConfig c = config;
         c.contour_points = static_cast<int>(angles);
         auto eye = std::make_shared<std::unique_ptr<vision::Tracker>>();
         return [=](const hal::Frame& frame) -> const vision::Result& {
           *eye = std::make_unique<vision::Tracker>(c, w, h);
           return (*eye)->process(frame);
         };
       },
       12},
  };
}

// ---- errors ----

struct Errors {
  std::vector<double> all;
  void add(double x) {
    if (std::isfinite(x)) all.push_back(x);
  }
  [[nodiscard]] double rms() const {
    double sum = 0;
    for (double x : all) sum += x * x;
    return all.empty() ? kNothing : std::sqrt(sum / static_cast<double>(all.size()));
  }
  [[nodiscard]] double quantile(double q) const {  // of |x|
    if (all.empty()) return kNothing;
    std::vector<double> v;
    for (double x : all) v.push_back(std::abs(x));
    const auto i = static_cast<std::size_t>(q * static_cast<double>(v.size() - 1) + 0.5);
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(i), v.end());
    return v[i];
  }
};

Polyline closed_line(const vision::Contour& contour) {
  std::vector<Point2> points;
  for (const auto& p : contour) points.push_back({p.x, p.y});
  return Polyline(std::move(points), true);
}

struct TrueLines {
  Polyline outer, inner;
};

// rms distance of a contour's points from the true line, um; each distance goes into `each` as well.
double contour_error_um(const vision::Contour& seen, const Polyline& truth, double um, Errors& each,
                        double& worst) {
  double sum = 0;
  worst = 0;
  for (const auto& p : seen) {
    const double d = truth.distance({p.x, p.y}) * um;
    each.add(d);
    sum += d * d;
    worst = std::max(worst, d);
  }
  return std::sqrt(sum / static_cast<double>(seen.size()));
}

// Eq. 5 at what was seen over eq. 5 at what is so, less one: modulus and thickness fall out.
double force_error(double wd_m, double a_m, const FrameTruth& t, double c_m) {
  constexpr double kLeastDepth_m = 3e-6;  // below it no force is rendered that could be felt
  if (t.wd_m < kLeastDepth_m || !(a_m > c_m) || !(t.a_m > c_m)) return kNothing;
  const vision::VisionConfig k;
  const auto force = [&](double w, double a) { return rt::membrane_force(k.E_Pa, k.nu, k.h_m, c_m, w, a); };
  return force(wd_m, a_m) / force(t.wd_m, t.a_m) - 1;
}

// What one method with one setting of its knob made of all frames of one noise level.
struct Trial {
  const Method* method;
  double value;
  double noise;
  Errors outer_frames{}, outer_points{}, inner_frames{}, inner_points{}, tip{}, wd{}, a{}, R{}, force{}, us{};
  Errors outer_stretch[kStretches]{};
  int frames = 0, seen = 0, good = 0;
  double length_px = 0;        // mean of the true outer contour
  vision::Contour in_force{};  // newest outer contour

  [[nodiscard]] std::string knob() const { return fmt::format(fmt::runtime(method->knob), value); }
  [[nodiscard]] bool shipped() const { return value == method->shipped; }

  void score(const vision::Result& r, const FrameTruth& t, const TrueLines& truth, double pixel_m,
             double c_m) {
    constexpr double kGood_px = 2;  // largest error of a contour that counts as found
    const double um = pixel_m * 1e6;
    ++frames;
    seen += r.outer.ok;
    // Unseen, the newest contour stays in force; before the first one, the centre alone is known.
    if (r.outer.ok) in_force = r.outer.contour;
    if (in_force.empty()) in_force = {t.centre};
    const bool moving = t.stretch == Stretch::recoil;
    Errors discarded;
    double worst = 0;
    const double rms = contour_error_um(in_force, truth.outer, um, moving ? discarded : outer_points, worst);
    outer_stretch[static_cast<int>(t.stretch)].add(rms);
    if (!moving) {
      outer_frames.add(rms);
      good += r.outer.ok && worst < kGood_px * um;
    }
    if (!moving && r.inner.ok) {
      inner_frames.add(contour_error_um(r.inner.contour, truth.inner, um, inner_points, worst));
    }
    if (r.needle.ok) tip.add(cv::norm(r.needle.tip - t.tip) * um);
    if (r.undeformed) R.add(r.undeformed->r * um - t.R_m * 1e6);
    if (t.stretch == Stretch::indentation && r.wd_px) {
      wd.add(*r.wd_px * um - t.wd_m * 1e6);
      if (r.a_px) {
        a.add(*r.a_px * um - t.a_m * 1e6);
        force.add(force_error(*r.wd_px * pixel_m, *r.a_px * pixel_m, t, c_m));
      }
    }
  }
};

// ---- limits ----

// Cramer-Rao bound of a contour with so many free modes, when contrast, blur and background are known: the
// normal position of one pixel of edge has the variance 2 sqrt(pi) sigma_p sigma_n^2 / C^2, and the modes
// share the pixels.
constexpr int kModes = 18;
double contour_bound_um(double noise, double length_px, const sim::MicroscopeParams& lens) {
  const double variance =
      2 * std::sqrt(std::numbers::pi) * lens.psf_px * noise * noise / (lens.contrast * lens.contrast);
  return std::sqrt(variance * kModes / length_px) * lens.pixel_m * 1e6;
}

// ---- run time ----

double now_us() {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double clock_overhead_us() {
  Errors pairs;
  for (int i = 0; i < 2001; ++i) {
    const double begin = now_us();
    pairs.add(now_us() - begin);
  }
  return pairs.quantile(0.5);
}

CallTime call_time(const Errors& us, double overhead_us) {
  const auto net_ns = [&](double q) { return std::max(0.0, 1e3 * (us.quantile(q) - overhead_us)); };
  return {.median_ns = net_ns(0.5),
          .p99_9_ns = net_ns(0.999),
          .max_ns = net_ns(1),
          .overhead_ns = 1e3 * overhead_us,
          .batch = 1,
          .batches = static_cast<std::int64_t>(us.all.size())};
}

// Where the shipped tracker's time goes.
struct Stages {
  static constexpr std::pair<const char*, double vision::StageTimes::*> kAll[] = {
      {"prepare", &vision::StageTimes::prepare}, {"needle", &vision::StageTimes::needle},
      {"holder", &vision::StageTimes::holder},   {"erase", &vision::StageTimes::erase},
      {"start", &vision::StageTimes::start},     {"outer", &vision::StageTimes::outer},
      {"inner", &vision::StageTimes::inner},     {"measure", &vision::StageTimes::measure},
      {"contact", &vision::StageTimes::contact}, {"total", &vision::StageTimes::total}};
  Errors following[std::size(kAll)], starting[std::size(kAll)];

  void add(const vision::StageTimes& us) {
    for (std::size_t i = 0; i < std::size(kAll); ++i) {
      (us.start > 0 ? starting : following)[i].add(us.*kAll[i].second);
    }
  }
};

// ---- the frames ----

std::vector<InjectionPlan> plans(bool quick) {
  const std::vector<double> noises = quick ? std::vector<double>{2, 5} : std::vector<double>{2, 5, 10};
  struct Aim {
    std::uint64_t seed;
    double aim_m, tilt_rad;
  };
  const std::vector<Aim> aims = quick ? std::vector<Aim>{{11, 3e-6, 0.03}}
                                      : std::vector<Aim>{{11, 3e-6, 0.03}, {12, -6e-6, -0.05}, {13, 0, 0}};
  std::vector<InjectionPlan> all;
  for (double noise : noises) {
    for (const Aim& aim : aims) {
      InjectionPlan p;
      p.seed = aim.seed;
      p.noise = noise;
      p.aim_m = aim.aim_m;
      p.tilt_rad = aim.tilt_rad;
      p.approach_m_s = 40e-6;
      if (quick) {
        p.indentation_m_s = 20e-6;
        p.inside_s = 0.3;
      }
      all.push_back(p);
    }
  }
  return all;
}

Table main_table() {
  Table t{.name = "vision", .columns = {"method",
                                        "knob",
                                        "noise_grey",
                                        "frames",
                                        "outer_rms_um",
                                        "outer_p95_um",
                                        "inner_rms_um",
                                        "inner_p95_um",
                                        "tip_rms_um",
                                        "wd_rms_um",
                                        "a_rms_um",
                                        "R_rms_um",
                                        "force_rms_rel",
                                        "seen_share",
                                        "within_2px_share",
                                        "approach_rms_um",
                                        "indentation_rms_um",
                                        "recoil_rms_um",
                                        "inside_rms_um",
                                        "bound_um"}};
  for (const auto& c : time_columns()) t.columns.push_back(c);
  t.columns.insert(t.columns.end(), {"on_front", "shipped"});
  t.shown = {"method",       "knob",       "noise_grey", "outer_rms_um",  "outer_p95_um",
             "inner_rms_um", "tip_rms_um", "wd_rms_um",  "force_rms_rel", "median_ns",
             "p99_9_ns",     "on_front",   "shipped"};
  return t;
}

}  // namespace

Result run_vision(const Job& job) {
  const std::vector<Method> all = methods();
  const std::vector<InjectionPlan> injections = plans(job.quick);
  std::vector<double> noises;
  for (const auto& p : injections) {
    if (noises.empty() || noises.back() != p.noise) noises.push_back(p.noise);
  }
  std::vector<std::vector<Trial>> trials;  // per noise level
  for (double noise : noises) {
    trials.emplace_back();
    for (const Method& m : all) {
      for (double value : job.quick ? m.quick_values : m.values) {
        trials.back().push_back({.method = &m, .value = value, .noise = noise});
      }
    }
  }

  const double overhead_us = clock_overhead_us();
  Stages stages;
  double first_us = kNothing;
  job.progress.start("frames", static_cast<std::int64_t>(injections.size()));
  for (const InjectionPlan& plan : injections) {
    const SimulatedInjection injection = simulate_injection(plan);
    auto& tried = trials[static_cast<std::size_t>(std::find(noises.begin(), noises.end(), plan.noise) -
                                                  noises.begin())];
    std::vector<Eye> eyes;
    for (Trial& t : tried) {
      t.in_force.clear();
      eyes.push_back(
          t.method->make(injection.config(), t.value, injection.lens.width, injection.lens.height));
    }
    for (std::size_t f = 0; f < injection.truth.size(); ++f) {
      const FrameTruth& truth = injection.truth[f];
      const TrueLines lines{closed_line(truth.outer), closed_line(truth.inner)};
      // In turns and changing order: what disturbs the machine hits all alike.
      for (std::size_t k = 0; k < eyes.size(); ++k) {
        const std::size_t i = (k + f) % eyes.size();
        Trial& trial = tried[i];
        if (f % static_cast<std::size_t>(trial.method->every) != 0) continue;
        const double begin = now_us();
        const vision::Result& seen = eyes[i](injection.frame(f));
        const double spent = now_us() - begin;
        if (f > 0 || trial.method->every > 1) trial.us.add(spent);  // the first frame is a start
        trial.length_px = 2 * std::numbers::pi * truth.R_m / injection.lens.pixel_m;
        trial.score(seen, truth, lines, injection.lens.pixel_m, injection.needle.radius_m);
        if (trial.shipped()) {
          stages.add(seen.us);
          if (f == 0) first_us = spent;
        }
      }
    }
    job.progress.step();
  }

  Result out;
  Table table = main_table();
  Figure figure{.name = "vision", .panels = {}};
  const sim::MicroscopeParams lens;
  std::vector<Work> nominal;
  Panel over_noise{.title = "shipped settings over noise",
                   .x_label = "noise of the picture [grey levels]",
                   .y_label = "outer contour, rms error [um]",
                   .log_x = true,
                   .log_y = true};
  const auto add_point = [&](const std::string& name, double x, double y, Style style) {
    auto s = std::find_if(over_noise.series.begin(), over_noise.series.end(),
                          [&](const Series& other) { return other.name == name; });
    if (s == over_noise.series.end()) {
      s = over_noise.series.insert(s, Series{.name = name, .x = {}, .y = {}, .style = style});
    }
    s->x.push_back(x);
    s->y.push_back(y);
  };
  const Trial* shipped_trial = nullptr;
  const Trial* paper_trial = nullptr;
  for (const auto& tried : trials) {
    std::vector<Work> works;
    for (const Trial& t : tried) {
      works.push_back({.method = t.method->name,
                       .knob = t.knob(),
                       .error = t.outer_frames.rms(),
                       .time = call_time(t.us, overhead_us),
                       .shipped = t.shipped()});
    }
    std::vector<Work> compared;
    for (std::size_t i = 0; i < tried.size(); ++i) {
      if (tried[i].method->whole) compared.push_back(works[i]);
    }
    const double noise = tried.front().noise;
    const double bound = contour_bound_um(noise, tried.front().length_px, lens);
    for (std::size_t i = 0; i < tried.size(); ++i) {
      const Trial& t = tried[i];
      const double still = static_cast<double>(t.outer_frames.all.size());
      Row row{t.method->name,
              t.knob(),
              noise,
              t.frames,
              t.outer_frames.rms(),
              t.outer_points.quantile(0.95),
              t.inner_frames.rms(),
              t.inner_points.quantile(0.95),
              t.tip.rms(),
              t.wd.rms(),
              t.a.rms(),
              t.R.rms(),
              t.force.rms(),
              static_cast<double>(t.seen) / t.frames,
              t.good / still,
              t.outer_stretch[0].rms(),
              t.outer_stretch[1].rms(),
              t.outer_stretch[2].rms(),
              t.outer_stretch[3].rms(),
              bound};
      for (const auto& c : time_cells(works[i].time)) row.push_back(c);
      const bool front = t.method->whole && better_than(works[i], compared) == nullptr;
      const bool paper = t.method == &all.front() && t.value == 16;
      row.emplace_back(front);
      row.emplace_back(t.shipped());
      if (front || t.shipped() || paper) table.shown_rows.push_back(table.rows.size());
      table.add(std::move(row));
      if (t.shipped()) add_point("closed path (shipped)", noise, works[i].error, Style::line_points);
      if (paper) add_point("greedy snake (16 nodes)", noise, works[i].error, Style::line_points);
      if (&tried == &trials.front() && t.shipped()) shipped_trial = &t;
      if (&tried == &trials.front() && paper) paper_trial = &t;
    }
    add_point(fmt::format("Cramer-Rao, {} modes", kModes), noise, bound, Style::limit);
    add_point("one pixel", noise, lens.pixel_m * 1e6, Style::limit);
    const Limit limits[] = {{"one pixel", lens.pixel_m * 1e6},
                            {fmt::format("Cramer-Rao, {} modes", kModes), bound}};
    figure.panels.push_back(work_precision(fmt::format("noise {} grey levels", noise),
                                           "outer contour, rms error [um]", compared, limits));
    if (&tried == &trials.front()) nominal = compared;
  }
  figure.panels.push_back(std::move(over_noise));
  figure.note = fmt::format(
      "Rms over frames of approach, indentation and inside (not of the quarter second of recoil), hidden "
      "arcs "
      "included; a frame in which nothing is seen counts with the contour last seen. Cramer-Rao: "
      "sqrt(2 sqrt(pi) s_p s_n^2 / C^2 K / L) with blur s_p = {} px, contrast C = {}, K = {} modes over L = "
      "{:.0f} "
      "px, all but the modes known.",
      lens.psf_px, lens.contrast, kModes, shipped_trial->length_px);
  out.tables.push_back(std::move(table));
  out.figures.push_back(std::move(figure));

  Table where{.name = "vision_stages",
              .columns = {"stage", "following_median_us", "following_p99_9_us", "starting_median_us"}};
  for (std::size_t i = 0; i < std::size(Stages::kAll); ++i) {
    where.add({Stages::kAll[i].first, stages.following[i].quantile(0.5), stages.following[i].quantile(0.999),
               stages.starting[i].quantile(0.5)});
  }
  out.tables.push_back(std::move(where));
  const RealFrames real = see_real_frames(job.quick, job.progress);
  if (real.table) out.tables.push_back(*real.table);

  const auto time_of = [&](const Trial* t) { return call_time(t->us, overhead_us).median_ns; };
  out.reading = fmt::format(
      "At noise {:g} the shipped tracker sees the outer membrane to {:.2f} um rms ({:.1f} times the "
      "Cramer-Rao "
      "bound) in {:.1f} ms a frame, a start takes {:.0f} ms; the paper's 16-node snake errs by {:.2f} um in "
      "{:.1f} ms; what is seen puts the force {:.0f} % off; on this front: {}. {}",
      noises.front(), shipped_trial->outer_frames.rms(),
      shipped_trial->outer_frames.rms() / contour_bound_um(noises.front(), shipped_trial->length_px, lens),
      1e-6 * time_of(shipped_trial), 1e-3 * first_us, paper_trial->outer_frames.rms(),
      1e-6 * time_of(paper_trial), 100 * shipped_trial->force.rms(), front_sentence(nominal), real.said);
  return out;
}

}  // namespace punctum::report
