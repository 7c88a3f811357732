// Circular Hough transform over centre and radius: where a round membrane may be.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "vision/image/circle.hpp"
#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

struct CircleCandidate {
  Circle circle;
  double score = 0;  // share of the circumference that voted
};

// The rows of a picture may vote one part after the other.
class CircleSearch {
 public:
  // area: where the centres may be. r_min, r_max in px.
  CircleSearch(const cv::Rect& area, double r_min, double r_max);

  // Every pixel in these rows of the field whose gradient exceeds `threshold` votes along its gradient, on
  // both sides. `blocked` (CV_8U, the whole picture; or empty): pixels > 0 do not vote.
  void vote(const GradientField& field, const cv::Mat& blocked, double threshold, const cv::Range& rows);

  // Once all have voted. At most `wanted` candidates, the best first, whose centres differ by more than
  // r_min / 3 or whose radii differ by more than 15 %.
  [[nodiscard]] Vector<CircleCandidate> best(int wanted);

 private:
  struct Vote {
    Point p, n;  // pixel and unit gradient
  };
  struct Top {
    double votes = 0;
    cv::Point at;
  };
  [[nodiscard]] double radius(std::size_t layer) const {
    return r_min_ + (static_cast<double>(layer) + 0.5) * cell_;
  }
  [[nodiscard]] static Top highest_of(const cv::Mat& layer);
  void count(const Vote& v);
  void smooth();
  [[nodiscard]] std::optional<Circle> take_highest();
  void refine(CircleCandidate& c) const;

  cv::Rect area_;
  double r_min_, cell_;     // px; the cells over centre and radius are cubes
  Vector<cv::Mat> layers_;  // CV_32F, one per radius
  Vector<Top> top_;         // of each layer
  Vector<Vote> votes_;
};

// The whole field at once.
[[nodiscard]] Vector<CircleCandidate> find_circles(const GradientField& field, const cv::Mat& blocked,
                                                   double threshold, double r_min, double r_max, int wanted);

}  // namespace punctum::vision
