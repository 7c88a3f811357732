// What is plugged in to this machine, and the lines of a scene that would use it. Reads, and asks the kernel;
// opens no watchdog (that would arm it), claims nothing, sends nothing but the question to cameras on a
// network who they are.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "hal/aravis/module.hpp"
#include "hal/cia402/look.hpp"
#include "hal/evdev/which_hand.hpp"
#include "hal/gpiod/lines.hpp"
#include "hal/v4l2/kernel.hpp"

namespace punctum::tools {

using NetworkCameras = tl::expected<std::vector<aravis::NetworkCamera>, std::string>;
// Those that answer within a second, or why nobody can be asked. Loads libaravis.
[[nodiscard]] NetworkCameras network_cameras();

// Where to look; a test puts folders and answers of its own in their place.
struct Machine {
  std::filesystem::path root = "/";
  gpiod::OpenChip open_chip = gpiod::open_chip;
  std::function<std::optional<cia402::CanLink>(const std::string&)> can_link = cia402::can_link;
  v4l2::Kernel* video = &v4l2::this_kernel();
  std::function<NetworkCameras()> ask_network = network_cameras;

  // Of the path on the machine.
  [[nodiscard]] std::filesystem::path at(const std::filesystem::path& path) const {
    return root / path.relative_path();
  }
};

struct PluggedIn {
  std::string place;  // path or name, as a scene says it; empty: nobody could look, and `what` says why
  std::string what;
  std::string remedy;  // what keeps this user from it, and what to do; empty: nothing
};

struct UsbDevice {
  std::string vendor, product;  // four hexadecimal digits each
  std::string maker, name, serial;
  std::string path;     // /dev/bus/usb/BUS/DEVICE
  bool vision = false;  // USB3 Vision
};

[[nodiscard]] std::vector<PluggedIn> gpio_chips(const Machine& machine);
[[nodiscard]] std::vector<PluggedIn> can_interfaces(const Machine& machine);
[[nodiscard]] std::vector<PluggedIn> v4l2_cameras(const Machine& machine);
[[nodiscard]] std::vector<UsbDevice> usb_devices(const Machine& machine);
[[nodiscard]] std::vector<PluggedIn> usb_vision_cameras(const Machine& machine);
[[nodiscard]] std::vector<PluggedIn> gige_vision_cameras(const std::vector<aravis::NetworkCamera>& cameras);
[[nodiscard]] std::vector<PluggedIn> gige_vision_cameras(const Machine& machine);
[[nodiscard]] std::vector<PluggedIn> falcons(const Machine& machine);
// Every input device, event2 before event10, as sysfs tells it; `number` is that of its file, major:minor.
struct NumberedInput {
  evdev::InputDevice device;
  std::string number;
};
[[nodiscard]] std::vector<NumberedInput> input_devices(const Machine& machine);
// Those of them that can be a hand: mice, gamepads and SpaceMice.
[[nodiscard]] std::vector<PluggedIn> hand_inputs(const Machine& machine);
[[nodiscard]] std::vector<PluggedIn> serial_ports(const Machine& machine);
[[nodiscard]] std::vector<PluggedIn> watchdogs(const Machine& machine);

// Empty, or what to do so that this user may use it: `rights` as access(2) has them.
[[nodiscard]] std::string remedy_for(const std::filesystem::path& file, const std::string& shown,
                                     int rights = R_OK | W_OK);

// The text of `punctum devices`.
[[nodiscard]] std::string plugged_in(const Machine& machine);

// How one kind of device is listed, and used by a scene: {} in the lines is its place. What only the operator
// knows, such as which wire is on which line, is a comment: with numbers of the station's own and without its
// "# " it is what the scene still lacks. A kind whose backend this program lacks is listed without lines.
struct PluggedKind {
  const char* title;
  std::vector<PluggedIn> (*list)(const Machine&);
  const char* table;  // of the device; empty: the lines need no backend
  const char* backend;
  const char* lines;
};
[[nodiscard]] const std::vector<PluggedKind>& plugged_kinds();

}  // namespace punctum::tools
