// The biologist. She looks at the picture, judges where the tip is, and moves her intention; the arm and the
// haptic device (hand.hpp) make a hand motion of it.
//
// What she wants of the tip is a path in the picture: a minimum-jerk approach to a point before the membrane,
// a push at steady speed until she sees it give way, the rest of the way in, the dwell with the injection
// button down, the way out. She moves her hand by that path and corrects it by what she saw a moment ago, so
// scale, clutch and registration do not matter to her. Across her line she gives way to a guiding force and
// does not mind an error smaller than she can judge. Tremor of 8 to 12 Hz and a slow drift come on top. When
// the needle does not follow her she stops, and after a second draws back and starts over.
#pragma once

#include <array>
#include <cstdint>

#include "hal/sim/config.hpp"
#include "hal/sim/noise.hpp"
#include "hal/sim/point.hpp"

namespace punctum::sim {

// s(x) = 10 x^3 - 15 x^4 + 6 x^5, clamped to [0, 1] (Flash & Hogan 1985), and its derivative.
[[nodiscard]] double minimum_jerk(double x) noexcept;
[[nodiscard]] double minimum_jerk_rate(double x) noexcept;

// 8 to 12 Hz as a sum of sinusoids whose amplitudes make up for the arm, so that a handle without friction
// shakes by rms_m on each axis.
class Tremor {
 public:
  Tremor(std::uint64_t seed, double rms_m, const HandParams& hand, double arm_stiffness_N_m,
         double arm_damping_Ns_m);
  [[nodiscard]] Vec3 at(double t_s) const noexcept;

 private:
  static constexpr int kLines = 8;
  struct Line {
    double omega = 0;
    double phase = 0;
    double amplitude_m = 0;
  };
  std::array<std::array<Line, kLines>, 3> lines_{};
};

// What there is to see and feel, true and now; the person delays and misjudges it herself.
struct PersonView {
  Vec3 tip_m = Vec3::Zero();     // world frame
  Vec3 inward = -Vec3::UnitX();  // the needle's mounted axis
  bool cell = false;
  Vec3 centre_m = Vec3::Zero();  // of the undeformed cell
  double R_m = 0;
  bool punctured = false;  // the innermost membrane she wants to get through
  std::uint64_t cell_index = 0;
  Vec3 hand_m = Vec3::Zero();  // handle, device frame
};

enum class Doing : std::uint32_t {
  settle,    // waits before she starts (over)
  approach,  // to a point before the membrane
  indent,    // pushes until she sees the membrane give way
  push_on,   // to the wanted depth
  inject,    // button down for the dwell
  withdraw,
  next_cell,  // presses the button
  go_back,    // to where the stage started
  clutch,     // button down: brings the hand back to the middle of its workspace
  rest,       // the task is over for her
  strokes,    // no cell in the scene: to and fro
};

struct PersonState {
  static constexpr int kLooks = 8;  // pictures she remembers, kLook_s apart

  Point intention_m;   // device frame, without tremor and drift
  Point shaken_m;      // with them: what the arm is pulled to
  Point wanted_tip_m;  // world frame
  Point path_from_m;   // world frame
  Point path_to_m;
  Point hand_from_m;                    // of the clutch, device frame
  Point target_m;                       // where her line meets the undeformed membrane
  Point line{-1, 0, 0};                 // her idea of the axis, into the cell
  Point felt_m;                         // handle against intention, low-passed
  Point puncture_tip_m;                 // where the tip was when the membrane gave way
  std::array<Point, kLooks> error_m{};  // wanted - seen
  std::array<Point, kLooks> tip_m{};    // seen
  std::uint64_t looks = 0;
  double next_look_s = 0;
  double doing_s = 0;   // for how long
  double path_s = 0;    // time along the path; slows down while the needle does not follow
  double path_T_s = 0;  // 0: at path_speed_m_s along the line
  double path_speed_m_s = 0;
  double still_s = 0;     // since the needle last came on
  double still_at_m = 0;  // where, along the way
  double noticed_s = -1;  // run time at which she becomes aware of the puncture
  Doing doing = Doing::settle;
  Doing resume = Doing::settle;  // after the clutch
  std::uint32_t buttons = 0;
  std::uint32_t attempts = 0;  // at this cell
  std::uint32_t cells_done = 0;
  std::uint32_t given_up = 0;  // of them, never punctured
  std::uint32_t clutched = 0;  // times
  std::uint32_t judged = 0;    // times
  double tilt_rad[2]{};        // of the handle
};

class Person {
 public:
  static constexpr double kLook_s = 0.04;

  explicit Person(const SimConfig& config);

  // Advances her from from_s to to_s of the run. Afterwards state().shaken_m is what the arm is pulled to.
  void step(double from_s, double to_s, const PersonView& view) noexcept;

  [[nodiscard]] const PersonState& state() const noexcept { return state_; }
  void restore(const PersonState& state) noexcept { state_ = state; }
  [[nodiscard]] const Tremor& tremor() const noexcept { return tremor_; }

 private:
  void begin(Doing doing, const PersonView& view) noexcept;
  void begin_path(Doing doing, const PersonView& view, const Vec3& to, double least_s) noexcept;
  void judge(const PersonView& view) noexcept;
  void look(const PersonView& view) noexcept;
  void decide(double to_s, const PersonView& view) noexcept;
  void after_withdrawal(const PersonView& view) noexcept;
  void maybe_clutch(const PersonView& view, const Vec3& hand_velocity) noexcept;
  void clutch(double dt_s) noexcept;
  void strokes(double dt_s) noexcept;
  void lead(double dt_s, const PersonView& view) noexcept;
  [[nodiscard]] Vec3 drift_at(double t_s) const noexcept;
  [[nodiscard]] std::size_t seen() const noexcept;
  [[nodiscard]] Vec3 way() const noexcept;  // unit vector of the motion she is making
  [[nodiscard]] bool moving() const noexcept;
  [[nodiscard]] bool refused() const noexcept;

  struct Wave {
    double omega = 0;
    double phase = 0;
    double amplitude = 0;
  };

  SimConfig config_;
  Tremor tremor_;
  Noise aim_;
  std::array<std::array<Wave, 3>, 2> drift_{};  // across the needle, at the needle, metres
  std::array<Wave, 2> tilt_{};                  // phase unused: omega, phase and size of the sway
  std::array<double, 2> tilt_mean_rad_{};
  Vec3 across_, deep_;  // unit, perpendicular to the mounted axis; deep_ is mostly z
  PersonState state_;
};

}  // namespace punctum::sim
