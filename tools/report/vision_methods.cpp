#include "tools/report/vision_methods.hpp"

#include <memory>

namespace punctum::report {

namespace {

Observer tracked(const vision::VisionConfig& config, int width, int height) {
  auto tracker = std::make_shared<vision::Tracker>(config, width, height);
  return [tracker](const hal::Frame& frame) -> const vision::Result& { return tracker->process(frame); };
}

}  // namespace

std::vector<VisionMethod> vision_methods() {
  using vision::VisionConfig;
  const VisionConfig shipped;
  return {
      {"paper's method",
       "{} nodes",
       {8, 16, 32, 64, 128},
       {16, 64},
       [](VisionConfig c, double nodes, int w, int h) {
         c.method = vision::Method::paper;
         c.snake.nodes = static_cast<int>(nodes);
         return tracked(c, w, h);
       }},
      {"paper's method (64 nodes)",
       "search +-{} px",
       {1, 2, 4},
       {},
       [](VisionConfig c, double radius, int w, int h) {
         c.method = vision::Method::paper;
         c.snake.nodes = 64;
         c.snake.radius_px = static_cast<int>(radius);
         return tracked(c, w, h);
       }},
      {"closed path",
       "{} angles",
       {128, 192, 256, 384, 512},
       {128, 256, 512},
       [](VisionConfig c, double angles, int w, int h) {
         c.contour_points = static_cast<int>(angles);
         return tracked(c, w, h);
       },
       1,
       static_cast<double>(shipped.contour_points)},
      {"closed path (outer only)",
       "{} angles",
       {256},
       {256},
       [](VisionConfig c, double angles, int w, int h) {
         c.inner = false;
         c.contour_points = static_cast<int>(angles);
         return tracked(c, w, h);
       },
       1,
       std::nan(""),
       false},
      {"closed path (started anew)",
       "{} angles",
       {256},
       {256},
       [](const VisionConfig& config, double angles, int w, int h) -> Observer {
         VisionConfig c = config;
         c.contour_points = static_cast<int>(angles);
         auto tracker = std::make_shared<std::unique_ptr<vision::Tracker>>();
         return [=](const hal::Frame& frame) -> const vision::Result& {
           *tracker = std::make_unique<vision::Tracker>(c, w, h);
           return (*tracker)->process(frame);
         };
       },
       12},
  };
}

}  // namespace punctum::report
