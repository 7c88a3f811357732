#include "vision/pipettes/cut_model.hpp"

#include <cmath>
#include <numbers>

#include "hal/math/elementary.hpp"
#include "vision/image/dispatched.hpp"
#include "vision/image/median.hpp"
#include "vision/image/quad.hpp"
#include "vision/pipettes/glass.hpp"
#include "vision/pipettes/of_blurs.hpp"
#include "vision/pipettes/shaft_blur.hpp"

namespace punctum::vision {

namespace {

constexpr double kRow_px = 1;        // along the needle
constexpr double kClearApart = 0.9;  // of the lanes beside the glass, over the blur
constexpr double kBehind_px = 14;    // behind the range, compared with every end
// In relief a line along the shaft is the slope of the light's path through a face of the glass. That slope
// is steepest at the face and goes on inwards: in the mean it lies so far from the axis, of the outer radius,
// by integrating over a tube with a bore of 0.61 of it. With one of 0.65, 0.89 and 0.55,
// the tips are as right. So far out the wall of an oblique cut ends.
constexpr double kOuterFace = 0.88, kInnerFace = 0.51;
constexpr double kUnequalWalls = 2;  // the strength of one over the other, from where on it is relief
constexpr double kCutOverWalls = 2;  // a cut that faces the light is up to so much brighter or darker

// The lanes of a row, so many; what is seen there is weighted.
struct RowLanes {
  std::size_t lanes;
  const double *weight, *tilt, *seen;
};

// Of what N things show in the lanes of a row, and of what is seen there: the sums of products, those of the
// things without their mean and slope across.
template <std::size_t N>
class RowProducts {
 public:
  [[gnu::always_inline]] void multiply(const RowLanes& row, const std::array<const double*, N>& shown) {
    std::array<Quad, N> mean{}, slope{}, seen{};
    std::array<std::array<Quad, N>, N> of_both{};
    for (std::size_t i = 0; i < row.lanes; i += kQuad) {
      Quad weight, tilt, grey;
      load(row.weight + i, weight);
      load(row.tilt + i, tilt);
      load(row.seen + i, grey);
      std::array<Quad, N> each;
      for (std::size_t a = 0; a < N; ++a) {
        load(shown[a] + i, each[a]);
      }
      for (std::size_t a = 0; a < N; ++a) {
        const Quad weighted = weight * each[a];
        mean[a] += weighted;
        slope[a] += tilt * weighted;
        seen[a] += each[a] * grey;
        for (std::size_t b = a; b < N; ++b) {
          of_both[a][b] += weighted * each[b];
        }
      }
    }
    for (std::size_t a = 0; a < N; ++a) {
      mean_[a] = sum_of(mean[a]);
      slope_[a] = sum_of(slope[a]);
      seen_[a] = sum_of(seen[a]);
      for (std::size_t b = a; b < N; ++b) {
        of_both_[a][b] = sum_of(of_both[a][b]);
      }
    }
  }
  // a <= b. weights, tilts: of the row, see CutModel.
  [[nodiscard]] double of(std::size_t a, std::size_t b, double weights, double tilts) const {
    return of_both_[a][b] - (mean_[a] * mean_[b] / weights + slope_[a] * slope_[b] / tilts);
  }
  [[nodiscard]] double with_seen(std::size_t a) const { return seen_[a]; }

