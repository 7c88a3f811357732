// Topic surface: how well the cell's surface is described, and what a description costs, against the surface
// of a large-deflection membrane.
#include "tools/report/surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "hal/sim/plant/cell.hpp"
#include "rt/control/local_membrane_model.hpp"
#include "rt/forces/membrane.hpp"
#include "rt/station/surface.hpp"
#include "tools/report/simulated_frames.hpp"
#include "tools/report/topic.hpp"
#include "vision/image/polar_contour.hpp"
#include "vision/image/polyline.hpp"
#include "vision/image/spline.hpp"
#include "vision/surface/surface_grid.hpp"
#include "vision/tracker.hpp"

namespace punctum::report {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

// ---- contours ----

using vision::Contour;
using vision::Point;

// The whole contour in a plane through the needle, beginning at the bottom of the dimple.
Contour closed_contour(const DeformedCell& cell) {
  Contour c;
  c = cell.meridian;
  for (std::size_t i = cell.meridian.size() - 1; i-- > 1;) {
    c.emplace_back(cell.meridian[i].x, -cell.meridian[i].y);
  }
  return c;
}

// `count` points at equal distances along a closed polygon, beginning at its first point.
Contour equally_spaced(const Contour& polygon, int count) {
  const std::size_t n = polygon.size();
  if (n == 0) {
    return {};
  }
  std::vector<double> at(n + 1, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    at[i + 1] = at[i] + cv::norm(polygon[(i + 1) % n] - polygon[i]);
  }
  Contour out;
  std::size_t i = 0;
  for (int k = 0; k < count; ++k) {
    const double s = at[n] * k / count;
    while (i + 1 < n && at[i + 1] <= s) {
      ++i;
    }
    const double t = (s - at[i]) / std::max(at[i + 1] - at[i], 1e-300);
    out.push_back(polygon[i] + t * (polygon[(i + 1) % n] - polygon[i]));
  }
  return out;
}

// The same closed contour, counter-clockwise, beginning where the axis crosses it on the side of the needle.
Contour from_the_dimple(Contour c) {
  if (vision::signed_area(c) < 0) {
    std::reverse(c.begin(), c.end());
  }
  const std::size_t n = c.size();
  std::size_t best = n;
  for (std::size_t i = 0; i < n; ++i) {
    const Point &p = c[i], &q = c[(i + 1) % n];
    if (p.y < 0 && q.y >= 0 && p.x > 0 && (best == n || p.x < c[best].x)) {
      best = i;
    }
  }
  if (best == n) {
    return {};
  }
  const Point &p = c[best], &q = c[(best + 1) % n];
  Contour out{p + p.y / (p.y - q.y) * (q - p)};
  for (std::size_t i = 1; i <= n; ++i) {
    const Point& next = c[(best + i) % n];
    if (cv::norm(next - out.back()) > 1e-9) {
      out.push_back(next);
    }
  }
  return out;
}

// Turns the upper half of a contour about the axis into its lower half; one picture does not tell more.
// `line` begins at the axis and has 2 (along - 1) equally spaced points.
void revolve(const Contour& line, Net& net) {
  const std::size_t around = static_cast<std::size_t>(net.around);
  for (int i = 0; i < net.along; ++i) {
    const Point &up = line[static_cast<std::size_t>(i)],
                &low = line[i == 0 ? 0 : line.size() - static_cast<std::size_t>(i)];
    std::array<double, 3>* row = &net.points[static_cast<std::size_t>(i) * around];
    for (std::size_t j = 0; j < around; ++j) {
      const double part = 0.5 * (1 + net.cosine[j]);
      const double r = part * up.y - (1 - part) * low.y;
      row[j] = {part * up.x + (1 - part) * low.x, r * net.cosine[j], r * net.sine[j]};
    }
  }
}

Surface polygon(Contour nodes) {
  return [nodes = std::move(nodes)](Net& net) { revolve(equally_spaced(nodes, 2 * (net.along - 1)), net); };
}

Surface spline(Contour nodes) {
  return [nodes = std::move(nodes)](Net& net) {
    revolve(vision::spline_through(nodes, 2 * (net.along - 1)), net);
  };
}

// What vision ships: the control net of a contour, and the grid of its points, with or without their normals.
enum class Normals : std::uint8_t { without, with };

Surface nurbs(const DeformedCell& cell, const Contour& contour, int control_points, Normals normals) {
  struct Parts {
    vision::NetFit fit;
    vision::MembraneNet net;
    std::optional<vision::SurfaceGrid> grid;
    vision::GridVectors points, directions;
  };
  auto parts = std::make_shared<Parts>(Parts{vision::NetFit(control_points), {}, {}, {}, {}});
  const double reach = vision::dimple_reach(cell.wd_um, cell.c_um);
  return [=](Net& net) {
    if (!parts->grid || parts->grid->along() != net.along || parts->grid->around() != net.around) {
      parts->grid.emplace(control_points, net.along, net.around);
    }
    parts->fit.fit(contour, {0, 0}, {-1, 0}, reach, parts->net);
    if (!parts->net.ok) {
      throw std::runtime_error(std::string(parts->net.reason));
    }
    if (normals == Normals::with) {
      parts->grid->points_and_normals(parts->net, parts->points, parts->directions);
    } else {
      parts->grid->points(parts->net, parts->points);
    }
    const vision::GridVectors& p = parts->points;
    for (std::size_t k = 0; k < net.points.size(); ++k) {
      net.points[k] = {p.x[k], p.y[k], p.z[k]};
    }
  };
}

// ---- sphere and profile ----

// A surface of revolution. at(s) is its meridian (x, r), s = 0 .. 1 from pole to pole.
template <class Meridian>
void revolve_meridian(const Meridian& at, Net& net) {
  const std::size_t around = static_cast<std::size_t>(net.around);
  for (int i = 0; i < net.along; ++i) {
    const Point p = at(static_cast<double>(i) / (net.along - 1));
    std::array<double, 3>* row = &net.points[static_cast<std::size_t>(i) * around];
    for (std::size_t j = 0; j < around; ++j) {
      row[j] = {p.x, p.y * net.cosine[j], p.y * net.sine[j]};
    }
  }
}

Surface sphere(double R) {
  return [R](Net& net) {
    revolve_meridian([R](double s) { return Point{R * std::cos(kPi * s), R * std::sin(kPi * s)}; }, net);
  };
}

// Eq. 4: w(r) = k [ln(a/r) - (a^2 - r^2)/(2 a^2)], w(c) = w_d, subtracted from the sphere; flat under the
// tip.
Surface dimpled_sphere(double R, double c, double wd, double a) {
  return [=](Net& net) {
    const double k = wd / (std::log(a / c) - (a * a - c * c) / (2 * a * a));
    revolve_meridian(
        [=](double s) {
          Point p{R * std::cos(kPi * s), R * std::sin(kPi * s)};
          const double r = std::max(p.y, c);
          if (p.x > 0 && r < a) {
            p.x -= k * (std::log(a / r) - (a * a - r * r) / (2 * a * a));
          }
          return p;
        },
        net);
  };
}

// ---- the tracker's own contours ----

// Cells with a contour of the shipped tracker, near these depths, from an injection along the axis.
std::vector<DeformedCell> seen_cells(const std::vector<double>& depths_um) {
  InjectionPlan plan;
  plan.aim_m = plan.tilt_rad = plan.spread = 0;
  plan.approach_m_s = 40e-6;
  plan.indentation_m_s = 16e-6;
  const SimulatedInjection injection = simulate_injection(plan);
  const double um = injection.lens.pixel_m * 1e6;
  const sim::Cell truth(injection.cell, injection.needle, sim::HolderParams{}, plan.seed, 0);
  vision::Tracker tracker(injection.config(), injection.lens.width, injection.lens.height);
  std::vector<DeformedCell> cells;
  std::vector<double> left = depths_um;
  for (std::size_t f = 0; f < injection.truth.size() && !left.empty(); ++f) {
    const vision::Result& r = tracker.process(injection.frame(f));
    const FrameTruth& t = injection.truth[f];
    if (!r.outer.ok || t.stretch != Stretch::indentation || t.wd_m * 1e6 < left.front()) {
      continue;
    }
    left.erase(left.begin());
    cells.push_back(deformed_cell(truth.table(sim::Membrane::outer).shape(), t.R_m * 1e6, t.wd_m * 1e6));
    for (const Point& p : r.outer.contour) {
      const Point d = um * (p - t.centre);
      cells.back().seen.emplace_back(-d.dot(t.axis), t.axis.cross(d));
    }
    cells.back().seen = from_the_dimple(cells.back().seen);
  }
  if (cells.empty()) {
    throw std::runtime_error("the tracker saw no indented cell");
  }
  return cells;
}

constexpr int kSide = 64;  // points along and around of the net that is timed

struct Entry {
  const SurfaceMethod* method;
  double value;
  std::vector<SurfaceError> errors;  // per depth
};

// Every method at each of its values.
std::vector<Entry> all_entries() {
  std::vector<Entry> entries;
  for (const SurfaceMethod& m : surface_methods()) {
    for (const double value : m.values) {
      entries.push_back({&m, value, {}});
    }
  }
  return entries;
}

void measure_distances(std::vector<Entry>& entries, const std::vector<DeformedCell>& cells,
                       Progress& progress) {
  progress.start("distances", static_cast<std::int64_t>(entries.size()));
  for (Entry& e : entries) {
    for (const DeformedCell& cell : cells) {
      e.errors.push_back(surface_error(cell, e.method->given(cell, e.value)));
    }
    progress.step();
  }
}

std::vector<CallTime> measure_times(const std::vector<Entry>& entries, const DeformedCell& cell, bool quick) {
  std::vector<Timed> timed;
  for (const Entry& e : entries) {
    timed.emplace_back([f = e.method->given(cell, e.value), net = Net(kSide, kSide)]() mutable {
      f(net);
      keep(net.points.front());
    });
  }
  return time_interleaved(timed, {.batches = 1000, .batch_us = 20, .seconds = quick ? 2.0 : 20.0});
}

// rms distance against time, per depth.
std::vector<std::vector<Work>> works_by_depth(const std::vector<Entry>& entries,
                                              const std::vector<CallTime>& times, std::size_t depths) {
  std::vector<std::vector<Work>> works(depths);
  for (std::size_t d = 0; d < depths; ++d) {
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const Entry& e = entries[i];
      works[d].push_back({.method = e.method->name,
                          .knob = fmt::format(fmt::runtime(e.method->knob), e.value),
                          .error = e.errors[d].rms_um,
                          .time = times[i],
                          .shipped = e.value == e.method->shipped});
    }
  }
  return works;
}

