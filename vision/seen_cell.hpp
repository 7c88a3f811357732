// The cell from frame to frame: both membranes are looked for and followed, and the outer one compared with
// what it is without the needle.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <utility>

#include "vision/membrane/edge_pattern.hpp"
#include "vision/membrane/membrane_start.hpp"
#include "vision/result.hpp"
#include "vision/seen_holder.hpp"
#include "vision/seen_needle.hpp"
#include "vision/stopwatch.hpp"

namespace punctum::vision {

class SeenCell {
 public:
  explicit SeenCell(const VisionConfig& config) : config_(config) {}

  void seed(const Circle& circle) { seed_ = circle; }  // it replaces the Hough transform
  // No frame was seen for a while: it may be anywhere.
  void go_on_from(const SeenCell& before) { seed_ = before.seed_; }

  [[nodiscard]] const FollowedMembrane& outer() const noexcept { return outer_; }
  [[nodiscard]] const FollowedMembrane& inner() const noexcept { return inner_; }
  // The outermost one that is known.
  [[nodiscard]] const FollowedMembrane& outermost() const noexcept { return outer_.known ? outer_ : inner_; }
  // What is seen of it against the holding pipette and the needle is compared with this.
  [[nodiscard]] Undeformed at_rest() const { return undeformed_.at_rest(); }
  // Standard deviation of where the needle's axis meets it at rest, px.
  [[nodiscard]] double entry_sd_px() const noexcept { return entry_sd_px_; }
  // By how much it lies further in than the tip of the needle, where it is dented to either side of that, px.
  [[nodiscard]] const std::optional<double>& ahead_of_tip_px() const noexcept { return ahead_of_tip_px_; }

  // Beside one that is followed, and somewhere in the picture.
  [[nodiscard]] bool looks_for_another() const noexcept { return held_.has_value(); }
  [[nodiscard]] bool must_start() const {
    return outer_.known ? outer_.lost() : !inner_.known || inner_.lost();
  }
  // Once per frame, before anything else: it goes where the holding pipette has gone, or where its edge is
  // seen to have gone, which takes the gradient of the whole picture.
  void begin(ClearedPicture& picture, const SeenHolder& holder);
  [[nodiscard]] bool is_held(const ClearedPicture& picture) const;  // at the mouth of the holding pipette
  // Its edge, where no holding pipette is known.
  [[nodiscard]] const Landmark& landmark() const noexcept { return landmark_; }
  // Once, when another one was found than the one that was touched.
  [[nodiscard]] bool is_another() noexcept { return std::exchange(another_, false); }
  // at_once: all of the search is done in this frame. False while no membrane is known.
  [[nodiscard]] bool start(const ClearedPicture& picture, const Touch& touch, bool at_once, Result& result);
  // Sets the membranes of the result.
  void follow(const ClearedPicture& picture, const SeenNeedle& needle, const Touch& touch, bool held,
              Result& result, Stopwatch& watch);
  // Sets its undeformed membrane, its entry and its gap. needle_hidden: it may touch the cell. False where it
  // is larger or smaller than cells of the scene: then it is none, and given up.
  [[nodiscard]] bool measure(const ClearedPicture& picture, const Touch& touch, bool needle_hidden, bool held,
                             Result& result);

 private:
  [[nodiscard]] std::optional<StartedMembranes> search(const ClearedPicture& picture, bool at_once);
  void take(StartedMembranes&& begun, const Touch& touch, const Result& result);
  void look_for_a_held_one(const ClearedPicture& picture, const Touch& touch, const Result& result);
  void doubt_outer(const ClearedPicture& picture, const Touch& touch, const Result& result);
  void see_edge(ClearedPicture& picture);
  void follow_snakes(const ClearedPicture& picture, Result& result, Stopwatch& watch);
  [[nodiscard]] bool round_as_if_untouched(const ClearedPicture& picture, const Touch& touch,
                                           const Result& result) const;
  [[nodiscard]] int fit_undeformed_membrane(const ClearedPicture& picture, const Touch& touch,
                                            bool needle_hidden, bool held, Result& result);
  [[nodiscard]] bool is_of_the_scene(double r_px) const;
  void give_up(Result& result);
  void measure_gap(int fitted_points, Result& result);

  static constexpr int kFirstLook = 25;  // frames with one that is not held; after twice as many again, ..
  static constexpr int kFirstDoubt = 5;  // frames without the inner membrane; after twice as many again, ..

  const VisionConfig& config_;
  std::optional<Circle> seed_;
  FollowedMembrane outer_, inner_;
  std::optional<CellSearch> search_;                  // while there is more to do
  std::optional<CellSearch> held_;                    // of one that is held, beside another one
  int not_held_ = 0, next_look_ = kFirstLook;         // frames
  int inner_missing_ = 0, next_doubt_ = kFirstDoubt;  // frames
  LearntUndeformed undeformed_;                       // of the outer one
  double entry_sd_px_ = 0;
  std::optional<double> ahead_of_tip_px_;
  bool another_ = false;
  EdgePattern pattern_;  // of the outermost one, where no holding pipette is known; learnt with this middle
  Point pattern_centre_;
  Landmark landmark_;
  // By which it moved with the holding pipette since the last frame, px; and in one jump, which all that is
  // kept of it has gone along with.
  std::optional<Point> carried_;
  Point jump_;
  int frames_lost_ = 0;  // that showed another one than that which was touched
};

}  // namespace punctum::vision
