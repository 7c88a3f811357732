#include "tools/vision/live_stage.hpp"

#include <cmath>

namespace punctum::tools {

std::optional<cv::Point2d> stage_tip_at(const rt::CoreSegment& core, std::int64_t exposure_ns) {
  constexpr double kOldest_s = 0.02;  // further carried on, a needle that turns round is elsewhere
  constexpr double kFarthest_m = 1;
  constexpr std::uint64_t kKept =
      rt::TelemetryRing::kSize - rt::TelemetryRing::kSize / 8;  // not overwritten now
  if (core.status.started.load() == 0) {
    return std::nullopt;
  }
  const double t_s =
      static_cast<double>(exposure_ns - static_cast<std::int64_t>(core.status.start_ns.load())) * 1e-9;
  const double before_s = t_s - 0.5e-9 * static_cast<double>(core.status.period_ns.load());
  rt::TelemetrySample sample, last;
  // The last sample before the exposure's own.
  std::uint64_t high = core.telemetry.head(), low = high > kKept ? high - kKept : 0;
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (core.telemetry.read(middle, sample) != hal::Read::ok) {
      return std::nullopt;
    }
    (sample.t_s < before_s ? low : high) = sample.t_s < before_s ? middle + 1 : middle;
  }
  if (low < 2 || core.telemetry.read(low - 1, last) != hal::Read::ok ||
      core.telemetry.read(low - 2, sample) != hal::Read::ok || !(last.t_s > sample.t_s) ||
      !(last.t_s < before_s) || !(t_s - last.t_s < kOldest_s)) {
    return std::nullopt;
  }
  const double on = (t_s - last.t_s) / (last.t_s - sample.t_s);
  const cv::Point2d now(last.tip_m[0] + on * (last.tip_m[0] - sample.tip_m[0]),
                        last.tip_m[1] + on * (last.tip_m[1] - sample.tip_m[1]));
  return std::abs(now.x) < kFarthest_m && std::abs(now.y) < kFarthest_m ? std::optional(now) : std::nullopt;
}

}  // namespace punctum::tools
