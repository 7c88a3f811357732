#include "rt/control/device_outputs.hpp"

#include <algorithm>

namespace punctum::rt {

Written DeviceOutputs::write(const SafetyOutput& safety, const Readings& readings,
                             const hal::StageCommand* set_point, bool gate_open, double elapsed_s)
    NONBLOCKING {
  Written written;
  if (safety.latch.cleared) {
    hand_force_unknown_ = false;
  }
  if (devices_.stage) {
    write_stage(safety.latch, readings, set_point, written);
  }
  if (devices_.injector) {
    devices_.injector->gate(gate_open);
  }
  const hal::Status status = devices_.hand.write_force(safety.hand_force_N);
  force_refused_s_ = status == hal::Status::ok ? 0 : force_refused_s_ + elapsed_s;
  if (status == hal::Status::disconnected || status == hal::Status::fault ||
      force_refused_s_ > hand_timeout_s_) {
    force_refused_s_ = 0;
    written.fault = first_of(written.fault, Fault::hand_lost);
    hand_force_unknown_ = true;
  }
  if (devices_.estop && safety.latch.heartbeat && !hand_force_unknown_) {
    heartbeat_level_ = !heartbeat_level_;
    devices_.estop->heartbeat(heartbeat_level_);
  }
  return written;
}

void DeviceOutputs::write_stage(const LatchOutput& latch, const Readings& readings,
                                const hal::StageCommand* set_point, Written& written) NONBLOCKING {
  hal::Stage& stage = *devices_.stage;
  if (latch.quick_stop) {
    stage.quick_stop();
    if (!latch.drive_power) {
      power(false);
    }
  } else if (!readings.enabled) {  // whatever power the drive came with
    stage.quick_stop();
    if (readings.at_standstill()) {
      power(false);
    }
  } else if (!readings.stage.enabled) {
    if (readings.stage_seen) {
      power(true);
    }
  } else if (until_command_ <= 0 && set_point != nullptr) {
    if (!power_given_) {  // it came with power: the chain's line has to say so too
      power(true);
    }
    const hal::Status status = stage.command(*set_point);
    written.stage_commanded = true;
    if (status == hal::Status::disconnected) {
      written.fault = Fault::stage_lost;
    }
    if (status == hal::Status::fault) {
      written.fault = Fault::stage_fault;
    }
    until_command_ = stage_divisor_;
  }
  until_command_ = std::max(until_command_ - 1, 0);
}

void DeviceOutputs::power(bool on) NONBLOCKING {
  power_given_ = on;
  devices_.stage->enable(on);
  if (devices_.estop) {
    devices_.estop->drive_power(on);
  }
}

}  // namespace punctum::rt
