// Topic vision: what it costs to see the contours, the tip and the dimple, and how well they are seen, on
// simulated frames whose truth is known.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>

#include "tools/report/foreign_frames.hpp"
#include "tools/report/real_frames.hpp"
#include "tools/report/simulated_frames.hpp"
#include "tools/report/topic.hpp"
#include "tools/report/vision_phases.hpp"
#include "tools/report/vision_trials.hpp"

namespace punctum::report {

namespace {

double bound_um(double noise, double length_px, const sim::MicroscopeParams& lens) {
  return contour_bound_px(noise, length_px, lens.psf_px, lens.contrast) * lens.pixel_m * 1e6;
}

double now_us() {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double clock_overhead_us() {
  Sample pairs;
  for (int i = 0; i < 2001; ++i) {
    const double begin = now_us();
    pairs.add(now_us() - begin);
  }
  return pairs.quantile(0.5);
}

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

std::vector<ForeignPlan> foreign_plans(bool quick) {
  constexpr int kFirst = 100;  // the renderer's seeds below are there to tune with
  std::vector<ForeignPlan> all;
  for (const double noise : quick ? std::vector<double>{5} : std::vector<double>{2, 5, 10, 20}) {
    for (int seed = kFirst; seed < kFirst + (quick ? 1 : 3); ++seed) {
      all.push_back({.seed = seed, .noise = noise, .frames = quick ? 40 : 80});
    }
  }
  return all;
}

Table main_table(const std::string& name) {
  Table t{.name = name, .columns = {"method",
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
  for (const auto& c : time_columns()) {
    t.columns.push_back(c);
  }
  t.columns.insert(t.columns.end(), {"on_front", "shipped"});
  t.shown = {"method",       "knob",       "noise_grey", "outer_rms_um",  "outer_p95_um",
             "inner_rms_um", "tip_rms_um", "wd_rms_um",  "force_rms_rel", "median_ns",
             "p99_9_ns",     "on_front",   "shipped"};
  return t;
}

// ---- measuring ----

struct Measurement {
  std::vector<VisionMethod> methods;
  std::vector<std::vector<Trial>> trials{};  // per noise level
  StageSamples stages{};
  double overhead_us = 0;          // of reading the clock
  double first_us = std::nan("");  // the shipped tracker's first frame of the last injection
};

// Those of a noise level, new if there are none.
std::vector<Trial>& trials_of(Measurement& m, double noise, bool quick) {
  const auto found = std::find_if(m.trials.begin(), m.trials.end(),
                                  [noise](const std::vector<Trial>& t) { return t.front().noise == noise; });
  if (found != m.trials.end()) {
    return *found;
  }
  m.trials.emplace_back();
  for (const VisionMethod& method : m.methods) {
    for (double value : quick ? method.quick_values : method.values) {
      m.trials.back().push_back({.method = &method, .value = value, .noise = noise});
    }
  }
  return m.trials.back();
}

double length_px(const vision::Contour& closed) {
  double sum = 0;
  for (std::size_t i = 0; i < closed.size(); ++i) {
    sum += cv::norm(closed[(i + 1) % closed.size()] - closed[i]);
  }
  return sum;
}

// All methods see the frames of one injection.
void observe(const DrawnInjection& injection, bool quick, Measurement& m) {
  std::vector<Trial>& trials = trials_of(m, injection.lens.noise, quick);
  std::vector<Observer> observers;
  for (Trial& t : trials) {
    t.newest.clear();
    observers.push_back(
        t.method->make(injection.config(), t.value, injection.lens.width, injection.lens.height));
  }
  for (std::size_t f = 0; f < injection.truth.size(); ++f) {
    const FrameTruth& truth = injection.truth[f];
    const TrueLines lines{vision::Polyline(truth.outer, true), vision::Polyline(truth.inner, true)};
    // The methods take turns in changing order, so that a disturbance of the machine hits all alike.
    for (std::size_t k = 0; k < observers.size(); ++k) {
      const std::size_t i = (k + f) % observers.size();
      Trial& trial = trials[i];
      if (f % static_cast<std::size_t>(trial.method->every) != 0) {
        continue;
      }
      const double begin = now_us();
      const vision::Result& seen = observers[i](injection.frame(f));
      const double spent = now_us() - begin;
      if (f > 0 || trial.method->every > 1) {
        trial.us.add(spent);  // the first frame is a start
      }
      trial.length_px = length_px(truth.outer);
      trial.score(seen, truth, lines, injection.lens.pixel_m, injection.needle.radius_m);
      if (trial.shipped()) {
        m.stages.add(seen.us);
        if (f == 0) {
          m.first_us = spent;
        }
      }
    }
  }
}

// ---- tables and figures ----

bool is_paper(const Trial& t, const Measurement& m) {
  return t.method == &m.methods.front() && t.value == 16;
}

// Of the lowest noise level.
template <class Which>
const Trial& trial_that(const Measurement& m, const Which& which) {
  return *std::find_if(m.trials.front().begin(), m.trials.front().end(), which);
}

std::vector<Work> works_of(const std::vector<Trial>& trials, double overhead_us) {
  std::vector<Work> works;
  for (const Trial& t : trials) {
    works.push_back({.method = t.method->name,
                     .knob = t.knob(),
                     .error = t.outer_frames.rms(),
                     .time = call_time(t.us, overhead_us),
                     .shipped = t.shipped()});
  }
  return works;
}

// Those that look for everything.
std::vector<Work> comparable(const std::vector<Trial>& trials, const std::vector<Work>& works) {
  std::vector<Work> out;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (trials[i].method->complete) {
      out.push_back(works[i]);
    }
  }
  return out;
}

Row row_of(const Trial& t, double bound_um) {
  return {t.method->name,
          t.knob(),
          t.noise,
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
          static_cast<double>(t.good) / static_cast<double>(t.outer_frames.all.size()),
          t.outer_stretch[0].rms(),
          t.outer_stretch[1].rms(),
          t.outer_stretch[2].rms(),
          t.outer_stretch[3].rms(),
          bound_um};
}

struct Output {
  Figure figure{.name = "vision", .panels = {}};
  Panel over_noise{.title = "shipped settings over noise",
                   .x_label = "noise of the picture [grey levels]",
                   .y_label = "outer contour, rms error [um]",
                   .log_x = true,
                   .log_y = true};

  // A row per trial into `table`, and a panel per noise level. whose: the frames; empty: the simulated
  // station's.
  void add(const Measurement& m, const std::string& whose, Table& table);

 private:
  void add_noise_level(const std::vector<Trial>& trials, const Measurement& m, const std::string& whose,
                       Table& table);
  void add_point(const std::string& name, double x, double y, Style style);
};

void Output::add_point(const std::string& name, double x, double y, Style style) {
  auto s = std::find_if(over_noise.series.begin(), over_noise.series.end(),
                        [&](const Series& other) { return other.name == name; });
  if (s == over_noise.series.end()) {
    s = over_noise.series.insert(s, Series{.name = name, .x = {}, .y = {}, .style = style});
  }
  s->x.push_back(x);
  s->y.push_back(y);
}

void Output::add(const Measurement& m, const std::string& whose, Table& table) {
  for (const auto& trials : m.trials) {
    add_noise_level(trials, m, whose, table);
  }
}

void Output::add_noise_level(const std::vector<Trial>& trials, const Measurement& m, const std::string& whose,
                             Table& table) {
  const sim::MicroscopeParams lens;  // either renderer's
  const std::vector<Work> works = works_of(trials, m.overhead_us), compared = comparable(trials, works);
  const double noise = trials.front().noise, pixel_um = lens.pixel_m * 1e6;
  const double bound = bound_um(noise, trials.front().length_px, lens);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Trial& t = trials[i];
    Row row = row_of(t, bound);
    for (const auto& c : time_cells(works[i].time)) {
      row.push_back(c);
    }
    const bool front = t.method->complete && better_than(works[i], compared) == nullptr;
    row.emplace_back(front);
    row.emplace_back(t.shipped());
    if (front || t.shipped() || is_paper(t, m)) {
      table.shown_rows.push_back(table.rows.size());
    }
    table.add(std::move(row));
    if (t.shipped()) {
      add_point("closed path (shipped)" + whose, noise, works[i].error, Style::line_points);
    }
    if (is_paper(t, m)) {
      add_point("the paper's method (16 nodes)" + whose, noise, works[i].error, Style::line_points);
    }
  }
  const std::string bound_name = fmt::format("Cramer-Rao, {} modes", kContourModes);
  if (whose.empty()) {
    add_point(bound_name, noise, bound, Style::limit);
    add_point("one pixel", noise, pixel_um, Style::limit);
  }
  const Limit limits[] = {{"one pixel", pixel_um}, {bound_name, bound}};
  figure.panels.push_back(work_precision(fmt::format("noise {} grey levels{}", noise, whose),
                                         "outer contour, rms error [um]", compared, limits));
}

Table stages_table(const StageSamples& stages) {
  Table t{.name = "vision_stages",
          .columns = {"stage", "following_median_us", "following_p99_9_us", "starting_median_us"}};
  for (std::size_t i = 0; i < std::size(StageSamples::kAll); ++i) {
    t.add({StageSamples::kAll[i].first, stages.following[i].quantile(0.5),
           stages.following[i].quantile(0.999), stages.starting[i].quantile(0.5)});
  }
  return t;
}

std::string reading(const Measurement& m, const Trial& shipped, const Trial& paper,
                    const sim::MicroscopeParams& lens, const std::string& others_frames) {
  const auto time_ns = [&m](const Trial& t) { return call_time(t.us, m.overhead_us).median_ns; };
  const auto& lowest_noise = m.trials.front();
  const std::vector<Work> nominal = comparable(lowest_noise, works_of(lowest_noise, m.overhead_us));
  return fmt::format(
      "At noise {:g} the shipped tracker sees the outer membrane to {:.2f} um rms ({:.1f} times the "
      "Cramer-Rao "
      "bound) in {:.1f} ms a frame, a start takes {:.0f} ms; the paper's method, a snake of 16 nodes, errs "
      "by {:.2f} um in "
      "{:.1f} ms; what is seen puts the force {:.0f} % off; on this front: {}. {}",
      shipped.noise, shipped.outer_frames.rms(),
      shipped.outer_frames.rms() / bound_um(shipped.noise, shipped.length_px, lens), 1e-6 * time_ns(shipped),
      1e-3 * m.first_us, paper.outer_frames.rms(), 1e-6 * time_ns(paper), 100 * shipped.force.rms(),
      front_sentence(nominal), others_frames);
}

std::string foreign_reading(const Measurement& m, const std::string& missing) {
  std::vector<std::string> seen;
  for (const auto& trials : m.trials) {
    const auto shipped =
        std::find_if(trials.begin(), trials.end(), [](const Trial& t) { return t.shipped(); });
    seen.push_back(fmt::format("{:.2f} um at noise {:g}", shipped->outer_frames.rms(), shipped->noise));
  }
  if (!missing.empty()) {
    seen.push_back("not (all) drawn: " + missing);
  }
  return fmt::format("Frames of another renderer: {}. ", fmt::join(seen, ", "));
}

constexpr int kSequencesOfAllMethods = 3;  // of each noise; the others are for the phases

// Returns why the frames of another renderer were not seen; empty: they were.
std::string observe_foreign(const Job& job, Measurement& m, PhaseScores& phases) {
  if (!job.frames.empty()) {
    const std::vector<ForeignFolder> folders = foreign_folders(job.frames);
    job.progress.start("another renderer", static_cast<std::int64_t>(folders.size()));
    std::map<PictureKind, int> seen;
    for (const ForeignFolder& f : folders) {
      DrawnInjection injection = read_foreign(f.folder);
      injection.lens.noise = f.kind.noise;
      phases.see(f.kind, injection);
      if (f.kind.name == fmt::format("noise-{:g}", f.kind.noise) &&
          ++seen[f.kind] <= (job.quick ? 1 : kSequencesOfAllMethods)) {
        observe(injection, job.quick, m);
      }
      job.progress.step();
    }
    return "";
  }
  const std::vector<ForeignPlan> injections = foreign_plans(job.quick);
  job.progress.start("another renderer", static_cast<std::int64_t>(injections.size()));
  for (const ForeignPlan& plan : injections) {
    const auto injection = foreign_injection(plan);
    if (!injection) {
      return injection.error();
    }
    observe(*injection, job.quick, m);
    phases.see({"another", fmt::format("noise-{:g}", plan.noise), plan.noise, injection->lens.psf_px},
               *injection);
    job.progress.step();
  }
  return {};
}

// The station's own pictures, as many as a share of right ones needs.
void observe_phases(const Job& job, PhaseScores& phases) {
  const std::vector<double> noises = job.quick ? std::vector<double>{5} : std::vector<double>{2, 5, 10, 20};
  const int seeds = job.quick ? 1 : 5;
  job.progress.start("phases", static_cast<std::int64_t>(noises.size()) * seeds);
  for (const double noise : noises) {
    for (int k = 0; k < seeds; ++k) {
      InjectionPlan plan;
      plan.seed = 21 + static_cast<std::uint64_t>(k);
      plan.noise = noise;
      plan.aim_m = 3e-6 * (k - 2);
      plan.tilt_rad = 0.02 * (k - 2);
      const SimulatedInjection injection = simulate_injection(plan);
      phases.see({"station", fmt::format("noise-{:g}", noise), noise, injection.lens.psf_px}, injection);
      job.progress.step();
    }
  }
}

}  // namespace

Result run_vision(const Job& job) {
  if (!job.frames.empty() && foreign_folders(job.frames).empty()) {
    throw std::runtime_error(
        fmt::format("--frames: {}: holds no noise-N[,KEY=VALUE]/SEED/truth.json", job.frames.string()));
  }
  const std::vector<InjectionPlan> injections = plans(job.quick);
  Measurement m{.methods = vision_methods(), .overhead_us = clock_overhead_us()}, foreign = m;
  job.progress.start("frames", static_cast<std::int64_t>(injections.size()));
  for (const InjectionPlan& plan : injections) {
    observe(simulate_injection(plan), job.quick, m);
    job.progress.step();
  }
  PhaseScores phases;
  observe_phases(job, phases);
  const std::string missing = observe_foreign(job, foreign, phases);

  const sim::MicroscopeParams lens;
  const Trial& shipped = trial_that(m, [](const Trial& t) { return t.shipped(); });
  const Trial& paper = trial_that(m, [&m](const Trial& t) { return is_paper(t, m); });
  Output output;
  Table table = main_table("vision"), foreign_table = main_table("vision_foreign");
  output.add(m, "", table);
  output.add(foreign, ", another renderer", foreign_table);
  Figure& figure = output.figure;
  figure.panels.push_back(std::move(output.over_noise));
  figure.note = fmt::format(
      "Rms over frames of approach, indentation and inside (not of the quarter second of recoil), hidden "
      "arcs "
      "included; a frame without a contour counts with the newest one before it. Cramer-Rao: "
      "sqrt(2 sqrt(pi) s_p s_n^2 / C^2 K / L) with blur s_p = {} px, contrast C = {}, K = {} modes over L = "
      "{:.0f} "
      "px, all but the modes known.",
      lens.psf_px, lens.contrast, kContourModes, shipped.length_px);
  const RealFrames real = see_real_frames(job.quick, job.progress);
  Result out;
  out.tables = {std::move(table), stages_table(m.stages)};
  if (!foreign_table.rows.empty()) {
    out.tables.push_back(std::move(foreign_table));
  }
  for (Table& t : phases.tables()) {
    out.tables.push_back(std::move(t));
  }
  if (real.table) {
    out.tables.push_back(*real.table);
  }
  out.figures = {std::move(figure), phases.figure()};
  out.reading = reading(m, shipped, paper, lens,
                        foreign_reading(foreign, missing) + phases.reading() + " " + real.summary);
  return out;
}

}  // namespace punctum::report
