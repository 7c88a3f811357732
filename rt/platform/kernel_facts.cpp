#include "rt/platform/kernel_facts.hpp"

#include <sys/utsname.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace punctum::rt {
namespace {

std::string first_line(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

bool has_line(const std::string& path, const std::string& wanted) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    if (line == wanted) return true;
  }
  return false;
}

}  // namespace

std::vector<int> parse_cpu_list(const std::string& text) {
  std::vector<int> cpus;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) {
    int first = 0;
    int last = 0;
    const int n = std::sscanf(part.c_str(), "%d-%d", &first, &last);
    if (n < 1) continue;
    if (n < 2) last = first;
    for (int cpu = first; cpu <= last && cpu - first < 4096; ++cpu) cpus.push_back(cpu);
  }
  return cpus;
}

// /sys/kernel/realtime exists only with the out-of-tree patches, so absence says nothing: mainline
// (6.12 and later) shows PREEMPT_RT in its version string and its configuration alone.
KernelFacts read_kernel_facts(const std::string& root, std::string release, std::string version) {
  KernelFacts facts;
  utsname name = {};
  ::uname(&name);
  facts.release = release.empty() ? std::string(name.release) : std::move(release);
  facts.version = version.empty() ? std::string(name.version) : std::move(version);
  std::sscanf(facts.release.c_str(), "%d.%d", &facts.major, &facts.minor);

  const std::vector<std::string> configurations{root + "/boot/config-" + facts.release,
                                                root + "/lib/modules/" + facts.release + "/config"};
  if (first_line(root + "/sys/kernel/realtime") == "1") {
    facts.preempt_rt_seen = "/sys/kernel/realtime";
  } else if (facts.version.find("PREEMPT_RT") != std::string::npos ||
             facts.version.find("PREEMPT RT") != std::string::npos) {
    facts.preempt_rt_seen = "the version string";
  } else {
    for (const std::string& path : configurations) {
      if (has_line(path, "CONFIG_PREEMPT_RT=y") || has_line(path, "CONFIG_PREEMPT_RT_FULL=y")) {
        facts.preempt_rt_seen = path.substr(root.size());
        break;
      }
    }
  }
  facts.preempt_rt = !facts.preempt_rt_seen.empty();
  if (!facts.preempt_rt) {
    facts.preempt_rt_seen = "not in /sys/kernel/realtime, the version string or the configuration";
  }

  facts.online_cpus = parse_cpu_list(first_line(root + "/sys/devices/system/cpu/online"));
  facts.isolated_cpus = parse_cpu_list(first_line(root + "/sys/devices/system/cpu/isolated"));
  facts.smt_active = first_line(root + "/sys/devices/system/cpu/smt/active") == "1";
  facts.rt_runtime_us = std::atol(first_line(root + "/proc/sys/kernel/sched_rt_runtime_us").c_str());
  return facts;
}

std::string governor_of(int cpu, const std::string& root) {
  return first_line(root + "/sys/devices/system/cpu/cpu" + std::to_string(cpu) + "/cpufreq/scaling_governor");
}

long fair_server_runtime_ns(int cpu, const std::string& root) {
  const std::string text =
      first_line(root + "/sys/kernel/debug/sched/fair_server/cpu" + std::to_string(cpu) + "/runtime");
  return text.empty() ? -1 : std::atol(text.c_str());
}

}  // namespace punctum::rt
