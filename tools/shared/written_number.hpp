// Numbers as people write them.
#pragma once

namespace punctum::tools {

// Without the last digits, which only tell of conversions between units: 0.03, not 0.030000000000000002.
// Twelve significant digits remain; no measurement has more.
[[nodiscard]] double as_written(double v);

}  // namespace punctum::tools
