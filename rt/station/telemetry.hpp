// What the core did in one tick. Plain data, lives in shared memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/station/alarm.hpp"
#include "rt/station/device.hpp"
#include "rt/station/fault.hpp"
#include "rt/station/phase.hpp"

namespace punctum::rt {

enum class StopStage : std::uint8_t { running, stopping, stopped };  // of the safety latch

inline constexpr std::size_t kMaxEffects = 12;

struct TelemetrySample {
  std::uint64_t tick = 0;  // of the absolute grid: gaps are missed releases
  double t_s = 0;          // since the start of the run
  Phase phase = Phase::free;
  Fault fault = Fault::none;
  StopStage stop = StopStage::running;
  std::uint8_t estop = 0;  // bit 0 contact a open, bit 1 contact b open, bit 2 reset pressed
  std::uint32_t alarms = 0;
  std::uint32_t buttons = 0;
  std::uint32_t cell = 0;  // counts cells of this run from 0

  double x_m[3] = {};      // hand, device frame
  double v_m_s[3] = {};    // hand velocity, filtered
  double tip_m[3] = {};    // needle tip by the stage's encoders
  double cmd_m[3] = {};    // stage set-point
  double force_N[3] = {};  // to the hand, after guard and limits

  double effect_N[kMaxEffects] = {};  // magnitude of each force effect at the hand; rt/forces/list.hpp
  double guard_N = 0;                 // what the passivity guard changed

  // The local membrane model, at the needle.
  double wd_m = 0;
  double a_m = 0;
  double R_m = 0;
  double tip_force_N = 0;             // membrane law, not scaled
  double sigma_d_Pa = 0;              // membrane stress of eq. 4
  double pressure_Pa = 0;             // internal pressure of eq. 4
  double entry_m[3] = {};             // entry point in the stage's frame
  double axis[3] = {};                // approach axis
  double contact_force_N[4][3] = {};  // membrane force as vectors at four points of the pipette's rim

  double obs_age_s = 0;  // age of the newest observation; -1 if none yet
  double sensor_N = 0;   // force sensor, 0 if there is none
  double vacuum_Pa = 0;
  double stored_energy_J = 0;    // in the effects, at the hand
  double injected_energy_J = 0;  // by moving or switching fixtures and by vibration, cumulative
  double obs_gap_m = 0;          // newest observation's gap, for comparison
  std::uint64_t observations = 0;
  std::uint64_t stale_ticks = 0;  // ticks on which the newest observation was too old
  std::uint8_t injector_open = 0;
  std::uint8_t unusable = 0;  // with alarm_sensor: whose data, rt/station/device.hpp
  std::uint8_t pad[6] = {};

  // Standard deviations and what only vision knows; 0 where it is not known.
  double wd_sd_m = 0;         // of wd_m
  double R_sd_m = 0;          // of R_m
  double tip_force_sd_N = 0;  // of tip_force_N by that of the depth; an error of the modulus comes on top
  double obs_a_m = 0;         // half-width of the dimple as the newest observation has it
  double obs_a_sd_m = 0;
  double E_fit_Pa = 0;  // elastic modulus as the force sensor tells it, rt/control/modulus_fit
  double E_fit_sd_Pa = 0;
};

}  // namespace punctum::rt
