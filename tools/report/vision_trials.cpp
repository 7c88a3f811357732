#include "tools/report/vision_trials.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "rt/forces/membrane.hpp"

namespace punctum::report {

namespace {

// Rms distance of the contour's points from the true line, um. Every distance is added to `each`; `worst` is
// the largest.
double contour_error_um(const vision::Contour& seen, const vision::Polyline& truth, double um, Sample& each,
                        double& worst) {
  double sum = 0;
  worst = 0;
  for (const auto& p : seen) {
    const double d = truth.distance(p) * um;
    each.add(d);
    sum += d * d;
    worst = std::max(worst, d);
  }
  return std::sqrt(sum / static_cast<double>(seen.size()));
}

// Eq. 5 at the seen dimple over eq. 5 at the true one, less one: modulus and thickness cancel.
double force_error(double wd_m, double a_m, const FrameTruth& t, double c_m) {
  constexpr double kLeastDepth_m = 3e-6;  // the rendered force is too small to be felt below it
  if (t.wd_m < kLeastDepth_m || !(a_m > c_m) || !(t.a_m > c_m)) {
    return std::nan("");
  }
  const vision::VisionConfig k;
  const auto force = [&](double w, double a) { return rt::membrane_force(k.E_Pa, k.nu, k.h_m, c_m, w, a); };
  return force(wd_m, a_m) / force(t.wd_m, t.a_m) - 1;
}

}  // namespace

void Trial::score(const vision::Result& r, const FrameTruth& t, const TrueLines& truth, double pixel_m,
                  double c_m) {
  constexpr double kGood_px = 2;  // largest error of a contour that counts as right
  const double um = pixel_m * 1e6;
  ++frames;
  seen += r.outer.ok;
  // A frame without a contour counts with the newest one; before the first one only the centre is known.
  if (r.outer.ok) {
    newest = r.outer.contour;
  }
  if (newest.empty()) {
    newest = {t.centre};
  }
  const bool moving = t.stretch == Stretch::recoil;
  Sample discarded;
  double worst = 0;
  const double rms = contour_error_um(newest, truth.outer, um, moving ? discarded : outer_points, worst);
  outer_stretch[static_cast<int>(t.stretch)].add(rms);
  if (!moving) {
    outer_frames.add(rms);
    good += r.outer.ok && worst < kGood_px * um;
  }
  if (!moving && r.inner.ok) {
    inner_frames.add(contour_error_um(r.inner.contour, truth.inner, um, inner_points, worst));
  }
  if (r.needle.ok) {
    tip.add(cv::norm(r.needle.tip - t.tip) * um);
  }
  if (r.undeformed) {
    R.add(r.undeformed->r * um - t.R_m * 1e6);
  }
  if (t.stretch == Stretch::indentation && r.wd_px) {
    wd.add(*r.wd_px * um - t.wd_m * 1e6);
    if (r.a_px) {
      a.add(*r.a_px * um - t.a_m * 1e6);
      force.add(force_error(*r.wd_px * pixel_m, *r.a_px * pixel_m, t, c_m));
    }
  }
}

CallTime call_time(const Sample& us, double overhead_us) {
  const auto net_ns = [&](double q) { return std::max(0.0, 1e3 * (us.quantile(q) - overhead_us)); };
  return {.median_ns = net_ns(0.5),
          .p99_9_ns = net_ns(0.999),
          .max_ns = net_ns(1),
          .overhead_ns = 1e3 * overhead_us,
          .batch = 1,
          .batches = static_cast<std::int64_t>(us.all.size())};
}

}  // namespace punctum::report
