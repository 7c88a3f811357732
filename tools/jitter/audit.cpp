#include "tools/jitter/audit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/ethtool.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <utility>

#include "rt/platform/kernel_facts.hpp"
#include "tools/jitter/interrupts.hpp"
#include "tools/shared/whole_file.hpp"

namespace punctum::jitter {
namespace {

// Where a plan is installed, below the root of the machine.
constexpr const char *kPlannedBootLine = "/etc/default/grub.d/punctum.cfg",
                     *kPlannedCommands = "/etc/punctum/machine",
                     *kPlannedRules = "/etc/udev/rules.d/61-punctum-machine.rules",
                     *kPlannedLimits = "/etc/security/limits.d/punctum.conf";
constexpr const char* kOrFailed = " || failed=1";

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
  if (source == "tsc" || source == "kvm-clock" || source == "arch_sys_counter" ||
      source == "hyperv_clocksource_tsc_page") {
    return f;
  }
  std::istringstream offered(
      line_of(root + "/sys/devices/system/clocksource/clocksource0/available_clocksource"));
  const std::vector<std::string> sources{std::istream_iterator<std::string>(offered), {}};
  if (std::find(sources.begin(), sources.end(), "tsc") != sources.end()) {
    f.remedy = "boot with clocksource=tsc";
    f.mend.boot = "clocksource=tsc";
  } else {  // to trust what the kernel has found to go wrong is no file's decision
    f.remedy =
        "the kernel offers no tsc: dmesg says why (grep -i tsc); tsc=reliable only where its "
        "maker says that the processor's counter is invariant";
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
    f.mend.command = "swapoff -a";
  }
  return f;
}

// The kernel takes it out of nohz_full and always puts it into the default mask of interrupts.
constexpr const char* kOtherThanBootCpu =
    "CPU 0 is the one that the kernel boots on, keeps time with and sends interrupts to: take another one";

// The words of the boot line that isolate CPUs, and those CPUs.
struct Isolating {
  std::vector<std::string> words;
  std::set<int> cpus;
};
Isolating isolating(const std::string& boot_line) {
  Isolating out;
  std::istringstream words(boot_line);
  for (std::string word; words >> word;) {
    if (word.starts_with("isolcpus=") || word.starts_with("nohz_full=")) {
      // "managed_irq,domain,3": flags before the CPUs.
      const std::size_t flags =
          word.find_last_of("abcdefghijklmnopqrstuvwxyz=,", word.find_first_of("0123456789"));
      const std::vector<int> cpus =
          rt::parse_cpu_list(word.substr(flags == std::string::npos ? 0 : flags + 1));
      out.cpus.insert(cpus.begin(), cpus.end());
      out.words.push_back(word);
    }
  }
  return out;
}

// What isolates the loop's CPU beside those that the boot line isolates already: the kernel ignores one of
// isolcpus= and nohz_full= that names others than the other one. Words that did not come from a plan stay
// where they are, and so are a person's to change.
void isolate(Finding& f, int cpu, const std::string& others, const std::string& root) {
  if (others.empty()) {
    f.remedy = "a machine with a second CPU";
  } else if (cpu == 0) {
    f.remedy = kOtherThanBootCpu;
  } else {
    Isolating now = isolating(line_of(root + "/proc/cmdline"));
    now.cpus.insert(cpu);
    const std::string words =
        fmt::format("isolcpus=managed_irq,domain,{0} nohz_full={0} rcu_nocbs={0} irqaffinity={1}",
                    rt::cpu_list({now.cpus.begin(), now.cpus.end()}), others);
    std::ifstream planned(root + kPlannedBootLine);
    const std::string ours(std::istreambuf_iterator<char>(planned), {});
    if (std::all_of(now.words.begin(), now.words.end(), [&](const std::string& word) {
          return ours.find(" " + word + " ") != std::string::npos ||
                 ours.find(" " + word + "\"") != std::string::npos;
        })) {
      f.mend.boot = words;
      f.remedy = "boot with " + words;
    } else {
      f.remedy = fmt::format("in the boot line, {} in place of {}", words, fmt::join(now.words, " "));
    }
  }
}

// A CPU that is only isolated still takes the tick of the timer and the callbacks of RCU.
Finding timer_tick(int cpu, const std::string& others, const std::string& root) {
  Finding f{"no timer tick", "this kernel cannot switch it off"};
  std::ifstream in(root + "/sys/devices/system/cpu/nohz_full");
  std::string cpus;
  if (!std::getline(in, cpus)) {
    return f;
  }
  const std::vector<int> off = rt::parse_cpu_list(cpus.find("null") == std::string::npos ? cpus : "");
  f.found = off.empty() ? "on everywhere" : "off on CPU " + cpus;
  if (cpu < 0) {
    f.remedy = "name the loop's own CPU: --cpu N";
  } else if (std::find(off.begin(), off.end(), cpu) == off.end()) {
    isolate(f, cpu, others, root);
  }
  return f;
}

// Those that a CPU serves now: "24 (eth0-rx)".
std::vector<std::string> interrupts_on(int cpu, const std::string& root) {
  std::vector<std::pair<int, std::string>> found;
  std::error_code none;
  for (const auto& irq : std::filesystem::directory_iterator(root + "/proc/irq", none)) {
    const std::string number = irq.path().filename().string();
    if (number.find_first_not_of("0123456789") != std::string::npos) {
      continue;
    }
    const std::vector<int> served = rt::parse_cpu_list(line_of(irq.path() / "effective_affinity_list"));
    if (std::find(served.begin(), served.end(), cpu) == served.end()) {
      continue;
    }
    for (const auto& handler : std::filesystem::directory_iterator(irq.path(), none)) {
      if (handler.is_directory(none)) {
        found.emplace_back(std::stoi(number),
                           fmt::format("{} ({})", number, handler.path().filename().string()));
      }
    }
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> out;
  for (auto& [number, text] : found) {
    out.push_back(std::move(text));
  }
  return out;
}

// Interrupts that may be served on the loop's CPU.
Finding interrupts(int cpu, const std::string& others, const std::string& root) {
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
  if (served && others.empty()) {
    f.found += "; there is no other CPU";
  } else if (served && cpu == 0) {
    f.remedy = kOtherThanBootCpu;
  } else if (served) {
    f.remedy = fmt::format("boot with irqaffinity={}", others);
    f.mend.boot = "irqaffinity=" + others;
  } else if (const std::vector<std::string> here = interrupts_on(cpu, root); !here.empty()) {
    f.found += fmt::format("; yet CPU {} serves {}", cpu, fmt::join(here, ", "));
    f.remedy = fmt::format(
        "echo {} > /proc/irq/NUMBER/smp_affinity_list; one that the kernel refuses to move is "
        "kept away by isolcpus=managed_irq,{}",
        others, cpu);
  }
  return f;
}

// nosmt leaves the first thread of each core: the loop's CPU has to be one of those. That one; -1: it is.
int instead_of_sibling(int cpu, const rt::KernelFacts& facts, const std::string& root) {
  const std::vector<int> core = rt::parse_cpu_list(
      line_of(fmt::format("{}/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list", root, cpu)));
  return facts.smt_active && !core.empty() && core.front() != cpu ? core.front() : -1;
}

Finding balancer(const std::string& root) {
  Finding f{"no irqbalance", "it does not run"};
  if (runs("irqbalance", root)) {
    f.found = "it moves interrupts from CPU to CPU";
    f.remedy = f.mend.command = "systemctl disable --now irqbalance";
  }
  return f;
}

// The interface of the default route.
std::string network_in_use(const std::string& root) {
  std::ifstream in(root + "/proc/net/route");
  std::string line;
  std::getline(in, line);  // the head
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string interface, destination;
    if (words >> interface >> destination && destination == "00000000") {
      return interface;
    }
  }
  return "";
}

std::optional<Coalescing> ask_coalescing(const std::string& interface) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ethtool_coalesce wanted{};
  wanted.cmd = ETHTOOL_GCOALESCE;
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  request.ifr_data = reinterpret_cast<char*>(&wanted);
  const bool told = fd >= 0 && ioctl(fd, SIOCETHTOOL, &request) == 0;
  if (fd >= 0) {
    (void)close(fd);
  }
  return told ? std::optional(Coalescing{wanted.rx_coalesce_usecs, wanted.use_adaptive_rx_coalesce != 0})
              : std::nullopt;
}

