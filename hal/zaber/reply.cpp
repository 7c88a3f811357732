#include "hal/zaber/reply.hpp"

#include <algorithm>
#include <charconv>
#include <numeric>

namespace punctum::zaber {
namespace {

std::optional<int> digits(std::string_view text, int base) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  const bool whole = error == std::errc{} && end == text.data() + text.size() && !text.starts_with('-');
  return whole ? std::optional(value) : std::nullopt;
}

// The next word, which is taken from the text.
std::string_view word_of(std::string_view& text) {
  const std::size_t end = std::min(text.find(' '), text.size());
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return word;
}

// Takes ":XX" off the end. All bytes between the first sign and the colon, and the checksum, add up to 0.
bool checksum_fits(std::string_view& line) {
  const std::size_t colon = line.rfind(':');
  if (colon == std::string_view::npos || colon + 3 != line.size()) {
    return true;  // there is none
  }
  const auto sum = digits(line.substr(colon + 1), 16);
  const unsigned bytes =
      std::accumulate(line.begin() + 1, line.begin() + static_cast<std::ptrdiff_t>(colon), 0U,
                      [](unsigned all, char c) { return all + static_cast<unsigned char>(c); });
  line = line.substr(0, colon);
  return sum && ((bytes + static_cast<unsigned>(*sum)) & 0xFFU) == 0;
}

bool is_flag(std::string_view word) {
  return word == "--" || (word.size() == 2 && std::all_of(word.begin(), word.end(), [](char c) {
                            return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
                          }));
}

}  // namespace

std::optional<Reply> parse_reply(std::string_view line) {
  if (!line.starts_with('@') || !checksum_fits(line)) {
    return std::nullopt;
  }
  line.remove_prefix(1);
  Reply reply;
  const auto device = digits(word_of(line), 10), axis = digits(word_of(line), 10);
  if (!device || *device < 1 || *device > 99 || !axis || *axis > 9) {
    return std::nullopt;
  }
  reply.device = *device;
  reply.axis = *axis;
  std::string_view accepted = word_of(line);
  if (const auto id = digits(accepted, 10)) {
    reply.id = *id;
    accepted = word_of(line);
  }
  const std::string_view state = word_of(line), flag = word_of(line);
  if ((accepted != "OK" && accepted != "RJ") || (state != "IDLE" && state != "BUSY") || !is_flag(flag) ||
      line.empty()) {
    return std::nullopt;
  }
  reply.ok = accepted == "OK";
  reply.busy = state == "BUSY";
  reply.flag = {flag[0], flag[1]};
  reply.data = line;
  return reply;
}

std::optional<std::int64_t> number_of(std::string_view data) {
  std::int64_t value = 0;
  const char* const begin = data.data();
  const char* const end_of_data = begin + data.size();
  const auto [end, error] = std::from_chars(begin, end_of_data, value);
  if (error != std::errc{} || (end != end_of_data && *end != '.')) {
    return std::nullopt;
  }
  const bool decimals = std::all_of(end == end_of_data ? end : end + 1, end_of_data,
                                    [](char c) { return c >= '0' && c <= '9'; });
  return decimals ? std::optional(value) : std::nullopt;
}

}  // namespace punctum::zaber
