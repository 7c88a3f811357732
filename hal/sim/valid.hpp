// What is read from the bench is checked where it is read: who writes it may be defective, and a state that
// no plant can have would be an index, a loop or a number of pixels in the reader.
#pragma once

#include "hal/sim/bench.hpp"

namespace punctum::sim {

// Every number finite and of a size that the station can hold, every enumerator one that exists.
[[nodiscard]] bool valid(const Snapshot& snapshot) noexcept;
[[nodiscard]] bool valid(const Exposure& exposure) noexcept;

// The newest valid snapshot in the bench. False: there is none.
[[nodiscard]] bool newest_valid(const Bench& bench, Snapshot& out) noexcept;

}  // namespace punctum::sim
