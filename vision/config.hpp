// Parameters of vision, as a scene sets them. Without OpenCV, so that every program can read a scene.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/parameters.hpp"

namespace punctum::vision {

// tracker: all that goes beyond the paper, and what ships.
// paper: the paper's method and nothing else, to compare with.
// truth: the observation comes from the simulated world, and no picture is drawn.
enum class Method : std::uint8_t { paper, tracker, truth };

// Border of the picture.
enum class Side : std::uint8_t { automatic, left, right };

struct HolderVision {
  std::string template_path;  // empty: cut from the first frame
  int window_px = 16;         // the correlation is searched +- this round the last position
  double min_score = 0.6;
};
constexpr auto keys_of(const HolderVision*) {
  return hal::keys(hal::path("template", &HolderVision::template_path),
                   hal::whole("window_px", &HolderVision::window_px, 2, 400),
                   hal::real("min_score", &HolderVision::min_score, -1, 1));
}

struct SnakeParams {
  int nodes = 16;
  double alpha = 0.6;  // elastic
  double beta = 0.5;   // bending
  double gamma = 1.2;  // Sobel
  int radius_px = 2;   // of the neighbourhood that is searched in one step
  int iterations = 60;
};
constexpr auto keys_of(const SnakeParams*) {
  return hal::keys(
      hal::whole("nodes", &SnakeParams::nodes, 8, 1024), hal::real("alpha", &SnakeParams::alpha, 0, 100),
      hal::real("beta", &SnakeParams::beta, 0, 100), hal::real("gamma", &SnakeParams::gamma, 0, 100),
      hal::whole("radius_px", &SnakeParams::radius_px, 1, 20),
      hal::whole("iterations", &SnakeParams::iterations, 1, 10'000));
}

struct VisionConfig {
  Method method = Method::tracker;
  double pixel_m = 0.825e-6;
  std::optional<HolderVision> holder = HolderVision{};
  bool needle = true;                  // an injection pipette is in the scene
  Side needle_from = Side::automatic;  // the border it enters through; the holder enters through the other
  bool inner = true;                   // the inner membrane is followed too
  bool surface = false;                // the surfaces of the membranes are reconstructed
  SnakeParams snake;
  static constexpr int kLeastContourPoints = 128, kMostContourPoints = 1024;
  int contour_points = 256;  // of a closed contour
  int dilation_px = 4;  // rows of the vertical element that dilates needle and cell before they are labelled;
                        // the tracker takes one more, so that the element has a middle
  double puncture_px = 1.5;  // least recoil of the contact points against the needle at a puncture
  double R_min_m = 35e-6;    // radii of the circular Hough transform, outer membrane
  double R_max_m = 80e-6;
  double E_Pa = 35.3e3;  // this and the next three: of eq. 5, for the force of recorded frames
  double nu = 0.5;
  double h_m = 4.6e-6;
  double c_m = 3.8e-6;

  [[nodiscard]] double px(double m) const noexcept { return m / pixel_m; }
  // So many pixels in a row, and in a column, are looked at as one: pixels finer than the lens resolves blur
  // every edge over many of them, and add their noise. The wall of the membrane keeps four or more of them,
  // and the radius of the smallest cell thirty-three. The keys in px count pixels that are binned.
  [[nodiscard]] int binning() const noexcept {
    constexpr double kWall_px = 4.5, kCell_px = 33, kMost = 16;
    return static_cast<int>(std::clamp(std::min(px(h_m) / kWall_px, px(R_min_m) / kCell_px), 1.0, kMost));
  }
};
constexpr auto keys_of(const VisionConfig*) {
  return hal::keys(hal::choice("method", &VisionConfig::method, "paper", "tracker", "truth"),
                   hal::flag("needle", &VisionConfig::needle),
                   hal::choice("needle_from", &VisionConfig::needle_from, "automatic", "left", "right"),
                   hal::flag("inner", &VisionConfig::inner), hal::flag("surface", &VisionConfig::surface),
                   hal::whole("contour_points", &VisionConfig::contour_points,
                              VisionConfig::kLeastContourPoints, VisionConfig::kMostContourPoints),
                   hal::whole("dilation_px", &VisionConfig::dilation_px, 0, 40),
                   hal::real("puncture_px", &VisionConfig::puncture_px, 0.1, 50),
                   hal::micro("radius_min_um", &VisionConfig::R_min_m, 1, 5000),
                   hal::micro("radius_max_um", &VisionConfig::R_max_m, 1, 5000));
}

}  // namespace punctum::vision
