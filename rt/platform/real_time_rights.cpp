#include "rt/platform/real_time_rights.hpp"

#include <fcntl.h>
#include <linux/capability.h>
#include <malloc.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <utility>

namespace punctum::rt {
namespace {

constexpr const char* kDmaLatency = "/dev/cpu_dma_latency";
constexpr std::size_t kPage = 4096;

std::string reason(int error) { return std::strerror(error); }

// What /proc/self/status says behind the key, empty if nothing.
std::string own_status(const std::string& key) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(key)) {
      return line.substr(key.size());
    }
  }
  return "";
}

long locked_kB() { return std::strtol(own_status("VmLck:").c_str(), nullptr, 10); }

// Effective capability of this process, by its number in linux/capability.h.
bool has_capability(int number) {
  return ((std::strtoull(own_status("CapEff:").c_str(), nullptr, 16) >> number) & 1U) != 0;
}
constexpr int kCapIpcLock = CAP_IPC_LOCK;
constexpr int kCapSysNice = CAP_SYS_NICE;

// The soft limit up to the hard one; returns the result.
rlim_t raise_limit(__rlimit_resource which, bool apply) {
  rlimit limit = {};
  if (::getrlimit(which, &limit) != 0) {
    return 0;
  }
  if (apply && limit.rlim_cur != limit.rlim_max) {
    limit.rlim_cur = limit.rlim_max;
    ::setrlimit(which, &limit);
  }
  return limit.rlim_max;
}

// Touches a deep stack once, so that the loop never grows it.
[[gnu::noinline]] void prefault_stack(std::size_t bytes) {
  char page[kPage];
  std::memset(page, 1, sizeof page);
  asm volatile("" : : "r"(page) : "memory");  // the page is really written
  if (bytes > kPage) {
    prefault_stack(bytes - kPage);
  }
  asm volatile("" : : "r"(page) : "memory");  // and in use until here: no tail call
}

RightFound kernel(const KernelFacts& facts) {
  RightFound right{.name = "PREEMPT_RT kernel", .required = true};
  right.got = facts.preempt_rt;
  right.detail = facts.release + ": " + facts.preempt_rt_seen;
  if (!right.got) {
    right.remedy = "Debian: apt-get install linux-image-rt-amd64, then boot it";
  }
  return right;
}

void limit_spinning() {
  constexpr rlim_t kSecond_us = 1'000'000;
  const rlimit limit{.rlim_cur = static_cast<rlim_t>(kSpinLimit_s * kSecond_us),
                     .rlim_max = static_cast<rlim_t>(kSpinKill_s * kSecond_us)};
  ::setrlimit(RLIMIT_RTTIME, &limit);
}

// Whether the kernel would give it: a control group without real-time time refuses what the limits allow.
bool priority_is_given(int level) {
  rlimit limit = {};
  sched_param before = {};
  const int policy = ::sched_getscheduler(0);
  if (policy < 0 || ::sched_getparam(0, &before) != 0 || ::getrlimit(RLIMIT_RTPRIO, &limit) != 0) {
    return false;
  }
  raise_limit(RLIMIT_RTPRIO, true);
  const sched_param parameter{.sched_priority = level};
  const bool given = ::sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
  if (given) {
    ::sched_setscheduler(0, policy, &before);
  }
  ::setrlimit(RLIMIT_RTPRIO, &limit);
  return given;
}

RightFound priority(const RightsWanted& wanted, bool apply) {
  RightFound right{.name = "SCHED_FIFO priority", .required = true};
  const int level = std::clamp(wanted.priority, 1, 98);  // 99 belongs to the kernel's own threads
  const rlim_t limit = raise_limit(RLIMIT_RTPRIO, apply);
  const std::string text = std::to_string(level);
  if (apply) {
    limit_spinning();
    const sched_param parameter{.sched_priority = level};
    right.got = ::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter) == 0;
    right.detail = right.got ? "SCHED_FIFO " + text : reason(errno);
  } else {
    const bool allowed = has_capability(kCapSysNice) || limit >= static_cast<rlim_t>(level);
    right.got = allowed && priority_is_given(level);
    right.detail = right.got ? "allowed up to SCHED_FIFO " + text
                   : allowed ? "refused by the kernel"
                             : "not allowed to this user";
  }
  if (right.got) {
    return right;
  }
  const std::string most = std::to_string(std::max(level, 95));  // 95: what the packages grant
  right.remedy =
      has_capability(kCapSysNice) || limit >= static_cast<rlim_t>(level)
          ? "the control group grants no real-time time: see cpu.rt_runtime_us of its cgroup"
          : "/etc/security/limits.d/punctum.conf: '@punctum - rtprio " + most +
                "' and join group punctum; or setcap cap_sys_nice,cap_ipc_lock=ep punctum-core; or systemd "
                "LimitRTPRIO=" +
                most;
  return right;
}

