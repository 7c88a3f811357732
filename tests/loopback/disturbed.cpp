// disturbed [--seed N] [--without KIND]...: starts one disturber after the other beside the loop of
// punctum-jitter, in random order and without telling the measurement which, and prints what it named. Exit
// status 0: at most one was not named.
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tools/jitter/measurement.hpp"

namespace {

using namespace punctum;
using tools::late::Cause, tools::late::Explained;

constexpr double kSeconds = 1.6;
constexpr int kCpu = 0;
constexpr std::int64_t kMs = 1'000'000, kEvery = 40 * kMs, kBurst = 2 * kMs;
constexpr std::size_t kPages = 400, kPage = 4096;

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000 + t.tv_nsec;
}
void sleep_until(std::int64_t ns) {
  const timespec t{.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}
void spin_until(std::int64_t ns) {
  while (now_ns() < ns) {
  }
}
void become(int priority) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(kCpu, &set);
  sched_setaffinity(0, sizeof set, &set);
  const sched_param p{.sched_priority = priority};
  sched_setscheduler(0, priority > 0 ? SCHED_FIFO : SCHED_OTHER, &p);
}

// ---- other processes ----

void hog() {
  become(95);
  for (;;) {
    const std::int64_t begin = now_ns();
    spin_until(begin + kBurst);
    sleep_until(begin + kEvery);
  }
}
// Timers by the hundred that expire together.
void timers() {
  const std::int64_t begin = now_ns();
  std::vector<std::thread> all;
  for (int i = 0; i < 250; ++i) {
    all.emplace_back([begin] {
      become(10);
      for (std::int64_t k = 1;; ++k) {
        sleep_until(begin + k * 10 * kMs);
      }
    });
  }
  all.front().join();
}
// A serial line that speaks in bursts.
void serial() {
  const int fd = open("/dev/ttyS0", O_WRONLY | O_NOCTTY);
  std::array<char, 256> text{};
  text.fill('.');
  while (fd >= 0 && write(fd, text.data(), text.size()) > 0) {
    sleep_until(now_ns() + kEvery);
  }
}
// Datagrams that the kernel hands on within its soft interrupt.
void network() {
  become(0);
  const int to = socket(AF_INET, SOCK_DGRAM, 0), from = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  (void)bind(to, reinterpret_cast<sockaddr*>(&address), size);
  (void)getsockname(to, reinterpret_cast<sockaddr*>(&address), &size);
  (void)connect(from, reinterpret_cast<sockaddr*>(&address), size);
  std::array<char, 60'000> block{};
  for (;;) {
    (void)!send(from, block.data(), block.size(), 0);
  }
}
void stop_and_go(pid_t whom) {
  become(90);
  for (;;) {
    kill(whom, SIGSTOP);
    sleep_until(now_ns() + 2 * kBurst);
    kill(whom, SIGCONT);
    sleep_until(now_ns() + kEvery);
  }
}

// ---- within the loop's own tick ----

std::atomic<bool> within{false};

struct Slow {
  virtual ~Slow() = default;
  virtual void work() = 0;
  rt::After run(const rt::Tick& tick) noexcept {
    if (within.load() && tick.release_ns >= due_ns) {
      due_ns = tick.release_ns + kEvery;
      work();
    }
    return rt::After::go_on;
  }
  std::int64_t due_ns = 0;
};
struct Computes final : Slow {
  void work() override { spin_until(now_ns() + kBurst); }
};
struct Waits final : Slow {
  void work() override { (void)poll(nullptr, 0, 2); }
};
// Pages that somebody keeps taking away: of nothing, or of a file that is not in memory.
struct Faults final : Slow {
  explicit Faults(bool of_file) {
    int flags = MAP_PRIVATE | MAP_ANONYMOUS;
    if (of_file) {
      char name[] = "/var/tmp/disturbed-XXXXXX";
      fd = mkstemp(name);
      unlink(name);
      const std::vector<char> block(kPages * kPage, 'x');
      (void)!write(fd, block.data(), block.size());
      fsync(fd);
      flags = MAP_SHARED;
    }
    pages = static_cast<volatile char*>(
        mmap(nullptr, kPages * kPage, fd >= 0 ? PROT_READ : PROT_READ | PROT_WRITE, flags, fd, 0));
    madvise(const_cast<char*>(pages), kPages * kPage, fd >= 0 ? MADV_RANDOM : MADV_NOHUGEPAGE);
  }
  ~Faults() override {
    munmap(const_cast<char*>(pages), kPages * kPage);
    if (fd >= 0) {
      close(fd);
    }
  }
  void work() override {
    char sum = 0;
    for (std::size_t i = 0; i < (fd >= 0 ? 20 : kPages); ++i) {
      if (fd < 0) {
        pages[i * kPage] = 1;
      }
      sum = static_cast<char>(sum + pages[i * kPage]);
    }
    kept = sum;
  }
  void take_away() const {
    munlock(const_cast<char*>(pages), kPages * kPage);
    madvise(const_cast<char*>(pages), kPages * kPage, MADV_DONTNEED);
    if (fd >= 0) {
      posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
    }
  }
  volatile char* pages = nullptr;
  volatile char kept = 0;
  int fd = -1;
};

struct Disturber {
  std::string name;
  Cause cause;
  std::string word;                   // that must stand in what is named
  std::function<void()> beside = {};  // as a process of its own
  Slow* in_tick = nullptr;
  Faults* faults = nullptr;
  int loop_priority = 80;
};

