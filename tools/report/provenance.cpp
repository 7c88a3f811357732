#include <fmt/format.h>

#include <algorithm>

#include "tools/report/output.hpp"
#include "tools/shared/machine.hpp"
#include "tools/shared/version.hpp"

namespace punctum::report {

namespace {

// So that the cells need no quotes.
std::string without_commas(std::string s) {
  std::replace(s.begin(), s.end(), ',', ';');
  return s;
}

}  // namespace

Provenance provenance() {
  const tools::MachineDescription machine = tools::this_machine();
#if defined(__clang__)
  const std::string compiler =
      fmt::format("clang {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#else
  const std::string compiler = fmt::format("g++ {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#endif
  return {.machine = without_commas(fmt::format("{}; {} cores; {}; {} {}", machine.processor, machine.cores,
                                                machine.architecture, "Linux", machine.kernel)),
          .compiler = compiler,
          .flags = without_commas(PUNCTUM_BUILD_FLAGS),
          .commit = tools::built_commit()};
}

}  // namespace punctum::report
