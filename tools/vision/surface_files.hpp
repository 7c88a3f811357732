// The membranes' surfaces of one picture as files for other programs.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/station/surface.hpp"

namespace punctum::tools {

// Writes, whole or not at all:
//   STEM.json                      the control nets, in metres
//   STEM.obj                       both membranes as triangles with normals, in micrometres
//   STEM-outer.stl, STEM-inner.stl the same, binary, a file each
// What was not reconstructed is not there; without either nothing is written. The error is one line.
[[nodiscard]] tl::expected<void, std::string> write_surface(const std::string& stem,
                                                            const rt::CellSurface& surface);

// All that write_surface() may write with this stem.
[[nodiscard]] std::vector<std::string> surface_files(const std::string& stem);

}  // namespace punctum::tools