Finding coalescing(const Machine& machine) {
  Finding f{"no NIC coalescing", "no network is in use"};
  const std::string interface = network_in_use(machine.root);
  if (interface.empty()) {
    return f;
  }
  const auto told = machine.coalescing ? machine.coalescing(interface) : ask_coalescing(interface);
  f.found =
      !told ? fmt::format("{}: its driver has none that could be set", interface)
            : fmt::format("{}: rx-usecs {}{}", interface, told->rx_us, told->adaptive ? ", adaptive" : "");
  if (told && (told->rx_us > 0 || told->adaptive)) {
    f.remedy = f.mend.command =
        fmt::format("ethtool -C {} {}rx-usecs 0", interface, told->adaptive ? "adaptive-rx off " : "");
    f.found += " (Debian: apt-get install ethtool)";
  }
  return f;
}

// Its number may be another one after a restart, so that what mends it goes by the name.
Finding interrupt_of(const UsedDevice& device, const Interrupt& irq, int cpu, int priority,
                     const std::string& others) {
  Finding f{fmt::format("irq {} {}", irq.number, fmt::join(irq.names, " ")),
            fmt::format("{}; served by CPU {}", device.title, irq.cpus.empty() ? "unknown" : irq.cpus)};
  std::vector<std::string> now, always;
  const std::vector<int> served = rt::parse_cpu_list(irq.cpus);
  if (!others.empty() && std::find(served.begin(), served.end(), cpu) != served.end()) {
    now.push_back(fmt::format("echo {} > /proc/irq/{}/smp_affinity_list", others, irq.number));
    always.push_back(
        fmt::format("for i in /proc/irq/*/'{}'; do echo {} > \"${{i%/*}}\"/smp_affinity_list; done",
                    irq.names.front(), others));
  }
  if (irq.thread.empty()) {
    f.found += "; no thread of its own";
  } else {
    f.found +=
        fmt::format("; thread {}", irq.thread_priority > 0 ? fmt::format("SCHED_FIFO {}", irq.thread_priority)
                                                           : std::string("of ordinary priority"));
    if (irq.thread_priority <= priority) {
      const int above = std::min(priority + 5, 98);
      const auto set = [above](const std::string& number, const char* then) {
        return fmt::format(
            "for t in $(grep -l \"^irq/{}-\" /proc/[0-9]*/comm | cut -d/ -f3); do chrt -f -p {} $t{}; done",
            number, above, then);
      };
      now.push_back(set(std::to_string(irq.number), ""));
      // The kernel cuts a thread's name at 15 characters, and so more of it the longer the number is: the
      // number is found by the name of the interrupt, which is whole. Where none is found, it has failed.
      always.push_back(fmt::format("ok=false; for i in /proc/irq/*/'{}'; do n=${{i%/*}}; {}; done; $ok",
                                   irq.names.front(), set("${n##*/}", " && ok=true")));
    }
  }
  f.remedy = fmt::format("{}", fmt::join(now, "; "));
  f.mend.command = fmt::format("{}", fmt::join(always, "\n"));
  return f;
}

