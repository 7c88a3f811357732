// Topic velocity: the hand's velocity from its quantised positions, error, lag and noise against run time.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "tools/report/topic.hpp"
#include "tools/report/velocity_methods.hpp"
#include "tools/report/velocity_motions.hpp"

namespace punctum::report {

Result run_velocity(const Job& job);

namespace {

using hal::Vec3;
using rt::VelocityParams;

constexpr double kEncoderStep_m = 0.03e-3;
constexpr double kMm = 1e3;
constexpr double kDamping_Ns_m = 4;  // the damping inside the cell: it turns the noise at rest into a force
constexpr double kMass_kg = 0.075, kHandleDamping_Ns_m = 0.1;

// A method with a value of its knob, ready to be run on any samples.
struct Candidate {
  std::string method, knob;
  bool shipped = false;
  std::function<std::function<Vec3(const EncoderRecord&, std::size_t)>(const EncoderSampling&)> begin{};
  std::function<Timed(const EncoderSampling&, const std::shared_ptr<const EncoderRecord>&)> timed{};
};

template <class Real>
struct Samples {
  std::vector<Eigen::Matrix<Real, 3, 1>> position_m;
  std::vector<Real> dt_s;
};

// make(sampling) returns the method, whose step(position, interval) is in Real.
template <class Real = double, class Make>
Candidate candidate(std::string method, std::string knob, Make make) {
  Candidate c{.method = std::move(method), .knob = std::move(knob)};
  c.begin = [make](const EncoderSampling& sampling) {
    return [m = make(sampling)](const EncoderRecord& r, std::size_t k) mutable {
      return Vec3(m.step(r.position_m[k].template cast<Real>(), static_cast<Real>(r.dt_s[k]))
                      .template cast<double>());
    };
  };
  c.timed = [make](const EncoderSampling& sampling, const std::shared_ptr<const EncoderRecord>& r) {
    auto samples = std::make_shared<Samples<Real>>();
    const std::size_t count = std::size_t{1} << static_cast<unsigned>(std::log2(r->dt_s.size()));
    for (std::size_t k = 0; k < count; ++k) {
      samples->position_m.push_back(r->position_m[k].template cast<Real>());
      samples->dt_s.push_back(static_cast<Real>(r->dt_s[k]));
    }
    return Timed([m = make(sampling), samples, mask = count - 1](std::size_t i) mutable {
      return m.step(samples->position_m[i & mask], samples->dt_s[i & mask]);
    });
  };
  return c;
}

Candidate with_known_force(std::string knob, double mass_kg) {
  const auto make = [mass_kg](const EncoderSampling& s) {
    VelocityParams p;
    p.d_m = s.step_m;
    return ForceKalman(p, 1 / s.rate_Hz, mass_kg, kHandleDamping_Ns_m);
  };
  Candidate c{.method = "Kalman told the force", .knob = std::move(knob)};
  c.begin = [make](const EncoderSampling& sampling) {
    return [m = make(sampling)](const EncoderRecord& r, std::size_t k) mutable {
      return m.step(r.position_m[k], r.dt_s[k], r.force_N[k == 0 ? 0 : k - 1]);
    };
  };
  c.timed = [make](const EncoderSampling& sampling, const std::shared_ptr<const EncoderRecord>& r) {
    const std::size_t count = std::size_t{1} << static_cast<unsigned>(std::log2(r->dt_s.size()));
    return Timed([m = make(sampling), r, mask = count - 1](std::size_t i) mutable {
      const std::size_t k = i & mask;
      return m.step(r->position_m[k], r->dt_s[k], r->force_N[k]);
    });
  };
  return c;
}

VelocityParams params(const EncoderSampling& s, double jerk_m_s3_rtHz) {
  VelocityParams p;
  p.d_m = s.step_m;
  p.jerk_m_s3_rtHz = jerk_m_s3_rtHz;
  return p;
}

// A window that is as long in time at every rate, as in the program.
VelocityParams window(const EncoderSampling& s, int at_1_kHz, double band_steps = 1, double smooth_s = 0) {
  VelocityParams p;
  p.d_m = band_steps * s.step_m;
  p.window = at_1_kHz;
  p.smooth_s = smooth_s;
  return rt::at_rate(p, s.rate_Hz);
}

std::vector<Candidate> candidates() {
  std::vector<Candidate> all;
  for (const std::size_t stride : {1U, 2U, 4U, 8U, 16U, 32U}) {
    all.push_back(candidate("finite difference", fmt::format("stride {}", stride),
                            [stride](const EncoderSampling&) { return Difference<double>(stride); }));
  }
  for (const double cutoff : {10.0, 20.0, 30.0, 50.0, 80.0, 150.0}) {
    all.push_back(candidate("EMA", fmt::format("{:g} Hz", cutoff),
                            [cutoff](const EncoderSampling&) { return Ema<double>(cutoff); }));
  }
  for (const int n : {4, 8, 16, 32}) {
    all.push_back(candidate("FOAW", fmt::format("window {}", n),
                            [n](const EncoderSampling& s) { return rt::Foaw(window(s, n)); }));
  }
  all.push_back(candidate<float>("FOAW float", "window 16", [](const EncoderSampling& s) {
    return rt::BasicFoaw<float>(window(s, 16));
  }));
  for (const double tau_ms : {1.0, 3.0}) {
    all.push_back(candidate(
        "FOAW and low-pass", fmt::format("window 16, {:g} ms", tau_ms),
        [tau_ms](const EncoderSampling& s) { return SmoothedFoaw(window(s, 16, 1, 1e-3 * tau_ms)); }));
  }
  all.push_back(candidate("FOAW and low-pass", "window 16, +-1.25 d, 3 ms",
                          [](const EncoderSampling& s) { return SmoothedFoaw(window(s, 16, 1.25, 3e-3)); }));
  const VelocityParams shipped;
  for (const double jerk : {0.5, 1.0, 2.0, 5.0, 12.0, 30.0}) {
    all.push_back(candidate("Kalman", fmt::format("jerk {:g}", jerk), [jerk](const EncoderSampling& s) {
      return rt::Kalman(params(s, jerk), 1 / s.rate_Hz);
    }));
    all.back().shipped = shipped.method == VelocityParams::Method::kalman && jerk == shipped.jerk_m_s3_rtHz;
  }
  const double jerk = shipped.jerk_m_s3_rtHz;
  all.push_back(candidate<float>(
      "Kalman float", fmt::format("jerk {:g}", jerk),
      [jerk](const EncoderSampling& s) { return rt::BasicKalman<float>(params(s, jerk), 1 / s.rate_Hz); }));
  all.push_back(candidate("Kalman, covariance kept", fmt::format("jerk {:g}", jerk),
                          [jerk](const EncoderSampling& s) { return CovarianceKalman(params(s, jerk)); }));
  all.push_back(with_known_force("mass exact", kMass_kg));
  all.push_back(with_known_force("mass x 2", 2 * kMass_kg));
  all.push_back(with_known_force("mass / 2", kMass_kg / 2));
  return all;
}

double error_m_s(const Candidate& c, const EncoderSampling& sampling, const EncoderRecord& r) {
  auto step = c.begin(sampling);
  return rms_error_m_s(r, [&](std::size_t k) { return step(r, k); });
}

// Delay and gain of the estimate at a sinusoid.
struct Lag {
  double lag_s = 0, gain = 0;
};
Lag lag(const Candidate& c, const EncoderSampling& sampling, double frequency_Hz, double amplitude_m) {
  const double T = 1 / sampling.rate_Hz, omega = 2 * std::numbers::pi * frequency_Hz;
  EncoderRecord r;
  for (int k = 0; k < 3 * sampling.rate_Hz; ++k) {
    const double x = amplitude_m * std::sin(omega * k * T);
    r.position_m.push_back(Vec3::Constant(sampling.step_m * std::floor(x / sampling.step_m + 0.5)));
    r.force_N.push_back(Vec3::Zero());
    r.dt_s.push_back(T);
  }
  auto step = c.begin(sampling);
  double in_phase = 0, behind = 0;
  int count = 0;
  for (std::size_t k = 0; k < r.dt_s.size(); ++k) {
    const double t = static_cast<double>(k) * T, v = step(r, k).x();
    if (t < 1) {
      continue;
    }
    in_phase += v * std::cos(omega * t);
    behind += v * std::sin(omega * t);
    ++count;
  }
  return {std::atan2(behind, in_phase) / omega,
          2 * std::hypot(in_phase, behind) / count / (amplitude_m * omega)};
}

// Results of one candidate at one sampling.
struct Measured {
  std::vector<double> errors_m_s;  // in the order of kMotions
  Lag slow, tremor;
  [[nodiscard]] double of(KnownMotion m) const {
    for (std::size_t i = 0; i < kMotions.size(); ++i) {
      if (kMotions[i].motion == m) {
        return errors_m_s[i];
      }
    }
    return std::nan("");
  }
};

Measured measure(const Candidate& c, const EncoderSampling& sampling,
                 std::span<const EncoderRecord> records) {
  Measured m;
  for (const EncoderRecord& r : records) {
    m.errors_m_s.push_back(error_m_s(c, sampling, r));
  }
  m.slow = lag(c, sampling, 2, 1e-3);
  m.tremor = lag(c, sampling, 10, 0.35e-3);
  return m;
}

std::vector<EncoderRecord> records_of(const EncoderSampling& sampling) {
  std::vector<EncoderRecord> all;
  for (const NamedMotion& m : kMotions) {
    all.push_back(record(m.motion, sampling));
  }
  return all;
}

std::vector<std::string> measured_columns() {
  std::vector<std::string> columns;
  for (const NamedMotion& m : kMotions) {
    columns.push_back(std::string(m.name) + "_error_mm_s");
  }
  for (const char* c : {"rest_force_mN", "lag_2Hz_ms", "lag_10Hz_ms", "gain_10Hz"}) {
    columns.emplace_back(c);
  }
  return columns;
}

Row measured_cells(const Measured& m) {
  Row row;
  for (const double e : m.errors_m_s) {
    row.emplace_back(kMm * e);
  }
  row.emplace_back(kMm * kDamping_Ns_m * m.of(KnownMotion::hold));
  row.emplace_back(1e3 * m.slow.lag_s);
  row.emplace_back(1e3 * m.tremor.lag_s);
  row.emplace_back(m.tremor.gain);
  return row;
}

void append(Row& row, Row more) {
  for (Cell& c : more) {
    row.push_back(std::move(c));
  }
}
void append(std::vector<std::string>& to, const std::vector<std::string>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

// One line per method, over its knob.
Panel noise_against_lag(std::span<const Candidate> all, std::span<const Measured> measured) {
  Panel p{.title = "1 kHz: noise at rest against lag",
          .x_label = "lag behind 10 Hz [ms]",
          .y_label = "rms velocity of a hand at rest, encoder flickering [mm/s]",
          .log_y = true};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool same = all[i].method == "Kalman told the force" || all[i].method == "Kalman, covariance kept";
    if (same || all[i].method.ends_with("float")) {
      continue;
    }
    auto s = std::find_if(p.series.begin(), p.series.end(),
                          [&](const Series& other) { return other.name == all[i].method; });
    if (s == p.series.end()) {
      s = p.series.insert(p.series.end(), Series{.name = all[i].method, .style = Style::line_points});
    }
    const double x = 1e3 * measured[i].tremor.lag_s, y = kMm * measured[i].of(KnownMotion::hold);
    s->x.push_back(x);
    s->y.push_back(y);
    if (all[i].shipped) {
      p.marks.push_back({x, y, "shipped"});
    }
  }
  return p;
}

struct AtRate {
  std::vector<Measured> measured;
  std::vector<Work> works;
};

// Error, lag, noise and time of all candidates at one rate, on uneven ticks.
AtRate measure_at(double rate_Hz, const std::vector<Candidate>& all, const Job& job) {
  const EncoderSampling sampling{.rate_Hz = rate_Hz, .step_m = kEncoderStep_m, .uneven = true};
  const std::vector<EncoderRecord> records = records_of(sampling);
  job.progress.start(fmt::format("{:g} Hz", rate_Hz), static_cast<std::int64_t>(all.size()) + 1);
  AtRate out;
  std::vector<Timed> timed;
  const auto work = std::make_shared<const EncoderRecord>(record(KnownMotion::work, sampling));
  for (const Candidate& c : all) {
    out.measured.push_back(measure(c, sampling, records));
    timed.push_back(c.timed(sampling, work));
    job.progress.step();
  }
  const std::vector<CallTime> times =
      time_interleaved(timed, {.batches = job.quick ? 100 : 2000, .seconds = job.quick ? 0.5 : 12.0});
  job.progress.step();
  for (std::size_t i = 0; i < all.size(); ++i) {
    out.works.push_back(
        {all[i].method, all[i].knob, kMm * out.measured[i].of(KnownMotion::work), times[i], all[i].shipped});
  }
  return out;
}

Table main_table() {
  Table table{.name = "velocity", .columns = {"method", "knob", "rate_Hz"}};
  append(table.columns, measured_columns());
  append(table.columns, time_columns());
  append(table.columns, {"on_front", "shipped"});
  table.shown = {"method",          "knob",        "rate_Hz",   "work_error_mm_s", "approach_error_mm_s",
                 "hold_error_mm_s", "lag_10Hz_ms", "median_ns", "on_front",        "shipped"};
  return table;
}

void add_rows(Table& table, double rate_Hz, const std::vector<Candidate>& all, const AtRate& at) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    Row row{all[i].method, all[i].knob, rate_Hz};
    append(row, measured_cells(at.measured[i]));
    append(row, time_cells(at.works[i].time));
    row.emplace_back(better_than(at.works[i], at.works) == nullptr);
    row.emplace_back(all[i].shipped);
    table.add(std::move(row));
  }
}

