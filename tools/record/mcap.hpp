// The file format MCAP, version 0 (https://mcap.dev/spec), as far as writer and reader share it.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace punctum::tools::mcap {

static_assert(std::endian::native == std::endian::little, "numbers of a file are little-endian");

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::string_view kOwnLibrary =
    "punctum";                                 // so begins the name of the writer in our own files
inline constexpr std::size_t kRecordHead = 9;  // its kind and the length of its content

enum class Op : std::uint8_t {
  header = 1,
  footer,
  schema,
  channel,
  message,
  chunk,
  message_index,
  chunk_index,
  attachment,
  attachment_index,
  statistics,
  metadata,
  metadata_index,
  summary_offset,
  data_end,
  others = 0x80,  // and all above: other people's
};

// CRC-32 as zlib has it.
class Crc32 {
 public:
  void add(std::string_view bytes) noexcept {
    std::uint32_t c = state_;
    for (const char b : bytes) {
      c = kTable[(c ^ static_cast<std::uint8_t>(b)) & 0xFFU] ^ (c >> 8U);
    }
    state_ = c;
  }
  [[nodiscard]] std::uint32_t value() const noexcept { return ~state_; }

 private:
  static constexpr std::array<std::uint32_t, 256> kTable = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < table.size(); ++i) {
      std::uint32_t c = i;
      for (int bit = 0; bit < 8; ++bit) {
        c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1U) : c >> 1U;
      }
      table[i] = c;
    }
    return table;
  }();
  std::uint32_t state_ = 0xFFFFFFFFU;
};
[[nodiscard]] inline std::uint32_t crc32(std::string_view bytes) noexcept {
  Crc32 crc;
  crc.add(bytes);
  return crc.value();
}

template <class Number>
void put(std::string& out, Number n) {
  const auto bytes = std::bit_cast<std::array<char, sizeof n>>(n);
  out.append(bytes.data(), bytes.size());
}
inline void put_text(std::string& out, std::string_view text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

// Takes the content of a record apart; once it has failed it gives zeros.
class Fields {
 public:
  explicit Fields(std::string_view bytes) : rest_(bytes) {}

  template <class Number>
  [[nodiscard]] Number number() {
    std::array<char, sizeof(Number)> bytes{};
    take(bytes.size()).copy(bytes.data(), bytes.size());
    return std::bit_cast<Number>(bytes);
  }
  [[nodiscard]] std::string_view take(std::uint64_t size) {
    if (failed_ || size > rest_.size()) {
      failed_ = true;
      return {};
    }
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }
  [[nodiscard]] std::string_view text() { return take(number<std::uint32_t>()); }
  [[nodiscard]] std::string_view rest() const { return rest_; }
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  std::string_view rest_;
  bool failed_ = false;
};

}  // namespace punctum::tools::mcap
