// A line of the Zaber ASCII protocol as a device sends it: "@01 1 07 OK IDLE -- 10000".
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace punctum::zaber {

struct Reply {
  int device = 0;
  int axis = 0;
  int id = -1;      // of the command that it answers; -1: it had none
  bool ok = false;  // false: rejected, and `data` says why
  bool busy = false;
  std::array<char, 2> flag{'-', '-'};  // the gravest warning that is active
  std::string_view data;               // of the line that was parsed
};

// Without its line end. Nothing: it is no reply (an alert "!", an information "#", anything broken), or its
// checksum is wrong.
[[nodiscard]] std::optional<Reply> parse_reply(std::string_view line);

// A whole number; positions may have decimals, which are less than a microstep.
[[nodiscard]] std::optional<std::int64_t> number_of(std::string_view data);

}  // namespace punctum::zaber
