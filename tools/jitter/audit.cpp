#include "tools/jitter/audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "rt/platform/real_time_rights.hpp"

namespace punctum::jitter {
namespace {

std::string line_of(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

Finding clock_source(const std::string& root) {
  const std::string source =
      line_of(root + "/sys/devices/system/clocksource/clocksource0/current_clocksource");
  Finding f{"clock source", source.empty() ? "cannot be read" : source, "", false};
  // Read in user space, without a system call; kvm-clock and the like are virtual machines' own of that kind.
  if (source != "tsc" && source != "kvm-clock" && source != "arch_sys_counter" &&
      source != "hyperv_clocksource_tsc_page") {
    f.remedy = "boot with clocksource=tsc tsc=reliable, if the processor's counter is invariant";
  }
  return f;
}

Finding swap_areas(const std::string& root) {
  std::ifstream in(root + "/proc/swaps");
  std::string line;
  int areas = -1;  // the first line is the head
  while (std::getline(in, line)) {
    ++areas;
  }
  Finding f{"no swap", areas > 0 ? fmt::format("{} area{}", areas, areas == 1 ? "" : "s") : "none", "",
            false};
  if (areas > 0) {
    f.remedy = "swapoff -a, and no swap line in /etc/fstab";
  }
  return f;
}

// Interrupts that may be served on the loop's CPU.
Finding interrupts(int cpu, const std::string& root) {
  const std::string allowed = line_of(root + "/proc/irq/default_smp_affinity");
  Finding f{"interrupts elsewhere", "default mask " + (allowed.empty() ? "cannot be read" : allowed), "",
            false};
  if (cpu < 0) {
    f.found = "no CPU is named";
    f.remedy = "name the loop's own CPU: --cpu N";
    return f;
  }
  // Groups of eight hexadecimal digits, the last one the lowest CPUs.
  std::string digits = allowed;
  digits.erase(std::remove(digits.begin(), digits.end(), ','), digits.end());
  const auto place = static_cast<std::size_t>(cpu / 4);
  bool served = true;
  if (!digits.empty()) {
    const char digit = place < digits.size() ? digits[digits.size() - 1 - place] : '0';
    const int value = digit >= 'a' ? digit - 'a' + 10 : digit >= 'A' ? digit - 'A' + 10 : digit - '0';
    served = (value >> (cpu % 4) & 1) != 0;
  }
  if (served) {
    f.remedy = fmt::format("boot with irqaffinity= without CPU {}", cpu);
  }
  return f;
}

}  // namespace

std::vector<Finding> audit(int cpu, int priority, const std::string& root) {
  rt::RightsWanted wanted;
  wanted.cpu = cpu;
  wanted.priority = priority;
  const auto rights = rt::RealTimeRights::examine(wanted);
  std::vector<Finding> out;
  for (const rt::RightFound& right : rights.table()) {
    out.push_back({right.name, right.detail, right.got ? "" : right.remedy, right.required});
    if (!right.got && right.remedy.empty()) {
      out.back().remedy = "-";
    }
  }
  out.push_back(clock_source(root));
  out.push_back(swap_areas(root));
  out.push_back(interrupts(cpu, root));
  return out;
}

std::string audit_text(const std::vector<Finding>& findings) {
  std::string out;
  int missing = 0, advised = 0;
  for (const Finding& f : findings) {
    const bool ready = f.remedy.empty();
    missing += !ready && f.required ? 1 : 0;
    advised += !ready && !f.required ? 1 : 0;
    out += fmt::format("{:<8}{:<24}{}\n",
                       ready        ? "ready"
                       : f.required ? "MISSING"
                                    : "advice",
                       f.name, f.found);
    if (!ready) {
      out += fmt::format("{:<8}{:<24}-> {}\n", "", "", f.remedy);
    }
  }
  return out + fmt::format("{} missing, {} advised\n", missing, advised);
}

}  // namespace punctum::jitter
