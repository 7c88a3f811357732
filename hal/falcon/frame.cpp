#include "hal/falcon/frame.hpp"

#include <algorithm>

namespace punctum::falcon {
namespace {

constexpr std::uint8_t kBegin = '<', kEnd = '>', kZero = 0x41;
constexpr std::size_t kFlags = 13, kSpare = 14;
constexpr std::uint8_t kAskHoming = 0x01;
constexpr unsigned kHomedShift = 4, kAllHomed = 0b111;
// Of the chip's second status byte: overrun, parity, framing.
constexpr unsigned kLineErrors = 0x0E;

bool may_stand_at(std::size_t place, std::uint8_t byte) {
  if (place == kFrameSize - 1) {
    return byte == kEnd;
  }
  const int largest = place < kFlags ? 0x0F : place == kFlags ? 0x7F : 0xFF - kZero;
  return byte >= kZero && byte <= kZero + largest;
}

}  // namespace

std::array<std::uint8_t, kFrameSize> command_frame(const Counts& motors, Light light) {
  std::array<std::uint8_t, kFrameSize> frame;
  frame.fill(kZero);
  frame.front() = kBegin;
  frame.back() = kEnd;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const auto bits = static_cast<std::uint16_t>(motors[i]);
    for (unsigned nibble = 0; nibble < 4; ++nibble) {
      frame[1 + 4 * i + nibble] = static_cast<std::uint8_t>(kZero + ((bits >> (4 * nibble)) & 0x0FU));
    }
  }
  frame[kFlags] = static_cast<std::uint8_t>(kZero + (kAskHoming | static_cast<std::uint8_t>(light)));
  frame[kSpare] = kZero;
  return frame;
}

std::optional<Reply> FrameReader::take(std::span<const std::uint8_t> packet) {
  if (packet.size() <= kStatusSize) {
    return std::nullopt;
  }
  if ((packet[1] & kLineErrors) != 0) {
    count(counts_.line_errors);
    restart();
    return std::nullopt;
  }
  std::optional<Reply> newest;
  for (const std::uint8_t byte : packet.subspan(kStatusSize)) {
    if (auto reply = take_byte(byte)) {
      newest = reply;
    }
  }
  return newest;
}

std::optional<Reply> FrameReader::take_byte(std::uint8_t byte) {
  if (size_ > 0 && !may_stand_at(size_, byte)) {
    count(counts_.malformed);
    size_ = 0;
  }
  if (size_ == 0 && byte != kBegin) {
    return std::nullopt;
  }
  frame_[size_++] = byte;
  if (size_ < kFrameSize) {
    return std::nullopt;
  }
  size_ = 0;
  count(counts_.frames);
  Reply reply;
  for (std::size_t i = 0; i < reply.encoders.size(); ++i) {
    unsigned bits = 0;
    for (unsigned nibble = 0; nibble < 4; ++nibble) {
      bits |= static_cast<unsigned>(frame_[1 + 4 * i + nibble] - kZero) << (4 * nibble);
    }
    reply.encoders[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(bits));
  }
  const auto flags = static_cast<unsigned>(frame_[kFlags] - kZero);
  reply.buttons = static_cast<std::uint8_t>(flags & 0x0FU);
  reply.homed = ((flags >> kHomedShift) & kAllHomed) == kAllHomed;
  return reply;
}

}  // namespace punctum::falcon
