#include "tools/shared/version.hpp"

#include <fmt/format.h>

namespace punctum::tools {

std::string version_line(std::string_view program) {
  return fmt::format("{} {} ({})", program, PUNCTUM_VERSION, built_commit());
}

}  // namespace punctum::tools
