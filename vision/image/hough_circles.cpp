#include "vision/image/hough_circles.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

namespace {

constexpr double kCell = 0.1, kCellLeast_px = 2;  // of the smallest radius
constexpr std::size_t kVotesMax = 60000;

}  // namespace

CircleSearch::CircleSearch(const cv::Rect& area, double r_min, double r_max)
    : area_(area), r_min_(r_min), cell_(std::max(kCellLeast_px, kCell * r_min)) {
  if (area.empty() || !(r_min >= 2) || !(r_max > r_min)) {
    return;
  }
  const int w = static_cast<int>(area.width / cell_) + 1, h = static_cast<int>(area.height / cell_) + 1;
  const int layers = static_cast<int>((r_max - r_min) / cell_) + 1;
  for (int k = 0; k < layers; ++k) {
    layers_.emplace_back(cv::Mat::zeros(h, w, CV_32F));
  }
}

// One vote per edge instead of one per pixel of its width: only the ridge tops of the gradient vote. Where
// there are too many, each part of the rows gives its share of them.
void CircleSearch::vote(const GradientField& field, const cv::Mat& blocked, double threshold,
                        const cv::Range& rows) {
  if (layers_.empty()) {
    return;
  }
  const cv::Rect a = field.area;
  Vector<Vote> votes;
  const int first = std::max(rows.start, 1), end = std::min(rows.end, a.height - 1);
  if (first >= end) {
    return;
  }
  const cv::Mat lengths = field.magnitude(cv::Range(first - 1, end + 1));
  for (int y = first; y < end; ++y) {
    const auto* slope = field.slope.ptr<cv::Vec2f>(y);
    const float* m = lengths.ptr<float>(y - first + 1);
    for (int x = 1; x + 1 < a.width; ++x) {
      const double g = static_cast<double>(m[x]);
      if (g <= threshold || (!blocked.empty() && blocked.at<std::uint8_t>(y + a.y, x + a.x) > 0)) {
        continue;
      }
      const double nx = static_cast<double>(slope[x][0]) / g, ny = static_cast<double>(slope[x][1]) / g;
      const int sx = static_cast<int>(std::lround(nx)), sy = static_cast<int>(std::lround(ny));
      if (static_cast<double>(lengths.at<float>(y - first + 1 + sy, x + sx)) > g ||
          static_cast<double>(lengths.at<float>(y - first + 1 - sy, x - sx)) > g) {
        continue;
      }
      votes.push_back({Point(x + a.x, y + a.y), Point(nx, ny)});
    }
  }
  const double most = kVotesMax * std::max(end - first, 0) / static_cast<double>(a.height);
  const double stride = std::max(1.0, static_cast<double>(votes.size()) / most);
  for (double i = 0; i < static_cast<double>(votes.size()); i += stride) {
    votes_.push_back(votes[static_cast<std::size_t>(i)]);
    count(votes_.back());
  }
}

// A layer's radius is greater by one cell than that of the layer before.
void CircleSearch::count(const Vote& v) {
  constexpr double kOne = 65536;  // a cell; whole numbers are faster
  const std::int64_t w = layers_[0].cols, h = layers_[0].rows;
  const auto whole = [](double cells) { return static_cast<std::int64_t>(std::floor(cells * kOne)); };
  for (const double side : {1.0, -1.0}) {
    const Point step = side * v.n, from = (v.p - Point(area_.x, area_.y) + radius(0) * step) / cell_;
    std::int64_t x = whole(from.x), y = whole(from.y);
    const std::int64_t dx = whole(step.x), dy = whole(step.y);
    for (cv::Mat& layer : layers_) {
      const std::int64_t column = x >> 16, row = y >> 16;
      if (column >= 0 && column < w && row >= 0 && row < h) {
        layer.ptr<float>(static_cast<int>(row))[column] += 1.0F;
      }
      x += dx;
      y += dy;
    }
  }
}

// In shares of the circumference. Neighbouring layers are added up, since a membrane is not a perfect circle.
void CircleSearch::smooth() {
  Vector<cv::Mat> smoothed(layers_.size());
  for (std::size_t k = 0; k < layers_.size(); ++k) {
    layers_[k] *= 1 / radius(k);
  }
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

CircleSearch::Top CircleSearch::highest_of(const cv::Mat& layer) {
  Top top;
  cv::minMaxLoc(layer, nullptr, &top.votes, nullptr, &top.at);
  return top;
}

// The highest cell as a circle; it and what is near it are set to 0. Empty when nothing is left.
std::optional<Circle> CircleSearch::take_highest() {
  const auto highest = std::max_element(top_.begin(), top_.end(),
                                        [](const Top& a, const Top& b) { return a.votes < b.votes; });
  if (!(highest->votes > 0)) {
    return std::nullopt;
  }
  const cv::Point at = highest->at;
  Circle c;
  c.centre = Point(area_.x + (at.x + 0.5) * cell_, area_.y + (at.y + 0.5) * cell_);
  c.r = radius(static_cast<std::size_t>(highest - top_.begin()));
  const double apart = std::max(1.0, r_min_ / 3 / cell_);
  for (std::size_t k = 0; k < layers_.size(); ++k) {
    if (std::abs(radius(k) - c.r) < std::max(1.5 * cell_, 0.15 * c.r)) {
      cv::circle(layers_[k], at, static_cast<int>(apart), cv::Scalar(0), cv::FILLED);
      top_[k] = highest_of(layers_[k]);
    }
  }
  return c;
}

// Centre and radius by least squares over the votes that agree with the candidate, and their share of the
// circumference.
void CircleSearch::refine(CircleCandidate& c) const {
  constexpr int kSectors = 72;
  for (int round = 0; round < 3; ++round) {
    const double tolerance = std::max(2.5, 0.06 * c.circle.r / (1 + round));
    Vector<Point> near;
    bool voted[kSectors] = {};
    for (const Vote& v : votes_) {
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

Vector<CircleCandidate> CircleSearch::best(int wanted) {
  if (votes_.size() < 16) {
    return {};
  }
  smooth();
  top_.clear();
  for (const cv::Mat& layer : layers_) {
    top_.push_back(highest_of(layer));
  }
  Vector<CircleCandidate> out;
  for (int n = 0; n < wanted; ++n) {
    const std::optional<Circle> highest = take_highest();
    if (!highest) {
      break;
    }
    CircleCandidate c{*highest, 0};
    refine(c);
    const auto behind = std::upper_bound(
        out.begin(), out.end(), c,
        [](const CircleCandidate& l, const CircleCandidate& r) { return l.score > r.score; });
    out.insert(behind, c);
  }
  return out;
}

Vector<CircleCandidate> find_circles(const GradientField& field, const cv::Mat& blocked, double threshold,
                                     double r_min, double r_max, int wanted) {
  CircleSearch search(field.area, r_min, r_max);
  search.vote(field, blocked, threshold, cv::Range::all());
  return search.best(wanted);
}

}  // namespace punctum::vision
