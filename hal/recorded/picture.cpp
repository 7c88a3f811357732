#include "hal/recorded/picture.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <string_view>

namespace punctum::recorded {
namespace {

using Bytes = std::span<const std::uint8_t>;
using Verdict = tl::expected<void, std::string>;

constexpr const char* kAllowed = "allowed: PNG, JPEG, TIFF, BMP, PGM, PPM";
constexpr const char* kEndsEarly = "the file ends before the picture does";

tl::unexpected<std::string> wrong(std::string what) { return tl::unexpected<std::string>(std::move(what)); }

bool starts_with(Bytes file, std::string_view magic) {
  return file.size() >= magic.size() &&
         std::equal(magic.begin(), magic.end(), file.begin(),
                    [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
}

// Numbers in a file; the caller has checked that they lie inside it.
std::uint32_t number(Bytes file, std::size_t at, int bytes, bool big_end_first) {
  std::uint32_t n = 0;
  for (int i = 0; i < bytes; ++i) {
    const std::size_t k = at + static_cast<std::size_t>(big_end_first ? i : bytes - 1 - i);
    n = n << 8 | file[k];
  }
  return n;
}

Verdict check_size(std::int64_t width, std::int64_t height) {
  if (width >= 1 && height >= 1 && width <= kMaxSide && height <= kMaxSide && width * height <= kMaxPixels)
    return {};
  return wrong("its size is " + std::to_string(width) + " x " + std::to_string(height) +
               " px; allowed: sides of 1 .. " + std::to_string(kMaxSide) + " px and at most " +
               std::to_string(kMaxPixels) + " px in all");
}

// ISO 3309, as PNG wants it.
std::uint32_t crc32(Bytes bytes) {
  static const std::array<std::uint32_t, 256> table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t n = 0; n < 256; ++n) {
      std::uint32_t c = n;
      for (int k = 0; k < 8; ++k) c = (c & 1U) != 0 ? 0xedb88320U ^ (c >> 1) : c >> 1;
      t[n] = c;
    }
    return t;
  }();
  std::uint32_t c = 0xffffffffU;
  for (const std::uint8_t b : bytes) c = table[(c ^ b) & 0xffU] ^ (c >> 8);
  return c ^ 0xffffffffU;
}

// Every chunk whole, up to IEND.
Verdict check_png(Bytes file) {
  std::size_t at = 8;
  for (bool first = true;; first = false) {
    if (file.size() - at < 12) return wrong(kEndsEarly);
    const std::size_t length = number(file, at, 4, true);
    const std::size_t type = at + 4;
    if (length > file.size() - at - 12) return wrong(kEndsEarly);
    const std::string name(file.begin() + static_cast<std::ptrdiff_t>(type),
                           file.begin() + static_cast<std::ptrdiff_t>(type) + 4);
    if (crc32(file.subspan(type, 4 + length)) != number(file, type + 4 + length, 4, true)) {
      return wrong("a checksum of the PNG file does not fit its data");
    }
    if (first) {
      if (name != "IHDR" || length != 13) return wrong("the PNG file has no header");
      const Verdict size = check_size(number(file, at + 8, 4, true), number(file, at + 12, 4, true));
      if (!size) return size;
    }
    if (name == "IEND") return {};
    at += 12 + length;
  }
}

// Every segment and scan, up to the end-of-image marker.
Verdict check_jpeg(Bytes file) {
  std::size_t at = 2;
  bool sized = false;
  bool scanned = false;
  for (;;) {
    // To the next marker. Between segments there are none but fill bytes; after a scan header, its coded
    // data, in which ff 00 is data and ff d0 .. d7 are restarts.
    while (at + 1 < file.size() && !(file[at] == 0xff && file[at + 1] != 0x00 && file[at + 1] != 0xff &&
                                     !(scanned && file[at + 1] >= 0xd0 && file[at + 1] <= 0xd7))) {
      if (!scanned && file[at] != 0xff) return wrong("the JPEG file is damaged");
      ++at;
    }
    if (at + 1 >= file.size()) return wrong(kEndsEarly);
    const std::uint8_t marker = file[at + 1];
    at += 2;
    if (marker == 0xd9) {
      if (!sized || !scanned) return wrong(kEndsEarly);
      return {};
    }
    if (marker == 0x01) continue;
    if (marker == 0xd8) return wrong("the JPEG file is damaged");
    if (file.size() - at < 2) return wrong(kEndsEarly);
    const std::size_t length = number(file, at, 2, true);
    if (length < 2) return wrong("the JPEG file is damaged");
    if (length > file.size() - at) return wrong(kEndsEarly);
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame) {
      if (length < 8) return wrong("the JPEG file is damaged");
      const Verdict size = check_size(number(file, at + 5, 2, true), number(file, at + 3, 2, true));
      if (!size) return size;
      sized = true;
    }
    if (marker == 0xda) scanned = true;
    at += length;
  }
}

Verdict check_bmp(Bytes file) {
  if (file.size() < 26) return wrong(kEndsEarly);
  const std::uint32_t pixels_at = number(file, 10, 4, false);
  const std::uint32_t header = number(file, 14, 4, false);
  if (header == 12) {
    const std::int64_t bits_per_pixel = number(file, 24, 2, false);
    const std::int64_t width = number(file, 18, 2, false);
    const std::int64_t height = number(file, 20, 2, false);
    const Verdict size = check_size(width, height);
    if (!size) return size;
    const std::int64_t row = (width * bits_per_pixel + 31) / 32 * 4;
    if (pixels_at + row * height > static_cast<std::int64_t>(file.size())) return wrong(kEndsEarly);
    return {};
  }
  if (file.size() < 54) return wrong(kEndsEarly);
  const std::int64_t width = static_cast<std::int32_t>(number(file, 18, 4, false));
  const std::int64_t height =
      static_cast<std::int32_t>(number(file, 22, 4, false));  // negative: top row first
  const Verdict size = check_size(width, height < 0 ? -height : height);
  if (!size) return size;
  const std::int64_t bits_per_pixel = number(file, 28, 2, false);
  const std::uint32_t compression = number(file, 30, 4, false);
  const std::int64_t bytes = compression == 1 || compression == 2
                                 ? std::int64_t{number(file, 34, 4, false)}
                                 : (width * bits_per_pixel + 31) / 32 * 4 * (height < 0 ? -height : height);
  if (pixels_at + bytes > static_cast<std::int64_t>(file.size())) return wrong(kEndsEarly);
  return {};
}

// P1 .. P6: width, height and, but for bitmaps, the largest value, as decimal numbers.
Verdict check_pnm(Bytes file) {
  const char kind = static_cast<char>(file[1]);
  const bool bitmap = kind == '1' || kind == '4';
  std::size_t at = 2;
  std::array<std::int64_t, 3> field{0, 0, 1};
  for (std::size_t i = 0; i < (bitmap ? 2U : 3U); ++i) {
    while (at < file.size() && (std::isspace(file[at]) != 0 || file[at] == '#')) {
      if (file[at] == '#') {
        while (at < file.size() && file[at] != '\n') ++at;
      } else {
        ++at;
      }
    }
    if (at >= file.size()) return wrong(kEndsEarly);
    if (std::isdigit(file[at]) == 0) return wrong("the header of the PNM file is damaged");
    std::int64_t n = 0;
    while (at < file.size() && std::isdigit(file[at]) != 0 && n < 1'000'000'000)
      n = n * 10 + (file[at++] - '0');
    field[i] = n;
  }
  const Verdict size = check_size(field[0], field[1]);
  if (!size) return size;
  if (field[2] < 1 || field[2] > 65535) return wrong("the header of the PNM file is damaged");
  std::int64_t row = field[0] * (field[2] > 255 ? 2 : 1);
  if (kind == '3' || kind == '6') row *= 3;
  if (kind == '4') row = (field[0] + 7) / 8;
  // In text each sample takes at least one character; that much at least must be there.
  if (row * field[1] / (kind <= '3' && field[2] > 255 ? 2 : 1) >
      static_cast<std::int64_t>(file.size() - at)) {
    return wrong(kEndsEarly);
  }
  return {};
}

// First directory only: size, and that all strips or tiles lie in the file.
Verdict check_tiff(Bytes file) {
  const bool big = file[0] == 'M';
  if (file.size() < 8) return wrong(kEndsEarly);
  if (number(file, 2, 2, big) != 42) return wrong("BigTIFF is not allowed");
  const std::size_t directory = number(file, 4, 4, big);
  if (directory < 8 || directory > file.size() || file.size() - directory < 2) return wrong(kEndsEarly);
  const std::size_t entries = number(file, directory, 2, big);
  if (entries * 12 + 4 > file.size() - directory - 2) return wrong(kEndsEarly);
  std::int64_t width = 0;
  std::int64_t height = 0;
  struct Field {
    std::size_t count = 0, at = 0;
    int bytes = 0;
  };
  Field offset;
  Field length;
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t e = directory + 2 + 12 * i;
    const std::uint32_t tag = number(file, e, 2, big);
    const std::uint32_t type = number(file, e + 2, 2, big);
    const std::size_t count = number(file, e + 4, 4, big);
    const int bytes = type == 3 ? 2 : type == 4 ? 4 : type == 1 ? 1 : 0;
    const bool wanted = tag == 256 || tag == 257 || tag == 273 || tag == 279 || tag == 324 || tag == 325;
    if (!wanted) continue;
    if (bytes == 0 || count == 0) return wrong("the TIFF file's directory is damaged");
    std::size_t at = e + 8;
    if (count > 4 / static_cast<std::size_t>(bytes)) {
      at = number(file, e + 8, 4, big);
      if (at > file.size() || count > (file.size() - at) / static_cast<std::size_t>(bytes))
        return wrong(kEndsEarly);
    }
    if (tag == 256) width = number(file, at, bytes, big);
    if (tag == 257) height = number(file, at, bytes, big);
    if (tag == 273 || tag == 324) offset = {count, at, bytes};
    if (tag == 279 || tag == 325) length = {count, at, bytes};
  }
  const Verdict size = check_size(width, height);
  if (!size) return size;
  for (std::size_t i = 0; i < std::min(offset.count, length.count); ++i) {
    const std::uint64_t from =
        number(file, offset.at + i * static_cast<std::size_t>(offset.bytes), offset.bytes, big);
    const std::uint64_t n =
        number(file, length.at + i * static_cast<std::size_t>(length.bytes), length.bytes, big);
    if (from + n > file.size()) return wrong(kEndsEarly);
  }
  return {};
}

Verdict check(Bytes file) {
  using namespace std::string_view_literals;
  if (file.empty()) return wrong("the file is empty");
  if (starts_with(file, "\x89PNG\r\n\x1a\n"sv)) return check_png(file);
  if (starts_with(file, "\xff\xd8\xff"sv)) return check_jpeg(file);
  if (starts_with(file, "II*\0"sv) || starts_with(file, "MM\0*"sv)) return check_tiff(file);
  if (starts_with(file, "BM"sv)) return check_bmp(file);
  if (file.size() > 2 && file[0] == 'P' && file[1] >= '1' && file[1] <= '6' && std::isspace(file[2]) != 0) {
    return check_pnm(file);
  }
  return wrong(std::string("not a picture this program reads; ") + kAllowed);
}

// The library writes what it dislikes to the standard error stream; here it is returned as a value.
class Hush {
 public:
  Hush() : before_(std::cerr.rdbuf(nullptr)) {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  }
  ~Hush() {
    std::cerr.rdbuf(before_);
    std::cerr.clear();
  }
  Hush(const Hush&) = delete;
  Hush& operator=(const Hush&) = delete;

