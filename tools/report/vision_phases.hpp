// How well the tracker and the paper's method see each membrane, the needle and the dimple in each phase of
// whole injections, in the pictures of both renderers; and how far what they say of their own errors is true.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/report/simulated_frames.hpp"
#include "tools/report/topic.hpp"

namespace punctum::report {

// Pictures that are judged together.
struct PictureKind {
  std::string renderer;  // "station" or "another"
  std::string name;      // "noise-5", "noise-5,rim=25"
  double noise = 0;      // grey levels
  double blur_px = 0;    // of the optics
  auto operator<=>(const PictureKind&) const = default;
};

class PhaseScores {
 public:
  PhaseScores();
  ~PhaseScores();
  PhaseScores(const PhaseScores&) = delete;
  PhaseScores& operator=(const PhaseScores&) = delete;

  // Both methods see the whole injection, from its first frame on.
  void see(const PictureKind& kind, const DrawnInjection& injection);
  // vision_phases: a row per kind of picture, method, membrane and phase. vision_objects: the needle's tip,
  // the depth of the dimple and the motion of the holding pipette.
  [[nodiscard]] std::vector<Table> tables() const;
  // Error over noise with the bound, bias and spread apart, success with its interval.
  [[nodiscard]] Figure figure() const;
  [[nodiscard]] std::string reading() const;

 private:
  struct Scores;
  std::unique_ptr<Scores> scores_;
};

// Wilson's interval of 95 % for a share of `good` in `all`.
struct Interval {
  double low = 0, high = 1;
};
[[nodiscard]] Interval share_interval(int good, int all);

// Cramer-Rao bound of a contour with 18 free modes over this length, when contrast, blur and background are
// known: the position of one pixel of edge along its normal has the variance 2 sqrt(pi) blur noise^2 /
// contrast^2, and the modes share the pixels.
inline constexpr int kContourModes = 18;
[[nodiscard]] double contour_bound_px(double noise, double length_px, double blur_px, double contrast);

}  // namespace punctum::report
