// 8-bit grey pictures of one size as the pages of a BigTIFF file, which may be larger than 4 GB. Not
// compressed. The format: https://www.awaresystems.be/imaging/tiff/bigtiff.html
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace punctum::tools {

class BigTiff {
 public:
  // The description is that of the first page. pixels_per_m: 0 if nobody knows.
  BigTiff(std::FILE* file, std::uint32_t width, std::uint32_t height, double pixels_per_m,
          std::string description)
      : file_(file),
        width_(width),
        height_(height),
        resolution_(resolution(pixels_per_m)),
        description_(std::move(description)) {
    bytes_ = "II";
    put(std::uint16_t{43});
    put(std::uint16_t{8});  // bytes of an offset
    put(std::uint16_t{0});
    link_ = bytes_.size();
    put(std::uint64_t{0});  // of the first page
    write();
  }

  // width * height pixels, row by row from the top.
  void page(std::string_view pixels) {
    enum Type : std::uint16_t { ascii = 2, u16 = 3, u32 = 4, rational = 5, u64 = 16 };
    enum Unit : std::uint64_t { none = 1, centimetre = 3 };
    const std::uint64_t strip = at_;
    bytes_.assign(pixels);
    bytes_.resize((bytes_.size() + 7) / 8 * 8);
    const std::uint64_t text = at_ + bytes_.size();
    const std::uint64_t text_size = description_.empty() ? 0 : description_.size() + 1;
    if (text_size > 0) {
      bytes_ += description_;
      bytes_.resize((bytes_.size() + 8) / 8 * 8);  // a zero at its end at least
    }
    const std::uint64_t directory = at_ + bytes_.size();
    std::uint64_t entries = 0;
    std::string list;
    list.swap(bytes_);
    const auto entry = [&](std::uint16_t tag, Type type, std::uint64_t count, std::uint64_t value) {
      put(tag);
      put(static_cast<std::uint16_t>(type));
      put(count);
      put(value);  // little-endian: a short one stands in its first bytes
      ++entries;
    };
    entry(256, u32, 1, width_);
    entry(257, u32, 1, height_);
    entry(258, u16, 1, 8);  // bits per sample
    entry(259, u16, 1, 1);  // not compressed
    entry(262, u16, 1, 1);  // 0 is black
    if (text_size > 0) {
      entry(270, ascii, text_size, text);
    }
    entry(273, u64, 1, strip);
    entry(277, u16, 1, 1);  // sample per pixel
    entry(278, u32, 1, height_);
    entry(279, u64, 1, std::uint64_t{width_} * height_);
    entry(282, rational, 1, resolution_);  // along a row
    entry(283, rational, 1, resolution_);
    entry(296, u16, 1, resolution_ == kUnknown ? none : centimetre);
    list.swap(bytes_);
    put(entries);
    bytes_ += list;
    const std::uint64_t next = at_ + bytes_.size();
    put(std::uint64_t{0});  // no further page
    write();
    patch(link_, directory);
    link_ = next;
    description_.clear();
  }

  [[nodiscard]] bool good() const { return good_; }

 private:
  // A rational number: the numerator in the lower half, the denominator in the upper one.
  static constexpr std::uint64_t kUnknown = 1 | std::uint64_t{1} << 32U;
  static std::uint64_t resolution(double pixels_per_m) {
    constexpr double kM_per_cm = 1e-2, kDenominator = 100;
    const double numerator = std::round(pixels_per_m * kM_per_cm * kDenominator);
    if (!(numerator >= 1 && numerator <= std::numeric_limits<std::uint32_t>::max())) {
      return kUnknown;
    }
    return static_cast<std::uint64_t>(numerator) | static_cast<std::uint64_t>(kDenominator) << 32U;
  }

  template <class Number>
  void put(Number n) {
    for (std::size_t i = 0; i < sizeof n; ++i) {
      bytes_ += static_cast<char>(n >> (8 * i) & 0xFFU);
    }
  }
  void write() {
    good_ = good_ && std::fwrite(bytes_.data(), 1, bytes_.size(), file_) == bytes_.size();
    at_ += bytes_.size();
    bytes_.clear();
  }
  void patch(std::uint64_t where, std::uint64_t value) {
    put(value);
    good_ = good_ && ::fseeko(file_, static_cast<off_t>(where), SEEK_SET) == 0 &&
            std::fwrite(bytes_.data(), 1, bytes_.size(), file_) == bytes_.size() &&
            ::fseeko(file_, 0, SEEK_END) == 0;
    bytes_.clear();
  }

  std::FILE* file_;
  std::uint32_t width_, height_;
  std::uint64_t resolution_;
  std::string description_;
  std::string bytes_;
  std::uint64_t at_ = 0;    // bytes written
  std::uint64_t link_ = 0;  // where the place of the next page is to stand
  bool good_ = true;
};

}  // namespace punctum::tools
