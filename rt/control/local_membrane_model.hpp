// Where the membrane is between two frames, in the stage's frame.
//
// The stage's encoders and the picture differ by an unknown registration, so only differences are used: an
// observation is compared with the tip's pose at its exposure (a short history), and it corrects the model's
// parameters at a bounded rate and, counted from how the cell was first seen and first touched, by a bounded
// sum: a claim beyond that is refused. Between frames the depth follows the tip of every tick. One
// picture tells no depth: the entry's z is the tip's when the cell was first seen, and is never corrected.
#pragma once

#include <array>
#include <cstdint>

#include "hal/devices.hpp"
#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/control/limits.hpp"
#include "rt/forces/ramp.hpp"
#include "rt/station/observation.hpp"

namespace punctum::rt {

// The membrane between two frames, and what happens when vision falls silent.
struct LocalModelParams {
  double disagree_m = 8e-6;  // stage and picture may move apart by this before the picture is not believed
  double gain = 0.3;         // of one observation at most; of a doubtful one less
  double max_rate_m_s = 100e-6;  // bounded correction of the membrane's position
  double stale_after_s = 0.30;   // age from which the rendered force fades
  double fade_s = 0.15;
  double return_s = 0.4;  // the force returns over this once vision is back
  // The paper's law wants the width of the dimple itself: a = c + dimple_scale sqrt(2 R w_d) follows the
  // simulated cell's force within 0.4 uN. Vision's 1 % width spans a whole sagging cell; a rate above 0 lets
  // it correct the scale.
  double dimple_scale = 0.6;
  double dimple_scale_rate_1_s = 0;
  double dimple_min_m = 2e-6;  // w_d from which a dimple's width is believed
  // Radius of a cell that vision looks for, by the scene.
  double R_min_m = 0;
  double R_max_m = 2e-3;
};
constexpr auto keys_of(const LocalModelParams*) {
  return hal::keys(hal::real("gain", &LocalModelParams::gain, 0.01, 1),
                   hal::micro("max_rate_um_s", &LocalModelParams::max_rate_m_s, 1, 1e5),
                   hal::micro("disagree_um", &LocalModelParams::disagree_m, 1, 1000),
                   hal::real("stale_after_s", &LocalModelParams::stale_after_s, 0.01, 5),
                   hal::real("fade_s", &LocalModelParams::fade_s, 0.01, 2),
                   hal::real("return_s", &LocalModelParams::return_s, 0.01, 5),
                   hal::real("dimple_scale", &LocalModelParams::dimple_scale, 0.01, 5),
                   hal::real("dimple_scale_rate_1_s", &LocalModelParams::dimple_scale_rate_1_s, 0, 50),
                   hal::micro("dimple_min_um", &LocalModelParams::dimple_min_m, 0.1, 500));
}

struct TipPose {
  std::int64_t t_ns = 0;
  hal::Vec3 tip_m = hal::Vec3::Zero();
  hal::Vec3 axis = -hal::Vec3::UnitX();
};

// More than a second at 8 kHz, statically allocated.
class PoseHistory {
 public:
  static constexpr std::size_t kSize = 8192;
  void push(const TipPose& pose) NONBLOCKING;  // t_ns rises; where it does not, the history begins anew
  // Interpolated; false if t_ns is older than the history or newer than its newest pose.
  [[nodiscard]] bool at(std::int64_t t_ns, TipPose& out) const NONBLOCKING;
  [[nodiscard]] std::size_t size() const NONBLOCKING { return size_; }
  [[nodiscard]] std::int64_t newest_ns() const NONBLOCKING {  // of a history that is not empty
    return poses_[(next_ + kSize - 1) % kSize].t_ns;
  }

 private:
  std::array<TipPose, kSize> poses_{};
  std::size_t next_ = 0;
  std::size_t size_ = 0;
};

// A flag that two observations in a row must change: one frame may be mistaken.
class ConfirmedFlag {
 public:
  static constexpr int kFrames = 2;
  void see(bool now) NONBLOCKING {
    others_ = now == value_ ? 0 : others_ + 1;
    if (others_ >= kFrames) {
      value_ = now;
      others_ = 0;
    }
  }
  [[nodiscard]] bool value() const NONBLOCKING { return value_; }

 private:
  bool value_ = false;
  int others_ = 0;
};

class LocalMembraneModel {
 public:
  LocalMembraneModel(const LocalModelParams& params, double c_m, double R_m) NONBLOCKING;

  void push_pose(const TipPose& pose) NONBLOCKING { history_.push(pose); }

  // A new observation: true if it could be used (finite, plausible, exposed within the history and not too
  // long ago, after the last restart, its needle where the stage has it, its cell where and as large as it
  // can be). inside: past the puncture, where a frame that shows the needle is enough to count as sight.
  bool observe(const Observation& seen, bool inside) NONBLOCKING;

  // Bounded-rate correction, age, fade. True if it moved the membrane.
  bool step(std::int64_t now_ns, const hal::Vec3& axis, double dt_s) NONBLOCKING;

  // The needle touches the cell: from here on the undeformed membrane stays where it is, but for disagree_m.
  void touch() NONBLOCKING;
  void let_go() NONBLOCKING { touched_ = false; }
  // A needle outside has punctured nothing: two observations have to show it anew.
  void is_outside() NONBLOCKING { punctured_ = inner_punctured_ = {}; }

