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
  // What cannot be read, or is no file and may never end, has no columns and no rows.
  explicit CsvReader(const std::string& path);

  [[nodiscard]] bool is_empty() const { return columns_.empty(); }
  [[nodiscard]] bool has(std::string_view column) const { return columns_.contains(column); }
  [[nodiscard]] bool next();  // false: there is no further row
  // Of the present row: it has a cell for each column, and no byte that is no text, as where blocks of a disk
  // were lost.
  [[nodiscard]] bool is_whole() const {
    return cells_.size() == width_ && line_.find('\0') == std::string::npos;
  }
  // Of the present row: the file ends before its line does.
  [[nodiscard]] bool is_cut_off() const { return in_.eof(); }
  // Of the present row; empty where the row or the file has no such cell.
  [[nodiscard]] std::string_view text(std::string_view column) const;
  [[nodiscard]] std::optional<double> number(std::string_view column) const;

 private:
  std::ifstream in_;
  std::map<std::string, std::size_t, std::less<>> columns_;
  std::size_t width_ = 0;  // of the header
  std::string line_;
  std::vector<std::string_view> cells_;
};

}  // namespace punctum::tools
