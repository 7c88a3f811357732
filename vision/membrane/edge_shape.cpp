#include "vision/membrane/edge_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/core.hpp>
#include <utility>

#include "hal/math/elementary.hpp"
#include "vision/image/blurred_step.hpp"
#include "vision/image/median.hpp"
#include "vision/image/periodic_smoothing.hpp"

namespace punctum::vision {

namespace {

constexpr double kSample_px = 0.5;      // between two samples across the contour
constexpr int kRounds = 3;              // shape and places in turn; a fourth changes less than 0.01 px
constexpr double kMost_px = 2.5;        // a place further from the contour is another edge's
constexpr int kLeastSamples = 12;       // of a profile
constexpr double kLeastShare = 0.35;    // of the points must be seen
constexpr double kLeastLikeness = 0.5;  // median share of a profile's variance that the shape explains
constexpr double kTukey = 4.7;          // times the scale: 95 % efficiency for normally distributed errors
constexpr double kLeastScale_px = 0.05;
constexpr double kSoft = 0.02;       // of the stiffness, where the membrane may have any shape
constexpr double kGainReach = 0.04;  // of the circumference to either side, over which contrast is averaged
// A place follows the samples that tell it, so that little is left of what they err by.
constexpr double kMostTrust = 3;
constexpr double kGrain = 0.6;  // per point, for granules of about 2 px
// Of the variance of the noise: samples between pixels and the weights of the places leave so much.
constexpr double kSampledNoise = 0.5;
constexpr double kClip = 1.3;        // times the spread: Huber's limit
constexpr double kBeside = 0.1;      // weight of a place beside a line that is not its own
constexpr double kCommon_px = 0.03;  // sd of what is wrong alike all round: the steps are no perfect model
constexpr double kShapeNoise = 0.5;  // grey levels: what the common shape itself is worth
constexpr double kHalo_px = 0.1;     // sd by which a halo may shift the whole contour
// Width of a halo's line, its place outside the step, and by what that differs; of the blur.
constexpr double kHaloBlur = 1.3, kHaloAt = 1.2, kHaloTolerance = 0.2;
constexpr double kBlurFirst_px = 1.8, kBlurLeast_px = 0.6, kBlurMost_px = 5;

// Of a smoothing that leaves out waves of more than `modes` periods round the contour.
double stiffness_of(double modes, double soft, std::size_t points) {
  const double wave = static_cast<double>(points) / (2 * std::numbers::pi * modes);
  return wave * wave * (wave * wave) * math::pow(kSoft, soft);
}

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

// The picture across the contour: for every point a row of samples along its normal.
struct Profiles {
  std::size_t points, samples;
  std::vector<Point> normal;  // outwards
  std::vector<double> grey;
  std::vector<std::uint8_t> seen;
  std::vector<std::uint8_t> whole;  // per point: every sample is seen

  Profiles(const ClearedPicture& picture, const Contour& contour, const EdgeShape& edge)
      : points(contour.size()),
        samples(static_cast<std::size_t>((edge.inside + edge.outside) / kSample_px) + 1),
        normal(points),
        grey(points * samples),
        seen(points * samples),
        whole(points, 1) {
    for (std::size_t i = 0; i < points; ++i) {
      const Point along = contour[(i + 2) % points] - contour[(i + points - 2) % points];
      const double l = cv::norm(along);
      normal[i] = l > 0 ? Point(along.y / l, -along.x / l) : Point(1, 0);
      for (std::size_t j = 0; j < samples; ++j) {
        const Point p = contour[i] + (static_cast<double>(j) * kSample_px - edge.inside) * normal[i];
        const std::size_t k = i * samples + j;
        const cv::Mat& m = picture.grey;
        seen[k] = p.x >= 0 && p.y >= 0 && p.x < m.cols - 1 && p.y < m.rows - 1 && !picture.hidden(p);
        whole[i] &= seen[k];
        grey[k] = seen[k] != 0 ? sample(m, p) : 0;
      }
    }
  }

