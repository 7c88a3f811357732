// What is wrong with the bytes of a picture file, before they are decoded.
//
// The decoding library notices by itself when a BMP or PNM file is incomplete; of those only the size is
// checked. It fills up JPEG and TIFF files that end early, and does not look at every checksum of a PNG file,
// so those are checked to their end.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>

namespace punctum::recorded {

// The error is a sentence without the name of the file.
[[nodiscard]] tl::expected<void, std::string> check_picture(std::span<const std::uint8_t> file);

}  // namespace punctum::recorded
