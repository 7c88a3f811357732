// A part of the picture that is blurred by itself, before it is combined with the others.
#pragma once

#include <cstddef>
#include <vector>

#include "hal/sim/camera/area_raster.hpp"

namespace punctum::sim {

// Half-width of the Gaussian in standard deviations.
inline constexpr double kBlurReach = 3.5;

struct BlurredLayer {
  Box box;
  std::vector<float> value;

  void start(const Box& b) {
    box = b;
    value.resize(static_cast<std::size_t>(b.width()) * static_cast<std::size_t>(b.height()));
  }
  [[nodiscard]] float* row(int y) noexcept {
    return &value[static_cast<std::size_t>(y) * static_cast<std::size_t>(box.width())];
  }

  // In place. Beyond the border the outermost value continues.
  void blur(double sigma_px);

 private:
  std::vector<float> columns_;
  std::vector<float> kernel_;
};

}  // namespace punctum::sim