Panel error_against_time(double rate_Hz, const std::vector<Work>& works) {
  const double count_mm_s = kMm * kEncoderStep_m * rate_Hz;
  return work_precision(
      fmt::format("{:g} kHz, {:g} mm encoder: a hand at work", rate_Hz * 1e-3, kMm * kEncoderStep_m),
      "rms error [mm/s]", works,
      std::array{Limit{"one count per tick, d/T", count_mm_s},
                 Limit{"rounding of two samples, d/T/sqrt(6)", count_mm_s / std::sqrt(6.0)}});
}

// The shipped candidate and one of each method.
std::vector<const Candidate*> one_of_each(const std::vector<Candidate>& all) {
  std::vector<const Candidate*> chosen;
  for (const Candidate& c : all) {
    if (c.shipped || (c.method == "finite difference" && c.knob == "stride 1") ||
        (c.method == "EMA" && c.knob == "30 Hz") || (c.method == "FOAW" && c.knob == "window 16") ||
        (c.method == "FOAW and low-pass" && c.knob == "window 16, 3 ms")) {
      chosen.push_back(&c);
    }
  }
  return chosen;
}

// Several rates and encoders, with even and uneven ticks.
struct SamplingSweep {
  Table table{.name = "velocity_sampling",
              .columns = {"method", "knob", "rate_Hz", "encoder_step_mm", "uneven"}};
  Panel panel{.title = fmt::format("{:g} mm encoder: a hand at work, at every rate", kMm* kEncoderStep_m),
              .x_label = "rate [Hz]",
              .y_label = "rms error [mm/s]",
              .log_x = true,
              .log_y = true};
};

