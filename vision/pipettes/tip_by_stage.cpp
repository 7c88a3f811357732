#include "vision/pipettes/tip_by_stage.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace punctum::vision {

namespace {

// Standard deviation of the tip in the picture, by how it shows it: a membrane on the tip draws its end
// aside, granules round it by several pixels.
constexpr std::array kPicture_px = {0.3, 0.4, 0.8, 2.0};
constexpr double kScatter_px = 0.15;  // of the stage, before it is known
constexpr double kStageDrift_px = 0.03;    // per frame, of the picture against the stage
constexpr double kMost_px = 5;        // of disagreement, unless the needle has slipped or bent
constexpr int kDisagreements = 10;    // frames in a row; then how far off the stage is, is not known
constexpr int kStageMemory = 30;           // frames

double squared(double x) { return x * x; }

double variance_of(TipSeen how) {
  return squared(kPicture_px[static_cast<std::size_t>(how)]);
}

}  // namespace

void TipByStage::begin(const std::optional<Point>& stage) {
  moved_.reset();
  if (stage && stage_) {
    moved_ = *stage - *stage_;
  }
  stage_ = stage;
  variance_ += squared(kStageDrift_px);
}

std::optional<Point> TipByStage::tip() const {
  return stage_ && frames_ > 0 ? std::optional(*stage_ + off_) : std::nullopt;
}

Point TipByStage::most_likely(const NeedlePose& seen, TipSeen how) {
  const auto told = tip();
  if (!told) {
    return seen.tip;
  }
  const double apart = (*told - seen.tip).dot(seen.axis);
  disagreements_ = std::abs(apart) > kMost_px ? disagreements_ + 1 : 0;
  if (disagreements_ > kDisagreements) {
    frames_ = disagreements_ = 0;
    return seen.tip;
  }
  const double of_picture = variance_of(how);
  const double of_stage = variance_ + scatter_;
  return seen.tip + of_picture / (of_picture + of_stage) * apart * seen.axis;
}

void TipByStage::learn(const NeedlePose& seen, TipSeen how) {
  if (!stage_) {
    return;
  }
  const Point off = seen.tip - *stage_;
  if (frames_ == 0) {
    off_ = off;
    variance_ = variance_of(how);
    scatter_ = squared(kScatter_px);
    frames_ = 1;
    return;
  }
  const double surprise = (off - off_).dot(seen.axis);
  frames_ = std::min(frames_ + 1, kStageMemory);
  const double expected = variance_ + variance_of(how);
  scatter_ = std::max(0.0, scatter_ + (surprise * surprise - expected - scatter_) / frames_);
  const double gain = variance_ / (expected + scatter_);
  off_ += gain * (off - off_);
  variance_ *= 1 - gain;
}

}  // namespace punctum::vision
