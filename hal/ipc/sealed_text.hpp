// A text that a parent hands to its children by an inherited descriptor, and that nobody can change. Set-up
// code.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "hal/ipc/segment.hpp"

namespace punctum::hal {

// Memory without a place in any file system, sealed against writing and resizing. `name`: for messages and
// /proc/PID/fd.
[[nodiscard]] tl::expected<Descriptor, std::string> seal_text(std::string_view name, std::string_view text);

// The path under which a process that has inherited the descriptor reads it, as often as it likes.
[[nodiscard]] std::string inherited_path(const Descriptor& descriptor);

}  // namespace punctum::hal
