// The passivity guard: whatever the force effects ask for, the handle is given no more energy than they
// store.
//
// A force held over a period and applied late turns a spring into a spring with a negative damper,
// -K (T/2 + t_d). Three means against it, weakest first:
//   compensation  a damper of kCompensation K (T/2 + t_d) beside every spring, bounded by what the device can
//                 render;
//   observer      the work of the last interval is exactly f (x_k - x_{k-1}), f the force that really acted
//                 (Hannaford & Ryu 2002). What it exceeds the change of stored energy by, and a quantised
//                 position cannot explain, is surplus; a bounded damper takes it back;
//   stiffness     a gain on the storing effects, lowered at once to the device's passive stiffness (Colgate &
//                 Schenkel) at the period that is really kept, and further while the handle is given surplus
//                 that the damper cannot take; it recovers slowly.
// Dissipative effects are scaled down where the device cannot render them. Nothing is banked: dissipation is
// forgotten within kForget_s, so no credit winds up however long it runs.
//
// Real-time safe. One frame for positions, velocities and forces. A saturated or late force counts as it
// acted: see wrote().
#pragma once

#include <array>
#include <cstddef>

#include "hal/devices.hpp"
#include "rt/control/config.hpp"
#include "rt/forces/velocity.hpp"

namespace punctum::rt {

// Effects that store energy as one point moves: `force_N` at the hand, `point_m` at the hand's scale. The
// fixtures' point is the handle behind the clutch and the limits, the membrane's is the needle, which follows
// it late, and that of friction's bristle is the handle itself.
struct Storing {
  hal::Vec3 force_N = hal::Vec3::Zero();
  hal::Vec3 point_m = hal::Vec3::Zero();
};

// What the effects of one tick ask for, at the hand.
struct GuardInput {
  hal::Vec3 position_m = hal::Vec3::Zero();  // of the handle, as its encoders say
  std::array<Storing, 3> storing;
  hal::Vec3 dissipative_N = hal::Vec3::Zero();  // of a velocity
  hal::Vec3 active_N = hal::Vec3::Zero();       // a cue with a bounded energy of its own
  double stiffness_N_m = 0;                     // bound of the storing effects' stiffness
  double damping_Ns_m = 0;                      // bound of the dissipative effects' damping
  double elapsed_s = 0;                         // since the last step

  [[nodiscard]] hal::Vec3 stored_N() const noexcept {
    return storing[0].force_N + storing[1].force_N + storing[2].force_N;
  }
  [[nodiscard]] hal::Vec3 wanted_N() const noexcept { return stored_N() + dissipative_N + active_N; }
};

class PassivityGuard {
 public:
  // velocity: as the scene says, of what the dissipative effects get.
  PassivityGuard(const GuardParams& params, const HandDevice& device, const VelocityParams& velocity,
                 double rate_Hz) noexcept;

  // The force to render. Input that is not finite passes through as it is and changes nothing here.
  [[nodiscard]] hal::Vec3 step(const GuardInput& in) noexcept;

  // After step(): what was written to the device, saturation and a stop included.
  void wrote(const hal::Vec3& force_N) noexcept;

  [[nodiscard]] double gain() const noexcept { return gain_; }  // on the storing effects, 0 .. 1
  [[nodiscard]] double damper_Ns_m() const noexcept { return damper_Ns_m_; }
  [[nodiscard]] const hal::Vec3& damper_N() const noexcept { return damper_N_; }
  [[nodiscard]] double surplus_J() const noexcept { return surplus_J_; }

 private:
  static constexpr std::size_t kRing = 8;  // written forces; more than the longest delay

  void follow_period(double elapsed_s) noexcept;
  [[nodiscard]] double allowed_stiffness_N_m() const noexcept;
  [[nodiscard]] double delay_s() const noexcept;  // of hold and transport
  [[nodiscard]] double real_J(const GuardInput& in) const noexcept;
  void observe(const GuardInput& in) noexcept;

  GuardParams params_;
  HandDevice device_;
  double T_s_;
  VelocityParams own_;  // of the guard's own velocity
  Kalman velocity_;
  double own_stable_Ns_m_;
  double stable_Ns_m_;   // damping that the device renders of the effects' velocity
  double in_phase_N_m_;  // stiffness whose motion that velocity follows
  double reserved_s_;    // period that is really kept, with some reserve
  double kept_s_;        // follows it without a step
  double mean_s_;        // its time-weighted mean

  bool first_ = true;
  hal::Vec3 position_m_ = hal::Vec3::Zero();
  std::array<Storing, 3> stored_;  // as rendered on the last step
  hal::Vec3 active_N_ = hal::Vec3::Zero();
  hal::Vec3 acted_N_ = hal::Vec3::Zero();  // over the interval before the last
  std::array<hal::Vec3, kRing> written_N_;
  std::size_t newest_ = 0;

  double surplus_J_ = 0;
  double given_J_ = 0;       // work on the handle, forgotten within kForget_s
  double late_J_ = 0;        // of intervals that were much too long, until the damper has taken it
  double stiff_gain_ = 1;    // for the passive stiffness
  double surplus_gain_ = 1;  // for surplus that stays
  double gain_ = 1;
  double taking_Ns_m_ = 0;  // the damper's part against surplus
  double damper_Ns_m_ = 0;
  hal::Vec3 damper_N_ = hal::Vec3::Zero();
};

}  // namespace punctum::rt
