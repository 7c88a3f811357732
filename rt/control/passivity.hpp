// The passivity guard: whatever the force effects ask for, the handle is given no more energy than they
// store.
//
// A force held over a period and applied late turns a spring into a spring with a negative damper,
// -K (T/2 + t_d). There are three remedies, the weakest first:
//   compensation  a damper of K (T/2 + t_d) beside every spring, of twice that above 10 Hz, bounded by what
//                 the device can render;
//   observer      the work of the last interval is exactly f (x_k - x_{k-1}), f the force that really acted
//                 (Hannaford & Ryu 2002). What it exceeds the change of stored energy by, and a quantised
//                 position cannot explain, is surplus; a bounded damper takes it back;
//   stiffness     a gain on the storing effects, lowered at once to the device's passive stiffness (Colgate &
//                 Schenkel) at the period that is really kept, and further while the handle is given surplus
//                 that the damper cannot take; it recovers slowly.
// These see what hold, delay and a late needle add. Above them stands the net account, for any cause: effects
// that move, change, come and go. It holds the work that the handle has put in and not got back, never more
// than what the effects store. Below zero the handle has got more than it gave: the damper takes that back,
// and where it cannot, the gain falls to nothing as the account comes to -kAllowed_J. So over any window of
// time the work on the handle is at most what was stored when it began, kAllowed_J, kAllowed_W over its
// length and what one force does over hold and delay. Active effects (vibration) have an account of their
// own. Dissipative effects are scaled down where the device cannot render them. Nothing is banked:
// dissipation is forgotten within kForget_s, so no credit winds up however long it runs.
//
// A hand that is silent may be anywhere: the force fades between the second and the fourth period of its
// samples, and no velocity over a longer gap is rendered.
//
// A hand that is sampled more slowly than the ticks is judged per sample: of the forces written between two
// samples the mean acted on the motion between them, and hold and damping follow the samples' period.
//
// Real-time safe. One frame for positions, velocities and forces. A saturated or late force counts as it
// acted: see wrote().
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "hal/devices.hpp"
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/control/device_limits.hpp"
#include "rt/control/velocity.hpp"
#include "rt/forces/effect.hpp"

namespace punctum::rt {

// The passivity guard, passivity.hpp.
struct GuardParams {
  double margin = 0.9;   // of the device's passive stiffness: what may be rendered
  double recover_s = 2;  // a lowered stiffness returns over this
};
constexpr auto keys_of(const GuardParams*) {
  return hal::keys(hal::real("margin", &GuardParams::margin, 0.1, 0.95),
                   hal::real("recover_s", &GuardParams::recover_s, 0.1, 60));
}

// The handle on one tick.
struct HandMotion {
  hal::Vec3 position_m = hal::Vec3::Zero();  // of the handle, as its encoders read
  double elapsed_s = 0;                      // since the last step
  bool fresh = true;                         // the position is a new sample
  double between_s = 0;  // between the two newest samples; 0: not known, the time of the ticks counts
  double age_s = 0;      // of the position
  bool begins = false;   // it has nothing to do with the one before: no motion lies between them
  bool leaps = false;    // it tells nothing of a velocity
};

// What the effects of one tick ask for, at the hand.
struct GuardInput : ForceParts, HandMotion {};

// What is left of a force that a position of this age asks for, 1 .. 0.
[[nodiscard]] double left_of_force(double age_s, double sample_s) NONBLOCKING;
// A device that samples more slowly renders no wall.
inline constexpr double kSlowestSample_s = 1.0 / 250;

class PassivityGuard {
 public:
  static constexpr double kAllowed_J = 2e-3;  // 0.2 N over 10 mm; a handle of 75 g gets 0.23 m/s at most
  static constexpr double kAllowed_W = 2e-3;  // a fifth of what a hand gives that presses 0.5 N at 20 mm/s
  static constexpr double kActive_J = 1e-3;   // of active effects: 20 bursts of a vibration at its default
  static constexpr double kActive_W = 1e-3;   // and as many each second

  // velocity: of the scene, the estimate that the dissipative effects get. slew_N_s: a limit behind the guard
  // lets the force change no faster.
  PassivityGuard(const GuardParams& params, const HandDevice& device, const VelocityParams& velocity,
                 double rate_Hz, double slew_N_s = std::numeric_limits<double>::infinity()) NONBLOCKING;

  // The force to render. Input that is not finite passes through as it is and changes nothing here.
  [[nodiscard]] hal::Vec3 step(const ForceParts& parts, const HandMotion& hand) NONBLOCKING;
  [[nodiscard]] hal::Vec3 step(const GuardInput& in) NONBLOCKING { return step(in, in); }

  // After step(): what was written to the device, saturation and a stop included.
  void wrote(const hal::Vec3& force_N) NONBLOCKING;