  // Where the membrane is soft and the nearby edge nearer or further than elsewhere, that is moved to its
  // usual distance, as it was learnt. contour: of the profiles.
  void move_nearby(const Contour& contour, const std::vector<double>& soft, const EdgeShape& edge,
                   const EdgeLearnt& learnt) {
    constexpr double kMoved_px = 0.7;      // what the two contours err by
    constexpr double kNotMoved_px = 0.05;  // less changes nothing
    constexpr double kApart = 2.5;
    std::vector<double> at(points);
    for (std::size_t i = 0; i < points; ++i) {
      at[i] = (edge.nearby_face[i] - contour[i]).dot(normal[i]);
    }
    const double usual = median_of(at), spread = learnt.blur_px * std::numbers::sqrt2;
    if (usual < kApart * learnt.blur_px) {  // the picture does not tell the two apart
      return;
    }
    for (std::size_t i = 0; i < points; ++i) {
      const double off = at[i] - usual, by = soft[i] * off * off * off / (kMoved_px * kMoved_px + off * off);
      for (std::size_t j = 0; j < samples && std::abs(by) > kNotMoved_px; ++j) {
        const double s = static_cast<double>(j) * kSample_px - edge.inside - at[i];
        grey[i * samples + j] +=
            learnt.nearby_height * (blurred_step((s + by) / spread) - blurred_step(s / spread));
      }
    }
  }

 private:
  static double sample(const cv::Mat& m, const Point& p) {
    const int x = static_cast<int>(p.x), y = static_cast<int>(p.y);
    const std::uint8_t *a = m.ptr<std::uint8_t>(y) + x, *b = m.ptr<std::uint8_t>(y + 1) + x;
    const double u = p.x - x, v = p.y - y;
    return (1 - v) * ((1 - u) * a[0] + u * a[1]) + v * ((1 - u) * b[0] + u * b[1]);
  }
};

// The common shape of all profiles, and each profile's place: grey = level + gain shape(s - place).
class CommonShape {
 public:
  CommonShape(const Profiles& profiles, const std::vector<double>& soft, const EdgeShape& edge)
      : profiles_(profiles),
        soft_(soft),
        beside_(edge.beside),
        modes_(edge.modes),
        least_lasting_(edge.lasting),
        shape_(profiles.samples),
        trust_(profiles.samples, 1.0),
        place_(profiles.points),
        raw_(profiles.points),
        weight_(profiles.points),
        gain_(profiles.points, 1.0),
        gain_raw_(profiles.points, 1.0),
        noise_(profiles.points),
        misfit_(profiles.points),
        likeness_(profiles.points),
        moved_shape_(profiles.samples),
        moved_slope_(profiles.samples) {}

  [[nodiscard]] bool find() {
    average();
    for (int round = 0; round < kRounds; ++round) {
      if (!place_all()) {
        return false;
      }
      average_gains();
      smooth_places();
      average();
    }
    std::vector<double> likeness;
    for (std::size_t i = 0; i < profiles_.points; ++i) {
      if (weight_[i] > 0) {
        likeness.push_back(likeness_[i]);
      }
    }
    return median_of(std::move(likeness)) > kLeastLikeness;
  }
  [[nodiscard]] const std::vector<double>& shape() const { return shape_; }   // grey levels, per sample
  [[nodiscard]] const std::vector<double>& places() const { return place_; }  // px, per point
  // Of the places, px^2. noise: of the picture, grey levels.
  struct Variance {
    std::vector<double> all, lasting;
  };
  [[nodiscard]] Variance variance(double noise, EdgeLearnt& mean) const;

 private:
  void average();
  void move_shape(double place_px);
  [[nodiscard]] bool place_all();
  [[nodiscard]] bool place(std::size_t i, double shape_energy, std::vector<double>& square,
                           std::vector<int>& count);
  void average_gains();
  void smooth_places();

