// Lies told about what vision saw (hal/sim/failures.hpp), between whoever observes and the slot: the device
// "vision" of a simulated station.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/sim/bench.hpp"
#include "hal/sim/failures.hpp"
#include "rt/station/observation.hpp"

namespace punctum::rt {

// Found by its argument: the channels of an observation.
[[nodiscard]] inline sim::Field field_of(Observation& o, sim::Channel channel) NONBLOCKING {
  sim::Field f;
  const auto numbers = [&f](double* first, int count) {
    f.number = first;
    f.numbers = count;
  };
  const auto bit = [&f, &o](std::uint32_t which) {
    f.word = &o.flags;
    f.bit = which;
  };
  switch (channel) {
    case sim::Channel::time:
      f.time_ns = &o.exposure_ns;
      break;
    case sim::Channel::position:
      numbers(o.tip_m, 3);
      break;
    case sim::Channel::axis:
      numbers(o.axis, 3);
      break;
    case sim::Channel::centre:
    case sim::Channel::cell:
      numbers(o.centre_m, 3);
      break;
    case sim::Channel::radius:
      numbers(&o.R_m, 1);
      break;
    case sim::Channel::entry:
      numbers(o.entry_m, 3);
      break;
    case sim::Channel::gap:
      numbers(&o.gap_m, 1);
      break;
    case sim::Channel::dimple_depth:
      numbers(&o.wd_m, 1);
      break;
    case sim::Channel::dimple_width:
      numbers(&o.a_m, 1);
      break;
    case sim::Channel::membrane_velocity:
      numbers(&o.membrane_velocity_m_s, 1);
      break;
    case sim::Channel::contact:
      bit(Observation::contact);
      break;
    case sim::Channel::punctured:
      bit(Observation::punctured);
      break;
    case sim::Channel::inner_punctured:
      bit(Observation::inner_punctured);
      break;
    default:
      break;
  }
  return f;
}

}  // namespace punctum::rt

namespace punctum::tools {

class VisionLiar {
 public:
  explicit VisionLiar(std::uint64_t seed) : liar_(seed, sim::Device::vision) {}

  // What vision says in place of the truth; nothing = no observation of this frame. `seen`: of the exposure.
  // A wrong entry changes the gap with it, a wrong cell both, and a repeated observation has the number of
  // the new frame unless its time is repeated too.
  [[nodiscard]] std::optional<rt::Observation> tell(const sim::Snapshot& seen, const rt::Observation& truth) {
    const sim::Failing& failing = seen.failure[static_cast<std::size_t>(sim::Device::vision)];
    rt::Observation told;
    if (liar_.tell(failing, truth, told) != hal::Status::ok) {
      return std::nullopt;
    }
    if (failing.channel == sim::Channel::all) {
      told.frame = truth.frame;
    }
    if (failing.channel == sim::Channel::cell) {
      for (int i = 0; i < 3; ++i) {
        told.entry_m[i] += told.centre_m[i] - truth.centre_m[i];
      }
    }
    if (failing.channel == sim::Channel::entry || failing.channel == sim::Channel::cell) {
      for (int i = 0; i < 3; ++i) {
        told.gap_m += (told.entry_m[i] - truth.entry_m[i]) * truth.axis[i];
      }
    }
    return told;
  }

 private:
  sim::Liar<rt::Observation> liar_;
};

}  // namespace punctum::tools
