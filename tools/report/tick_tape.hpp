// A recording of the servo's inputs in every tick of one simulated run, to be played without the simulated
// world: the same hand, stage and observations for every scene.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <type_traits>
#include <vector>

#include "rt/control/servo.hpp"
#include "rt/station/input.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::report {

struct TickTold {
  rt::InputSample input;
  bool observed = false;
  rt::Observation observation;
};
static_assert(std::is_trivially_copyable_v<TickTold>);

// Records the run of a simulated scene in virtual time, with observations of the truth, until its task ends
// or `seconds` have passed. For a scene with recorded pictures it is a run of `icsi` with the scene's own
// operator.
[[nodiscard]] std::vector<TickTold> record_ticks(const tools::Scene& scene, double seconds);

// Runs a servo with the scene's parameters through the tape. The devices of the scene only copy the
// recording.
[[nodiscard]] rt::Fault replay_ticks(const tools::Scene& scene, const std::vector<TickTold>& tape);

// The same, back to back, with how long each tick took by the machine's clock, ns; what reading the clock
// takes is in it.
[[nodiscard]] std::vector<std::int64_t> time_ticks(const tools::Scene& scene,
                                                   const std::vector<TickTold>& tape);

[[nodiscard]] tl::expected<void, std::string> write_tape(const std::string& path,
                                                         const std::vector<TickTold>& tape);
[[nodiscard]] tl::expected<std::vector<TickTold>, std::string> read_tape(const std::string& path);

}  // namespace punctum::report
