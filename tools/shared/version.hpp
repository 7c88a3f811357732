// What was built: the version of the project and the commit.
#pragma once

#include <string>
#include <string_view>

namespace punctum::tools {

// 12 digits, with "+changes" when the tree differed from it; "unknown" outside a git tree.
[[nodiscard]] const char* built_commit() noexcept;

// The answer to --version: "punctum-core 0.1 (4727cbda541f)".
[[nodiscard]] std::string version_line(std::string_view program);

}  // namespace punctum::tools
