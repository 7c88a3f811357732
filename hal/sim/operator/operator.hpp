// The simulated operator. The operator looks at the picture, judges where the tip is, and moves the intended
// hand position; the arm and the haptic device (hand.hpp) turn that into a motion of the handle.
//
// The operator wants the tip to follow a path in the picture: a minimum-jerk approach to a point before the
// membrane, a push at steady speed until the membrane is seen to give way, the rest of the depth, the dwell
// with the injection button down, and the withdrawal. The hand moves by that path and is corrected by what
// was seen a moment ago, so scale, clutch and registration do not matter. Sideways the operator gives way to
// a guiding force and tolerates an error smaller than an eye can judge. Tremor of 8 to 12 Hz and a slow drift
// are added. When the needle does not follow, the operator stops, and after a second draws back and starts
// over.
#pragma once

#include <array>
#include <cstdint>

#include "hal/math/elementary.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/noise.hpp"
#include "hal/sim/point.hpp"

namespace punctum::sim {

// s(x) = 10 x^3 - 15 x^4 + 6 x^5, clamped to [0, 1] (Flash & Hogan 1985), and its derivative.
[[nodiscard]] double minimum_jerk(double x) NONBLOCKING;
[[nodiscard]] double minimum_jerk_rate(double x) NONBLOCKING;

// Sinusoids, computed together.
struct Waves {
  static constexpr std::size_t kCount = math::kTogether;
  using Each = std::array<double, kCount>;
  Each omega{}, phase{}, amplitude{};
  Each taken_off{};  // of each sine

  [[nodiscard]] Each at(double t_s) const NONBLOCKING {
    Each x;
    for (std::size_t i = 0; i < kCount; ++i) {
      x[i] = omega[i] * t_s + phase[i];
    }
    math::sines(x);
    for (std::size_t i = 0; i < kCount; ++i) {
      x[i] = amplitude[i] * (x[i] - taken_off[i]);
    }
    return x;
  }
};

// Tremor of 8 to 12 Hz: a sum of sinusoids. Their amplitudes are divided by the gain of the arm, so that a
// handle without friction shakes by rms_m on each axis.
class Tremor {
 public:
  Tremor(std::uint64_t seed, double rms_m, const HandParams& hand, double arm_stiffness_N_m,
         double arm_damping_Ns_m);
  [[nodiscard]] Vec3 at(double t_s) const NONBLOCKING;

 private:
  std::array<Waves, 3> lines_;
};

// The truth at this instant. The delay and the misjudgement of what is seen are the operator's own.
struct OperatorView {
  Vec3 tip_m = Vec3::Zero();     // world frame
  Vec3 inward = -Vec3::UnitX();  // the needle's mounted axis
  bool cell = false;
  Vec3 centre_m = Vec3::Zero();  // of the undeformed cell
  double R_m = 0;
  bool punctured = false;  // the innermost membrane has given way
  std::uint64_t cell_index = 0;
  Vec3 hand_m = Vec3::Zero();  // handle, device frame
  bool powered = false;        // the stage's drives
  bool relay_open = false;     // the lamp of the relay: it has opened since the start
};

enum class Activity : std::uint32_t {
  settle,    // waits before the first or the next attempt
  approach,  // to a point before the membrane
  indent,    // pushes until the membrane is seen to give way
  push_on,   // to the wanted depth
  inject,    // button down for the dwell
  withdraw,
  next_cell,  // presses the button
  go_back,    // to where the stage started
  clutch,     // holds the button and brings the hand back to the middle of its workspace
  rest,       // the task is over
  strokes,    // the scene has no cell: the hand moves to and fro
};

struct OperatorState {
  static constexpr int kLooks = 8;  // pictures remembered, kLook_s apart

