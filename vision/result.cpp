#include "vision/result.hpp"

#include <algorithm>
#include <iterator>

namespace punctum::vision {

std::string verdict_on(const Result& result, const VisionConfig& config) {
  std::string v;
  const auto say = [&v](const char* what, bool wanted, const auto& found) {
    if (wanted && !found.ok) {
      v += (v.empty() ? "" : "; ") + (what + (": " + (found.reason.empty() ? "not found" : found.reason)));
    }
  };
  say("holder", config.holder.has_value(), result.holder);
  say("needle", config.needle, result.needle);
  say("outer", true, result.outer);
  say("inner", config.inner, result.inner);
  return v.empty() ? "ok" : v;
}

void tell_in_fine_pixels(Result& r, const Binning& binning) {
  const double k = binning.by;
  const auto place = [&](Point& p) { p = binning.fine(p); };
  const auto lengths = [&](auto&... length) { ((length *= k), ...); };
  const auto if_known = [&](auto&... length) { ((length ? void(*length *= k) : void()), ...); };
  place(r.holder.mouth);
  const Point corner = binning.fine(r.holder.box.tl() - Point(0.5, 0.5));
  r.holder.box = {corner.x + 0.5, corner.y + 0.5, r.holder.box.width * k, r.holder.box.height * k};
  place(r.needle.tip);
  lengths(r.holder.sd, r.needle.sd, r.needle.constant_sd, r.needle.half_width, r.needle.point_aside);
  for (Membrane* m : {&r.outer, &r.inner}) {
    std::for_each(m->nodes.begin(), m->nodes.end(), place);
    std::for_each(m->contour.begin(), m->contour.end(), place);
    std::for_each(m->sd_px.begin(), m->sd_px.end(), lengths);
    lengths(m->residual_px);
  }
  if (r.undeformed) {
    place(r.undeformed->centre);
    lengths(r.undeformed->r, r.undeformed->rms, r.undeformed->r_sd);
  }
  for (std::size_t i = 0; i < r.points.point.size(); ++i) {
    if (r.points.point[i]) {
      place(*r.points.point[i]);
      lengths(r.points.behind_tip[i]);
    }
  }
  if (r.entry) {
    place(*r.entry);
  }
  if_known(r.inner_radius_px, r.gap_px, r.wd_px, r.a_px);
  lengths(r.membrane_velocity_px_s, r.gap_sd_px, r.wd_sd_px, r.a_sd_px);
  for (auto* net : {&r.outer_net, &r.inner_net}) {
    if (*net) {
      Section origin = Section::Zero();
      origin.head<2>().setConstant(0.5 * (k - 1));
      std::for_each_n((*net)->control.begin(), (*net)->size,
                      [&](Section& section) { section = k * section + origin; });
    }
  }
}

rt::Observation to_observation(const Result& r, const VisionConfig& config, int width, int height) {
  rt::Observation o;
  const double k = config.pixel_m;
  const auto place = [&](const Point& p, double (&out)[3]) {
    out[0] = (p.x - (width - 1) / 2.0) * k;
    out[1] = (p.y - (height - 1) / 2.0) * k;
    out[2] = 0;
  };
  o.frame = r.frame;
  o.exposure_ns = r.exposure_ns;
  o.flags = (r.holder.ok ? rt::Observation::holder_ok : 0U) | (r.needle.ok ? rt::Observation::tip_ok : 0U) |
            (r.outer.ok ? rt::Observation::outer_ok : 0U) | (r.inner.ok ? rt::Observation::inner_ok : 0U) |
            (r.contact ? rt::Observation::contact : 0U) | (r.punctured ? rt::Observation::punctured : 0U) |
            (r.inner_punctured ? rt::Observation::inner_punctured : 0U);
  if (r.needle.ok) {
    place(r.needle.point(), o.tip_m);
    o.axis[0] = r.needle.axis.x;
    o.axis[1] = r.needle.axis.y;
    o.axis[2] = 0;
  }
  if (r.holder.ok) {
    place(r.holder.mouth, o.holder_m);
  }
  o.holder_score = r.holder.score;
  if (r.undeformed) {
    place(r.undeformed->centre, o.centre_m);
    o.R_m = r.undeformed->r * k;
    o.R_sd_m = r.undeformed->r_sd * k;
  }
  o.R_inner_m = r.inner_radius_px.value_or(0) * k;
  if (r.entry) {
    place(*r.entry, o.entry_m);
  }
  o.gap_m = r.gap_px.value_or(0) * k;
  o.wd_m = r.wd_px.value_or(0) * k;
  o.a_m = r.a_px.value_or(0) * k;
  o.membrane_velocity_m_s = r.membrane_velocity_px_s * k;
  for (std::size_t i = 0; i < 2; ++i) {
    if (r.points.point[i]) {
      place(*r.points.point[i], o.contact_point_m[i]);
    }
  }
  o.noise_m = r.gap_sd_px * k;
  o.wd_sd_m = r.wd_sd_px * k;
  o.a_sd_m = r.a_sd_px * k;
  o.total_us = static_cast<std::uint64_t>(std::max(0.0, r.us.total));
  return o;
}

rt::CellSurface to_surface(const Result& r, const VisionConfig& config, int width, int height) {
  rt::CellSurface surface;
  surface.frame = r.frame;
  surface.exposure_ns = r.exposure_ns;
  const double k = config.pixel_m;
  Section origin = Section::Zero();
  origin.head<2>() << (width - 1) / 2.0, (height - 1) / 2.0;
  const auto fill = [&](const std::optional<MembraneNet>& net, rt::CellSurface::Flag flag,
                        rt::MembraneSurface& out) {
    if (!net || !net->ok || net->size != rt::MembraneSurface::kControlPoints) {
      return;
    }
    surface.flags |= flag;
    for (std::size_t i = 0; i < std::size(out.control_m); ++i) {
      Eigen::Map<Section>(out.control_m[i]) = k * (net->control[i] - origin);
    }
  };
  fill(r.outer_net, rt::CellSurface::outer_ok, surface.outer);
  fill(r.inner_net, rt::CellSurface::inner_ok, surface.inner);
  return surface;
}

}  // namespace punctum::vision
