#include "tools/punctum/device_looks.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>

#include "hal/gpiod/gpiod_devices.hpp"
#include "hal/v4l2/v4l2_camera.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "tools/punctum/kernel_watchdog.hpp"
#include "tools/scene/messages.hpp"
#include "tools/scene/scene_keys.hpp"

namespace punctum::tools {
namespace {

using Is = hal::Finding::Is;

hal::Findings look_at_simulated(const Scene&, const Machine&, std::string_view) { return {{Is::found, ""}}; }

hal::Findings look_at_handle(const Scene&, const Machine&, std::string_view) {
  return {{Is::found, "a button of the handle"}};
}

hal::Findings look_at_recorded(const Scene& scene, const Machine&, std::string_view) {
  return {{Is::found, fmt::format("{:g} per s", scene.recorded->fps)}};
}

hal::Findings look_at_gpiod(const Scene& scene, const Machine& machine, std::string_view device) {
  return gpiod::look(*scene.gpiod,
                     {.estop = device == "estop",
                      .injector = device == "injector",
                      .enabling = device == "enabling",
                      .vacuum = device == "vacuum"},
                     machine.open_chip);
}

hal::Findings look_at_cia402(const Scene& scene, const Machine& machine, std::string_view device) {
  if (device != "stage") {
    return {{Is::found, fmt::format("node {}, on the bus of the stage", scene.cia402->force_node)}};
  }
  return cia402::look(*scene.cia402, machine.can_link(scene.cia402->interface));
}

hal::Findings look_at_v4l2(const Scene& scene, const Machine& machine, std::string_view) {
  const rt::MonotonicClock clock;
  return v4l2::V4l2Camera(*scene.v4l2, *scene.camera, clock, *machine.video).look();
}

std::string names_of(const std::vector<PluggedIn>& cameras) {
  std::string names;
  for (const PluggedIn& camera : cameras) {
    names += (names.empty() ? "" : ", ") + camera.place;
  }
  return names;
}

hal::Findings look_at_aravis(const Scene& scene, const Machine& machine, std::string_view) {
  const std::string& name = scene.aravis->name;
  if (name.starts_with("Fake")) {
    return {{Is::note, name + " is a camera inside libaravis: it shows when it is opened"}};
  }
  const auto found = [](const PluggedIn& camera) -> hal::Findings {
    return {{camera.remedy.empty() ? Is::found : Is::missing,
             camera.remedy.empty() ? camera.what : camera.remedy}};
  };
  std::vector<PluggedIn> cameras = usb_vision_cameras(machine);
  if (const auto one = std::ranges::find(cameras, name, &PluggedIn::place); one != cameras.end()) {
    return found(*one);
  }
  const NetworkCameras asked = machine.ask_network();
  if (!asked) {
    return {{Is::missing, asked.error()}};
  }
  const std::vector<PluggedIn> on_network = gige_vision_cameras(asked.value());
  if (name.empty()) {
    cameras.insert(cameras.end(), on_network.begin(), on_network.end());
    if (cameras.size() == 1) {
      return found(cameras.front());
    }
    return {{Is::missing, cameras.empty() ? "no camera is plugged in on USB, and none answers on the network"
                                          : "there are several cameras, allowed: aravis.name = one of " +
                                                names_of(cameras)}};
  }
  for (std::size_t i = 0; i < asked->size(); ++i) {
    const aravis::NetworkCamera& camera = (*asked)[i];
    if (name == camera.name || name == camera.maker + "-" + camera.serial || name == camera.address) {
      return found(on_network[i]);
    }
  }
  // The library shortens some makers' names, and knows cameras by names that their users gave them.
  cameras.insert(cameras.end(), on_network.begin(), on_network.end());
  if (const bool address = name.find_first_not_of("0123456789.") == std::string::npos;
      !cameras.empty() && !address) {
    return {{Is::note, fmt::format("{} is not seen, but {}: whether it is the same shows when it is opened",
                                   name, names_of(cameras))}};
  }
  return {{Is::missing, fmt::format("{} is not on USB and does not answer on the network, allowed for "
                                    "aravis.name: one that `punctum devices` shows",
                                    name)}};
}

hal::Findings one_of(const std::vector<PluggedIn>& there, std::string missing) {
  if (there.empty()) {
    return {{Is::missing, std::move(missing)}};
  }
  const PluggedIn& first = there.front();
  return {first.remedy.empty() ? hal::Finding{Is::found, fmt::format("{} ({})", first.place, first.what)}
                               : hal::Finding{Is::missing, first.remedy}};
}

hal::Findings look_at_falcon(const Scene&, const Machine& machine, std::string_view) {
  return one_of(falcons(machine), "no Falcon is plugged in (USB 0403:cb48)");
}

// A device file that is opened when the run begins.
hal::Findings look_at_file(const Machine& machine, const std::string& path, const char* key) {
  std::error_code ec;
  if (!std::filesystem::is_character_file(machine.at(path), ec)) {
    return {{Is::missing,
             fmt::format("{}: no such device, allowed for {}: one that `punctum devices` shows", path, key)}};
  }
  std::string remedy = remedy_for(machine.at(path), path);
  return {remedy.empty() ? hal::Finding{Is::found, path} : hal::Finding{Is::missing, std::move(remedy)}};
}

// The kernel's number of a device's file, as sysfs writes it; empty: it is none.
std::string number_of(const std::filesystem::path& file) {
  struct stat about{};
  return stat(file.c_str(), &about) == 0 && S_ISCHR(about.st_mode)
             ? fmt::format("{}:{}", major(about.st_rdev), minor(about.st_rdev))
             : "";
}

// The path of the hand, chosen as the backend does when the run begins, or why it would refuse.
tl::expected<std::string, std::string> hand_of(const evdev::EvdevParams& params,
                                               const std::vector<NumberedInput>& inputs,
                                               const Machine& machine) {
  if (params.path.empty()) {
    std::vector<evdev::InputDevice> there;
    for (const NumberedInput& one : inputs) {
      // One that is known to be another device does not matter, may it be read or not.
      if (one.device.layout != nullptr && one.device.name.find(params.name) != std::string::npos &&
          !number_of(machine.at(one.device.path)).empty()) {
        there.push_back(one.device);
      }
    }
    return evdev::choose_hand(there, params.name);
  }
  const std::string number = number_of(machine.at(params.path));
  const auto one = std::ranges::find(inputs, number, &NumberedInput::number);
  if (number.empty() || one == inputs.end()) {
    return tl::unexpected(fmt::format("{}: {}, allowed for evdev.path: one that `punctum devices` shows",
                                      params.path, number.empty() ? "no such device" : "is no input device"));
  }
  if (!one->device.refused.empty()) {
    return tl::unexpected(one->device.refused);
  }
  if (one->device.layout == nullptr) {
    return tl::unexpected(evdev::is_no_hand(one->device));
  }
  return one->device.path;
}

hal::Findings look_at_evdev(const Scene& scene, const Machine& machine, std::string_view) {
  const std::vector<NumberedInput> inputs = input_devices(machine);
  const auto path = hand_of(*scene.evdev, inputs, machine);
  if (!path) {
    return {{Is::missing, path.error()}};
  }
  const auto one =
      std::ranges::find(inputs, *path, [](const NumberedInput& input) { return input.device.path; });
  return {{Is::found, fmt::format("{} ({}, {})", *path, one->device.name, one->device.layout->name)}};
}

hal::Findings look_at_zaber(const Scene& scene, const Machine& machine, std::string_view) {
  return look_at_file(machine, scene.zaber->port, "zaber.port");
}

hal::Finding look_at_watchdog(const WatchdogParams& params, const Machine& machine) {
  std::error_code ec;
  if (!std::filesystem::is_character_file(machine.at(params.path), ec)) {
    return {Is::missing, params.path +
                             ": no watchdog is there, allowed for watchdog.path: one that `punctum devices` "
                             "shows (modprobe softdog gives one without hardware)"};
  }
  if (std::string remedy = remedy_for(machine.at(params.path), params.path); !remedy.empty()) {
    return {Is::missing, std::move(remedy)};
  }
  const auto folder = watchdog_folder(machine.at(params.path), machine.at("/sys"));
  for (const PluggedIn& one : watchdogs(machine)) {
    if (folder && one.place == "/dev/" + folder->filename().string()) {
      return {one.remedy.empty() ? Is::found : Is::missing,
              one.remedy.empty() ? fmt::format("{} ({})", params.path, one.what) : one.remedy};
    }
  }
  const auto may = may_be_armed(machine.at(params.path), machine.at("/sys"));
  return may ? hal::Finding{Is::found, params.path}
             : hal::Finding{Is::missing, params.path + ": " + may.error()};
}

hal::Findings look_at_browser(const Scene&, const Machine&, std::string_view) {
  return {{Is::found, "whoever takes the hand on the page of punctum-console"}};
}

}  // namespace

const std::vector<DeviceLook>& device_looks() {
  static const std::vector<DeviceLook> looks = {
      {kSimulated, look_at_simulated}, {kRecorded, look_at_recorded}, {kGpiod, look_at_gpiod},
      {kCia402, look_at_cia402},       {kV4l2, look_at_v4l2},         {kAravis, look_at_aravis},
      {kFalcon, look_at_falcon},       {kEvdev, look_at_evdev},       {kZaber, look_at_zaber},
      {kBrowser, look_at_browser},     {kHandle, look_at_handle}};
  return looks;
}

std::vector<DeviceFinding> look_at_devices(const Scene& scene, const Machine& machine) {
  std::vector<DeviceFinding> all;
  for (const NamedDevice& device : scene_devices()) {
    std::string backend = scene.devices.*device.backend;
    if (backend.empty() && device.table == "enabling" && scene.servo.enabling) {
      backend = kHandle;
    }
    if (backend.empty()) {
      continue;
    }
    const auto look = std::ranges::find(device_looks(), backend, &DeviceLook::backend);
    const hal::Findings findings = look != device_looks().end()
                                       ? look->look(scene, machine, device.table)
                                       : hal::Findings{{Is::note, "shows when it is opened"}};
    for (const hal::Finding& finding : findings) {
      all.push_back(
          {device.table,
           {finding.is, backend + (finding.line.empty() ? "" : ": ") + printable(finding.line, 1000)}});
    }
  }
  if (scene.watchdog) {
    all.push_back({"watchdog", look_at_watchdog(*scene.watchdog, machine)});
  }
  return all;
}

}  // namespace punctum::tools
