// Injections whose every frame comes with its truth: into the simulated cell, as the simulated microscope
// shows it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hal/sim/config.hpp"
#include "vision/config.hpp"
#include "vision/image/contour.hpp"

namespace punctum::report {

enum class Stretch : std::uint8_t { approach, indentation, recoil, inside };
inline constexpr int kStretches = 4;

struct FrameTruth {
  Stretch stretch = Stretch::approach;
  vision::Contour outer, inner;         // px; the edges before blur, with the arcs that pipettes hide
  vision::Point tip, axis;              // px, unit
  vision::Point centre;                 // of the cell, px
  double wd_m = 0, a_m = 0, R_m = 0;    // NaN: not told
  std::optional<vision::Point> holder;  // the middle of the mouth, px
};

struct InjectionPlan {
  std::uint64_t seed = 1;
  double noise = 2;  // grey levels
  double aim_m = 3e-6;
  double tilt_rad = 0.03;
  double spread = 0.1;  // of the sizes of cells
  double gap_m = 25e-6;
  double approach_m_s = 25e-6, indentation_m_s = 8e-6;
  double inside_s = 0.6;  // after the recoil
};

struct DrawnInjection {
  sim::MicroscopeParams lens;  // of whatever draws: its pixels, blur and contrast
  sim::NeedleParams needle;
  std::vector<std::vector<std::uint8_t>> pixels;  // of each frame, row by row
  std::vector<FrameTruth> truth;

  [[nodiscard]] hal::Frame frame(std::size_t i) const;
  [[nodiscard]] vision::VisionConfig config() const;  // the shipped settings for this picture
};

struct SimulatedInjection : DrawnInjection {
  sim::CellParams cell;
};

// 25 frames a second, with both pipettes and both membranes.
[[nodiscard]] SimulatedInjection simulate_injection(const InjectionPlan& plan);

}  // namespace punctum::report
