// Puncture: the membrane, pushed along by the needle until now, runs back against it (fig. 9).
#pragma once

#include <cstdint>

namespace punctum::vision {

struct PunctureInput {
  std::int64_t t_ns = 0;
  bool contact = false;    // needle and cell touch
  bool points = false;     // membrane_px is known
  double membrane_px = 0;  // mean place of the two contact points along the needle's axis, into the cell > 0
  double tip_px = 0;       // place of the tip along the same axis
  double depth_px = 0;     // of the contact points past the undeformed membrane
  double gap_px = 0;       // tip to undeformed membrane, > 0 outside
  double radius_px = 0;    // of the needle
};

class Puncture {
 public:
  // recoil_px: how far the membrane must have run back, against the needle, before it counts.
  explicit Puncture(double recoil_px) : recoil_px_(recoil_px) {}

  // True from the puncture until the needle is outside again by more than its own diameter.
  bool update(const PunctureInput& in);
  [[nodiscard]] bool punctured() const noexcept { return punctured_; }
  [[nodiscard]] double membrane_velocity_px_s() const noexcept { return velocity_; }
  [[nodiscard]] double relative_velocity_px_s() const noexcept {
    return relative_;
  }  // membrane against needle
  void reset() { *this = Puncture(recoil_px_); }

 private:
  double recoil_px_;
  bool punctured_ = false;
  bool have_last_ = false;
  std::int64_t last_ns_ = 0;
  double last_membrane_ = 0, last_tip_ = 0;
  double velocity_ = 0, relative_ = 0;
  double deepest_ = 0;  // of the membrane since contact began
  double tip_at_deepest_ = 0;
  bool pushing_ = false;  // it has moved with the needle
  double first_ = 0;      // place at the beginning of the contact
  int inside_frames_ = 0;
  int recoil_frames_ = 0;
  std::int64_t frames_ = 0;  // since the start
};

}  // namespace punctum::vision
