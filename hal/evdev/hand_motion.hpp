// From the events of a mouse, a gamepad or a SpaceMouse to a hand: pure, so that it can be tested without a
// device.
//
// The counts of a mouse are ways, the deflection of a stick or a knob is a speed: hal/hand_follower.hpp makes
// the hand of them.
#pragma once

#include <linux/input.h>

#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/devices.hpp"
#include "hal/evdev/config.hpp"
#include "hal/hand_follower.hpp"
#include "hal/realtime.hpp"

namespace punctum::evdev {

// A set of codes of one type, as the kernel's ioctls fill it.
template <std::size_t Count>
struct Codes {
  std::array<std::uint8_t, (Count + 7) / 8> bits{};
  [[nodiscard]] bool has(std::size_t code) const NONBLOCKING {
    return code < Count && (bits[code / 8] >> (code % 8) & 1U) != 0;
  }
  void add(std::size_t code) NONBLOCKING {
    bits[code / 8] = static_cast<std::uint8_t>(bits[code / 8] | 1U << (code % 8));
  }
};
using Keys = Codes<KEY_CNT>;

// What a device says that it can do.
struct Abilities {
  Keys keys;
  Codes<REL_CNT> relative;
  Codes<ABS_CNT> absolute;
};

struct AxisOf {
  std::uint16_t code;
  double sign;  // in the hand's frame: x right, y up, z towards the operator
};
struct ButtonOf {
  std::uint16_t code;
  std::uint32_t button;  // hal::kButton...
};

enum class Counts : std::uint8_t {
  ways,         // EV_REL: how far it went since the last event
  deflections,  // EV_REL: how far it is from its middle, told again and again while it is
  positions,    // EV_ABS: how far it is from its middle, told when it changes
};

// One kind of device: which of its axes and buttons are which of the hand's.
struct Layout {
  const char* name;
  Counts counts;
  std::array<AxisOf, 3> axes;
  std::array<ButtonOf, 4> buttons;
};

// The kind of a device, null: none that can be a hand.
[[nodiscard]] const Layout* layout_of(const Abilities& abilities);

// Of an absolute axis.
struct Range {
  int min = -1;
  int max = 1;
};

class HandMotion {
 public:
  // A movement that waited for longer is not made late: the program was held up, and the hand is elsewhere.
  static constexpr std::int64_t kStale_ns = 50'000'000;
  // A knob that tells its deflection as counts: as many are full deflection, so often.
  static constexpr double kFullCounts = 350, kReports_1_s = 100;

  HandMotion(const EvdevParams& params, const Layout& layout, const std::array<Range, 3>& ranges)
      : params_(params), layout_(layout), ranges_(ranges), follower_(params.speed_m_s) {}

  // now_ns: on the clock of the event's own time.
  void take(const input_event& event, std::int64_t now_ns) NONBLOCKING;

  // Events were lost: what is held and deflected has to be asked for, and told by is().
  [[nodiscard]] bool wants_state() const NONBLOCKING { return wants_state_; }
  void is(const Keys& held, const std::array<int, 3>& positions) NONBLOCKING;

  // Where the hand is now; times go forward.
  [[nodiscard]] hal::HandState at(std::int64_t now_ns) NONBLOCKING;

 private:
  void take_key(std::uint16_t code, bool held) NONBLOCKING;
  void take_relative(std::uint16_t code, int value) NONBLOCKING;
  void deflect(std::size_t axis, int value) NONBLOCKING;
  [[nodiscard]] double beyond_dead_zone(double deflection) const NONBLOCKING;

  const EvdevParams params_;
  const Layout& layout_;
  const std::array<Range, 3> ranges_;
  hal::HandFollower follower_;
  std::uint32_t buttons_ = 0;
  bool losing_ = false;  // until the next report
  bool wants_state_ = false;
};

}  // namespace punctum::evdev
