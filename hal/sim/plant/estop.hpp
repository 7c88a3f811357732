// The e-stop chain: two normally closed contacts, a reset button, and the relay that watches the heartbeat.
//
// The relay opens when the heartbeat line has not toggled for relay_timeout_s: drive power off, injector gate
// shut, hand amplifier off. It closes by itself the first time the heartbeat runs; after it has opened it
// needs a running heartbeat and a press of reset.
#pragma once

#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/failures.hpp"
#include "hal/sim/noise.hpp"

namespace punctum::sim {

struct EstopPlantState {
  std::int64_t last_toggle_ns = 0;
  std::int64_t last_reset_ns = 0;  // last time reset was down
  std::int64_t opened_ns = 0;      // when the relay opened last
  std::uint8_t contact_a_closed = 1;
  std::uint8_t contact_b_closed = 1;
  std::uint8_t reset_pressed = 0;
  std::uint8_t pulse_seen = 0;  // a contact was open since the last reading and is closed again
  std::uint8_t heartbeat_level = 0;
  std::uint8_t heartbeat_seen = 0;  // it has toggled at least once
  std::uint8_t relay_closed = 0;
  std::uint8_t was_reset = 0;  // reset was pressed since the relay opened
};

// nan: the chain reports a fault. saturate: contact a is welded, it never opens. noise: both contacts read
// open half of the time, each by itself.
class SimEstop final : public hal::EstopChain {
 public:
  explicit SimEstop(const SimConfig& config);

  // reset: the operator presses the button.
  void step(std::int64_t t_ns, double from_s, double to_s, bool reset, const Failing& failure) NONBLOCKING;

  [[nodiscard]] hal::Status read(hal::EstopState& out) NONBLOCKING override;
  void heartbeat(bool level) NONBLOCKING override;

  [[nodiscard]] bool power() const NONBLOCKING { return state_.relay_closed != 0; }
  [[nodiscard]] const EstopPlantState& state() const NONBLOCKING { return state_; }
  void restore(const EstopPlantState& state, std::int64_t t_ns) NONBLOCKING;

 private:
  const std::array<EstopEvent, 4> events_;
  const int event_count_;
  const std::int64_t timeout_ns_;
  const Noise noise_;
  EstopPlantState state_;
  FailingReader<EstopPlantState> reader_;
  Liar<hal::EstopState> liar_;
  Failing failure_;
  std::int64_t now_ns_ = 0;
  bool unread_ = false;  // an opening that was not read yet, as the event queue of a GPIO line keeps it
};

}  // namespace punctum::sim
