// Where the membrane is between two frames, in the stage's frame.
//
// The stage's encoders and the picture differ by a registration nobody knows, so only differences are used:
// an observation is compared with the tip's pose at its exposure (a short history), and what it says moves
// the model's parameters at a bounded rate. Between frames the depth follows the tip of every tick. One
// picture tells no depth: the entry's z is the tip's when the cell was first seen, and is never corrected.
#pragma once

#include <array>
#include <cstdint>

#include "hal/devices.hpp"
#include "rt/control/config.hpp"
#include "rt/control/limits.hpp"
#include "rt/forces/ramp.hpp"
#include "rt/station/observation.hpp"

namespace punctum::rt {

struct TipPose {
  std::int64_t t_ns = 0;
  hal::Vec3 tip_m = hal::Vec3::Zero();
  hal::Vec3 axis = -hal::Vec3::UnitX();
};

// More than a second at 8 kHz, statically allocated.
class PoseHistory {
 public:
  static constexpr std::size_t kSize = 8192;
  void push(const TipPose& pose) noexcept;  // t_ns rises; where it does not, the history begins anew
  // Interpolated; false if t_ns is older than the history or newer than its newest pose.
  [[nodiscard]] bool at(std::int64_t t_ns, TipPose& out) const noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return size_; }

 private:
  std::array<TipPose, kSize> poses_{};
  std::size_t next_ = 0;
  std::size_t size_ = 0;
};

class LocalMembraneModel {
 public:
  LocalMembraneModel(const LocalModelParams& params, double c_m, double R_m) noexcept;

  void push_pose(const TipPose& pose) noexcept { history_.push(pose); }

  // A new observation: true if it could be used (finite, plausible, exposed within the history, after the
  // last restart, its needle where the stage has it). inside: past the puncture, where a frame that shows the
  // needle is enough to count as sight.
  bool observe(const Observation& seen, bool inside) noexcept;

  // Bounded-rate correction, age, fade.
  void step(std::int64_t now_ns, const hal::Vec3& axis, double dt_s) noexcept;

  // A fresh cell: forget the old one; observations exposed before now do not count.
  void restart(std::int64_t now_ns) noexcept;

  [[nodiscard]] const Membrane3D& membrane() const noexcept { return membrane_; }
  [[nodiscard]] double depth_m(const hal::Vec3& tip_m) const noexcept { return membrane_.depth_m(tip_m); }
  [[nodiscard]] double R_m() const noexcept { return membrane_.R_m; }
  [[nodiscard]] double dimple_scale() const noexcept { return dimple_scale_; }
  [[nodiscard]] bool stale() const noexcept { return stale_; }
  [[nodiscard]] bool overdue() const noexcept { return overdue_; }           // stale, and not just starting
  [[nodiscard]] double force_gain() const noexcept { return fade_.gain(); }  // 0 while stale
  [[nodiscard]] double age_s() const noexcept { return age_s_; }             // -1: nothing seen yet
  [[nodiscard]] bool contact_seen() const noexcept { return contact_; }
  [[nodiscard]] bool puncture_seen() const noexcept { return punctured_; }
  [[nodiscard]] double seen_gap_m() const noexcept { return seen_gap_m_; }
  [[nodiscard]] std::uint64_t used() const noexcept { return used_; }

 private:
  // The picture lies beside the stage's frame, nobody knows how far, but it stays there. A picture that
  // stands still while the needle moves would drag the membrane along, and no depth limit would ever bite.
  [[nodiscard]] bool agrees(const TipPose& pose, const hal::Vec3& seen_tip_m) noexcept;

  LocalModelParams params_;
  double c_m_;
  double R_default_m_;
  PoseHistory history_;
  Membrane3D membrane_;
  hal::Vec3 entry_correction_m_ = hal::Vec3::Zero();  // still to be applied
  double R_correction_m_ = 0;
  double scale_correction_ = 0;
  double dimple_scale_;
  std::int64_t newest_exposure_ns_ = 0;
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
  bool punctured_ = false;
  double seen_gap_m_ = 0;
  std::uint64_t used_ = 0;
};

}  // namespace punctum::rt
