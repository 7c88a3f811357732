// The force that the hand is to feel: the fades that switch it on and off, the sum of the scene's effects,
// and the passivity guard.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/realtime.hpp"
#include "rt/control/cell_observer.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/passivity.hpp"
#include "rt/control/task.hpp"
#include "rt/forces/effects.hpp"

namespace punctum::rt {

struct RenderInput {
  double dt_s = 0;
  bool last_running = true;  // no stop was latched on the last tick
  bool coupled = false;      // hand and needle
  bool ending = false;
  hal::Vec3 hand_velocity_m_s = hal::Vec3::Zero();  // device frame
  hal::Vec3 hand_point_m = hal::Vec3::Zero();       // the hand at needle scale
  hal::Vec3 needle_axis = -hal::Vec3::UnitX();      // as commanded
  double position_scale = 500;
  double commanded_scale = 1;
  const EffectGains* reduced_effects = nullptr;  // their gains, unless all are full
};

class Rendering {
 public:
  explicit Rendering(const ServoConfig& config) NONBLOCKING;

  // World axes.
  const EffectSum& sum_effects(const RenderInput& in, const Readings& readings, const CellFacts& cell,
                               const TaskFacts& task) NONBLOCKING;
  // The force that gives the hand no more energy than the effects store; without a guard, all of it as long
  // as the hand tells where it is.
  [[nodiscard]] hal::Vec3 keep_passive(const EffectSum& sum, const Readings& readings, double elapsed_s)
      NONBLOCKING;
  // What was written to the hand, device frame.
  void wrote(const hal::Vec3& force_N) NONBLOCKING;

  void restart() NONBLOCKING { force_fade_.set(0); }  // the force returns by a ramp

  [[nodiscard]] bool faded() const NONBLOCKING { return force_fade_.at() == 0; }
  [[nodiscard]] bool needle_faded() const NONBLOCKING { return needle_fade_.at() == 0; }
  [[nodiscard]] double guard_N() const NONBLOCKING { return guard_N_; }  // what the guard changed
  [[nodiscard]] const std::optional<Membrane>& membrane() const NONBLOCKING { return effects_.membrane(); }
  // The needle's force by the membrane law; 0 if the scene has none.
  [[nodiscard]] double tip_force_N() const NONBLOCKING {
    return effects_.membrane() ? effects_.membrane()->state().force_N : 0;
  }
  [[nodiscard]] const EffectSum& sum() const NONBLOCKING { return effects_.sum(); }
  [[nodiscard]] std::uint32_t alarms() const NONBLOCKING { return alarms_; }

 private:
  double return_s_;
  Effects effects_;
  std::optional<PassivityGuard> guard_;
  Ramp force_fade_;   // of every force
  Ramp needle_fade_;  // of the forces that belong to the needle: off while the clutch is pressed
  double guard_N_ = 0;
  std::uint32_t alarms_ = 0;
};

}  // namespace punctum::rt
