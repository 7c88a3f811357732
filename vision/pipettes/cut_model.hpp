// What a needle shows that is cut so and ends there, and how well that explains the picture.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <opencv2/core.hpp>

#include "vision/image/gradient.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/pipettes/needle_pose.hpp"

namespace punctum::vision {

struct CutEnd {
  double at = 0, tangent = 0;  // behind the tip of the pose, px; of the cut
};

// Two walls that stop along an oblique line, each as its own line is blurred, and a line of glass along it,
// or none. What is neither walls nor clear is a speck and tells nothing. The medium is as even as it is
// beside the needle: were it not known out of focus, where the walls merge, the end would be half as certain.
class CutModel {
 public:
  // The shaft that tells how the walls look: all of it, or where light comes from one side only what the
  // noise asks for, since that light shows what the lumen holds, which changes along a needle.
  enum class Shaft { all, near };
  // radius: outer, of a glass in relief, px; 0: not in relief.
  CutModel(const GradientField& field, const NeedlePose& needle, double noise, double blur_px, double back,
           double ahead, Shaft shaft = Shaft::all, double radius = 0);
  [[nodiscard]] bool stands_out() const noexcept { return clear_; }
  // As light that comes from one side makes them.
  [[nodiscard]] bool walls_differ() const noexcept { return walls_differ_; }
  [[nodiscard]] bool in_relief() const noexcept { return in_relief_; }
  // Log likelihood over no needle, twice.
  [[nodiscard]] double gain(const CutEnd& end) const;
  // The most that a needle and a speck before it explain, in line with the wall at that side.
  [[nodiscard]] double gain_with_speck(const CutEnd& end, double side) const;
  // What specks and granules leave of the picture, over what the noise alone would, at least 1.
  [[nodiscard]] double misfit(double gain) const {
    return std::max(1.0, (square_ - gain * unit_) / (area_px2_ * smooth_noise_ * smooth_noise_));
  }

 private:
  // Lanes of a row on one side of the axis: of the glass, of which so many are in the lumen, and beside it,
  // of which the outer ones are hardly blurred walls.
  static constexpr std::size_t kWithin = 5, kLumenLanes = 2, kClearLanes = 3, kBeside = 2;
  static constexpr std::size_t kOneSide = kWithin + kClearLanes, kAllLanes = 2 * kOneSide;
  using GlassRow = std::array<double, kAllLanes>;
  struct Seen {
    double s, half_width;
    GlassRow grey;                  // later times the weight, without what the medium may add
    GlassRow at;                    // where the lanes lie, px from the axis
    GlassRow tilt{};                // the same from their mean place
    GlassRow weight{};              // width of the lane, px; nearly none where there is a speck
    double weights = 0, tilts = 0;  // of the weights the sum, and that over the squares of the tilts
    // px, px cubed: what tells that the medium is even here, in the mean and across.
    double even = 0, level = 0;
    // Of both walls where the needle goes on: squared, and times the grey levels.
    double walls_squared = 0, walls_seen = 0;
  };
  // Of the squares of what is shown, and of that times what is seen: walls; the same times the distance from
  // the end; line; what else is shown.
  template <int N>
  struct Sums {
    cv::Matx<double, N, N> a;
    cv::Vec<double, N> g;
  };
  // In the lanes of a row, where the needle ends so.
  struct Shown {
    GlassRow walls, line;
  };
  struct Ends {
    CutEnd end;
    double cut_px, of_line_px, reach_px;  // reach: where the needle goes on to, and from where it shows
  };
  [[nodiscard]] Ends ends_at(const CutEnd& end) const;
  [[nodiscard]] Shown shown_in(const Seen& row, const Ends& ends) const;
  [[nodiscard]] Sums<3> sums(const CutEnd& end) const;
  struct Speck {
    double at, aside, radius_px;  // behind the tip of the pose and beside its axis, px
  };
  // shown: per row.
  [[nodiscard]] Sums<4> with_speck(const Sums<3>& of_needle, const CutEnd& end, const Vector<Shown>& shown,
                                   const Speck& speck) const;
  template <int N>
  [[nodiscard]] double likelier(Sums<N> sums) const;
  [[nodiscard]] double lane_at(std::size_t lane, double half_width) const;
  [[nodiscard]] double lane_width(std::size_t lane, double half_width) const;
  [[nodiscard]] static bool is_beside(std::size_t lane) { return lane % kOneSide + kBeside >= kOneSide; }
  void weigh_without_specks(Seen& row, double most) const;
  void take_off_plane();
  void tell_how_even_it_is();
  void take_off_mean_and_slope(Seen& row) const;
  void expect_walls(Seen& row) const;
  void show_in_relief(double radius, double strength);
  double half_width_, blur_, smooth_noise_, unit_;
  double square_ = 0, area_px2_ = 0;  // of what is seen, grey levels squared
  bool clear_ = false;
  Vector<Seen> rows_;
  GlassRow walls_{}, near_{}, line_{};  // of the shaft; the share of the nearer one; of a line across
  double middle_, line_behind_;         // of a wall, from the axis; of the line, behind the end
  bool walls_differ_ = false, in_relief_ = false;
  double radius_ = 0;  // in relief: outer, of the glass, px; and the place of the line that is seen in a lane
  GlassRow face_{};
};

}  // namespace punctum::vision
