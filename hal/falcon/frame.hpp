// The frames of 16 bytes that a Falcon and its host exchange, and what of them arrives in USB packets.
//
// '<', three signed 16-bit numbers of four nibbles each, least significant first, a byte of flags, a byte
// without meaning, '>'. A nibble n is sent as 0x41 + n.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/falcon/kinematics.hpp"

namespace punctum::falcon {

inline constexpr std::size_t kFrameSize = 16;
inline constexpr std::size_t kPacketSize = 64;  // of both bulk endpoints
inline constexpr std::size_t kStatusSize = 2;   // of the FTDI chip, at the beginning of each packet

enum class Light : std::uint8_t { none = 0, green = 0x02, blue = 0x04, red = 0x08 };

// Homing is asked for in every frame: it makes an arm find its mark when it next passes it.
[[nodiscard]] std::array<std::uint8_t, kFrameSize> command_frame(const Counts& motors, Light light);

struct Reply {
  Counts encoders{};
  std::uint8_t buttons = 0;  // four bits
  bool homed = false;        // all three arms
};

// Counters stop at their largest value.
inline void count(std::uint32_t& counter) { counter += counter < UINT32_MAX ? 1 : 0; }

struct FrameCounts {
  std::uint32_t frames = 0;
  std::uint32_t malformed = 0;    // began, and were none
  std::uint32_t line_errors = 0;  // packets that the chip itself calls damaged
};

// Frames out of a stream of packets. A frame may come in pieces, and a packet may hold several or none.
class FrameReader {
 public:
  // The last whole frame of this packet.
  std::optional<Reply> take(std::span<const std::uint8_t> packet);
  void restart() { size_ = 0; }  // what was begun does not count
  [[nodiscard]] const FrameCounts& counts() const { return counts_; }

 private:
  [[nodiscard]] std::optional<Reply> take_byte(std::uint8_t byte);

  std::array<std::uint8_t, kFrameSize> frame_{};
  std::size_t size_ = 0;
  FrameCounts counts_;
};

}  // namespace punctum::falcon
