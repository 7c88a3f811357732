// The core as built asks nothing of the world but arithmetic: every symbol that libpunctum_rt.a leaves for
// others to define is on the list below. Whatever is not (heap, exceptions, type information, locks, stdio,
// strings, guarded statics, any system call) is found, whoever brings it.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace {

std::string from_environment(const char* name, const char* otherwise) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : otherwise;
}

// The mathematics library, the four memory functions a compiler may call by itself, its stack check, and the
// atomic operations that g++ for ARM keeps in libgcc.
const std::regex& allowed() {
  static const std::regex list(
      "a?(sin|cos|tan)h?f?|sincosf?|atan2f?|sqrtf?|cbrtf?|exp(2|m1)?f?|log(1p|2|10)?f?|powf?|hypotf?|fmodf?|"
      "remainderf?|floorf?|ceilf?|truncf?|l?l?roundf?|l?l?rintf?|nearbyintf?|fmaf?|fabsf?|copysignf?|fminf?|"
      "fmaxf?|ldexpf?|frexpf?|erff?c?f?|"
      "memcpy|memmove|memset|memcmp|"
      "__stack_chk_fail|__stack_chk_guard|_GLOBAL_OFFSET_TABLE_|"
      "__aarch64_(cas|swp|ldadd|ldset|ldclr|ldeor)[0-9]+_(relax|acq|rel|acq_rel|sync)");
  return list;
}

// Type information, and the guards of statics in functions, may not even be defined.
bool forbidden_to_define(const std::string& symbol) {
  return symbol.starts_with("_ZTI") || symbol.starts_with("_ZTS") || symbol.starts_with("_ZGV");
}

struct Symbols {
  std::set<std::string> defined;
  std::map<std::string, std::string> undefined;  // symbol -> where it is asked for
};

// `file` is an archive or an object, read by nm in its portable format: "file[member]: name type ...".
Symbols symbols_of(const std::string& file) {
  const std::string command = from_environment("PUNCTUM_NM", PUNCTUM_NM_PROGRAM) + " -A -P '" + file + "'";
  const auto close = [](std::FILE* f) { pclose(f); };
  const std::unique_ptr<std::FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
  std::string text;
  std::array<char, 4096> buffer{};
  while (pipe != nullptr && std::fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr) {
    text += buffer.data();
  }
  Symbols symbols;
  std::istringstream lines(text);
  std::string where;
  std::string name;
  std::string type;
  std::string rest;
  while (lines >> where >> name >> type && std::getline(lines, rest)) {
    if (type == "U" || type == "w" || type == "v") {
      symbols.undefined[name] = where;
    } else {
      symbols.defined.insert(name);
    }
  }
  return symbols;
}

std::string offences(const Symbols& symbols, const std::set<std::string>& besides = {}) {
  std::string found;
  for (const auto& [symbol, where] : symbols.undefined) {
    if (!symbols.defined.contains(symbol) && !besides.contains(symbol) &&
        !std::regex_match(symbol, allowed())) {
      found += "\n  " + where + " needs " + symbol;
    }
  }
  for (const std::string& symbol : symbols.defined) {
    if (forbidden_to_define(symbol)) {
      found += "\n  " + symbol + " is defined";
    }
  }
  return found;
}

TEST(CoreSymbols, CoreNeedsNothingButArithmetic) {
  const Symbols core = symbols_of(from_environment("PUNCTUM_RT_ARCHIVE", PUNCTUM_RT_LIBRARY));
  ASSERT_FALSE(core.defined.empty()) << "nm shows no core";
  EXPECT_EQ(offences(core), "");
}

TEST(CoreSymbols, CoreClockMakesTwoSystemCallsAndNoOther) {
  const Symbols clock = symbols_of(from_environment("PUNCTUM_CLOCK_ARCHIVE", PUNCTUM_CLOCK_LIBRARY));
  ASSERT_FALSE(clock.defined.empty()) << "nm shows no clock";
  EXPECT_EQ(offences(clock, {"clock_gettime", "clock_nanosleep", "__errno_location"}), "");
}

class CoreSymbolsPlanted : public testing::TestWithParam<const char*> {};

TEST_P(CoreSymbolsPlanted, IsFound) {
  const Symbols planted = symbols_of(std::string(PUNCTUM_PLANTED_DIR "/") + GetParam() + ".o");
  ASSERT_FALSE(planted.defined.empty()) << "the planted object is not there";
  EXPECT_NE(offences(planted), "");
}

INSTANTIATE_TEST_SUITE_P(, CoreSymbolsPlanted,
                         testing::Values("MALLOC", "NEW", "VECTOR", "STRING", "THROW", "RANGE_CHECK", "RTTI",
                                         "MUTEX", "PRINTF", "IOSTREAM", "GUARD", "EXIT", "SLEEP", "ASSERT"),
                         [](const auto& plant) { return std::string(plant.param); });

TEST(CoreSymbols, ArithmeticIsNotMistakenForAnOffence) {
  const Symbols planted = symbols_of(PUNCTUM_PLANTED_DIR "/NOTHING.o");
  ASSERT_FALSE(planted.undefined.empty());
  EXPECT_EQ(offences(planted), "");
}

}  // namespace
