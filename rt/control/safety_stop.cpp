#include "rt/control/safety_stop.hpp"

namespace punctum::rt {

SafetyOutput SafetyStop::step(const Causes& causes, const hal::Vec3& hand_force_N, const Readings& readings,
                              double elapsed_s) NONBLOCKING {
  drive_.step(readings, latch_.stage() == StopStage::running, latch_.stage() == StopStage::stopped,
              elapsed_s);
  LatchInput in;
  in.causes = causes;
  in.chain_readable = readings.estop_readable;
  in.contacts_closed = readings.estop.contact_a_closed && readings.estop.contact_b_closed;
  in.reset_pressed = readings.estop.reset_pressed;
  in.reset_down = readings.reset_down;
  in.pressed_anew = readings.pressed_anew && (readings.estop_readable || !readings.has_estop);
  in.at_standstill = drive_.stands();
  in.drive_obeys = drive_.obeys();
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
