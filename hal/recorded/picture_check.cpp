#include "hal/recorded/picture_check.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "hal/recorded/picture.hpp"

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

// A number of up to four bytes. The caller has checked that it lies inside the file.
std::uint32_t number(Bytes file, std::size_t at, int bytes, bool big_endian) {
  std::uint32_t n = 0;
  for (int i = 0; i < bytes; ++i) {
    const std::size_t k = at + static_cast<std::size_t>(big_endian ? i : bytes - 1 - i);
    n = n << 8 | file[k];
  }
  return n;
}

Verdict check_size(std::int64_t width, std::int64_t height) {
  if (width >= 1 && height >= 1 && width <= kMaxSide && height <= kMaxSide && width * height <= kMaxPixels) {
    return {};
  }
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
      for (int k = 0; k < 8; ++k) {
        c = (c & 1U) != 0 ? 0xedb88320U ^ (c >> 1) : c >> 1;
      }
      t[n] = c;
    }
    return t;
  }();
  std::uint32_t c = 0xffffffffU;
  for (const std::uint8_t b : bytes) {
    c = table[(c ^ b) & 0xffU] ^ (c >> 8);
  }
  return c ^ 0xffffffffU;
}

// Every chunk is whole and fits its checksum, up to IEND; the header is the first. OpenCV 4.10 does not look
// at the checksum of the last chunk.
Verdict check_png(Bytes file) {
  std::size_t at = 8;
  for (bool first = true;; first = false) {
    if (file.size() - at < 12) {
      return wrong(kEndsEarly);
    }
    const std::size_t length = number(file, at, 4, true);
    const std::size_t type = at + 4;
    if (length > file.size() - at - 12) {
      return wrong(kEndsEarly);
    }
    const std::string name(file.begin() + static_cast<std::ptrdiff_t>(type),
                           file.begin() + static_cast<std::ptrdiff_t>(type) + 4);
    if (crc32(file.subspan(type, 4 + length)) != number(file, type + 4 + length, 4, true)) {
      return wrong("a checksum of the PNG file does not fit its data");
    }
    if (first) {
      if (name != "IHDR" || length != 13) {
        return wrong("the PNG file has no header");
      }
      if (const Verdict size = check_size(number(file, at + 8, 4, true), number(file, at + 12, 4, true));
          !size) {
        return size;
      }
    }
    if (name == "IEND") {
      return {};
    }
    at += 12 + length;
  }
}

Verdict check_bmp(Bytes file) {
  if (file.size() < 26) {
    return wrong(kEndsEarly);
  }
  if (number(file, 14, 4, false) == 12) {  // the old, short header
    return check_size(number(file, 18, 2, false), number(file, 20, 2, false));
  }
  const std::int64_t width = static_cast<std::int32_t>(number(file, 18, 4, false));
  const std::int64_t height = static_cast<std::int32_t>(number(file, 22, 4, false));
  return check_size(width, std::abs(height));  // a negative height: the top row comes first
}

// P1 .. P6: width and height are the first two decimal numbers.
Verdict check_pnm(Bytes file) {
  std::size_t at = 2;
  std::array<std::int64_t, 2> size{};
  for (std::int64_t& n : size) {
    while (at < file.size() && (std::isspace(file[at]) != 0 || file[at] == '#')) {
      if (file[at] == '#') {
        while (at < file.size() && file[at] != '\n') {
          ++at;
        }
      } else {
        ++at;
      }
    }
    while (at < file.size() && std::isdigit(file[at]) != 0 && n < 1'000'000'000) {
      n = n * 10 + (file[at++] - '0');
    }
  }
  return check_size(size[0], size[1]);
}

// Every segment and scan, up to the end-of-image marker.
Verdict check_jpeg(Bytes file) {
  std::size_t at = 2;
  bool sized = false;
  bool scanned = false;
  for (;;) {
    // The next marker. Between segments there are only fill bytes. After the header of a scan its coded data
    // follow, in which ff 00 is data and ff d0 .. d7 are restarts.
    while (at + 1 < file.size() && !(file[at] == 0xff && file[at + 1] != 0x00 && file[at + 1] != 0xff &&
                                     !(scanned && file[at + 1] >= 0xd0 && file[at + 1] <= 0xd7))) {
      if (!scanned && file[at] != 0xff) {
        return wrong("the JPEG file is damaged");
      }
      ++at;
    }
    if (at + 1 >= file.size()) {
      return wrong(kEndsEarly);
    }
    const std::uint8_t marker = file[at + 1];
    at += 2;
    if (marker == 0xd9) {
      if (!sized || !scanned) {
        return wrong(kEndsEarly);
      }
      return {};
    }
    if (marker == 0x01) {
      continue;
    }
    if (marker == 0xd8) {
      return wrong("the JPEG file is damaged");
    }
    if (file.size() - at < 2) {
      return wrong(kEndsEarly);
    }
    const std::size_t length = number(file, at, 2, true);
    if (length < 2) {
      return wrong("the JPEG file is damaged");
    }
    if (length > file.size() - at) {
      return wrong(kEndsEarly);
    }
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame) {
      if (length < 8) {
        return wrong("the JPEG file is damaged");
      }
      const Verdict size = check_size(number(file, at + 5, 2, true), number(file, at + 3, 2, true));
      if (!size) {
        return size;
      }
      sized = true;
    }
    if (marker == 0xda) {
      scanned = true;
    }
    at += length;
  }
}