 private:
  std::array<double, N> mean_{}, slope_{}, seen_{};
  std::array<std::array<double, N>, N> of_both_{};
};

PUNCTUM_WIDE_LOOP void multiply_two(const RowLanes& row, const std::array<const double*, 2>& shown,
                                    RowProducts<2>& out) {
  out.multiply(row, shown);
}
PUNCTUM_WIDE_LOOP void multiply_three(const RowLanes& row, const std::array<const double*, 3>& shown,
                                      RowProducts<3>& out) {
  out.multiply(row, shown);
}

// What the table says at (along - tangent at) / blur, for each of so many.
PUNCTUM_WIDE_LOOP void from_table(const OfBlurs& table, const double* at, std::size_t many, double along,
                                  double tangent, double blur, double* out) {
  for (std::size_t i = 0; i < many; i += kQuad) {
    Quad here;
    load(at + i, here);
    const Quad blurs = (along - tangent * here) / blur;
    const auto places = OfBlurs::places(blurs);
    for (std::size_t k = 0; k < kQuad; ++k) {
      out[i + k] = table.at_place(places[k]);
    }
  }
}

}  // namespace

double CutModel::lane_at(std::size_t lane, double half_width) const {
  const std::size_t i = lane % kOneSide;
  const double u = i < kWithin ? half_width * (static_cast<double>(i) + 0.5) / kWithin
                               : half_width + kClearApart * blur_ * (static_cast<double>(i - kWithin) + 0.5);
  return lane < kOneSide ? -u : u;
}

double CutModel::lane_width(std::size_t lane, double half_width) const {
  return lane % kOneSide < kWithin ? half_width / kWithin : kClearApart * blur_;
}

CutModel::CutModel(const GradientField& field, const NeedlePose& needle, double noise, double blur_px,
                   double back, double ahead, Shaft along, double radius)
    : half_width_(needle.half_width),
      blur_(blur_px),
      smooth_noise_(std::max(noise, 0.3) / (2 * field.sigma * std::sqrt(std::numbers::pi))),
      middle_(middle_radius_of_glass(half_width_, blur_)),
      line_behind_(kHalfOfWall * middle_) {
  constexpr double kMargin_px = 6;  // the blur of the end reaches so far
  constexpr double kLeast_grey = 1.5, kMost_noises = 0.25;
  constexpr double kLeastShaft_px = 14, kPerNoise = 4;  // px per grey level
  const double shaft_px = kShaftTo_px - kShaftFrom_px,
               told_by_px =
                   along == Shaft::all ? shaft_px : std::clamp(kPerNoise * noise, kLeastShaft_px, shaft_px);
  // What the smoothing leaves of the noise in an end of that blur: it is a peak across, a slope along.
  const double blur2 = blur_ * blur_, of_noise = blur2 / (blur2 + field.sigma * field.sigma);
  unit_ = std::max(noise * noise, 0.1) * of_noise * of_noise / kRow_px;
  std::array<Vector<double>, kAllLanes> shaft;
  for (double s = -ahead - kMargin_px; s <= back + kShaftFrom_px + told_by_px; s += kRow_px) {
    GlassRow grey{};
    const double w = needle.half_width + needle.taper * s;
    GlassRow at{};
    bool whole = true;
    for (std::size_t i = 0; i < kAllLanes && whole; ++i) {
      at[i] = lane_at(i, w);
      const Point p = needle.at(s, at[i]);
      whole = p.x > field.area.x + 1 && p.y > field.area.y + 1 && p.x < field.area.x + field.area.width - 2 &&
              p.y < field.area.y + field.area.height - 2;
      grey[i] = field.grey(p);
    }
    if (!whole) {
      break;
    }
    if (s >= back + kShaftFrom_px) {
      // Against what is clear on either side.
      const double low = 0.5 * (grey[kOneSide - 1] + grey[kOneSide - 2]),
                   high = 0.5 * (grey[kAllLanes - 1] + grey[kAllLanes - 2]);
      const double far = 0.5 * (at[kAllLanes - 1] + at[kAllLanes - 2]);
      for (std::size_t i = 0; i < kAllLanes; ++i) {
        shaft[i].push_back(grey[i] - 0.5 * (low + high) - 0.5 * (high - low) / far * at[i]);
      }
    }
    if (s <= back + kBehind_px) {
      rows_.push_back({.s = s, .half_width = w, .grey = grey, .at = at});
    }
  }
  constexpr std::size_t kFewest = 12;
  if (shaft[0].size() < kFewest) {
    return;
  }
  double square = 0, most = 0, of_wall = 0, of_low = 0, squares = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    walls_[i] = median_of(shaft[i]);
    square += walls_[i] * walls_[i] / kAllLanes;
    most = std::max(most, std::abs(walls_[i]));
    const double u = lane_at(i, half_width_), lumen = middle_ - line_behind_;
    const double near = kBumpOfBlurs((std::abs(u) - middle_) / blur_),
                 far = kBumpOfBlurs((std::abs(u) + middle_) / blur_);
    near_[i] = near / std::max(near + far, 1e-9);
    line_[i] = kStepOfBlurs((lumen - u) / blur_) - kStepOfBlurs((-lumen - u) / blur_);
    of_wall += walls_[i] * (near + far);
    of_low = i < kOneSide ? of_wall : of_low;
    squares += (near + far) * (near + far);
  }
  for (double& l : line_) {
    l *= of_wall / squares;
  }
  const double of_high = of_wall - of_low, weaker = std::min(std::abs(of_low), std::abs(of_high)),
               stronger = std::max(std::abs(of_low), std::abs(of_high));
  walls_differ_ = of_low * of_high < 0 || stronger > kUnequalWalls * weaker;
  if (radius > 0) {
    show_in_relief(radius,
                   std::copysign(std::sqrt(2 * (of_low * of_low + of_high * of_high)) / squares, of_wall));
  }
  clear_ = square > kLeast_grey * kLeast_grey && square > kMost_noises * kMost_noises * noise * noise;
  for (Seen& row : rows_) {
    weigh_without_specks(row, most);
  }
  take_off_plane();
  tell_how_even_it_is();
  for (Seen& row : rows_) {
    take_off_mean_and_slope(row);
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      square_ += row.weight[i] * row.grey[i] * row.grey[i];
      area_px2_ += row.weight[i];
      row.grey[i] *= row.weight[i];
    }
    expect_walls(row);
  }
}

