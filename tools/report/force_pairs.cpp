#include "tools/report/force_pairs.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

#include "rt/forces/membrane.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/whole_file.hpp"

namespace punctum::report {
namespace {

constexpr const char* kResult = "force_N";

struct Column {
  std::string_view name;
  bool (*good)(double);
  std::string_view allowed;
};
bool positive(double x) { return x > 0; }
constexpr std::array<Column, 6> kColumns = {{
    {"a_m", [](double) { return true; }, "a number"},
    {"wd_m", [](double) { return true; }, "a number"},
    {"c_m", positive, "a number above 0"},
    {"h_m", positive, "a number above 0"},
    {"E_Pa", positive, "a number above 0"},
    {"nu", [](double x) { return x > -1 && x < 1; }, "-1 .. 1"},
}};
enum : std::size_t { kA, kW, kC, kH, kE, kNu };

std::string_view trimmed(std::string_view s) {
  const std::size_t first = s.find_first_not_of(" \t");
  return first == std::string_view::npos ? "" : s.substr(first, s.find_last_not_of(" \t") + 1 - first);
}

// For a message: short, and without control characters.
std::string shown(std::string_view s) {
  std::string text(s.substr(0, 40));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < ' ' || c == 127) {
      c = '?';
    }
  }
  return text;
}

tl::unexpected<std::string> wrong(std::size_t line, const std::string& what) {
  return tl::unexpected(fmt::format("line {}: {}", line, what));
}

bool number(std::string_view cell, double& value) {
  std::string_view text = trimmed(cell);
  if (text.starts_with('+') && !text.starts_with("+-")) {
    text.remove_prefix(1);
  }
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

}  // namespace

tl::expected<std::string, std::string> evaluate_pairs(std::string_view csv) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";  // that some programs put before UTF-8
  std::string out;
  if (csv.starts_with(kMark)) {
    out = kMark;
    csv.remove_prefix(kMark.size());
  }
  std::array<std::size_t, kColumns.size()> place{};
  std::size_t columns = 0;
  std::size_t line_number = 0;
  while (!csv.empty()) {
    ++line_number;
    const std::size_t newline = csv.find('\n');
    std::string_view line = csv.substr(0, newline);
    const bool ended = newline != std::string_view::npos;
    csv.remove_prefix(ended ? newline + 1 : csv.size());
    const bool carriage_return = line.ends_with('\r');
    if (carriage_return) {
      line.remove_suffix(1);
    }
    const auto append = [&](std::string_view what) {
      out += line;
      out += ',';
      out += what;
      out += carriage_return ? "\r\n" : "\n";
    };

    const auto cells = tools::split_csv(line);
    if (columns == 0) {
      columns = cells.size();
      for (std::size_t i = 0; i < columns; ++i) {
        if (trimmed(cells[i]) == kResult) {
          return wrong(1, fmt::format("{}: is there already", kResult));
        }
      }
      for (std::size_t k = 0; k < kColumns.size(); ++k) {
        std::size_t found = 0;
        for (std::size_t i = 0; i < columns; ++i) {
          if (trimmed(cells[i]) != kColumns[k].name) {
            continue;
          }
          place[k] = i;
          ++found;
        }
        if (found != 1) {
          return wrong(1, fmt::format("{}: {} of this column, needed: a_m,wd_m,c_m,h_m,E_Pa,nu",
                                      kColumns[k].name, found == 0 ? "none" : "more than one"));
        }
      }
      append(kResult);
      continue;
    }
    if (cells.size() != columns) {
      return wrong(line_number, fmt::format("{} columns, but the header has {}", cells.size(), columns));
    }
    std::array<double, kColumns.size()> x{};
    for (std::size_t k = 0; k < kColumns.size(); ++k) {
      const std::string_view cell = cells[place[k]];
      if (!number(cell, x[k]) || !kColumns[k].good(x[k])) {
        return wrong(line_number, fmt::format("{}: {} is not allowed, allowed: {}", kColumns[k].name,
                                              cell.empty() ? "nothing" : shown(cell), kColumns[k].allowed));
      }
    }
    if (x[kW] > 0 && !(x[kA] > x[kC])) {
      return wrong(line_number, fmt::format("a_m: {} is not allowed, allowed: above c_m, which is {}",
                                            shown(cells[place[kA]]), shown(cells[place[kC]])));
    }
    const double force_N = rt::membrane_force(x[kE], x[kNu], x[kH], x[kC], x[kW], x[kA]);
    append(fmt::format("{:.17g}", force_N));
  }
  if (columns == 0) {
    return wrong(1, "empty, needed: a_m,wd_m,c_m,h_m,E_Pa,nu");
  }
  return out;
}

int evaluate_pairs_file(const std::string& input, const std::string& output) {
  constexpr int kBadInput = 2;
  const auto fail = [](const std::string& text) {
    tools::complain(text);
    return kBadInput;
  };
  const auto text = tools::read_whole(input);
  if (!text) {
    return fail("--input: " + text.error());
  }
  if (tools::same_file(output, input)) {
    return fail(fmt::format("--output: {}: is the file of --input, allowed: another one", output));
  }
  const auto rows = evaluate_pairs(*text);
  if (!rows) {
    return fail(fmt::format("{}: {}", input, rows.error()));
  }

  if (const auto written = tools::write_whole(output, *rows); !written) {
    return fail("--output: " + written.error());
  }
  return 0;
}

}  // namespace punctum::report
