// The picture across a contour: for every point a row of samples along its normal.
#pragma once

#include <cstddef>

#include "vision/image/contour.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/membrane/cleared_picture.hpp"

namespace punctum::vision {

// Neighbouring points lie side by side, sample by sample: a processor with wide registers computes all at
// once.
inline constexpr std::size_t kSideBySide = 8;
using Lanes = float __attribute__((vector_size(kSideBySide * sizeof(float))));

struct EdgeProfiles {
  static constexpr double kStep_px = 0.5;  // between two samples

  std::size_t points, samples, groups;
  double inside;         // px of the first sample within the contour
  Vector<Point> normal;  // outwards
  // Of a group's points sample by sample. What lies beyond the last point is not seen.
  Vector<Lanes> grey;   // without the point's mean; 0 where it is not seen
  Vector<Lanes> seen;   // 1, or 0
  Vector<int> seen_of;  // per point: samples that are seen

  // inside, outside: px of the picture that are looked at on either side of the contour.
  EdgeProfiles(const ClearedPicture& picture, const Contour& contour, double inside_px, double outside_px);

  [[nodiscard]] bool whole(std::size_t i) const { return seen_of[i] == static_cast<int>(samples); }
  [[nodiscard]] const Lanes* grey_of(std::size_t group) const { return grey.data() + group * samples; }
  [[nodiscard]] double grey_at(std::size_t point, std::size_t sample) const {
    return static_cast<double>(grey_of(point / kSideBySide)[sample][static_cast<int>(point % kSideBySide)]);
  }
  [[nodiscard]] const Lanes* seen_in(std::size_t group) const { return seen.data() + group * samples; }
  [[nodiscard]] double place_of(std::size_t sample) const {  // px from the contour
    return static_cast<double>(sample) * kStep_px - inside;
  }

  // Where the membrane is soft (1, per point) and another edge beside it nearer or further than elsewhere,
  // that is moved to its usual distance. face: where it lies, per point; height: half of its change of grey,
  // outwards. contour: of the profiles.
  void move_nearby(const Contour& contour, const Vector<double>& soft, const Contour& face, double height,
                   double blur_px);
};

}  // namespace punctum::vision
