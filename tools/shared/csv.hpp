// Reading tables of plain cells: a header row, cells without quotes, commas between them.
#pragma once

#include <cstddef>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace punctum::tools {

// A line always has one cell more than it has commas. The cells point into the line.
[[nodiscard]] std::vector<std::string_view> split_csv(std::string_view line);

class CsvReader {
 public:
  explicit CsvReader(const std::string& path);  // a file that cannot be read has no columns and no rows

  [[nodiscard]] bool is_empty() const { return columns_.empty(); }
  [[nodiscard]] bool has(std::string_view column) const { return columns_.contains(column); }
  [[nodiscard]] bool next();  // false: there is no further row
  // Of the present row; empty where the row or the file has no such cell.
  [[nodiscard]] std::string_view text(std::string_view column) const;
  [[nodiscard]] std::optional<double> number(std::string_view column) const;

 private:
  std::ifstream in_;
  std::map<std::string, std::size_t, std::less<>> columns_;
  std::string line_;
  std::vector<std::string_view> cells_;
};

}  // namespace punctum::tools
