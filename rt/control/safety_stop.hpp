// The safety latch round the force to the hand: while a stop is latched the last force before it fades to
// zero.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/drive_check.hpp"
#include "rt/control/safety_latch.hpp"

namespace punctum::rt {

struct SafetyOutput {
  LatchOutput latch;
  bool running = true;                         // no stop is latched
  hal::Vec3 hand_force_N = hal::Vec3::Zero();  // device frame: what goes out
  Fault cause = Fault::none;                   // of the stop, the first one
  StopStage stage = StopStage::running;
  std::uint64_t faults_latched = 0;  // bit f: Fault f was latched in this run
};

class SafetyStop {
 public:
  explicit SafetyStop(const EstopParams& params) NONBLOCKING : latch_(params),
                                                               power_off_after_s_(params.power_off_after_s) {}

  // causes: all that is wrong on this tick.
  [[nodiscard]] SafetyOutput step(const Causes& causes, const hal::Vec3& hand_force_N,
                                  const Readings& readings, double elapsed_s) NONBLOCKING;

  [[nodiscard]] Fault cause() const NONBLOCKING { return latch_.cause(); }
  [[nodiscard]] StopStage stage() const NONBLOCKING { return latch_.stage(); }
  [[nodiscard]] bool reset_needed() const NONBLOCKING { return latch_.state().reset_needed; }

 private:
  void remember(Fault fault) NONBLOCKING { faults_latched_ |= 1ULL << static_cast<unsigned>(fault); }

  SafetyLatch latch_;
  DriveCheck drive_;
  double power_off_after_s_;
  double without_power_s_ = 0;  // the drive is to be, up to power_off_after_s_
  hal::Vec3 force_before_stop_N_ = hal::Vec3::Zero();
  std::uint64_t faults_latched_ = 0;
};

}  // namespace punctum::rt
