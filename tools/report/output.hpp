// What becomes of a topic's result: CSV files and one page that shows all figures.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tools/report/topic.hpp"

namespace punctum::report {

// The machine on which the numbers were measured, and the program.
struct Provenance {
  std::string machine, compiler, flags, commit;
};
[[nodiscard]] Provenance provenance();

// A header row, the rows, then the columns machine,compiler,flags,commit. Quoted where RFC 4180 asks for it.
[[nodiscard]] std::string csv(const Table& table, const Provenance& from);

struct Finished {
  std::string topic, about;
  Result result{};
  std::string error{};  // why there is no result
};

// One page that needs no other file. The figures are read from OUT/NAME.svg, if they exist.
[[nodiscard]] std::string page(std::span<const Finished> topics, const Provenance& from,
                               const std::filesystem::path& out);

}  // namespace punctum::report
