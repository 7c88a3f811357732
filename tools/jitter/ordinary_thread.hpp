// A thread beside the loop: of ordinary priority (a real-time thread's children have that:
// SCHED_RESET_ON_FORK), on any processor but the loop's, and deaf to signals.
#pragma once

#include <sched.h>
#include <signal.h>

#include <thread>
#include <utility>

namespace punctum::jitter {

template <class Function>
std::jthread ordinary_thread(Function&& function) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  cpu_set_t bound, others;
  CPU_ZERO(&bound);
  sched_getaffinity(0, sizeof bound, &bound);
  std::jthread thread(std::forward<Function>(function));
  if (CPU_COUNT(&bound) == 1) {
    CPU_ZERO(&others);
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (!CPU_ISSET(cpu, &bound)) {
        CPU_SET(cpu, &others);
      }
    }
    // Refused where there is no other.
    (void)pthread_setaffinity_np(thread.native_handle(), sizeof others, &others);
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace punctum::jitter
