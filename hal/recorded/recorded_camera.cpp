#include "hal/recorded/recorded_camera.hpp"

#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "hal/recorded/modules.hpp"
#include "hal/recorded/picture.hpp"

namespace punctum::recorded {
namespace {

namespace fs = std::filesystem;

constexpr double kDefaultFps = 25;
constexpr double kMaxFps = 1e5;
constexpr std::int64_t kUncertain = 1;  // many kinds of video tell a duration, of which the count is rounded
constexpr const char* kPictures = "*.png, *.jpg, *.jpeg, *.tif, *.tiff, *.bmp, *.pgm, *.ppm";
constexpr std::array<std::string_view, 9> kPictureEndings{".png", ".jpg", ".jpeg", ".tif", ".tiff",
                                                          ".bmp", ".pgm", ".ppm",  ".pnm"};

// What other systems lay beside a picture, as ._a.png, is hidden.
bool is_hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

bool is_picture_name(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kPictureEndings.begin(), kPictureEndings.end(), ending) != kPictureEndings.end();
}

// A link that leads nowhere stands for a picture that cannot be read. What is there and no file may have no
// end.
bool is_file(const fs::path& path) {
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
  return type == fs::file_type::regular || type == fs::file_type::not_found;
}

tl::expected<std::vector<std::string>, std::string> files_of_folder(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  fs::directory_iterator it(folder, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    if (!is_hidden(it->path()) && is_picture_name(it->path()) && is_file(it->path())) {
      files.push_back(it->path().string());
    }
  }
  if (error) {
    return tl::unexpected(folder + ": " + error.message());
  }
  if (files.empty()) {
    return tl::unexpected(folder + ": no pictures in this folder; allowed: " + kPictures);
  }
  return files;
}

tl::expected<std::vector<std::string>, std::string> files_of_pattern(const std::string& pattern) {
  glob_t found{};
  std::vector<std::string> files;
  if (::glob(pattern.c_str(), 0, nullptr, &found) == 0) {
    for (std::size_t i = 0; i < found.gl_pathc; ++i) {
      if (is_file(found.gl_pathv[i])) {
        files.emplace_back(found.gl_pathv[i]);
      }
    }
  }
  ::globfree(&found);
  if (files.empty()) {
    return tl::unexpected(pattern + ": no file matches");
  }
  return files;
}

// Rec. 601, in 14-bit fixed point.
void to_grey(const cv::Mat& picture, std::vector<std::uint8_t>& out) {
  out.resize(picture.total());
  const int channels = picture.channels();
  std::uint8_t* to = out.data();
  for (int y = 0; y < picture.rows; ++y) {
    const std::uint8_t* from = picture.ptr<std::uint8_t>(y);
    for (int x = 0; x < picture.cols; ++x, from += channels) {
      *to++ =
          channels == 1
              ? from[0]
              : static_cast<std::uint8_t>((from[0] * 1868 + from[1] * 9617 + from[2] * 4899 + 8192) >> 14);
    }
  }
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) noexcept {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      while (i < a.size() && a[i] == '0') {
        ++i;
      }
      while (j < b.size() && b[j] == '0') {
        ++j;
      }
      std::size_t n = 0;
      std::size_t m = 0;
      while (i + n < a.size() && digit(a[i + n])) {
        ++n;
      }
      while (j + m < b.size() && digit(b[j + m])) {
        ++m;
      }
      if (n != m) {
        return n < m;
      }
      const int order = a.substr(i, n).compare(b.substr(j, m));
      if (order != 0) {
        return order < 0;
      }
      i += n;
      j += m;
    } else {
      if (a[i] != b[j]) {
        return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
      }
      ++i;
      ++j;
    }
  }
  if ((i < a.size()) != (j < b.size())) {
    return j < b.size();
  }
  return a < b;  // 01 and 1 are the same number, but the order must be strict
}

struct Camera::Impl {
  std::vector<std::string> files;  // empty: a video
  std::unique_ptr<Video> video;
  std::string source;
  std::int64_t count = -1;
  double fps = kDefaultFps;

  std::int64_t position = 0;  // of the next picture
  Picture picture;
  int width = 0;
  int height = 0;
  bool first_is_waiting = false;  // read by open(), not yet handed out
  std::string name;
  std::string error;

  // Reads the picture at `position` into `picture`: ok, fault or disconnected, with `error`.
  hal::Status read() {
    error.clear();
    return files.empty() ? read_video() : read_file();
  }

  hal::Status read_file() {
    if (position >= count) {
      return hal::Status::disconnected;
    }
    name = files[static_cast<std::size_t>(position)];
    auto one = read_picture(name, position == 0 ? 0 : picture.bits);
    if (!one) {
      error = one.error();
      return hal::Status::fault;
    }
    return accept(std::move(*one));
  }

  // The first of 16-bit pictures may be dark. Some of the others are looked at, from the first to the last;
  // what one alone needs may be a flash.
  void scale_as_most_need() {
    constexpr std::int64_t kLooks = 16;
    std::vector<int> bits{picture.bits};
    const std::int64_t looks = std::min(kLooks, count);
    for (std::int64_t look = 1; look < looks; ++look) {
      if (const auto one = read_picture(files[static_cast<std::size_t>(look * (count - 1) / (looks - 1))])) {
        bits.push_back(one->bits);
      }
    }
    std::sort(bits.begin(), bits.end(), std::greater());
    if (bits.size() > 1 && bits[1] > picture.bits) {
      if (auto first = read_picture(files[0], bits[1])) {
        picture = std::move(*first);
      }
    }
  }

