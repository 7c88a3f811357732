#include "tools/jitter/load.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <thread>
#include <utility>

namespace punctum::jitter {
namespace {

constexpr std::size_t kMemory = std::size_t{32} << 20, kWritten = std::size_t{1} << 20;
constexpr long kTimer_ns = 100'000;
constexpr off_t kFile = 64 << 20;

unsigned processors() { return std::max(1U, std::thread::hardware_concurrency()); }

// Every cache line of a memory larger than the caches, again and again.
[[noreturn]] void fill_memory() {
  auto* memory = static_cast<volatile char*>(std::malloc(kMemory));
  for (;;) {
    for (std::size_t i = 0; memory != nullptr && i < kMemory; i += 64) {
      memory[i] = static_cast<char>(i);
    }
  }
}

// Its last name is gone at once; -1: it cannot be made.
int nameless_file(const std::string& folder) {
  std::string path = folder + "/punctum-jitter-XXXXXX";
  const int fd = mkostemp(path.data(), O_CLOEXEC);
  if (fd >= 0) {
    (void)unlink(path.c_str());
  }
  return fd;
}

[[noreturn]] void write_disk(int fd) {
  static std::array<char, kWritten> block{};
  for (off_t at = 0;; at = (at + static_cast<off_t>(kWritten)) % kFile) {
    if (pwrite(fd, block.data(), block.size(), at) < 0 || fdatasync(fd) < 0) {
      sleep(1);  // it is full by now
    }
  }
}

[[noreturn]] void exchange_bytes(int socket, bool begins) {
  char byte = 0;
  if (begins) {
    (void)!write(socket, &byte, 1);
  }
  for (;;) {
    if (read(socket, &byte, 1) != 1 || write(socket, &byte, 1) != 1) {
      sleep(1);
    }
  }
}

[[noreturn]] void set_timers() {
  const timespec pause{.tv_sec = 0, .tv_nsec = kTimer_ns};
  for (;;) {
    (void)clock_nanosleep(CLOCK_MONOTONIC, 0, &pause, nullptr);
  }
}

}  // namespace

template <class Work>
bool Load::add(Work work) {
  const pid_t parent = getpid(), pid = fork();
  if (pid == 0) {
    (void)signal(SIGINT, SIG_IGN);  // it ends with its parent
    (void)prctl(PR_SET_PDEATHSIG, static_cast<unsigned long>(SIGKILL));
    if (getppid() != parent) {
      _exit(0);
    }
    work();
  }
  if (pid > 0) {
    pids_.push_back(pid);
  }
  return pid > 0;
}

std::string Load::stated() {
  return fmt::format(
      "{} processes that fill {} MiB of memory each, one that writes {} MiB to the disk and waits for it, "
      "two "
      "that wake each other, one that sleeps {} us at a time",
      processors(), kMemory >> 20, kWritten >> 20, kTimer_ns / 1000);
}

tl::expected<Load, std::string> Load::start() {
  const char* named = std::getenv("TMPDIR");
  const std::string folder = named != nullptr ? named : "/var/tmp";
  const int fd = nameless_file(folder);
  if (fd < 0) {
    return tl::unexpected(
        fmt::format("--load: {}: no file can be written there: {}; TMPDIR names another folder", folder,
                    std::strerror(errno)));
  }
  Load load;
  std::array<int, 2> pair{};
  bool all = socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) == 0;
  for (unsigned i = 0; i < processors(); ++i) {
    all = all && load.add(fill_memory);
  }
  all = all && load.add([fd] { write_disk(fd); }) && load.add([&] { exchange_bytes(pair[0], true); }) &&
        load.add([&] { exchange_bytes(pair[1], false); }) && load.add(set_timers);
  for (const int used : {fd, pair[0], pair[1]}) {
    (void)close(used);
  }
  if (!all) {
    return tl::unexpected(std::string("--load: its processes cannot be started"));
  }
  return load;
}

Load::~Load() {
  for (const pid_t pid : pids_) {
    (void)kill(pid, SIGKILL);
  }
  for (const pid_t pid : pids_) {
    (void)waitpid(pid, nullptr, 0);
  }
}

}  // namespace punctum::jitter
