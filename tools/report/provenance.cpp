#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <fstream>
#include <thread>

#include "tools/report/output.hpp"
#include "tools/shared/version.hpp"

namespace punctum::report {

namespace {

std::string cpu_model() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (const auto colon = line.find(": "); line.starts_with("model name") && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  return "unknown processor";
}

// So that the cells need no quotes.
std::string without_commas(std::string s) {
  std::replace(s.begin(), s.end(), ',', ';');
  return s;
}

}  // namespace

Provenance provenance() {
  utsname system{};
  uname(&system);
#if defined(__clang__)
  const std::string compiler =
      fmt::format("clang {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#else
  const std::string compiler = fmt::format("g++ {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#endif
  return {.machine = without_commas(fmt::format("{}; {} cores; {}; {} {}", cpu_model(),
                                                std::thread::hardware_concurrency(), system.machine,
                                                system.sysname, system.release)),
          .compiler = compiler,
          .flags = without_commas(PUNCTUM_BUILD_FLAGS),
          .commit = tools::built_commit()};
}

}  // namespace punctum::report
