#include "tools/vision/picture_file.hpp"

#include <filesystem>
#include <vector>

#include "hal/recorded/modules.hpp"
#include "tools/shared/whole_file.hpp"

namespace punctum::tools {

tl::expected<void, std::string> write_picture(const std::string& path, const cv::Mat& picture) {
  const auto pictures = recorded::load_pictures();
  if (!pictures) {
    return tl::unexpected(path + ": " + pictures.error());
  }
  std::vector<unsigned char> bytes;
  try {
    if (!pictures->encode(std::filesystem::path(path).extension().string(), picture, bytes)) {
      return tl::unexpected(path + ": cannot be written: not a format of pictures");
    }
  } catch (const cv::Exception&) {
    return tl::unexpected(path + ": cannot be written: not a format of pictures");
  }
  return write_whole(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, Sync::later);
}

}  // namespace punctum::tools
