#include "tools/vision/live_camera.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include "hal/aravis/module.hpp"
#include "hal/v4l2/v4l2_camera.hpp"

namespace punctum::tools {

tl::expected<std::unique_ptr<hal::LiveCamera>, std::string> make_live_camera(const Scene& scene,
                                                                             const hal::Clock& clock) {
  if (scene.v4l2) {
    return std::make_unique<v4l2::V4l2Camera>(*scene.v4l2, *scene.camera, clock);
  }
  // Its library and what that needs take longer to load than all the rest of this program.
  void* const module = dlopen(aravis::kModule, RTLD_NOW | RTLD_LOCAL);
  const auto make =
      module == nullptr ? nullptr : reinterpret_cast<aravis::MakeCamera>(dlsym(module, aravis::kMakeCamera));
  if (make == nullptr) {
    const char* const why = dlerror();
    return tl::unexpected(
        fmt::format("camera.device = \"aravis\" is not part of this installation ({}): it is built where "
                    "libaravis-dev is installed",
                    why == nullptr ? aravis::kModule : why));
  }
  return std::unique_ptr<hal::LiveCamera>(make(*scene.aravis, *scene.camera, clock));
}

}  // namespace punctum::tools