// All of the cut is a line then: as bright or dark as the light's path rises there, from none to the glass.
// strength: of the walls, grey levels.
void CutModel::show_in_relief(double radius, double strength) {
  in_relief_ = true;
  radius_ = radius;
  line_behind_ = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double u = lane_at(i, half_width_);
    face_[i] = std::copysign(std::clamp(std::abs(u), kInnerFace * radius, kOuterFace * radius), u);
    line_[i] = strength * (kStepOfBlurs((radius - u) / blur_) - kStepOfBlurs((-radius - u) / blur_));
  }
}

void CutModel::expect_walls(Seen& row) const {
  double x0 = 0, x1 = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double x = walls_[i], weighted = row.weight[i] * x;
    x0 += weighted;
    x1 += weighted * row.tilt[i];
    row.walls_squared += weighted * x;
    row.walls_seen += row.grey[i] * x;
  }
  row.walls_squared -= x0 * x0 / row.weights + x1 * x1 / row.tilts;
}

// What is neither the walls nor clear is a speck, wherever the needle ends. most: of the walls, grey levels.
void CutModel::weigh_without_specks(Seen& row, double most) const {
  constexpr double kNoises = 4, kOfWalls = 0.3, kOfSpeck = 1e-3;
  const double tolerance = kNoises * smooth_noise_ + kOfWalls * most,
               of_cut = in_relief_ ? kCutOverWalls * most : 0;
  Vector<double> clear;  // beside the walls and between them
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    if (i % kOneSide >= kWithin || i % kOneSide < kLumenLanes) {
      clear.push_back(row.grey[i]);
    }
  }
  const double level = median_of(clear);
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    const double grey = row.grey[i] - level;
    const bool speck =
        grey < std::min(walls_[i], -of_cut) - tolerance || grey > std::max(walls_[i], of_cut) + tolerance;
    row.weight[i] = (speck ? kOfSpeck : 1) * lane_width(i, row.half_width);
  }
}

// Of the medium beside the needle.
void CutModel::take_off_plane() {
  cv::Matx33d a = 1e-6 * cv::Matx33d::eye();
  cv::Vec3d g;
  for (const Seen& row : rows_) {
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      if (is_beside(i)) {
        const cv::Vec3d plane(1, row.s, row.at[i]);
        a += row.weight[i] * plane * plane.t();
        g += row.weight[i] * row.grey[i] * plane;
      }
    }
  }
  const cv::Vec3d plane = a.inv() * g;
  for (Seen& row : rows_) {
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      row.grey[i] -= plane[0] + plane[1] * row.s + plane[2] * row.at[i];
    }
  }
}

