#include "tools/shared/machine.hpp"

#include <sys/utsname.h>

#include <fstream>
#include <thread>

namespace punctum::tools {
namespace {

std::string processor() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (const auto colon = line.find(": "); line.starts_with("model name") && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  return "unknown processor";
}

// The kernel says so in a file of its own; older ones in their version only.
bool real_time(const utsname& system) {
  std::ifstream in("/sys/kernel/realtime");
  char said = '0';
  return (in >> said && said == '1') || std::string(system.version).find("PREEMPT_RT") != std::string::npos;
}

}  // namespace

MachineDescription this_machine() {
  utsname system{};
  uname(&system);
  return {.host = system.nodename,
          .processor = processor(),
          .architecture = system.machine,
          .kernel = std::string(system.release) + " " + system.version,
          .cores = std::thread::hardware_concurrency(),
          .real_time_kernel = real_time(system)};
}

}  // namespace punctum::tools
