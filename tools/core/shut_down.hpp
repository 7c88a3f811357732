// The one way out of the core: what every end of the loop, of the set-up or of the process comes to.
//
// Force zero, injector gate shut and quick stop at once; drive power off when the stage stands still, or when
// it should have. The holding vacuum stays. It speaks to the devices as the tick does, so it holds whatever a
// backend does in its own safe_state().
#pragma once

#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/world.hpp"
#include "rt/control/devices.hpp"

namespace punctum::tools {

// Waits for nothing; may be called from a signal handler, in the middle of a tick.
void stop_and_power_off(const rt::Devices& devices) NONBLOCKING;

// From here on a thread of this process that spins at real-time priority (rt::kSpinLimit_s) does so, and the
// process ends by SIGXCPU. `devices` outlives the process.
void shut_down_when_spinning(const rt::Devices& devices);

class ShutDown {
 public:
  // From open devices on. `longest_ns`: drive power goes off after so long although the stage still moves.
  ShutDown(const rt::Devices& devices, hal::Clock& clock, std::int64_t period_ns, std::int64_t longest_ns)
      : devices_(devices), clock_(clock), period_ns_(period_ns), longest_ns_(longest_ns) {}
  ~ShutDown() { run(); }
  ShutDown(const ShutDown&) = delete;
  ShutDown& operator=(const ShutDown&) = delete;

  // The devices were started; the simulated plant, where there is one, is stepped on until all is off.
  void started(sim::World* world) noexcept { world_ = world; }
  void run() noexcept;  // once; a second call does nothing

 private:
  [[nodiscard]] bool at_standstill() noexcept;
  void pass_one_period() noexcept;

  const rt::Devices devices_;
  hal::Clock& clock_;
  std::int64_t period_ns_, longest_ns_;
  sim::World* world_ = nullptr;
  bool done_ = false;
};

}  // namespace punctum::tools