struct Named {
  Cause cause = Cause::unknown;
  std::string what;
  double us = 0;
  std::size_t ticks = 0;
};

// What took most of the time of the late ticks, of those that have a cause; unknown, where three of four have
// none.
Named named(const jitter::Result& result) {
  std::map<Cause, Named> all;
  for (const Explained& e : result.explained) {
    Named& one = all[e.verdict.cause];
    one.cause = e.verdict.cause;
    one.us += 1e-3 * static_cast<double>(e.tick.end_ns - e.tick.release_ns);
    ++one.ticks;
    one.what += e.verdict.what + "\n";
  }
  Named most;
  if (const auto unknown = all.find(Cause::unknown); unknown != all.end()) {
    if (4 * unknown->second.ticks >= 3 * result.explained.size()) {
      return unknown->second;
    }
    all.erase(unknown);
  }
  for (const auto& [cause, one] : all) {
    if (one.us > most.us) {
      most = one;
    }
  }
  return most;
}

jitter::Result disturb(const Disturber& d) {
  const pid_t loop = getpid();
  pid_t child = -1;
  if (d.beside) {
    child = fork();
    if (child == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (getppid() != loop) {
        _exit(0);
      }
      usleep(300'000);
      d.beside();
      _exit(0);
    }
  }
  std::atomic<bool> over{false};
  std::thread taker([&] {
    usleep(300'000);
    within.store(d.in_tick != nullptr);
    while (!over.load()) {
      if (d.faults != nullptr) {
        d.faults->take_away();
      }
      usleep(5'000);
    }
    within.store(false);
  });
  Computes nothing;
  Slow& slow = d.in_tick != nullptr ? *d.in_tick : nothing;
  jitter::Wanted wanted;
  wanted.rate_Hz = 4000;
  wanted.seconds = kSeconds;
  wanted.cpu = kCpu;
  wanted.priority = d.loop_priority;
  wanted.explain_us = 150;
  auto result = jitter::measure(wanted, {.slots = {rt::slot<&Slow::run>("work", slow)}});
  over.store(true);
  taker.join();
  if (child > 0) {
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().c_str());
    std::exit(2);
  }
  return *result;
}

}  // namespace

int main(int argc, char** argv) {
  unsigned seed = 1;
  std::set<std::string> without;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--seed") == 0) {
      seed = static_cast<unsigned>(std::strtoul(argv[i + 1], nullptr, 10));
    } else {
      without.insert(argv[i + 1]);
    }
  }
  Computes computes;
  Waits waits;
  Faults memory(false), file(true);
  const pid_t self = getpid();
  std::vector<Disturber> all{
      {.name = "timers", .cause = Cause::interrupt, .word = "timer", .beside = timers},
      {.name = "serial", .cause = Cause::interrupt, .word = "ttyS", .beside = serial, .loop_priority = 40},
      {.name = "network", .cause = Cause::interrupt, .word = "NET_RX", .beside = network},
      {.name = "hog", .cause = Cause::preemption, .word = "SCHED_FIFO 95", .beside = hog},
      {.name = "faults",
       .cause = Cause::page_fault,
       .word = "slot work",
       .in_tick = &memory,
       .faults = &memory},
      {.name = "disk", .cause = Cause::page_fault, .word = "disk", .in_tick = &file, .faults = &file},
      {.name = "bus", .cause = Cause::device_or_bus, .word = "", .in_tick = &waits},
      {.name = "slot", .cause = Cause::own_computing, .word = "slot work", .in_tick = &computes},
      {.name = "stop", .cause = Cause::stopped, .word = "", .beside = [self] { stop_and_go(self); }}};
  std::erase_if(all, [&](const Disturber& d) { return without.contains(d.name); });
  std::mt19937 random(seed);
  std::shuffle(all.begin(), all.end(), random);
  std::size_t right = 0;
  for (const Disturber& d : all) {
    const jitter::Result result = disturb(d);
    const Named found = named(result);
    const bool good = found.cause == d.cause && found.what.find(d.word) != std::string::npos;
    right += good ? 1 : 0;
    const std::size_t at = found.what.find(d.word),
                      line = good && at != 0 ? found.what.rfind('\n', at) + 1 : 0;
    std::printf("%-8s %-4s %3zu of %3zu late ticks, %8.0f us: %s: %s\n", d.name.c_str(), good ? "yes" : "NO",
                found.ticks, result.explained.size(), found.us, tools::late::name_of(found.cause),
                found.what.substr(line, found.what.find('\n', line) - line).c_str());
    if (const char* to = std::getenv("DISTURBED_TRACE"); to != nullptr && !good) {
      std::FILE* out = std::fopen(to, "w");
      for (const Explained& e : result.explained) {
        std::fprintf(out, "# %.6f wake %.6f end %.6f: %s: %s\n",
                     1e-9 * static_cast<double>(e.tick.release_ns),
                     1e-9 * static_cast<double>(e.tick.wake_ns), 1e-9 * static_cast<double>(e.tick.end_ns),
                     tools::late::name_of(e.verdict.cause), e.verdict.what.c_str());
      }
      std::fputs(result.trace.c_str(), out);
      std::fclose(out);
    }
    if (!result.untraced.empty()) {
      std::printf("         not traced: %s\n", result.untraced.c_str());
    }
    std::fflush(stdout);
  }
  std::printf("%zu of %zu named\n", right, all.size());
  return right + 1 >= all.size() ? 0 : 1;
}
