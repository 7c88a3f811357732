// TOML text as a tree, or one line that says what is wrong with it. The only header that includes toml++.
#pragma once

// toml++ asserts, or lets the compiler assume, what a malformed key denies; without that it reports the key.
#define TOML_EXCEPTIONS 0
#define TOML_ASSERT(expr) static_assert(true)
#define TOML_MAX_NESTED_VALUES 16
#if __has_include(<toml++/impl/preprocessor.hpp>)  // 3.4
#include <toml++/impl/preprocessor.hpp>
#else
#include <toml++/impl/preprocessor.h>
#endif
#undef TOML_ASSERT_ASSUME
#define TOML_ASSERT_ASSUME(expr) static_assert(true)
#include <toml++/toml.h>

#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace punctum::tools {

// Where a message stands: "file:line:column", or only the source of an override.
struct Source {
  std::string name;
  bool has_lines = true;
  [[nodiscard]] std::string at(const toml::source_position& p) const;
};

[[nodiscard]] tl::expected<toml::table, std::string> parse_toml(std::string_view text, const Source& source);

}  // namespace punctum::tools
