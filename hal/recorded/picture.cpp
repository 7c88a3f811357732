#include "hal/recorded/picture.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <atomic>
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
#include <streambuf>
#include <string>
#include <utility>

#include "hal/recorded/modules.hpp"
#include "hal/recorded/picture_check.hpp"

namespace punctum::recorded {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr const char* kDamaged = "the picture's data are damaged or incomplete";

tl::unexpected<std::string> wrong(std::string what) { return tl::unexpected<std::string>(std::move(what)); }

// What OpenCV writes to std::cerr is not shown while one of these lives: here an error is a value. What other
// threads write goes on.
class NoErrorOutput {
 public:
  NoErrorOutput() {
    [[maybe_unused]] static std::streambuf* const once =
        std::cerr.rdbuf(new Others(std::cerr.rdbuf()));  // there as long as std::cerr
    silent = true;
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  }
  ~NoErrorOutput() { silent = false; }
  NoErrorOutput(const NoErrorOutput&) = delete;
  NoErrorOutput& operator=(const NoErrorOutput&) = delete;

 private:
  class Others : public std::streambuf {
   public:
    explicit Others(std::streambuf* to) : to_(to) {}

   protected:
    int overflow(int c) override {
      return silent || c == traits_type::eof() ? traits_type::not_eof(c)
                                               : to_->sputc(traits_type::to_char_type(c));
    }
    std::streamsize xsputn(const char* text, std::streamsize n) override {
      return silent ? n : to_->sputn(text, n);
    }
    int sync() override { return to_->pubsync(); }

   private:
    std::streambuf* to_;
  };
  static thread_local bool silent;
};
thread_local bool NoErrorOutput::silent = false;

// Takes what the JPEG library writes to the standard error stream: it says there alone, and through nothing
// that OpenCV lets through, that it has filled up what is missing. It writes in the thread that decodes; what
// other threads write meanwhile goes on. The stream between is never closed, since one of them may still have
// it.
class LibraryWarnings {
 public:
  LibraryWarnings() : alone_(mutex()) {
    static std::FILE* const stream = between();
    before() = stderr;
    if (stream != nullptr) {
      stderr = stream;
    }
    text_.reserve(kEnough);  // nothing is thrown through the library
    taken = &text_;
  }
  ~LibraryWarnings() {
    taken = nullptr;
    stderr = before();
  }
  LibraryWarnings(const LibraryWarnings&) = delete;
  LibraryWarnings& operator=(const LibraryWarnings&) = delete;

  // Bytes that belong to nothing do no harm: some cameras fill up their files.
  [[nodiscard]] bool tell_of_damage() const {
    return text_.find("Corrupt JPEG data") != std::string::npos &&
           text_.find("extraneous bytes") == std::string::npos;
  }

 private:
  static constexpr std::size_t kEnough = 1024;

  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  static std::atomic<std::FILE*>& before() {
    static std::atomic<std::FILE*> stream{stderr};
    return stream;
  }
  // Without a buffer: each line arrives in the thread that writes it.
  static std::FILE* between() {
    std::FILE* const stream = ::fopencookie(nullptr, "w", {nullptr, take, nullptr, nullptr});
    if (stream != nullptr) {
      (void)std::setvbuf(stream, nullptr, _IONBF, 0);
    }
    return stream;
  }
  static ssize_t take(void* /*cookie*/, const char* text, std::size_t n) {
    if (taken == nullptr) {
      return static_cast<ssize_t>(std::fwrite(text, 1, n, before()));
    }
    taken->append(text, std::min(n, kEnough - std::min(kEnough, taken->size())));
    return static_cast<ssize_t>(n);
  }

  std::lock_guard<std::mutex> alone_;
  std::string text_;
  static thread_local std::string* taken;  // null: this thread decodes nothing
};
thread_local std::string* LibraryWarnings::taken = nullptr;

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