  // A fresh cell: forget the old one; observations exposed before now do not count.
  void restart(std::int64_t now_ns) NONBLOCKING;

  [[nodiscard]] const Membrane3D& membrane() const NONBLOCKING { return membrane_; }
  [[nodiscard]] double depth_m(const hal::Vec3& tip_m) const NONBLOCKING { return membrane_.depth_m(tip_m); }
  [[nodiscard]] double R_m() const NONBLOCKING { return membrane_.R_m; }
  [[nodiscard]] double dimple_scale() const NONBLOCKING { return dimple_scale_; }
  [[nodiscard]] bool stale() const NONBLOCKING { return stale_; }
  [[nodiscard]] bool overdue() const NONBLOCKING { return overdue_; }  // stale, and not just starting
  [[nodiscard]] double force_gain() const NONBLOCKING { return fade_.gain(); }  // 0 while stale
  [[nodiscard]] double age_s() const NONBLOCKING { return age_s_; }             // -1: nothing seen yet
  [[nodiscard]] bool contact_seen() const NONBLOCKING { return contact_; }
  // In two usable observations in a row.
  [[nodiscard]] bool puncture_seen() const NONBLOCKING { return punctured_.value(); }
  [[nodiscard]] bool inner_puncture_seen() const NONBLOCKING { return inner_punctured_.value(); }
  // The newest observation claims what cannot be.
  [[nodiscard]] bool implausible() const NONBLOCKING { return implausible_; }
  // This cell as the first frames showed it: what later ones are held against.
  [[nodiscard]] const Membrane3D& first_seen() const NONBLOCKING { return first_; }
  [[nodiscard]] double seen_gap_m() const NONBLOCKING { return seen_gap_m_; }
  // Standard deviation of depth_m, the way of the membrane since the newest observation included.
  [[nodiscard]] double depth_sd_m() const NONBLOCKING;
  [[nodiscard]] double R_sd_m() const NONBLOCKING { return R_sd_m_; }
  [[nodiscard]] double seen_a_m() const NONBLOCKING { return seen_a_m_; }
  [[nodiscard]] double seen_a_sd_m() const NONBLOCKING { return seen_a_sd_m_; }
  [[nodiscard]] std::uint64_t used() const NONBLOCKING { return used_; }

 private:
  static constexpr std::size_t kFirstFrames = 5;  // one of them may be mistaken, or two alike

  [[nodiscard]] double gain_of(const Observation& seen) NONBLOCKING;
  [[nodiscard]] Membrane3D claimed_by(const Observation& seen, const TipPose& pose) NONBLOCKING;
  [[nodiscard]] bool in_order(const Observation& seen) NONBLOCKING;
  void remember_first(const Membrane3D& claim) NONBLOCKING;
  [[nodiscard]] bool can_be(const Membrane3D& claim) const NONBLOCKING;
  // Turns the membrane to this axis, and applies of the corrections as much as their rate allows.
  void move(const hal::Vec3& axis, double dt_s) NONBLOCKING;

  // The offset between the picture and the stage's frame is unknown but constant. A picture that stands still
  // while the needle moves would move the membrane with the needle, and no depth limit would hold it.
  [[nodiscard]] bool agrees(const TipPose& pose, const hal::Vec3& seen_tip_m) NONBLOCKING;

  LocalModelParams params_;
  double c_m_;
  double R_default_m_;
  PoseHistory history_;
  Membrane3D membrane_;
  hal::Vec3 entry_correction_m_ = hal::Vec3::Zero();  // still to be applied
  double R_correction_m_ = 0;
  double variance_m2_ = 0;  // of the entry along the axis
  double scale_correction_ = 0;
  bool settled_ = false;  // of these nothing is left, or what never will be
  double dimple_scale_;
  std::array<Membrane3D, kFirstFrames> first_claims_{};
  std::size_t first_frames_ = 0;
  Membrane3D first_;
  bool touched_ = false;
  hal::Vec3 touched_entry_m_ = hal::Vec3::Zero();
  bool implausible_ = false;
  std::int64_t newest_exposure_ns_ = 0;
  std::uint64_t newest_frame_ = 0;
  std::int64_t not_before_ns_ = 0;
  bool seen_ = false;
  bool stale_ = true;
  bool overdue_ = false;
  bool started_ = false;
  bool focused_ = false;
  double focus_z_m_ = 0;  // the focal plane in the stage's frame, where every cell of the run lies
  bool registered_ = false;
  hal::Vec3 registration_m_ = hal::Vec3::Zero();  // stage minus picture, across the optical axis
  std::int64_t registered_ns_ = 0;                // exposure it is of
  bool disagreed_ = false;
  hal::Vec3 disagreed_at_m_ = hal::Vec3::Zero();   // the stage when picture and stage began to disagree
  hal::Vec3 disagreed_off_m_ = hal::Vec3::Zero();  // and stage minus picture then
  double age_s_ = -1;
  Ramp fade_;
  bool contact_ = false;
  ConfirmedFlag punctured_;
  ConfirmedFlag inner_punctured_;
  double seen_gap_m_ = 0;
  double R_sd_m_ = 0, seen_a_m_ = 0, seen_a_sd_m_ = 0;  // of the newest observation
  std::uint64_t used_ = 0;
};

}  // namespace punctum::rt