  const Profiles& profiles_;
  const std::vector<double>& soft_;
  const std::vector<std::uint8_t>& beside_;
  double modes_, least_lasting_;
  std::vector<double> shape_;
  std::vector<double> trust_;   // per sample: the less other things differ there, the more
  std::vector<double> spread_;  // per sample, of single profiles about it, grey levels; empty: not known
  std::vector<double> place_, raw_, weight_, gain_, gain_raw_;
  std::vector<double> robust_, stiffness_;  // of the smoothing that gave the places
  std::vector<double> noise_;               // variance of a raw place for noise of one grey level, px^2
  std::vector<double> misfit_;              // grey levels, rms
  std::vector<double> likeness_;            // share of the variance that is explained
  std::vector<double> moved_shape_, moved_slope_, values_;
};

// Mean of the middle half: as robust as is needed against impurities, and less noisy than the median.
double middle_mean(std::vector<double>& v) {
  if (v.size() < 8) {
    return 0;
  }
  const auto quarter = static_cast<std::ptrdiff_t>(v.size() / 4);
  std::nth_element(v.begin(), v.begin() + quarter, v.end());
  std::nth_element(v.begin() + quarter, v.end() - quarter, v.end());
  double sum = 0;
  for (auto it = v.begin() + quarter; it != v.end() - quarter; ++it) {
    sum += *it;
  }
  return sum / static_cast<double>(v.end() - v.begin() - 2 * quarter);
}

// Of what is within `most` of the middle, what lies further out counts as if it lay there.
double clipped_mean(const std::vector<double>& v, double middle, double most) {
  double sum = 0;
  for (const double x : v) {
    sum += std::clamp(x, middle - most, middle + most);
  }
  return v.empty() ? 0 : sum / static_cast<double>(v.size());
}

void CommonShape::average() {
  const std::size_t m = profiles_.samples;
  std::vector<double> level(profiles_.points);
  for (std::size_t i = 0; i < profiles_.points; ++i) {
    const double* row = &profiles_.grey[i * m];
    for (std::size_t j = 0; j < m; ++j) {
      level[i] += row[j] / static_cast<double>(m);
    }
  }
  for (std::size_t j = 0; j < m; ++j) {
    values_.clear();
    for (std::size_t i = 0; i < profiles_.points; ++i) {
      if (profiles_.whole[i] != 0 && soft_[i] < 0.5) {
        const double x =
            std::clamp(static_cast<double>(j) + place_[i] / kSample_px, 0.0, static_cast<double>(m) - 1.001);
        const auto low = static_cast<std::size_t>(x);
        const double u = x - static_cast<double>(low);
        const double* row = &profiles_.grey[i * m];
        values_.push_back(((1 - u) * row[low] + u * row[low + 1] - level[i]) / gain_[i]);
      }
    }
    shape_[j] = spread_.empty() ? middle_mean(values_) : clipped_mean(values_, shape_[j], kClip * spread_[j]);
  }
}

// The shape and its slope (per px) at the samples of a profile whose place that is.
void CommonShape::move_shape(double place_px) {
  const auto m = static_cast<std::ptrdiff_t>(shape_.size());
  const double shift = place_px / kSample_px, whole = std::ceil(shift), u = whole - shift;
  const auto moved = static_cast<std::ptrdiff_t>(whole);
  const auto at = [&](std::ptrdiff_t j) {
    return shape_[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(j, 0, m - 1))];
  };
  double before = at(-moved - 1), here = at(-moved), after = at(1 - moved);
  for (std::ptrdiff_t j = 0; j < m; ++j) {
    const double next = at(j - moved + 2);
    moved_shape_[static_cast<std::size_t>(j)] = (1 - u) * here + u * after;
    moved_slope_[static_cast<std::size_t>(j)] =
        ((1 - u) * (after - before) + u * (next - here)) / (2 * kSample_px);
    before = here;
    here = after;
    after = next;
  }
}

bool CommonShape::place_all() {
  double shape_energy = 0;
  move_shape(0);
  for (const double slope : moved_slope_) {
    shape_energy += slope * slope;
  }
  if (!(shape_energy > 0)) {
    return false;
  }
  std::vector<double> square(profiles_.samples, 0.0);  // of what the shape leaves, per sample
  std::vector<int> count(profiles_.samples, 0);
  std::size_t used = 0;
  for (std::size_t i = 0; i < profiles_.points; ++i) {
    raw_[i] = place_[i];
    weight_[i] = 0;
    used += place(i, shape_energy, square, count);
  }
  double usual = 0;
  for (std::size_t j = 0; j < square.size(); ++j) {
    square[j] = count[j] > 0 ? square[j] / count[j] : 0;
    usual += square[j] / static_cast<double>(square.size());
  }
  spread_.resize(square.size());
  for (std::size_t j = 0; j < square.size(); ++j) {
    spread_[j] = std::sqrt(square[j]);
    trust_[j] = usual / std::max(square[j], usual / kMostTrust + 1e-9);
  }
  return static_cast<double>(used) >= kLeastShare * static_cast<double>(profiles_.points);
}

// One step of Gauss and Newton. False: too little of the edge is seen, or it is another one.
bool CommonShape::place(std::size_t i, double shape_energy, std::vector<double>& square,
                        std::vector<int>& count) {
  move_shape(place_[i]);
  // Weighted normal equations for level, gain and step; the derivative by the place is -gain slope. In
  // variables of their own: this is where a frame's time goes.
  double a00 = 0, a01 = 0, a02 = 0, a11 = 0, a12 = 0, a22 = 0, b_level = 0, b_gain = 0, b_step = 0;
  double energy = 0, slopes = 0;
  int n = 0;
  const std::size_t samples = profiles_.samples;
  const double g = gain_[i];
  const double *grey = &profiles_.grey[i * samples], *trust = trust_.data();
  const double *shape = moved_shape_.data(), *steep = moved_slope_.data();
  const std::uint8_t* seen = &profiles_.seen[i * samples];
  for (std::size_t j = 0; j < samples; ++j) {
    if (seen[j] == 0) {
      continue;
    }
    const double w = trust[j], t = shape[j], d = -g * steep[j], wt = w * t, wg = w * grey[j];
    a00 += w;
    a01 += wt;
    a02 += w * d;
    a11 += wt * t;
    a12 += wt * d;
    a22 += w * d * d;
    b_level += wg;
    b_gain += wg * t;
    b_step += wg * d;
    energy += wg * grey[j];
    slopes += steep[j] * steep[j];
    ++n;
  }
  if (n < kLeastSamples || slopes < 0.5 * shape_energy) {
    return false;
  }
  const cv::Matx33d a(a00, a01, a02, a01, a11, a12, a02, a12, a22);
  const cv::Vec3d b(b_level, b_gain, b_step);
  const cv::Vec3d x = a.solve(b, cv::DECOMP_CHOLESKY);
  if (!(x[1] > 0)) {
    return false;
  }
  gain_raw_[i] = std::clamp(x[1], 0.2, 5.0);
  const double spread = energy - b[0] * b[0] / a00, left = std::max(0.0, energy - x.dot(b));
  likeness_[i] = spread > 0 ? std::max(0.0, 1 - left / spread) : 0;
  misfit_[i] = std::sqrt(left / a00);
  // The place with the neighbourhood's contrast: of one profile alone contrast and place are hard to tell
  // apart.
  const double b0 = b[0] - g * a01, b2 = b[2] - g * a12;
  const double det = a00 * a22 - a02 * a02;
  if (!(det > 0)) {
    return false;
  }
  const double level = (b0 * a22 - b2 * a02) / det, step = (a00 * b2 - a02 * b0) / det;
  raw_[i] = std::clamp(place_[i] + step, -kMost_px, kMost_px);
  weight_[i] = 1;
  const double mean_slope = a02 / a00, told = det / a00;
  double doubted = 0;
  for (std::size_t j = 0; j < samples; ++j) {
    if (seen[j] != 0) {
      const double slope = g * steep[j] + mean_slope, pulled = trust[j] * slope;
      const double rest = grey[j] - level - g * (shape[j] - step * steep[j]);
      doubted += pulled * pulled;
      square[j] += rest * rest;
      ++count[j];
    }
  }
  noise_[i] = kSampledNoise * doubted / (kSample_px * told * told);
  return true;
}

void CommonShape::average_gains() {
  const std::size_t n = profiles_.points;
  const auto reach = static_cast<std::size_t>(kGainReach * static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i) {
    values_.clear();
    for (std::size_t k = n - reach; k <= n + reach; k += 2) {
      const std::size_t q = (i + k) % n;
      if (weight_[q] > 0) {
        values_.push_back(gain_raw_[q]);
      }
    }
    if (values_.size() >= 4) {
      gain_[i] = median_of(values_);
    }
  }
}

void CommonShape::smooth_places() {
  const std::size_t n = profiles_.points;
  values_.clear();
  for (std::size_t i = 0; i < n; ++i) {
    if (weight_[i] > 0) {
      values_.push_back(misfit_[i]);
    }
  }
  const double usual = std::max(median_of(values_), 1e-3);
  stiffness_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    // An impurity on the edge makes the profile fit badly, and pulls.
    const double bad = 2 * std::max(0.0, misfit_[i] / usual - 1);
    weight_[i] *= std::min(1.0, gain_[i] * gain_[i]) / (1 + bad * bad);
    if (!beside_.empty() && beside_[i] != 0) {
      weight_[i] *= kBeside;
    }
    stiffness_[i] = stiffness_of(modes_, soft_[i], n);
  }
  robust_ = weight_;
  for (int round = 0; round < 2; ++round) {
    place_ = smooth_periodic(raw_, robust_, stiffness_);
    values_.clear();
    for (std::size_t i = 0; i < n; ++i) {
      if (weight_[i] > 0) {
        values_.push_back(std::abs(raw_[i] - place_[i]));
      }
    }
    const double limit = kTukey * std::max(kSdOfMedian * median_of(values_), kLeastScale_px);
    for (std::size_t i = 0; i < n; ++i) {
      const double t = (raw_[i] - place_[i]) / limit;
      robust_[i] = std::abs(t) < 1 ? weight_[i] * std::pow(1 - t * t, 2) : 0;
    }
  }
  place_ = smooth_periodic(raw_, robust_, stiffness_);
  for (double& p : place_) {
    p = std::clamp(p, -kMost_px, kMost_px);
  }
}

