// The phases of an injection, from the local membrane model (every tick) and vision (every frame).
//
// free -> contact -> indentation -> puncture -> injection -> withdrawal -> clear -> (next cell) free.
// Every threshold has its hysteresis; before the puncture the phase may fall back, after it only onwards.
// What vision says of a puncture counts only while the encoders too say that the needle dents the cell.
#pragma once

#include <array>
#include <cstdint>

#include "hal/parameters.hpp"
#include "hal/realtime.hpp"
#include "rt/station/phase.hpp"

namespace punctum::rt {

struct PhaseParams {
  double contact_on_m = 0.3e-6;        // w_d that begins contact
  double contact_off_m = 0.5e-6;       // gap that ends it
  double indentation_on_m = 3e-6;      // w_d
  double withdrawal_speed_m_s = 5e-6;  // outward speed that begins withdrawal once inside
  double withdrawal_back_m = 2e-6;     // and the way back from the deepest point that it takes
  double clear_m = 10e-6;              // gap that ends withdrawal
  double timeout_s[7] = {120, 20, 30, 15, 20, 20, 60};  // per phase, alarm
};
constexpr auto keys_of(const PhaseParams*) {
  return hal::keys(hal::micro("contact_on_um", &PhaseParams::contact_on_m, 0.01, 50),
                   hal::micro("contact_off_um", &PhaseParams::contact_off_m, 0.01, 50),
                   hal::micro("indentation_on_um", &PhaseParams::indentation_on_m, 0.05, 500),
                   hal::micro("withdrawal_speed_um_s", &PhaseParams::withdrawal_speed_m_s, 0.1, 1000),
                   hal::micro("withdrawal_back_um", &PhaseParams::withdrawal_back_m, 0, 500),
                   hal::micro("clear_um", &PhaseParams::clear_m, 0.1, 1000),
                   hal::element("timeout_free_s", &PhaseParams::timeout_s, 0, 0.1, 1e5),
                   hal::element("timeout_contact_s", &PhaseParams::timeout_s, 1, 0.1, 1e5),
                   hal::element("timeout_indentation_s", &PhaseParams::timeout_s, 2, 0.1, 1e5),
                   hal::element("timeout_puncture_s", &PhaseParams::timeout_s, 3, 0.1, 1e5),
                   hal::element("timeout_injection_s", &PhaseParams::timeout_s, 4, 0.1, 1e5),
                   hal::element("timeout_withdrawal_s", &PhaseParams::timeout_s, 5, 0.1, 1e5),
                   hal::element("timeout_clear_s", &PhaseParams::timeout_s, 6, 0.1, 1e5));
}

struct PhaseInput {
  bool membrane_known = false;  // the local model has been placed by vision
  double depth_m = 0;           // of the tip past the undeformed membrane, along the axis; < 0 outside
  double contact_depth_m = 0;   // of the tip past the first contact, by the encoders
  double inward_m = 0;     // way of the tip along the axis by the stage's encoders; only differences count
  double outward_m_s = 0;  // its speed the other way, low-passed
  bool vision_contact = false;  // of the newest usable observation
  bool vision_punctured = false;
  bool vision_contradicts =
      false;                // the newest observation puts the cell where it cannot be, or it went along
  bool may_inject = false;  // the innermost membrane is seen to be through
  bool inject = false;      // button
  bool next_cell = false;   // button
};

class Phases {
 public:
  // All it remembers.
  struct State {
    Phase phase = Phase::free;
    bool changed = false;
    double in_phase_s = 0;
    double deepest_m = 0;       // inward_m
    bool next_cell_was = true;  // a button held from the start is no edge
    bool inject_was = true;
    std::uint32_t cell = 0;
    friend bool operator==(const State&, const State&) = default;
  };

  explicit Phases(const PhaseParams& params) NONBLOCKING : Phases(params, State{}) {}
  Phases(const PhaseParams& params, const State& state) NONBLOCKING : params_(params), state_(state) {}

  // Advances by at most one phase. dt_s: since the previous call.
  Phase step(const PhaseInput& in, double dt_s) NONBLOCKING;

  [[nodiscard]] Phase phase() const NONBLOCKING { return state_.phase; }
  [[nodiscard]] bool inside() const NONBLOCKING;  // latched puncture: from `puncture` to `withdrawal`
  [[nodiscard]] bool entered(Phase p) const NONBLOCKING {  // on this tick
    return state_.changed && state_.phase == p;
  }
  [[nodiscard]] bool changed() const NONBLOCKING { return state_.changed; }
  [[nodiscard]] double seconds_in_phase() const NONBLOCKING { return state_.in_phase_s; }
  [[nodiscard]] bool timed_out() const NONBLOCKING;                             // alarm
  [[nodiscard]] std::uint32_t cell() const NONBLOCKING { return state_.cell; }  // from 0
  [[nodiscard]] const State& state() const NONBLOCKING { return state_; }

 private:
  void go(Phase next) NONBLOCKING;

  PhaseParams params_;
  State state_;
};

}  // namespace punctum::rt
