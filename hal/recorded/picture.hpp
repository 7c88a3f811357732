// One recorded picture: from the bytes of a file to 8-bit grey, or a sentence that says what is wrong with
// it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace punctum::recorded {

// Larger ones are refused before they are decoded.
inline constexpr std::int64_t kMaxPixels = std::int64_t{8192} * 8192;
inline constexpr std::int64_t kMaxSide = 16384;
inline constexpr std::int64_t kMaxFileBytes = std::int64_t{512} << 20;

// 8-bit grey without padding between rows.
struct Picture {
  std::vector<std::uint8_t> pixels;
  int width = 0;
  int height = 0;
  int bits = 8;       // of the grey values that were scaled to 8: 8, 10, 12, 14 or 16
  bool deep = false;  // its samples had 16 bits
};

// PNG, JPEG, TIFF, BMP, PGM or PPM. Colour becomes grey; 16-bit samples are scaled from `bits`, or, when that
// is 0, from the least of 8, 10, 12, 14, 16 bits that holds the brightest of them. A file that is incomplete,
// damaged where its format tells, or larger than allowed is an error.
[[nodiscard]] tl::expected<Picture, std::string> decode(std::span<const std::uint8_t> file, int bits = 0);

// The same from a file; errors start with its path.
[[nodiscard]] tl::expected<Picture, std::string> read_picture(const std::string& path, int bits = 0);

}  // namespace punctum::recorded
