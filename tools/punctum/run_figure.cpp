#include "tools/punctum/run_figure.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "rt/forces/list.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/figure.hpp"

namespace punctum::tools {
namespace {

constexpr std::uint64_t kMostPoints = 6000;  // of one line

// One line of the figure: what it shows of a row.
struct Curve {
  std::size_t panel;
  std::string name;
  std::function<double(const CsvReader&)> value;
};

double cell(const CsvReader& row, const char* column) {
  return row.number(column).value_or(std::numeric_limits<double>::quiet_NaN());
}

std::vector<Curve> curves_of(const Scene& scene) {
  std::vector<Curve> curves;
  const auto add = [&curves](std::size_t panel, const char* name, const char* column, double scale) {
    curves.push_back(
        {panel, name, [column, scale](const CsvReader& row) { return scale * cell(row, column); }});
  };
  curves.push_back({0, "force", [](const CsvReader& row) {
                      return std::hypot(cell(row, "fx_N"), cell(row, "fy_N"), cell(row, "fz_N"));
                    }});
#define PUNCTUM_EFFECT(name, Class) \
  if (scene.servo.name) {           \
    add(0, #name, #name "_N", 1);   \
  }
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
  const bool simulated_cell = scene.sim && scene.sim->cell;
  if (!scene.servo.membrane && !simulated_cell) {
    for (const auto& [name, hand, tip] :
         {std::tuple{"x", "x_m", "tip_x_m"}, {"y", "y_m", "tip_y_m"}, {"z", "z_m", "tip_z_m"}}) {
      add(1, name, hand, 1e3);
      add(2, name, tip, 1e6);
    }
    return curves;
  }
  if (simulated_cell) {
    add(1, "true", "true_force_N", 1e6);
    add(2, "tip, true", "true_gap_m", -1e6);
    add(2, "dimple, true", "true_wd_m", 1e6);
  }
  if (scene.servo.membrane) {
    add(1, "estimate", "tip_force_N", 1e6);
  }
  add(2, "core", "wd_m", 1e6);
  return curves;
}

}  // namespace

tl::expected<std::string, std::string> draw_run(const std::string& folder, const Scene& scene,
                                                const Measures& m, std::uint64_t rows) {
  if (m.ticks < 2) {
    return tl::unexpected(std::string("nothing was recorded"));
  }
  const bool needle = scene.servo.membrane || (scene.sim && scene.sim->cell);
  Figure figure{.name = "figure", .panels = std::vector<Panel>(3), .columns = 1};
  figure.panel_width = 1300;
  figure.panel_height = 320;
  figure.panels[0].title = scene.name + ": force, depth and phases";
  figure.panels[0].y_label = "at the hand [N]";
  figure.panels[1].y_label = needle ? "needle force [uN]" : "hand [mm]";
  figure.panels[2].y_label = needle ? "depth [um]" : "needle tip [um]";
  figure.panels[2].x_label = "time [s]";
  for (Panel& panel : figure.panels) {
    for (const PhaseSpan& p : m.phases) {
      panel.bands.push_back({p.start_s, p.end_s, "", static_cast<int>(p.phase)});
    }
  }
  for (Band& band : figure.panels[0].bands) {
    band.label = scene.servo.phases ? rt::name(static_cast<rt::Phase>(band.colour)) : "";
  }

  const std::vector<Curve> curves = curves_of(scene);
  std::vector<Series> lines(curves.size());
  CsvReader samples(folder + "/samples.csv");
  const std::uint64_t every = std::max<std::uint64_t>(1, rows / kMostPoints);
  for (std::uint64_t row = 0; samples.next(); ++row) {
    if (row % every != 0) {
      continue;
    }
    for (std::size_t i = 0; i < curves.size(); ++i) {
      lines[i].x.push_back(cell(samples, "t_s"));
      lines[i].y.push_back(curves[i].value(samples));
    }
  }
  for (std::size_t i = 0; i < curves.size(); ++i) {
    lines[i].name = curves[i].name;
    figure.panels[curves[i].panel].series.push_back(std::move(lines[i]));
  }
  const std::string picture = folder + "/figure.png";
  if (auto drawn = draw(figure, picture); !drawn) {
    return tl::unexpected(drawn.error());
  }
  return picture;
}

}  // namespace punctum::tools