  Point intention_m;   // device frame, without tremor and drift
  Point arm_target_m;  // with tremor and drift: the position that the arm pulls to
  Point wanted_tip_m;  // world frame
  Point path_from_m;   // world frame
  Point path_to_m;
  Point hand_from_m;                    // of the clutch, device frame
  Point target_m;                       // where the intended line meets the undeformed membrane
  Point line{-1, 0, 0};                 // unit vector of the intended line, into the cell
  Point felt_offset_m;                  // of the handle from arm_target_m, low-passed
  Point puncture_tip_m;                 // where the tip was when the membrane gave way
  std::array<Point, kLooks> error_m{};  // wanted tip - seen tip
  std::array<Point, kLooks> tip_m{};    // seen
  std::uint64_t looks = 0;
  double next_look_s = 0;
  double activity_s = 0;  // since the activity began
  double path_s = 0;      // time along the path; slows down while the needle does not follow
  double path_T_s = 0;    // 0: at path_speed_m_s along the line
  double path_speed_m_s = 0;
  double stalled_s = 0;   // since the needle last advanced
  double furthest_m = 0;  // furthest advance so far, along direction()
  double aware_s = -1;    // run time at which the operator becomes aware of the puncture; -1: not yet
  Activity activity = Activity::settle;
  Activity resume = Activity::settle;  // after the clutch
  std::uint32_t buttons = 0;
  std::uint32_t enabling = 0;  // the button of the enabling device
  double enabling_s = 0;       // since it was let go, or held without power for the drives
  std::uint32_t reset = 0;     // the reset button of the e-stop chain
  double relay_open_s = 0;
  std::uint32_t waits = 0;     // since the relay opened, until the drives have power again
  std::uint32_t attempts = 0;  // at this cell
  std::uint32_t cells_done = 0;
  std::uint32_t given_up = 0;    // cells of cells_done that were never punctured
  std::uint32_t clutched = 0;    // how often the clutch was used
  std::uint32_t judgements = 0;  // how often the line was judged
  double tilt_rad[2]{};          // of the handle
};

class Operator {
 public:
  static constexpr double kLook_s = 0.04;

  explicit Operator(const SimConfig& config);

  // Advances the operator from from_s to to_s of the run; then the arm pulls to state().arm_target_m.
  void step(double from_s, double to_s, const OperatorView& view) NONBLOCKING;

  [[nodiscard]] const OperatorState& state() const NONBLOCKING { return state_; }
  void restore(const OperatorState& state) NONBLOCKING { state_ = state; }
  [[nodiscard]] const Tremor& tremor() const NONBLOCKING { return tremor_; }

 private:
  void begin(Activity activity, const OperatorView& view) NONBLOCKING;
  void begin_path(Activity activity, const OperatorView& view, const Vec3& to, double least_s) NONBLOCKING;
  void judge(const OperatorView& view) NONBLOCKING;
  void look(const OperatorView& view) NONBLOCKING;
  void decide(double to_s, const OperatorView& view) NONBLOCKING;
  void after_withdrawal(const OperatorView& view) NONBLOCKING;
  void maybe_clutch(const OperatorView& view, const Vec3& hand_velocity) NONBLOCKING;
  void clutch(double dt_s) NONBLOCKING;
  void strokes(double dt_s) NONBLOCKING;
  void hold_to_run(double dt_s, const OperatorView& view) NONBLOCKING;
  void follow_path(double dt_s, const OperatorView& view) NONBLOCKING;
  [[nodiscard]] std::size_t seen_slot() const NONBLOCKING;
  [[nodiscard]] Vec3 direction() const NONBLOCKING;  // unit vector of the intended motion
  [[nodiscard]] bool moving() const NONBLOCKING;
  [[nodiscard]] bool refused() const NONBLOCKING;

  SimConfig config_;
  Tremor tremor_;
  Noise aim_;
  static constexpr std::size_t kDrifts = 3;
  static_assert(2 * kDrifts + 2 == Waves::kCount);
  // In two directions across the needle, at the needle, in metres; then of the tilt. They begin at zero.
  Waves wander_;
  std::array<double, 2> tilt_mean_rad_{};
  Vec3 sideways_axis_, depth_axis_;  // unit, perpendicular to the mounted axis; depth_axis_ is mostly z
  OperatorState state_;
};

}  // namespace punctum::sim
