// The pictures of a recording: a PNG file each with a table of their times, or all in one OME-TIFF.
#pragma once

#include <string>
#include <tl/expected.hpp>

namespace punctum::tools {

// The value: why the recording is not the whole run, in a line; empty if it is. The error is one line:
// no pictures in it, or they cannot be written. What is there already is not replaced.
[[nodiscard]] tl::expected<std::string, std::string> export_png(const std::string& recording,
                                                                const std::string& folder);
[[nodiscard]] tl::expected<std::string, std::string> export_ome_tiff(const std::string& recording,
                                                                     const std::string& file);

}  // namespace punctum::tools
