// Pictures as files, whole or not at all.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <tl/expected.hpp>

namespace punctum::tools {

// In the format of the path's suffix. Does not wait for the disk. The error is one line.
[[nodiscard]] tl::expected<void, std::string> write_picture(const std::string& path, const cv::Mat& picture);

}  // namespace punctum::tools
