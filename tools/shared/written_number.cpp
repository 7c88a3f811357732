#include "tools/shared/written_number.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

namespace punctum::tools {

double as_written(double v) {
  return std::isfinite(v) ? std::strtod(fmt::format("{:.12g}", v).c_str(), nullptr) : v;
}

}  // namespace punctum::tools
