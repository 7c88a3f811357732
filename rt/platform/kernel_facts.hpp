// What the running kernel offers to real-time work. Reads /sys, /proc and /boot; set-up only.
#pragma once

#include <string>
#include <vector>

namespace punctum::rt {

struct KernelFacts {
  std::string release;  // uname -r
  std::string version;  // uname -v
  int major = 0;
  int minor = 0;
  bool preempt_rt = false;
  std::string preempt_rt_seen;  // where it was found, or where it was looked for
  std::vector<int> online_cpus;
  std::vector<int> isolated_cpus;  // by isolcpus= or a cpuset
  bool smt_active = false;
  long rt_runtime_us = 0;  // sched_rt_runtime_us; -1 = no throttling; 0 = unknown

  [[nodiscard]] bool at_least(int want_major, int want_minor) const {
    return major > want_major || (major == want_major && minor >= want_minor);
  }
};

// root stands before every path: "" for this machine. Empty release and version: asked of the kernel.
[[nodiscard]] KernelFacts read_kernel_facts(const std::string& root = "", std::string release = "",
                                            std::string version = "");

// Frequency governor of a CPU, empty where there is none (fixed frequency, virtual machine).
[[nodiscard]] std::string governor_of(int cpu, const std::string& root = "");

// Of the fair server of a CPU (6.12 and later), in ns; -1 = cannot be read.
[[nodiscard]] long fair_server_runtime_ns(int cpu, const std::string& root = "");

// "0-2,5" -> 0 1 2 5, and back.
[[nodiscard]] std::vector<int> parse_cpu_list(const std::string& text);
[[nodiscard]] std::string cpu_list(const std::vector<int>& cpus);

// The CPUs that are left for everything else where a loop has this one: not the isolated ones either, which
// are kept free for something, too, unless no other is left.
[[nodiscard]] std::vector<int> cpus_beside(int cpu, const KernelFacts& facts);

}  // namespace punctum::rt
