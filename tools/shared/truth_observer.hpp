// Vision's answer without a picture: what the simulated world knows of itself, as an observation.
#pragma once

#include <cstdint>
#include <optional>

#include "hal/sim/truth.hpp"
#include "rt/station/observation.hpp"

namespace punctum::tools {

// `before`: of the observation before, for the membrane's velocity.
[[nodiscard]] inline rt::Observation observe_truth(const sim::Truth& t, std::uint64_t frame,
                                                   std::int64_t exposure_ns,
                                                   const std::optional<sim::Truth>& before) {
  rt::Observation o;
  o.frame = frame;
  o.exposure_ns = exposure_ns;
  o.flags = rt::Observation::tip_ok;
  const auto put = [](const sim::Vec3& v, double (&out)[3]) {
    out[0] = v.x();
    out[1] = v.y();
    out[2] = v.z();
  };
  put(t.tip_m, o.tip_m);
  put(t.axis, o.axis);
  if (t.holder_mouth_m) {
    o.flags |= rt::Observation::holder_ok;
    put(*t.holder_mouth_m, o.holder_m);
    o.holder_score = 1;
  }
  if (!t.cell) {
    return o;
  }
  o.flags |= rt::Observation::outer_ok | (t.R_inner_m > 0 ? rt::Observation::inner_ok : 0U) |
             (t.contact ? rt::Observation::contact : 0U) |
             (t.zona_punctured ? rt::Observation::punctured : 0U) |
             (t.R_inner_m > 0 && t.punctured ? rt::Observation::inner_punctured : 0U);
  put(t.centre_m, o.centre_m);
  o.R_m = t.R_m;
  o.R_inner_m = t.R_inner_m;
  put(t.entry_m, o.entry_m);
  o.gap_m = t.gap_m;
  o.wd_m = t.wd_m;
  o.a_m = t.wd_m > 0 ? t.a_m : 0;
  if (before && before->cell && t.t_s > before->t_s) {
    o.membrane_velocity_m_s = (t.wd_m - before->wd_m) / (t.t_s - before->t_s);
  }
  put(t.tip_m, o.contact_point_m[0]);
  put(t.tip_m, o.contact_point_m[1]);
  o.noise_m = 1e-9;
  return o;
}

}  // namespace punctum::tools
