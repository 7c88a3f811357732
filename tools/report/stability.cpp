// Topic stability: the stiffness that the device renders, with and without the passivity guard, against the
// published limits.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <thread>

#include "rt/control/device_limits.hpp"
#include "rt/control/passivity.hpp"
#include "tools/report/closed_loop.hpp"
#include "tools/report/topic.hpp"

namespace punctum::report {
namespace {

constexpr std::array<double, 5> kRates{500, 1000, 2000, 4000, 8000};
constexpr int kDelays = 6;

// Calls f(i) for all i < n, on all processors.
template <class F>
void for_all(std::size_t n, const F& f) {
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> threads;
  for (unsigned i = 0; i < std::max(1U, std::thread::hardware_concurrency()); ++i) {
    threads.emplace_back([&] {
      for (std::size_t k = next++; k < n; k = next++) {
        f(k);
      }
    });
  }
}

struct Swept {
  LoopCell cell;
  LoopResult result;
};

enum class Walls : std::uint8_t { still, moving };

std::vector<Swept> sweep(Walls walls, std::size_t n, bool guarded, Progress& progress) {
  std::vector<Swept> all(n);
  progress.start(guarded ? "sweep with the guard" : "sweep without", static_cast<std::int64_t>(n));
  for_all(n, [&](std::size_t i) {
    all[i].cell = walls == Walls::still ? sweep_cell(i + 1, guarded) : moving_cell(i + 1, guarded);
    all[i].result = run_loop(all[i].cell);
    progress.step();
  });
  return all;
}

constexpr const char* kTimings[] = {"steady", "jitter", "lost_ticks", "late_tick"};
constexpr const char* kHolders[] = {"nobody", "fingertip", "arm"};

constexpr const char* kMotions[] = {"still", "modulated", "moving", "corrected", "switched"};

Table cells_table(const char* name, const std::vector<Swept>& with, const std::vector<Swept>& without) {
  Table t{name,
          {"cell",
           "rate_Hz",
           "ticks_per_sample",
           "delay_ticks",
           "K_N_m",
           "membrane_E_Pa",
           "damping_of_limit",
           "mass_kg",
           "device_b_Ns_m",
           "coulomb_N",
           "encoder_m",
           "timing",
           "holder",
           "push_N",
           "speed_m_s",
           "motion",
           "depth",
           "travel_m",
           "frequency_Hz",
           "force_max_N",
           "slew_N_s",
           "passive_N_m",
           "commanded_N_m",
           "rendered_N_m",
           "peak_to_peak_m",
           "surplus_J",
           "net_J",
           "stored_max_J",
           "guard_damper_Ns_m",
           "guard_rest_N",
           "unstable",
           "faithful",
           "unguarded_peak_to_peak_m",
           "unguarded_surplus_J",
           "unguarded_net_J",
           "unguarded_unstable"}};
  for (std::size_t i = 0; i < with.size(); ++i) {
    const auto& [c, r] = with[i];
    Row row{i + 1,
            c.rate_Hz,
            c.ticks_per_sample,
            c.device.delay_ticks,
            c.membrane_E_Pa > 0 ? std::nan("") : c.stiffness_N_m,
            c.membrane_E_Pa,
            c.damping_share,
            c.device.mass_kg,
            c.device.damping_Ns_m,
            c.coulomb_N,
            c.device.encoder_step_m,
            kTimings[static_cast<int>(c.timing)],
            kHolders[static_cast<int>(c.holder)],
            c.push_N,
            c.speed_m_s,
            kMotions[static_cast<int>(c.motion)],
            c.depth,
            c.travel_m,
            c.frequency_Hz,
            c.device.force_max_N,
            c.slew_N_s,
            r.passive_N_m,
            r.commanded_N_m,
            r.rendered_N_m,
            r.peak_to_peak_m,
            r.surplus_J,
            r.net_J,
            r.stored_max_J,
            r.damper_Ns_m,
            r.rest_N,
            r.unstable(),
            faithful(c, r)};
    const bool both = i < without.size();
    row.emplace_back(both ? without[i].result.peak_to_peak_m : std::nan(""));
    row.emplace_back(both ? without[i].result.surplus_J : std::nan(""));
    row.emplace_back(both ? without[i].result.net_J : std::nan(""));
    row.emplace_back(both ? Cell(without[i].result.unstable()) : Cell(std::nan("")));
    t.add(std::move(row));
  }
  t.shown = {"cell",   "rate_Hz", "delay_ticks",  "K_N_m",    "membrane_E_Pa",
             "timing", "holder",  "rendered_N_m", "unstable", "unguarded_unstable"};
  return t;
}

// Per rate and delay: the number of cells, of unstable ones and so on.
Table counts_table(const std::vector<Swept>& with, const std::vector<Swept>& without) {
  Table t{"stability",
          {"rate_Hz", "delay_ticks", "cells", "unstable_guarded", "unfaithful_guarded",
           "active_at_rest_guarded", "unstable_unguarded", "lowest_rendered_of_owed", "rest_noise_max_N"}};
  for (const double rate : kRates) {
    for (int d = 0; d < kDelays; ++d) {
      std::int64_t cells = 0, bad = 0, poor = 0, at_rest = 0, unguarded = 0;
      double lowest = 1e9, noise = 0;
      for (std::size_t i = 0; i < with.size(); ++i) {
        const auto& [c, r] = with[i];
        if (c.rate_Hz != rate || c.device.delay_ticks != d) {
          continue;
        }
        ++cells;
        bad += r.unstable();
        poor += !faithful(c, r);
        at_rest += r.active_at_rest;
        unguarded += without[i].result.unstable();
        noise = std::max(noise, r.rest_N);
        const bool counts =
            r.commanded_N_m > 0 && c.timing != Timing::lost_ticks && c.timing != Timing::late_tick;
        if (counts) {
          lowest = std::min(lowest, r.rendered_N_m / std::min(r.commanded_N_m, r.passive_N_m));
        }
      }
      t.add({rate, d, cells, bad, poor, at_rest, unguarded, lowest < 1e9 ? lowest : std::nan(""), noise});
    }
  }
  return t;
}

// Per motion of the wall and sample rate of the hand.
Table moving_counts_table(const std::vector<Swept>& with, const std::vector<Swept>& without) {
  Table t{"stability_moving",
          {"motion", "ticks_per_sample", "cells", "unstable_guarded", "unfaithful_guarded",
           "unstable_unguarded", "net_guarded_max_J", "net_unguarded_max_J"}};
  for (std::size_t motion = 0; motion < std::size(kMotions); ++motion) {
    for (const int ticks : {1, 2, 4, 8}) {
      std::int64_t cells = 0, bad = 0, poor = 0, unguarded = 0;
      double net = 0, bare = 0;
      for (std::size_t i = 0; i < with.size(); ++i) {
        const auto& [c, r] = with[i];
        if (static_cast<std::size_t>(c.motion) != motion || c.ticks_per_sample != ticks) {
          continue;
        }
        ++cells;
        bad += r.unstable();
        poor += !faithful(c, r);
        unguarded += without[i].result.unstable();
        net = std::max(net, r.net_J);
        bare = std::max(bare, without[i].result.net_J);
      }
      t.add({kMotions[motion], ticks, cells, bad, poor, unguarded, net, bare});
    }
  }
  return t;
}

// A table, and the worst of what stands in it.
struct WithWorst {
  Table table;
  double worst = 0;
};

// What the hand does not get back of its work on walls that are stable without the guard.
WithWorst transparency(Progress& progress) {
  WithWorst out;
  out.table = {
      "stability_transparency",
      {"rate_Hz", "delay_ticks", "ticks_per_sample", "of_passive", "lost_part", "unguarded_lost_part"}};
  std::vector<LoopCell> cells;
  std::vector<double> parts;
  for (const double rate : {1000.0, 4000.0, 8000.0}) {
    for (const int d : {0, 1, 5}) {
      for (const int ticks : {1, 4}) {
        for (const double part : {0.1, 0.5, 0.85}) {
          LoopCell c;
          c.rate_Hz = rate;
          c.device.delay_ticks = d;
          c.ticks_per_sample = ticks;
          c.stiffness_N_m = part * c.device.damping_Ns_m * rate / (0.5 * ticks + d);
          cells.push_back(c);
          parts.push_back(part);
        }
      }
    }
  }
  std::vector<double> with(cells.size()), without(cells.size());
  progress.start("transparency", static_cast<std::int64_t>(cells.size()));
  for_all(cells.size(), [&](std::size_t i) {
    LoopCell c = cells[i];
    with[i] = lost_part(c);
    c.guarded = false;
    without[i] = lost_part(c);
    progress.step();
  });
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const LoopCell& c = cells[i];
    out.table.add({c.rate_Hz, c.device.delay_ticks, c.ticks_per_sample, parts[i], with[i], without[i]});
    out.worst = std::max(out.worst, std::abs(with[i]));
  }
  return out;
}

// For a finite difference, at any rate. device_limits widens its windows with the rate, so it is evaluated at
// 1 kHz with the same b T/m and B T/m.
double exact_boundary_N_m(const rt::HandDevice& device, double T_s, double B_Ns_m) {
  rt::VelocityParams difference;
  difference.method = rt::VelocityParams::Method::foaw;
  difference.window = 1;
  difference.smooth_s = 0;
  constexpr double T1_s = 1e-3;
  rt::HandDevice same = device;
  same.damping_Ns_m *= T_s / T1_s;
  const double K1 = rt::stable_stiffness_N_m(same, T1_s, difference, B_Ns_m * T_s / T1_s);
  return K1 * (T1_s / T_s) * (T1_s / T_s);
}

// Boundary of the linear loop: exact, by Gil's formula, and measured.
struct Boundaries {
  Table table;
  Panel panel;
  double worst_exact = 0, worst_Gil = 0;
};

Boundaries boundaries(bool quick, Progress& progress) {
  Boundaries out;
  out.table = {"stability_boundaries",
               {"rate_Hz", "delay_ticks", "mass_kg", "b_Ns_m", "B_Ns_m", "measured_N_m", "exact_N_m",
                "measured_over_exact", "Gil_N_m", "Gil_claims", "measured_over_Gil"}};
  out.panel.title = "boundary of the linear loop";
  out.panel.x_label = "B T / m";
  out.panel.y_label = "K T^2 / m";
  out.panel.log_x = out.panel.log_y = true;
  struct Point {
    double rate;
    rt::HandDevice device;
    double B;
    double measured = 0;
  };
  std::vector<Point> points;
  const std::vector<double> rates = quick ? std::vector<double>{1000} : std::vector<double>{1000, 4000, 8000};
  const int steps = quick ? 8 : 16;
  for (const double rate : rates) {
    for (int d = 0; d <= 2; ++d) {
      constexpr double end[] = {1.9, 0.8, 0.52};  // of B T/m, just below where K = 0 is unstable
      for (int i = 0; i < steps; ++i) {
        Point p{rate, {}, 0};
        p.device.delay_ticks = d;
        p.device.damping_Ns_m = 0.1;
        p.B = 0.002 * std::pow(end[d] / 0.002, i / (steps - 1.0)) * p.device.mass_kg * rate;
        points.push_back(p);
      }
    }
  }
  progress.start("boundaries", static_cast<std::int64_t>(points.size()));
  for_all(points.size(), [&](std::size_t i) {
    points[i].measured = measured_boundary_N_m(points[i].device, 1 / points[i].rate, points[i].B);
    progress.step();
  });
  constexpr const char* kNames[] = {"exact, no delay", "exact, one tick", "exact, two ticks"};
  std::array<Series, 3> exact, Gil;
  Series measured{"measured", {}, {}, Style::points};
  for (const Point& p : points) {
    const double T = 1 / p.rate, m = p.device.mass_kg, b = p.device.damping_Ns_m;
    const int d = p.device.delay_ticks;
    const double K_exact = exact_boundary_N_m(p.device, T, p.B);
    const double K_Gil = (b + p.B) / (T * (0.5 + d));
    const bool claims = b * T / m <= 0.01 && p.B * T / m <= 0.02;
    out.worst_exact = std::max(out.worst_exact, std::abs(p.measured / K_exact - 1));
    if (claims) {
      out.worst_Gil = std::max(out.worst_Gil, std::abs(p.measured / K_Gil - 1));
    }
    out.table.add(
        {p.rate, d, m, b, p.B, p.measured, K_exact, p.measured / K_exact, K_Gil, claims, p.measured / K_Gil});
    if (p.rate != 1000) {
      continue;
    }
    const auto i = static_cast<std::size_t>(d);
    const double x = p.B * T / m;
    exact[i].name = kNames[d];
    exact[i].x.push_back(x);
    exact[i].y.push_back(K_exact * T * T / m);
    Gil[i].style = Style::limit;
    Gil[i].x.push_back(x);
    Gil[i].y.push_back(K_Gil * T * T / m);
    measured.x.push_back(x);
    measured.y.push_back(p.measured * T * T / m);
  }
  Gil[0].name = "Gil (b+B)/(T/2+t_d)";
  for (auto& s : exact) {
    out.panel.series.push_back(std::move(s));
  }
  for (auto& s : Gil) {
    out.panel.series.push_back(std::move(s));
  }
  out.panel.series.push_back(std::move(measured));
  return out;
}

// Colgate & Schenkel's formula against the energy of imposed motions.
WithWorst passivity(Progress& progress) {
  WithWorst out;
  out.table = {
      "stability_passivity",
      {"rate_Hz", "delay_ticks", "K_N_m", "B_Ns_m", "tau_s", "formula_b_Ns_m", "slow_sinusoid_b_Ns_m",
       "nyquist_sinusoid_b_Ns_m", "nyquist_triangle_b_Ns_m", "largest_over_formula"}};
  struct Case {
    double rate;
    int d;
    double K, B, tau;
  };
  constexpr Case kCases[] = {
      {1000, 0, 100, 0, 0}, {1000, 0, 1000, 0, 0},      {4000, 0, 1000, 0, 0},     {8000, 0, 5000, 0, 0},
      {1000, 1, 100, 0, 0}, {1000, 2, 100, 0, 0},       {4000, 2, 500, 0, 0},      {1000, 0, 0, 2, 0},
      {1000, 0, 100, 2, 0}, {1000, 0, 100, 2, 0.00531}, {4000, 0, 1000, 1, 0.003}, {8000, 0, 2000, 5, 0.003}};
  progress.start("cycle energy", std::size(kCases));
  for (const Case& c : kCases) {
    const double T = 1 / c.rate;
    const CycleEnergy e = cycle_energy(c.K, c.B, c.tau, T, c.d);
    const double formula = c.d > 0 ? c.K * T * (0.5 + c.d) : c.K * T / 2 + c.B * T / (T + 2 * c.tau);
    const double largest = std::max({e.slow_Ns_m, e.sinusoid_Ns_m, e.triangle_Ns_m});
    out.worst = std::max(out.worst, std::abs(largest / formula - 1));
    out.table.add({c.rate, c.d, c.K, c.B, c.tau, formula, e.slow_Ns_m, e.sinusoid_Ns_m, e.triangle_Ns_m,
                   largest / formula});
    progress.step();
  }
  return out;
}

LoopCell plain_cell(double rate, int delay, double K, bool guarded) {
  LoopCell c;
  c.rate_Hz = rate;
  c.device.delay_ticks = delay;
  c.stiffness_N_m = K;
  c.speed_m_s = 0.05;
  c.guarded = guarded;
  return c;
}

std::vector<double> log_steps(double from, double to, int n) {
  std::vector<double> x;
  for (int i = 0; i < n; ++i) {
    x.push_back(from * std::pow(to / from, i / (n - 1.0)));
  }
  return x;
}

// Stiffness against delay of the default device under a fingertip, without and with the guard.
struct Maps {
  Panel without, with;
};

Maps maps(bool quick, Progress& progress) {
  struct Place {
    double rate;
    int d;
    double delay_ms;
  };
  std::vector<Place> places;
  for (const double rate : kRates) {
    for (int d = 0; d < kDelays; ++d) {
      const double ms = 1e3 * (0.5 + d) / rate;
      const bool there = std::any_of(places.begin(), places.end(),
                                     [ms](const Place& p) { return std::abs(p.delay_ms / ms - 1) < 0.05; });
      if (!there) {
        places.push_back({rate, d, ms});
      }
    }
  }
  const auto K = log_steps(10, 1e6, quick ? 11 : 31);
  Maps out;
  const std::size_t n = places.size() * K.size();
  for (const bool guarded : {false, true}) {
    Panel& panel = guarded ? out.with : out.without;
    panel.title = guarded ? "with the guard" : "without the guard";
    panel.x_label = "commanded stiffness [N/m]";
    panel.y_label = "hold and delay, T/2 + t_d [ms]";
    panel.log_x = panel.log_y = true;
    panel.map.emplace();
    panel.map->categories = {"at rest, as commanded", "at rest, stiffness reduced", "unstable"};
    panel.map->x.resize(n);
    panel.map->y.resize(n);
    panel.map->value.resize(n);
    progress.start(panel.title, static_cast<std::int64_t>(n));
    for_all(n, [&](std::size_t i) {
      const Place& place = places[i / K.size()];
      const LoopResult r = run_loop(plain_cell(place.rate, place.d, K[i % K.size()], guarded));
      panel.map->x[i] = K[i % K.size()];
      panel.map->y[i] = place.delay_ms;
      panel.map->value[i] = r.unstable() ? 2 : r.rendered_N_m < 0.95 * r.commanded_N_m ? 1 : 0;
      progress.step();
    });
    Series passive{"passive limit", {}, {}, Style::limit};
    const double b = rt::HandDevice{}.damping_Ns_m;
    double longest = 0, shortest = 1e9;
    for (const Place& p : places) {
      longest = std::max(longest, p.delay_ms);
      shortest = std::min(shortest, p.delay_ms);
    }
    for (const double ms : log_steps(shortest, longest, 20)) {
      passive.x.push_back(b / (ms * 1e-3));
      passive.y.push_back(ms);
    }
    panel.series.push_back(std::move(passive));
  }
  return out;
}

// Stiffness against frequency of a wall whose stiffness swings by half, under an arm that swings at half the
// frequency, without and with the guard.
Maps modulated_maps(bool quick, Progress& progress) {
  const auto parts = log_steps(0.05, 50, quick ? 9 : 25);
  const auto frequencies = log_steps(0.3, 30, quick ? 7 : 17);
  const std::size_t n = parts.size() * frequencies.size();
  Maps out;
  for (const bool guarded : {false, true}) {
    Panel& panel = guarded ? out.with : out.without;
    panel.title = guarded ? "modulated, with the guard" : "modulated, without the guard";
    panel.x_label = "commanded stiffness / passive limit";
    panel.y_label = "modulation [Hz]";
    panel.log_x = panel.log_y = true;
    panel.map.emplace();
    panel.map->categories = {"as commanded", "within the bound, reduced",
                             "work beyond the bound, or unstable"};
    panel.map->x.resize(n);
    panel.map->y.resize(n);
    panel.map->value.resize(n);
    progress.start(panel.title, static_cast<std::int64_t>(n));
    for_all(n, [&](std::size_t i) {
      LoopCell c = plain_cell(1000, 0, 1, guarded);
      c.stiffness_N_m = parts[i % parts.size()] * rt::passive_stiffness_N_m(c.device, 1e-3);
      c.motion = WallMotion::modulated;
      c.holder = Holder::arm;
      c.frequency_Hz = frequencies[i / parts.size()];
      const LoopResult r = run_loop(c);
      panel.map->x[i] = parts[i % parts.size()];
      panel.map->y[i] = c.frequency_Hz;
      panel.map->value[i] = r.unstable() ? 2 : r.least_gain < 0.95 ? 1 : 0;
      progress.step();
    });
  }
  return out;
}

struct Rendered {
  Table table;
  Panel panel;
};

Rendered rendered(bool quick, Progress& progress) {
  Rendered out;
  out.table = {"stability_largest",
               {"rate_Hz", "delay_ticks", "passive_N_m", "largest_unguarded_N_m", "largest_guarded_N_m"}};
  out.panel.title = "stiffness rendered, guarded";
  out.panel.x_label = "commanded / passive limit";
  out.panel.y_label = "rendered / passive limit";
  out.panel.log_x = out.panel.log_y = true;
  const auto parts = log_steps(0.05, 500, quick ? 13 : 41);
  progress.start("largest stiffness", 9 * static_cast<std::int64_t>(parts.size()));
  for (const double rate : {1000.0, 4000.0, 8000.0}) {
    for (int d = 0; d <= 2; ++d) {
      const double passive = rt::passive_stiffness_N_m(plain_cell(rate, d, 1, true).device, 1 / rate);
      std::vector<LoopResult> with(parts.size()), without(parts.size());
      for_all(parts.size(), [&](std::size_t i) {
        with[i] = run_loop(plain_cell(rate, d, parts[i] * passive, true));
        without[i] = run_loop(plain_cell(rate, d, parts[i] * passive, false));
        progress.step();
      });
      double best = 0, bare = 0;
      bool still = true;
      Series s{
          fmt::format("{:g} kHz, {} tick{}", rate * 1e-3, d, d == 1 ? "" : "s"), {}, {}, Style::line_points};
      for (std::size_t i = 0; i < parts.size(); ++i) {
        if (!with[i].unstable()) {
          best = std::max(best, with[i].rendered_N_m);
        }
        still = still && !without[i].unstable();
        if (still) {
          bare = parts[i] * passive;
        }
        s.x.push_back(parts[i]);
        s.y.push_back(with[i].rendered_N_m / passive);
      }
      out.table.add({rate, d, passive, bare, best});
      if (d == 0 || rate == 1000) {
        out.panel.series.push_back(std::move(s));
      }
    }
  }
  out.panel.series.push_back({"owed at least", {0.05, 0.8, 0.8, 500}, {0.045, 0.72, 0.5, 0.5}, Style::limit});
  return out;
}

CallTime guard_time() {
  rt::PassivityGuard guard({}, {}, {}, 1000);
  rt::GuardInput in;
  in.stiffness_N_m = 300;
  in.elapsed_s = 1e-3;
  return time_calls([&guard, in](std::size_t i) mutable {
    const double x = 1e-3 * static_cast<double>(i % 64);
    in.position_m = {x, 0, 0};
    in.storing[0] = {{-300 * x, 0, 0}, in.position_m};
    const hal::Vec3 f = guard.step(in);
    guard.wrote(f);
    return f.x();
  });
}

}  // namespace

