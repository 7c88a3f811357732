// What is wired to the GPIO lines of a station, at the other end: the contacts and the reset button of the
// emergency stop, the relay that watches the heartbeat, and the injector. Relay and injector are those of the
// simulated station (hal/sim/plant); relay open: no power for drives, injector and handle.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "hal/sim/config.hpp"
#include "hal/sim/plant/estop.hpp"
#include "hal/sim/plant/injector.hpp"
#include "tools/emulators/world/gpio_wires.hpp"
#include "tools/emulators/world/wired_world.hpp"

namespace punctum::emulator {

// Offsets of the chip's lines, as in scene `loopback`. Contacts switch to the supply: closed is high.
struct SafetyLines {
  int contact_a = 0, contact_b = 1, reset = 2, heartbeat = 3, gate = 4;
};

class SafetyChain {
 public:
  // Contacts are closed, reset is not pressed, and the relay waits for the heartbeat. What happens is told to
  // `world`.
  SafetyChain(const sim::SimConfig& config, GpioWires wires, WiredWorld& world, std::int64_t now_ns,
              const SafetyLines& lines = {});

  // Looks at the outputs and moves the inputs. Several times in a tick of the core, and not in step with it:
  // edges between two looks are not seen. False: the chip is gone.
  [[nodiscard]] bool step(std::int64_t now_ns);
  [[nodiscard]] bool power() const { return relay_.power(); }

  // "contact a|b open|closed" or "reset": done, or not one of these.
  [[nodiscard]] bool command(std::string_view line, std::int64_t now_ns);
  static constexpr const char* kCommands = "contact a|b open|closed | reset (is pressed for 100 ms)";

 private:
  struct Wire {  // into the chip
    int line;
    bool high;
  };
  [[nodiscard]] bool put(Wire& wire, bool high, std::int64_t now_ns, const char* high_says,
                         const char* low_says);

  GpioWires wires_;
  WiredWorld& world_;
  WatchedLevel heartbeat_, gate_;
  Wire contact_a_, contact_b_, reset_;
  bool there_;
  sim::SimEstop relay_;
  std::optional<sim::SimInjector> injector_;
  std::int64_t began_ns_, stepped_ns_, reset_until_ns_ = 0;
  bool a_closed_ = true, b_closed_ = true, gate_was_open_ = false, valve_was_open_ = false;
  double dose_before_s_ = 0;
};

}  // namespace punctum::emulator
