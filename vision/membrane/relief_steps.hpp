// Where an edge lies in what turns with the light, in relief: the slope of what the light crosses.
#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>

#include "vision/membrane/edge_shape.hpp"

namespace punctum::vision {

// The own face and the nearby one, blurred. A round body is crossed by light over a length that grows as the
// root of the depth below its face, and more slowly further in; of a sheet, the length jumps at its edge.
class ReliefSteps {
 public:
  // turning: grey levels, from edge.inside px within the contour outwards.
  ReliefSteps(const Vector<double>& turning, const EdgeShape& edge);

  struct Fit {
    double own = 0;   // where the own face lies, px from the contour
    double left = 0;  // rms of what the fit leaves, grey levels
  };
  // As round body or as sheet, whichever has told the edge better over the frames. flatness: log of what the
  // one leaves over what the other does, mean over the frames; this one counts as that part of it. Empty
  // where that one does not explain the edge.
  [[nodiscard]] std::optional<Fit> fit(double part, double& flatness);

 private:
  enum class Body : std::uint8_t { round, sheet };
  struct Trial {
    cv::Vec3d x;  // own place, blur, place of the nearby face against the own one
    double cost = 0;
  };
  // Of what is fitted: a level, and of either face of a round body the root and a step, of a sheet a line.
  static constexpr std::size_t kMostParts = 5;
  void show(double at, double blur, Body body, std::size_t part);
  [[nodiscard]] double cost_of(const cv::Vec3d& x, Body body);
  void go_downhill(Trial& here, Body body, double& step, int rounds);
  [[nodiscard]] Trial best_of(Body body);

  const EdgeShape& edge_;
  std::size_t samples_;
  Vector<double> turning_;  // this and the next: zeros behind the samples, to a multiple of kQuad
  std::array<Vector<double>, kMostParts> parts_;  // what each shows
};

}  // namespace punctum::vision
