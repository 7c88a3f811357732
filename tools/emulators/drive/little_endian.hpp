// Numbers in CANopen messages.
#pragma once

#include <cstdint>

namespace punctum::emulator {

[[nodiscard]] inline std::uint32_t word(const std::uint8_t* data, int bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < bytes; ++i) {
    value |= static_cast<std::uint32_t>(data[i]) << 8 * i;
  }
  return value;
}
inline void put(std::uint8_t* data, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) {
    data[i] = static_cast<std::uint8_t>(value >> 8 * i);
  }
}

}  // namespace punctum::emulator
