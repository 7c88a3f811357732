#include "vision/image/hough_circles.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

namespace {

struct Vote {
  Point p, n;  // pixel and unit gradient
};

// One vote per edge instead of one per pixel of its width: only the ridge tops of the gradient vote.
std::vector<Vote> votes_of(const GradientField& field, const cv::Mat& blocked, double threshold) {
  constexpr std::size_t kVotesMax = 60000;
  const cv::Rect a = field.area;
  std::vector<Vote> votes;
  for (int y = 1; y + 1 < a.height; ++y) {
    const float *gx = field.gx.ptr<float>(y), *gy = field.gy.ptr<float>(y), *m = field.sobel.ptr<float>(y);
    for (int x = 1; x + 1 < a.width; ++x) {
      const double g = static_cast<double>(m[x]);
      if (g <= threshold || (!blocked.empty() && blocked.at<std::uint8_t>(y + a.y, x + a.x) > 0)) {
        continue;
      }
      const double nx = static_cast<double>(gx[x]) / g, ny = static_cast<double>(gy[x]) / g;
      const int sx = static_cast<int>(std::lround(nx)), sy = static_cast<int>(std::lround(ny));
      if (static_cast<double>(field.sobel.at<float>(y + sy, x + sx)) > g ||
          static_cast<double>(field.sobel.at<float>(y - sy, x - sx)) > g) {
        continue;
      }
      votes.push_back({Point(x + a.x, y + a.y), Point(nx, ny)});
    }
  }
  if (votes.size() <= kVotesMax) {
    return votes;
  }
  std::vector<Vote> fewer;
  const double stride = static_cast<double>(votes.size()) / kVotesMax;
  for (std::size_t i = 0; i < kVotesMax; ++i) {
    fewer.push_back(votes[static_cast<std::size_t>(static_cast<double>(i) * stride)]);
  }
  return fewer;
}

// Accumulator over centre and radius; its cells are cubes.
class Accumulator {
 public:
  Accumulator(const cv::Rect& area, double r_min, double r_max)
      : area_(area), r_min_(r_min), cell_(std::max(2.0, r_min / 14)) {
    const int w = static_cast<int>(area.width / cell_) + 1, h = static_cast<int>(area.height / cell_) + 1;
    const int layers = static_cast<int>((r_max - r_min) / cell_) + 1;
    for (int k = 0; k < layers; ++k) {
      layers_.emplace_back(cv::Mat::zeros(h, w, CV_32F));
    }
  }
  void add(const std::vector<Vote>& votes);
  void smooth();
  // The highest cell as a circle; it and what is near it are set to 0. Empty when nothing is left.
  [[nodiscard]] std::optional<Circle> take_highest();

