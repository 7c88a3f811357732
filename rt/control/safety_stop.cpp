#include "rt/control/safety_stop.hpp"

#include <algorithm>

namespace punctum::rt {

SafetyOutput SafetyStop::step(const Causes& causes, const hal::Vec3& hand_force_N, const Readings& readings,
                              double elapsed_s) NONBLOCKING {
  const bool running = latch_.stage() == StopStage::running;
  // Nobody has pressed the enabling device yet: the drive is to stand as after a stop. It has as long as
  // there to come to rest.
  const bool waits = running && !readings.enabled && readings.stage_seen;
  without_power_s_ = latch_.stage() == StopStage::stopped ? power_off_after_s_
                     : waits ? std::min(without_power_s_ + elapsed_s, power_off_after_s_)
                             : 0;
  drive_.step(readings, running && !waits, without_power_s_ >= power_off_after_s_, elapsed_s);
  const bool obeys = waits ? drive_.rests() : drive_.obeys();
  LatchInput in;
  in.causes = causes;
  if (running && !obeys) {
    in.causes.add(Fault::stage_not_stopping);
  }
  in.chain_readable = readings.estop_readable;
  in.contacts_closed = readings.estop.contact_a_closed && readings.estop.contact_b_closed;
  in.reset_pressed = readings.estop.reset_pressed;
  in.reset_down = readings.reset_down;
  in.pressed_anew = readings.pressed_anew && (readings.estop_readable || !readings.has_estop);
  in.at_standstill = drive_.stands();
  in.drive_obeys = obeys;
  SafetyOutput out;
  out.latch = latch_.step(in, elapsed_s);
  out.stage = latch_.stage();
  out.running = out.stage == StopStage::running;
  out.cause = latch_.cause();

  if (out.cause != Fault::none) {
    remember(out.cause);
  }
  if (!in.drive_obeys) {
    remember(Fault::stage_not_stopping);
  }
  if (readings.estop_discrepancy) {
    remember(Fault::estop_discrepancy);
  }
  // A contact that does not open shows only when the switch is let go, and that is the first cause.
  if ((causes.all & 1U << static_cast<unsigned>(Fault::enabling_fault)) != 0) {
    remember(Fault::enabling_fault);
  }
  out.faults_latched = faults_latched_;

  if (out.latch.cleared) {
    force_before_stop_N_.setZero();
  } else if (out.running) {
    out.hand_force_N = hand_force_N;
    force_before_stop_N_ = hand_force_N;
  } else {
    out.hand_force_N = out.latch.hand_gain * force_before_stop_N_;
  }
  return out;
}

}  // namespace punctum::rt
