#include "vision/membrane/edge_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/periodic_smoothing.hpp"
#include "vision/membrane/blurred_steps.hpp"
#include "vision/membrane/common_shape.hpp"
#include "vision/membrane/edge_profiles.hpp"
#include "vision/membrane/relief_steps.hpp"

namespace punctum::vision {

namespace {

constexpr double kHalo_px = 0.1;    // sd by which a halo may shift the whole contour
constexpr double kFocus_px = 1.6;   // blur, with the pixels' own, of a picture that is in focus
constexpr double kRelief_px = 0.3;  // sd by which relief may: the form of a face is known only roughly

// The contour without finer waves, moved along the rays from its centre.
Contour smoothed(const Contour& contour, const Vector<double>& stiffness) {
  const std::size_t n = contour.size();
  const Point centre = centroid(contour);
  Vector<double> r(n);
  for (std::size_t i = 0; i < n; ++i) {
    r[i] = cv::norm(contour[i] - centre);
  }
  const Vector<double> smooth = smooth_periodic(r, Vector<double>(n, 1.0), stiffness);
  Contour out(n);
  for (std::size_t i = 0; i < n; ++i) {
    out[i] = centre + smooth[i] / std::max(r[i], 1e-9) * (contour[i] - centre);
  }
  return out;
}

// own: where the edge lies in the common shape, px; own_sd: by which that may be wrong all round.
SeenOutline outline(const Contour& base, const EdgeProfiles& profiles, const CommonShape& common, double own,
                    double own_sd, double noise, EdgeLearnt& learnt) {
  CommonShape::Variance variance = common.variance(noise, learnt);
  SeenOutline out{Contour(base.size()), std::move(variance.all), std::move(variance.lasting)};
  for (std::size_t i = 0; i < base.size(); ++i) {
    out.variance[i] += own_sd * own_sd;
    out.lasting[i] += own_sd * own_sd;
    out.contour[i] = base[i] + (common.places()[i] + own) * profiles.normal[i];
  }
  return out;
}

double waves_of(const EdgeShape& edge, const EdgeLearnt& learnt) {
  return edge.modes * (edge.granular ? kFocus_px / std::max(kFocus_px, learnt.own_blur_px) : 1);
}

std::optional<SeenOutline> shaped_once(const ClearedPicture& picture, const Contour& contour,
                                       const Vector<double>& soft, const EdgeShape& edge,
                                       EdgeLearnt& learnt) {
  const Vector<double> stiffness = stiffness_of(waves_of(edge, learnt), soft);
  const Contour base = smoothed(contour, stiffness);
  EdgeProfiles profiles(picture, base, edge.inside, edge.outside);
  const bool apart = edge.nearby && edge.nearby_face.size() == base.size();
  if (apart && learnt.nearby_height != 0) {
    profiles.move_nearby(base, soft, edge.nearby_face, learnt.nearby_height, learnt.blur_px);
  }
  CommonShape common(profiles, soft, stiffness, edge);
  if (!common.find(learnt)) {
    return std::nullopt;
  }
  if (edge.relief != Point(0, 0)) {
    const auto steps = ReliefSteps(common.turning(), edge).fit(1.0 / (learnt.frames + 1), learnt.flatness);
    if (!steps) {
      learnt.shape.clear();
      return std::nullopt;
    }
    learnt.relief = edge.relief;
    learnt.inside = edge.inside;
    learnt.face += steps->own;
    return outline(base, profiles, common, steps->own, kRelief_px, picture.noise, learnt);
  }
  const auto steps = BlurredSteps(common.shape(), edge).fit(learnt.steps);
  if (!steps) {
    return std::nullopt;
  }
  constexpr double kPart = 0.3;
  learnt.blur_now_px = steps->blur_px;
  learnt.own_blur_px += (learnt.own_blur_px == 0 ? 1 : kPart) * (steps->blur_px - learnt.own_blur_px);
  if (apart) {
    const double part = learnt.nearby_height == 0 ? 1 : kPart;
    learnt.nearby_height += part * (steps->nearby_height - learnt.nearby_height);
    learnt.blur_px += part * (steps->blur_px - learnt.blur_px);
  }
  learnt.halo = steps->halo;
  learnt.steps = steps->unknowns;
  learnt.inside = edge.inside;
  learnt.face += steps->own;
  const double blurred = edge.per_blur * std::max(0.0, steps->blur_px - kFocus_px);
  return outline(base, profiles, common, steps->own, math::hypot(steps->halo ? kHalo_px : 0, blurred),
                 picture.noise, learnt);
}

}  // namespace

double grey_beside_face(const EdgeLearnt& edge, const Point& outwards, double outside_px) {
  const double last = static_cast<double>(edge.shape.size() - 1),
               at = std::clamp((edge.inside + edge.face + outside_px) / EdgeProfiles::kStep_px, 0.0, last);
  const auto i = static_cast<std::size_t>(std::min(at, last - 1));
  const auto of = [&](const Vector<double>& v) {
    return v[i] + (at - static_cast<double>(i)) * (v[i + 1] - v[i]) - v.back();
  };
  return of(edge.shape) + (edge.turning.empty() ? 0 : outwards.dot(edge.relief) * of(edge.turning));
}

std::optional<SeenOutline> shaped_edge(const ClearedPicture& picture, const Contour& contour,
                                       const Vector<double>& soft, const EdgeShape& edge,
                                       EdgeLearnt& learnt) {
  if (contour.size() < 64 || soft.size() != contour.size()) {
    return std::nullopt;
  }
  constexpr double kClearly = 0.9;
  const bool blur_known = learnt.own_blur_px > 0;
  auto shaped = shaped_once(picture, contour, soft, edge, learnt);
  if (shaped && !blur_known && waves_of(edge, learnt) < kClearly * edge.modes) {
    if (auto again = shaped_once(picture, contour, soft, edge, learnt)) {
      return again;
    }
  }
  return shaped;
}

}  // namespace punctum::vision
