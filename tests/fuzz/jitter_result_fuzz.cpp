// Results of punctum-jitter as anyone may have written them: read, or refused with one line.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "tests/fuzz/must.hpp"
#include "tools/jitter/difference.hpp"
#include "tools/jitter/result.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace punctum::jitter;
  const auto result = result_of_json({reinterpret_cast<const char*>(data), size});
  if (!result) {
    must(!result.error().empty() && result.error().find('\n') == std::string::npos,
         "a refusal of no line or of several");
    return 0;
  }
  for (const double part : {0.0, 0.5, 0.999, 1.0}) {
    const double q = result->wake.quantile_us(part);
    must(q >= 0 && q <= result->wake.max_us, "a quantile beyond the largest value");
  }
  must(!summary(*result, 80).empty(), "no summary");
  must(!histogram_text(result->wake).empty(), "no histogram");
  const auto again = result_of_json(json_of(*result));
  must(again.has_value(), "what was written does not read back");
  must(again->wake.quantile_us(0.5) == result->wake.quantile_us(0.5), "another median is read back");
  if (result->parts.size() < 20) {
    const auto found = difference(*result, *again);
    must(!found || !found->any(), "a result differs from itself");
  }
  return 0;
}
