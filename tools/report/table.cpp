#include <fmt/format.h>

#include <stdexcept>

#include "tools/report/topic.hpp"

namespace punctum::report {

std::string Cell::text(int digits) const {
  if (const auto* s = std::get_if<std::string>(&value_)) return *s;
  if (const auto* i = std::get_if<std::int64_t>(&value_)) return fmt::format("{}", *i);
  const double v = std::get<double>(value_);
  return std::isnan(v) ? std::string() : fmt::format("{:.{}g}", v, digits);
}

void Table::add(Row row) {
  if (row.size() != columns.size())
    throw std::logic_error(
        fmt::format("table {}: a row of {} cells for {} columns", name, row.size(), columns.size()));
  rows.push_back(std::move(row));
}

}  // namespace punctum::report
