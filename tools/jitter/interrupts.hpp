// The interrupts of the devices that a scene uses, as the kernel shows them.
#pragma once

#include <string>
#include <vector>

#include "tools/scene/scene.hpp"

namespace punctum::jitter {

struct Interrupt {
  int number = 0;
  std::vector<std::string> names = {};  // of its handlers
  std::string cpus = {};                // that may serve it, as the kernel lists them
  // Of its thread: what the kernel calls it, and its priority of SCHED_FIFO (0: an ordinary one). Empty: it
  // has none.
  std::string thread = {};
  int thread_priority = 0;
};

struct UsedDevice {
  std::string title;                  // "stage: cia402 can0"
  std::string absent;                 // why the kernel does not know it; empty: it does
  bool idle = false;                  // it has an interrupt that nobody handles yet
  std::vector<Interrupt> interrupts;  // none: the device has none of its own
};

// Of every device that the core or vision reads in time, but the simulated ones.
[[nodiscard]] std::vector<UsedDevice> used_devices(const tools::Scene& scene, const std::string& root);

// Whether a process of this name runs.
[[nodiscard]] bool runs(const std::string& comm, const std::string& root);

}  // namespace punctum::jitter