SamplingSweep sweep_sampling(const std::vector<const Candidate*>& chosen, const Job& job) {
  SamplingSweep out;
  append(out.table.columns, measured_columns());
  for (const Candidate* c : chosen) {
    out.panel.series.push_back(
        {.name = fmt::format("{} ({})", c->method, c->knob), .style = Style::line_points});
  }
  Series count{.name = "one count per tick, d/T", .style = Style::limit};
  const std::vector<double> rates_Hz =
      job.quick ? std::vector{1000.0, 8000.0} : std::vector{1000.0, 2000.0, 4000.0, 8000.0};
  job.progress.start("rates and encoders", 4 * static_cast<std::int64_t>(rates_Hz.size()));
  for (const double rate_Hz : rates_Hz) {
    for (const double step_m : {kEncoderStep_m, 0.055e-3}) {
      for (const bool uneven : {false, true}) {
        const EncoderSampling sampling{.rate_Hz = rate_Hz, .step_m = step_m, .uneven = uneven};
        const std::vector<EncoderRecord> records = records_of(sampling);
        for (std::size_t i = 0; i < chosen.size(); ++i) {
          const Measured m = measure(*chosen[i], sampling, records);
          Row row{chosen[i]->method, chosen[i]->knob, rate_Hz, kMm * step_m, uneven};
          append(row, measured_cells(m));
          out.table.add(std::move(row));
          if (uneven && step_m == kEncoderStep_m) {
            out.panel.series[i].x.push_back(rate_Hz);
            out.panel.series[i].y.push_back(kMm * m.of(KnownMotion::work));
          }
        }
        job.progress.step();
      }
    }
    count.x.push_back(rate_Hz);
    count.y.push_back(kMm * kEncoderStep_m * rate_Hz);
  }
  out.panel.series.push_back(std::move(count));
  return out;
}