// The page through which the kernel shows its clock is not part of locked memory: the first reading is a
// fault.
void prefault_clock() {
  timespec now;
  ::clock_gettime(CLOCK_MONOTONIC, &now);
}

RightFound memory(bool apply) {
  RightFound right{.name = "locked memory", .required = true};
  const rlim_t limit = raise_limit(RLIMIT_MEMLOCK, apply);
  // Under a limit the first page beyond it, of stack or heap, would end the process.
  const bool allowed = has_capability(kCapIpcLock) || limit == RLIM_INFINITY;
  if (apply && allowed) {
    // Freed memory stays with the process, and no allocation makes a mapping of its own.
    ::mallopt(M_TRIM_THRESHOLD, -1);
    ::mallopt(M_MMAP_MAX, 0);
    const bool locked = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    const int error = errno;
    right.got = locked && locked_kB() > 0;  // a sanitizer replaces mlockall by a call that locks nothing
    right.detail = right.got ? "all present and future pages" : locked ? "has no effect here" : reason(error);
  } else {
    right.got = allowed && !apply;
    right.detail = right.got ? "allowed" : "limit " + std::to_string(limit >> 20) + " MiB";
  }
  if (!right.got) {
    right.remedy =
        "/etc/security/limits.d/punctum.conf: '@punctum - memlock unlimited' and join group punctum; or "
        "setcap "
        "cap_sys_nice,cap_ipc_lock=ep punctum-core; or systemd LimitMEMLOCK=infinity";
  }
  return right;
}

RightFound stack(const RightsWanted& wanted, bool apply) {
  RightFound right{.name = "stack prefaulted", .required = true};
  rlimit limit = {};
  ::getrlimit(RLIMIT_STACK, &limit);
  // How much of the stack is left is unknown; set-up has used less than half of it.
  const std::size_t bytes = limit.rlim_cur == RLIM_INFINITY
                                ? wanted.stack_bytes
                                : std::min<std::size_t>(wanted.stack_bytes, limit.rlim_cur / 2);
  if (apply) {
    prefault_stack(bytes);
  }
  right.got = bytes == wanted.stack_bytes;
  right.detail = std::to_string(bytes >> 10) + " KiB";
  if (!right.got) {
    right.remedy = "raise the stack limit: ulimit -s 8192";
  }
  return right;
}

RightFound affinity(const RightsWanted& wanted, const KernelFacts& facts, bool apply) {
  RightFound right{.name = "CPU affinity"};
  if (wanted.cpu < 0) {
    right.detail = "no CPU asked for";
    right.remedy = "name a CPU of its own in the scene";
    return right;
  }
  right.required = true;  // on another one, none of what was made ready for this loop holds
  const std::string text = "CPU " + std::to_string(wanted.cpu);
  cpu_set_t set;
  CPU_ZERO(&set);
  bool possible = wanted.cpu < CPU_SETSIZE;
  if (possible) {
    CPU_SET(wanted.cpu, &set);
  }
  // No thread begins on an isolated CPU, and yet it may go there: only the kernel's answer tells.
  cpu_set_t before;
  CPU_ZERO(&before);
  possible = possible && ::sched_getaffinity(0, sizeof before, &before) == 0 &&
             ::sched_setaffinity(0, sizeof set, &set) == 0;
  if (possible && !apply) {
    ::sched_setaffinity(0, sizeof before, &before);
  }
  right.got = possible;
  right.detail = possible ? text : text + " is not available";
  if (!possible) {
    right.remedy = "name a CPU that is online (" + cpu_list(facts.online_cpus) +
                   ") and that the process may use; nosmt takes the second thread of each core";
  }
  return right;
}

RightFound isolation(const RightsWanted& wanted, const KernelFacts& facts) {
  RightFound right{.name = "isolated CPU"};
  const bool isolated = std::count(facts.isolated_cpus.begin(), facts.isolated_cpus.end(), wanted.cpu) > 0;
  right.got = wanted.cpu >= 0 && isolated;
  right.detail = right.got ? "CPU " + std::to_string(wanted.cpu)
                           : std::to_string(facts.isolated_cpus.size()) + " CPUs isolated";
  if (!right.got) {
    const std::string cpu = wanted.cpu >= 0 ? std::to_string(wanted.cpu) : "N";
    const std::string others = cpu_list(cpus_beside(wanted.cpu, facts));
    right.remedy = others.empty() ? "a machine with a second CPU"
                   : wanted.cpu == 0
                       ? "take another CPU: on CPU 0 the kernel keeps time and serves interrupts"
                       : "boot with isolcpus=" + cpu + " nohz_full=" + cpu + " rcu_nocbs=" + cpu +
                             " irqaffinity=" + (wanted.cpu < 0 ? "0" : others) +
                             ", and give the scene that CPU";
  }
  return right;
}