std::vector<Finding> devices(const tools::Scene& scene, int cpu, int priority, const std::string& others,
                             const std::string& root) {
  std::vector<Finding> out;
  for (const UsedDevice& device : used_devices(scene, root)) {
    if (!device.absent.empty()) {
      out.push_back({device.title,
                     device.absent,
                     "punctum check " + (scene.source == "built-in" ? scene.name : scene.source),
                     false,
                     {}});
    } else if (device.interrupts.empty() && device.idle) {
      out.push_back({device.title,
                     "nobody handles its interrupt yet",
                     "audit again while it is in use (a CAN interface: systemctl start punctum-bus@can0)",
                     false,
                     {}});
    } else if (device.interrupts.empty()) {
      out.push_back({device.title, "no interrupt of its own", "", false, {}});
    }
    for (const Interrupt& irq : device.interrupts) {
      // One controller may serve several devices.
      Finding f = interrupt_of(device, irq, cpu, priority, others);
      const auto same =
          std::find_if(out.begin(), out.end(), [&](const Finding& o) { return o.name == f.name; });
      if (same == out.end()) {
        out.push_back(std::move(f));
      } else {
        same->found = device.title + "; " + same->found;
      }
    }
  }
  if (out.empty()) {
    out.push_back(
        {"devices", fmt::format("those of {} have no interrupts: none is real", scene.name), "", false, {}});
  }
  return out;
}

}  // namespace

