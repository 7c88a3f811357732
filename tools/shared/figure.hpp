// Figures of panels, drawn by gnuplot.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace punctum::tools {

enum class Style : std::uint8_t {
  line,
  points,
  line_points,
  limit,  // dashed and grey: a known limit
  front   // broad and pale, under the others
};

struct Series {
  std::string name{};  // empty: not in the key
  std::vector<double> x{}, y{};
  Style style = Style::line;
};

// A point worth pointing at, mostly the shipped default.
struct Mark {
  double x = 0, y = 0;
  std::string label{};
};

// A stretch of the x axis, coloured over the whole height behind the lines.
struct Band {
  double from = 0, to = 0;
  std::string label{};
  int colour = 0;  // bands of one meaning have one colour
};

// Coloured cells at (x, y). With categories, `value` is an index into them, drawn in this order: green,
// amber, red, blue, grey; without, it is a scale of colours.
struct Map {
  std::vector<double> x{}, y{}, value{};
  std::vector<std::string> categories{};
  std::string value_label{};
  bool log_value = false;
};

// Lying bars, one per name, from the top; parts[k].y[i] is how much part k adds to bar i.
struct Bars {
  std::vector<std::string> names{};
  std::vector<Series> parts{};
};

struct Panel {
  std::string title{}, x_label{}, y_label{};
  bool log_x = false, log_y = false;
  std::vector<Series> series{};  // drawn over the map, where there is one
  std::vector<Mark> marks{};
  std::optional<Map> map{};
  std::optional<Bars> bars{};
  std::vector<Band> bands{};  // in order; the x axis then ends where they end
};

struct Figure {
  std::string name{};
  std::vector<Panel> panels{};
  int columns = 2;
  std::string note{};  // one sentence to stand under it
  int panel_width = 620, panel_height = 470;
};

// The name of the picture decides: .svg or .png.
[[nodiscard]] std::string gnuplot_script(const Figure& figure, const std::filesystem::path& picture);

// The error says why there is no picture; the script and the words of gnuplot then lie beside its place.
[[nodiscard]] tl::expected<void, std::string> draw(const Figure& figure,
                                                   const std::filesystem::path& picture);

}  // namespace punctum::tools
