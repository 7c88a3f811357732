// The ways to see a frame that topic vision compares.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "vision/tracker.hpp"

namespace punctum::report {

// Gets one frame after the other. The result is valid until the next call.
using Observer = std::function<const vision::Result&(const hal::Frame&)>;

struct VisionMethod {
  std::string name;
  std::string knob;  // "nodes {}"
  std::vector<double> values, quick_values;
  std::function<Observer(vision::VisionConfig, double, int width, int height)> make;  // for one injection;
  // the number is the value of the knob
  int every = 1;                  // frames; more for a method that sees each frame by itself
  double shipped = std::nan("");  // value of the knob that the program ships
  bool complete = true;           // looks for everything, so that it may be compared with the others
};

// One row per method: another method is one more row.
[[nodiscard]] std::vector<VisionMethod> vision_methods();

}  // namespace punctum::report