// By what is beside the needle in the rows about it: a membrane across it, say.
void CutModel::tell_how_even_it_is() {
  constexpr std::size_t kAbout = 4;
  struct Uneven {
    double level, slope, of_level, of_slope;  // squared; what the noise makes of both
  };
  Vector<Uneven> uneven;
  for (const Seen& row : rows_) {
    double m0 = 0, m2 = 0, r0 = 0, r1 = 0;
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      if (is_beside(i)) {
        const double u = row.at[i], w = row.weight[i];
        m0 += w;
        m2 += w * u * u;
        r0 += w * row.grey[i];
        r1 += w * u * row.grey[i];
      }
    }
    uneven.push_back({r0 * r0 / (m0 * m0), r1 * r1 / (m2 * m2), unit_ / m0, unit_ / m2});
  }
  for (std::size_t j = 0; j < rows_.size(); ++j) {
    const std::size_t from = j > kAbout ? j - kAbout : 0, to = std::min(j + kAbout + 1, rows_.size());
    Uneven sum{};
    for (std::size_t k = from; k < to; ++k) {
      sum.level += uneven[k].level;
      sum.slope += uneven[k].slope;
      sum.of_level += uneven[k].of_level;
      sum.of_slope += uneven[k].of_slope;
    }
    const double n = static_cast<double>(to - from), doubt = std::sqrt(2 / n);
    rows_[j].even = unit_ * n / (std::max(sum.level - sum.of_level, 0.0) + doubt * sum.of_level);
    rows_[j].level = unit_ * n / (std::max(sum.slope - sum.of_slope, 0.0) + doubt * sum.of_slope);
  }
}

void CutModel::take_off_mean_and_slope(Seen& row) const {
  double middle = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    row.weights += row.weight[i];
    middle += row.weight[i] * row.at[i];
  }
  middle /= row.weights;
  double mean = 0, slope = 0;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    row.tilt[i] = row.at[i] - middle;
    row.tilts += row.weight[i] * row.tilt[i] * row.tilt[i];
    mean += row.weight[i] * row.grey[i];
    slope += row.weight[i] * row.tilt[i] * row.grey[i];
  }
  row.weights += row.even;
  row.tilts += row.level;
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    row.grey[i] -= mean / row.weights + slope / row.tilts * row.tilt[i];
  }
}

CutModel::Ends CutModel::ends_at(const CutEnd& end) const {
  const double cut_px = end.tangent * (in_relief_ ? radius_ : middle_),
               of_line_px = blur_ * std::sqrt(1 + end.tangent * end.tangent);
  return {end, cut_px, of_line_px, std::abs(cut_px) + OfBlurs::kFar * of_line_px};
}

CutModel::Shown CutModel::shown_in(const Seen& row, const Ends& ends) const {
  const double along = row.s - ends.end.at;
  Shown out;
  from_table(kBumpOfBlurs, row.at.data(), kAllLanes, along - line_behind_, ends.end.tangent, ends.of_line_px,
             out.line.data());
  if (in_relief_) {
    from_table(kStepOfBlurs, face_.data(), kAllLanes, along, ends.end.tangent, blur_, out.walls.data());
  } else {
    const double low = kStepOfBlurs((along + ends.cut_px) / blur_),
                 high = kStepOfBlurs((along - ends.cut_px) / blur_);
    for (std::size_t i = 0; i < kAllLanes; ++i) {
      const double near = i < kOneSide ? low : high, far = i < kOneSide ? high : low;
      out.walls[i] = far + near_[i] * (near - far);
    }
  }
  for (std::size_t i = 0; i < kAllLanes; ++i) {
    out.walls[i] *= walls_[i];
    out.line[i] *= line_[i];
  }
  return out;
}

CutModel::Sums<3> CutModel::sums(const CutEnd& end) const {
  Sums<3> of{cv::Matx33d::zeros(), {}};
  const Ends ends = ends_at(end);
  for (const Seen& row : rows_) {
    if (row.s < end.at - ends.reach_px) {
      continue;
    }
    if (row.s > end.at + line_behind_ + ends.reach_px) {
      const double from_end = row.s - end.at;
      of.a(0, 0) += row.walls_squared;
      of.a(0, 1) += from_end * row.walls_squared;
      of.a(1, 1) += from_end * from_end * row.walls_squared;
      of.g[0] += row.walls_seen;
      of.g[1] += from_end * row.walls_seen;
      continue;
    }
    const Shown shown = shown_in(row, ends);
    RowProducts<2> row_of;
    multiply_two({kAllLanes, row.weight.data(), row.tilt.data(), row.grey.data()},
                 {shown.walls.data(), shown.line.data()}, row_of);
    const auto product = [&](std::size_t k, std::size_t l) {
      return row_of.of(k, l, row.weights, row.tilts);
    };
    const double xx = product(0, 0), xl = product(0, 1), ll = product(1, 1), xy = row_of.with_seen(0),
                 ly = row_of.with_seen(1);
    const double from_end = std::max(0.0, row.s - end.at);
    of.a += cv::Matx33d(xx, from_end * xx, xl, from_end * xx, from_end * from_end * xx, from_end * xl, xl,
                        from_end * xl, ll);
    of.g += cv::Vec3d(xy, from_end * xy, ly);
  }
  of.a(1, 0) = of.a(0, 1);
  return of;
}

