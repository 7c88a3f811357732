// What one tick of the servo was given: enough, with the commands that its events tell and the observations
// that it took, for the same tick again. Plain data, lives in shared memory.
#pragma once

#include <cstdint>

namespace punctum::rt {

struct InputSample {
  enum Flag : std::uint32_t {
    degraded = 1U << 0,  // the alarm "without real-time rights"
    // Asked of the servo before this tick, by signals or by the time limit.
    stop = 1U << 1,
    end = 1U << 2,
    end_here = 1U << 3,
    // Devices that there are.
    has_stage = 1U << 4,
    has_estop = 1U << 5,
    has_injector = 1U << 6,
    has_vacuum = 1U << 7,
    has_force_sensor = 1U << 8,
    has_enabling = 1U << 9,
    // What they told, where their status is ok.
    stage_enabled = 1U << 10,
    stage_powered = 1U << 11,
    stage_at_standstill = 1U << 12,
    estop_a_closed = 1U << 13,
    estop_b_closed = 1U << 14,
    estop_reset = 1U << 15,
    estop_pulse = 1U << 16,
    enabling_a_closed = 1U << 17,
    enabling_b_closed = 1U << 18,
    enabling_pulse = 1U << 19,
    injector_open = 1U << 20,
  };
  // A hal::Status of two bits for each.
  enum Answer : std::uint32_t {
    hand_read,
    stage_read,
    estop_read,
    injector_read,
    vacuum_read,
    force_sensor_read,
    enabling_read,
    hand_write,
    stage_write
  };

  std::uint64_t number = 0;  // counts the ticks of the run from 0, without gaps
  std::uint64_t tick = 0;    // of the absolute grid
  std::int64_t release_ns = 0;
  std::int64_t start_ns = 0;
  double period_s = 0;
  std::uint64_t missed_in_window = 0;
  std::uint64_t observations = 0;  // number in vision's ring of the newest one that it saw, counted from 1
  std::uint32_t flags = 0;
  std::uint32_t answers = 0;

  double hand_m[3] = {};  // device frame
  double hand_wxyz[4] = {1, 0, 0, 0};
  std::int64_t hand_ns = 0;  // when the device took the sample, station clock
  std::uint32_t buttons = 0;
  std::uint32_t pad = 0;

  double tip_m[3] = {};
  double axis[3] = {};
  double following_error_m[3] = {};
  std::int64_t stage_ns = 0;

  std::int64_t estop_ns = 0, enabling_ns = 0, injector_ns = 0, vacuum_ns = 0, force_sensor_ns = 0;
  double vacuum_Pa = 0;
  double axial_N = 0;
};

}  // namespace punctum::rt
