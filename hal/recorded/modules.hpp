// OpenCV's readers and writers of files, loaded when the first file is opened: those of pictures bring in
// some 120 libraries, which take longer to load than all the rest of a program, and those of videos 100 more.
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace punctum::recorded {

// All of these may throw what OpenCV throws.
struct Pictures {
  cv::Mat (*decode)(const cv::Mat& bytes);  // grey, of 8 or 16 bits; empty: cannot be read
  bool (*encode)(const std::string& suffix, const cv::Mat& picture, std::vector<unsigned char>& out);
};

class Video {
 public:
  virtual ~Video() = default;
  [[nodiscard]] virtual bool open(const std::string& path) = 0;
  [[nodiscard]] virtual bool read(cv::Mat& out) = 0;
  [[nodiscard]] virtual double width() const = 0;
  [[nodiscard]] virtual double height() const = 0;
  [[nodiscard]] virtual double frame_count() const = 0;
  [[nodiscard]] virtual double frame_rate() const = 0;
};

// The error is one line.
[[nodiscard]] tl::expected<Pictures, std::string> load_pictures();
[[nodiscard]] tl::expected<std::unique_ptr<Video>, std::string> load_video();

}  // namespace punctum::recorded
