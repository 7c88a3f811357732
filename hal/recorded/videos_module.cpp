// punctum_videos.so
#include <exception>
#include <opencv2/videoio.hpp>

#include "hal/recorded/modules.hpp"

namespace punctum::recorded {
namespace {

class OpenCvVideo final : public Video {
 public:
  bool open(const std::string& path) override {
    for (const int backend : {cv::CAP_FFMPEG, cv::CAP_GSTREAMER, cv::CAP_OPENCV_MJPEG}) {
      try {
        if (video_.open(path, backend)) {
          break;
        }
      } catch (const std::exception&) {
        continue;
      }
    }
    return video_.isOpened();
  }
  bool read(cv::Mat& out) override { return video_.read(out); }
  [[nodiscard]] double width() const override { return video_.get(cv::CAP_PROP_FRAME_WIDTH); }
  [[nodiscard]] double height() const override { return video_.get(cv::CAP_PROP_FRAME_HEIGHT); }
  [[nodiscard]] double frame_count() const override { return video_.get(cv::CAP_PROP_FRAME_COUNT); }
  [[nodiscard]] double frame_rate() const override { return video_.get(cv::CAP_PROP_FPS); }

 private:
  cv::VideoCapture video_;
};

}  // namespace
}  // namespace punctum::recorded

extern "C" punctum::recorded::Video* punctum_video() { return new punctum::recorded::OpenCvVideo; }
