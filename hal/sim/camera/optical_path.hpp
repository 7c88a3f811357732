// The optical path through cell, glass and specks, and the picture that oblique light makes of it (Hoffman
// modulation contrast): the slope of the path towards the light brightens, away from it darkens.
//
// Lengths in px, refractive indices above that of the medium, so that slopes have no unit. A cell is a body
// round its equator, whose slices shrink about its centre; a pipette is a tube of revolution.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "hal/sim/camera/area_raster.hpp"
#include "hal/sim/camera/blurred_layer.hpp"

namespace punctum::sim {

// A hollow pipette along a straight axis in the picture; it begins at `front` and leaves the picture.
struct Tube {
  Pixel front;
  std::array<double, 2> inwards{1, 0};  // unit vector, from the front into the tube
  double lip_px = 0;                    // rounding of the outer edge of the front
  struct Station {
    double behind_px = 0;  // along the axis from the front
    double outer_px = 0;   // radii
    double bore_px = 0;
  };
  std::array<Station, 3> stations{};  // in order; between them straight, beyond them constant
};

class OpticalPath {
 public:
  void start(const Box& picture);  // nothing but medium
  // Surfaces at the height of the focus, from outside inwards; an empty one is not there. defocus: px of blur
  // per px above or below that height.
  void add_cell(std::span<const Pixel> outer, std::span<const Pixel> zona_inner,
                std::span<const Pixel> ooplasm, const Pixel& centre, double blur_px, double defocus);
  // Glass takes the place of what the cell has there.
  void add_tube(const Tube& tube, double blur_px);
  // A round grain; the strongest slope of its path.
  void add_speck(const Pixel& centre, double sigma_px, double slope) noexcept;
  // light *= what of it passes; `towards` is the unit vector to the light, gain the relative brightness per
  // slope, blur_px the point spread.
  void shine(const std::array<double, 2>& towards, double gain, double blur_px, std::vector<float>& light);

 private:
  void add_body(std::span<const Pixel> equator, const Pixel& centre, double index, double defocus);
  void add_layer() noexcept;

  Box picture_;
  std::vector<float> path_;
  std::vector<float> index_;  // of the cell at the height of the focus
  AreaRaster raster_;
  static constexpr std::array kBlurs_px{0.0, 0.75, 1.5, 3.0, 6.0, 12.0};
  std::array<AreaRaster, kBlurs_px.size()> blurred_;  // of a cell, by how far they are out of focus
  BlurredLayer layer_;
  std::vector<Pixel> slice_;
};

}  // namespace punctum::sim