// The largest distance of all depths against time.
std::vector<Work> worst_works(const std::vector<Entry>& entries, const std::vector<Work>& any_depth) {
  std::vector<Work> worst = any_depth;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    worst[i].error = 0;
    for (const SurfaceError& e : entries[i].errors) {
      worst[i].error = std::max(worst[i].error, e.max_um);
    }
  }
  return worst;
}

Table table_of(const std::vector<Entry>& entries, const std::vector<DeformedCell>& cells,
               const std::vector<std::vector<Work>>& works) {
  Table table{.name = "surface",
              .columns = {"method", "knob", "wd_um", "rms_um", "dimple_rms_um", "max_um", "point_ns"},
              .rows = {},
              .shown = {"method", "knob", "wd_um", "rms_um", "dimple_rms_um", "max_um", "median_ns",
                        "on_front", "shipped"}};
  for (const auto& c : time_columns()) {
    table.columns.push_back(c);
  }
  table.columns.insert(table.columns.end(), {"on_front", "shipped"});
  for (std::size_t i = 0; i < entries.size(); ++i) {
    for (std::size_t d = 0; d < cells.size(); ++d) {
      const Work& w = works[d][i];
      const SurfaceError& e = entries[i].errors[d];
      Row row{w.method,
              w.knob,
              cells[d].wd_um,
              e.rms_um,
              e.dimple_rms_um,
              e.max_um,
              w.time.median_ns / (kSide * kSide)};
      for (const auto& c : time_cells(w.time)) {
        row.push_back(c);
      }
      const bool front = better_than(w, works[d]) == nullptr;
      row.emplace_back(front);
      row.emplace_back(w.shipped);
      if (d + 1 == cells.size() && (front || w.shipped)) {
        table.shown_rows.push_back(table.rows.size());
      }
      table.add(std::move(row));
    }
  }
  return table;
}

