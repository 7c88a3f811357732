// Words for whoever has started the program. What cannot be written (the disk is full, nobody reads the pipe)
// is dropped: no program ends for want of a listener. Nothing here throws.
#pragma once

#include <cstdio>
#include <string_view>

namespace punctum::tools {

void say(std::string_view text) noexcept;        // on the standard output, as it is
void say_aside(std::string_view text) noexcept;  // on the standard error output, as it is
void complain(std::string_view text) noexcept;   // likewise, as a line of its own

// The exit code of a program whose words are its result: `code`, but exit_not_done in place of exit_done
// where not all of them were taken; one line on the standard error output says so.
[[nodiscard]] int code_after_words(int code) noexcept;

}  // namespace punctum::tools
