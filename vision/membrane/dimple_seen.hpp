// Whether the needle pushes a membrane or is through it, told by the picture alone: of dimples of all
// depths and of several shapes, which has the edge of the membrane along it.
#pragma once

#include <array>
#include <optional>

#include "vision/membrane/membrane_search.hpp"

namespace punctum::vision {

struct SeenDimple {
  double depth = 0;     // px along the needle, below the outline at rest
  double evidence = 0;  // log odds of an edge along it, against none
  std::size_t shape = 0;
  bool on_tip = false;                       // it ends at the needle's tip: the needle pushes the membrane
  std::array<double, kDimpleShapes> odds{};  // of the shapes, for the next frame
};

// The likeliest. Empty where too little is visible beside the needle, or the needle does not point at the
// cell.
[[nodiscard]] std::optional<SeenDimple> likeliest_dimple(const MembraneSearch& search);

// The band of the search, laid along it.
[[nodiscard]] EdgeBand band_along(const MembraneSearch& search, const SeenDimple& dimple);

}  // namespace punctum::vision
