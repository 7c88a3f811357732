// The phases of an injection, from the local membrane model (every tick) and vision (every frame).
//
// free -> contact -> indentation -> puncture -> injection -> withdrawal -> clear -> (next cell) free.
// Every threshold has its hysteresis; before the puncture the phase may fall back, after it only onwards.
#pragma once

#include <array>
#include <cstdint>

#include "rt/control/config.hpp"
#include "rt/station/telemetry.hpp"

namespace punctum::rt {

struct PhaseInput {
  bool membrane_known = false;  // the local model has been placed by vision
  double depth_m = 0;           // of the tip past the undeformed membrane, along the axis; < 0 outside
  double inward_m = 0;     // way of the tip along the axis by the stage's encoders; only differences count
  double outward_m_s = 0;  // its speed the other way, low-passed
  bool vision_contact = false;  // of the newest usable observation
  bool vision_punctured = false;
  bool inject = false;     // button
  bool next_cell = false;  // button
};

class Phases {
 public:
  explicit Phases(const PhaseParams& params) noexcept : params_(params) {}

  // Advances by at most one phase. dt_s: since the previous call.
  Phase step(const PhaseInput& in, double dt_s) noexcept;

  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  [[nodiscard]] bool inside() const noexcept;  // latched puncture: from `puncture` to `withdrawal`
  [[nodiscard]] bool entered(Phase p) const noexcept { return changed_ && phase_ == p; }  // on this tick
  [[nodiscard]] bool changed() const noexcept { return changed_; }
  [[nodiscard]] double seconds_in_phase() const noexcept { return in_phase_s_; }
  [[nodiscard]] bool timed_out() const noexcept;                       // alarm
  [[nodiscard]] std::uint32_t cell() const noexcept { return cell_; }  // from 0

 private:
  void go(Phase next) noexcept;

  PhaseParams params_;
  Phase phase_ = Phase::free;
  bool changed_ = false;
  double in_phase_s_ = 0;
  double deepest_m_ = 0;       // inward_m
  bool next_cell_was_ = true;  // a button held from the start is no edge
  std::uint32_t cell_ = 0;
};

}  // namespace punctum::rt