RightFound dma_latency(bool apply, int& fd) {
  RightFound right{.name = "CPU sleep held off"};
  if (::access(kDmaLatency, F_OK) != 0) {
    right.detail = std::string("no ") + kDmaLatency;
    right.remedy = "a kernel with CONFIG_CPU_IDLE, or a machine whose CPUs do not sleep";
    return right;
  }
  if (apply) {
    fd = ::open(kDmaLatency, O_WRONLY | O_CLOEXEC);
    const std::int32_t microseconds = 0;
    right.got = fd >= 0 && ::write(fd, &microseconds, sizeof microseconds) == sizeof microseconds;
    right.detail = right.got ? std::string(kDmaLatency) + " held at 0 us" : reason(errno);
  } else {
    right.got = ::access(kDmaLatency, W_OK) == 0;
    right.detail = right.got ? std::string(kDmaLatency) + " may be written" : reason(errno);
  }
  if (!right.got) {
    right.remedy =
        "/etc/udev/rules.d/61-punctum-machine.rules: "
        "KERNEL==\"cpu_dma_latency\", GROUP=\"punctum\", MODE=\"0660\"";
  }
  return right;
}

RightFound frequency(const RightsWanted& wanted, const KernelFacts& facts) {
  RightFound right{.name = "performance governor"};
  std::vector<int> cpus = wanted.cpu >= 0 ? std::vector<int>{wanted.cpu} : facts.online_cpus;
  std::string other;
  bool scaling = false;
  for (const int cpu : cpus) {
    const std::string governor = governor_of(cpu);
    scaling = scaling || !governor.empty();
    if (!governor.empty() && governor != "performance") {
      other = "CPU " + std::to_string(cpu) + ": " + governor;
    }
  }
  right.got = other.empty();
  right.detail = !right.got ? other : scaling ? "performance" : "no frequency scaling here";
  if (!right.got) {
    right.remedy = "cpupower frequency-set -g performance (Debian: apt-get install linux-cpupower)";
  }
  return right;
}

RightFound siblings(const KernelFacts& facts) {
  RightFound right{.name = "no SMT siblings"};
  right.got = !facts.smt_active;
  right.detail = facts.smt_active ? "SMT is on: a sibling shares the CPU's units" : "SMT off or absent";
  if (!right.got) {
    right.remedy = "boot with nosmt, or: echo off > /sys/devices/system/cpu/smt/control";
  }
  return right;
}

// Before 6.12 a real-time thread that never sleeps is stopped for the rest of each second; since then a fair
// server lends ordinary tasks a share instead. A tick that sleeps every period meets neither.
RightFound throttling(const RightsWanted& wanted, const KernelFacts& facts) {
  RightFound right{.name = "no RT throttling"};
  if (!facts.at_least(6, 12)) {
    right.got = facts.rt_runtime_us == -1;
    right.detail = right.got ? "off" : "on: " + std::to_string(facts.rt_runtime_us) + " us of each second";
    if (!right.got) {
      right.remedy =
          "only a loop that never sleeps meets it; to switch it off: "
          "echo -1 > /proc/sys/kernel/sched_rt_runtime_us";
    }
    return right;
  }
  const int cpu = std::max(wanted.cpu, 0);
  const long runtime = fair_server_runtime_ns(cpu);
  right.got = runtime == 0;
  right.detail = right.got     ? "fair server off"
                 : runtime < 0 ? "fair server (6.12 and later): cannot be read without debugfs"
                               : "fair server: " + std::to_string(runtime / 1'000'000) + " ms of each second";
  if (!right.got) {
    right.remedy =
        "only a loop that never sleeps meets it; to switch it off on the loop's own CPU: echo 0 > "
        "/sys/kernel/debug/sched/fair_server/cpu" +
        std::to_string(cpu) + "/runtime";
  }
  return right;
}

}  // namespace