// The raw places scatter by the picture's noise, which differs from point to point and from frame to frame,
// and by what is beside the edge, of which neighbours see the same and the next frames, too.
CommonShape::Variance CommonShape::variance(double noise, EdgeLearnt& mean) const {
  const std::size_t n = profiles_.points;
  double points = 0, weight = 0, square = 0, weights = 0, difference = 0, by_noise = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t next = (i + 1) % n;
    const double w = robust_[i], off = raw_[i] - place_[i];
    if (w > 0) {
      points += 1;
      weight += w;
      square += w * off * off;
      by_noise += w * noise * noise * noise_[i];
      const double both = std::sqrt(w * robust_[next]);
      weights += both;
      difference += 0.5 * both * std::pow(off - raw_[next] + place_[next], 2);
    }
  }
  constexpr int kMemory = 40;  // frames
  const double part = 1.0 / (mean.frames = std::min(mean.frames + 1, kMemory));
  mean.square += part * (square / weight - mean.square);  // some are seen, or there would be no shape
  mean.difference += part * (difference / std::max(weights, 1e-9) - mean.difference);
  by_noise /= weight;
  // What neighbours have in common falls off by kGrain from point to point. Of waves that are long against
  // its kernel K the smoothing takes all: of the scatter 2 K(0) - K * K(0), times what is in common.
  const double wave = static_cast<double>(n) / (2 * std::numbers::pi * modes_);
  double scatter = mean.square, together = 1;
  for (int round = 0; round < 4; ++round) {
    scatter = mean.square / (1 - std::min(0.6, 0.44 * together / wave));
    together = 1 + 2 / (1 - kGrain) * std::max(0.0, 1 - mean.difference / std::max(scatter, 1e-9));
  }
  scatter *= together;
  by_noise = std::min(scatter, by_noise);
  const double lasting = std::max(scatter - by_noise, least_lasting_ * scatter);
  Variance out{variance_of_smoothing(robust_, stiffness_), std::vector<double>(n)};
  for (std::size_t i = 0; i < n; ++i) {
    out.all[i] += 1 / points;  // of the steps in the mean profile
    out.lasting[i] = lasting * out.all[i] + kCommon_px * kCommon_px;
    out.all[i] = by_noise * out.all[i] + out.lasting[i];
  }
  return out;
}