// The meridian of a dimple: the true one and the described ones.
Panel meridian_panel(const DeformedCell& cell) {
  Panel shape{.title = fmt::format("w_d = {:.1f} um", cell.wd_um),
              .x_label = "distance from the needle's axis [um]",
              .y_label = "along the axis [um]"};
  const auto draw = [&shape](const std::string& name, const Surface& surface) {
    Net net(257, 2);
    surface(net);
    Series s{.name = name, .x = {}, .y = {}, .style = Style::line};
    for (std::size_t i = 0; i < net.points.size() && net.points[i][0] >= 0; i += 2) {
      s.x.push_back(net.points[i][1]);
      s.y.push_back(net.points[i][0]);
    }
    shape.series.push_back(std::move(s));
  };
  draw("true", polygon(closed_contour(cell)));
  for (const SurfaceMethod& m : surface_methods()) {
    if (m.name != "polygon" && m.name != "periodic spline" && m.name != "NURBS as seen, with normals") {
      draw(m.name, m.given(cell, m.values[m.values.size() / 2]));
    }
  }
  return shape;
}

std::string reading_of(const DeformedCell& cell, const std::vector<Work>& works) {
  const auto error_of = [&works](const std::string& method) {
    const auto w = std::find_if(works.begin(), works.end(), [&](const Work& other) {
      return other.method == method && other.knob.empty();
    });
    return w == works.end() ? kNothing : w->error;
  };
  double seen_best = std::numeric_limits<double>::infinity();
  for (const Work& w : works) {
    if (w.method == "periodic spline as seen") {
      seen_best = std::min(seen_best, w.error);
    }
  }
  const auto enough = std::find_if(works.begin(), works.end(), [seen_best](const Work& w) {
    return w.method == "periodic spline" && w.error < seen_best;  // the fewest nodes come first
  });
  return fmt::format(
      "At w_d = {:.1f} um the undeformed sphere is {:.2f} um rms off the surface, eq. 4 on it {:.2f} um with "
      "a from w_d and {:.2f} um with a as seen; what the tracker sees is good to {:.2f} um, so a spline "
      "needs no more than {}; of the whole surface, {}.",
      cell.wd_um, error_of("undeformed sphere"), error_of("sphere with eq. 4 (a from w_d)"),
      error_of("sphere with eq. 4 (true a)"), seen_best,
      enough == works.end() ? "nothing tried" : enough->knob, front_sentence(works));
}

}  // namespace

