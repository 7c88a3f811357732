#include "hal/sim/camera/area_raster.hpp"

#include <array>
#include <cmath>
#include <utility>

namespace punctum::sim {

Box box_of(std::span<const Pixel> line, double margin) noexcept {
  constexpr double kFar = 1e8;
  double x0 = kFar;
  double y0 = kFar;
  double x1 = -kFar;
  double y1 = -kFar;
  for (const Pixel& p : line) {
    x0 = std::min(x0, p.x);
    x1 = std::max(x1, p.x);
    y0 = std::min(y0, p.y);
    y1 = std::max(y1, p.y);
  }
  return {static_cast<int>(std::floor(x0 - margin)), static_cast<int>(std::floor(y0 - margin)),
          static_cast<int>(std::ceil(x1 + margin)) + 1, static_cast<int>(std::ceil(y1 + margin)) + 1};
}

double signed_area(std::span<const Pixel> line) noexcept {
  double twice = 0;
  for (std::size_t i = 0, j = line.size() - 1; i < line.size(); j = i++) {
    twice += line[j].x * line[i].y - line[i].x * line[j].y;
  }
  return 0.5 * twice;
}

void offset(std::span<const Pixel> line, double outwards, std::vector<Pixel>& out) {
  out.resize(line.size());
  const double side = signed_area(line) < 0 ? -outwards : outwards;
  double nx = 0;
  double ny = 0;
  const std::size_t n = line.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Pixel& before = line[i == 0 ? n - 1 : i - 1];
    const Pixel& after = line[i + 1 == n ? 0 : i + 1];
    const double tx = after.x - before.x;
    const double ty = after.y - before.y;
    const double length = std::hypot(tx, ty);
    if (length > 1e-9) {
      nx = ty / length;
      ny = -tx / length;
    }
    out[i] = {line[i].x + side * nx, line[i].y + side * ny};
  }
}

void AreaRaster::start(const Box& box) {
  box_ = box;
  stride_ = static_cast<std::size_t>(box.width()) + 2;
  sum_.assign(stride_ * static_cast<std::size_t>(box.height()), 0.0F);
}

void AreaRaster::add(std::span<const Pixel> polygon, double weight) noexcept {
  const double w = signed_area(polygon) < 0 ? weight : -weight;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    edge(polygon[j].x - box_.x0 + 0.5, polygon[j].y - box_.y0 + 0.5, polygon[i].x - box_.x0 + 0.5,
         polygon[i].y - box_.y0 + 0.5, w);
  }
}

void AreaRaster::edge(double xa, double ya, double xb, double yb, double weight) noexcept {
  if (ya == yb) {
    return;
  }
  if (ya > yb) {
    std::swap(xa, xb);
    std::swap(ya, yb);
    weight = -weight;
  }
  const double w = box_.width();
  const double h = box_.height();
  const double slope = (xb - xa) / (yb - ya);
  const double y0 = std::max(ya, 0.0);
  const double y1 = std::min(yb, h);
  if (!(y0 < y1)) {
    return;
  }
  double x0 = xa + (y0 - ya) * slope;
  double x1 = xa + (y1 - ya) * slope;
  // Cut where the edge crosses the left and right border; left of the box it counts as lying on the border.
  std::array<double, 4> cut{y0, y1, y1, y1};
  int cuts = 1;
  for (const double border : {0.0, w}) {
    if ((x0 < border) != (x1 < border)) {
      cut[static_cast<std::size_t>(cuts++)] = std::clamp(ya + (border - xa) / slope, y0, y1);
    }
  }
  if (cuts == 3 && cut[1] > cut[2]) {
    std::swap(cut[1], cut[2]);
  }
  cut[static_cast<std::size_t>(cuts)] = y1;
  for (int k = 0; k < cuts; ++k) {
    const double p = cut[static_cast<std::size_t>(k)];
    const double q = cut[static_cast<std::size_t>(k) + 1];
    if (!(p < q)) {
      continue;
    }
    const double xp = std::clamp(xa + (p - ya) * slope, 0.0, w);
    const double xq = std::clamp(xa + (q - ya) * slope, 0.0, w);
    inside(xp, p, xq, q, weight);
  }
}

// 0 <= x <= width, 0 <= y0 < y1 <= height.
void AreaRaster::inside(double x0, double y0, double x1, double y1, double weight) noexcept {
  const double slope = (x1 - x0) / (y1 - y0);
  const double w = box_.width();
  const int last = std::min(static_cast<int>(std::ceil(y1)), box_.height());
  double x = x0;
  for (int y = static_cast<int>(y0); y < last; ++y) {
    float* const a = &sum_[static_cast<std::size_t>(y) * stride_];
    const double dy = std::min(y + 1.0, y1) - std::max(static_cast<double>(y), y0);
    if (dy <= 0) {
      continue;
    }
    const double next = std::clamp(x + slope * dy, 0.0, w);
    const double d = dy * weight;
    const double left = std::min(x, next);
    const double right = std::max(x, next);
    const int i0 = static_cast<int>(left);
    const int i1 = std::max(static_cast<int>(std::ceil(right)), i0 + 1);
    if (i1 == i0 + 1) {
      const double mean = 0.5 * (left + right) - i0;
      a[i0] += static_cast<float>(d * (1 - mean));
      a[i0 + 1] += static_cast<float>(d * mean);
    } else {
      // Area right of the slanted edge in pixel i grows as the integral of the covered fraction.
      const double per = d / (right - left);
      double before = 0;
      for (int i = i0; i < i1; ++i) {
        const double l = std::max(left, static_cast<double>(i));
        const double r = std::min(right, i + 1.0);
        const double covered = per * (r - l) * (i + 1 - 0.5 * (l + r)) + per * (l - left);
        a[i] += static_cast<float>(covered - before);
        before = covered;
      }
      a[i1] += static_cast<float>(d - before);
    }
    x = next;
  }
}

}  // namespace punctum::sim
