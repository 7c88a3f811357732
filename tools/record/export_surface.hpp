// The surfaces of the membranes at one moment of a recording.
#pragma once

#include <optional>
#include <string>
#include <tl/expected.hpp>

namespace punctum::tools {

// Those that vision told nearest to a time of the run (none: the last ones): STEM.obj and what else
// tools/vision/surface_files.hpp writes. The value: why the recording is not the whole run, in a line; empty
// if it is. The error is one line: nothing could be read or written.
[[nodiscard]] tl::expected<std::string, std::string> export_surface(const std::string& recording,
                                                                    const std::string& stem,
                                                                    std::optional<double> at_s);

}  // namespace punctum::tools