 private:
  [[nodiscard]] double radius(std::size_t layer) const {
    return r_min_ + (static_cast<double>(layer) + 0.5) * cell_;
  }
  cv::Rect area_;
  double r_min_, cell_;
  std::vector<cv::Mat> layers_;  // one per radius
};

void Accumulator::add(const std::vector<Vote>& votes) {
  for (const Vote& v : votes) {
    for (std::size_t k = 0; k < layers_.size(); ++k) {
      const double r = radius(k);
      for (const double s : {r, -r}) {
        const double cx = v.p.x - area_.x + s * v.n.x, cy = v.p.y - area_.y + s * v.n.y;
        const int x = static_cast<int>(cx / cell_), y = static_cast<int>(cy / cell_);
        if (cx >= 0 && cy >= 0 && x < layers_[k].cols && y < layers_[k].rows) {
          layers_[k].at<float>(y, x) += static_cast<float>(1 / r);
        }
      }
    }
  }
}

// Neighbouring layers are added up, since a membrane is not a perfect circle.
void Accumulator::smooth() {
  std::vector<cv::Mat> smoothed(layers_.size());
  for (std::size_t k = 0; k < layers_.size(); ++k) {
    cv::Mat sum = layers_[k].clone();
    if (k > 0) {
      sum += 0.7 * layers_[k - 1];
    }
    if (k + 1 < layers_.size()) {
      sum += 0.7 * layers_[k + 1];
    }
    cv::GaussianBlur(sum, smoothed[k], cv::Size(5, 5), 1.2);
  }
  layers_ = std::move(smoothed);
}

std::optional<Circle> Accumulator::take_highest() {
  double highest = 0;
  std::size_t layer = 0;
  cv::Point at;
  for (std::size_t k = 0; k < layers_.size(); ++k) {
    double value = 0;
    cv::Point p;
    cv::minMaxLoc(layers_[k], nullptr, &value, nullptr, &p);
    if (value > highest) {
      highest = value;
      layer = k;
      at = p;
    }
  }
  if (!(highest > 0)) {
    return std::nullopt;
  }
  Circle c;
  c.centre = Point(area_.x + (at.x + 0.5) * cell_, area_.y + (at.y + 0.5) * cell_);
  c.r = radius(layer);
  const double apart = std::max(1.0, r_min_ / 3 / cell_);
  for (std::size_t k = 0; k < layers_.size(); ++k) {
    if (std::abs(radius(k) - c.r) < std::max(1.5 * cell_, 0.15 * c.r)) {
      cv::circle(layers_[k], at, static_cast<int>(apart), cv::Scalar(0), cv::FILLED);
    }
  }
  return c;
}

// Centre and radius by least squares over the votes that agree with the candidate, and their share of the
// circumference.
void refine_circle(const std::vector<Vote>& votes, CircleCandidate& c) {
  constexpr int kSectors = 72;
  for (int round = 0; round < 3; ++round) {
    const double tolerance = std::max(2.5, 0.06 * c.circle.r / (1 + round));
    std::vector<Point> near;
    bool voted[kSectors] = {};
    for (const Vote& v : votes) {
      const Point d = v.p - c.circle.centre;
      const double l = cv::norm(d);
      if (std::abs(l - c.circle.r) < tolerance && std::abs(d.dot(v.n)) > 0.8 * l) {
        near.push_back(v.p);
        const int s = static_cast<int>((math::atan2(d.y, d.x) / (2 * std::numbers::pi) + 0.5) * kSectors);
        voted[std::clamp(s, 0, kSectors - 1)] = true;
      }
    }
    c.score = static_cast<double>(std::count(voted, voted + kSectors, true)) / kSectors;
    if (near.size() < 12 || c.score < 0.3) {
      return;
    }
    const auto fitted = fit_circle(near);
    if (!fitted || cv::norm(fitted->centre - c.circle.centre) > 0.2 * c.circle.r ||
        std::abs(fitted->r - c.circle.r) > 0.2 * c.circle.r) {
      return;
    }
    c.circle = *fitted;
  }
}

}  // namespace

std::vector<CircleCandidate> find_circles(const GradientField& field, const cv::Mat& blocked,
                                          double threshold, double r_min, double r_max, int wanted) {
  if (field.area.empty() || !(r_min >= 2) || !(r_max > r_min) || wanted < 1) {
    return {};
  }
  const std::vector<Vote> votes = votes_of(field, blocked, threshold);
  if (votes.size() < 16) {
    return {};
  }
  Accumulator accumulator(field.area, r_min, r_max);
  accumulator.add(votes);
  accumulator.smooth();
  std::vector<CircleCandidate> out;
  for (int n = 0; n < wanted; ++n) {
    const std::optional<Circle> highest = accumulator.take_highest();
    if (!highest) {
      break;
    }
    CircleCandidate c{*highest, 0};
    refine_circle(votes, c);
    const auto behind = std::upper_bound(
        out.begin(), out.end(), c,
        [](const CircleCandidate& l, const CircleCandidate& r) { return l.score > r.score; });
    out.insert(behind, c);
  }
  return out;
}

}  // namespace punctum::vision