// The common shape as one or two blurred steps, and a halo where there is one. Unknown are the place of the
// own step, the blur, and the places of the others against it; for given ones, level and heights follow by
// linear least squares.
class BlurredSteps {
 public:
  BlurredSteps(const std::vector<double>& shape, const EdgeShape& edge)
      : shape_(shape), edge_(edge), halo_(bright_outside(shape, edge)) {}

  struct Fit {
    double own = 0;  // where the own step lies, px from the contour
    double blur_px = 0, nearby_height = 0;
    bool halo = false;
  };
  // Empty when no such steps explain the shape.
  [[nodiscard]] std::optional<Fit> fit() {
    cv::Vec4d x(0, kBlurFirst_px, edge_.nearby ? edge_.nearby->at : 0, 1.5);
    double cost = residuals(x, now_), damping = 1e-3;
    for (int round = 0; round < 25 && damping < 1e4; ++round) {
      const cv::Vec4d y = x + step(x, damping);
      const double next = residuals(y, ahead_);
      if (!(next < cost)) {
        damping *= 10;
        continue;
      }
      const bool settled = cost - next < 1e-4 * cost;
      x = y;
      cost = next;
      now_ = ahead_;
      damping = std::max(damping / 5, 1e-6);
      if (settled) {
        break;
      }
    }
    const bool plausible = std::abs(x[0]) < kMost_px && x[1] > kBlurLeast_px && x[1] < kBlurMost_px;
    if (!plausible) {
      return std::nullopt;
    }
    (void)residuals(x, now_);
    return Fit{x[0], x[1], heights_[2], halo_};
  }

