// Where the manipulator's encoders had the needle's tip, from a table: samples.csv of a run, or one like it.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace punctum::tools {

class StagePoses {
 public:
  // Columns t_s, tip_x_m, tip_y_m; others do not matter. The error is one line.
  [[nodiscard]] static tl::expected<StagePoses, std::string> read(const std::string& file);

  // Between the two rows round t_s, m, microscope frame. Empty before the first row, after the last one and
  // in a gap of more than kLongestGap_s.
  [[nodiscard]] std::optional<cv::Point2d> at(double t_s) const;
  static constexpr double kLongestGap_s = 0.2;

 private:
  struct Row {
    double t_s = 0;
    cv::Point2d tip_m;
  };
  std::vector<Row> rows_;  // by rising time
};

}  // namespace punctum::tools
