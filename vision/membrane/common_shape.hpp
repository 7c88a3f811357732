// The common shape of all profiles across a membrane, and each profile's place:
// grey = level + gain (shape(s - place) + lit turning(s - place)), lit = normal . relief, in relief only.
#pragma once

#include <cstddef>
#include <cstdint>

#include "vision/image/kept_vector.hpp"
#include "vision/membrane/edge_profiles.hpp"
#include "vision/membrane/edge_shape.hpp"

namespace punctum::vision {

// Per point, of a smoothing that leaves out waves of more than `modes` periods round the contour; soft: as in
// shaped_edge.
[[nodiscard]] Vector<double> stiffness_of(double modes, const Vector<double>& soft);

// What the profiles of a group have in common with the shape: sums over the samples, weighted by trust.
struct ProfileProducts {
  Lanes one, shape, slope, shape_shape, shape_slope, slope_slope;
  Lanes grey, grey_shape, grey_slope, grey_grey;
  Lanes untrusted;  // squared slopes, not weighted
};

class CommonShape {
 public:
  // soft: per point, as in shaped_edge. stiffness: of the smoothing of the places.
  CommonShape(const EdgeProfiles& profiles, const Vector<double>& soft, const Vector<double>& stiffness,
              const EdgeShape& edge);

  // False: the profiles have no shape in common. learnt: that of the last frame, with which it begins; takes
  // this frame's.
  [[nodiscard]] bool find(EdgeLearnt& learnt);
  [[nodiscard]] const Vector<double>& shape() const { return shape_; }      // grey levels, per sample
  [[nodiscard]] const Vector<double>& turning() const { return turning_; }  // likewise; in relief only
  [[nodiscard]] const Vector<double>& places() const { return place_; }     // px, per point
  // Of the places, px^2. noise: of the picture, grey levels.
  struct Variance {
    Vector<double> all, lasting;
  };
  [[nodiscard]] Variance variance(double noise, EdgeLearnt& mean) const;

 private:
  [[nodiscard]] bool find_from(int rounds);
  void learn(EdgeLearnt& learnt);
  [[nodiscard]] bool tells_shape(std::size_t i) const;
  [[nodiscard]] Vector<std::size_t> every_second() const;  // of the points that tell the shape
  void average_first();
  void average_first_in_relief();
  void average();
  void pad(const Vector<double>& shape, Vector<float>& padded, Vector<float>& slope) const;
  void trust_samples();
  [[nodiscard]] double place_of_group(std::size_t group) const;
  [[nodiscard]] double lit(std::size_t group) const;
  void move_shape(double place_px, double lit);
  void multiply(std::size_t group, ProfileProducts& out) const;
  [[nodiscard]] bool compare(std::size_t i, const ProfileProducts& sums, double shape_energy);
  void place(std::size_t group, const ProfileProducts& sums, Vector<Lanes>& square, Vector<Lanes>& count);
  [[nodiscard]] bool place_all();
  [[nodiscard]] bool place_again();
  void average_gains();
  void smooth_places();

  const EdgeProfiles& profiles_;
  const Vector<double>&soft_, &stiffness_;
  const Vector<std::uint8_t>&beside_line_, &in_shadow_;
  double modes_, least_lasting_;
  Vector<double> lit_;  // per point; empty: not in relief
  Vector<double> shape_, turning_;
  Vector<double> spread_;  // per sample, of single profiles about it, grey levels
  Vector<float> trust_;    // per sample: the less other things differ there, the more
  Vector<double> place_, raw_, weight_, gain_, gain_raw_;
  Vector<double> robust_;                // weights of the smoothing that gave the places
  Vector<double> noise_;                 // variance of a raw place for noise of one grey level, px^2
  Vector<double> misfit_;                // grey levels, rms
  Vector<double> likeness_;              // share of the variance that is explained
  Vector<float> padded_, padded_slope_;  // the shape, going on at either end as it ends; per px
  Vector<float> padded_turning_, padded_turning_slope_;
  Vector<float> moved_shape_, moved_slope_;
  Vector<double> values_;
};

}  // namespace punctum::vision
