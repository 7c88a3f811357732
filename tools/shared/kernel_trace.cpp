#include "tools/shared/kernel_trace.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace punctum::tools::late {
namespace {

constexpr const char* kPrefix = "punctum-jitter-";
constexpr int kRing_KiB = 3072;  // of each processor that is traced
// Without these nothing is explained; the others depend on kernel and processor.
constexpr std::array kNeeded{"sched/sched_switch", "sched/sched_waking"};
constexpr std::array kWanted{"irq/irq_handler_entry",
                             "irq/irq_handler_exit",
                             "irq/softirq_entry",
                             "irq/softirq_exit",
                             "timer/hrtimer_expire_entry",
                             "timer/hrtimer_expire_exit",
                             "irq_vectors/local_timer_entry",
                             "irq_vectors/local_timer_exit",
                             "irq_vectors/reschedule_entry",
                             "irq_vectors/reschedule_exit",
                             "irq_vectors/call_function_entry",
                             "irq_vectors/call_function_exit",
                             "irq_vectors/call_function_single_entry",
                             "irq_vectors/call_function_single_exit",
                             "irq_vectors/irq_work_entry",
                             "irq_vectors/irq_work_exit",
                             "irq_vectors/thermal_apic_entry",
                             "irq_vectors/thermal_apic_exit",
                             "nmi/nmi_handler",
                             "power/cpu_frequency"};
// Of the loop's thread alone: others make them by the thousand.
constexpr std::array kOfThread{"exceptions/page_fault_user", "exceptions/page_fault_kernel",
                               "raw_syscalls/sys_enter", "raw_syscalls/sys_exit"};

bool put(const std::string& path, std::string_view text) {
  const int fd = open(path.c_str(), O_WRONLY | O_CLOEXEC | O_TRUNC);
  const bool written = fd >= 0 && write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (fd >= 0) {
    (void)close(fd);
  }
  return written;
}

// The only processor that the thread may use; -1: there are several.
int only_processor(int tid) {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(tid, sizeof set, &set) != 0 || CPU_COUNT(&set) != 1) {
    return -1;
  }
  int cpu = 0;
  while (!CPU_ISSET(cpu, &set)) {
    ++cpu;
  }
  return cpu;
}

bool make_ring(const std::string& folder, int cpu) {
  const std::string size = std::to_string(kRing_KiB);
  if (cpu < 0) {
    return put(folder + "/buffer_size_kb", size);
  }
  // As hexadecimal groups of 32 processors.
  std::string mask = fmt::format("{:x}", 1U << (cpu % 32));
  for (int group = 0; group < cpu / 32; ++group) {
    mask += ",00000000";
  }
  return put(folder + "/tracing_cpumask", mask) &&
         put(fmt::format("{}/per_cpu/cpu{}/buffer_size_kb", folder, cpu), size);
}

// What a killed one has left.
void remove_old(const std::string& instances) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(instances, error)) {
    const std::string name = entry.path().filename();
    int pid = 0;
    const std::string_view rest = std::string_view(name).substr(std::min(name.size(), std::strlen(kPrefix)));
    if (name.starts_with(kPrefix) &&
        std::from_chars(rest.data(), rest.data() + rest.size(), pid).ec == std::errc{} && kill(pid, 0) != 0 &&
        errno == ESRCH) {
      (void)rmdir(entry.path().c_str());
    }
  }
}

}  // namespace

tl::expected<KernelTrace, std::string> KernelTrace::start(int tid) {
  std::string instances;
  for (const char* place : {"/sys/kernel/tracing/instances", "/sys/kernel/debug/tracing/instances"}) {
    if (access(place, F_OK) == 0) {
      instances = place;
      break;
    }
  }
  if (instances.empty()) {
    return tl::unexpected(std::string("there is no tracefs: mount -t tracefs tracefs /sys/kernel/tracing"));
  }
  remove_old(instances);
  KernelTrace trace;
  const int cpu = only_processor(tid);
  const std::string mine = fmt::format("common_pid == {}", tid);
  for (std::size_t i = 0; i < trace.folders_.size(); ++i) {
    const std::string folder = fmt::format("{}/{}{}-{}", instances, kPrefix, getpid(), i);
    if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
      return tl::unexpected(fmt::format("{}: {}: tracing is root's", instances, std::strerror(errno)));
    }
    trace.folders_[i] = folder;
    bool all = (i == 0 || put(folder + "/tracing_on", "0")) && put(folder + "/trace_clock", "mono") &&
               make_ring(folder, cpu);
    for (const char* event : kOfThread) {
      const std::string at = fmt::format("{}/events/{}/", folder, event);
      if (put(at + "filter", mine)) {
        (void)put(at + "enable", "1");
      }
    }
    for (const char* event : kWanted) {
      (void)put(fmt::format("{}/events/{}/enable", folder, event), "1");
    }
    // Of all that are woken, the loop's thread alone: under a storm of timers the ring reaches back further.
    (void)put(folder + "/events/sched/sched_waking/filter", fmt::format("pid == {}", tid));
    for (const char* event : kNeeded) {
      all = all && put(fmt::format("{}/events/{}/enable", folder, event), "1");
    }
    if (!all) {
      return tl::unexpected(fmt::format("{}: this kernel traces no switches on the loop's clock", folder));
    }
  }
  return trace;
}

KernelTrace::~KernelTrace() {
  for (const std::string& folder : folders_) {
    if (!folder.empty()) {
      (void)put(folder + "/tracing_on", "0");
      (void)rmdir(folder.c_str());
    }
  }
}

std::string KernelTrace::take() {
  (void)put(folders_[1] + "/trace", "");
  (void)put(folders_[1] + "/tracing_on", "1");
  (void)put(folders_[0] + "/tracing_on", "0");
  std::string out;
  const int fd = open((folders_[0] + "/trace").c_str(), O_RDONLY | O_CLOEXEC);
  // Small pieces: a kernel that is not preemptible serves nobody else on this processor during one.
  std::array<char, 4096> block{};
  for (ssize_t n = 0; fd >= 0 && (n = read(fd, block.data(), block.size())) > 0;) {
    out.append(block.data(), static_cast<std::size_t>(n));
  }
  if (fd >= 0) {
    (void)close(fd);
  }
  std::swap(folders_[0], folders_[1]);
  return out;
}

}  // namespace punctum::tools::late
