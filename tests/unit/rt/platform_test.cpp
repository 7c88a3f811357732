// What the machine is asked for, and what is said when it does not give it.
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>

#include "rt/platform/kernel_facts.hpp"
#include "rt/platform/real_time_rights.hpp"

namespace punctum::rt {
namespace {

namespace fs = std::filesystem;

class KernelFactsTest : public testing::Test {
 protected:
  void SetUp() override {
    root = fs::temp_directory_path() / ("punctum-kernel-" + std::to_string(::getpid()));
    fs::create_directories(root);
  }
  void TearDown() override { fs::remove_all(root); }
  void write(const std::string& path, const std::string& text) const {
    fs::create_directories((root / path).parent_path());
    std::ofstream(root / path) << text;
  }
  fs::path root;
};

TEST_F(KernelFactsTest, an_out_of_tree_real_time_kernel_is_known_by_its_file) {
  write("sys/kernel/realtime", "1\n");
  const KernelFacts facts = read_kernel_facts(root, "6.1.0-18-rt-amd64", "#1 SMP Debian 6.1.76-1");
  EXPECT_TRUE(facts.preempt_rt);
  EXPECT_EQ(facts.preempt_rt_seen, "/sys/kernel/realtime");
  EXPECT_EQ(facts.major, 6);
  EXPECT_EQ(facts.minor, 1);
  EXPECT_FALSE(facts.at_least(6, 12));
}

TEST_F(KernelFactsTest, a_mainline_real_time_kernel_is_known_by_its_version_string_alone) {
  const KernelFacts facts =
      read_kernel_facts(root, "6.12.9-rt", "#1 SMP PREEMPT_RT Debian 6.12.9-1 (2025-01-10)");
  EXPECT_TRUE(facts.preempt_rt);
  EXPECT_TRUE(facts.at_least(6, 12));
}

TEST_F(KernelFactsTest, a_real_time_kernel_with_a_strange_version_string_is_known_by_its_configuration) {
  write("boot/config-6.12.0-custom", "CONFIG_SMP=y\nCONFIG_PREEMPT_RT=y\n");
  const KernelFacts facts = read_kernel_facts(root, "6.12.0-custom", "#1 custom");
  EXPECT_TRUE(facts.preempt_rt);
  EXPECT_EQ(facts.preempt_rt_seen, "/boot/config-6.12.0-custom");
}

TEST_F(KernelFactsTest, a_preemptible_kernel_is_not_taken_for_a_real_time_one) {
  write("boot/config-6.1.0", "CONFIG_PREEMPT=y\n# CONFIG_PREEMPT_RT is not set\nCONFIG_HAVE_PREEMPT_RT=y\n");
  write("sys/kernel/realtime", "0\n");
  EXPECT_FALSE(read_kernel_facts(root, "6.1.0", "#1 SMP PREEMPT_DYNAMIC Debian").preempt_rt);
}

TEST_F(KernelFactsTest, reads_the_cpus_that_are_online_and_isolated) {
  write("sys/devices/system/cpu/online", "0-5\n");
  write("sys/devices/system/cpu/isolated", "2,4-5\n");
  write("sys/devices/system/cpu/smt/active", "1\n");
  write("proc/sys/kernel/sched_rt_runtime_us", "-1\n");
  write("sys/devices/system/cpu/cpu2/cpufreq/scaling_governor", "powersave\n");
  const KernelFacts facts = read_kernel_facts(root, "6.1.0", "#1");
  EXPECT_EQ(facts.online_cpus, (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(facts.isolated_cpus, (std::vector<int>{2, 4, 5}));
  EXPECT_TRUE(facts.smt_active);
  EXPECT_EQ(facts.rt_runtime_us, -1);
  EXPECT_EQ(governor_of(2, root), "powersave");
  EXPECT_EQ(governor_of(3, root), "");
  EXPECT_EQ(fair_server_runtime_ns(2, root), -1);
}

TEST_F(KernelFactsTest, tells_which_cpus_are_left_for_everything_else) {
  write("sys/devices/system/cpu/online", "0-5\n");
  write("sys/devices/system/cpu/isolated", "2,5\n");
  const KernelFacts facts = read_kernel_facts(root, "6.1.0", "#1");
  EXPECT_EQ(cpu_list(cpus_beside(0, facts)), "1,3-4");
  EXPECT_EQ(cpu_list(cpus_beside(2, facts)), "0-1,3-4");
  EXPECT_EQ(cpu_list({}), "");
}

TEST_F(KernelFactsTest, survives_a_machine_that_says_nothing) {
  const KernelFacts facts = read_kernel_facts(root, "strange", "?");
  EXPECT_FALSE(facts.preempt_rt);
  EXPECT_EQ(facts.major, 0);
  EXPECT_TRUE(facts.online_cpus.empty());
}

// Runs in a child: priorities and locked memory end with it. 0 = all held.
int in_child(const std::function<int()>& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::_exit(work());
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(RealTimeRights, never_refuses_and_names_a_remedy_for_each_missing_right) {
  EXPECT_EQ(in_child([] {
              const RealTimeRights rights = RealTimeRights::acquire({.priority = 10});
              auto status = std::make_unique<CoreStatus>();
              rights.publish(*status);
              if (status->rights_count.load() != rights.table().size()) {
                return 1;
              }
              bool missing = false;
              for (std::size_t i = 0; i < rights.table().size(); ++i) {
                const Right& right = status->rights[i];
                if (right.name.text != rights.table()[i].name) {
                  return 2;
                }
                if (right.remedy.text != rights.table()[i].remedy) {
                  return 3;  // nothing is cut off
                }
                if (right.detail.text != rights.table()[i].detail) {
                  return 4;
                }
                if ((right.got == 0) != (right.remedy.text[0] != '\0')) {
                  return 5;
                }
                missing = missing || (right.required != 0 && right.got == 0);
              }
              return missing == (status->degraded.load() == 1) && missing == rights.degraded() ? 0 : 6;
            }),
            0);
}

TEST(RealTimeRights, without_any_right_the_core_is_degraded_but_runs) {
  EXPECT_EQ(in_child([] {
              rlimit none = {0, 0};
              ::setrlimit(RLIMIT_RTPRIO, &none);
              ::setrlimit(RLIMIT_MEMLOCK, &none);
              if (::geteuid() == 0 && (::setgid(65534) != 0 || ::setuid(65534) != 0)) {
                return 1;
              }
              const RealTimeRights rights = RealTimeRights::acquire({.priority = 10});
              if (!rights.degraded()) {
                return 2;
              }
              int missing = 0;
              for (const RightFound& right : rights.table()) {
                if (right.name == "SCHED_FIFO priority" || right.name == "locked memory") {
                  missing += !right.got && right.remedy.find("limits.d") != std::string::npos ? 1 : 0;
                }
              }
              return missing == 2 ? 0 : 3;
            }),
            0);
}

TEST(RealTimeRights, examining_changes_nothing) {
  EXPECT_EQ(in_child([] {
              const int policy = ::sched_getscheduler(0);
              const RealTimeRights rights = RealTimeRights::examine({.priority = 10, .cpu = 0});
              return ::sched_getscheduler(0) == policy && !rights.table().empty() ? 0 : 1;
            }),
            0);
}

const RightFound& right_named(const RealTimeRights& rights, const std::string& name) {
  return *std::find_if(rights.table().begin(), rights.table().end(),
                       [&](const RightFound& right) { return right.name == name; });
}

// As of a process on a machine with isolcpus=: it begins on the others. The kernel's own answer is the truth.
TEST(RealTimeRights, examining_tells_of_a_cpu_what_the_kernel_says_when_it_is_asked_for) {
  const auto goes_to = [](int cpu) {
    return in_child([cpu] {
             cpu_set_t set;
             CPU_ZERO(&set);
             CPU_SET(cpu, &set);
             return ::sched_setaffinity(0, sizeof set, &set) == 0 ? 1 : 0;
           }) == 1;
  };
  int first = 0;
  while (!goes_to(first)) {
    ++first;
  }
  for (int cpu = 0; cpu <= static_cast<int>(::sysconf(_SC_NPROCESSORS_CONF)); ++cpu) {
    EXPECT_EQ(in_child([&] {
                cpu_set_t narrow, after;
                CPU_ZERO(&narrow);
                CPU_SET(first, &narrow);
                if (::sched_setaffinity(0, sizeof narrow, &narrow) != 0) {
                  return 2;
                }
                const bool got =
                    right_named(RealTimeRights::examine({.priority = 10, .cpu = cpu}), "CPU affinity").got;
                if (::sched_getaffinity(0, sizeof after, &after) != 0 || !CPU_EQUAL(&narrow, &after)) {
                  return 3;
                }
                return got ? 1 : 0;
              }),
              goes_to(cpu) ? 1 : 0)
        << cpu;
  }
}

// As in a control group without real-time time, or in a container: limits allow it, and the kernel refuses.
TEST(RealTimeRights, examining_tells_of_a_priority_that_the_kernel_refuses) {
  EXPECT_EQ(in_child([] {
              sock_filter program[] = {
                  BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
                  BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_sched_setscheduler, 0, 1),
                  BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM),
                  BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
              };
              const sock_fprog filter{.len = 4, .filter = program};
              rlimit before = {}, after = {};
              if (::prctl(PR_SET_NO_NEW_PRIVS, 1UL, 0UL, 0UL, 0UL) != 0 ||
                  ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0 ||
                  ::getrlimit(RLIMIT_RTPRIO, &before) != 0) {
                return 1;
              }
              const RealTimeRights examined = RealTimeRights::examine({.priority = 10});
              if (::getrlimit(RLIMIT_RTPRIO, &after) != 0 || after.rlim_cur != before.rlim_cur) {
                return 2;
              }
              const RightFound& told = right_named(examined, "SCHED_FIFO priority");
              const RealTimeRights acquired = RealTimeRights::acquire({.priority = 10});
              return told.got || right_named(acquired, told.name).got || told.remedy.empty() ? 3 : 0;
            }),
            0);
}

TEST(RealTimeRights, what_is_said_to_be_got_is_got) {
  EXPECT_EQ(in_child([] {
              const RealTimeRights rights = RealTimeRights::acquire({.priority = 11, .cpu = 0});
              for (const RightFound& right : rights.table()) {
                if (right.name == "SCHED_FIFO priority" && right.got) {
                  sched_param parameter = {};
                  ::sched_getparam(0, &parameter);
                  if ((::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) != SCHED_FIFO) {
                    return 1;
                  }
                  if (parameter.sched_priority != 11) {
                    return 2;
                  }
                }
                if (right.name == "CPU affinity" && right.got) {
                  cpu_set_t set;
                  CPU_ZERO(&set);
                  ::sched_getaffinity(0, sizeof set, &set);
                  if (CPU_COUNT(&set) != 1 || !CPU_ISSET(0, &set)) {
                    return 3;
                  }
                }
                if (right.name == "locked memory" && right.got) {
                  std::ifstream in("/proc/self/status");
                  long locked_kB = -1;
                  for (std::string line; std::getline(in, line);) {
                    if (line.rfind("VmLck:", 0) == 0) {
                      locked_kB = std::stol(line.substr(6));
                    }
                  }
                  if (locked_kB <= 0) {
                    return 4;
                  }
                }
              }
              return 0;
            }),
            0);
}

TEST(RealTimeRights, are_left_again_also_without_capabilities) {
  EXPECT_EQ(in_child([] {
              (void)RealTimeRights::acquire({.priority = 11, .cpu = 0});
              if (!drop_capabilities()) {
                return 1;
              }
              leave_real_time();
              return (::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) == SCHED_OTHER ? 0 : 2;
            }),
            0);
}

TEST(RealTimeRights, no_remedy_sends_interrupts_to_the_loop_s_own_cpu) {
  for (int cpu = 0; cpu < 4; ++cpu) {
    const RealTimeRights rights = RealTimeRights::examine({.priority = 10, .cpu = cpu});
    const std::string& remedy = right_named(rights, "isolated CPU").remedy;
    const std::size_t at = remedy.find("irqaffinity=");
    if (at != std::string::npos) {
      EXPECT_EQ(
          std::ranges::count(parse_cpu_list(remedy.substr(at + 12, remedy.find(' ', at) - at - 13)), cpu), 0)
          << remedy;
    }
  }
}

TEST(RealTimeRights, the_rule_of_a_remedy_does_not_take_the_place_of_the_packages_own) {
  const RealTimeRights rights = RealTimeRights::examine({.priority = 10});
  EXPECT_EQ(right_named(rights, "CPU sleep held off").remedy.find("/60-punctum.rules"), std::string::npos);
}

TEST(RealTimeRights, a_cpu_that_does_not_exist_is_said_so) {
  EXPECT_EQ(in_child([] {
              const RealTimeRights rights = RealTimeRights::acquire({.priority = 10, .cpu = 900});
              for (const RightFound& right : rights.table()) {
                if (right.name == "CPU affinity") {
                  return right.got || right.remedy.empty() || !right.required || !rights.degraded() ? 1 : 0;
                }
              }
              return 2;
            }),
            0);
}

TEST(ThreadCounters, count_the_faults_of_fresh_pages) {
  const ThreadCounters before = read_thread_counters();
  constexpr std::size_t kBytes = std::size_t{64} << 20;
  const std::unique_ptr<char[]> fresh(new char[kBytes]);
  prefault_writable(fresh.get(), kBytes);
  const ThreadCounters after = read_thread_counters();
  EXPECT_GT(after.minor_faults, before.minor_faults);
  prefault(fresh.get(), kBytes);
  // 16384 pages; a sanitizer has faults of its own
  EXPECT_LE(read_thread_counters().minor_faults, after.minor_faults + 200) << "a second touch costs nothing";
}

}  // namespace
}  // namespace punctum::rt
