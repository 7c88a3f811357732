// The shape of the injection pipette near its tip, learnt while nothing touches it. With it the end is found
// where the picture alone hardly shows it: near the tip the walls are thin, and a yolk is granular.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "vision/image/gradient.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

class NeedleShape {
 public:
  struct End {
    double ahead = 0;  // of the tip of the given pose, px
    double doubt = 0;  // px: ends further away than this are much less likely
  };

  [[nodiscard]] bool known() const noexcept { return frames_ > 0; }
  [[nodiscard]] bool reliable() const noexcept { return frames_ >= kReliable; }
  // Takes in what a frame shows along the needle. Its shape becomes the mean over the last frames.
  void learn(const GradientField& field, const NeedlePose& needle);
  void forget() { *this = {}; }

  // Distance of the end face ahead of the tip of the poses that it was learnt from, px; sub-pixel.
  [[nodiscard]] std::optional<double> face() const;
  // The most likely end, from `back` px behind the tip to `ahead` px ahead of it. Empty when it is not there,
  // or when the shape is not known.
  [[nodiscard]] std::optional<End> end(const GradientField& field, const NeedlePose& needle, double back,
                                       double ahead) const;

 private:
  static constexpr int kReliable = 8;  // frames
  static constexpr std::size_t kLanes = 21;
  // Absorption across the needle, as a share of the light, without mean and slope.
  using Profile = std::array<double, kLanes>;

  [[nodiscard]] static double square(const Profile& p);
  [[nodiscard]] std::optional<Profile> profile(const GradientField& field, const NeedlePose& needle,
                                               double behind) const;

  // The shape without what lay beside the needle in a few frames only.
  void smooth_along_shaft();

  double reach_ = 0;            // to either side of the axis, px
  std::vector<Profile> mean_;   // of the frames, every half pixel, from a little ahead of the tip
  std::vector<Profile> shape_;  // likewise
  int frames_ = 0;
};

}  // namespace punctum::vision
