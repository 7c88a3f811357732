// Results of punctum-jitter as anyone may have written them: read, or refused with one line.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "tools/jitter/difference.hpp"
#include "tools/jitter/result.hpp"

namespace {

void must(bool holds) {
  if (!holds) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace punctum::jitter;
  const auto result = result_of_json({reinterpret_cast<const char*>(data), size});
  if (!result) {
    must(!result.error().empty() && result.error().find('\n') == std::string::npos);
    return 0;
  }
  for (const double part : {0.0, 0.5, 0.999, 1.0}) {
    const double q = result->wake.quantile_us(part);
    must(q >= 0 && q <= result->wake.max_us);
  }
  must(!summary(*result, 80).empty());
  must(!histogram_text(result->wake).empty());
  const auto again = result_of_json(json_of(*result));
  must(again.has_value());
  must(again->wake.quantile_us(0.5) == result->wake.quantile_us(0.5));
  if (result->parts.size() < 20) {
    const auto found = difference(*result, *again);
    must(!found || !found->front().differs);
  }
  return 0;
}
