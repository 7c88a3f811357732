// What the devices and vision told the servo in every tick of one simulated run, to be told again without
// the simulated world: the same hand, stage and observations, whatever the scene leaves out.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <type_traits>
#include <vector>

#include "hal/devices.hpp"
#include "hal/sim/point.hpp"
#include "rt/control/servo.hpp"
#include "tools/scene.hpp"

namespace punctum::report {

struct TickTold {
  std::uint64_t tick = 0;
  std::int64_t release_ns = 0;
  sim::Point hand_m;
  double hand_wxyz[4] = {1, 0, 0, 0};
  std::uint32_t buttons = 0;
  hal::Status hand_status = hal::Status::no_data, stage_status = hal::Status::no_data;
  bool stage_enabled = false, stage_at_standstill = false;
  sim::Point tip_m, axis, following_error_m;
  hal::EstopState estop;
  bool observed = false;
  double vacuum_Pa = 0, axial_N = 0;
  rt::Observation observation;
};
static_assert(std::is_trivially_copyable_v<TickTold>);

// The run of a simulated scene in virtual time, seen by an observer that reads the truth, until its task is
// done, at most `seconds`. A scene whose pictures are recorded is told its person's run of `icsi`.
[[nodiscard]] std::vector<TickTold> record_ticks(const tools::Scene& scene, double seconds);

// A servo for this scene goes through the tape once. The devices of the scene are there and only copy.
[[nodiscard]] rt::Fault replay_ticks(const tools::Scene& scene, const std::vector<TickTold>& tape);

[[nodiscard]] tl::expected<void, std::string> write_tape(const std::string& path,
                                                         const std::vector<TickTold>& tape);
[[nodiscard]] tl::expected<std::vector<TickTold>, std::string> read_tape(const std::string& path);

}  // namespace punctum::report
