#include "rt/platform/kernel_facts.hpp"

#include <sys/utsname.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>

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
    if (line == wanted) {
      return true;
    }
  }
  return false;
}

// Takes the number that `text` begins with off it; nothing if it begins otherwise.
template <class Number>
std::optional<Number> take_number(std::string_view& text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{}) {
    return std::nullopt;
  }
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

}  // namespace

std::vector<int> parse_cpu_list(const std::string& text) {
  std::vector<int> cpus;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) {
    std::string_view rest = part;
    const std::optional<int> first = take_number<int>(rest);
    if (!first) {
      continue;
    }
    int last = *first;
    if (rest.starts_with('-')) {
      rest.remove_prefix(1);
      last = take_number<int>(rest).value_or(*first);
    }
    for (int cpu = *first; cpu <= last && cpu - *first < 4096; ++cpu) {
      cpus.push_back(cpu);
    }
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
  std::string_view rest = facts.release;
  facts.major = take_number<int>(rest).value_or(0);
  if (rest.starts_with('.')) {
    rest.remove_prefix(1);
    facts.minor = take_number<int>(rest).value_or(0);
  }

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
  const std::string runtime = first_line(root + "/proc/sys/kernel/sched_rt_runtime_us");
  rest = runtime;
  facts.rt_runtime_us = take_number<long>(rest).value_or(0);
  return facts;
}

std::string governor_of(int cpu, const std::string& root) {
  return first_line(root + "/sys/devices/system/cpu/cpu" + std::to_string(cpu) + "/cpufreq/scaling_governor");
}

long fair_server_runtime_ns(int cpu, const std::string& root) {
  const std::string text =
      first_line(root + "/sys/kernel/debug/sched/fair_server/cpu" + std::to_string(cpu) + "/runtime");
  std::string_view rest = text;
  return take_number<long>(rest).value_or(-1);
}

std::string cpu_list(const std::vector<int>& cpus) {
  std::string out;
  for (std::size_t i = 0; i < cpus.size();) {
    std::size_t end = i;
    while (end + 1 < cpus.size() && cpus[end + 1] == cpus[end] + 1) {
      ++end;
    }
    out += out.empty() ? "" : ",";
    out += std::to_string(cpus[i]);
    if (end > i) {
      out += '-';
      out += std::to_string(cpus[end]);
    }
    i = end + 1;
  }
  return out;
}

std::vector<int> cpus_beside(int cpu, const KernelFacts& facts) {
  std::vector<int> others = facts.online_cpus;
  std::erase(others, cpu);
  std::vector<int> shared = others;
  std::erase_if(shared, [&](int one) {
    return std::count(facts.isolated_cpus.begin(), facts.isolated_cpus.end(), one) > 0;
  });
  return shared.empty() ? others : shared;
}

}  // namespace punctum::rt
