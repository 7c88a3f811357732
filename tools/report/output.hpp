// What becomes of a topic's result: CSV files, figures by gnuplot, one page that shows them all.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "tools/report/topic.hpp"

namespace punctum::report {

// Where and of what the numbers were measured.
struct Provenance {
  std::string machine, compiler, flags, commit;
};
[[nodiscard]] Provenance provenance();

// A header row, the rows, then the columns machine,compiler,flags,commit. Quoted where RFC 4180 asks for it.
[[nodiscard]] std::string csv(const Table& table, const Provenance& from);

// OUT/NAME.svg by gnuplot. The error says why there is none.
[[nodiscard]] tl::expected<void, std::string> draw(const Figure& figure, const std::filesystem::path& out);
[[nodiscard]] std::string gnuplot_script(const Figure& figure, const std::filesystem::path& svg);

struct Finished {
  std::string topic, about;
  Result result{};
  std::string error{};  // why there is no result
};

// One page without anything outside of it; the figures are read from OUT/NAME.svg where they exist.
[[nodiscard]] std::string page(std::span<const Finished> topics, const Provenance& from,
                               const std::filesystem::path& out);
[[nodiscard]] std::string escaped(const std::string& text);  // for HTML, attributes too

}  // namespace punctum::report
