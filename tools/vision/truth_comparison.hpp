// What vision saw against what is so, where the camera is simulated.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "hal/sim/camera/sim_camera.hpp"
#include "tools/vision/observation_csv.hpp"
#include "vision/result.hpp"

namespace punctum::tools {

class TruthComparison {
 public:
  TruthComparison(const vision::VisionConfig& config, int width, int height)
      : um_(config.pixel_m * 1e6), pixel_m_(config.pixel_m), middle_((width - 1) / 2.0, (height - 1) / 2.0) {}

  [[nodiscard]] TruthError compare(const vision::Result& r, const sim::SimCamera& camera) const;

 private:
  [[nodiscard]] vision::Point pixel(double x_m, double y_m) const {
    return {x_m / pixel_m_ + middle_.x, y_m / pixel_m_ + middle_.y};
  }
  [[nodiscard]] std::vector<double> distances(const vision::Contour& seen,
                                              std::span<const std::array<double, 2>> truth) const;

  double um_, pixel_m_;
  vision::Point middle_;
};

}  // namespace punctum::tools