// With what is usual of walls and line.
template <int N>
double CutModel::likelier(Sums<N> of) const {
  constexpr double kStrength = 0.25,
                   kPerPx = 0.01;  // usual deviations of the walls' strength from the shaft's
  // Usual deviation of the line's strength from none, or from that of the walls. In focus it shows, and is
  // not just where a usual capillary has it; out of focus the walls merge into one.
  constexpr double kFocused = 3, kClosed = 0.15, kUnsharp_px = 2.2;
  const double sure = unit_ / (kStrength * kStrength);
  of.a(0, 0) += sure;
  of.g[0] += sure;
  of.a(1, 1) += unit_ / (kPerPx * kPerPx);
  // An open end or one that is closed by glass as strong as the walls.
  const double usual = blur_ > kUnsharp_px ? kClosed : kFocused, of_line = unit_ / (usual * usual);
  of.a(2, 2) += of_line;
  const cv::Matx<double, N, N> inverse = of.a.inv();
  const double open = (of.g.dot(inverse * of.g) - sure) / unit_;
  of.g[2] += of_line;
  const double closed = (of.g.dot(inverse * of.g) - sure - of_line) / unit_, more = std::max(open, closed);
  return more + 2 * math::log(0.5 * (1 + math::exp(-0.5 * std::abs(open - closed))));
}

// As dark or bright as it fits best.
CutModel::Sums<4> CutModel::with_speck(const Sums<3>& of_needle, const CutEnd& end,
                                       const Vector<Shown>& shown, const Speck& speck) const {
  Sums<4> of{cv::Matx44d::eye(), {}};
  for (int i = 0; i < 3; ++i) {
    of.g[i] = of_needle.g[i];
    for (int j = 0; j < 3; ++j) {
      of.a(i, j) = of_needle.a(i, j);
    }
  }
  GlassRow dark;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Seen& row = rows_[k];
    if (std::abs(row.s - speck.at) > 3 * speck.radius_px) {
      continue;
    }
    const double along = kBumpOfBlurs((row.s - speck.at) / speck.radius_px);
    from_table(kBumpOfBlurs, row.at.data(), kAllLanes, speck.aside, 1, speck.radius_px, dark.data());
    for (double& of_lane : dark) {
      of_lane *= along;
    }
    RowProducts<3> row_of;
    multiply_three({kAllLanes, row.weight.data(), row.tilt.data(), row.grey.data()},
                   {shown[k].walls.data(), shown[k].line.data(), dark.data()}, row_of);
    const auto with_speck = [&](std::size_t a) { return row_of.of(a, 2, row.weights, row.tilts); };
    of.a(0, 3) += with_speck(0);
    of.a(1, 3) += std::max(0.0, row.s - end.at) * with_speck(0);
    of.a(2, 3) += with_speck(1);
    of.a(3, 3) += with_speck(2);
    of.g[3] += row_of.with_seen(2);
  }
  for (int i = 0; i < 3; ++i) {
    of.a(3, i) = of.a(i, 3);
  }
  return of;
}

double CutModel::gain(const CutEnd& end) const { return likelier(sums(end)); }

double CutModel::gain_with_speck(const CutEnd& end, double side) const {
  constexpr double kReach_px = 14, kOffLine_px = 1;
  const Ends ends = ends_at(end);
  const Sums<3> of_needle = sums(end);
  Vector<Shown> shown;
  for (const Seen& row : rows_) {
    shown.push_back(shown_in(row, ends));
  }
  double most = likelier(of_needle);
  for (const double radius_px : {blur_, 1.5 * blur_}) {
    for (double off = -kOffLine_px; off <= kOffLine_px; off += 1) {
      for (double ahead = 0; ahead <= kReach_px; ahead += 1) {
        const Speck speck{end.at - ahead, std::copysign(middle_ + off, side), radius_px};
        most = std::max(most, likelier(with_speck(of_needle, end, shown, speck)));
      }
    }
  }
  return most;
}

}  // namespace punctum::vision
