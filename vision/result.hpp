// What one frame showed, in pixels, and the observation made of it, in metres.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rt/station/observation.hpp"
#include "rt/station/telemetry.hpp"
#include "vision/config.hpp"
#include "vision/holding_pipette.hpp"
#include "vision/membrane_following.hpp"

namespace punctum::vision {

// Microseconds spent on one frame, stage by stage; 0: the stage did not run.
struct StageTimes {
  double prepare = 0;  // noise, smoothing, Sobel
  double holder = 0;
  double needle = 0;
  double erase = 0;  // polygons, impurities
  double start = 0;  // Hough transform and first contours; not while following
  double outer = 0;
  double inner = 0;
  double contact = 0;  // contact points, dilation, labelling; not far from the cell
  double measure = 0;  // undeformed shape, R, gap
  double total = 0;
};

struct Result {
  std::uint64_t frame = 0;
  std::int64_t exposure_ns = 0;
  bool usable = false;  // the picture could be worked on at all
  double noise = 0;     // grey levels

  HolderFix holder;
  NeedleFix needle;
  Membrane outer, inner;
  std::optional<Circle> undeformed;       // of the outer membrane
  std::optional<double> inner_radius_px;  // mean of the inner one

  bool merged = false;  // the paper's test: dilation and labelling
  bool contact = false;
  bool punctured = false;
  ContactPoints points;
  std::optional<Point> entry;                 // needle's axis on the undeformed outer membrane
  std::optional<double> gap_px, wd_px, a_px;  // a is empty without a dimple; w_d is 0 then
  double membrane_velocity_px_s = 0;          // of the contact points, into the cell > 0
  double gap_noise_px = 0;
  rt::Phase phase = rt::Phase::free;
  int impurities = 0;

  StageTimes us;
  std::string verdict;  // "ok", or what is missing and why
};

// "ok", or what of the scene is missing and why.
[[nodiscard]] std::string verdict_on(const Result& result, const VisionConfig& config);

// Metres in the microscope's frame, for a picture of that size.
[[nodiscard]] rt::Observation to_observation(const Result& result, const VisionConfig& config, int width,
                                             int height);

}  // namespace punctum::vision
