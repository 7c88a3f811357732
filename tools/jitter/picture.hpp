// A result as a picture, drawn by gnuplot.
#pragma once

#include "tools/jitter/result.hpp"
#include "tools/shared/figure.hpp"

namespace punctum::jitter {

// How often each time was met, and how the wake-ups went over the measurement.
[[nodiscard]] tools::Figure picture_of(const Result& result);

}  // namespace punctum::jitter