 private:
  static constexpr int kUnknown = 4;  // own place; blur; places of the nearby step and of the halo against it
  // Whether it is brighter beside the outer face of a wall than further out: the halo of a cell out of
  // perfect focus.
  static bool bright_outside(const std::vector<double>& shape, const EdgeShape& edge) {
    constexpr double kShare = 0.15;  // of what the shape spans
    constexpr std::ptrdiff_t kFarOut = 3;
    if (!edge.nearby || edge.nearby->at > 0) {
      return false;
    }
    const auto [least, most] = std::minmax_element(shape.begin(), shape.end());
    const double far = *std::max_element(shape.end() - kFarOut, shape.end());
    return *most - far > kShare * (*most - *least) &&
           static_cast<double>(most - shape.begin()) * kSample_px > edge.inside - kMost_px;
  }
  [[nodiscard]] bool free(int k) const {
    return k < 2 || (k == 2 && edge_.nearby && edge_.nearby->tolerance_px > 0) || (k == 3 && halo_);
  }
  // Returns the sum of their squares.
  double residuals(const cv::Vec4d& x, std::vector<double>& out) {
    const double blur = std::clamp(x[1], 0.3, 8.0) * std::numbers::sqrt2;
    std::vector<cv::Vec4d> column(shape_.size());
    cv::Matx44d a = cv::Matx44d::zeros();
    cv::Vec4d b = cv::Vec4d::all(0);
    for (std::size_t j = 0; j < shape_.size(); ++j) {
      const double s = static_cast<double>(j) * kSample_px - edge_.inside - x[0];
      const double z = (s - x[3]) / (kHaloBlur * std::clamp(x[1], 0.3, 8.0));
      column[j] = {1, blurred_step(s / blur), edge_.nearby ? blurred_step((s - x[2]) / blur) : 0,
                   halo_ ? math::exp(-0.5 * z * z) : 0};
      a += column[j] * column[j].t();
      b += shape_[j] * column[j];
    }
    for (int p = 0; p < kUnknown; ++p) {
      a(p, p) += 1e-9 * static_cast<double>(shape_.size());
    }
    const cv::Vec4d h = heights_ = a.solve(b, cv::DECOMP_CHOLESKY);
    out.clear();
    double cost = 0;
    for (std::size_t j = 0; j < shape_.size(); ++j) {
      out.push_back(shape_[j] - h.dot(column[j]));
      cost += out.back() * out.back();
    }
    if (free(2)) {
      out.push_back(kShapeNoise * (x[2] - edge_.nearby->at) / edge_.nearby->tolerance_px);
      cost += out.back() * out.back();
    }
    if (halo_) {
      out.push_back(kShapeNoise * (x[3] - kHaloAt * x[1]) / (kHaloTolerance * x[1]));
      cost += out.back() * out.back();
    }
    return cost;
  }
  // Of Levenberg and Marquardt, with differences.
  cv::Vec4d step(const cv::Vec4d& x, double damping) {
    constexpr double kDifference = 1e-4;
    std::array<std::vector<double>, kUnknown> slope;
    cv::Matx44d a = cv::Matx44d::eye();
    cv::Vec4d b = cv::Vec4d::all(0);
    for (int p = 0; p < kUnknown; ++p) {
      if (free(p)) {
        cv::Vec4d y = x;
        y[p] += kDifference;
        residuals(y, slope[static_cast<std::size_t>(p)]);
      }
    }
    for (int p = 0; p < kUnknown; ++p) {
      for (int q = 0; q <= p && free(p); ++q) {
        a(p, q) = 0;
        for (std::size_t j = 0; j < now_.size(); ++j) {
          a(p, q) += (slope[static_cast<std::size_t>(p)][j] - now_[j]) *
                     (slope[static_cast<std::size_t>(q)][j] - now_[j]) / (kDifference * kDifference);
        }
        a(q, p) = a(p, q);
      }
      for (std::size_t j = 0; j < now_.size() && free(p); ++j) {
        b[p] -= (slope[static_cast<std::size_t>(p)][j] - now_[j]) / kDifference * now_[j];
      }
      a(p, p) = a(p, p) * (1 + damping) + 1e-9;
    }
    cv::Vec4d d = a.solve(b, cv::DECOMP_CHOLESKY);
    for (int p = 0; p < kUnknown; ++p) {
      d[p] = free(p) ? std::clamp(d[p], -1.0, 1.0) : 0;
    }
    return d;
  }

  const std::vector<double>& shape_;
  const EdgeShape& edge_;
  bool halo_;
  std::vector<double> now_, ahead_;
  cv::Vec4d heights_;  // of the last residuals: level, own step, nearby step, halo
};

}  // namespace

std::optional<SeenOutline> shaped_edge(const ClearedPicture& picture, const Contour& contour,
                                       const std::vector<double>& soft, const EdgeShape& edge,
                                       EdgeLearnt& learnt) {
  if (contour.size() < 64 || soft.size() != contour.size()) {
    return std::nullopt;
  }
  const Contour base = smoothed(contour, soft, edge.modes);
  Profiles profiles(picture, base, edge);
  const bool apart = edge.nearby && edge.nearby_face.size() == base.size();
  if (apart && learnt.nearby_height != 0) {
    profiles.move_nearby(base, soft, edge, learnt);
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
