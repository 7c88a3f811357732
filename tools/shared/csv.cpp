#include "tools/shared/csv.hpp"

#include <charconv>
#include <filesystem>

namespace punctum::tools {

std::vector<std::string_view> split_csv(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t from = 0;;) {
    const std::size_t comma = line.find(',', from);
    cells.push_back(line.substr(from, comma - from));
    if (comma == std::string_view::npos) {
      return cells;
    }
    from = comma + 1;
  }
}

CsvReader::CsvReader(const std::string& path) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) {
    return;
  }
  in_.open(path);
  if (std::getline(in_, line_)) {
    for (const std::string_view name : split_csv(line_)) {
      columns_.emplace(name, width_++);
    }
  }
}

bool CsvReader::next() {
  if (!std::getline(in_, line_)) {
    return false;
  }
  cells_ = split_csv(line_);
  return true;
}

std::string_view CsvReader::text(std::string_view column) const {
  const auto found = columns_.find(column);
  return found == columns_.end() || found->second >= cells_.size() ? std::string_view{}
                                                                   : cells_[found->second];
}

std::optional<double> CsvReader::number(std::string_view column) const {
  const std::string_view cell = text(column);
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size()) {
    return std::nullopt;
  }
  return value;
}

}  // namespace punctum::tools
