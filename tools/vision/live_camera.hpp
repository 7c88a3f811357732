// The plugged camera that a scene names.
#pragma once

#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "hal/live_camera.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

// Not yet open. clock: the station's.
[[nodiscard]] tl::expected<std::unique_ptr<hal::LiveCamera>, std::string> make_live_camera(
    const Scene& scene, const hal::Clock& clock);

}  // namespace punctum::tools
