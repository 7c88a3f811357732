// The electronic data sheet of a CANopen device (CiA 306): its object dictionary as a text that masters read.
#pragma once

#include <cstdint>
#include <string>

#include "tools/emulators/drive/object_dictionary.hpp"

namespace punctum::emulator {

struct EdsDevice {
  int node = 1;  // that the dictionary has; the sheet is that of any
  std::uint32_t vendor_id = 0, product_code = 0;
  std::string product;
};

// The present values are told as the defaults.
[[nodiscard]] std::string eds(const ObjectDictionary& objects, const EdsDevice& device);

}  // namespace punctum::emulator
