// A band round a closed contour, and the signed edges in it as a grid of samples.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <utility>

#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

enum class Polarity : std::uint8_t {
  any,           // the sign of the edge changes round the cell, as in phase contrast
  brighter_out,  // the outside is brighter than the inside
  darker_out,
  relief,  // its sign turns with the direction of the edge, as Relief tells
};

// An edge lit from one side (Hoffman's modulation, DIC), outwards: even + along . normal. Its largest is 1.
struct Relief {
  double even = 0;
  Point along;

  // Less than 1 only where light along the edge leaves little to see.
  [[nodiscard]] double sign_at(const Point& normal) const {
    return std::clamp(2 * (even + along.dot(normal)), -1.0, 1.0);
  }
  [[nodiscard]] Relief opposite() const { return {-even, -along}; }
};

// The band that is searched: one radius per angle +- half_width.
struct EdgeBand {
  Point centre;
  Vector<double> middle;             // px, at equally spaced angles from 0
  double half_width = 8;             // px
  double step = 0.5;                 // px between samples
  double slope = 1.0;                // largest change of the offset from the middle, px per px of arc
  double stiffness = 0.25;           // cost of that change, per (px/px)^2 and angle
  Vector<double> lower, upper;       // hard limits per angle; or empty
  Vector<std::uint8_t> hidden;       // 1: nothing is visible along this ray; or empty
  Vector<double> seen_to;            // further out nothing is visible, per angle; or empty
  Relief relief;                     // for Polarity::relief
  bool measures_background = false;  // see EdgePath::background
  // CV_8U, of the whole picture; or empty. Not 0: the pixel belongs to something else (a pipette, an
  // impurity), where there is neither an edge nor a cost.
  cv::Mat covered;
  // Places that the contour passes (the needle's end face while it pushes): index of the angle, radius.
  Vector<std::pair<int, double>> anchors;
};

// Whether nothing of a picture (CV_8U) is set about those places: to look at it once, not place by place.
[[nodiscard]] bool is_clear_about(const cv::Mat& picture, std::span<const Point> places);

// The angle i runs round, the sample j outwards along its ray.
struct EdgeSamples {
  static constexpr float kForbidden = 1e6F;  // cost of a sample outside the limits

  int angles, samples, half;   // half: the sample on the middle of the band
  double arc = 0;              // between two angles, px
  Vector<float> edge;          // across the middle of the band, outwards, grey levels per px; 0: not visible
  Vector<float> cost;          // 0: visible; 1: not visible; kForbidden
  Vector<std::uint8_t> shown;  // 1: this angle is visible near the middle of the band

  EdgeSamples(const GradientField& field, const EdgeBand& band, Polarity polarity);

  [[nodiscard]] bool empty() const { return edge.empty(); }
  [[nodiscard]] std::size_t id(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(samples) + static_cast<std::size_t>(j);
  }

 private:
  struct Ray;
  void sample(const GradientField& field, const EdgeBand& band, const Ray& ray, bool may_be_covered,
              std::size_t a);
};

}  // namespace punctum::vision