  hal::Status read_video() {
    name = source + ":" + std::to_string(position);
    cv::Mat raw;
    try {
      if (!video->read(raw) || raw.empty()) {
        if (position + kUncertain < count) {
          error = source + ": ends after " + std::to_string(position) + " of " + std::to_string(count) +
                  " pictures";
        }
        return hal::Status::disconnected;
      }
    } catch (const std::exception&) {
      error = name + ": cannot be decoded";
      return hal::Status::fault;
    }
    if (raw.depth() != CV_8U || (raw.channels() != 1 && raw.channels() != 3 && raw.channels() != 4)) {
      error = name + ": allowed: 8-bit grey or colour";
      return hal::Status::fault;
    }
    Picture one;
    one.width = raw.cols;
    one.height = raw.rows;
    to_grey(raw, one.pixels);
    return accept(std::move(one));
  }

  hal::Status accept(Picture one) {
    const int bits = position == 0 ? one.bits : picture.bits;
    if (position == 0) {
      width = one.width;
      height = one.height;
    }
    if (one.width != width || one.height != height) {
      error = name + ": " + std::to_string(one.width) + " x " + std::to_string(one.height) +
              " px, but the first is " + std::to_string(width) + " x " + std::to_string(height) + " px";
      return hal::Status::fault;
    }
    picture = std::move(one);
    picture.bits = bits;
    return hal::Status::ok;
  }

  tl::expected<void, std::string> open_video(double wanted_fps) {
    // An absolute path, so that no backend takes it for an address or a numbered pattern of pictures.
    std::error_code error_code;
    const std::string path = fs::absolute(source, error_code).string();
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // silent: an error is returned as a value
    auto loaded = load_video();
    if (!loaded) {
      return tl::unexpected(source + ": " + loaded.error());
    }
    video = std::move(*loaded);
    if (!video->open(path)) {
      return tl::unexpected(
          source + ": neither a picture nor a video that this program can read; pictures: " + kPictures);
    }
    const double w = video->width();
    const double h = video->height();
    if (w > static_cast<double>(kMaxSide) || h > static_cast<double>(kMaxSide) ||
        w * h > static_cast<double>(kMaxPixels)) {
      return tl::unexpected(source + ": its pictures are too large; allowed: sides of at most " +
                            std::to_string(kMaxSide) + " px and at most " + std::to_string(kMaxPixels) +
                            " px in all");
    }
    const double frames = video->frame_count();
    if (frames >= 1 && frames < 1e9) {
      count = static_cast<std::int64_t>(frames);
    }
    const double own_fps = video->frame_rate();
    if (wanted_fps <= 0 && own_fps > 0 && own_fps <= kMaxFps) {
      fps = own_fps;
    }
    return {};
  }
};

Camera::Camera(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Camera::~Camera() = default;
Camera::Camera(Camera&&) noexcept = default;
Camera& Camera::operator=(Camera&&) noexcept = default;

tl::expected<Camera, std::string> Camera::open(const std::string& source, double fps) {
  if (!std::isfinite(fps) || fps > kMaxFps) {
    return tl::unexpected<std::string>("fps: allowed: up to 100000 per second");
  }
  auto impl = std::make_unique<Impl>();
  impl->source = source;
  if (fps > 0) {
    impl->fps = fps;
  }

  std::error_code error;
  const fs::file_status status = fs::status(source, error);
  tl::expected<std::vector<std::string>, std::string> files;
  if (fs::is_directory(status)) {
    files = files_of_folder(source);
  } else if (fs::is_regular_file(status)) {
    if (is_picture_name(source)) {
      files->push_back(source);
    }
  } else if (fs::exists(status)) {
    return tl::unexpected(source + ": neither a file nor a folder");
  } else if (source.find_first_of("*?[") != std::string::npos) {
    files = files_of_pattern(source);
  } else {
    return tl::unexpected(source + ": no such file or folder");
  }
  if (!files) {
    return tl::unexpected(files.error());
  }
  impl->files = std::move(*files);
  std::sort(impl->files.begin(), impl->files.end(), natural_less);

  if (impl->files.empty()) {
    const auto video = impl->open_video(fps);
    if (!video) {
      return tl::unexpected(video.error());
    }
  } else {
    impl->count = static_cast<std::int64_t>(impl->files.size());
  }
  if (impl->read() != hal::Status::ok) {
    return tl::unexpected(impl->error.empty() ? source + ": no picture in it" : impl->error);
  }
  if (impl->picture.deep) {
    impl->scale_as_most_need();
  }
  impl->first_is_waiting = true;
  return Camera(std::move(impl));
}

hal::Status Camera::next(hal::Frame& out, std::int64_t) {
  Impl& c = *impl_;
  const hal::Status status = std::exchange(c.first_is_waiting, false) ? hal::Status::ok : c.read();
  if (status == hal::Status::disconnected) {
    return status;
  }
  out = {};
  out.sequence = static_cast<std::uint64_t>(c.position);
  out.exposure_ns = std::llround(static_cast<double>(c.position) / c.fps * 1e9);
  ++c.position;
  if (status != hal::Status::ok) {
    return status;
  }
  out.pixels = c.picture.pixels.data();
  out.width = c.width;
  out.height = c.height;
  out.stride = c.width;
  return status;
}

void Camera::release(const hal::Frame&) {}

const std::string& Camera::last_error() const noexcept { return impl_->error; }
const std::string& Camera::name() const noexcept { return impl_->name; }
const std::vector<std::string>& Camera::files() const noexcept { return impl_->files; }
int Camera::width() const noexcept { return impl_->width; }
int Camera::height() const noexcept { return impl_->height; }
double Camera::fps() const noexcept { return impl_->fps; }
std::int64_t Camera::count() const noexcept { return impl_->count; }

}  // namespace punctum::recorded
