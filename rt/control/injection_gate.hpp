// When the injector's gate is open: while the operator presses, inside the cell, seen by vision, and for a
// bounded time per cell. Only a press that begins where an injection may begin opens it.
#pragma once

#include <optional>

#include "hal/realtime.hpp"
#include "rt/control/config.hpp"
#include "rt/control/device_inputs.hpp"

namespace punctum::rt {

struct GateInput {
  bool stopped = false;  // the safety latch shuts the gate
  bool vision_fresh = true;
  bool ending = false;  // the run ends, or was asked to
  bool injection_phase = false;
  bool may_inject = false;  // TaskFacts
  bool new_cell = false;    // on this tick
};

class InjectionGate {
 public:
  // A pneumatic valve and its line answer within some 10 ms: of a shorter pulse nobody can tell what came
  // out. The button and the end of a run wait for it; a stop, lost sight, an injector that does
  // not answer and the end of the injection phase shut the gate at once.
  static constexpr double kShortest_s = 0.02;

  explicit InjectionGate(const ServoConfig& config) NONBLOCKING : params_(config.injector),
                                                                  hand_timeout_s_(config.hand_timeout_s) {}

  // Open on this tick?
  [[nodiscard]] bool step(const Readings& readings, const GateInput& in, double elapsed_s) NONBLOCKING;

 private:
  std::optional<InjectorParams> params_;
  double hand_timeout_s_;
  double open_s_ = 0;       // in this cell
  double this_time_s_ = 0;  // since it was opened
  bool open_ = false;
  bool armed_ = false;  // the button was up since an injection became possible, and since the gate was shut
};

}  // namespace punctum::rt
