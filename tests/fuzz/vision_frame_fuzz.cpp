// Any bytes as a picture of any size: the tracker gives a verdict, never crashes, and its numbers are finite.
#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/fuzz/must.hpp"
#include "vision/tracker.hpp"

// Bytes 0 and 1: width and height (1 .. 256). Byte 2: bits of the configuration. The rest: pixels, repeated
// to fill the picture; a second frame starts at another place of them.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace punctum;
  if (size < 4) {
    return 0;
  }
  const int width = data[0] + 1, height = data[1] + 1;
  vision::VisionConfig config;
  config.inner = (data[2] & 1) != 0;
  config.needle = (data[2] & 2) != 0;
  if ((data[2] & 4) != 0) {
    config.holder.reset();
  }
  config.method = (data[2] & 8) == 0 ? vision::Method::tracker : vision::Method::paper;
  config.R_min_m = (data[2] & 16) != 0 ? 10e-6 : 35e-6;
  vision::Tracker tracker(config, width, height);
  const std::size_t bytes = size - 3;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      pixels[i] = data[3 + (i + k * 7) % bytes];
    }
    hal::Frame frame;
    frame.pixels = pixels.data();
    frame.width = width;
    frame.height = height;
    frame.stride = width;
    frame.sequence = k;
    frame.exposure_ns = static_cast<std::int64_t>(k) * 40'000'000;
    const vision::Result& r = tracker.process(frame);
    must(!r.verdict.empty(), "no verdict");
    for (const auto* m : {&r.outer, &r.inner}) {
      must(!m->ok || m->contour.size() >= 128, "a contour of too few points");
      for (const auto& p : m->contour) {
        must(std::isfinite(p.x) && std::isfinite(p.y), "a contour that is not finite");
      }
    }
    const rt::Observation o = vision::to_observation(r, config, width, height);
    for (const double v :
         {o.tip_m[0], o.tip_m[1], o.R_m, o.gap_m, o.wd_m, o.a_m, o.noise_m, o.membrane_velocity_m_s}) {
      must(std::isfinite(v), "an observation that is not finite");
    }
  }
  return 0;
}
