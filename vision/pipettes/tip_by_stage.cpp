#include "vision/pipettes/tip_by_stage.hpp"

#include <algorithm>
#include <cmath>

#include "hal/math/elementary.hpp"

namespace punctum::vision {

namespace {

constexpr double kScatter_px = 0.15;          // of the stage, before it is known
constexpr double kStageDrift_px = 0.03;       // per frame, of the picture against the stage
constexpr double kMost_px = 8, kMost_sd = 3;  // of disagreement, unless the needle has slipped or bent
constexpr double kFastest_px = 25;            // in a frame; faster, it was placed anew
constexpr double kFarthest_px = 1e7;          // a number beyond it is no place
constexpr int kDisagreements = 10;            // frames in a row; then how far off the stage is, is not known
constexpr int kStageMemory = 30;              // frames
// A camera that is late shows a needle that moves fast where it was.
constexpr double kResting_px = 0.5;  // per frame
constexpr double kLatest_frames = 8;
constexpr double kMoved_px = 4, kStayed = 0.3;  // further than it may be late; share of it

double squared(double x) { return x * x; }

}  // namespace

void TipByStage::begin(const std::optional<Point>& stage) {
  moved_.reset();
  const bool told = stage && std::abs(stage->x) < kFarthest_px && std::abs(stage->y) < kFarthest_px;
  if (told && stage_) {
    moved_ = *stage - *stage_;
    if (cv::norm(*moved_) > kFastest_px) {  // it was placed anew
      moved_.reset();
      at_rest_.reset();
      in_motion_.reset();
      frames_ = 0;
    }
  }
  constexpr double kJump_px = 8;  // no hand moves it so far in a frame
  jumped_ = jumped_ || (moved_ && cv::norm(*moved_) > kJump_px) || !told;
  stage_ = told ? stage : std::nullopt;
  variance_ += squared(kStageDrift_px);
}

void TipByStage::jump_with_picture(const Point& by) {
  constexpr double kUncertain_px = 0.3;
  off_ += by;
  variance_ += squared(kUncertain_px);
  disagreements_ = 0;
  for (auto* from : {&at_rest_, &in_motion_}) {
    if (*from) {
      (*from)->tip += by;
    }
  }
}

void TipByStage::after_gap() {
  constexpr double kDrift_px = 1;
  stage_.reset();
  at_rest_.reset();
  in_motion_.reset();
  disagreements_ = 0;
  variance_ += squared(kDrift_px);
}

void TipByStage::forget() {
  const auto stage = stage_;
  *this = {};
  stage_ = stage;
}

std::optional<Point> TipByStage::tip() const {
  return stage_ && frames_ > 0 ? std::optional(*stage_ + off_) : std::nullopt;
}

double TipByStage::sd() const { return std::sqrt(variance_ + scatter_ + squared(constant_sd_)); }

// Further than picture and manipulator scatter.
bool TipByStage::far_apart(const NeedlePose& seen) const {
  const double of_both = squared(seen.sd) - squared(seen.constant_sd) + variance_ + scatter_;
  return std::abs((*stage_ + off_ - seen.tip).dot(seen.axis)) >
         std::max(kMost_px, kMost_sd * std::sqrt(of_both));
}

bool TipByStage::picture_strays(const NeedlePose& seen) {
  if (!tip() || !seen.ok) {
    return false;
  }
  const bool apart = far_apart(seen);
  jumped_ = jumped_ && apart;
  return apart && !jumped_;
}

NeedlePose TipByStage::most_likely(const NeedlePose& seen) {
  const auto told = tip();
  if (!told) {
    return seen;
  }
  const double apart = (*told - seen.tip).dot(seen.axis);
  // What is wrong in every frame is wrong in both.
  const double of_both = squared(seen.constant_sd);
  const double of_stage = variance_ + scatter_;
  double of_picture = squared(seen.sd) - of_both;
  const bool disagree = far_apart(seen);
  disagreements_ = disagree ? disagreements_ + 1 : 0;
  if (disagreements_ > kDisagreements) {
    frames_ = disagreements_ = 0;
  }
  if (disagree) {
    NeedlePose doubtful = seen;
    doubtful.sd = math::hypot(seen.sd, apart);
    return doubtful;
  }
  // Something is taken for its end: the picture errs by as much as that.
  if (squared(apart) > squared(kMost_sd) * (of_picture + of_stage)) {
    of_picture = squared(apart);
  }
  NeedlePose both = seen;
  both.tip += of_picture / (of_picture + of_stage) * apart * seen.axis;
  both.sd = std::sqrt(of_picture * of_stage / (of_picture + of_stage) + of_both);
  return both;
}

void TipByStage::learn(const NeedlePose& seen) {
  if (!stage_) {
    return;
  }
  compare(seen);
  const Point off = seen.tip - *stage_;
  constant_sd_ = seen.constant_sd;
  const double of_picture = squared(seen.sd) - squared(constant_sd_);
  if (frames_ == 0) {
    off_ = off;
    variance_ = of_picture;
    scatter_ = squared(kScatter_px);
    frames_ = 1;
    return;
  }
  frames_ = std::min(frames_ + 1, kStageMemory);
  const double expected = variance_ + of_picture, most = kMost_sd * std::sqrt(expected + scatter_);
  // Something may be taken for the end once: only what stays surprising is learnt.
  const double whole = (off - off_).dot(seen.axis), surprise = std::clamp(whole, -most, most);
  scatter_ = std::max(0.0, scatter_ + (surprise * surprise - expected - scatter_) / frames_);
  const double gain = variance_ / (expected + scatter_);
  off_ += gain * (off - off_ - (whole - surprise) * seen.axis);
  variance_ *= 1 - gain;
}

void TipByStage::compare(const NeedlePose& seen) {
  if (!moved_) {
    return;
  }
  const Compared now{*stage_, seen.tip, cv::norm(*moved_)};
  if (now.fastest <= kResting_px) {  // a speck on it goes with it aside
    const Point way = at_rest_ ? now.stage - at_rest_->stage : Point();
    picture_stays_ = stays(at_rest_, now, way.dot(seen.axis) * seen.axis, 0) || picture_stays_;
  }
  const Point way = in_motion_ ? now.stage - in_motion_->stage : Point();
  picture_stays_far_ = stays(in_motion_, now, way, kLatest_frames) || picture_stays_far_;
}

// way: of the manipulator, as far as it counts. late: frames, at most.
bool TipByStage::stays(std::optional<Compared>& from, const Compared& now, const Point& way, double late) {
  if (!from) {
    from = now;
  }
  from->fastest = std::max(from->fastest, now.fastest);
  const double far = cv::norm(way), moved = far - late * from->fastest;
  if (moved <= kMoved_px) {
    return false;
  }
  const bool stays = (now.tip - from->tip).dot(way) < kStayed * moved * far;
  picture_moves_ = !stays;
  from = now;
  return stays;
}

}  // namespace punctum::vision
