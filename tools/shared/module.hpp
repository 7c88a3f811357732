// A part of the installation that a program loads only when it is needed.
#pragma once

#include <string>
#include <tl/expected.hpp>

namespace punctum::tools {

// The function of a module (a file in lib/punctum/modules), or why there is none. The module stays loaded.
[[nodiscard]] tl::expected<void*, std::string> function_of_module(const char* module, const char* function);

}  // namespace punctum::tools
