#include "tools/shared/html.hpp"

#include <cstddef>
#include <cstdint>

namespace punctum::tools {
namespace {

constexpr const char* kNoText = "\xEF\xBF\xBD";  // U+FFFD

// The length of the UTF-8 letter at the start of s; 0 if there is none.
std::size_t letter_length(std::string_view s) {
  const auto first = static_cast<unsigned char>(s[0]);
  const std::size_t n = first < 0x80   ? 1
                        : first < 0xC2 ? 0
                        : first < 0xE0 ? 2
                        : first < 0xF0 ? 3
                        : first < 0xF5 ? 4
                                       : 0;
  if (n > s.size()) {
    return 0;
  }
  for (std::size_t i = 1; i < n; ++i) {
    if ((static_cast<unsigned char>(s[i]) & 0xC0U) != 0x80U) {
      return 0;
    }
  }
  // Overlong forms, surrogates and what lies beyond Unicode.
  const auto second = n > 1 ? static_cast<unsigned char>(s[1]) : 0U;
  if ((first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
      (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F)) {
    return 0;
  }
  return n;
}

}  // namespace

std::string readable(std::string_view text) {
  std::string s;
  while (!text.empty()) {
    const std::size_t n = letter_length(text);
    const auto c = static_cast<unsigned char>(text[0]);
    const bool is_text = n > 0 && (c >= 0x20 || c == '\n' || c == '\t') && c != 0x7F;
    s += is_text ? text.substr(0, n) : kNoText;
    text.remove_prefix(is_text ? n : 1);
  }
  return s;
}

std::string escaped(std::string_view text) {
  std::string s;
  for (const char c : readable(text)) {
    switch (c) {
      case '&':
        s += "&amp;";
        break;
      case '<':
        s += "&lt;";
        break;
      case '>':
        s += "&gt;";
        break;
      case '"':
        s += "&quot;";
        break;
      case '\'':
        s += "&#39;";
        break;
      default:
        s += c;
    }
  }
  return s;
}

std::string base64(std::string_view bytes) {
  constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = bytes.size() - i < 3 ? bytes.size() - i : 3;
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8U | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out += k <= n ? kLetters[group >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return out;
}

}  // namespace punctum::tools
