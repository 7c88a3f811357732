// Other people's renderer of microscope frames, in $PUNCTUM_DATA/../frames or ../shared/frames. It is no part
// of this tree, and runs with Debian's Python; scipy/ stands in for the scipy that makes it fast.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/programs.hpp"

namespace punctum::e2e {

inline std::filesystem::path renderer() {
  const char* named = std::getenv("PUNCTUM_DATA");
  return std::filesystem::path(named != nullptr ? named : "../shared/data") / "../frames/render.py";
}

inline int python(const std::vector<std::string>& arguments) {
  setenv("PYTHONPATH", PUNCTUM_SOURCE_DIR "/tests/support", 1);
  setenv("PYTHONDONTWRITEBYTECODE", "1", 1);
  return Running(arguments, "/dev/null", "python3").wait();
}

// Why it cannot draw; not others: why one that is part of this tree cannot. Or empty.
inline std::string renderer_lacks(bool others = true) {
  if (others && !std::filesystem::exists(renderer())) {
    return renderer().string() + " is not there: the renderer is not part of this tree";
  }
  return python({"-c", "import numpy, cv2"}) != 0 ? "the renderer needs python3-numpy and python3-opencv"
                                                  : "";
}

}  // namespace punctum::e2e
