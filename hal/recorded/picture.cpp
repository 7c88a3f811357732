#include "hal/recorded/picture.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <mutex>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "hal/recorded/modules.hpp"
#include "hal/recorded/picture_check.hpp"

namespace punctum::recorded {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr const char* kDamaged = "the picture's data are damaged or incomplete";

tl::unexpected<std::string> wrong(std::string what) { return tl::unexpected<std::string>(std::move(what)); }

// Silences the library, which writes its errors to the standard error stream; here an error is a value.
class NoErrorOutput {
 public:
  NoErrorOutput() : before_(std::cerr.rdbuf(nullptr)) {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  }
  ~NoErrorOutput() {
    std::cerr.rdbuf(before_);
    std::cerr.clear();
  }
  NoErrorOutput(const NoErrorOutput&) = delete;
  NoErrorOutput& operator=(const NoErrorOutput&) = delete;

 private:
  std::streambuf* before_;
};

// Takes what the JPEG library writes to the standard error stream: it says there alone, and through nothing
// that OpenCV lets through, that it has filled up what is missing. The stream that takes it is never closed,
// since another thread may write to it.
class LibraryWarnings {
 public:
  LibraryWarnings() : alone_(mutex()), before_(stderr) {
    static std::FILE* const stream = ::fmemopen(text().data(), text().size(), "w");
    if (stream != nullptr) {
      (void)std::fseek(stream, 0, SEEK_SET);
      text().fill('\0');
      stderr = stream;
    }
  }
  ~LibraryWarnings() { stderr = before_; }
  LibraryWarnings(const LibraryWarnings&) = delete;
  LibraryWarnings& operator=(const LibraryWarnings&) = delete;

  // Bytes that belong to nothing do no harm: some cameras fill up their files.
  [[nodiscard]] bool tell_of_damage() const {
    (void)std::fflush(stderr);
    const std::string_view all(text().data(), text().size());
    return all.find("Corrupt JPEG data") != std::string_view::npos &&
           all.find("extraneous bytes") == std::string_view::npos;
  }

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  static std::array<char, 1024>& text() {
    static std::array<char, 1024> bytes{};
    return bytes;
  }
  std::lock_guard<std::mutex> alone_;
  std::FILE* before_;
};

// Bits per sample that the brightest pixel needs: 8, 10 .. 16.
int bits_of(const cv::Mat& picture) {
  std::uint16_t brightest = 0;
  for (int y = 0; y < picture.rows; ++y) {
    const auto* const row = picture.ptr<std::uint16_t>(y);
    brightest = std::max(brightest, *std::max_element(row, row + picture.cols));
  }
  int bits = 8;
  while (bits < 16 && brightest >> bits != 0) {
    bits += 2;
  }
  return bits;
}

}  // namespace

tl::expected<Picture, std::string> decode(Bytes file, int bits) {
  const auto good = check_picture(file);
  if (!good) {
    return tl::unexpected(good.error());
  }
  const auto pictures = load_pictures();
  if (!pictures) {
    return tl::unexpected(pictures.error());
  }
  cv::Mat picture;
  try {
    const NoErrorOutput silenced;
    const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<std::uint8_t*>(file.data()));
    std::optional<LibraryWarnings> warnings;
    if (file[0] == 0xff) {  // JPEG
      warnings.emplace();
    }
    picture = pictures->decode(bytes);
    if (warnings && warnings->tell_of_damage()) {
      return wrong(kDamaged);
    }
  } catch (const std::bad_alloc&) {
    return wrong("not enough memory for the picture");
  } catch (const std::exception&) {
    return wrong(kDamaged);
  }
  if (picture.empty()) {
    return wrong(kDamaged);
  }
  if (picture.type() != CV_8UC1 && picture.type() != CV_16UC1) {
    return wrong("its samples are neither 8 nor 16 bits wide; allowed: whole numbers of 8 or 16 bits");
  }
  Picture out;
  out.width = picture.cols;
  out.height = picture.rows;
  out.pixels.reserve(picture.total());
  if (picture.type() == CV_8UC1) {
    for (int y = 0; y < picture.rows; ++y) {
      const std::uint8_t* const row = picture.ptr<std::uint8_t>(y);
      out.pixels.insert(out.pixels.end(), row, row + picture.cols);
    }
    return out;
  }
  out.deep = true;
  out.bits = bits >= 8 && bits <= 16 ? bits : bits_of(picture);
  for (int y = 0; y < picture.rows; ++y) {
    const auto* const row = picture.ptr<std::uint16_t>(y);
    for (int x = 0; x < picture.cols; ++x) {
      out.pixels.push_back(static_cast<std::uint8_t>(std::min(row[x] >> (out.bits - 8), 255)));
    }
  }
  return out;
}

tl::expected<Picture, std::string> read_picture(const std::string& path, int bits) {
  struct stat about{};
  if (::stat(path.c_str(), &about) != 0) {
    return wrong(path + ": no such file, or it may not be read");
  }
  if (!S_ISREG(about.st_mode)) {
    return wrong(path + ": not a file");
  }
  if (about.st_size > kMaxFileBytes) {
    return wrong(path + ": larger than " + std::to_string(kMaxFileBytes >> 20) +
                 " MiB, which is the most allowed");
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) {
    return wrong(path + ": may not be read");
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(about.st_size));
  bytes.resize(bytes.empty() ? 0 : std::fread(bytes.data(), 1, bytes.size(), file.get()));
  auto picture = decode(bytes, bits);
  if (!picture) {
    return wrong(path + ": " + picture.error());
  }
  return picture;
}

}  // namespace punctum::recorded
