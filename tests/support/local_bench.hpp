// A simulated world's segments in the memory of one process.
#pragma once

#include "hal/sim/bench.hpp"

namespace punctum::sim {

struct LocalBench : Bench {
  CameraAnswers camera;
};

}  // namespace punctum::sim
