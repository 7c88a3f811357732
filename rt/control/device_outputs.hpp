// Writes the devices: stage, injector gate, force to the hand, heartbeat of the e-stop chain.
#pragma once

#include "hal/realtime.hpp"
#include "rt/control/config.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/devices.hpp"
#include "rt/control/safety_stop.hpp"

namespace punctum::rt {

struct Written {
  Fault fault = Fault::none;     // latched on the next tick
  bool stage_commanded = false;  // a set-point was sent
};

class DeviceOutputs {
 public:
  DeviceOutputs(const ServoConfig& config, const Devices& devices) NONBLOCKING
      : devices_(devices),
        stage_divisor_(config.stage_divisor > 1 ? config.stage_divisor : 1),
        hand_timeout_s_(config.hand_timeout_s) {}

  // set_point: a null pointer as long as hand and needle are not coupled.
  [[nodiscard]] Written write(const SafetyOutput& safety, const Readings& readings,
                              const hal::StageCommand* set_point, bool gate_open, double elapsed_s)
      NONBLOCKING;

 private:
  void write_stage(const LatchOutput& latch, const Readings& readings, const hal::StageCommand* set_point,
                   Written& written) NONBLOCKING;

  // To the stage, and to the enable line of the chain: the drive's own word is not all that gives it power.
  void power(bool on) NONBLOCKING;

  const Devices devices_;
  int stage_divisor_;
  double hand_timeout_s_;
  double force_refused_s_ = 0;       // for so long the hand has taken no force
  int until_command_ = 0;            // ticks until the next stage set-point
  bool hand_force_unknown_ = false;  // it could not be written: no heartbeat until the reset
  bool heartbeat_level_ = false;
  bool power_given_ = false;
};

}  // namespace punctum::rt