std::string reading(const std::vector<Candidate>& all, const AtRate& at_1_kHz) {
  const auto at = [&all](std::string_view method, std::string_view knob) {
    return static_cast<std::size_t>(
        std::find_if(all.begin(), all.end(),
                     [&](const Candidate& c) { return c.method == method && c.knob == knob; }) -
        all.begin());
  };
  const auto shipped = static_cast<std::size_t>(
      std::find_if(all.begin(), all.end(), [](const Candidate& c) { return c.shipped; }) - all.begin());
  const std::size_t foaw = at("FOAW and low-pass", "window 16, 3 ms");
  const auto ratio = [&](auto value) { return value(foaw) / value(shipped); };
  return fmt::format(
      "At a hand at work at 1 kHz, in mm/s, {}; FOAW with its 3 ms low-pass errs {:.2g} times as much in "
      "{:.2g} times the time, lags {:.2g} ms behind a trembling hand instead of {:.2g} ms, and has {:.2g} "
      "times the noise of a hand at rest whose encoder flickers.",
      front_sentence(at_1_kHz.works), ratio([&](std::size_t i) { return at_1_kHz.works[i].error; }),
      ratio([&](std::size_t i) { return at_1_kHz.works[i].time.median_ns; }),
      1e3 * at_1_kHz.measured[foaw].tremor.lag_s, 1e3 * at_1_kHz.measured[shipped].tremor.lag_s,
      ratio([&](std::size_t i) { return at_1_kHz.measured[i].of(KnownMotion::hold); }));
}

}  // namespace

