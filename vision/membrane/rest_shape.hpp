// The shape of a membrane at rest: learnt while nothing touches it, kept while the needle does.
#pragma once

#include <optional>

#include "vision/image/drift_covariance.hpp"
#include "vision/image/kept_vector.hpp"
#include "vision/membrane/cleared_picture.hpp"
#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

// Contour of one membrane.
struct RestOutline {
  Point centre;
  Vector<double> r;             // px per angle; empty: not known
  int frames = 0;               // that it was learnt from
  Point drift = {};             // px per frame, while it was learnt
  double spin = 0;              // rad per frame
  DriftCovariance turned = {};  // of the angle, and of spin

  [[nodiscard]] bool reliable() const noexcept;                             // learnt from enough frames
  [[nodiscard]] Vector<double> seen_from(const Point& other_centre) const;  // empty: not known
  void learn(const Point& now_centre, const Vector<double>& now_r);
  void turn(double rad);
  // Goes on turning as it did, and as what is seen of the contour where weight > 0 shows. Returns by how
  // much, rad.
  double turn_with(const Contour& contour, std::span<const double> weight);

 private:
  void turn_on();
  // px at the rim, and its variance; returns what of it is believed, rad.
  double turn_as_seen(double rim_px, double variance);
};

// Of a membrane that was never seen without the needle: what is seen of it away from the needle, and near the
// needle as far within the outline of the membrane around it as elsewhere. r: seen from `centre`; entry: of
// the needle.
[[nodiscard]] RestOutline outline_within(const RestOutline& around, const Point& centre,
                                         const Vector<double>& r, const Point& entry);

// The outer membrane with nothing touching it: the shape that is fitted to what touches nothing, and the
// outline of its outer face as it was seen. In contact both move with the holding
// pipette or, without one, as the cell drifted before.
class LearntUndeformed {
 public:
  // now: fitted to this frame. touched: the needle is near. learns: the outline of this frame is learnt, too.
  // mouth: of the holding pipette, where it is seen. Returns by how much an outline that is not learnt has
  // moved: with the holding pipette, or else as it drifted before; and turned, as the contour does where
  // weight > 0.
  struct Mouth {
    Point at;
    double sd = 0;  // px
  };
  struct Moved {
    Point shift;
    double turn = 0;  // rad
  };
  [[nodiscard]] Moved update(const Undeformed& now, bool touched, bool learns,
                             const std::optional<Mouth>& mouth, const Contour& contour,
                             std::span<const double> weight);
  // The contour of a frame in which nothing touches it, seen from `centre`.
  void learn_outline(const Contour& contour, const Point& centre);
  void forget();
  void jump_with_picture(const Point& by);
  [[nodiscard]] bool known() const noexcept { return shape_.has_value(); }
  [[nodiscard]] const std::optional<Undeformed>& shape() const noexcept { return shape_; }
  // Its shape is the outline as it was seen, if it ever was. Not before it is known.
  [[nodiscard]] Undeformed at_rest() const;
  // Whether a new outer contour is this cell in the same place. Where the needle may dent it, it may differ.
  [[nodiscard]] bool same_cell(const Contour& outer, const Point& centre, const NeedlePose& needle) const;

 private:
  [[nodiscard]] Point moved(const std::optional<Mouth>& mouth);

  std::optional<Undeformed> shape_;
  RestOutline face_;
  int frames_ = 0;  // that it was learnt from
  std::optional<Point> mouth_;
};

// Weights for fit_undeformed: 0 where the contour is hidden, may be dented at `entry`, or is pressed by the
// holding pipette.
[[nodiscard]] Vector<double> undeformed_weights(const Contour& contour, const ClearedPicture& picture,
                                                const std::optional<Point>& entry,
                                                const std::optional<Point>& mouth);

}  // namespace punctum::vision
