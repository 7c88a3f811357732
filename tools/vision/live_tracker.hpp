// The tracker of a live camera, which starts anew after a gap in time. What it knew of the places of needle
// and cell, and of where they were going, is then of another moment: followed from there, a needle that has
// moved away may never be found again.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>

#include "vision/tracker.hpp"

namespace punctum::tools {

class LiveTracker {
 public:
  // The needle is looked for within some 25 pixels of where it was. Drawn back at 100 um/s it leaves them in
  // a quarter of a second, and the search widens while it is lost. Within a second it has been found so far;
  // after three it was not.
  static constexpr std::int64_t kLongestGap_ns = 1'000'000'000;
  // A camera may be slow: so many of its own intervals are no gap either.
  static constexpr std::int64_t kLongestGap_intervals = 5;

  // An empty template: it is cut from the first frame. The clock is the one that frames are stamped with.
  LiveTracker(const vision::VisionConfig& config, int width, int height, const cv::Mat& holder_template,
              hal::Clock& clock)
      : clock_(clock), tracker_(config, width, height) {
    if (!holder_template.empty()) {
      tracker_.holder_template(holder_template);
    }
  }

  // As vision::Tracker::process. The search of a whole frame takes a slow machine seconds, in which it can
  // take no other one: that is no gap, or it would search for ever. Meanwhile the core, without sight, lets
  // the needle only withdraw.
  const vision::Result& process(const hal::Frame& frame,
                                const std::optional<vision::Point>& stage = std::nullopt) {
    const std::int64_t begun_ns = clock_.now_ns();
    if (last_ns_ != kNever) {
      slept_ = slept_ || begun_ns - ready_ns_ > kLongestGap_ns;
      const std::int64_t interval_ns = frame.exposure_ns - last_ns_;
      const std::int64_t waited_ns = frame.exposure_ns - std::max(last_ns_, ready_ns_);
      if ((waited_ns > kLongestGap_ns || (slept_ && interval_ns > kLongestGap_ns)) &&
          interval_ns / kLongestGap_intervals >= shortest_ns_ && found_) {
        tracker_.after_gap();
        ++restarts_;
        found_ = following_ = slept_ = false;
      }
      shortest_ns_ = interval_ns > 0 ? std::min(shortest_ns_, interval_ns) : shortest_ns_;
    }
    last_ns_ = frame.exposure_ns;
    const vision::Result& result = tracker_.process(frame, stage);
    found_ = found_ || result.needle.ok || result.outer.ok;
    ready_ns_ = clock_.now_ns();
    slept_ = slept_ || (following_ && ready_ns_ - begun_ns > kLongestGap_ns);
    following_ = result.needle.ok && result.outer.ok;
    return result;
  }
  [[nodiscard]] int restarts() const noexcept { return restarts_; }

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();

  hal::Clock& clock_;
  vision::Tracker tracker_;
  std::int64_t last_ns_ = kNever;   // the last frame's exposure
  std::int64_t ready_ns_ = kNever;  // for the next one
  std::int64_t shortest_ns_ = std::numeric_limits<std::int64_t>::max();
  int restarts_ = 0;
  bool found_ = false;  // needle or cell, since it began
  // The process was stopped while it waited for a picture, or while it looked at one as quickly as always. A
  // picture of before may still come first.
  bool slept_ = false;
  bool following_ = false;  // needle and cell, in the last picture
};

}  // namespace punctum::tools
