// Any text is either rows, which then come back with a force each, or one line that says what is wrong.
#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "tests/fuzz/must.hpp"
#include "tools/report/force_pairs.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto out = punctum::report::evaluate_pairs(text);
  if (!out) {
    must(!out.error().empty(), "an error without a word");
    must(out.error().find('\n') == std::string::npos, "an error of more than one line");
    return 0;
  }
  const auto lines = [](std::string_view s) {
    return std::count(s.begin(), s.end(), '\n') + (s.empty() || s.back() == '\n' ? 0 : 1);
  };
  must(lines(*out) == lines(text), "rows were lost or made");
  must(out->find("inf") == std::string::npos || text.find("inf") != std::string_view::npos,
       "an infinite force");
  must(!punctum::report::evaluate_pairs(*out), "a second force was appended");
  return 0;
}
