// punctum-report as a person runs it: every topic there is, in its quick form.
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "tests/e2e/programs.hpp"
#include "tools/report/topic.hpp"

namespace punctum::e2e {
namespace {

const char* const kProgram = "punctum-report";

class Report : public Programs {
 protected:
  int run(const std::vector<std::string>& args) {
    Running running(args, words(), kProgram);
    const int code = running.wait();
    said_ = running.output();
    return code;
  }
};

TEST_F(Report, AllWritesTablesFiguresAndOnePageForEveryTopic) {
  ASSERT_EQ(run({"all", "--quick", "--out", report()}), 0) << said_;
  const fs::path out = report();
  const std::string html = read_all(out / "index.html");
  for (const report::Topic& topic : report::topics()) {
    const std::string name(topic.name);
    SCOPED_TRACE(name);
    EXPECT_NE(html.find("<section id=\"" + name + "\">"), std::string::npos);
    EXPECT_GT(read_all(out / (name + ".svg")).size(), 1000U);
    const std::string csv = read_all(out / (name + ".csv"));
    EXPECT_GE(std::count(csv.begin(), csv.end(), '\n'), 2);
    EXPECT_TRUE(csv.substr(0, csv.find('\n')).ends_with(",machine,compiler,flags,commit"));
    EXPECT_TRUE(std::regex_search(said_, std::regex("(^|\n)" + name + " +[^ ].*\\([0-9.]+ s\\)\n"))) << said_;
  }
  EXPECT_FALSE(std::regex_search(html, std::regex("<script|<link|<img|<iframe|@import")));
  for (std::size_t at = html.find("href="); at != std::string::npos; at = html.find("href=", at + 1))
    ASSERT_EQ(html[at + 6], '#') << html.substr(at, 60);
  EXPECT_EQ(html.find("class=\"failed\""), std::string::npos);
}

TEST_F(Report, BadInputIsOneLineAndCodeTwo) {
  const std::vector<std::vector<std::string>> inputs = {
      {"colour", "--out", report()}, {"all", "--out", "/proc/nowhere"}, {}, {"all", "--fast"}};
  for (const auto& args : inputs) {
    EXPECT_EQ(run(args), 2) << said_;
    EXPECT_EQ(std::count(said_.begin(), said_.end(), '\n'), 1) << said_;
  }
  EXPECT_FALSE(fs::exists(report()));
}

}  // namespace
}  // namespace punctum::e2e
