#include "tools/shared/stop_signal.hpp"

#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <string>

namespace punctum::tools::stop_signal {
namespace {

std::atomic<int> signals{0};
std::atomic<bool> parent_died{false};
std::atomic<Wake> wake_up{nullptr};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<Wake>::is_always_lock_free);

constexpr int kMostAncestors = 8;
constexpr int kParentDied = SIGUSR1;  // not SIGTERM, with which somebody else may ask

// 0: there is no such process.
std::uint64_t parent_of(std::uint64_t pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/status");
  for (std::string key; in >> key;) {
    if (std::uint64_t parent = 0; key == "PPid:" && in >> parent) {
      return parent;
    }
  }
  return 0;
}

extern "C" void on_stop_signal(int) {
  const int now = signals.fetch_add(1) + 1;
  if (const Wake wake = wake_up.load()) {
    wake(now);
  }
}

extern "C" void on_parent_died(int) {
  parent_died.store(true);
  request();
  if (const Wake wake = wake_up.load()) {
    wake(signals.load());
  }
}

}  // namespace

void watch(std::initializer_list<int> which, Wake wake) {
  wake_up.store(wake);
  struct sigaction action{};
  action.sa_handler = on_stop_signal;
  for (const int signal : which) {
    sigaction(signal, &action, nullptr);
  }
}

bool watch_parent(std::uint64_t maker) {
  struct sigaction action{};
  action.sa_handler = on_parent_died;
  sigaction(kParentDied, &action, nullptr);
  prctl(PR_SET_PDEATHSIG, kParentDied);
  auto ancestor = static_cast<std::uint64_t>(getppid());
  for (int i = 0; i < kMostAncestors && ancestor > 1 && ancestor != maker; ++i) {
    ancestor = parent_of(ancestor);
  }
  return ancestor == maker;
}

bool parent_has_died() noexcept { return parent_died.load(); }

int count() NONBLOCKING { return signals.load(std::memory_order_relaxed); }

void request() noexcept {
  int none = 0;
  signals.compare_exchange_strong(none, 1);
}

}  // namespace punctum::tools::stop_signal
