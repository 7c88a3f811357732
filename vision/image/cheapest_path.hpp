// The cheapest closed path through a grid of costs, by dynamic programming.
#pragma once

#include <span>

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

// The grid has `angles` rows of at least eight `samples`; from row to row a path moves by at most
// bend.size() - 1 samples, which costs that much more: bend[0], bend[1] ... ; at most kMostReach. Returns the
// sample in each row. The path closes.
inline constexpr int kMostReach = 8;
[[nodiscard]] Vector<int> cheapest_closed_path(std::span<const float> cost, int angles, int samples,
                                               std::span<const float> bend);

}  // namespace punctum::vision
