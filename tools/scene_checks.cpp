// What must fit together between the tables of a scene.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rt/control/device_limits.hpp"
#include "rt/forces/cone_guide.hpp"
#include "rt/forces/membrane.hpp"
#include "rt/forces/ramp.hpp"
#include "tools/scene_keys.hpp"

namespace punctum::tools {
namespace {

constexpr double kLargestClick_N = 0.25;

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

// Four digits, rounded down: what is said to be allowed is allowed.
double rounded_down(double v) {
  if (!(v > 0) || !std::isfinite(v)) return v;
  const double unit = std::pow(10, std::floor(std::log10(v)) - 3);
  return std::floor(v / unit) * unit;
}

std::string device_text(const rt::ServoConfig& servo) {
  const auto& v = servo.velocity;
  return fmt::format(
      "m = haptic.mass_kg {:g}, T = 1/servo.rate_hz = {:g} ms, delay {} ticks, velocity by {}{}",
      servo.device.mass_kg, 1e3 / servo.rate_Hz, servo.device.delay_ticks,
      v.method == rt::VelocityParams::Method::kalman ? "Kalman filter"
                                                     : fmt::format("window of {} at 1 kHz", v.window),
      v.smooth_s > 0 ? fmt::format(" and low-pass of {:g} ms", v.smooth_s * 1e3) : "");
}

// Damping that would make the handle itself swing.
std::optional<Problem> check_damping(const rt::ServoConfig& servo) {
  if (!servo.damping && !servo.axis) return std::nullopt;
  const double T = 1 / servo.rate_Hz;
  const double most = rt::stable_damping_Ns_m(servo.device, T, servo.velocity);
  const std::string formula =
      fmt::format("at most {:g} m/T = {:g} ({})", rounded_down(most * T / servo.device.mass_kg),
                  rounded_down(most), device_text(servo));
  double inside = 0;
  if (const auto& d = servo.damping) {
    for (const auto& [key, B] : {std::pair{"damping.B1_Ns_m", d->B1_Ns_m}, {"damping.B2_Ns_m", d->B2_Ns_m}})
      if (!(B < most)) return Problem{key, fmt::format("{:g} cannot be rendered, allowed: {}", B, formula)};
    inside = std::max(d->B1_Ns_m, d->B2_Ns_m);
  }
  if (servo.axis && !(inside + servo.axis->B_inward_Ns_m < most))
    return Problem{"axis.B_inward_Ns_m", fmt::format("{:g} beside damping.B2_Ns_m = {:g} cannot be rendered, "
                                                     "allowed: together {}",
                                                     servo.axis->B_inward_Ns_m, inside, formula)};
  return std::nullopt;
}

// The largest stiffness that the membrane has at the hand, up to the force that a limit cuts off.
double membrane_stiffness_N_m(const rt::ServoConfig& servo) {
  if (!servo.membrane || !servo.local_model) return 0;
  const double k_p = servo.mapping.position_scale;
  const double k_f = servo.mapping.force_scale;
  constexpr int kSteps = 200;
  double largest = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double part = static_cast<double>(i) / kSteps;
    const rt::MembraneState m =
        rt::membrane_law(*servo.membrane, part * part * servo.limits.penetration_depth_m, servo.membrane->R_m,
                         servo.local_model->dimple_scale);
    largest = std::max(largest, m.stiffness_N_m * k_f / k_p);
    if (m.force_N > servo.limits.tip_force_hard_N || m.force_N * k_f > servo.limits.hand_force_N) break;
  }
  return largest;
}

struct Spring {
  const char* key;
  const char* name;
  double K_N_m;
};

// Springs that act at once beside damping B: stable with nobody at the handle, and passive where no guard
// sees to it.
std::optional<Problem> check_springs(const rt::ServoConfig& servo, std::initializer_list<Spring> springs,
                                     double B) {
  double K = 0;
  std::string sum;
  const Spring* stiffest = springs.begin();
  for (const Spring& s : springs) {
    if (!(s.K_N_m > 0)) continue;
    K += s.K_N_m;
    sum += fmt::format("{}{} {:.4g}", sum.empty() ? "" : " + ", s.name, s.K_N_m);
    if (s.K_N_m > stiffest->K_N_m) stiffest = &s;
  }
  if (sum.empty()) return std::nullopt;
  const double T = 1 / servo.rate_Hz;
  const double stable = rt::stable_stiffness_N_m(servo.device, T, servo.velocity, B);
  if (!(K <= stable))
    return Problem{
        stiffest->key,
        fmt::format("stiffness {} = {:.4g} N/m beside B = {:g} Ns/m swings by itself, allowed: at most {:g} "
                    "m/T^2 = {:g}, where a pole of 1 + (K + B V(z)) P(z) z^-delay reaches the unit circle "
                    "(b = haptic.damping_Ns_m {:g}, {})",
                    sum, K, B, rounded_down(stable * T * T / servo.device.mass_kg), rounded_down(stable),
                    servo.device.damping_Ns_m, device_text(servo))};
  const double passive = rt::passive_stiffness_N_m(servo.device, T);
  if (!servo.guard && !(K <= passive))
    return Problem{stiffest->key,
                   fmt::format("stiffness {} = {:.4g} N/m is not passive, allowed: at most b/(T/2 + delay) = "
                               "{:g} (b = haptic.damping_Ns_m {:g}, {}), or add [guard]",
                               sum, K, rounded_down(passive), servo.device.damping_Ns_m, device_text(servo))};
  return std::nullopt;
}

std::optional<Problem> check_stiffness(const rt::ServoConfig& servo) {
  const double cone = servo.cone ? rt::cone_stiffness_bound_N_m(*servo.cone) : 0;
  const double axis = servo.axis ? servo.axis->K_N_m : 0;
  const Spring repulsive{"repulsive.K_N_m", "repulsive", servo.repulsive ? servo.repulsive->K_N_m : 0};
  const Spring friction{"friction.K_N_m", "friction", servo.friction ? servo.friction->K_N_m : 0};
  const double B1 = servo.damping ? servo.damping->B1_Ns_m : 0;
  const double B2 = servo.damping ? servo.damping->B2_Ns_m : 0;
  const Spring membrane{"membrane.E_kPa", "membrane", membrane_stiffness_N_m(servo)};
  if (auto p = check_springs(servo, {{"cone.K_N_m", "cone", cone}, membrane, repulsive, friction}, B1))
    return p;

  // At the puncture the cone is switched off while the axis is switched on.
  double fading = 0;
  double both = axis;
  if (servo.cone && servo.axis) {
    constexpr int kSteps = 64;
    for (int i = 0; i < kSteps; ++i) {
      const double t_s = i * std::max(servo.cone->ramp_s, servo.axis->ramp_s) / kSteps;
      const double of_cone = cone * rt::smooth_step(1 - t_s / servo.cone->ramp_s);
      const double of_axis = axis * rt::smooth_step(t_s / servo.axis->ramp_s);
      if (of_cone + of_axis > both) {
        both = of_cone + of_axis;
        fading = of_cone;
      }
    }
  }
  const Spring inside{"axis.K_N_m", "axis", both - fading};
  const double one_way = servo.axis ? servo.axis->B_inward_Ns_m : 0;
  for (const double B : {B1, B2, B2 + one_way})
    if (auto p = check_springs(servo, {inside, {"cone.K_N_m", "cone", fading}, repulsive, friction}, B))
      return p;
  return std::nullopt;
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
           needs(servo.repulsive.has_value(), "repulsive", servo.local_model.has_value(), "local_model",
                 "it says where the cell is"),
           needs(servo.vibration.has_value(), "vibration", servo.phases.has_value(), "phases",
                 "contact and puncture are phases"),
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
  if (auto p = check_damping(servo)) return p;
  if (auto p = check_stiffness(servo)) return p;
  if (servo.vibration && servo.vibration->frequency_Hz > servo.rate_Hz / 4)
    return Problem{"vibration.frequency_hz",
                   fmt::format("is too fast for the servo, allowed: at most servo.rate_hz / 4 = {:g}",
                               servo.rate_Hz / 4)};
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
  // One step of the stage under a stiff law is felt as a click.
  const double click_N =
      membrane_stiffness_N_m(servo) * servo.mapping.position_scale * sim.stage.resolution_m;
  if (click_N > kLargestClick_N)
    return Problem{
        "membrane.E_kPa",
        fmt::format("one step of the stage would be {:.2g} N at the hand, allowed: at most {:g} N (softer, "
                    "less mapping.force_scale or a finer stage.resolution_um)",
                    click_N, kLargestClick_N)};
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
