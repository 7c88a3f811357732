// A file of measured dimples, and the same rows with their force.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tools/report/force_pairs.hpp"

namespace punctum::report {
namespace {

const std::string kHeader = "a_m,wd_m,c_m,h_m,E_Pa,nu\n";
const std::string kGood = "25e-6,20e-6,3.8e-6,4.6e-6,35.3e3,0.5\n";

TEST(ForcePairs, are_returned_unchanged_with_the_force_in_17_digits) {
  const auto out = evaluate_pairs(kHeader + kGood + " 2.0E-5, 20e-6,3.8e-6,4.6e-6,+35300,0.50\n");
  ASSERT_TRUE(out) << out.error();
  // mpmath, 60 digits, of the exact doubles.
  const double first = 5.6915190527838721534e-6, second = 0.000012233026284245715667;
  const std::size_t one = out->find(kGood.substr(0, kGood.size() - 1) + ",");
  ASSERT_EQ(one, kHeader.size() + std::string(",force_N").size());
  EXPECT_EQ(out->substr(0, one), "a_m,wd_m,c_m,h_m,E_Pa,nu,force_N\n");
  EXPECT_NEAR(std::atof(out->c_str() + one + kGood.size()) / first, 1, 4e-15);
  const std::string row = " 2.0E-5, 20e-6,3.8e-6,4.6e-6,+35300,0.50,";
  const std::size_t two = out->find(row);
  ASSERT_NE(two, std::string::npos);
  const std::string printed = out->substr(two + row.size());
  EXPECT_NEAR(std::atof(printed.c_str()) / second, 1, 4e-15);
  EXPECT_EQ(printed, [&] {
    char text[40];
    (void)std::snprintf(text, sizeof text, "%.17g\n", std::atof(printed.c_str()));
    return std::string(text);
  }());
}

TEST(ForcePairs, keep_other_columns_their_order_line_ends_and_a_byte_order_mark) {
  const auto out = evaluate_pairs(
      "\xEF\xBB\xBF"
      "name,nu,E_Pa,h_m,c_m,wd_m,a_m\r\nmouse 3,0.5,35.3e3,4.6e-6,3.8e-6,0,25e-6\r\n"
      "x,0.5,35.3e3,4.6e-6,3.8e-6,-1e-6,0");
  ASSERT_TRUE(out) << out.error();
  EXPECT_EQ(*out,
            "\xEF\xBB\xBF"
            "name,nu,E_Pa,h_m,c_m,wd_m,a_m,force_N\r\n"
            "mouse 3,0.5,35.3e3,4.6e-6,3.8e-6,0,25e-6,0\r\nx,0.5,35.3e3,4.6e-6,3.8e-6,-1e-6,0,0\n");
}

TEST(ForcePairs, report_in_one_line_what_is_wrong_and_where) {
  const std::pair<std::string, std::string> cases[] = {
      {"", "line 1: empty"},
      {"a_m,wd_m,c_m,h_m,E_Pa\n", "line 1: nu: none"},
      {"a_m,wd_m,c_m,h_m,E_Pa,nu,a_m\n", "line 1: a_m: more than one"},
      {"a_m,wd_m,c_m,h_m,E_Pa,nu,force_N\n", "line 1: force_N: is there already"},
      {kHeader + kGood + "25e-6,20e-6,3.8e-6,4.6e-6,35.3e3\n", "line 3: 5 columns, but the header has 6"},
      {kHeader + kGood + "\n", "line 3: 1 columns"},
      {kHeader + "25e-6,deep,3.8e-6,4.6e-6,35.3e3,0.5\n", "line 2: wd_m: deep is not allowed"},
      {kHeader + "25e-6,20e-6,3.8e-6,4.6e-6,35.3e3,\n", "line 2: nu: nothing is not allowed"},
      {kHeader + "25e-6,20e-6,3.8e-6,4.6e-6,35.3e3,1\n", "line 2: nu: 1 is not allowed, allowed: -1 .. 1"},
      {kHeader + "25e-6,20e-6,0,4.6e-6,35.3e3,0.5\n", "line 2: c_m: 0 is not allowed"},
      {kHeader + "25e-6,20e-6,3.8e-6,-1,35.3e3,0.5\n", "line 2: h_m: -1 is not allowed"},
      {kHeader + "nan,20e-6,3.8e-6,4.6e-6,35.3e3,0.5\n", "line 2: a_m: nan is not allowed"},
      {kHeader + "25e-6,1e999,3.8e-6,4.6e-6,35.3e3,0.5\n", "line 2: wd_m: 1e999 is not allowed"},
      {kHeader + "3.8e-6,20e-6,3.8e-6,4.6e-6,35.3e3,0.5\n",
       "line 2: a_m: 3.8e-6 is not allowed, allowed: above c_m, which is 3.8e-6"},
  };
  for (const auto& [csv, message] : cases) {
    const auto out = evaluate_pairs(csv);
    ASSERT_FALSE(out) << csv;
    EXPECT_TRUE(out.error().starts_with(message)) << out.error();
    EXPECT_EQ(out.error().find('\n'), std::string::npos);
  }
}

TEST(ForcePairs, are_written_completely_or_leave_the_old_file) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("punctum-pairs-" + std::to_string(getpid()));
  fs::create_directories(folder);
  const auto write = [](const fs::path& path, const std::string& text) { std::ofstream(path) << text; };
  const auto read = [](const fs::path& path) {
    std::ifstream file(path);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  write(folder / "good.csv", kHeader + kGood);
  write(folder / "bad.csv", kHeader + kGood + "1,2\n");
  EXPECT_EQ(evaluate_pairs_file(folder / "good.csv", folder / "out.csv"), 0);
  const std::string written = read(folder / "out.csv");
  EXPECT_TRUE(written.starts_with("a_m,wd_m,c_m,h_m,E_Pa,nu,force_N\n"));
  EXPECT_EQ(evaluate_pairs_file(folder / "bad.csv", folder / "out.csv"), 2);
  EXPECT_EQ(read(folder / "out.csv"), written);
  EXPECT_EQ(evaluate_pairs_file(folder / "bad.csv", folder / "new.csv"), 2);
  EXPECT_EQ(evaluate_pairs_file(folder / "none.csv", folder / "new.csv"), 2);
  EXPECT_EQ(evaluate_pairs_file(folder, folder / "new.csv"), 2);
  EXPECT_EQ(evaluate_pairs_file("/dev/zero", folder / "new.csv"), 2);
  EXPECT_EQ(evaluate_pairs_file(folder / "good.csv", folder / "no" / "new.csv"), 2);
  EXPECT_EQ(evaluate_pairs_file(folder / "good.csv", folder / "." / "good.csv"), 2)
      << "the rows would be gone";
  EXPECT_EQ(read(folder / "good.csv"), kHeader + kGood);
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder)) {
    ++files;
  }
  EXPECT_EQ(files, 3U);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace punctum::report
