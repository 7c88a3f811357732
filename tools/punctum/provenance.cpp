#include "tools/punctum/provenance.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/shared/machine.hpp"
#include "tools/shared/version.hpp"

namespace punctum::tools {
namespace {

// As the kernel keeps it: words with a zero byte after each.
std::string command_line() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::string words{std::istreambuf_iterator<char>(in), {}};
  while (!words.empty() && words.back() == '\0') {
    words.pop_back();
  }
  for (char& c : words) {
    c = c == '\0' ? ' ' : c;
  }
  return words;
}

}  // namespace

nlohmann::ordered_json provenance(const Scene& scene) {
  const MachineDescription machine = this_machine();
  const std::time_t now = std::time(nullptr);
  return {{"begun_at", fmt::format("{:%Y-%m-%dT%H:%M:%S%z}", fmt::localtime(now))},
          {"program", version_line("punctum")},
          {"command_line", command_line()},
          {"scene", scene.name},
          {"title", scene.title},
          {"scene_source", scene.source},
          {"machine",
           {{"name", machine.host},
            {"processor", machine.processor},
            {"cores", machine.cores},
            {"architecture", machine.architecture},
            {"kernel", machine.kernel},
            {"real_time_kernel", machine.real_time_kernel}}}};
}

}  // namespace punctum::tools
