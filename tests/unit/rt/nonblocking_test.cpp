// Whatever the real-time tick may call says so: in the core, and in the interfaces it calls, `noexcept` is
// written NONBLOCKING (hal/realtime.hpp), so that nothing new escapes the compiler's proof. What sleeps is
// listed here.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace punctum::tests {
namespace {

namespace fs = std::filesystem;

// The clocks' sleep and the loop that calls it between two ticks.
const std::regex kSleeps(R"(sleep_until_ns\(|\bEnded (Executive::)?run\(|Executive::Ended Executive::run\()");

int noexcepts(const std::string& line) {
  static const std::regex bare(R"(\bnoexcept\b)");
  const std::string code = line.substr(0, line.find("//"));
  return std::regex_search(code, bare) && !std::regex_search(code, kSleeps) ? 1 : 0;
}

TEST(Nonblocking, every_noexcept_of_the_core_is_written_nonblocking_but_of_what_sleeps) {
  int lines = 0;
  std::vector<fs::path> files{"hal/devices.hpp", "hal/frames.hpp", "hal/ipc/exchange.hpp"};
  for (const char* room : {"rt/executive", "rt/station", "rt/forces", "rt/control"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(PUNCTUM_SOURCE_DIR) / room)) {
      if (entry.path().extension() == ".hpp" || entry.path().extension() == ".cpp") {
        files.push_back(entry.path());
      }
    }
  }
  for (const fs::path& file : files) {
    std::ifstream in(PUNCTUM_SOURCE_DIR / file);
    ASSERT_TRUE(in.good()) << file;
    int number = 0;
    for (std::string line; std::getline(in, line); ++number, ++lines) {
      EXPECT_EQ(noexcepts(line), 0) << file.string() << ":" << number + 1 << ": " << line;
    }
  }
  EXPECT_GT(lines, 1000);
}

TEST(Nonblocking, a_bare_noexcept_is_seen_and_a_sleeper_is_let_through) {
  EXPECT_EQ(noexcepts("  void tick() noexcept;"), 1);
  EXPECT_EQ(noexcepts("  void tick() NONBLOCKING;  // was noexcept"), 0);
  EXPECT_EQ(noexcepts("  void sleep_until_ns(std::int64_t t_ns) noexcept override;"), 0);
  EXPECT_EQ(noexcepts("  Ended run(const std::atomic<bool>& stop) noexcept;"), 0);
  EXPECT_EQ(noexcepts("  void rerun(int n) noexcept;"), 1);
}

// A suppression in the core would hide what it stands on.
TEST(Nonblocking, nothing_in_the_core_switches_the_proof_off) {
  const std::regex off(R"(#pragma|_Pragma|__rtsan|nolock|nonallocating|blocking\(false\)|no_sanitize)");
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(PUNCTUM_SOURCE_DIR) / "rt")) {
    if (!entry.is_regular_file() || entry.path().extension() == ".txt") {
      continue;
    }
    std::ifstream in(entry.path());
    for (std::string line; std::getline(in, line);) {
      const bool harmless = line == "#pragma once" || line.starts_with("#pragma GCC unroll ");
      EXPECT_TRUE(harmless || !std::regex_search(line, off)) << entry.path() << ": " << line;
    }
  }
}

}  // namespace
}  // namespace punctum::tests
