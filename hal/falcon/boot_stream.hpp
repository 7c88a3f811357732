// The image that boots a Falcon's processor: TI's serial boot stream for the C2000 family, 8 bits wide. It is
// checked before the first byte is sent: half an image leaves a processor that does not answer.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace punctum::falcon {

struct BootStream {
  std::uint32_t entry = 0;
  int blocks = 0;
  std::size_t words = 0;  // of 16 bits, in all blocks
};

// What the image says of itself, or one line: what is wrong with it, and where.
[[nodiscard]] tl::expected<BootStream, std::string> check_boot_stream(std::span<const std::uint8_t> image);

// The bytes of a file that holds such an image. The error is one line.
[[nodiscard]] tl::expected<std::vector<std::uint8_t>, std::string> read_boot_stream(const std::string& path);

}  // namespace punctum::falcon
