// punctum-report as a user runs it: all topics, with --quick.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/e2e/quick_report.hpp"
#include "tests/support/programs.hpp"
#include "tools/report/topic.hpp"

namespace punctum::e2e {
namespace {

// The fields of a CSV file; some of them are quoted.
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
    Running running(args, words(), "punctum-report");
    const int code = running.wait();
    said_ = running.output();
    return code;
  }
};

TEST_F(Report, writes_tables_figures_and_one_page_for_every_topic) {
  const QuickReport& made = quick_report();
  ASSERT_EQ(made.code, 0) << made.said;
  const fs::path out = made.folder();
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
    for (const auto& row : rows) {
      ASSERT_EQ(row.size(), head.size());
    }
    const auto column = [&head](const char* wanted) {
      return static_cast<std::size_t>(std::find(head.begin(), head.end(), wanted) - head.begin());
    };
    if (const auto shipped = column("shipped"), median = column("median_ns"); shipped < head.size()) {
      ASSERT_LT(median, head.size());
      EXPECT_TRUE(std::any_of(rows.begin() + 1, rows.end(), [&](const auto& row) {
        return row[shipped] == "1" && std::atof(row[median].c_str()) > 0;
      }));
    }
    EXPECT_TRUE(std::regex_search(made.said, std::regex("(^|\n)" + name + " +[^ ].*\\([0-9.]+ s\\)\n")))
        << made.said;
  }
  EXPECT_FALSE(std::regex_search(html, std::regex("<script|<link|<img|<iframe|@import")));
  for (std::size_t at = html.find("href="); at != std::string::npos; at = html.find("href=", at + 1)) {
    ASSERT_EQ(html[at + 6], '#') << html.substr(at, 60);
  }
  EXPECT_EQ(html.find("class=\"failed\""), std::string::npos);
}

TEST_F(Report, reports_bad_input_in_one_line_with_exit_code_two) {
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
