// Puncture: the membrane, which the needle pushed until now, recoils against it (fig. 9).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace punctum::vision {

struct PunctureInput {
  std::int64_t t_ns = 0;
  bool contact = false;    // needle and cell touch
  bool points = false;     // membrane_px is known
  double membrane_px = 0;  // mean place of the two contact points along the needle's axis, > 0 into the cell
  double tip_px = 0;       // place of the tip along the same axis
  double depth_px = 0;     // of the contact points past the undeformed membrane
  std::optional<double> gap_px = {};  // tip to undeformed membrane, > 0 outside; empty: not seen
  double radius_px = 0;               // of the needle
  double sd_px = 0.7;                 // of membrane_px
  bool free = false;                  // the picture beside the needle shows the membrane off the tip
  bool refocused = false;             // what lies on the needle is told elsewhere than before
  bool unsharp = false;               // far out of the focus in which they touched: a dent hardly shows
  double recoil = 0;                  // log odds, by its motion, that it has gone back since the last frame
};

// Page's sequential test (CUSUM) on the way that the membrane has gone back further than the needle.
class Puncture {
 public:
  // recoil_px: least distance that the membrane has recoiled against the needle.
  explicit Puncture(double recoil_px) : recoil_px_(recoil_px) {}

  // True from the puncture until the needle is outside the cell by more than its own diameter; by half of
  // that, when it stays there or was out of sight for as long.
  bool update(const PunctureInput& in);
  [[nodiscard]] bool punctured() const noexcept { return punctured_; }
  [[nodiscard]] double membrane_velocity_px_s() const noexcept { return velocity_; }

 private:
  static constexpr double kUsualShare = 0.9;  // contact points lie beside the needle, a little behind its tip
  void weigh_recoil(const PunctureInput& in);
  [[nodiscard]] bool is_through_undented_membrane(const PunctureInput& in);
  [[nodiscard]] bool has_left(const PunctureInput& in);

  double recoil_px_;
  bool punctured_ = false;
  bool have_last_ = false;
  std::int64_t last_ns_ = 0;
  double last_membrane_ = 0;
  double velocity_ = 0;
  double share_ = kUsualShare;                // of the tip's depth to which the membrane is pushed
  double tip_square_ = 0, tip_membrane_ = 0;  // means over the frames: tip^2, tip times membrane
  std::array<double, 4> before_{};            // membrane_px of the frames before, the newest at places_ - 1
  std::size_t places_ = 0;
  int outside_frames_ = 0, unseen_frames_ = 0;  // in a row
  int inside_frames_ = 0;    // in a row with the tip inside a membrane that is hardly dented
  double evidence_ = 0;      // log odds of a recoil against none, over the frames since there was none
  std::int64_t frames_ = 0;  // since the start or the last reset
};

// Where the inner membrane's contour crosses the needle.
struct InnerOnNeedle {
  double behind_tip_px = 0;  // the nearer of the two sides
  double place_px = 0;       // along the needle's axis in the picture, > 0 into the cell
};

// The inner membrane, once the outer one is through. While it holds, its contour lies on the tip; when it has
// given way, the contour crosses the needle behind the tip. Where it gives way with a small dimple, this is
// told only after the needle has gone on by the rest of twice least_behind_px. In 16 simulated oocytes it was
// told 64 to 112 ms after it happened, but in one of them 151 ms before: the contour had lost the dimple.
class InnerPuncture {
 public:
  // Distance behind the tip, px, from which the contour no longer lies on a tip of that radius.
  [[nodiscard]] static double least_behind_px(double radius_px);

  // seen: empty if the contour is not followed or does not cross the needle's edges. True until the outer
  // membrane is no longer punctured.
  bool update(bool outer_punctured, const std::optional<InnerOnNeedle>& seen, double radius_px);

 private:
  bool punctured_ = false;
  int frames_ = 0;                 // in a row
  std::optional<double> deepest_;  // place of the contour since the outer membrane is through
};

}  // namespace punctum::vision
