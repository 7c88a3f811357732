// Which backend looks at its device without touching it, and what it says.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "hal/device_life.hpp"
#include "tools/punctum/plugged_in.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

struct DeviceLook {
  std::string_view backend;
  // device: the name of its table in the scene.
  hal::Findings (*look)(const Scene& scene, const Machine& machine, std::string_view device);
};
[[nodiscard]] const std::vector<DeviceLook>& device_looks();

struct DeviceFinding {
  std::string device;  // its table in the scene
  hal::Finding finding;
};
// Of every device of the scene, and of the machine's watchdog; a device has at least one.
[[nodiscard]] std::vector<DeviceFinding> look_at_devices(const Scene& scene, const Machine& machine = {});

}  // namespace punctum::tools
