// obs.csv: the result of vision, one row per frame; contours.csv: its contours, one row per node; and how
// certain each node is.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "tools/shared/row_file.hpp"
#include "vision/result.hpp"

namespace punctum::tools {

// Errors against the simulated truth; empty where there is nothing to compare.
struct TruthError {
  std::optional<double> outer_rms_um, outer_p95_um,
      outer_max_um;  // of the contour's points, also on hidden arcs
  std::optional<double> inner_rms_um;
  std::optional<double> tip_um, gap_um, wd_um, a_um;  // seen minus true; the tip along the needle's axis
  std::optional<double> tip_lateral_um;
};

class ObservationCsv {
 public:
  // append: continues a file that already has the same columns. with_truth: adds the columns of TruthError.
  [[nodiscard]] static tl::expected<ObservationCsv, std::string> open(const std::string& path, bool append,
                                                                      bool with_truth);

  // offset: of the region of interest; it is added to all places in pixels.
  void row(const vision::Result& result, const vision::VisionConfig& config, double t_s, cv::Point offset,
           const TruthError* truth = nullptr);
  // A frame that could not be used.
  void row(std::uint64_t frame, double t_s, double total_us, const std::string& verdict);
  [[nodiscard]] bool flush();  // false: something could not be written, now or before
  [[nodiscard]] const std::string& failure() const noexcept { return rows_.failure(); }

  // Eq. 5 at the measured dimple; empty where w_d or a is not known.
  [[nodiscard]] static std::optional<double> force_N(const vision::Result& result,
                                                     const vision::VisionConfig& config);
  // Its standard deviation by those of w_d and a.
  [[nodiscard]] static std::optional<double> force_sd_N(const vision::Result& result,
                                                        const vision::VisionConfig& config);

 private:
  RowFile rows_;
  bool with_truth_ = false;
};

// One row per node of the contours: where it is, or the standard deviation of its place across the contour.
class ContoursCsv {
 public:
  enum class Of : std::uint8_t { place, deviation };
  [[nodiscard]] static tl::expected<ContoursCsv, std::string> open(const std::string& path, Of of);
  void rows(const vision::Result& result, cv::Point offset);
  [[nodiscard]] bool flush();
  [[nodiscard]] const std::string& failure() const noexcept { return rows_.failure(); }

 private:
  RowFile rows_;
  Of of_ = Of::place;
};

}  // namespace punctum::tools