DeformedCell deformed_cell(const sim::MembraneShape& shape, double R_um, double wd_um) {
  constexpr int kIntervals = 128, kParts = 8;  // of an interval
  DeformedCell cell{.R_um = R_um, .c_um = shape.c_over_R * R_um, .wd_um = wd_um, .meridian = {}, .seen = {}};
  const double tip = std::asin(shape.c_over_R), seat = kPi - std::asin(shape.seat_over_R);
  const auto arc = [&](double from, double to, int parts, double drop) {
    for (int i = 0; i < parts; ++i) {
      const double theta = from + (to - from) * i / parts;
      cell.meridian.push_back({R_um * std::cos(theta) - drop, R_um * std::sin(theta)});
    }
  };
  if (!(wd_um > 0)) {
    arc(0, kPi, 4096, 0);
    cell.meridian.emplace_back(-R_um, 0);
    return cell;
  }
  sim::MembraneSolution x;
  constexpr double kStep = 0.02;  // of R: Newton's method starts from the solution before
  const double w = wd_um / R_um;
  for (double at = std::min(kStep, w);; at = std::min(at + kStep, w)) {
    if (!sim::solve_membrane(shape, at, kIntervals, x)) {
      throw std::runtime_error(fmt::format("no equilibrium of the membrane at depth {} R", at));
    }
    if (at >= w) {
      break;
    }
  }
  cell.a_um = x.half_width * R_um;
  // The patch under the tip moves as a whole, the patch in the seat stays; between them are cubics through
  // the nodes.
  arc(0, tip, 64, wd_um);
  for (std::size_t i = 0; i + 1 < x.theta.size(); ++i) {
    const double h = x.theta[i + 1] - x.theta[i];
    for (int k = 0; k < kParts; ++k) {
      const double s = static_cast<double>(k) / kParts, s2 = s * s, s3 = s2 * s;
      const auto cubic = [&](double y0, double d0, double y1, double d1) {
        return (2 * s3 - 3 * s2 + 1) * y0 + (s3 - 2 * s2 + s) * h * d0 + (3 * s2 - 2 * s3) * y1 +
               (s3 - s2) * h * d1;
      };
      cell.meridian.push_back({R_um * cubic(x.z[i], x.dz[i], x.z[i + 1], x.dz[i + 1]),
                               R_um * cubic(x.r[i], x.dr[i], x.r[i + 1], x.dr[i + 1])});
    }
  }
  arc(seat, kPi, 512, 0);
  cell.meridian.emplace_back(-R_um, 0);
  return cell;
}