Finding finding_of(const rt::RightFound& right, int cpu, const std::string& others, const std::string& root) {
  Finding f{right.name,
            right.detail,
            right.got              ? ""
            : right.remedy.empty() ? "-"
                                   : right.remedy,
            right.required,
            {}};
  if (right.got) {
    return f;
  }
  if (right.name == "SCHED_FIFO priority") {
    const std::size_t limit = right.remedy.find("@punctum - rtprio ");
    f.mend.limits = limit == std::string::npos ? "@punctum - rtprio 95" : right.remedy.substr(limit, 20);
  } else if (right.name == "locked memory") {
    f.mend.limits = "@punctum - memlock unlimited";
  } else if (right.name == "isolated CPU" && cpu >= 0) {
    isolate(f, cpu, others, root);
  } else if (right.name == "CPU sleep held off") {
    f.mend.udev = R"(KERNEL=="cpu_dma_latency", SUBSYSTEM=="misc", GROUP="punctum", MODE="0660")";
  } else if (right.name == "performance governor") {
    f.mend.boot = "cpufreq.default_governor=performance";
  } else if (right.name == "no SMT siblings") {
    f.mend.boot = "nosmt";
  } else if (right.name == "no RT throttling" && cpu >= 0) {
    // The remedy ends with its command.
    f.mend.command = right.remedy.substr(right.remedy.rfind(": ") + 2);
  }
  return f;
}

std::vector<Finding> audit(int cpu, int priority, const tools::Scene* scene, const Machine& machine) {
  const std::string& root = machine.root;
  const rt::KernelFacts facts = rt::read_kernel_facts(root);
  rt::RightsWanted wanted;
  wanted.cpu = cpu;
  wanted.priority = priority;
  const auto rights = rt::RealTimeRights::examine(wanted);
  // Nothing is planned for a CPU that is not there.
  const int asked = cpu;
  const bool absent = cpu >= 0 && !facts.online_cpus.empty() &&
                      std::count(facts.online_cpus.begin(), facts.online_cpus.end(), cpu) == 0;
  cpu = absent ? -1 : cpu;
  const int first = instead_of_sibling(cpu, facts, root);
  std::vector<int> other_cpus = rt::cpus_beside(cpu, facts);
  if (facts.smt_active && first < 0) {  // nosmt, which is planned then, takes the second threads away
    std::erase_if(other_cpus, [&](int one) { return instead_of_sibling(one, facts, root) >= 0; });
  }
  const std::string others = asked >= 0 ? rt::cpu_list(other_cpus) : "";
  std::vector<Finding> out;
  if (facts.online_cpus.empty()) {
    out.push_back(
        {.name = "CPUs",
         .found = "/sys/devices/system/cpu/online cannot be read: what is said of CPUs below is a guess",
         .remedy = "audit outside of this container, where /sys is mounted"});
  }
  for (const rt::RightFound& right : rights.table()) {
    Finding& f = out.emplace_back(finding_of(right, cpu, others, root));
    if (absent && right.name == "CPU affinity") {
      f = {.name = right.name,
           .found = fmt::format("CPU {} is not online", asked),
           .remedy = "name one of " + rt::cpu_list(facts.online_cpus),
           .required = true};
    }
  }
  if (first >= 0) {
    for (Finding& f : out) {
      f.mend.boot = f.name == "no SMT siblings" ? "" : f.mend.boot;  // it would take the loop's CPU away
    }
    out.push_back(
        {.name = "first thread of a core",
         .found = fmt::format("CPU {} is the second one of CPU {}: nosmt switches it off", cpu, first),
         .remedy = fmt::format("audit and run with --cpu {}", first)});
  }
  out.push_back(timer_tick(cpu, others, root));
  out.push_back(clock_source(root));
  out.push_back(swap_areas(root));
  out.push_back(interrupts(asked, others, root));
  if (absent) {
    out.back().mend = {};
  }
  out.push_back(balancer(root));
  out.push_back(coalescing(machine));
  if (scene != nullptr) {
    const std::vector<Finding> of_devices = devices(*scene, cpu, priority, others, root);
    out.insert(out.end(), of_devices.begin(), of_devices.end());
  }
  return out;
}

