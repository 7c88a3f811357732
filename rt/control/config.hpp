// Everything the servo needs to know of a scene. An empty optional is a thing that is not there.
#pragma once

#include <optional>

#include "hal/parameters.hpp"
#include "rt/control/device_limits.hpp"
#include "rt/control/limits.hpp"
#include "rt/control/local_membrane_model.hpp"
#include "rt/control/master_to_stage.hpp"
#include "rt/control/passivity.hpp"
#include "rt/control/phases.hpp"
#include "rt/control/safety_latch.hpp"
#include "rt/control/velocity.hpp"
#include "rt/forces/list.hpp"

namespace punctum::rt {

struct InjectorParams {
  double max_open_s = 2.0;      // clamped by the tick
  double shut_within_s = 0.25;  // of the gate: open for longer is a fault
};
constexpr auto keys_of(const InjectorParams*) {
  return hal::keys(hal::real("max_open_s", &InjectorParams::max_open_s, 0.001, 60),
                   hal::milli("shut_within_ms", &InjectorParams::shut_within_s, 1, 5000));
}

struct VacuumParams {
  double min_Pa = 200;
  double window_s = 0.1;
  double still_s = 1;  // the same digits for longer: the gauge hangs, alarm; 0 = off
};
constexpr auto keys_of(const VacuumParams*) {
  return hal::keys(hal::real("min_Pa", &VacuumParams::min_Pa, 0, 50'000),
                   hal::milli("window_ms", &VacuumParams::window_s, 1, 10'000),
                   hal::real("still_s", &VacuumParams::still_s, 0, 1000));
}

// A button of the handle that is held for the station to move (hold-to-run). Without a press, new since the
// start, no drive has power and the hand feels nothing; to let it go for longer than a bounce of its contact,
// or to squeeze it, is a stop. A device with two positions never reports the third.
struct EnablingParams {
  double release_s = 0.02;
};
constexpr auto keys_of(const EnablingParams*) {
  return hal::keys(hal::milli("release_ms", &EnablingParams::release_s, 0, 200));
}

struct ServoConfig : EffectParams {
  double rate_Hz = 1000;   // 1, 2, 4 or 8 kHz
  int stage_divisor = 1;   // stage set-points every n-th tick
  int overrun_limit = 20;  // missed ticks in the window
  double overrun_window_s = 1.0;
  bool real_actuators = false;  // an overrun is then a fault, not an alarm
  double hand_timeout_s = 0.02;
  double hand_jump_m = 0.006;     // in a millisecond: 6 m/s; a hand that is thrown reaches 5
  double stage_timeout_s = 0.02;  // silent for longer: stage_lost
  // Projects a motion of the tip onto those that the stage can make, along the needle at least; absent: all.
  std::optional<hal::Mat3> stage_reach;
  int cells = 1;                // to inject; 0 = until the time limit
  bool vision = true;           // observations are expected
  bool inner_membrane = false;  // vision follows it: an injection waits until it is through

  HandDevice device;
  VelocityParams velocity;
  MappingParams mapping;
  LimitParams limits;
  EstopParams estop;
  std::optional<PhaseParams> phases = PhaseParams{};  // absent: always `free`
  std::optional<LocalModelParams> local_model = LocalModelParams{};
  std::optional<GuardParams> guard;
  std::optional<InjectorParams> injector;
  std::optional<VacuumParams> vacuum;
  std::optional<EnablingParams> enabling;
  bool force_sensor = false;
};
// [servo]
inline constexpr auto kServoKeys =
    hal::keys(hal::one_of("rate_hz", &ServoConfig::rate_Hz, 1000, 2000, 4000, 8000),
              hal::whole("stage_divisor", &ServoConfig::stage_divisor, 1, 64),
              hal::whole("overrun_limit", &ServoConfig::overrun_limit, 1, 100'000),
              hal::real("overrun_window_s", &ServoConfig::overrun_window_s, 0.01, 60));
// [scene]
inline constexpr auto kTaskKeys = hal::keys(hal::whole("cells", &ServoConfig::cells, 0, 1'000'000));
// [haptic]
inline constexpr auto kHandWatchKeys =
    hal::keys(hal::milli("timeout_ms", &ServoConfig::hand_timeout_s, 1, 1000),
              hal::milli("jump_mm", &ServoConfig::hand_jump_m, 0.1, 200));
// [stage]
inline constexpr auto kStageWatchKeys =
    hal::keys(hal::milli("timeout_ms", &ServoConfig::stage_timeout_s, 1, 1000));

}  // namespace punctum::rt
