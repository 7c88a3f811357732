// What one frame shows, in pixels, and the observation that is made of it, in metres.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rt/station/observation.hpp"
#include "rt/station/surface.hpp"
#include "rt/station/telemetry.hpp"
#include "vision/config.hpp"
#include "vision/image/binning.hpp"
#include "vision/membrane/membrane_following.hpp"
#include "vision/membrane/membrane_on_needle.hpp"
#include "vision/pipettes/holding_pipette.hpp"
#include "vision/surface/membrane_net.hpp"

namespace punctum::vision {

// Microseconds spent on one frame, stage by stage; 0: the stage did not run.
struct StageTimes {
  double prepare = 0;  // noise, smoothing, Sobel
  double holder = 0;
  double needle = 0;
  double erase = 0;  // pipettes and impurities
  double start = 0;  // Hough transform and first contours; only until the membranes are followed
  double outer = 0;
  double inner = 0;
  double contact = 0;  // contact points, dilation, labelling; only near the cell
  double measure = 0;  // undeformed shape, R and gap
  double surface = 0;  // control nets of the membranes; only where the scene asks for them
  double total = 0;
};

struct Result {
  std::uint64_t frame = 0;
  std::int64_t exposure_ns = 0;
  bool usable = false;  // the frame is a picture of the right size and has contrast
  double noise = 0;     // grey levels

  HolderPose holder;
  NeedlePose needle;
  Membrane outer, inner;
  std::optional<Circle> undeformed;       // of the outer membrane
  std::optional<double> inner_radius_px;  // mean of the inner one

  // The paper's test of contact: dilation and labelling. The tracker makes it where the gap does not decide.
  bool merged = false;
  bool contact = false;
  bool punctured = false;        // the outer membrane
  bool inner_punctured = false;  // and the inner one
  ContactPoints points;
  std::optional<Point> entry;                 // where the needle's axis meets the undeformed outer membrane
  std::optional<double> gap_px, wd_px, a_px;  // without a dimple a is empty and w_d is 0
  double membrane_velocity_px_s = 0;          // of the contact points, > 0 into the cell
  double gap_sd_px = 0, wd_sd_px = 0, a_sd_px = 0;  // standard deviations, where the values are known
  std::optional<MembraneNet> outer_net, inner_net;
  rt::Phase phase = rt::Phase::free;
  int impurities = 0;

  StageTimes us;
  std::string verdict;  // see verdict_on()
};

// "ok"; or what of the scene was not found, and why.
[[nodiscard]] std::string verdict_on(const Result& result, const VisionConfig& config);

// Of a binned picture, in the pixels of the one that was binned.
void tell_in_fine_pixels(Result& result, const Binning& binning);

// In metres, in the frame of the microscope: the origin is the middle of the picture, which has that size.
[[nodiscard]] rt::Observation to_observation(const Result& result, const VisionConfig& config, int width,
                                             int height);
// The same frame and units; the nets have as many control points as the station's.
[[nodiscard]] rt::CellSurface to_surface(const Result& result, const VisionConfig& config, int width,
                                         int height);

}  // namespace punctum::vision
