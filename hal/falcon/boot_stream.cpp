#include "hal/falcon/boot_stream.hpp"

#include <cstdio>
#include <fstream>

namespace punctum::falcon {
namespace {

using Unexpected = tl::unexpected<std::string>;

constexpr std::size_t kMostBytes = 1U << 20U;  // more than the processor has memory
constexpr unsigned kKey = 0x08AA;              // a stream 8 bits wide
constexpr int kReservedWords = 8;
constexpr std::uint32_t kHighestAddress = 0x3FFFFF;  // it has 22 address lines

std::string hex(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof(text), "0x%04X", static_cast<unsigned>(value));
  return text;
}

// Words of 16 bits, low byte first.
class Words {
 public:
  explicit Words(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool have(std::size_t words) const { return bytes_.size() - at_ >= 2 * words; }
  [[nodiscard]] std::uint32_t next() {
    const auto word = static_cast<std::uint32_t>(bytes_[at_] | (bytes_[at_ + 1] << 8U));
    at_ += 2;
    return word;
  }
  // High word first.
  [[nodiscard]] std::uint32_t next_address() {
    const std::uint32_t high = next();
    return high << 16U | next();
  }
  void skip(std::size_t words) { at_ += 2 * words; }
  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

std::string place(const Words& words) { return "byte " + std::to_string(words.at()) + ": "; }

}  // namespace

tl::expected<BootStream, std::string> check_boot_stream(std::span<const std::uint8_t> image) {
  if (image.size() > kMostBytes) {
    return Unexpected("has " + std::to_string(image.size()) + " bytes, allowed: at most " +
                      std::to_string(kMostBytes));
  }
  Words words(image);
  const auto ends = [&](const char* in) {
    return Unexpected(place(words) + "ends in " + in + ", allowed: a whole C2000 boot stream");
  };
  constexpr std::size_t kHead = 1 + kReservedWords + 2;
  if (!words.have(kHead)) {
    return ends("its head");
  }
  if (const std::uint32_t key = words.next(); key != kKey) {
    return Unexpected("byte 0: begins with " + hex(key) +
                      ", allowed: a C2000 boot stream, which begins with " + hex(kKey));
  }
  words.skip(kReservedWords);
  BootStream stream;
  stream.entry = words.next_address();
  const auto too_high = [&](std::uint32_t address) {
    return Unexpected(place(words) + "address " + hex(address) + ", allowed: up to " + hex(kHighestAddress));
  };
  if (stream.entry > kHighestAddress) {
    return too_high(stream.entry);
  }
  for (;;) {
    if (!words.have(1)) {
      return ends("the middle: no block of size 0 ends it");
    }
    const std::uint32_t size = words.next();
    if (size == 0) {
      break;
    }
    if (!words.have(2 + static_cast<std::size_t>(size))) {
      return ends("a block");
    }
    const std::uint32_t address = words.next_address();
    if (address > kHighestAddress || kHighestAddress - address < size - 1) {
      return too_high(address);
    }
    words.skip(size);
    ++stream.blocks;
    stream.words += size;
  }
  if (stream.blocks == 0) {
    return Unexpected(place(words) + "holds no block, allowed: at least one");
  }
  if (words.left() > 0) {
    return Unexpected(place(words) + std::to_string(words.left()) + " bytes behind its end, allowed: none");
  }
  return stream;
}

tl::expected<std::vector<std::uint8_t>, std::string> read_boot_stream(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::uint8_t> image;
  char part[4096];
  while (file && image.size() <= kMostBytes) {
    file.read(part, sizeof(part));
    image.insert(image.end(), part, part + file.gcount());
  }
  if (image.empty()) {
    return Unexpected("falcon.firmware = \"" + path +
                      "\": cannot be read, allowed: a file with a boot stream");
  }
  if (const auto checked = check_boot_stream(image); !checked) {
    return Unexpected("falcon.firmware = \"" + path + "\": " + checked.error());
  }
  return image;
}

}  // namespace punctum::falcon