Result run_velocity(const Job& job) {
  const std::vector<Candidate> all = candidates();
  Table table = main_table();
  Figure figure{.name = "velocity"};
  std::vector<AtRate> rates;
  for (const double rate_Hz : {1000.0, 4000.0}) {
    rates.push_back(measure_at(rate_Hz, all, job));
    add_rows(table, rate_Hz, all, rates.back());
    figure.panels.push_back(error_against_time(rate_Hz, rates.back().works));
  }
  const AtRate& at_1_kHz = rates.front();
  figure.panels.push_back(noise_against_lag(all, at_1_kHz.measured));
  SamplingSweep sweep = sweep_sampling(one_of_each(all), job);
  figure.panels.push_back(std::move(sweep.panel));
  figure.note = fmt::format(
      "A hand at work: strokes of 0.2 to 50 mm/s with 0.25 mm rms of tremor, ticks up to some 10 us late and "
      "one in 200 some periods late. At rest: the encoder flickers between two counts. Kalman's knob is the "
      "hand's jerk in m/s^3/sqrt(Hz).");

  Result result;
  result.tables = {std::move(table), std::move(sweep.table)};
  result.figures = {std::move(figure)};
  result.reading = reading(all, at_1_kHz);
  return result;
}

}  // namespace punctum::report
