#include "tools/vision/truth_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vision/image/polyline.hpp"

namespace punctum::tools {
namespace {

double rms(const std::vector<double>& d) {
  double ss = 0;
  for (const double x : d) {
    ss += x * x;
  }
  return std::sqrt(ss / static_cast<double>(d.size()));
}

}  // namespace

TruthError TruthComparison::compare(const vision::Result& r, const sim::SimCamera& camera) const {
  TruthError e;
  const sim::Truth& t = camera.truth();
  if (r.needle.ok) {
    const vision::Point d = r.needle.tip - pixel(t.tip_m.x(), t.tip_m.y());
    vision::Point axis(t.axis.x(), t.axis.y());
    axis *= 1 / std::max(cv::norm(axis), 1e-9);
    e.tip_um = d.dot(axis) * um_;
    e.tip_lateral_um = axis.cross(d) * um_;
  }
  if (!t.cell) {
    return e;
  }
  if (r.outer.ok && !camera.outer().empty()) {
    std::vector<double> d = distances(r.outer.contour, camera.outer());
    e.outer_rms_um = rms(d);
    e.outer_max_um = *std::max_element(d.begin(), d.end());
    const auto p95 = d.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(d.size() - 1));
    std::nth_element(d.begin(), p95, d.end());
    e.outer_p95_um = *p95;
  }
  if (r.inner.ok && !camera.inner().empty()) {
    e.inner_rms_um = rms(distances(r.inner.contour, camera.inner()));
  }
  if (r.gap_px) {
    e.gap_um = *r.gap_px * um_ - t.gap_m * 1e6;
  }
  if (r.wd_px) {
    e.wd_um = *r.wd_px * um_ - t.wd_m * 1e6;
  }
  if (r.a_px && t.wd_m > 0) {
    e.a_um = *r.a_px * um_ - t.a_m * 1e6;
  }
  return e;
}

std::vector<double> TruthComparison::distances(const vision::Contour& seen,
                                               std::span<const std::array<double, 2>> truth) const {
  vision::Contour contour;
  for (const auto& p : truth) {
    contour.push_back(pixel(p[0], p[1]));
  }
  const vision::Polyline line(std::move(contour), true);
  std::vector<double> d;
  d.reserve(seen.size());
  for (const vision::Point& p : seen) {
    d.push_back(line.distance(p) * um_);
  }
  return d;
}

}  // namespace punctum::tools
