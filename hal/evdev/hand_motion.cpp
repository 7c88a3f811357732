#include "hal/evdev/hand_motion.hpp"

#include <algorithm>
#include <cmath>

namespace punctum::evdev {
namespace {

// As the kernel's drivers report them: Documentation/input/gamepad.rst; a mouse counts towards the operator,
// a knob towards the operator (y) and down (z).
constexpr Layout kLayouts[] = {
    {"SpaceMouse",
     Counts::positions,
     {{{ABS_X, 1}, {ABS_Z, -1}, {ABS_Y, 1}}},
     {{{BTN_0, hal::kButtonEnable},
       {BTN_1, hal::kButtonInject},
       {BTN_2, hal::kButtonClutch},
       {BTN_3, hal::kButtonNextCell}}}},
    {"SpaceMouse",
     Counts::deflections,
     {{{REL_X, 1}, {REL_Z, -1}, {REL_Y, 1}}},
     {{{BTN_0, hal::kButtonEnable},
       {BTN_1, hal::kButtonInject},
       {BTN_2, hal::kButtonClutch},
       {BTN_3, hal::kButtonNextCell}}}},
    {"gamepad",
     Counts::positions,
     {{{ABS_X, 1}, {ABS_Y, -1}, {ABS_RY, -1}}},
     {{{BTN_TR, hal::kButtonEnable},
       {BTN_SOUTH, hal::kButtonInject},
       {BTN_TL, hal::kButtonClutch},
       {BTN_NORTH, hal::kButtonNextCell}}}},
    {"mouse",
     Counts::ways,
     {{{REL_X, 1}, {REL_Y, -1}, {REL_WHEEL, 1}}},
     {{{BTN_LEFT, hal::kButtonEnable},
       {BTN_RIGHT, hal::kButtonInject},
       {BTN_MIDDLE, hal::kButtonClutch},
       {BTN_SIDE, hal::kButtonNextCell}}}},
};

// The third axis of a mouse and the third and fourth button of any device may be missing.
bool fits(const Layout& layout, const Abilities& abilities) {
  const auto has_axis = [&](std::uint16_t code) {
    return layout.counts == Counts::positions ? abilities.absolute.has(code) : abilities.relative.has(code);
  };
  const std::size_t axes = layout.counts == Counts::ways ? 2 : 3;
  return std::all_of(layout.axes.begin(), layout.axes.begin() + axes,
                     [&](const AxisOf& axis) { return has_axis(axis.code); }) &&
         abilities.keys.has(layout.buttons[0].code) && abilities.keys.has(layout.buttons[1].code);
}

std::int64_t time_of(const input_event& event) NONBLOCKING {
  return static_cast<std::int64_t>(event.input_event_sec) * 1'000'000'000 +
         static_cast<std::int64_t>(event.input_event_usec) * 1'000;
}

}  // namespace

const Layout* layout_of(const Abilities& abilities) {
  const auto* found = std::find_if(std::begin(kLayouts), std::end(kLayouts),
                                   [&](const Layout& layout) { return fits(layout, abilities); });
  return found == std::end(kLayouts) ? nullptr : found;
}

void HandMotion::take(const input_event& event, std::int64_t now_ns) NONBLOCKING {
  if (event.type == EV_SYN && event.code == SYN_DROPPED) {
    losing_ = true;
    return;
  }
  if (losing_) {
    if (event.type == EV_SYN && event.code == SYN_REPORT) {
      losing_ = false;
      wants_state_ = true;
    }
    return;
  }
  switch (event.type) {
    case EV_KEY:
      take_key(event.code, event.value != 0);
      break;
    case EV_REL:
      if (now_ns - time_of(event) <= kStale_ns) {
        take_relative(event.code, event.value);
      }
      break;
    case EV_ABS:
      for (std::size_t i = 0; i < layout_.axes.size(); ++i) {
        if (layout_.counts == Counts::positions && layout_.axes[i].code == event.code) {
          deflect(i, event.value);
        }
      }
      break;
    default:
      break;
  }
}

void HandMotion::is(const Keys& held, const std::array<int, 3>& positions) NONBLOCKING {
  wants_state_ = false;
  for (const ButtonOf& button : layout_.buttons) {
    take_key(button.code, held.has(button.code));
  }
  if (layout_.counts == Counts::positions) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
      deflect(i, positions[i]);
    }
  }
}

void HandMotion::take_key(std::uint16_t code, bool held) NONBLOCKING {
  for (const ButtonOf& button : layout_.buttons) {
    if (button.code == code) {
      buttons_ = held ? buttons_ | button.button : buttons_ & ~button.button;
    }
  }
}

void HandMotion::take_relative(std::uint16_t code, int value) NONBLOCKING {
  for (std::size_t i = 0; i < layout_.axes.size(); ++i) {
    const AxisOf& axis = layout_.axes[i];
    if (layout_.counts == Counts::positions || axis.code != code) {
      continue;
    }
    double way_m = value * (code == REL_WHEEL ? params_.wheel_m : params_.count_m);
    if (layout_.counts == Counts::deflections) {
      way_m = beyond_dead_zone(value / kFullCounts) * params_.speed_m_s / kReports_1_s;
    }
    follower_.move(i, axis.sign * way_m);
  }
}

void HandMotion::deflect(std::size_t axis, int value) NONBLOCKING {
  const double min = ranges_[axis].min, max = ranges_[axis].max;
  const double deflection = (2.0 * value - min - max) / (max - min);
  follower_.steer(axis, layout_.axes[axis].sign * beyond_dead_zone(deflection) * params_.speed_m_s);
}

// From -1 to 1, finer near the middle.
double HandMotion::beyond_dead_zone(double deflection) const NONBLOCKING {
  const double beyond = std::abs(deflection) - params_.dead_zone;
  if (!(beyond > 0)) {
    return 0;
  }
  const double part = std::min(beyond / (1 - params_.dead_zone), 1.0);
  return deflection < 0 ? -part * part : part * part;
}

hal::HandState HandMotion::at(std::int64_t now_ns) NONBLOCKING {
  hal::HandState state;
  state.position_m = follower_.at(now_ns);
  state.buttons = buttons_;
  state.sample_ns = now_ns;
  return state;
}

}  // namespace punctum::evdev
