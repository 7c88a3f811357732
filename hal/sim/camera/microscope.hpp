// The simulated microscope: a picture of the cell, the two pipettes and drifting impurities, in bright field
// or with light from one side (`optical_path.hpp`).
//
// Every outline is filled with the exact area it covers of each pixel, then blurred with the point-spread
// function of its depth, so the given contours are the geometric edges before blur. It runs in the vision
// program and allocates memory.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "hal/sim/config.hpp"

namespace punctum::sim {

struct NeedleInPicture {
  Vec3 tip_m = Vec3::Zero();   // centre of the tip's end face; its z is the depth in focus
  Vec3 axis = -Vec3::UnitX();  // pointing out of the tip
};

struct CellInPicture {
  // Closed polylines in order, x and y in the world frame, first point not repeated.
  std::span<const std::array<double, 2>> outer;  // outer face of zona or chorion
  std::span<const std::array<double, 2>> inner;  // edge of ooplasm or yolk; empty: no inner membrane
  Vec3 centre_m = Vec3::Zero();  // the grain of the ooplasm is fixed to it; its z is the depth in focus
  double zona_h_m = 0;
  std::uint64_t identity = 0;  // another cell has another grain
};

// What the objective sees at one exposure. What is absent is not drawn; a value that is not finite, or
// further away than 1e6 px, counts as absent.
struct PictureScene {
  std::optional<NeedleInPicture> needle;
  std::optional<Vec3> holder_mouth_m;  // centre of its mouth; the tube enters from the left
  std::optional<CellInPicture> cell;
};

class Microscope {
 public:
  Microscope(const MicroscopeParams& params, const NeedleParams& needle,
             const std::optional<HolderParams>& holder, std::uint64_t seed);
  ~Microscope();
  Microscope(Microscope&&) noexcept;
  Microscope& operator=(Microscope&&) noexcept;

  [[nodiscard]] int width() const noexcept;
  [[nodiscard]] int height() const noexcept;

  // Fills `out` row by row with width() bytes each; does nothing if `out` is smaller than width() * height().
  // The same seed, scene and frame number give the same bytes; another number gives other noise.
  void render(const PictureScene& scene, std::uint64_t frame_number, std::span<std::uint8_t> out);

  // Standard deviation of the blur at depth z, in pixels.
  [[nodiscard]] double blur_px(double z_m) const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace punctum::sim
