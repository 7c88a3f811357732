#include "tools/vision/stage_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "tools/shared/csv.hpp"

namespace punctum::tools {

tl::expected<StagePoses, std::string> StagePoses::read(const std::string& file) {
  std::error_code ec;
  if (const auto there = std::filesystem::status(file, ec);
      std::filesystem::exists(there) && !std::filesystem::is_regular_file(there)) {
    return tl::unexpected(file + ": not a file");
  }
  CsvReader table(file);
  for (const char* column : {"t_s", "tip_x_m", "tip_y_m"}) {
    if (!table.has(column)) {
      return tl::unexpected(
          fmt::format("{}: no column {}; t_s, tip_x_m and tip_y_m are needed", file, column));
    }
  }
  StagePoses out;
  for (int line = 2; table.next(); ++line) {
    const auto t = table.number("t_s"), x = table.number("tip_x_m"), y = table.number("tip_y_m");
    const auto in_range = [](const std::optional<double>& v, double most) {
      return v && std::abs(*v) <= most;
    };
    constexpr double kLongest_s = 1e6, kFarthest_m = 1;
    if (!in_range(t, kLongest_s) || !in_range(x, kFarthest_m) || !in_range(y, kFarthest_m)) {
      return tl::unexpected(
          fmt::format("{}:{}: t_s, tip_x_m and tip_y_m must be numbers, at most {:g} s and {:g} m", file,
                      line, kLongest_s, kFarthest_m));
    }
    if (!out.rows_.empty() && *t <= out.rows_.back().t_s) {
      return tl::unexpected(fmt::format("{}:{}: t_s does not rise", file, line));
    }
    out.rows_.push_back({*t, {*x, *y}});
  }
  return out;
}

std::optional<cv::Point2d> StagePoses::at(double t_s) const {
  const auto after =
      std::lower_bound(rows_.begin(), rows_.end(), t_s, [](const Row& row, double t) { return row.t_s < t; });
  if (after == rows_.end()) {
    return std::nullopt;
  }
  if (after->t_s == t_s) {
    return after->tip_m;
  }
  if (after == rows_.begin() || after->t_s - (after - 1)->t_s > kLongestGap_s) {
    return std::nullopt;
  }
  const Row& before = *(after - 1);
  const double part = (t_s - before.t_s) / (after->t_s - before.t_s);
  return before.tip_m + part * (after->tip_m - before.tip_m);
}

}  // namespace punctum::tools
