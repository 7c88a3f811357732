#include "tools/report/foreign_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <tuple>
#include <utility>

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
  t.holder = {told.at("holder").at(0).get<double>(), told.at("holder").at(1).get<double>()};
  return t;
}

}  // namespace

DrawnInjection read_foreign(const fs::path& drawn) {
  DrawnInjection out;
  const fs::path file = drawn / "truth.json";
  try {
    for (const auto& told : nlohmann::json::parse(read_text(file))) {
      out.truth.push_back(truth_of(told, out.lens.pixel_m));
      auto picture = recorded::read_picture(drawn / fmt::format("frame_{:04}.png", out.pixels.size()));
      if (!picture) {
        throw std::runtime_error(picture.error());
      }
      out.lens.width = picture->width;
      out.lens.height = picture->height;
      out.pixels.push_back(std::move(picture->pixels));
    }
  } catch (const nlohmann::json::exception& e) {
    throw std::runtime_error(
        fmt::format("{}: frame {}: {}; each frame has a phase, outer and inner contours and tip and holder "
                    "[px], and wd_px",
                    file.string(), out.truth.size(), e.what()));
  }
  return out;
}

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
    DrawnInjection out = read_foreign(drawn);
    out.lens.noise = plan.noise;
    return out;
  } catch (const std::exception& e) {
    return tl::unexpected(std::string(e.what()));
  }
}

std::vector<ForeignFolder> foreign_folders(const fs::path& frames) {
  std::vector<ForeignFolder> found;
  for (const auto& kind : fs::directory_iterator(frames)) {
    const std::string name = kind.path().filename().string();
    if (!kind.is_directory() || !name.starts_with("noise-")) {
      continue;
    }
    PictureKind pictures{.renderer = "another",
                         .name = name,
                         .noise = std::strtod(name.c_str() + std::strlen("noise-"), nullptr),
                         .blur_px = sim::MicroscopeParams{}.psf_px};
    if (const auto blur = name.find(",blur="); blur != std::string::npos) {
      pictures.blur_px = std::strtod(name.c_str() + blur + std::strlen(",blur="), nullptr);
    }
    for (const auto& sequence : fs::directory_iterator(kind)) {
      if (fs::exists(sequence.path() / "truth.json")) {
        found.push_back({pictures, sequence.path()});
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const ForeignFolder& a, const ForeignFolder& b) {
    return std::tie(a.kind, a.folder) < std::tie(b.kind, b.folder);
  });
  return found;
}

}  // namespace punctum::report
