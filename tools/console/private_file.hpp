// Files that hold a secret, or what is shown to everybody.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

namespace punctum::console {

enum class Readers : std::uint8_t { owner, everybody };

// The text of a regular file of up to 64 kB; no pipe is waited for. Of `owner`: refused where anybody but
// this user or root may read, write or own it. The error is one line and tells nothing of the text.
[[nodiscard]] tl::expected<std::string, std::string> read_file(const std::string& path, Readers readers);

}  // namespace punctum::console
