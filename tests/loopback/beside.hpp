// The core's loop in real time, with somebody outside who acts beside it at a higher priority.
#pragma once

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <functional>
#include <thread>

#include "rt/executive/executive.hpp"

namespace punctum::loopback {

inline constexpr int kCorePriority = 80, kOutsidePriority = 90;

inline void become(int priority) {
  const sched_param parameter{priority};
  ASSERT_EQ(pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter), 0);
}

// Runs until a slot ends the loop and `outside` has ended.
inline void run_beside(rt::Executive& executive, const std::function<void()>& outside) {
  std::thread wires([&] {
    become(kOutsidePriority);
    outside();
  });
  become(kCorePriority);
  std::atomic<bool> stop{false};
  EXPECT_EQ(executive.run(stop), rt::Executive::Ended::by_slot);
  const sched_param ordinary{0};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  wires.join();
}

}  // namespace punctum::loopback
