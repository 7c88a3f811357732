// punctum-report as a person runs it: every topic there is, in its quick form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/e2e/programs.hpp"
#include "tools/report/topic.hpp"

namespace punctum::e2e {
namespace {

const char* const kProgram = "punctum-report";

// The fields of a CSV file, quoted ones too.
std::vector<std::vector<std::string>> fields(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> row(1);
  bool quoted = false;
  for (std::size_t i = 0; i < csv.size(); ++i) {
    const char c = csv[i];
    if (quoted && c == '"' && i + 1 < csv.size() && csv[i + 1] == '"') {
      row.back() += csv[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && c == ',') {
      row.emplace_back();
    } else if (!quoted && c == '\n') {
      rows.push_back(std::move(row));
      row.assign(1, "");
    } else {
      row.back() += c;
    }
  }
  return rows;
}

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
    const std::string svg = read_all(out / (name + ".svg"));
    EXPECT_NE(svg.find("</svg>"), std::string::npos);
    EXPECT_EQ(svg.find("nothing could be drawn"), std::string::npos);
    const auto rows = fields(read_all(out / (name + ".csv")));
    ASSERT_GE(rows.size(), 2U);
    const auto& head = rows.front();
    EXPECT_EQ(std::set(head.begin(), head.end()).size(), head.size());
    EXPECT_EQ(std::vector(head.end() - 4, head.end()),
              (std::vector<std::string>{"machine", "compiler", "flags", "commit"}));
    for (const auto& row : rows) ASSERT_EQ(row.size(), head.size());
    const auto column = [&head](const char* wanted) {
      return static_cast<std::size_t>(std::find(head.begin(), head.end(), wanted) - head.begin());
    };
    if (const auto shipped = column("shipped"), median = column("median_ns"); shipped < head.size()) {
      ASSERT_LT(median, head.size());
      EXPECT_TRUE(std::any_of(rows.begin() + 1, rows.end(), [&](const auto& row) {
        return row[shipped] == "1" && std::atof(row[median].c_str()) > 0;
      }));
    }
    EXPECT_TRUE(std::regex_search(said_, std::regex("(^|\n)" + name + " +[^ ].*\\([0-9.]+ s\\)\n"))) << said_;
  }
  EXPECT_FALSE(std::regex_search(html, std::regex("<script|<link|<img|<iframe|@import")));
  for (std::size_t at = html.find("href="); at != std::string::npos; at = html.find("href=", at + 1))
    ASSERT_EQ(html[at + 6], '#') << html.substr(at, 60);
  EXPECT_EQ(html.find("class=\"failed\""), std::string::npos);
}

TEST_F(Report, BadInputIsOneLineAndCodeTwo) {
  const std::vector<std::vector<std::string>> inputs = {{"colour", "--out", report()},
                                                        {"all", "--out", "/proc/nowhere"},
                                                        {"all", "--out", ""},
                                                        {},
                                                        {"all", "--fast"}};
  for (const auto& args : inputs) {
    EXPECT_EQ(run(args), 2) << said_;
    EXPECT_EQ(std::count(said_.begin(), said_.end(), '\n'), 1) << said_;
  }
  EXPECT_FALSE(fs::exists(report()));
}

}  // namespace
}  // namespace punctum::e2e
