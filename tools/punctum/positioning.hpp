// Moves the slow manipulator of a scene from point to point: only while no run goes on, for a run holds it.
#pragma once

#include <optional>

#include "hal/devices.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

// To a point in the positioner's own frame; without one, to where the scene parks it. Returns an ExitCode.
[[nodiscard]] int move_positioner(const Scene& scene, const std::optional<hal::Vec3>& target_m);

}  // namespace punctum::tools
