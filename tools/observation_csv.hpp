// obs.csv and contours.csv: what vision saw, one row per frame.
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "vision/tracker.hpp"

namespace punctum::tools {

// Against the simulated truth, in micrometres; empty where there is nothing to compare.
struct TruthError {
  std::optional<double> outer_rms_um, outer_p95_um,
      outer_max_um;  // of the contour's points, hidden arcs included
  std::optional<double> inner_rms_um;
  std::optional<double> tip_um, gap_um, wd_um, a_um;  // seen minus true; tip: along the needle's axis
  std::optional<double> tip_lateral_um;
};

class ObservationCsv {
 public:
  // append: goes on in a file that has the same columns already. with_truth: the columns of TruthError at the
  // end.
  [[nodiscard]] static tl::expected<ObservationCsv, std::string> open(const std::string& path, bool append,
                                                                      bool with_truth);

  // offset: of the region of interest, added to everything in pixels.
  void row(const vision::Result& result, const vision::VisionConfig& config, double t_s, cv::Point offset,
           const TruthError* truth = nullptr);
  // A frame that could not be worked on.
  void row(std::uint64_t frame, double t_s, double total_us, const std::string& verdict);
  [[nodiscard]] bool flush();  // false: something could not be written, now or before

  // Eq. 5 at what was measured; empty where w_d or a is not known.
  [[nodiscard]] static std::optional<double> force_N(const vision::Result& result,
                                                     const vision::VisionConfig& config);

 private:
  struct Close {
    void operator()(std::FILE* f) const noexcept { std::fclose(f); }
  };
  std::unique_ptr<std::FILE, Close> file_;
  bool with_truth_ = false;
};

class ContoursCsv {
 public:
  [[nodiscard]] static tl::expected<ContoursCsv, std::string> open(const std::string& path);
  void rows(const vision::Result& result, cv::Point offset);
  [[nodiscard]] bool flush();

 private:
  struct Close {
    void operator()(std::FILE* f) const noexcept { std::fclose(f); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace punctum::tools