 private:
  std::streambuf* before_;
};

int bits_that_hold(const cv::Mat& picture) {
  std::uint16_t brightest = 0;
  for (int y = 0; y < picture.rows; ++y) {
    const auto* const row = picture.ptr<std::uint16_t>(y);
    brightest = std::max(brightest, *std::max_element(row, row + picture.cols));
  }
  int bits = 8;
  while (bits < 16 && brightest >> bits != 0) bits += 2;
  return bits;
}

}  // namespace

tl::expected<Picture, std::string> decode(Bytes file, int bits) {
  const Verdict good = check(file);
  if (!good) return tl::unexpected(good.error());
  cv::Mat picture;
  try {
    const Hush hush;
    const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<std::uint8_t*>(file.data()));
    picture = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const std::bad_alloc&) {
    return wrong("not enough memory for the picture");
  } catch (const std::exception&) {
    return wrong("the picture's data are damaged");
  }
  if (picture.empty()) return wrong("the picture's data are damaged");
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
  out.bits = bits >= 8 && bits <= 16 ? bits : bits_that_hold(picture);
  for (int y = 0; y < picture.rows; ++y) {
    const auto* const row = picture.ptr<std::uint16_t>(y);
    for (int x = 0; x < picture.cols; ++x) {
      out.pixels.push_back(static_cast<std::uint8_t>(std::min(row[x] >> (out.bits - 8), 255)));
    }
  }
  return out;
}

tl::expected<Picture, std::string> read_picture(const std::string& path, int bits) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) return wrong(path + ": no such file, or it may not be read");
  if (!S_ISREG(about.st_mode)) return wrong(path + ": not a file");
  if (about.st_size > kMaxFileBytes) {
    return wrong(path + ": larger than " + std::to_string(kMaxFileBytes >> 20) +
                 " MiB, which is the most allowed");
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) return wrong(path + ": may not be read");
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(about.st_size));
  bytes.resize(bytes.empty() ? 0 : std::fread(bytes.data(), 1, bytes.size(), file.get()));
  auto picture = decode(bytes, bits);
  if (!picture) return wrong(path + ": " + picture.error());
  return picture;
}

}  // namespace punctum::recorded
