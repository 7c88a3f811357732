#include "tools/vision/live_camera.hpp"

#include <fmt/format.h>

#include "hal/aravis/module.hpp"
#include "hal/v4l2/v4l2_camera.hpp"
#include "tools/shared/module.hpp"

namespace punctum::tools {

tl::expected<std::unique_ptr<hal::LiveCamera>, std::string> make_live_camera(const Scene& scene,
                                                                             const hal::Clock& clock) {
  if (scene.v4l2) {
    return std::make_unique<v4l2::V4l2Camera>(*scene.v4l2, *scene.camera, clock);
  }
  // Its library and what that needs take longer to load than all the rest of this program.
  const auto make = function_of_module(aravis::kModule, aravis::kMakeCamera);
  if (!make) {
    return tl::unexpected(
        fmt::format("camera.device = \"aravis\" is {} ({})", aravis::kNotInstalled, make.error()));
  }
  return std::unique_ptr<hal::LiveCamera>(
      reinterpret_cast<aravis::MakeCamera>(*make)(*scene.aravis, *scene.camera, clock));
}

}  // namespace punctum::tools
