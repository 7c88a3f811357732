// The core as built asks nothing of the world but arithmetic: every symbol that libpunctum_rt.a leaves for
// others to define is on the list of tests/support/symbols.hpp. Whatever is not (heap, exceptions, type
// information, locks, stdio, strings, guarded statics, any system call) is found; planted_violations_test
// shows that it is.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "tests/support/symbols.hpp"

namespace punctum::tests {
namespace {

std::string from_environment(const char* name, const char* otherwise) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : otherwise;
}

Symbols read(const std::string& file) {
  return symbols_of(from_environment("PUNCTUM_NM", PUNCTUM_NM_PROGRAM), file);
}

// The elementary functions that the core calls, in a library of their own.
Symbols elementary_functions() {
  return read(from_environment("PUNCTUM_MATH_ARCHIVE", PUNCTUM_MATH_LIBRARY));
}

TEST(CoreSymbols, core_needs_nothing_but_arithmetic) {
  const Symbols core = read(from_environment("PUNCTUM_RT_ARCHIVE", PUNCTUM_RT_LIBRARY));
  ASSERT_FALSE(core.defined.empty()) << "nm shows no core";
  EXPECT_EQ(offences(core, elementary_functions().defined), "");
}

TEST(CoreSymbols, elementary_functions_need_nothing_at_all) {
  const Symbols functions = elementary_functions();
  ASSERT_FALSE(functions.defined.empty()) << "nm shows no function";
  for (const auto& [symbol, where] : functions.undefined) {
    EXPECT_TRUE(functions.defined.contains(symbol) || symbol == "_GLOBAL_OFFSET_TABLE_")
        << where << " needs " << symbol;
  }
  EXPECT_EQ(offences(functions), "");
}

TEST(CoreSymbols, core_clock_makes_two_system_calls_and_no_other) {
  const Symbols clock = read(from_environment("PUNCTUM_CLOCK_ARCHIVE", PUNCTUM_CLOCK_LIBRARY));
  ASSERT_FALSE(clock.defined.empty()) << "nm shows no clock";
  EXPECT_EQ(offences(clock, {"clock_gettime", "clock_nanosleep", "__errno_location"}), "");
}

}  // namespace
}  // namespace punctum::tests
