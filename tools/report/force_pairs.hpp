// punctum-report force --input: the force of eq. 5 for measured dimples.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace punctum::report {

// CSV with a header that has the columns a_m,wd_m,c_m,h_m,E_Pa,nu in any order, among
// others. Every line is returned unchanged with force_N appended, in 17 significant digits. The error is one
// line: "line N: column: what is wrong, allowed: ...".
[[nodiscard]] tl::expected<std::string, std::string> evaluate_pairs(std::string_view csv);

// The same for files. Exit code 0; or 2 with one line on stderr, and no output file.
[[nodiscard]] int evaluate_pairs_file(const std::string& input, const std::string& output);

}  // namespace punctum::report
