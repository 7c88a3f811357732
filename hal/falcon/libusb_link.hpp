// A Falcon behind libusb. Everything is allocated when it is opened; one transfer in is always queued.
#pragma once

#include <memory>

#include "hal/devices.hpp"
#include "hal/falcon/usb_link.hpp"

namespace punctum::falcon {

// The first Falcon that is plugged in. clock: the station's, on which packets are dated.
[[nodiscard]] std::unique_ptr<UsbLink> libusb_link(const hal::Clock& clock);

}  // namespace punctum::falcon
