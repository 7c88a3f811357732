// What vision needs to know of a scene. No OpenCV here.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace punctum::vision {

enum class Method : std::uint8_t { paper, truth };  // truth: the simulated world's own, no picture drawn

enum class Side : std::uint8_t { automatic, left, right };  // of the picture's border

struct HolderVision {
  std::string template_path;  // empty: cut from the first frame or drawn from the geometry
  int window_px = 16;         // correlation is searched +- this round the last position
  double min_score = 0.6;
};

struct SnakeParams {
  int nodes = 16;
  double alpha = 0.6;  // elastic
  double beta = 0.5;   // bending
  double gamma = 1.2;  // Sobel
  int radius_px = 2;   // neighbourhood searched per step
  int iterations = 60;
};

struct VisionConfig {
  Method method = Method::paper;
  double pixel_m = 0.825e-6;
  std::optional<HolderVision> holder = HolderVision{};
  bool needle = true;                  // an injection pipette is in the scene
  Side needle_from = Side::automatic;  // the border it comes through; the holder is at the other one
  bool inner = true;                   // follow the inner membrane too
  SnakeParams snake;
  bool refine = true;        // beyond the paper: every angle of a contour is moved to the sub-pixel edge
  int contour_points = 256;  // of a closed contour, >= 128
  int dilation_px = 4;       // vertical, before the classes of pipette and cell are labelled
  double puncture_px = 1.5;  // recoil of the contact points against the needle that tells a puncture
  double R_min_m = 35e-6;    // circular Hough transform, outer membrane
  double R_max_m = 80e-6;
  double E_Pa = 35.3e3;  // for the force column of offline tracking
  double nu = 0.5;
  double h_m = 4.6e-6;
  double c_m = 3.8e-6;

  [[nodiscard]] double px(double m) const noexcept { return m / pixel_m; }
};

}  // namespace punctum::vision