RealTimeRights RealTimeRights::find(const RightsWanted& wanted, bool apply) {
  RealTimeRights rights;
  const KernelFacts facts = read_kernel_facts();
  // Memory first: later set-up then happens in locked memory. Priority last: a thread that has it can keep
  // everybody else from its CPU.
  rights.table_.push_back(kernel(facts));
  rights.table_.push_back(memory(apply));
  rights.table_.push_back(stack(wanted, apply));
  rights.table_.push_back(affinity(wanted, facts, apply));
  rights.table_.push_back(isolation(wanted, facts));
  rights.table_.push_back(dma_latency(apply, rights.dma_latency_fd_));
  rights.table_.push_back(frequency(wanted, facts));
  rights.table_.push_back(siblings(facts));
  rights.table_.push_back(throttling(wanted, facts));
  if (apply) {
    prefault_clock();
    ::prctl(PR_SET_TIMERSLACK, 1UL);  // ns; matters only without SCHED_FIFO
  }
  rights.table_.push_back(priority(wanted, apply));
  return rights;
}

RealTimeRights RealTimeRights::acquire(const RightsWanted& wanted) { return find(wanted, true); }
RealTimeRights RealTimeRights::examine(const RightsWanted& wanted) { return find(wanted, false); }

RealTimeRights::RealTimeRights(RealTimeRights&& other) noexcept
    : table_(std::move(other.table_)), dma_latency_fd_(std::exchange(other.dma_latency_fd_, -1)) {}

RealTimeRights::~RealTimeRights() {
  if (dma_latency_fd_ >= 0) {
    ::close(dma_latency_fd_);
  }
}

bool RealTimeRights::degraded() const {
  return std::any_of(table_.begin(), table_.end(),
                     [](const RightFound& right) { return right.required && !right.got; });
}

void RealTimeRights::publish(CoreStatus& status) const {
  const std::size_t count = std::min(table_.size(), kMaxRights);
  for (std::size_t i = 0; i < count; ++i) {
    Right& right = status.rights[i];
    right.name.set(table_[i].name.c_str());
    right.detail.set(table_[i].detail.c_str());
    right.remedy.set(table_[i].remedy.c_str());
    right.got = table_[i].got ? 1 : 0;
    right.required = table_[i].required ? 1 : 0;
  }
  status.degraded.store(degraded() ? 1 : 0);
  status.rights_count.store(count, std::memory_order_release);
}

void leave_real_time() noexcept {
  const sched_param parameter{.sched_priority = 0};
  // Only a privileged thread may clear the flag.
  (void)::sched_setscheduler(0, SCHED_OTHER | SCHED_RESET_ON_FORK, &parameter);
}

bool drop_capabilities() noexcept {
  // What is locked stays locked without the capability as long as the limit allows for it.
  const rlimit unlimited{.rlim_cur = RLIM_INFINITY, .rlim_max = RLIM_INFINITY};
  ::setrlimit(RLIMIT_MEMLOCK, &unlimited);
  __user_cap_header_struct header = {.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  const __user_cap_data_struct none[2] = {};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1UL, 0UL, 0UL, 0UL) == 0 &&
         ::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0UL, 0UL, 0UL) == 0 &&
         ::syscall(SYS_capset, &header, none) == 0;
}

void prefault(const void* data, std::size_t size) {
  const auto* bytes = static_cast<const volatile char*>(data);
  for (std::size_t i = 0; i < size; i += kPage) {
    (void)bytes[i];
  }
}

void prefault_writable(void* data, std::size_t size) {
  auto* bytes = static_cast<char*>(data);
  for (std::size_t i = 0; i + sizeof(Word) <= size; i += kPage) {
    // A store of the same value; an addition of 0 would be turned into a mere load.
    std::atomic_ref<std::uint64_t> word(*reinterpret_cast<std::uint64_t*>(bytes + i));
    std::uint64_t value = word.load(std::memory_order_relaxed);
    word.compare_exchange_strong(value, value);
  }
}

ThreadCounters read_thread_counters() noexcept {
  rusage usage = {};
  ::getrusage(RUSAGE_THREAD, &usage);
  return {static_cast<std::uint64_t>(usage.ru_minflt), static_cast<std::uint64_t>(usage.ru_majflt),
          static_cast<std::uint64_t>(usage.ru_nvcsw), static_cast<std::uint64_t>(usage.ru_nivcsw)};
}

void publish_counters(const ThreadCounters& before, const ThreadCounters& after, std::uint64_t allocations,
                      bool allocations_watched, CoreStatus& status) {
  status.minor_faults.store(after.minor_faults - before.minor_faults);
  status.major_faults.store(after.major_faults - before.major_faults);
  status.voluntary_switches.store(after.voluntary_switches - before.voluntary_switches);
  status.involuntary_switches.store(after.involuntary_switches - before.involuntary_switches);
  status.allocations.store(allocations);
  status.allocations_watched.store(allocations_watched ? 1 : 0);
  status.counters_final.store(1, std::memory_order_release);
}

}  // namespace punctum::rt
