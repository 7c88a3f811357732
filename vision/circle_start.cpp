#include "vision/circle_start.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace punctum::vision {

namespace {

struct Vote {
  Point p, n;  // pixel and unit gradient
};

// Centre and radius by least squares over the voters that agree with the candidate, and their share.
void settle(const std::vector<Vote>& votes, CircleCandidate& c) {
  constexpr int kSectors = 72;
  for (int round = 0; round < 3; ++round) {
    const double tolerance = std::max(2.5, 0.06 * c.circle.r / (1 + round));
    std::vector<Point> near;
    bool seen[kSectors] = {};
    for (const Vote& v : votes) {
      const Point d = v.p - c.circle.centre;
      const double l = cv::norm(d);
      if (std::abs(l - c.circle.r) < tolerance && std::abs(d.dot(v.n)) > 0.8 * l) {
        near.push_back(v.p);
        const int s = static_cast<int>((std::atan2(d.y, d.x) / (2 * std::numbers::pi) + 0.5) * kSectors);
        seen[std::clamp(s, 0, kSectors - 1)] = true;
      }
    }
    c.score = static_cast<double>(std::count(seen, seen + kSectors, true)) / kSectors;
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
  const cv::Rect a = field.area;
  if (a.empty() || !(r_min >= 2) || !(r_max > r_min) || wanted < 1) {
    return {};
  }
  std::vector<Vote> votes;
  // Only ridge tops of the gradient vote: one pixel per edge instead of its whole width.
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
  if (votes.size() < 16) {
    return {};
  }
  constexpr std::size_t kVotesMax = 60000;
  if (votes.size() > kVotesMax) {
    std::vector<Vote> fewer;
    const double keep = static_cast<double>(votes.size()) / kVotesMax;
    for (std::size_t i = 0; i < kVotesMax; ++i) {
      fewer.push_back(votes[static_cast<std::size_t>(static_cast<double>(i) * keep)]);
    }
    votes.swap(fewer);
  }
  const double cell = std::max(2.0, r_min / 14);
  const int w = static_cast<int>(a.width / cell) + 1, h = static_cast<int>(a.height / cell) + 1;
  const int layers = static_cast<int>((r_max - r_min) / cell) + 1;
  std::vector<cv::Mat> accumulator;
  for (int k = 0; k < layers; ++k) {
    accumulator.emplace_back(cv::Mat::zeros(h, w, CV_32F));
  }
  for (const Vote& v : votes) {
    for (int k = 0; k < layers; ++k) {
      const double r = r_min + (k + 0.5) * cell;
      for (const double s : {r, -r}) {
        const int x = static_cast<int>((v.p.x - a.x + s * v.n.x) / cell);
        const int y = static_cast<int>((v.p.y - a.y + s * v.n.y) / cell);
        if (v.p.x - a.x + s * v.n.x >= 0 && v.p.y - a.y + s * v.n.y >= 0 && x < w && y < h) {
          accumulator[static_cast<std::size_t>(k)].at<float>(y, x) += static_cast<float>(1 / r);
        }
      }
    }
  }
  // Neighbouring layers together: a membrane is not a perfect circle.
  std::vector<cv::Mat> score(accumulator.size());
  for (int k = 0; k < layers; ++k) {
    cv::Mat sum = accumulator[static_cast<std::size_t>(k)].clone();
    if (k > 0) {
      sum += 0.7 * accumulator[static_cast<std::size_t>(k - 1)];
    }
    if (k + 1 < layers) {
      sum += 0.7 * accumulator[static_cast<std::size_t>(k + 1)];
    }
    cv::GaussianBlur(sum, score[static_cast<std::size_t>(k)], cv::Size(5, 5), 1.2);
  }
  std::vector<CircleCandidate> out;
  const double apart = std::max(1.0, r_min / 3 / cell);
  for (int n = 0; n < wanted; ++n) {
    double best = 0;
    int bk = -1;
    cv::Point bp;
    for (int k = 0; k < layers; ++k) {
      double m = 0;
      cv::Point p;
      cv::minMaxLoc(score[static_cast<std::size_t>(k)], nullptr, &m, nullptr, &p);
      if (m > best) {
        best = m;
        bk = k;
        bp = p;
      }
    }
    if (bk < 0) {
      break;
    }
    CircleCandidate c;
    c.circle.centre = Point(a.x + (bp.x + 0.5) * cell, a.y + (bp.y + 0.5) * cell);
    c.circle.r = r_min + (bk + 0.5) * cell;
    for (int k = 0; k < layers; ++k) {
      const double r = r_min + (k + 0.5) * cell;
      if (std::abs(r - c.circle.r) < std::max(1.5 * cell, 0.15 * c.circle.r)) {
        cv::circle(score[static_cast<std::size_t>(k)], bp, static_cast<int>(apart), cv::Scalar(0),
                   cv::FILLED);
      }
    }
    settle(votes, c);
    out.push_back(c);
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const CircleCandidate& l, const CircleCandidate& r) { return l.score > r.score; });
  return out;
}

}  // namespace punctum::vision
