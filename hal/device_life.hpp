// The life of a device outside the tick. Set-up code: these calls may block, allocate and take locks.
//
//   open -> start -> per-tick I/O through the interfaces of devices.hpp -> safe_state -> close
//
// A backend's class implements Device and the interfaces it serves; the assembly of a program calls it. The
// tick never sees Device.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/devices.hpp"

namespace punctum::hal {

// The interfaces that a device serves; null: it does not serve this one.
struct Served {
  HapticDevice* haptic = nullptr;
  Stage* stage = nullptr;
  EstopChain* estop = nullptr;
  Injector* injector = nullptr;
  HoldingVacuum* vacuum = nullptr;
  ForceSensor* force_sensor = nullptr;
  QueuedPositioner* positioner = nullptr;
  EnablingSwitch* enabling = nullptr;
};

// What can be seen of a device while nothing of it is claimed, set, or sent anything: one line each. A
// backend has a function look(...) that returns them, for `punctum check`; it may run beside a core that uses
// the device.
struct Finding {
  enum class Is : std::uint8_t {
    found,
    note,     // it can run, but somebody should know
    missing,  // it cannot; the line says what to do
  };
  Is is = Is::found;
  std::string line;
};
using Findings = std::vector<Finding>;

class Device {
 public:
  virtual ~Device() = default;

  // Claims and checks the hardware and moves nothing. The error is one line: what is wrong, what to do. A
  // device that failed to open holds nothing and is not closed.
  [[nodiscard]] virtual tl::expected<void, std::string> open() = 0;

  // Valid from open() to close().
  [[nodiscard]] virtual Served served() noexcept = 0;

  // From here on readings arrive and commands act; the device's own threads begin here, after memory was
  // locked. The first tick is due at first_tick_ns of the station's clock. The error is one line.
  [[nodiscard]] virtual tl::expected<void, std::string> start(std::int64_t first_tick_ns) = 0;
  // What start() may wait for the hardware.
  [[nodiscard]] virtual std::int64_t longest_start_ns() const noexcept { return 0; }

  // After the last tick, however it came about; also without start(), and more than once. What can move or
  // push is stopped at once; the holding vacuum stays.
  virtual void safe_state() noexcept = 0;

  // Ends its threads and releases the hardware.
  virtual void close() noexcept = 0;
};

}  // namespace punctum::hal
