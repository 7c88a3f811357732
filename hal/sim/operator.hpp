// The biologist. She looks at the picture, judges where the tip is, and moves her intention; the arm and the
// haptic device (hand.hpp) make a hand motion of it.
//
// What she wants of the tip is a path in the picture: a minimum-jerk approach to a point before the membrane,
// a push at steady speed until she sees it give way, the rest of the way in, the dwell with the injection
// button down, the way out. She moves her hand by that path and corrects it by what she saw reaction_s ago,
// so scale, clutch and registration do not matter to her. Across her line she gives way to a guiding force
// and does not mind an error smaller than she can judge. Tremor of 8 to 12 Hz and a slow drift come on top.
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
  Vec3 tip_m = Vec3::Zero();  // world frame
  bool cell = false;
  Vec3 entry_m = Vec3::Zero();   // where the undeformed membrane lies in the needle's way
  Vec3 inward = -Vec3::UnitX();  // the needle's mounted axis
  double R_m = 0;
  bool punctured = false;  // the innermost membrane she wants to get through
  std::uint64_t cell_index = 0;
  Vec3 hand_m = Vec3::Zero();  // handle, device frame
};

enum class Doing : std::uint32_t {
  settle,
  approach,
  indent,
  push_on,
  inject,
  withdraw,
  next_cell,
  go_back,
  clutch,
  rest,
  strokes
};

struct PersonState {
  static constexpr int kLooks = 24;  // perceived pictures kept, kLook_s apart

  Point intention_m;   // device frame, without tremor
  Point shaken_m;      // with tremor and drift: what the arm is pulled to
  Point wanted_tip_m;  // world frame
  Point path_from_m;
  Point path_to_m;
  Point aim_offset_m;                          // her misjudgement of where the axis is
  Point line{-1, 0, 0};                        // her idea of the axis
  Point felt_m;                                // handle against intention, low-passed
  std::array<Point, kLooks> looked_error_m{};  // wanted - seen
  std::array<Point, kLooks> looked_tip_m{};
  std::uint64_t looks = 0;
  double next_look_s = 0;
  double doing_s = 0;  // for how long
  double path_s = 0;   // time along the path; stands still while the needle does not follow
  double path_T_s = 0;
  double travelled_m = 0;
  double speed_m_s = 0;
  double progress_s = 0;       // since the tip last moved on, as seen
  double progress_m = 0;       // where it was then, along the line
  double saw_puncture_s = -1;  // run time at which she became aware of it
  Doing doing = Doing::settle;
  Doing resume = Doing::settle;  // after the clutch
  std::uint32_t buttons = 0;
  std::uint32_t attempts = 0;  // at this cell
  std::uint32_t cells_done = 0;
  std::uint32_t gave_up = 0;  // cells
  std::uint64_t cell_index = 0;
  double tilt_rad[2]{};
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
  void look(double t_s, const PersonView& view) noexcept;
  void begin(Doing doing) noexcept;
  void begin_path(Doing doing, const Vec3& to, double duration_s) noexcept;
  void decide(double t_s, const PersonView& view) noexcept;
  [[nodiscard]] Vec3 wanted_velocity(double dt_s) noexcept;
  [[nodiscard]] Vec3 seen_error() const noexcept;
  [[nodiscard]] Vec3 seen_tip() const noexcept;
  [[nodiscard]] bool held_up() const noexcept;
  void judge(const PersonView& view) noexcept;

  SimConfig config_;
  Tremor tremor_;
  Noise aim_;
  Noise tilt_;
  std::array<std::array<double, 9>, 3> drift_{};  // three slow lines per axis: angular rate, phase, amplitude
  PersonState state_;
};

}  // namespace punctum::sim
