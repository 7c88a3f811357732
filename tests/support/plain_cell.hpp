#pragma once

#include "hal/sim/plant/cell.hpp"

namespace punctum::sim::test {

// At the origin, with the nominal properties.
inline CellParams uniform_cell() {
  CellParams params;
  params.centre_m = Vec3::Zero();
  params.spread = 0;
  return params;
}

inline const Cell& plain_cell() {
  static const Cell cell(uniform_cell(), NeedleParams{}, HolderParams{}, 1, 0);
  return cell;
}

}  // namespace punctum::sim::test
