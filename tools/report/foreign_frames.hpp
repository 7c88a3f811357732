// Injections as another renderer draws them, which is no part of this project: other people's optics, noise
// and dimple.
#pragma once

#include <filesystem>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "tools/report/simulated_frames.hpp"
#include "tools/report/vision_phases.hpp"

namespace punctum::report {

struct ForeignPlan {
  int seed = 0;
  double noise = 0;  // grey levels
  int frames = 0;    // of the whole injection
};

// Drawn by $PUNCTUM_DATA/../frames/render.py, or ../shared/frames/render.py, with Python's numpy and OpenCV.
// An error says what of it is missing. Neither the width of a dimple nor the radius of the cell is told.
[[nodiscard]] tl::expected<DrawnInjection, std::string> foreign_injection(const ForeignPlan& plan);

// Drawn beforehand: FRAMES/noise-N[,KEY=VALUE]/SEED/ holds frame_0000.png ... and truth.json, as the renderer
// writes them. In order of noise, key and seed.
struct ForeignFolder {
  PictureKind kind;
  std::filesystem::path folder;
};
[[nodiscard]] std::vector<ForeignFolder> foreign_folders(const std::filesystem::path& frames);
// Throws when something of it is missing or cannot be read.
[[nodiscard]] DrawnInjection read_foreign(const std::filesystem::path& folder);

}  // namespace punctum::report
