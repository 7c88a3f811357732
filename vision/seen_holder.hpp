// The holding pipette from frame to frame: its tube is looked for at the border, then its mouth is followed.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <span>

#include "vision/config.hpp"
#include "vision/image/landmark.hpp"
#include "vision/membrane/cleared_picture.hpp"
#include "vision/membrane/followed_membrane.hpp"
#include "vision/pipettes/drifting_place.hpp"
#include "vision/pipettes/holding_pipette.hpp"
#include "vision/pipettes/pipette_mask.hpp"

namespace punctum::vision {

class SeenHolder {
 public:
  explicit SeenHolder(const VisionConfig& config)
      : config_(config), pipette_(config.holder.value_or(HolderVision{})) {}

  void use_template(const cv::Mat& pattern);  // CV_8U
  // No frame was seen for a while: only a template that was given stays.
  void go_on_from(SeenHolder& before);

  // Once per frame, before anything else: whether its tube is looked for in this one.
  void begin();
  [[nodiscard]] bool due() const noexcept { return due_; }
  [[nodiscard]] bool found() const noexcept { return tube_.has_value(); }
  // Found, and the cell was last seen at its mouth or nowhere.
  [[nodiscard]] bool holds() const noexcept { return found() && !beside_; }
  // Its mouth, where it is seen exactly.
  [[nodiscard]] const Landmark& landmark() const noexcept { return landmark_; }
  // Tells the picture its face as well. sides: the borders that it may enter through.
  [[nodiscard]] HolderPose locate(ClearedPicture& picture, std::span<const Side> sides);
  // Once per frame that shows a cell, after it was located. What does not hold it may be no pipette, such as
  // a box with writing in it: its place is neither claimed nor believed.
  void compare_with_cell(bool at_mouth, HolderPose& holder);
  // What is erased of it, where it is found. The paper's snake needs the membrane that the pipette touches:
  // there the contact with the membrane is the end of what is erased.
  [[nodiscard]] Polygon polygon(const ClearedPicture& picture, const FollowedMembrane& outer) const;

 private:
  void follow_mouth(HolderPose& holder);
  void doubt(HolderPose& holder) const;

  const VisionConfig& config_;
  HoldingPipette pipette_;
  DriftingPlace mouth_;
  Landmark landmark_;
  std::optional<TubeTrace> tube_;
  bool template_given_ = false;
  bool due_ = false;
  bool beside_ = false;  // the cell is not at its mouth
  int frames_ = 0;       // without it
};

}  // namespace punctum::vision