// An entry of a TIFF directory: `count` whole numbers of `bytes` bytes each, at `at` in the file.
struct TiffField {
  std::size_t count = 0, at = 0;
  int bytes = 0;
  [[nodiscard]] std::uint32_t value(Bytes file, std::size_t i, bool big_endian) const {
    return number(file, at + i * static_cast<std::size_t>(bytes), bytes, big_endian);
  }
};

tl::expected<TiffField, std::string> read_field(Bytes file, std::size_t entry, bool big_endian) {
  const std::uint32_t type = number(file, entry + 2, 2, big_endian);
  TiffField field;
  field.bytes = type == 3 ? 2 : type == 4 ? 4 : type == 1 ? 1 : 0;
  field.count = number(file, entry + 4, 4, big_endian);
  if (field.bytes == 0 || field.count == 0) {
    return wrong("the TIFF file's directory is damaged");
  }
  const auto bytes = static_cast<std::size_t>(field.bytes);
  field.at = entry + 8;  // the numbers themselves, or where they are
  if (field.count > 4 / bytes) {
    field.at = number(file, entry + 8, 4, big_endian);
    if (field.at > file.size() || field.count > (file.size() - field.at) / bytes) {
      return wrong(kEndsEarly);
    }
  }
  return field;
}

// A directory after the first one is a further picture, unless it says to be a smaller version of one.
bool is_smaller_version(Bytes file, std::size_t directory, bool big_endian) {
  constexpr std::uint32_t kSubfileType = 254, kReduced = 1;
  if (directory > file.size() || file.size() - directory < 2) {
    return false;
  }
  const std::size_t entries = number(file, directory, 2, big_endian);
  for (std::size_t i = 0; i < entries && 12 * (i + 1) <= file.size() - directory - 2; ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    if (number(file, entry, 2, big_endian) == kSubfileType) {
      return (number(file, entry + 8, 4, big_endian) & kReduced) != 0;
    }
  }
  return false;
}

// The size of the first directory, that all its strips or tiles lie inside the file, and that it is the only
// picture: of several the library would give the first alone.
Verdict check_tiff(Bytes file) {
  const bool big_endian = file[0] == 'M';
  if (file.size() < 8) {
    return wrong(kEndsEarly);
  }
  const std::size_t directory = number(file, 4, 4, big_endian);
  if (directory < 8 || directory > file.size() || file.size() - directory < 2) {
    return wrong(kEndsEarly);
  }
  const std::size_t entries = number(file, directory, 2, big_endian);
  if (entries * 12 + 4 > file.size() - directory - 2) {
    return wrong(kEndsEarly);
  }
  const std::size_t next = number(file, directory + 2 + 12 * entries, 4, big_endian);
  if (next != 0 && !is_smaller_version(file, next, big_endian)) {
    return wrong("the TIFF file holds several pictures; allowed: one in a file");
  }
  std::int64_t width = 0, height = 0;
  TiffField offset, length;  // of the strips or tiles
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    const std::uint32_t tag = number(file, entry, 2, big_endian);
    if (tag != 256 && tag != 257 && tag != 273 && tag != 279 && tag != 324 && tag != 325) {
      continue;
    }
    const auto field = read_field(file, entry, big_endian);
    if (!field) {
      return tl::unexpected(field.error());
    }
    if (tag == 256) {
      width = field->value(file, 0, big_endian);
    } else if (tag == 257) {
      height = field->value(file, 0, big_endian);
    } else if (tag == 273 || tag == 324) {
      offset = *field;
    } else {
      length = *field;
    }
  }
  const Verdict size = check_size(width, height);
  if (!size) {
    return size;
  }
  for (std::size_t i = 0; i < std::min(offset.count, length.count); ++i) {
    const std::uint64_t end =
        std::uint64_t{offset.value(file, i, big_endian)} + length.value(file, i, big_endian);
    if (end > file.size()) {
      return wrong(kEndsEarly);
    }
  }
  return {};
}

}  // namespace

Verdict check_picture(Bytes file) {
  using namespace std::string_view_literals;
  if (file.empty()) {
    return wrong("the file is empty");
  }
  if (starts_with(file, "\x89PNG\r\n\x1a\n"sv)) {
    return check_png(file);
  }
  if (starts_with(file, "\xff\xd8\xff"sv)) {
    return check_jpeg(file);
  }
  if (starts_with(file, "II*\0"sv) || starts_with(file, "MM\0*"sv)) {
    return check_tiff(file);
  }
  if (starts_with(file, "BM"sv)) {
    return check_bmp(file);
  }
  if (file.size() > 2 && file[0] == 'P' && file[1] >= '1' && file[1] <= '6' && std::isspace(file[2]) != 0) {
    return check_pnm(file);
  }
  return wrong(std::string("not a picture this program reads; ") + kAllowed);
}

}  // namespace punctum::recorded
