#include "vision/membrane/edge_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>
#include <utility>

#include "vision/image/periodic_smoothing.hpp"
#include "vision/membrane/blurred_steps.hpp"
#include "vision/membrane/common_shape.hpp"
#include "vision/membrane/edge_profiles.hpp"

namespace punctum::vision {

namespace {

constexpr double kHalo_px = 0.1;  // sd by which a halo may shift the whole contour

// The contour without finer waves, moved along the rays from its centre.
Contour smoothed(const Contour& contour, const std::vector<double>& soft, double modes) {
  const std::size_t n = contour.size();
  const Point centre = centroid(contour);
  std::vector<double> stiffness(n), r(n);
  for (std::size_t i = 0; i < n; ++i) {
    stiffness[i] = stiffness_of(modes, soft[i], n);
    r[i] = cv::norm(contour[i] - centre);
  }
  const std::vector<double> smooth = smooth_periodic(r, std::vector<double>(n, 1.0), stiffness);
  Contour out(n);
  for (std::size_t i = 0; i < n; ++i) {
    out[i] = centre + smooth[i] / std::max(r[i], 1e-9) * (contour[i] - centre);
  }
  return out;
}

}  // namespace

std::optional<SeenOutline> shaped_edge(const ClearedPicture& picture, const Contour& contour,
                                       const std::vector<double>& soft, const EdgeShape& edge,
                                       EdgeLearnt& learnt) {
  if (contour.size() < 64 || soft.size() != contour.size()) {
    return std::nullopt;
  }
  const Contour base = smoothed(contour, soft, edge.modes);
  EdgeProfiles profiles(picture, base, edge.inside, edge.outside);
  const bool apart = edge.nearby && edge.nearby_face.size() == base.size();
  if (apart && learnt.nearby_height != 0) {
    profiles.move_nearby(base, soft, edge.nearby_face, learnt.nearby_height, learnt.blur_px);
  }
  CommonShape common(profiles, soft, edge);
  const auto steps = common.find() ? BlurredSteps(common.shape(), edge).fit() : std::nullopt;
  if (!steps) {
    return std::nullopt;
  }
  if (apart) {
    constexpr double kPart = 0.3;
    const double part = learnt.nearby_height == 0 ? 1 : kPart;
    learnt.nearby_height += part * (steps->nearby_height - learnt.nearby_height);
    learnt.blur_px += part * (steps->blur_px - learnt.blur_px);
  }
  CommonShape::Variance variance = common.variance(picture.noise, learnt);
  SeenOutline out{Contour(base.size()), std::move(variance.all), std::move(variance.lasting)};
  for (std::size_t i = 0; i < base.size(); ++i) {
    if (steps->halo) {  // its shape is not known
      out.variance[i] += kHalo_px * kHalo_px;
      out.lasting[i] += kHalo_px * kHalo_px;
    }
    out.contour[i] = base[i] + (common.places()[i] + steps->own) * profiles.normal[i];
  }
  return out;
}

}  // namespace punctum::vision
