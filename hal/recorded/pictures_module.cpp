// punctum_pictures.so
#include <opencv2/imgcodecs.hpp>

#include "hal/recorded/modules.hpp"

extern "C" void punctum_pictures(punctum::recorded::Pictures& out) {
  out.decode = [](const cv::Mat& bytes) {
    return cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  };
  out.encode = [](const std::string& suffix, const cv::Mat& picture, std::vector<unsigned char>& bytes) {
    return cv::imencode(suffix, picture, bytes);
  };
}
