#include <fmt/format.h>

#include <stdexcept>

#include "tools/report/output.hpp"

namespace punctum::report {
namespace {

std::string field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) {
    return text;
  }
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') {
      out += c;
    }
    out += c;
  }
  return out + "\"";
}

}  // namespace

std::string Cell::text(int digits) const {
  if (const auto* s = std::get_if<std::string>(&value_)) {
    return *s;
  }
  if (const auto* i = std::get_if<std::int64_t>(&value_)) {
    return fmt::format("{}", *i);
  }
  const double v = std::get<double>(value_);
  return std::isnan(v) ? std::string() : fmt::format("{:.{}g}", v, digits);
}

void Table::add(Row row) {
  if (row.size() != columns.size()) {
    throw std::logic_error(
        fmt::format("table {}: a row of {} cells for {} columns", name, row.size(), columns.size()));
  }
  rows.push_back(std::move(row));
}

std::string csv(const Table& table, const Provenance& from) {
  std::string text;
  for (const auto& c : table.columns) {
    text += field(c) + ",";
  }
  text += "machine,compiler,flags,commit\n";
  const std::string where = field(from.machine) + "," + field(from.compiler) + "," + field(from.flags) + "," +
                            field(from.commit) + "\n";
  for (const Row& row : table.rows) {
    for (const Cell& cell : row) {
      text += field(cell.text()) + ",";
    }
    text += where;
  }
  return text;
}

}  // namespace punctum::report
