// The report that a lab keeps: report.json, figure.svg and report.html, from a run that has just ended or
// from what a folder holds.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace punctum::tools {

// What was run and where (begun.json), and what came of it.
[[nodiscard]] nlohmann::ordered_json whole_facts(const nlohmann::ordered_json& begun,
                                                 nlohmann::ordered_json facts);

// Each file is there whole or not at all; the errors are one line.
[[nodiscard]] tl::expected<void, std::string> write_begun(const std::string& folder,
                                                          const nlohmann::ordered_json& begun);
[[nodiscard]] tl::expected<void, std::string> write_report_json(const std::string& folder,
                                                                const nlohmann::ordered_json& facts);
// report.html and, unless it is not wanted, figure.svg.
[[nodiscard]] tl::expected<void, std::string> write_report_page(const std::string& folder,
                                                                const nlohmann::ordered_json& facts,
                                                                bool figure);

// `punctum report FOLDER...`: each folder's report.html again, with report.json where there is none; of
// several folders also a comparison, at `out` (empty: reports/comparison-DATE.html). Returns an ExitCode.
[[nodiscard]] int report_folders(const std::vector<std::string>& folders, const std::string& out);

}  // namespace punctum::tools