Result run_stability(const Job& job) {
  Result out;
  const std::size_t n = job.quick ? 200 : 20000;
  const auto with = sweep(Walls::still, n, true, job.progress);
  const auto without = sweep(Walls::still, n, false, job.progress);
  const auto moving_with = sweep(Walls::moving, n, true, job.progress);
  const auto moving_without = sweep(Walls::moving, n, false, job.progress);
  WithWorst lost = transparency(job.progress);
  Boundaries bounds = boundaries(job.quick, job.progress);
  WithWorst passive = passivity(job.progress);
  Maps map = maps(job.quick, job.progress);
  Maps modulated = modulated_maps(job.quick, job.progress);
  Rendered largest = rendered(job.quick, job.progress);
  const CallTime cost = guard_time();

  const auto unstable = [](const std::vector<Swept>& all) {
    return std::count_if(all.begin(), all.end(), [](const Swept& s) { return s.result.unstable(); });
  };
  const auto poor =
      std::count_if(with.begin(), with.end(), [](const Swept& s) { return !faithful(s.cell, s.result); });
  double noise = 0;
  for (const Swept& s : with) {
    noise = std::max(noise, s.result.unstable() ? 0 : s.result.rest_N);
  }
  const auto at_rest =
      std::count_if(with.begin(), with.end(), [](const Swept& s) { return s.result.active_at_rest; });
  out.reading = fmt::format(
      "Of {} cells {} are unstable without the guard and {} with it ({} if energy given to a handle at rest "
      "counts "
      "too), {} render less stiffness with it than is owed; measured boundaries are within {:.2g} % of the "
      "exact "
      "ones, {:.2g} % of Gil's where it claims to hold and {:.2g} % of Colgate and Schenkel's; the guard "
      "takes "
      "{:.0f} ns a tick and adds at most {:.1f} mN rms once the handle rests. Of {} cells more with walls "
      "that "
      "move, slow hands and limits of force and slew {} are unstable or give more than {:g} mJ and {:g} mW "
      "without the guard and {} with it, {} render less than is owed. Where a wall is stable by itself, the "
      "hand gets back its work within {:.2g} %.",
      n, unstable(without), unstable(with), at_rest, poor, 100 * bounds.worst_exact, 100 * bounds.worst_Gil,
      100 * passive.worst, cost.median_ns, 1e3 * noise, n, unstable(moving_without),
      1e3 * rt::PassivityGuard::kAllowed_J, 1e3 * rt::PassivityGuard::kAllowed_W, unstable(moving_with),
      std::count_if(moving_with.begin(), moving_with.end(),
                    [](const Swept& s) { return !faithful(s.cell, s.result); }),
      100 * lost.worst);

  Table guard{"stability_guard", {"what"}};
  for (const auto& c : time_columns()) {
    guard.columns.push_back(c);
  }
  Row row{"one step of the passivity guard"};
  for (const auto& c : time_cells(cost)) {
    row.push_back(c);
  }
  guard.add(std::move(row));

  out.tables = {
      counts_table(with, without), std::move(largest.table), std::move(bounds.table),
      std::move(passive.table),    std::move(guard),         cells_table("stability_cells", with, without)};
  out.tables.push_back(moving_counts_table(moving_with, moving_without));
  out.tables.push_back(std::move(lost.table));
  out.tables.push_back(cells_table("stability_moving_cells", moving_with, moving_without));
  Figure figure{
      "stability",
      {std::move(map.without), std::move(map.with), std::move(bounds.panel), std::move(largest.panel)}};
  figure.note =
      "Maps: the default device pushed against a wall by a fingertip, every rate and delay. Unstable: moving "
      "by more than 4 encoder counts and 0.1 mm in the last second, or given more energy than is stored, by "
      "5 % of the most stored and the work of 4 encoder counts, over the seconds in which it moves that "
      "much. The stiffness owed is asked of cells whose "
      "ticks are not lost; softer walls than 5 N/m are pushed by an arm.";
  Figure moving{"stability_moving", {std::move(modulated.without), std::move(modulated.with)}};
  moving.note =
      "The default device at 1 kHz in an arm that swings in a wall for five seconds while its stiffness "
      "swings by "
      "half at twice the frequency. Beyond the bound: more work than was stored, 2 mJ, and 2 mW over the "
      "time.";
  out.figures = {std::move(figure), std::move(moving)};
  return out;
}

}  // namespace punctum::report
