#include "vision/seen_holder.hpp"

#include <algorithm>
#include <utility>

#include "vision/membrane/undeformed.hpp"

namespace punctum::vision {

void SeenHolder::use_template(const cv::Mat& pattern) {
  pipette_.use_template(pattern);
  template_given_ = true;
}

void SeenHolder::go_on_from(SeenHolder& before) {
  if (before.template_given_) {
    pipette_ = std::move(before.pipette_);
    template_given_ = true;
  }
}

void SeenHolder::begin() {
  constexpr int kEvery = 8;  // frames between two searches for a tube that was not found
  due_ = config_.holder && !tube_ && frames_++ % kEvery == 0;
  landmark_.begin();
}

HolderPose SeenHolder::locate(ClearedPicture& picture, std::span<const Side> sides) {
  HolderPose holder;
  if (due_) {
    tube_ =
        find_holder_tube(picture.field, sides, picture.grey.rows, config_.px(config_.R_max_m), picture.noise);
  }
  if (!pipette_.has_template()) {
    holder.reason = tube_ ? pipette_.cut_template(picture.grey, *tube_, picture.noise)
                          : "no wide tube enters through the border";
  }
  if (pipette_.has_template()) {
    holder = pipette_.find(picture.grey);
    if (config_.method == Method::tracker) {
      pipette_.refine(picture.grey, holder);
      follow_mouth(holder);
    }
  }
  if (holder.ok && holder.sd > 0) {
    landmark_.seen(holder.mouth);
    if (tube_ && landmark_.jump()) {
      tube_->root += *landmark_.jump();
    }
  }
  if (tube_) {
    // The middle of a given template need not be the mouth.
    const Point mouth = holder.ok && !template_given_ ? holder.mouth : tube_->end();
    picture.holder_face = {mouth, tube_->axis, tube_->end_half_width};
  }
  doubt(holder);
  return holder;
}

void SeenHolder::compare_with_cell(bool at_mouth, HolderPose& holder) {
  beside_ = found() && !at_mouth;
  doubt(holder);
}

void SeenHolder::doubt(HolderPose& holder) const {
  if (beside_ && holder.ok) {
    holder.ok = false;
    holder.reason = "no cell at its mouth";
  }
}

// One picture tells it less surely than all of them.
void SeenHolder::follow_mouth(HolderPose& holder) {
  if (!holder.ok) {
    mouth_.unseen();
    return;
  }
  const auto [at, sd] = mouth_.next(holder.mouth, holder.sd);
  holder.box.x += at.x - holder.mouth.x;
  holder.box.y += at.y - holder.mouth.y;
  holder.mouth = at;
  holder.sd = sd;
}

Polygon SeenHolder::polygon(const ClearedPicture& picture, const FollowedMembrane& outer) const {
  constexpr double kInto_px = 2;  // the blur of the pipette's face reaches so far
  Point end = picture.holder_face->mouth;
  if (config_.method == Method::paper && outer.known) {
    if (const auto membrane = entry_point(outer.contour(), end, tube_->axis)) {
      end -= std::max(0.0, (end - *membrane).dot(tube_->axis) - kInto_px) * tube_->axis;
    }
  }
  return holder_polygon(*tube_, end, picture.grey.size(), 2, -1);
}

}  // namespace punctum::vision
