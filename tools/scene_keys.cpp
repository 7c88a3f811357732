#include "tools/scene_keys.hpp"

#include <fmt/format.h>

#include <array>
#include <limits>

namespace punctum::tools {
namespace {

using sim::Failure;

Key real(std::string name, double& target, double min, double max) {
  return {std::move(name), Real{&target, 1, 1, min, max}};
}
Key micro(std::string name, double& target, double min, double max) {  // um, uN, ...
  return {std::move(name), Real{&target, 1, 1e6, min, max}};
}
Key milli(std::string name, double& target, double min, double max) {  // mm, ms, mN, ...
  return {std::move(name), Real{&target, 1, 1e3, min, max}};
}
Key kilo(std::string name, double& target, double min, double max) {  // kPa
  return {std::move(name), Real{&target, 1e3, 1, min, max}};
}
Key whole(std::string name, int& target, std::int64_t min, std::int64_t max) {
  return {std::move(name), Whole{&target, min, max}};
}
Key flag(std::string name, bool& target) { return {std::move(name), Flag{&target}}; }
Key triple_um(std::string name, hal::Vec3& target, double min, double max) {
  return {std::move(name), Triple{&target, 1, 1e6, min, max, false}};
}

template <typename E>
Key choice(std::string name, E& target, std::vector<std::string> names) {
  return {std::move(name), Choice{std::move(names), true, [&target] { return static_cast<int>(target); },
                                  [&target](int i) { target = static_cast<E>(i); }}};
}
// Only one device of each kind exists so far; a real one will be another word here.
Key simulated_only() {
  return {"device", Choice{{"simulated"}, true, [] { return 0; }, [](int) {}}};
}

void keep(Scene&, bool) {}
bool always(const Scene&) { return true; }

// A thing that lives in one optional.
template <typename Get>
Table thing(std::string name, Get get, std::function<std::vector<Key>(Scene&)> keys) {
  return {std::move(name), Kind::thing,
          [get](const Scene& s) { return get(const_cast<Scene&>(s)).has_value(); },
          [get](Scene& s, bool on) {
            if (on) {
              if (!get(s)) get(s).emplace();
            } else {
              get(s).reset();
            }
          },
          std::move(keys)};
}

std::vector<Table> make_tables() {
  std::vector<Table> t;

  t.push_back({"scene", Kind::settings, always, keep, [](Scene& s) {
                 return std::vector<Key>{
                     {"title", Text{&s.title, false}},
                     real("seconds", s.seconds, 0, 1e6),
                     whole("cells", s.servo.cells, 0, 1'000'000),
                     choice("clock", s.clock, {"real", "virtual"}),
                     {"seed", Whole{&s.sim->seed, 0, std::numeric_limits<std::int64_t>::max()}}};
               }});

  t.push_back({"servo", Kind::settings, always, keep, [](Scene& s) {
                 static constexpr std::array rates{1000.0, 2000.0, 4000.0, 8000.0};
                 auto& c = s.servo;
                 return std::vector<Key>{
                     {"rate_hz", Choice{{"1000", "2000", "4000", "8000"},
                                        false,
                                        [&c] {
                                          for (int i = 0; i < 4; ++i)
                                            if (c.rate_Hz == rates[static_cast<std::size_t>(i)]) return i;
                                          return 0;
                                        },
                                        [&c](int i) { c.rate_Hz = rates[static_cast<std::size_t>(i)]; }}},
                     whole("stage_divisor", c.stage_divisor, 1, 64),
                     whole("overrun_limit", c.overrun_limit, 1, 100'000),
                     real("overrun_window_s", c.overrun_window_s, 0.01, 60),
                     whole("priority", s.core_priority, 1, 98),
                     whole("cpu", s.core_cpu, -1, 1023)};
               }});

  t.push_back({"haptic", Kind::required, always, keep, [](Scene& s) {
                 auto& h = s.sim->hand;
                 return std::vector<Key>{simulated_only(),
                                         real("mass_kg", h.mass_kg, 0.01, 2),
                                         real("damping_Ns_m", h.damping_Ns_m, 0, 20),
                                         real("coulomb_N", h.coulomb_N, 0, 2),
                                         milli("encoder_step_mm", h.encoder_step_m, 1e-5, 1),
                                         real("force_max_N", h.force_max_N, 0.1, 40),
                                         milli("workspace_mm", h.workspace_m, 5, 1000),
                                         whole("delay_ticks", h.delay_ticks, 0, sim::kMaxDelayTicks),
                                         milli("timeout_ms", s.servo.hand_timeout_s, 1, 1000),
                                         milli("jump_mm", s.servo.hand_jump_m, 0.1, 200)};
               }});

  t.push_back({"operator", Kind::required, always, keep, [](Scene& s) {
                 auto& p = s.sim->person;
                 return std::vector<Key>{real("arm_stiffness_N_m", p.arm_stiffness_N_m, 10, 2000),
                                         real("arm_damping_Ns_m", p.arm_damping_Ns_m, 0.1, 50),
                                         milli("tremor_mm", p.tremor_m, 0, 5),
                                         micro("aim_error_um", p.aim_error_m, 0, 50),
                                         micro("drift_um_s", p.drift_m_s, 0, 50),
                                         real("reaction_s", p.reaction_s, 0.05, 3),
                                         real("approach_s", p.approach_s, 0.2, 60),
                                         micro("indentation_speed_um_s", p.indentation_speed_m_s, 0.5, 500),
                                         micro("depth_um", p.depth_m, 1, 1000),
                                         real("dwell_s", p.dwell_s, 0, 60),
                                         micro("withdrawal_speed_um_s", p.withdrawal_speed_m_s, 1, 1000),
                                         real("tilt_rad", p.tilt_rad, 0, 0.5),

                                         real("give_way_1_s", p.give_way_1_s, 0, 50)};
               }});

  t.push_back({"stage", Kind::required, always, keep, [](Scene& s) {
                 auto& p = s.sim->stage;
                 return std::vector<Key>{simulated_only(),
                                         triple_um("start_um", p.start_m, -5000, 5000),
                                         {"axis", Triple{&p.axis, 1, 1, -1, 1, true}},
                                         milli("lag_ms", p.lag_s, 0.1, 200),
                                         micro("resolution_um", p.resolution_m, 0.001, 5),
                                         micro("velocity_max_um_s", p.velocity_max_m_s, 10, 1e5),
                                         milli("travel_mm", p.travel_m, 0.1, 100),
                                         triple_um("registration_um", p.registration_m, -100, 100),
                                         milli("brake_mm_s2", p.brake_m_s2, 1, 1e5),
                                         milli("timeout_ms", s.servo.stage_timeout_s, 1, 1000)};
               }});

  t.push_back({"needle", Kind::required, always, keep, [](Scene& s) {
                 auto& p = s.sim->needle;
                 return std::vector<Key>{micro("radius_um", p.radius_m, 0.2, 50),
                                         micro("shaft_radius_um", p.shaft_radius_m, 0.2, 500),
                                         micro("taper_um", p.taper_m, 1, 5000)};
               }});

  t.push_back({"estop", Kind::settings, always, keep, [](Scene& s) {
                 auto& e = s.servo.estop;
                 return std::vector<Key>{milli("discrepancy_ms", e.discrepancy_s, 1, 1000),
                                         milli("hand_ramp_ms", e.hand_ramp_s, 0, 20),
                                         milli("power_off_after_ms", e.power_off_after_s, 10, 5000),
                                         milli("relay_timeout_ms", s.sim->relay_timeout_s, 5, 1000)};
               }});

  t.push_back({"velocity", Kind::settings, always, keep, [](Scene& s) {
                 auto& v = s.servo.velocity;
                 return std::vector<Key>{
                     choice("method", v.method, {"kalman", "foaw"}), milli("d_mm", v.d_m, 1e-5, 1),
                     real("jerk_m_s3_rtHz", v.jerk_m_s3_rtHz, 0.01, 1000), whole("window", v.window, 2, 64),
                     milli("smooth_ms", v.smooth_s, 0, 100)};
               }});

  t.push_back({"mapping", Kind::settings, always, keep, [](Scene& s) {
                 auto& m = s.servo.mapping;
                 return std::vector<Key>{real("position_scale", m.position_scale, 1, 1e5),
                                         real("force_scale", m.force_scale, 0, 1e7),
                                         real("tremor_cutoff_hz", m.tremor_cutoff_Hz, 0, 100),
                                         real("max_tilt_rad", m.max_tilt_rad, 0, 0.5),
                                         real("coupling_s", m.coupling_s, 0, 5),
                                         triple_um("workspace_min_um", m.workspace_min_m, -1e5, 1e5),
                                         triple_um("workspace_max_um", m.workspace_max_m, -1e5, 1e5)};
               }});

  t.push_back({"limits", Kind::settings, always, keep, [](Scene& s) {
                 auto& l = s.servo.limits;
                 return std::vector<Key>{
                     real("hand_force_N", l.hand_force_N, 0, 40),
                     micro("stage_velocity_um_s", l.stage_velocity_m_s, 1, 1e5),
                     milli("stage_acceleration_mm_s2", l.stage_acceleration_m_s2, 0.1, 1e5),
                     micro("penetration_depth_um", l.penetration_depth_m, 1, 5000),
                     micro("far_wall_um", l.far_wall_m, 0, 5000),
                     micro("tip_force_soft_uN", l.tip_force_soft_N, 0.1, 1e5),
                     micro("tip_force_hard_uN", l.tip_force_hard_N, 0.1, 1e5),
                     micro("following_error_um", l.following_error_m, 0.1, 1000)};
               }});

  t.push_back({"cell", Kind::thing, [](const Scene& s) { return s.sim->cell.has_value(); },
               [](Scene& s, bool on) {
                 if (on && !s.sim->cell) {
                   s.sim->cell.emplace();
                   s.sim->cell->inner = false;  // [cell.inner] says otherwise
                 } else if (!on) {
                   s.sim->cell.reset();
                 }
               },
               [](Scene& s) {
                 auto& c = *s.sim->cell;
                 return std::vector<Key>{triple_um("centre_um", c.centre_m, -5000, 5000),
                                         micro("radius_um", c.R_m, 5, 2000),
                                         micro("zona_h_um", c.zona_h_m, 0.05, 100),
                                         kilo("zona_E_kPa", c.zona_E_Pa, 0.1, 1e5),
                                         real("nu", c.nu, 0, 0.5),
                                         real("zona_pretension", c.zona_pretension, 0, 0.3),
                                         real("zona_puncture_strain", c.zona_puncture_strain, 0.01, 3),
                                         milli("recoil_ms", c.recoil_s, 1, 5000),
                                         real("viscosity_Ns_m", c.viscosity_Ns_m, 0, 10),
                                         micro("far_wall_margin_um", c.far_wall_strain_margin_m, 0, 500),
                                         micro("tear_lateral_um", c.tear_lateral_m, 0.5, 500),
                                         real("spread", c.spread, 0, 0.5)};
               }});

  t.push_back({"cell.inner", Kind::thing, [](const Scene& s) { return s.sim->cell && s.sim->cell->inner; },
               [](Scene& s, bool on) {
                 if (s.sim->cell) s.sim->cell->inner = on;
               },
               [](Scene& s) {
                 auto& c = *s.sim->cell;
                 return std::vector<Key>{
                     micro("gap_um", c.inner_gap_m, 0, 500), micro("h_um", c.inner_h_m, 0.01, 50),
                     kilo("E_kPa", c.inner_E_Pa, 0.01, 1e5), real("pretension", c.inner_pretension, 0, 0.3),
                     real("puncture_strain", c.inner_puncture_strain, 0.01, 3)};
               }});

  t.push_back(thing(
      "holder", [](Scene & s) -> auto& { return s.sim->holder; },
      [](Scene& s) {
        auto& h = *s.sim->holder;
        return std::vector<Key>{micro("outer_radius_um", h.outer_radius_m, 2, 2000),
                                micro("inner_radius_um", h.inner_radius_m, 1, 2000),
                                real("vacuum_Pa", h.vacuum_Pa, 0, 50'000),
                                micro("drop_um", h.drop_m, -500, 500)};
      }));

  t.push_back(thing(
      "vacuum", [](Scene & s) -> auto& { return s.servo.vacuum; },
      [](Scene& s) {
        auto& v = *s.servo.vacuum;
        return std::vector<Key>{real("min_Pa", v.min_Pa, 0, 50'000),
                                milli("window_ms", v.window_s, 1, 10'000),
                                real("still_s", v.still_s, 0, 1000)};
      }));

  t.push_back({"injector", Kind::thing,
               [](const Scene& s) { return s.sim->injector.has_value() && s.servo.injector.has_value(); },
               [](Scene& s, bool on) {
                 if (on) {
                   if (!s.sim->injector) s.sim->injector.emplace();
                   if (!s.servo.injector) s.servo.injector.emplace();
                 } else {
                   s.sim->injector.reset();
                   s.servo.injector.reset();
                 }
               },
               [](Scene& s) {
                 return std::vector<Key>{simulated_only(), milli("open_ms", s.sim->injector->open_s, 0, 1000),
                                         real("max_open_s", s.servo.injector->max_open_s, 0.001, 60),
                                         milli("shut_within_ms", s.servo.injector->shut_within_s, 1, 5000)};
               }});

  t.push_back({"force_sensor", Kind::thing,
               [](const Scene& s) { return s.sim->force_sensor.has_value() && s.servo.force_sensor; },
               [](Scene& s, bool on) {
                 s.servo.force_sensor = on;
                 if (!on) {
                   s.sim->force_sensor.reset();
                 } else if (!s.sim->force_sensor) {
                   s.sim->force_sensor.emplace();
                 }
               },
               [](Scene& s) {
                 return std::vector<Key>{simulated_only(),
                                         micro("noise_uN", s.sim->force_sensor->noise_N, 0, 1000),
                                         milli("lag_ms", s.sim->force_sensor->lag_s, 0, 1000)};
               }});

  // A simulated microscope or recorded pictures; `device` decides which other keys there are.
  t.push_back({"camera", Kind::thing,
               [](const Scene& s) { return s.recorded.has_value() || s.sim->microscope.has_value(); },
               [](Scene& s, bool on) {
                 if (!on) {
                   s.sim->microscope.reset();
                   s.recorded.reset();
                 } else if (!s.recorded && !s.sim->microscope) {
                   s.sim->microscope.emplace();
                 }
               },
               [](Scene& s) {
                 std::vector<Key> k{{"device", Choice{{"simulated", "recorded"},
                                                      true,
                                                      [&s] { return s.recorded ? 1 : 0; },
                                                      [&s](int i) {
                                                        if (i == 0) {
                                                          s.recorded.reset();
                                                          if (!s.sim->microscope) s.sim->microscope.emplace();
                                                        } else {
                                                          s.sim->microscope.reset();
                                                          if (!s.recorded) s.recorded.emplace();
                                                        }
                                                      }}}};
                 if (s.recorded) {
                   auto& r = *s.recorded;
                   k.push_back({"frames", Text{&r.frames, true}});
                   k.push_back(real("fps", r.fps, 0.01, 1000));
                   k.push_back(micro("pixel_um", r.pixel_m, 0.01, 50));
                   return k;
                 }
                 if (!s.sim->microscope) return k;
                 auto& m = *s.sim->microscope;
                 k.push_back(whole("width_px", m.width, 64, 4096));
                 k.push_back(whole("height_px", m.height, 64, 4096));
                 k.push_back(micro("pixel_um", m.pixel_m, 0.01, 50));
                 k.push_back(real("fps", m.fps, 1, 1000));
                 k.push_back(milli("latency_ms", m.latency_s, 0, 1000));
                 k.push_back(real("psf_px", m.psf_px, 0.3, 20));
                 k.push_back(micro("defocus_um", m.defocus_m, -200, 200));
                 k.push_back(real("contrast", m.contrast, 0, 120));
                 k.push_back(real("noise", m.noise, 0, 60));
                 k.push_back(real("gradient", m.gradient, 0, 1));
                 k.push_back(whole("impurities", m.impurities, 0, 500));
                 return k;
               }});

  t.push_back({"vision", Kind::thing, [](const Scene& s) { return s.vision.has_value(); },
               [](Scene& s, bool on) {
                 if (on && !s.vision) {
                   s.vision.emplace();
                   s.vision->holder.reset();  // [vision.holder] says otherwise
                 } else if (!on) {
                   s.vision.reset();
                 }
               },
               [](Scene& s) {
                 auto& v = *s.vision;
                 return std::vector<Key>{choice("method", v.method, {"paper", "truth"}),
                                         flag("needle", v.needle),
                                         choice("needle_from", v.needle_from, {"automatic", "left", "right"}),
                                         flag("inner", v.inner),
                                         flag("refine", v.refine),
                                         whole("contour_points", v.contour_points, 128, 4096),
                                         whole("dilation_px", v.dilation_px, 0, 40),
                                         real("puncture_px", v.puncture_px, 0.1, 50),
                                         micro("radius_min_um", v.R_min_m, 1, 5000),
                                         micro("radius_max_um", v.R_max_m, 1, 5000),
                                         whole("cpu", s.vision_cpu, -1, 1023),
                                         whole("nice", s.vision_nice, 0, 19)};
               }});

  t.push_back({"vision.holder", Kind::thing,
               [](const Scene& s) { return s.vision && s.vision->holder.has_value(); },
               [](Scene& s, bool on) {
                 if (!s.vision) return;
                 if (!on) {
                   s.vision->holder.reset();
                 } else if (!s.vision->holder) {
                   s.vision->holder.emplace();
                 }
               },
               [](Scene& s) {
                 auto& h = *s.vision->holder;
                 return std::vector<Key>{{"template", Text{&h.template_path, true}},
                                         whole("window_px", h.window_px, 2, 400),
                                         real("min_score", h.min_score, -1, 1)};
               }});

  t.push_back({"vision.snake", Kind::settings, [](const Scene& s) { return s.vision.has_value(); }, keep,
               [](Scene& s) {
                 auto& k = s.vision->snake;
                 return std::vector<Key>{
                     whole("nodes", k.nodes, 8, 1024),       real("alpha", k.alpha, 0, 100),
                     real("beta", k.beta, 0, 100),           real("gamma", k.gamma, 0, 100),
                     whole("radius_px", k.radius_px, 1, 20), whole("iterations", k.iterations, 1, 10'000)};
               }});

  t.push_back(thing(
      "phases", [](Scene & s) -> auto& { return s.servo.phases; },
      [](Scene& s) {
        auto& p = *s.servo.phases;
        std::vector<Key> k{micro("contact_on_um", p.contact_on_m, 0.01, 50),
                           micro("contact_off_um", p.contact_off_m, 0.01, 50),
                           micro("indentation_on_um", p.indentation_on_m, 0.05, 500),
                           micro("withdrawal_speed_um_s", p.withdrawal_speed_m_s, 0.1, 1000),
                           micro("withdrawal_back_um", p.withdrawal_back_m, 0, 500),
                           micro("clear_um", p.clear_m, 0.1, 1000)};
        for (int i = 0; i < rt::kPhases; ++i)
          k.push_back(real(fmt::format("timeout_{}_s", rt::name(static_cast<rt::Phase>(i))), p.timeout_s[i],
                           0.1, 1e5));
        return k;
      }));

  t.push_back(thing(
      "local_model", [](Scene & s) -> auto& { return s.servo.local_model; },
      [](Scene& s) {
        auto& m = *s.servo.local_model;
        return std::vector<Key>{real("gain", m.gain, 0.01, 1),
                                micro("max_rate_um_s", m.max_rate_m_s, 1, 1e5),
                                micro("disagree_um", m.disagree_m, 1, 1000),
                                real("stale_after_s", m.stale_after_s, 0.01, 5),
                                real("fade_s", m.fade_s, 0.01, 2),
                                real("return_s", m.return_s, 0.01, 5),
                                real("dimple_scale", m.dimple_scale, 0.01, 5),
                                real("dimple_scale_rate_1_s", m.dimple_scale_rate_1_s, 0, 50),
                                micro("dimple_min_um", m.dimple_min_m, 0.1, 500)};
      }));

  t.push_back(thing(
      "membrane", [](Scene & s) -> auto& { return s.servo.membrane; },
      [](Scene& s) {
        auto& m = *s.servo.membrane;
        return std::vector<Key>{choice("law", m.law, {"large_deflection", "paper"}),
                                kilo("E_kPa", m.E_Pa, 0.1, 1e5),
                                real("nu", m.nu, 0, 0.5),
                                micro("h_um", m.h_m, 0.05, 100),
                                micro("c_um", m.c_m, 0.2, 50),
                                micro("R_um", m.R_m, 5, 2000),
                                real("prestrain", m.prestrain, 0.002, 1),
                                micro("seat_um", m.seat_m, 1, 2000)};
      }));

  t.push_back(thing(
      "cone", [](Scene & s) -> auto& { return s.servo.cone; },
      [](Scene& s) {
        auto& c = *s.servo.cone;
        return std::vector<Key>{choice("method", c.method, {"potential", "paper"}),
                                real("K_N_m", c.K_N_m, 0, 3000),
                                micro("d0_um", c.d0_m, 0.1, 2000),
                                micro("r0_um", c.r0_m, 0, 100),
                                real("alpha_rad", c.alpha_rad, 0, 1.2),
                                micro("eps_um", c.eps_m, 0.01, 100),
                                real("ramp_s", c.ramp_s, 0.001, 5),
                                micro("reach_um", c.reach_m, 0.1, 5000)};
      }));

  t.push_back(thing(
      "axis", [](Scene & s) -> auto& { return s.servo.axis; },
      [](Scene& s) {
        auto& a = *s.servo.axis;
        return std::vector<Key>{real("K_N_m", a.K_N_m, 0, 3000), micro("eps_um", a.eps_m, 0.01, 100),
                                real("ramp_s", a.ramp_s, 0.001, 5),
                                real("B_inward_Ns_m", a.B_inward_Ns_m, 0, 100)};
      }));

  t.push_back(thing(
      "damping", [](Scene & s) -> auto& { return s.servo.damping; },
      [](Scene& s) {
        auto& d = *s.servo.damping;
        return std::vector<Key>{real("B1_Ns_m", d.B1_Ns_m, 0, 100), real("B2_Ns_m", d.B2_Ns_m, 0, 100),
                                milli("ramp_ms", d.ramp_s, 1, 1000)};
      }));

  t.push_back(thing(
      "repulsive", [](Scene & s) -> auto& { return s.servo.repulsive; },
      [](Scene& s) {
        auto& r = *s.servo.repulsive;
        return std::vector<Key>{triple_um("offset_um", r.offset_m, -2000, 2000),
                                micro("radius_um", r.radius_m, 0.5, 2000), real("K_N_m", r.K_N_m, 0, 3000),
                                real("ramp_s", r.ramp_s, 0.001, 5)};
      }));

  t.push_back(thing(
      "friction", [](Scene & s) -> auto& { return s.servo.friction; },
      [](Scene& s) {
        auto& f = *s.servo.friction;
        return std::vector<Key>{real("F_c_N", f.F_c_N, 0, 10), real("K_N_m", f.K_N_m, 1, 3000)};
      }));

  t.push_back(thing(
      "vibration", [](Scene & s) -> auto& { return s.servo.vibration; },
      [](Scene& s) {
        auto& v = *s.servo.vibration;
        return std::vector<Key>{
            real("frequency_hz", v.frequency_Hz, 5, 2000), real("amplitude_N", v.amplitude_N, 0, 5),
            milli("decay_ms", v.decay_s, 1, 1000), micro("energy_uJ", v.energy_J, 0, 1e5)};
      }));

  t.push_back(thing(
      "guard", [](Scene & s) -> auto& { return s.servo.guard; },
      [](Scene& s) {
        auto& g = *s.servo.guard;
        return std::vector<Key>{real("margin", g.margin, 0.1, 0.95), real("recover_s", g.recover_s, 0.1, 60)};
      }));
  return t;
}

std::vector<List> make_lists() {
  std::vector<List> l;
  l.push_back({"failure", static_cast<int>(std::tuple_size_v<decltype(sim::SimConfig::failures)>),
               [](Scene& s) -> int& { return s.sim->failure_count; },
               [](Scene& s, int i) {
                 auto& f = s.sim->failures[static_cast<std::size_t>(i)];
                 std::vector<Key> k{
                     choice("device", f.device,
                            {"haptic", "stage", "estop", "injector", "vacuum", "force_sensor", "camera"}),
                     {"kind", Choice{{"freeze", "drop", "delay", "nan", "disconnect", "saturate", "noise"},
                                     true,
                                     [&f] { return static_cast<int>(f.kind) - 1; },
                                     [&f](int n) { f.kind = static_cast<Failure>(n + 1); }}},
                     real("at_s", f.at_s, 0, 1e6),
                     real("for_s", f.for_s, 0, 1e6)};
                 return k;
               }});
  l.push_back({"estop_press", static_cast<int>(std::tuple_size_v<decltype(sim::SimConfig::estop_events)>),
               [](Scene& s) -> int& { return s.sim->estop_event_count; },
               [](Scene& s, int i) {
                 auto& e = s.sim->estop_events[static_cast<std::size_t>(i)];
                 return std::vector<Key>{real("at_s", e.at_s, 0, 1e6), real("for_s", e.for_s, 0.0001, 1e6),
                                         flag("contact_a", e.contact_a), flag("contact_b", e.contact_b),
                                         flag("reset_after", e.reset_after)};
               }});
  return l;
}

std::string words(const std::vector<std::string>& names, bool quoted) {
  std::string s;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) s += i + 1 == names.size() ? " or " : ", ";
    s += quoted ? "\"" + names[i] + "\"" : names[i];
  }
  return s;
}

}  // namespace

const std::vector<Table>& scene_tables() {
  static const std::vector<Table> list = make_tables();
  return list;
}

const std::vector<List>& scene_lists() {
  static const std::vector<List> list = make_lists();
  return list;
}

std::string allowed(const Key& key) {
  struct Visitor {
    std::string operator()(const Real& r) const {
      return fmt::format("a number from {} to {}", r.min, r.max);
    }
    std::string operator()(const Whole& w) const {
      return fmt::format("a whole number from {} to {}", w.min, w.max);
    }
    std::string operator()(const Flag&) const { return "true or false"; }
    std::string operator()(const Text& t) const {
      return t.path ? "a path in quotes, at most 1000 characters" : "text in quotes, at most 1000 characters";
    }
    std::string operator()(const Choice& c) const { return words(c.names, c.quoted); }
    std::string operator()(const Triple& t) const {
      return t.unit ? "a direction [x, y, z] that is not zero, each from -1 to 1"
                    : fmt::format("[x, y, z], each a number from {} to {}", t.min, t.max);
    }
  };
  return std::visit(Visitor{}, key.value);
}

}  // namespace punctum::tools