Net::Net(int along_, int around_)
    : along(along_),
      around(around_),
      points(static_cast<std::size_t>(along_) * static_cast<std::size_t>(around_)) {
  for (int j = 0; j < around; ++j) {
    cosine.push_back(std::cos(2 * kPi * j / around));
    sine.push_back(std::sin(2 * kPi * j / around));
  }
}

const std::vector<SurfaceMethod>& surface_methods() {
  static const std::vector<double> few{8, 16, 32, 64, 128, 256};
  static const std::vector<double> nets{8, 12, 16, 24, 32, 48, 64};
  static const std::vector<SurfaceMethod> rows = {
      {"undeformed sphere", "", {0}, [](const DeformedCell& d, double) { return sphere(d.R_um); }},
      {"sphere with eq. 4 (a from w_d)",
       "",
       {0},
       [](const DeformedCell& d, double) {
         const rt::LocalModelParams shipped;
         return dimpled_sphere(d.R_um, d.c_um, d.wd_um,
                               d.c_um + rt::dimple_reach(d.R_um, d.wd_um, shipped.dimple_scale));
       }},
      {"sphere with eq. 4 (true a)",
       "",
       {0},
       [](const DeformedCell& d, double) { return dimpled_sphere(d.R_um, d.c_um, d.wd_um, d.a_um); }},
      {"polygon",
       "{} nodes",
       {8, 16, 32, 64, 128, 256, 512},
       [](const DeformedCell& d, double nodes) {
         return polygon(equally_spaced(closed_contour(d), static_cast<int>(nodes)));
       }},
      {"polygon at equal angles",
       "{} nodes",
       {32, 64, 128, 256, 512},
       [](const DeformedCell& d, double nodes) {
         const Contour c = closed_contour(d);
         return polygon(vision::from_polar({}, vision::polar_radii(c, {}, static_cast<int>(nodes))));
       },
       static_cast<double>(vision::VisionConfig{}.contour_points)},
      {"periodic spline", "{} nodes", few,
       [](const DeformedCell& d, double nodes) {
         return spline(equally_spaced(closed_contour(d), static_cast<int>(nodes)));
       }},
      {"periodic spline as seen", "{} nodes", few,
       [](const DeformedCell& d, double nodes) {
         return d.seen.empty() ? Surface() : spline(equally_spaced(d.seen, static_cast<int>(nodes)));
       }},
      {"NURBS", "{} sections", nets,
       [](const DeformedCell& d, double size) {
         return nurbs(d, equally_spaced(closed_contour(d), 256), static_cast<int>(size), Normals::without);
       }},
      {"NURBS as seen", "{} sections", nets,
       [](const DeformedCell& d, double size) {
         return d.seen.empty() ? Surface() : nurbs(d, d.seen, static_cast<int>(size), Normals::without);
       },
       rt::MembraneSurface::kControlPoints},
      {"NURBS as seen, with normals", "{} sections", nets,
       [](const DeformedCell& d, double size) {
         return d.seen.empty() ? Surface() : nurbs(d, d.seen, static_cast<int>(size), Normals::with);
       }},
  };
  return rows;
}

