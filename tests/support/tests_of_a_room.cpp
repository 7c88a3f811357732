// The main function of a program that holds the tests of a room.
//
//   forces_test                                        all of them
//   forces_test forces_cues_test forces_membrane_test  the tests of these files
//   forces_test --gtest_filter='*friction*'            by name
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string>

namespace {

// The tests of one file as a filter: "Suite.test:Suite.other:", empty where the program has no such file.
std::string tests_of(const std::string& file) {
  std::string filter;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  for (int s = 0; s < all.total_test_suite_count(); ++s) {
    const testing::TestSuite& suite = *all.GetTestSuite(s);
    for (int t = 0; t < suite.total_test_count(); ++t) {
      const testing::TestInfo& test = *suite.GetTestInfo(t);
      if (std::filesystem::path(test.file()).stem() == file) {
        filter += std::string(suite.name()) + "." + test.name() + ":";
      }
    }
  }
  return filter;
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  std::string filter;
  for (int i = 1; i < argc; ++i) {
    const std::string tests = tests_of(argv[i]);
    if (tests.empty()) {
      std::fprintf(stderr, "%s: there is no test of a file %s.cpp here\n", argv[0], argv[i]);
      return 2;
    }
    filter += tests;
  }
  if (!filter.empty()) {
    testing::GTEST_FLAG(filter) = filter;
  }
  return RUN_ALL_TESTS();
}
