// Which input device of Linux is the hand, and why another one is not: decided from what is known of the
// devices, so that a run, which opens them, and a look, which does not, say the same.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/evdev/hand_motion.hpp"

namespace punctum::evdev {

struct InputDevice {
  std::string path;                // such as /dev/input/event5
  std::string name;                // what the kernel calls it
  const Layout* layout = nullptr;  // null: none that can be a hand
  std::string refused;             // why this user may not read it; empty: the user may
};

// Where no path says which: the path of the only one that may be read, can be a hand, and has this part in
// its name.
[[nodiscard]] tl::expected<std::string, std::string> choose_hand(const std::vector<InputDevice>& devices,
                                                                 const std::string& part);

// Of a device that cannot be a hand.
[[nodiscard]] std::string is_no_hand(const InputDevice& device);

}  // namespace punctum::evdev