std::string audit_text(const std::vector<Finding>& findings) {
  std::string out;
  int missing = 0, advised = 0;
  for (const Finding& f : findings) {
    const bool ready = f.remedy.empty();
    missing += !ready && f.required ? 1 : 0;
    advised += !ready && !f.required ? 1 : 0;
    out += fmt::format("{:<8}{:<23} {}\n",
                       ready        ? "ready"
                       : f.required ? "MISSING"
                                    : "advice",
                       f.name, f.found);
    if (!ready) {
      out += fmt::format("{:<8}{:<23} -> {}\n", "", "", f.remedy);
    }
  }
  return out + fmt::format("{} missing, {} advised\n", missing, advised);
}

std::map<std::string, std::string> plan(const std::vector<Finding>& findings, const std::string& root) {
  std::vector<std::string> boot, commands, udev, limits, by_hand;
  const auto add = [](std::vector<std::string>& to, const std::string& what) {
    if (!what.empty() && std::find(to.begin(), to.end(), what) == to.end()) {
      to.push_back(what);
    }
  };
  for (const Finding& f : findings) {
    std::istringstream words(f.mend.boot);
    for (std::string word; words >> word;) {
      add(boot, word);
    }
    std::istringstream lines(f.mend.command);
    for (std::string line; std::getline(lines, line);) {
      add(commands, line);
    }
    add(udev, f.mend.udev);
    add(limits, f.mend.limits);
    if (!f.remedy.empty() && f.mend.boot.empty() && f.mend.command.empty() && f.mend.udev.empty() &&
        f.mend.limits.empty()) {
      by_hand.push_back(f.name + ": " + f.remedy);
    }
  }
  // What an earlier plan has mended is ready by now, and is so no longer where its file is replaced.
  const auto installed = [&](const std::string& path) {
    std::ifstream in(root + path);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) {
      if (!line.empty() && !line.starts_with('#')) {
        lines.push_back(line);
      }
    }
    return lines;
  };
  for (const std::string& line : installed(kPlannedBootLine)) {
    const std::string before = "GRUB_CMDLINE_LINUX=\"$GRUB_CMDLINE_LINUX ";
    std::istringstream words(
        line.starts_with(before) ? line.substr(before.size(), line.rfind('"') - before.size()) : "");
    for (std::string word; words >> word;) {
      const std::string key = word.substr(0, word.find('='));
      if (std::none_of(boot.begin(), boot.end(),
                       [&](const std::string& one) { return one.substr(0, one.find('=')) == key; })) {
        boot.push_back(word);
      }
    }
  }
  for (const std::string& line : installed(kPlannedCommands)) {
    if (const std::size_t end = line.rfind(kOrFailed); end != std::string::npos) {
      add(commands, line.substr(0, end));
    }
  }
  for (const std::string& line : installed(kPlannedRules)) {
    add(udev, line);
  }
  for (const std::string& line : installed(kPlannedLimits)) {
    add(limits, line);
  }
  std::map<std::string, std::string> files;
  std::string readme = "What the audit of this machine found missing, as files. As root:\n\n";
  const auto text = [](const std::vector<std::string>& lines) {
    return fmt::format("{}\n", fmt::join(lines, "\n"));
  };
  constexpr const char* kMade = "# Written by punctum-jitter --audit --plan.\n";
  if (!boot.empty()) {
    const std::string line = fmt::format("{}", fmt::join(boot, " "));
    files["boot-line"] = line + "\n";
    files[kPlannedBootLine + 1] =
        fmt::format("{}GRUB_CMDLINE_LINUX=\"$GRUB_CMDLINE_LINUX {}\"\n", kMade, line);
  }
  if (!udev.empty()) {
    files[kPlannedRules + 1] = kMade + text(udev);
  }
  if (!limits.empty()) {
    files[kPlannedLimits + 1] = kMade + text(limits);
  }
  if (!commands.empty()) {
    // One that fails stops no other, and is not hidden by those after it.
    std::string script = fmt::format("#!/bin/sh\n{}failed=0\n", kMade);
    for (const std::string& command : commands) {
      script += command + kOrFailed + "\n";
    }
    files[kPlannedCommands + 1] = script + "exit $failed\n";
    // Before every run, for a CAN interface has an interrupt, and that a thread, only while it is up; buses
    // are brought up before network.target.
    files["etc/systemd/system/punctum-machine.service"] = fmt::format(
        "{}[Unit]\nDescription=This machine made ready for punctum\nAfter=network.target "
        "punctum-bus@can0.service punctum-bus@can1.service\n\n[Service]\nType=oneshot\n"
        "ExecStart=/bin/sh /etc/punctum/machine\n\n[Install]\nWantedBy=multi-user.target\n",
        kMade);
    for (const char* unit : {"punctum@", "punctum-can@"}) {
      files[fmt::format("etc/systemd/system/{}.service.d/machine.conf", unit)] =
          fmt::format("{}[Unit]\nWants=punctum-machine.service\nAfter=punctum-machine.service\n", kMade);
    }
  }
  readme += files.empty() ? "    (there is nothing to install)\n" : "    cp -r etc /\n";
  if (std::any_of(commands.begin(), commands.end(),
                  [](const std::string& command) { return command.starts_with("ethtool "); })) {
    readme += "    apt-get install ethtool\n";
  }
  if (!boot.empty()) {
    readme += "    update-grub           # without GRUB: append boot-line to the kernel's boot line\n";
  }
  if (!udev.empty() || !limits.empty()) {
    readme += "    groupadd -f punctum\n";
  }
  if (!udev.empty()) {
    readme += "    udevadm control --reload && udevadm trigger\n";
  }
  if (!commands.empty()) {
    readme += "    systemctl enable --now punctum-machine\n";
  }
  if (!limits.empty()) {
    readme += "    usermod -aG punctum USER  # and log in again\n";
  }
  if (!boot.empty()) {
    readme += "    reboot\n";
  }
  if (std::any_of(boot.begin(), boot.end(),
                  [](const std::string& word) { return word.starts_with("nohz_full="); })) {
    readme += "\nThe scene then names the loop's own CPU, that of --cpu: [servo] cpu = N\n";
  }
  if (!by_hand.empty()) {
    readme += "\nBy hand:\n\n";
    for (const std::string& one : by_hand) {
      readme += "- " + one + "\n";
    }
  }
  files["README"] = readme;
  return files;
}

tl::expected<void, std::string> write_plan(const std::map<std::string, std::string>& files,
                                           const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_empty(folder, error) || error) {
    return tl::unexpected(fmt::format("--plan: {}: {}, allowed: a folder that is new or empty", folder,
                                      error ? error.message() : "it is not empty"));
  }
  for (const auto& [name, text] : files) {
    const fs::path path = fs::path(folder) / name;
    fs::create_directories(path.parent_path(), error);
    if (error) {
      return tl::unexpected(fmt::format("--plan: {}: {}", path.parent_path().string(), error.message()));
    }
    if (const auto written = tools::write_whole(path.string(), text); !written) {
      return written;
    }
  }
  return {};
}

}  // namespace punctum::jitter
