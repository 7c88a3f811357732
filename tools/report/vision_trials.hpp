// Errors and times of the methods of topic vision.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "tools/report/simulated_frames.hpp"
#include "tools/report/topic.hpp"
#include "tools/report/vision_methods.hpp"
#include "vision/image/polyline.hpp"

namespace punctum::report {

// A sample of numbers; those that are not finite are left out.
struct Sample {
  std::vector<double> all;
  void add(double x) {
    if (std::isfinite(x)) {
      all.push_back(x);
    }
  }
  [[nodiscard]] double rms() const {
    double sum = 0;
    for (double x : all) {
      sum += x * x;
    }
    return all.empty() ? std::nan("") : std::sqrt(sum / static_cast<double>(all.size()));
  }
  [[nodiscard]] double quantile(double q) const {  // of the absolute values
    if (all.empty()) {
      return std::nan("");
    }
    std::vector<double> v;
    for (double x : all) {
      v.push_back(std::abs(x));
    }
    const auto i = static_cast<std::size_t>(q * static_cast<double>(v.size() - 1) + 0.5);
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(i), v.end());
    return v[i];
  }
};

struct TrueLines {
  vision::Polyline outer, inner;
};

// One method with one value of its knob, on all frames of one noise level.
struct Trial {
  const VisionMethod* method;
  double value;
  double noise;
  Sample outer_frames{}, outer_points{}, inner_frames{}, inner_points{}, tip{}, wd{}, a{}, R{}, force{}, us{};
  Sample outer_stretch[kStretches]{};
  int frames = 0, seen = 0, good = 0;
  double length_px = 0;      // mean of the true outer contour
  vision::Contour newest{};  // outer contour of the last frame that showed one

  [[nodiscard]] std::string knob() const { return fmt::format(fmt::runtime(method->knob), value); }
  [[nodiscard]] bool shipped() const { return value == method->shipped; }

  void score(const vision::Result& r, const FrameTruth& t, const TrueLines& truth, double pixel_m,
             double c_m);
};

// Times of the stages of the shipped tracker.
struct StageSamples {
  static constexpr std::pair<const char*, double vision::StageTimes::*> kAll[] = {
      {"prepare", &vision::StageTimes::prepare}, {"needle", &vision::StageTimes::needle},
      {"holder", &vision::StageTimes::holder},   {"erase", &vision::StageTimes::erase},
      {"start", &vision::StageTimes::start},     {"outer", &vision::StageTimes::outer},
      {"inner", &vision::StageTimes::inner},     {"measure", &vision::StageTimes::measure},
      {"contact", &vision::StageTimes::contact}, {"total", &vision::StageTimes::total}};
  Sample following[std::size(kAll)], starting[std::size(kAll)];

  void add(const vision::StageTimes& us) {
    for (std::size_t i = 0; i < std::size(kAll); ++i) {
      (us.start > 0 ? starting : following)[i].add(us.*kAll[i].second);
    }
  }
};

// Of one call of a method, less the time that reading the clock takes.
[[nodiscard]] CallTime call_time(const Sample& us, double overhead_us);

}  // namespace punctum::report
