// punctum-vision track: recorded frames -> obs.csv, contours.csv, overlays, surfaces.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace punctum::tools {

struct TrackOptions {
  std::string frames;                                // folder, glob, one picture or a video file
  std::string scene;                                 // built-in name or path
  std::vector<std::string> overrides;                // table.key=value
  std::string out;                                   // obs.csv
  std::string contours, deviations;                  // empty: not written
  std::string overlay;                               // folder; empty: not drawn
  std::string surface;                               // folder; empty: not reconstructed
  std::optional<double> fps;                         // none: the video's, the scene's, or 25
  std::optional<std::array<int, 4>> roi;             // x, y, width, height
  std::optional<std::array<double, 3>> seed_circle;  // x, y, r in the whole picture
  std::string poses;                                 // table of the manipulator's poses; empty: none
  std::string holder_template;                       // picture file; empty: cut from the first frame
};

// Exit code. 0: done. 1: not all that was found could be written. 2, with one line on stderr: a bad scene,
// first frame, region, seed circle, poses or template, or an output that cannot be opened, or that
// would destroy an input or another output.
[[nodiscard]] int track(const TrackOptions& options);

}  // namespace punctum::tools
