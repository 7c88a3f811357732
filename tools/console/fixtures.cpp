#include "tools/console/fixtures.hpp"

#include <nlohmann/json.hpp>

namespace punctum::console {

std::string fixtures_json(const rt::ServoConfig& config) {
  using nlohmann::ordered_json;
  const auto vector = [](const hal::Vec3& v) { return ordered_json{v.x(), v.y(), v.z()}; };
  ordered_json all = ordered_json::object();
  if (config.cone) {
    all["cone"] = {{"alpha_rad", config.cone->alpha_rad}};
  }
  if (const auto& f = config.forbidden) {
    all["needle"] = {
        {"tip_radius_m", f->tip_radius_m}, {"shaft_radius_m", f->shaft_radius_m}, {"taper_m", f->taper_m}};
    if (f->floor) {
      all["floor"] = {{"z_m", f->floor->z_m}, {"clearance_m", f->clearance_m}};
    }
    if (f->holder) {
      all["holder"] = {{"mouth_m", vector(f->holder->mouth_m)},
                       {"axis", vector(f->holder->axis)},
                       {"radius_m", f->holder->radius_m},
                       {"clearance_m", f->clearance_m}};
    }
  }
  return all.dump();
}

}  // namespace punctum::console
