#include "tools/report/foreign_frames.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "hal/recorded/picture.hpp"
#include "tools/report/watched_programs.hpp"

namespace punctum::report {

namespace {

namespace fs = std::filesystem;

vision::Contour contour_of(const nlohmann::json& points) {
  vision::Contour out;
  for (const auto& p : points) {
    out.emplace_back(p.at(0).get<double>(), p.at(1).get<double>());
  }
  return out;
}

Stretch stretch_of(const std::string& phase) {
  return phase == "approach"   ? Stretch::approach
         : phase == "contact"  ? Stretch::indentation
         : phase == "puncture" ? Stretch::recoil
                               : Stretch::inside;
}

FrameTruth truth_of(const nlohmann::json& told, double pixel_m) {
  FrameTruth t;
  t.stretch = stretch_of(told.at("phase"));
  t.outer = contour_of(told.at("outer"));
  t.inner = contour_of(told.at("inner"));
  t.tip = {told.at("tip").at(0).get<double>(), told.at("tip").at(1).get<double>()};
  t.axis = {-1, 0};
  t.centre = vision::centroid(t.outer);
  t.wd_m = told.at("wd_px").get<double>() * pixel_m;
  t.a_m = t.R_m = std::nan("");
  return t;
}

}  // namespace

tl::expected<DrawnInjection, std::string> foreign_injection(const ForeignPlan& plan) {
  const char* data = std::getenv("PUNCTUM_DATA");
  const fs::path renderer = fs::path(data != nullptr ? data : "../shared/data") / "../frames/render.py";
  if (!fs::exists(renderer)) {
    return tl::unexpected(renderer.string() + " is not there");
  }
  try {
    const TemporaryFolder folder;
    const fs::path drawn = folder / "frames";
    run_all({{.name = "python3",
              .args = {renderer.string(), drawn.string(), fmt::format("{}", plan.seed),
                       fmt::format("{}", plan.noise), fmt::format("{}", plan.frames)},
              .log = folder / "log"}},
            1);
    DrawnInjection out;
    out.lens.noise = plan.noise;
    for (const auto& told : nlohmann::json::parse(read_text(drawn / "truth.json"))) {
      auto picture = recorded::read_picture(drawn / fmt::format("frame_{:04}.png", out.pixels.size()));
      if (!picture) {
        return tl::unexpected(picture.error());
      }
      out.lens.width = picture->width;
      out.lens.height = picture->height;
      out.pixels.push_back(std::move(picture->pixels));
      out.truth.push_back(truth_of(told, out.lens.pixel_m));
    }
    return out;
  } catch (const std::exception& e) {
    return tl::unexpected(std::string(e.what()));
  }
}

}  // namespace punctum::report
