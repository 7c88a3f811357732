#include "hal/evdev/which_hand.hpp"

namespace punctum::evdev {

tl::expected<std::string, std::string> choose_hand(const std::vector<InputDevice>& devices,
                                                   const std::string& part) {
  std::vector<std::string> found;
  std::string list, refused;
  for (const InputDevice& device : devices) {
    if (!device.refused.empty()) {
      refused = refused.empty() ? device.refused : refused;
    } else if (device.layout != nullptr && device.name.find(part) != std::string::npos) {
      found.push_back(device.path);
      list += (list.empty() ? "" : ", ") + device.path + " (" + device.name + ")";
    }
  }
  if (found.size() == 1) {
    return found.front();
  }
  if (!found.empty()) {
    return tl::unexpected("several devices can be the hand: " + list +
                          ", allowed: one of them as evdev.path");
  }
  if (!refused.empty()) {
    return tl::unexpected(refused);
  }
  return tl::unexpected("no mouse, gamepad or SpaceMouse" + (part.empty() ? "" : " called \"" + part + "\"") +
                        " in /dev/input, allowed: plug one in, or say which in evdev.path");
}

std::string is_no_hand(const InputDevice& device) {
  return device.path + ": \"" + device.name + "\" is neither a mouse, a gamepad nor a SpaceMouse";
}

}  // namespace punctum::evdev
