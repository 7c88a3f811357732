#include "tools/scene/toml_document.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <utility>

#include "tools/scene/messages.hpp"

namespace punctum::tools {
namespace {

using Unexpected = tl::unexpected<std::string>;

// toml++ builds a table for each dot of a key and destroys them by recursion: 100 000 of them overflow the
// stack.
constexpr int kMostDotsOnLine = 64;

// The word that was most probably meant on that line, for messages about syntax.
std::string key_on_line(std::string_view text, std::uint32_t line) {
  std::string_view l = text;
  for (std::uint32_t n = 1; n < line && !l.empty(); ++n) {
    const auto end = l.find('\n');
    l = end == std::string_view::npos ? std::string_view{} : l.substr(end + 1);
  }
  l = l.substr(0, l.find('\n'));
  l = l.substr(0, l.find('='));
  const auto first = l.find_first_not_of(" \t\r");
  const auto last = l.find_last_not_of(" \t\r");
  return first == std::string_view::npos ? "syntax" : printable(l.substr(first, last - first + 1), 40);
}

// What toml++ says, in the words of all other messages.
std::string reworded(std::string what) {
  if (what.find("cannot redefine existing") != std::string::npos) {
    return "given twice, allowed: once";
  }
  if (what.find("maximum nested value depth") != std::string::npos) {
    return fmt::format("brackets are nested too deeply, allowed: {} levels", TOML_MAX_NESTED_VALUES);
  }
  if (what.starts_with("Error while parsing ")) {
    if (const auto colon = what.find(": "); colon != std::string::npos) {
      what = what.substr(colon + 2);
    }
  }
  return "not valid TOML: " + what;
}

// One letter of UTF-8 beyond ASCII that begins at text[i]; i is moved to its last byte. 0: not a letter.
std::uint32_t read_letter(std::string_view text, std::size_t& i) {
  const auto lead = static_cast<unsigned char>(text[i]);
  const int more = lead >= 0xf0 && lead < 0xf5   ? 3
                   : lead >= 0xe0 && lead < 0xf0 ? 2
                   : lead >= 0xc2 && lead < 0xe0 ? 1
                                                 : 0;
  constexpr std::uint32_t kLeast[] = {0, 0x80, 0x800, 0x10000};
  std::uint32_t letter = lead & (0x3fU >> more);
  int read = 0;
  for (; read < more && i + 1 < text.size() && (text[i + 1] & 0xc0) == 0x80; ++read) {
    letter = letter << 6 | (static_cast<unsigned char>(text[++i]) & 0x3fU);
  }
  const bool valid = more > 0 && read == more && letter >= kLeast[more] && letter < 0x110000 &&
                     (letter < 0xd800 || letter > 0xdfff);
  return valid ? letter : 0;
}

// The string or comment that a place of the text is in.
class Quote {
 public:
  void pass(char c) {
    if (c == '\n') {
      quote_ = 0;
    } else if (quote_ == 0 && (c == '"' || c == '\'' || c == '#')) {
      quote_ = c;
      escaped_ = false;
    } else if (quote_ != '#' && c == quote_ && !escaped_) {
      quote_ = 0;
    }
    escaped_ = c == '\\' && quote_ == '"' && !escaped_;
  }
  [[nodiscard]] bool open() const { return quote_ != 0; }
  [[nodiscard]] bool escapes_are_read() const { return quote_ == '"' || quote_ == '#'; }

 private:
  char quote_ = 0;
  bool escaped_ = false;
};

// The same text in ASCII: letters beyond it as \UXXXXXXXX, which means the same in a "string". toml++ 3.3
// leaves open what it does with such a letter where a key or a value could begin.
tl::expected<std::string, std::string> in_ascii(std::string_view text, const Source& source) {
  std::string out;
  out.reserve(text.size());
  toml::source_position here{1, 0};
  int dots = 0;  // of keys, on this line; decimal points count too
  Quote quote;
  for (std::size_t i = 0; i < text.size(); ++i) {
    ++here.column;
    const char c = text[i];
    if (static_cast<unsigned char>(c) < 0x80) {
      out += c;
      quote.pass(c);
      dots += c == '.' && !quote.open() ? 1 : 0;
      if (dots > kMostDotsOnLine) {
        return Unexpected(
            fmt::format("{}: syntax: too many dots, allowed: {} on a line outside of \"strings\"",
                        source.at(here), kMostDotsOnLine));
      }
      if (c == '\n') {
        ++here.line;
        here.column = 0;
        dots = 0;
      }
      continue;
    }
    const std::uint32_t letter = read_letter(text, i);
    if (letter == 0 || !quote.escapes_are_read()) {
      return Unexpected(fmt::format("{}: syntax: {}", source.at(here),
                                    letter != 0
                                        ? "a letter beyond ASCII, allowed: in comments and \"strings\""
                                        : "not a letter of UTF-8, allowed: text in UTF-8"));
    }
    out += fmt::format("\\U{:08X}", letter);
  }
  return out;
}

}  // namespace

std::string Source::at(const toml::source_position& p) const {
  return has_lines ? fmt::format("{}:{}:{}", name, p.line, p.column) : name;
}

tl::expected<toml::table, std::string> parse_toml(std::string_view text, const Source& source) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // some editors put it before UTF-8
  if (text.starts_with(kByteOrderMark)) {
    text.remove_prefix(kByteOrderMark.size());
  }
  const auto ascii = in_ascii(text, source);
  if (!ascii) {
    return Unexpected(ascii.error());
  }
  toml::parse_result result = toml::parse(*ascii);
  if (!result) {
    const auto& e = result.error();
    return Unexpected(fmt::format("{}: {}: {}", source.at(e.source().begin),
                                  key_on_line(text, e.source().begin.line),
                                  reworded(printable(e.description(), 200))));
  }
  return std::move(result).table();
}

}  // namespace punctum::tools
