// punctum-vision live: the camera of a scene -> observations in the station.
#pragma once

#include <string>

namespace punctum::tools {

struct LiveOptions {
  std::string scene;     // resolved scene file
  std::string segments;  // as HandedSegments::parse() takes it; no bench: no simulated world
  std::string out;       // obs.csv; a file of the same columns is continued; empty: not written
  std::string overlay;   // folder for every kOverlayEvery-th frame and every change of phase; empty: none
};

inline constexpr int kOverlayEvery = 12;

// Runs until the camera ends or SIGTERM: 0; 1 = the camera was lost (a restart may help); 2 = bad input.
[[nodiscard]] int live(const LiveOptions& options);

}  // namespace punctum::tools
