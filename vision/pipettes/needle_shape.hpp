// The shape of the injection pipette near its tip, learnt while nothing touches it. With it the end is found
// where the picture alone hardly shows it: near the tip the walls are thin, and a yolk is granular.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/backdrop.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

class NeedleShape {
 public:
  // How the needle is looked at.
  struct View {
    bool over_backdrop = false;  // by what it changes of what was seen without it
    std::size_t blur = 0;        // how much less sharp than learnt; 0: as learnt
  };
  struct End {
    double ahead = 0;  // of the tip of the given pose, px
    double doubt = 0;  // px: ends further away than this are much less likely
    View view;         // in which it is seen best
  };

  [[nodiscard]] bool known() const noexcept { return frames_ > 0; }
  [[nodiscard]] bool reliable() const noexcept { return frames_ >= kReliable; }
  // Takes in what a frame shows along the needle. Its shape becomes the mean over the last frames.
  void learn(const GradientField& field, const NeedlePose& needle);
  void forget() { *this = {}; }

  // Distance of the end face ahead of the tip of the poses that it was learnt from, px; sub-pixel.
  [[nodiscard]] std::optional<double> face() const;
  // The most likely end, from `back` px behind the tip to `ahead` px ahead of it. Empty when it is not there,
  // or when the shape is not known. backdrop: what would be seen there without the needle, as far as known.
  // The views near the given one are tried.
  [[nodiscard]] std::optional<End> end(const GradientField& field, const Backdrop& backdrop,
                                       const NeedlePose& needle, double back, double ahead, View near);
  // By which the needle is less sharp in a view than it was learnt, px; beyond_blurs: at least.
  [[nodiscard]] static double blur_px(View view);
  [[nodiscard]] static bool beyond_blurs(View view);
  // How far ahead of the tip an end is, px, that is known to be within `reach` px of it. In this view alone.
  [[nodiscard]] std::optional<double> end_near(View view, const GradientField& field,
                                               const Backdrop& backdrop, const NeedlePose& needle,
                                               double reach);

 private:
  static constexpr int kReliable = 8;  // frames
  static constexpr std::size_t kLanes = 21;
  // Absorption across the needle, as a share of the light, without mean and slope.
  using Profile = std::array<float, kLanes>;

  using Profiles = Vector<Profile>;  // every half pixel along the needle, from ahead of the tip
  [[nodiscard]] static float product(const Profile& a, const Profile& b);
  [[nodiscard]] std::optional<Profile> light_across(const GradientField& field, const NeedlePose& needle,
                                                    double behind) const;
  [[nodiscard]] Profiles light_along(const GradientField& field, const NeedlePose& needle, double ahead,
                                     int rows) const;
  [[nodiscard]] static Profiles absorption(Profiles light);
  [[nodiscard]] Profiles absorption_over(const Backdrop& backdrop, const NeedlePose& needle, double ahead,
                                         const Profiles& light, const Profiles& of_usual) const;
  void blur(double sigma_px, Profiles& out) const;

  // The shape in one sharpness.
  struct Look {
    Profiles rows;        // empty: not blurred since the shape was learnt
    Vector<float> power;  // of the rows, the last one first, and a few of nothing
    Vector<float> lanes;  // the same rows lane by lane
    void arrange();       // power and lanes
  };
  struct Fit {
    Vector<float> gain;  // of each end, over no needle; in squares of the absorption
    int best = 0;
    double variance = 0;  // of a lane, once the needle is taken off
    View view;
    [[nodiscard]] float top() const { return gain[static_cast<std::size_t>(best)]; }
    [[nodiscard]] bool inside() const { return best >= 2 && best + 3 <= static_cast<int>(gain.size()); }
    [[nodiscard]] double ahead_of(double first) const;
  };
  [[nodiscard]] static Vector<float> gains(const Profiles& seen, const Look& look, int from, int to);
  [[nodiscard]] const Look& look(std::size_t blurred);
  [[nodiscard]] Fit fit(const Profiles& seen, View view, int ends);
  [[nodiscard]] static std::optional<End> end_of(const Fit& fit, double ahead);

  // The shape without what lay beside the needle in a few frames only.
  void smooth_along_shaft();

  double reach_ = 0;           // to either side of the axis, px
  Profiles mean_;              // of the frames
  std::array<Look, 6> shape_;  // likewise, without specks; ever less sharp, see look()
  int frames_ = 0;
};

}  // namespace punctum::vision
