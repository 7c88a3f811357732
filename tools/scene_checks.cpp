// What must fit together between the tables of a scene.
#include <fmt/format.h>

#include "tools/scene_keys.hpp"

namespace punctum::tools {
namespace {

constexpr double um(double m) { return m * 1e6; }

bool failing_device_is_there(const Scene& s, sim::Device d) {
  switch (d) {
    case sim::Device::camera:
      return s.sim->microscope.has_value();
    case sim::Device::injector:
      return s.sim->injector.has_value();
    case sim::Device::vacuum:
      return s.sim->holder.has_value();
    case sim::Device::force_sensor:
      return s.sim->force_sensor.has_value();
    case sim::Device::hand:
    case sim::Device::stage:
    case sim::Device::estop:
      return true;
  }
  return false;
}

}  // namespace

std::optional<Problem> check_together(const Scene& s) {
  const auto& servo = s.servo;
  const auto& sim = *s.sim;
  const auto& limits = servo.limits;

  // Things that need other things.
  const auto needs = [&](bool there, const char* what, bool has, const char* needed,
                         const char* why) -> std::optional<Problem> {
    if (!there || has) return std::nullopt;
    return Problem{
        what, fmt::format("needs [{}] ({}), allowed: add [{}] or leave [{}] out", needed, why, needed, what)};
  };
  const bool camera = s.recorded || sim.microscope;
  for (const auto& p : {
           needs(s.vision.has_value(), "vision", camera, "camera", "vision looks at pictures"),
           needs(camera, "camera", s.vision.has_value(), "vision", "nobody looks at the pictures"),
           needs(servo.phases.has_value(), "phases", s.vision.has_value(), "vision",
                 "vision sees contact and puncture"),
           needs(servo.local_model.has_value(), "local_model", s.vision.has_value(), "vision",
                 "vision corrects the local model"),
           needs(servo.membrane.has_value(), "membrane", servo.local_model.has_value(), "local_model",
                 "it says where the membrane is"),
           needs(servo.cone.has_value(), "cone", servo.local_model.has_value(), "local_model",
                 "it says where the entry point is"),
           needs(servo.axis.has_value(), "axis", servo.phases.has_value(), "phases", "withdrawal is a phase"),
           needs(servo.axis.has_value(), "axis", servo.local_model.has_value(), "local_model",
                 "it says where the entry point is"),
           needs(servo.phases.has_value(), "phases", servo.local_model.has_value(), "local_model",
                 "the phases follow its depth"),
           needs(sim.microscope && s.vision, "camera", sim.cell.has_value(), "cell",
                 "there is nothing to look at"),
           needs(sim.holder.has_value(), "holder", sim.cell.has_value(), "cell", "there is nothing to hold"),
           needs(servo.vacuum.has_value(), "vacuum", sim.holder.has_value(), "holder",
                 "suction needs a pipette"),
           needs(s.vision && s.vision->holder && sim.microscope, "vision.holder", sim.holder.has_value(),
                 "holder", "there is no holding pipette to find"),
           needs(s.vision && s.vision->inner && sim.microscope, "vision.inner", !sim.cell || sim.cell->inner,
                 "cell.inner", "there is no inner membrane to follow"),
       })
    if (p) return p;
  if (s.vision && s.vision->method == vision::Method::truth && !sim.microscope)
    return Problem{"vision.method", "\"truth\" is known of a simulated camera only, allowed: \"paper\""};
  if (s.recorded && s.clock == ClockKind::virtual_time)
    return Problem{"scene.clock", "\"virtual\" cannot wait for recorded frames, allowed: \"real\""};
  if (s.recorded && s.recorded->frames.empty())
    return Problem{"camera.frames", "is missing, allowed: a folder, a glob or a video file"};

  // Needle, cell and pipettes.
  const auto& needle = sim.needle;
  if (needle.shaft_radius_m < needle.radius_m)
    return Problem{"needle.shaft_radius_um",
                   fmt::format("{:g} is smaller than the tip, allowed: at least radius_um = {:g}",
                               um(needle.shaft_radius_m), um(needle.radius_m))};
  if (sim.cell) {
    const auto& c = *sim.cell;
    if (needle.radius_m * 4 > c.R_m)
      return Problem{"needle.radius_um",
                     fmt::format("is too thick for the cell, allowed: at most cell.radius_um / 4 = {:g}",
                                 um(c.R_m / 4))};
    if (c.zona_h_m * 4 > c.R_m)
      return Problem{
          "cell.zona_h_um",
          fmt::format("is too thick for the cell, allowed: at most radius_um / 4 = {:g}", um(c.R_m / 4))};
    if (c.inner && c.zona_h_m + c.inner_gap_m > 0.5 * c.R_m)
      return Problem{
          "cell.inner.gap_um",
          fmt::format("leaves no room inside the cell, allowed: at most radius_um / 2 - zona_h_um = {:g}",
                      um(0.5 * c.R_m - c.zona_h_m))};
    if (c.zona_puncture_strain <= c.zona_pretension)
      return Problem{
          "cell.zona_puncture_strain",
          fmt::format("is reached before the needle touches, allowed: above zona_pretension = {:g}",
                      c.zona_pretension)};
    const double gap = (sim.stage.start_m - c.centre_m).norm() - c.R_m;
    if (gap < needle.radius_m)
      return Problem{"stage.start_um",
                     fmt::format("is inside or at the cell, allowed: at least {:g} um from its centre",
                                 um(c.R_m + needle.radius_m))};
    // Sizes differ by up to 2.5 sigma; a held cell grows away from its pipette, on both sides towards the
    // needle.
    const double grows_m = (sim.holder ? 5 : 2.5) * c.spread * c.R_m;
    if (gap < needle.radius_m + grows_m)
      return Problem{
          "stage.start_um",
          fmt::format(
              "would be inside a large cell of this spread, allowed: at least {:g} um from its centre",
              um(c.R_m + needle.radius_m + grows_m))};
    if (um(limits.penetration_depth_m) > um(2 * c.R_m))
      return Problem{
          "limits.penetration_depth_um",
          fmt::format("goes through the cell, allowed: at most 2 * cell.radius_um = {:g}", um(2 * c.R_m))};
    if (limits.far_wall_m > c.R_m)
      return Problem{
          "limits.far_wall_um",
          fmt::format("leaves no room to inject, allowed: at most cell.radius_um = {:g}", um(c.R_m))};
    if (sim.person.depth_m > limits.penetration_depth_m)
      return Problem{"operator.depth_um", fmt::format("is deeper than the limit lets her, allowed: at most "
                                                      "limits.penetration_depth_um = {:g}",
                                                      um(limits.penetration_depth_m))};
    if (sim.holder) {
      const auto& h = *sim.holder;
      if (h.inner_radius_m >= h.outer_radius_m)
        return Problem{"holder.inner_radius_um",
                       fmt::format("is not smaller than the outer one, allowed: below outer_radius_um = {:g}",
                                   um(h.outer_radius_m))};
      if (h.inner_radius_m >= c.R_m)
        return Problem{"holder.inner_radius_um",
                       fmt::format("swallows the cell, allowed: below cell.radius_um = {:g}", um(c.R_m))};
      if (servo.vacuum && servo.vacuum->min_Pa >= h.vacuum_Pa)
        return Problem{
            "vacuum.min_Pa",
            fmt::format("is above the suction itself, allowed: below holder.vacuum_Pa = {:g}", h.vacuum_Pa)};
    }
  }

  // The core's numbers.
  if (servo.damping && servo.damping->B2_Ns_m < servo.damping->B1_Ns_m)
    return Problem{"damping.B2_Ns_m",
                   fmt::format("is below the damping outside, allowed: at least B1_Ns_m = {:g}",
                               servo.damping->B1_Ns_m)};
  if (servo.damping) {
    // Discrete stability of a mass with one tick of delay: B < 0.828 m / T.
    const double most = 0.828 * sim.hand.mass_kg * servo.rate_Hz;
    if (servo.damping->B2_Ns_m > most)
      return Problem{
          "damping.B2_Ns_m",
          fmt::format(
              "cannot be rendered at this rate, allowed: at most 0.828 haptic.mass_kg * rate_hz = {:g}",
              most)};
  }
  if (limits.tip_force_soft_N >= limits.tip_force_hard_N)
    return Problem{"limits.tip_force_soft_uN",
                   fmt::format("is not below the hard limit, allowed: below tip_force_hard_uN = {:g}",
                               um(limits.tip_force_hard_N))};
  if (limits.hand_force_N > sim.hand.force_max_N)
    return Problem{"limits.hand_force_N", fmt::format("is more than the device can do, allowed: at most "
                                                      "haptic.force_max_N = {:g}",
                                                      sim.hand.force_max_N)};
  if (limits.stage_velocity_m_s > sim.stage.velocity_max_m_s)
    return Problem{"limits.stage_velocity_um_s",
                   fmt::format("is more than the stage can do, allowed: at most "
                               "stage.velocity_max_um_s = {:g}",
                               um(sim.stage.velocity_max_m_s))};
  // The drive's own lag at full speed is no fault of its.
  const double lags_m = limits.stage_velocity_m_s * sim.stage.lag_s;
  if (lags_m > limits.following_error_m)
    return Problem{"limits.following_error_um",
                   fmt::format("the stage lags further behind at full speed, allowed: at least "
                               "stage_velocity_um_s * stage.lag_ms = {:g}",
                               um(lags_m))};
  if (servo.membrane && servo.membrane->c_m * 4 > servo.membrane->R_m)
    return Problem{"membrane.c_um", fmt::format("is too thick for the cell, allowed: at most R_um / 4 = {:g}",
                                                um(servo.membrane->R_m / 4))};
  for (int i = 0; i < 3; ++i) {
    const auto& m = servo.mapping;
    if (m.workspace_min_m[i] >= m.workspace_max_m[i])
      return Problem{"mapping.workspace_min_um",
                     fmt::format("is not below workspace_max_um in {}, allowed: below {:g}", "xyz"[i],
                                 um(m.workspace_max_m[i]))};
    if (sim.stage.start_m[i] < m.workspace_min_m[i] || sim.stage.start_m[i] > m.workspace_max_m[i])
      return Problem{"stage.start_um",
                     fmt::format("is outside the workspace in {}, allowed: from {:g} to {:g}", "xyz"[i],
                                 um(m.workspace_min_m[i]), um(m.workspace_max_m[i]))};
    if (std::abs(sim.stage.start_m[i]) > sim.stage.travel_m)
      return Problem{"stage.start_um",
                     fmt::format("is beyond the stage's travel in {}, allowed: within +-{:g}", "xyz"[i],
                                 um(sim.stage.travel_m))};
  }
  if (servo.phases && servo.phases->contact_on_m >= servo.phases->indentation_on_m)
    return Problem{"phases.contact_on_um", fmt::format("is not below indentation_on_um, allowed: below {:g}",
                                                       um(servo.phases->indentation_on_m))};
  if (servo.phases && servo.phases->contact_off_m >= servo.phases->clear_m)
    return Problem{"phases.contact_off_um",
                   fmt::format("is not below clear_um, allowed: below {:g}", um(servo.phases->clear_m))};

  // Camera and vision.
  const double fps = s.recorded ? s.recorded->fps : sim.microscope ? sim.microscope->fps : 0;
  if (fps > servo.rate_Hz / 2)
    return Problem{"camera.fps", fmt::format("is too fast for the servo, allowed: at most rate_hz / 2 = {:g}",
                                             servo.rate_Hz / 2)};
  if (servo.local_model && fps > 0) {
    const double latency = sim.microscope ? sim.microscope->latency_s : 0;
    const double least = 1.5 / fps + latency;
    if (servo.local_model->stale_after_s < least)
      return Problem{
          "local_model.stale_after_s",
          fmt::format("every frame would be stale, allowed: at least 1.5 / fps + latency = {:g}", least)};
  }
  if (s.vision) {
    const auto& v = *s.vision;
    if (v.R_min_m >= v.R_max_m)
      return Problem{"vision.radius_min_um",
                     fmt::format("is not below radius_max_um, allowed: below {:g}", um(v.R_max_m))};
    if (sim.cell && sim.microscope && (sim.cell->R_m < v.R_min_m || sim.cell->R_m > v.R_max_m))
      return Problem{"vision.radius_min_um",
                     fmt::format("the cell's radius of {:g} is not looked for, allowed: a range "
                                 "that contains it",
                                 um(sim.cell->R_m))};
  }

  for (int i = 0; i < sim.failure_count; ++i) {
    const auto& f = sim.failures[static_cast<std::size_t>(i)];
    if (!failing_device_is_there(s, f.device))
      return Problem{fmt::format("failure[{}].device", i),
                     "this scene has no such device, allowed: one that is there"};
  }
  return std::nullopt;
}

}  // namespace punctum::tools
