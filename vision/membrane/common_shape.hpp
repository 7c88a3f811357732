// The common shape of all profiles across a membrane, and each profile's place:
// grey = level + gain shape(s - place).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vision/membrane/edge_profiles.hpp"
#include "vision/membrane/edge_shape.hpp"

namespace punctum::vision {

// Of a smoothing that leaves out waves of more than `modes` periods round the contour; soft: as in
// shaped_edge.
[[nodiscard]] double stiffness_of(double modes, double soft, std::size_t points);

class CommonShape {
 public:
  // soft: per point, as in shaped_edge.
  CommonShape(const EdgeProfiles& profiles, const std::vector<double>& soft, const EdgeShape& edge);

  [[nodiscard]] bool find();  // false: the profiles have no shape in common
  [[nodiscard]] const std::vector<double>& shape() const { return shape_; }   // grey levels, per sample
  [[nodiscard]] const std::vector<double>& places() const { return place_; }  // px, per point
  // Of the places, px^2. noise: of the picture, grey levels.
  struct Variance {
    std::vector<double> all, lasting;
  };
  [[nodiscard]] Variance variance(double noise, EdgeLearnt& mean) const;

 private:
  // What the profiles of a group have in common with the shape: sums over the samples, weighted by trust.
  struct Products {
    Lanes one, shape, slope, shape_shape, shape_slope, slope_slope;
    Lanes grey, grey_shape, grey_slope, grey_grey;
    Lanes untrusted;  // squared slopes, not weighted
  };

  void average_first();
  void average();
  void trust_samples();
  [[nodiscard]] double place_of_group(std::size_t group) const;
  void move_shape(double place_px);
  [[nodiscard]] Products products(std::size_t group) const;
  [[nodiscard]] bool compare(std::size_t i, const Products& sums, double shape_energy);
  void place(std::size_t group, const Products& sums, std::vector<Lanes>& square, std::vector<Lanes>& count);
  [[nodiscard]] bool place_all();
  void average_gains();
  void smooth_places();

  const EdgeProfiles& profiles_;
  const std::vector<double>& soft_;
  const std::vector<std::uint8_t>& beside_;
  double modes_, least_lasting_;
  std::vector<double> shape_;
  std::vector<double> spread_;  // per sample, of single profiles about it, grey levels
  std::vector<float> trust_;    // per sample: the less other things differ there, the more
  std::vector<double> place_, raw_, weight_, gain_, gain_raw_;
  std::vector<double> robust_, stiffness_;    // of the smoothing that gave the places
  std::vector<double> noise_;                 // variance of a raw place for noise of one grey level, px^2
  std::vector<double> misfit_;                // grey levels, rms
  std::vector<double> likeness_;              // share of the variance that is explained
  std::vector<float> padded_, padded_slope_;  // the shape, going on at either end as it ends; per px
  std::vector<float> moved_shape_, moved_slope_;
  std::vector<double> values_;
};

}  // namespace punctum::vision