SurfaceError surface_error(const DeformedCell& cell, const Surface& surface) {
  constexpr int kAlong = 1025, kAround = 4;
  Net net(kAlong, kAround);
  surface(net);
  SurfaceError out;
  const vision::Polyline truth(cell.meridian);
  double area = 0, sum = 0, dimple_area = 0, dimple_sum = 0;
  for (int j = 0; j <= kAround / 2; ++j) {  // above, beside and below the axis
    Contour line;
    for (int i = 0; i < kAlong; ++i) {
      const auto& p = net.points[static_cast<std::size_t>(i * kAround + j)];
      line.emplace_back(p[0], std::hypot(p[1], p[2]));
      out.max_um = std::max(out.max_um, truth.distance(line.back()));
    }
    const vision::Polyline described(std::move(line));
    for (std::size_t i = 0; i + 1 < cell.meridian.size(); ++i) {
      const Point &p = cell.meridian[i], &q = cell.meridian[i + 1];
      const double weight = 0.5 * (p.y + q.y) * cv::norm(q - p);
      const double d = described.distance(p);
      area += weight;
      sum += weight * d * d;
      out.max_um = std::max(out.max_um, d);
      if (p.y < cell.a_um && p.x > 0) {
        dimple_area += weight;
        dimple_sum += weight * d * d;
      }
    }
  }
  out.rms_um = std::sqrt(sum / area);
  out.dimple_rms_um = dimple_area > 0 ? std::sqrt(dimple_sum / dimple_area) : kNothing;
  return out;
}

Result run_surface(const Job& job) {
  job.progress.start("an injection to look at", 1);
  const std::vector<DeformedCell> cells =
      seen_cells(job.quick ? std::vector<double>{5, 20} : std::vector<double>{2, 5, 10, 15, 20});
  job.progress.step();
  const DeformedCell& deepest = cells.back();

  std::vector<Entry> entries = all_entries();
  measure_distances(entries, cells, job.progress);
  const std::vector<CallTime> times = measure_times(entries, deepest, job.quick);
  const auto works = works_by_depth(entries, times, cells.size());
  const Limit limits[] = {{"one pixel", sim::MicroscopeParams{}.pixel_m * 1e6}};

  Result out;
  out.figures.push_back(
      {.name = "surface",
       .panels = {work_precision(fmt::format("whole surface, w_d = {:.1f} um", deepest.wd_um),
                                 "rms distance [um]", works.back(), limits),
                  work_precision("worst place of all depths", "largest distance [um]",
                                 worst_works(entries, works.back()), limits),
                  meridian_panel(deepest)},
       .columns = 2,
       .note = fmt::format(
           "A call builds the description and evaluates a net of {0} x {0} points. Nodes lie on the "
           "true contour, except those of the contour as seen (noise {1} grey levels).",
           kSide, InjectionPlan{}.noise)});
  out.tables.push_back(table_of(entries, cells, works));
  out.reading = reading_of(deepest, works.back());
  return out;
}

}  // namespace punctum::report
