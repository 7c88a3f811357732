// Any events, to a mouse, a gamepad and both kinds of knob: the hand stays continuous and within reach.
#include <cstdint>
#include <cstring>

#include "hal/evdev/hand_motion.hpp"
#include "tests/fuzz/must.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace punctum;
  evdev::Abilities all;
  all.relative.bits.fill(0xFF);
  all.keys.bits.fill(0xFF);
  all.absolute.bits.fill(0xFF);
  evdev::Abilities relative = all, pad = all, mouse = all;
  relative.absolute.bits.fill(0);
  pad.keys = {};
  for (const int code : {BTN_SOUTH, BTN_TR, BTN_TL}) {
    pad.keys.add(static_cast<std::size_t>(code));
  }
  pad.relative.bits.fill(0);
  pad.absolute = {};
  for (const int code : {ABS_X, ABS_Y, ABS_RY}) {
    pad.absolute.add(static_cast<std::size_t>(code));
  }
  mouse.absolute.bits.fill(0);
  mouse.relative = {};
  mouse.relative.add(REL_X);
  mouse.relative.add(REL_Y);
  mouse.relative.add(REL_WHEEL);
  const evdev::EvdevParams params;
  for (const evdev::Abilities* of : {&all, &relative, &pad, &mouse}) {
    const evdev::Layout* const layout = evdev::layout_of(*of);
    evdev::HandMotion motion(params, *layout, {evdev::Range{-350, 350}, {0, 255}, {-32768, 32767}});
    std::int64_t now_ns = 0;
    hal::Vec3 before_m = motion.at(now_ns).position_m;
    for (std::size_t at = 0; at + 6 <= size; at += 6) {
      input_event event{};
      event.type = data[at] % 8;
      event.code = static_cast<std::uint16_t>(data[at + 1] + (event.type == EV_KEY ? BTN_MISC : 0));
      std::memcpy(&event.value, data + at + 2, sizeof(event.value));
      event.input_event_sec = 0;
      motion.take(event, now_ns);
      if (motion.wants_state()) {
        motion.is({}, {event.value, data[at], data[at + 1]});
      }
      now_ns += 1'000'000;
      const hal::HandState state = motion.at(now_ns);
      must(state.position_m.allFinite() &&
               state.position_m.cwiseAbs().maxCoeff() <= hal::HandFollower::kReach_m &&
               (state.position_m - before_m).norm() <= params.speed_m_s * 1.001e-3,
           "the hand leaps");
      before_m = state.position_m;
    }
  }
  return 0;
}