  [[nodiscard]] double gain() const NONBLOCKING { return gain_; }  // on the storing effects, 0 .. 1
  [[nodiscard]] double damper_Ns_m() const NONBLOCKING { return damper_Ns_m_; }
  [[nodiscard]] const hal::Vec3& damper_N() const NONBLOCKING { return damper_N_; }
  [[nodiscard]] double surplus_J() const NONBLOCKING { return surplus_J_; }
  [[nodiscard]] double net_J() const NONBLOCKING { return net_J_; }

 private:
  static constexpr std::size_t kRing = 8;  // written forces; more than the longest delay

  // A period that is really kept, with some reserve.
  class Period {
   public:
    explicit Period(double nominal_s) NONBLOCKING;
    void follow(double interval_s, double recover_s) NONBLOCKING;
    [[nodiscard]] double kept_s() const NONBLOCKING { return kept_s_; }

   private:
    double nominal_s_;
    double mean_s_;      // time-weighted
    double reserved_s_;  // steps with the mean
    double kept_s_;      // follows it without a step
    std::array<double, 4> last_s_;
    std::size_t newest_ = 0;
  };

  // Forces over an interval: of the passive part, and of the active effects.
  struct Forces {
    hal::Vec3 passive_N = hal::Vec3::Zero();
    hal::Vec3 active_N = hal::Vec3::Zero();
    double stored_J = 0;  // by the effects as rendered
  };

  // A coordinate since it stepped last.
  struct Way {
    double at_m = 0;  // then
    double since_s = 0;
    double acted_N = 0;  // lately
    double samples = 0;
  };

  // The input of one tick, and what several of the steps below take of it.
  struct Input {
    const ForceParts& parts;
    const HandMotion& hand;
    hal::Vec3 stored_N;
    double wanted_N;       // length of stored_N
    double stiffness_N_m;  // not negative
    double delay_s;        // of hold and transport
    double passive_N_m;    // stiffness that is passive with this delay
    double on_time;        // nominal period over the one that the samples keep
  };
  [[nodiscard]] Input input(const ForceParts& parts, const HandMotion& hand) const NONBLOCKING;

  [[nodiscard]] double regular_s() const NONBLOCKING;
  [[nodiscard]] double transport_s() const NONBLOCKING;
  [[nodiscard]] double real_J(const Input& in) const NONBLOCKING;
  void lower_gain(const Input& in) NONBLOCKING;
  void forget_interval() NONBLOCKING;
  void observe_tick(const Input& in) NONBLOCKING;
  void observe_sample(const Input& in) NONBLOCKING;
  void account(const Input& in, const hal::Vec3& moved_m, const hal::Vec3& acted_N) NONBLOCKING;
  void follow_motion(const HandMotion& hand, double between_s) NONBLOCKING;
  void damp(const Input& in, double share) NONBLOCKING;

  GuardParams params_;
  HandDevice device_;
  double T_s_;
  double slew_N_s_;
  VelocityParams own_;  // of the guard's own velocity
  Kalman velocity_;
  double own_stable_Ns_m_;
  double stable_Ns_m_;   // damping that the device renders of the effects' velocity
  double in_phase_N_m_;  // stiffness whose motion that velocity follows
  Period tick_;
  Period sample_;

  bool first_ = true;
  bool gap_ = false;                          // samples were missed before the last one, or it leapt
  hal::Vec3 position_m_ = hal::Vec3::Zero();  // the last sample
  hal::Vec3 moved_m_ = hal::Vec3::Zero();     // to it
  std::array<StoringForce, kEnergyPoints> last_storing_;  // as rendered on the last step
  std::array<Forces, kRing> written_;
  std::size_t newest_ = 0;
  Forces asked_;                           // on the last step
  hal::Vec3 acted_N_ = hal::Vec3::Zero();  // mean over the samples' interval before the last
  std::array<Way, 3> way_;                 // of each coordinate

  // Since the last sample.
  double since_s_ = 0;
  Forces acted_Ns_;        // over its time
  double taken_up_J_ = 0;  // by the storing effects

  double surplus_J_ = 0;
  double given_J_ = 0;       // work on the handle, forgotten within kForget_s
  double late_J_ = 0;        // of intervals that were much too long, until the damper has taken it
  double net_J_ = 0;         // the net account
  double active_J_ = 0;      // that of the active effects
  double stiff_gain_ = 1;    // for the passive stiffness
  double surplus_gain_ = 1;  // for surplus that stays
  double net_gain_ = 1;      // for the net account
  double gain_ = 1;
  double active_gain_ = 1;
  hal::Vec3 v_m_s_ = hal::Vec3::Zero();     // of the handle
  hal::Vec3 slow_m_s_ = hal::Vec3::Zero();  // of the hand's own motion
  double braked_m_s2_ = 0;
  double taking_Ns_m_ = 0;  // the damper's part against surplus
  double damper_Ns_m_ = 0;
  hal::Vec3 damper_N_ = hal::Vec3::Zero();
};

}  // namespace punctum::rt
