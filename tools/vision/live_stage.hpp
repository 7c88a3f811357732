// Where the manipulator's encoders had the needle's tip when a picture was taken, from the core's telemetry.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>

#include "rt/station/station.hpp"

namespace punctum::tools {

// Metres, microscope frame; at most a tick or two carried on from the last samples before the exposure.
// The tick of the exposure itself may not be written yet, and whether it is must change nothing. Empty where
// the core has not told it.
[[nodiscard]] std::optional<cv::Point2d> stage_tip_at(const rt::CoreSegment& core, std::int64_t exposure_ns);

}  // namespace punctum::tools
