// What must fit together between the tables of a scene.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <type_traits>

#include "hal/cia402/bus_load.hpp"
#include "hal/cia402/calibration.hpp"
#include "hal/sim/failures.hpp"
#include "rt/control/renderable.hpp"
#include "rt/executive/missed_window.hpp"
#include "tools/scene/messages.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/shared/udp_address.hpp"

namespace punctum::tools {
namespace {

using Found = std::optional<Problem>;

constexpr double um(double m) { return m * 1e6; }

// Four digits, rounded down: what is said to be allowed is allowed.
double rounded_down(double v) {
  if (!(v > 0) || !std::isfinite(v)) {
    return v;
  }
  const double unit = std::pow(10, std::floor(std::log10(v)) - 3);
  return std::floor(v / unit) * unit;
}

// ---- things that need other things ----

// What needs what, and why.
struct Need {
  const char* what;
  const char* needed;
  const char* why;
};
constexpr Need kNeeds[] = {
    {"vision", "camera", "vision looks at pictures"},
    {"camera", "vision", "nobody looks at the pictures"},
    {"phases", "vision", "vision sees contact and puncture"},
    {"local_model", "vision", "vision corrects the local model"},
    {"membrane", "local_model", "it says where the membrane is"},
    {"cone", "local_model", "it says where the entry point is"},
    {"axis", "phases", "withdrawal is a phase"},
    {"axis", "local_model", "it says where the entry point is"},
    {"phases", "local_model", "the phases follow its depth"},
    {"repulsive", "local_model", "it says where the cell is"},
    {"vibration", "phases", "contact and puncture are phases"},
};

Found check_needs(const Scene& s) {
  const auto unmet = [](const Need& n) {
    return Problem{n.what, fmt::format("needs [{}] ({}), allowed: add [{}] or leave [{}] out", n.needed,
                                       n.why, n.needed, n.what)};
  };
  for (const Need& n : kNeeds) {
    if (table_named(n.what)->there(s) && !table_named(n.needed)->there(s)) {
      return unmet(n);
    }
  }
  // What only a simulated device, or a picture that is drawn, needs of the simulation.
  const bool cell = s.sim && s.sim->cell, holder = s.sim && s.sim->holder;
  const bool drawn = s.vision && s.simulated_camera();
  if (drawn && !cell) {
    return unmet({"camera", "sim.cell", "there is nothing to look at"});
  }
  if (holder && !cell) {
    return unmet({"sim.holder", "sim.cell", "there is nothing to hold"});
  }
  if (s.devices.vacuum == kSimulated && !holder) {
    return unmet({"vacuum", "sim.holder", "suction needs a pipette"});
  }
  if (drawn && s.vision->holder && !holder) {
    return unmet({"vision.holder", "sim.holder", "there is no holding pipette to find"});
  }
  if (drawn && s.vision->inner && cell && !s.sim->cell->inner) {
    return unmet({"vision.inner", "sim.cell.inner", "there is no inner membrane to follow"});
  }
  if (s.vision && s.vision->surface && s.vision->method == vision::Method::truth) {
    return Problem{"vision.surface",
                   "needs contours, and vision.method = \"truth\" looks for none, allowed: false"};
  }
  return std::nullopt;
}

// The table of a camera that is plugged in says which one.
Found check_camera_table(const Scene& s, std::string_view backend, bool there) {
  const bool used = s.devices.camera == backend;
  if (used && !there) {
    return Problem{"camera.device", fmt::format("\"{}\" needs [{}] (it says which camera), allowed: add [{}]",
                                                backend, backend, backend)};
  }
  if (there && !used) {
    return Problem{
        std::string(backend),
        fmt::format("no camera uses it, allowed: with device = \"{}\" in [camera], or leave it out",
                    backend)};
  }
  return std::nullopt;
}

Found check_live_camera(const Scene& s) {
  if (auto p = check_camera_table(s, kV4l2, s.v4l2.has_value())) {
    return p;
  }
  if (auto p = check_camera_table(s, kAravis, s.aravis.has_value())) {
    return p;
  }
  if (s.v4l2 && !s.v4l2->path.starts_with('/')) {
    return Problem{"v4l2.path", "is no path, allowed: the path of a camera, such as \"/dev/video0\""};
  }
  if (s.camera && s.camera->fps > 0 && s.camera->exposure_s * s.camera->fps > 1) {
    return Problem{"camera.exposure_ms",
                   fmt::format("is longer than a frame, allowed: at most 1000 / fps = {:g}",
                               rounded_down(1e3 / s.camera->fps))};
  }
  return std::nullopt;
}

// A switch knows two pressures: its own, and none.
Found check_vacuum_switch(const gpiod::GpiodParams& p, const rt::VacuumParams& vacuum) {
  if (p.vacuum_switch_Pa == 0) {
    return Problem{
        "gpiod.vacuum_switch_kPa",
        "is missing, which [vacuum] needs, allowed: the pressure below ambient at which it closes"};
  }
  if (vacuum.min_Pa == 0 || vacuum.min_Pa > p.vacuum_switch_Pa) {
    return Problem{"vacuum.min_Pa",
                   fmt::format("{:g}, but the switch tells either 0 or {:g}, allowed: more than 0, at most "
                               "gpiod.vacuum_switch_kPa = {:g}",
                               vacuum.min_Pa, p.vacuum_switch_Pa, p.vacuum_switch_Pa / 1e3)};
  }
  if (vacuum.still_s > 0) {
    return Problem{
        "vacuum.still_s",
        fmt::format("{:g}, but a switch shows the same as long as it does not switch, allowed: 0 with "
                    "vacuum.device = \"gpiod\"",
                    vacuum.still_s)};
  }
  return std::nullopt;
}

// The lines of [gpiod], and what its devices need of them.
Found check_gpiod(const Scene& s) {
  const auto needed_by = [&s](const char* table, std::string DeviceNames::* device) {
    return s.devices.*device == kGpiod ? table : nullptr;
  };
  const char* const estop = needed_by("estop", &DeviceNames::estop);
  const char* const enabling = needed_by("enabling", &DeviceNames::enabling);
  const char* const injector = needed_by("injector", &DeviceNames::injector);
  const char* const vacuum = needed_by("vacuum", &DeviceNames::vacuum);
  const char* any = nullptr;
  for (const char* table : {estop, enabling, injector, vacuum}) {
    any = any != nullptr ? any : table;
  }
  if (!s.gpiod) {
    return any != nullptr
               ? Found{Problem{fmt::format("{}.device", any),
                               "\"gpiod\" needs [gpiod] (it says which lines), allowed: add [gpiod]"}}
               : std::nullopt;
  }
  if (any == nullptr) {
    return Problem{
        "gpiod",
        "no device uses it, allowed: with device = \"gpiod\" in [estop], [enabling], [injector] or "
        "[vacuum], or leave it out"};
  }
  const gpiod::GpiodParams& p = *s.gpiod;
  if (!p.chip.starts_with('/')) {
    return Problem{"gpiod.chip", "is no path, allowed: the path of a GPIO chip, such as \"/dev/gpiochip0\""};
  }
  if (p.enable != gpiod::kNotWired && estop == nullptr) {
    return Problem{
        "gpiod.enable",
        "is driven with the emergency stop's lines, allowed: with device = \"gpiod\" in [estop], or "
        "leave it out"};
  }
  struct Line {
    const char* key;
    int offset;
    const char* needed_by;  // null: by nothing
  };
  const Line lines[] = {{"gpiod.contact_a", p.contact_a, estop},
                        {"gpiod.contact_b", p.contact_b, estop},
                        {"gpiod.reset", p.reset, estop},
                        {"gpiod.heartbeat", p.heartbeat, estop},
                        {"gpiod.enable", p.enable, nullptr},
                        {"gpiod.gate", p.gate, injector},
                        {"gpiod.vacuum_gate", p.vacuum_gate, nullptr},
                        {"gpiod.vacuum_switch", p.vacuum_switch, vacuum},
                        {"gpiod.valve_contact", p.valve_contact, nullptr},
                        {"gpiod.enabling_a", p.enabling_a, enabling},
                        {"gpiod.enabling_b", p.enabling_b, enabling}};
  for (const Line& line : lines) {
    if (line.needed_by != nullptr && line.offset == gpiod::kNotWired) {
      return Problem{line.key,
                     fmt::format("is missing, which [{}] needs, allowed: the offset of a line, from 0 "
                                 "on",
                                 line.needed_by)};
    }
    for (const Line* other = lines; other != &line; ++other) {
      if (line.offset != gpiod::kNotWired && line.offset == other->offset) {
        return Problem{line.key, fmt::format("{} is the line of {} too, allowed: a line of its own",
                                             line.offset, other->key)};
      }
    }
  }
  return vacuum != nullptr ? check_vacuum_switch(p, *s.servo.vacuum) : std::nullopt;
}

Found check_falcon(const Scene& s) {
  if (s.falcon && s.devices.haptic != kFalcon) {
    return Problem{"falcon",
                   "no handle uses it, allowed: with device = \"falcon\" in [haptic], or leave it out"};
  }
  return std::nullopt;
}

// A hand without force.
Found check_evdev(const Scene& s) {
  const bool hand = s.devices.haptic == kEvdev;
  if (!hand && s.evdev) {
    return Problem{"evdev", "no hand uses it, allowed: with device = \"evdev\" in [haptic], or leave it out"};
  }
  if (hand && !s.evdev) {
    return Problem{"haptic.device", "\"evdev\" needs [evdev] (it says which device), allowed: add [evdev]"};
  }
  if (hand && s.hand_feels()) {
    return Problem{"haptic.force_max_N",
                   fmt::format("{:g}, but mice, gamepads and knobs render no force, allowed: 0 with "
                               "haptic.device = \"evdev\"",
                               s.servo.device.force_max_N)};
  }
  if (hand && !s.evdev->path.empty() && !s.evdev->path.starts_with('/')) {
    return Problem{"evdev.path",
                   "is no path, allowed: an input device, such as \"/dev/input/event5\", or empty"};
  }
  return std::nullopt;
}

// A hand on the operator's page. A network lies between it and the station: it moves simulated devices alone.
Found check_browser(const Scene& s) {
  if (s.devices.haptic != kBrowser) {
    return std::nullopt;
  }
  if (s.hand_feels()) {
    return Problem{
        "haptic.force_max_N",
        fmt::format("{:g}, but a page renders no force, allowed: 0 with haptic.device = \"browser\"",
                    s.servo.device.force_max_N)};
  }
  if (!s.servo.enabling) {
    return Problem{"haptic.device",
                   "\"browser\" needs [enabling] (letting go of the button stops), allowed: add [enabling]"};
  }
  for (const auto& [table, backend] :
       {std::pair{"stage", &s.devices.stage}, std::pair{"injector", &s.devices.injector},
        std::pair{"vacuum", &s.devices.vacuum}, std::pair{"positioner", &s.devices.positioner}}) {
    if (!backend->empty() && *backend != kSimulated) {
      return Problem{
          fmt::format("{}.device", table),
          fmt::format(
              "\"{}\", but the hand on a page moves simulated devices alone, allowed: \"simulated\" with "
              "haptic.device = \"browser\"",
              *backend)};
    }
  }
  return std::nullopt;
}

// A positioner on a serial line.
Found check_zaber(const Scene& s) {
  const bool positioner = s.devices.positioner == kZaber;
  if (!positioner && s.zaber) {
    return Problem{
        "zaber", "no positioner uses it, allowed: with device = \"zaber\" in [positioner], or leave it out"};
  }
  if (!positioner) {
    return std::nullopt;
  }
  if (!s.zaber) {
    return Problem{"positioner.device",
                   "\"zaber\" needs to know its axes, allowed: with [zaber] and three [[zaber.axis]]"};
  }
  if (!s.zaber->port.starts_with('/')) {
    return Problem{"zaber.port", "is no path, allowed: the path of a serial line, such as \"/dev/ttyUSB0\""};
  }
  if (s.zaber->axis_count != zaber::kAxes) {
    return Problem{"zaber.axis",
                   fmt::format("{} of them, allowed: three [[zaber.axis]], x, y and z in this order",
                               s.zaber->axis_count)};
  }
  const auto& axes = s.zaber->axes;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (axes[i].microstep_m == 0) {
      return Problem{fmt::format("zaber.axis[{}].microstep_um", i),
                     "moves nothing, allowed: the way of one microstep, not 0"};
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (axes[k].device == axes[i].device && axes[k].axis == axes[i].axis) {
        return Problem{fmt::format("zaber.axis[{}].axis", i),
                       fmt::format("device {} axis {} is zaber.axis[{}] already, allowed: an axis of its own",
                                   axes[i].device, axes[i].axis, k)};
      }
    }
  }
  return std::nullopt;
}

Found check_backends(const Scene& s) {
  if (s.vision && s.vision->method == vision::Method::truth && !s.simulated_camera()) {
    return Problem{"vision.method",
                   "\"truth\" is known of a simulated camera only, allowed: \"paper\" or \"tracker\""};
  }
  if (s.clock == ClockKind::virtual_time) {
    if (s.recorded) {
      return Problem{"scene.clock", "\"virtual\" cannot wait for recorded frames, allowed: \"real\""};
    }
    for (const NamedDevice& d : scene_devices()) {
      const std::string& backend = s.devices.*d.backend;
      if (!backend.empty() && backend != kSimulated) {
        return Problem{"scene.clock",
                       fmt::format("\"virtual\" cannot wait for {}.device = \"{}\", allowed: \"real\"",
                                   d.table, backend)};
      }
    }
  }
  if (s.recorded && s.recorded->frames.empty()) {
    return Problem{"camera.frames", "is missing, allowed: a folder, a glob or a video file"};
  }
  return std::nullopt;
}

// ---- drives on a CAN bus ----

Found check_nodes(const cia402::CanStageParams& can) {
  std::vector<int> nodes = {can.master_node};
  const auto taken = [&nodes](int node) {
    const bool known = std::find(nodes.begin(), nodes.end(), node) != nodes.end();
    nodes.push_back(node);
    return known;
  };
  for (int i = 0; i < can.axis_count; ++i) {
    const int node = can.axes[static_cast<std::size_t>(i)].node;
    if (node == 0 || taken(node)) {
      return Problem{
          fmt::format("cia402.axis[{}].node", i),
          fmt::format("{}, allowed: a number from 1 to {} that no other node has, nor the master",
                      node == 0 ? "is missing" : fmt::format("{} is taken", node), cia402::kMaxNode)};
    }
  }
  if (can.force_node != 0 && taken(can.force_node)) {
    return Problem{"cia402.force_node",
                   fmt::format("{} is taken, allowed: a number that no other node has", can.force_node)};
  }
  return std::nullopt;
}

// Axes that enclose less than about 11 degrees magnify every error of a count by more than this.
constexpr double kWorstCondition = 10;
// Of the needle's direction, what one or two axes cannot follow: the digits of the scene, or a needle that is
// bent by a degree. On the deepest way into a cell, 90 um, a third of lateral_um.
constexpr double kBesideNeedle = 0.02;

Found check_axes(const cia402::CanStageParams& can) {
  if (can.axis_count < 1) {
    return Problem{"cia402.axis",
                   fmt::format("is missing, allowed: from 1 to {} [[cia402.axis]]", cia402::kMaxAxes)};
  }
  for (int i = 0; i < can.axis_count; ++i) {
    const cia402::AxisParams& axis = can.axes[static_cast<std::size_t>(i)];
    const std::string name = fmt::format("cia402.axis[{}].", i);
    if (axis.count_m.isZero()) {
      return Problem{name + "count_um",
                     "moves nothing, allowed: how the tip moves with one count, [x, y, z], not zero"};
    }
    if (axis.min_counts >= axis.max_counts) {
      return Problem{name + "min_counts",
                     fmt::format("is not below max_counts, allowed: below {}", axis.max_counts)};
    }
  }
  const double condition = cia402::condition_of_axes(can);
  if (!(condition <= kWorstCondition)) {
    return Problem{"cia402.axis",
                   fmt::format("the axes' directions count_um hardly span {}, condition {:.3g}, allowed: at "
                               "most {:g} (axes more than about 11 degrees apart)",
                               can.axis_count == 2 ? "a plane" : "space", condition, kWorstCondition)};
  }
  if (const auto reach = cia402::reach_of_axes(can)) {
    const double beside = (can.needle - *reach * can.needle).norm();
    if (beside > kBesideNeedle) {
      return Problem{
          "cia402.needle",
          fmt::format("lies {:.3g} um beside what {} can do on a way of 100 um, allowed: at most "
                      "{:g}; one or two [[cia402.axis]] must move the needle along its own axis",
                      beside * 100, can.axis_count == 1 ? "the axis" : "the axes", kBesideNeedle * 100)};
    }
  }
  return std::nullopt;
}

Found check_bus(const cia402::CanStageParams& can, const rt::ServoConfig& servo) {
  const double cycle_s = can.sync_divisor / servo.rate_Hz;
  if (cia402::interpolation_period(cycle_s).mantissa == 0) {
    return Problem{
        "cia402.sync_divisor",
        fmt::format("a period of {:g} us is none that drives can interpolate, allowed: 1 to 255 ms, or "
                    "tenths, hundredths or thousandths of it",
                    cycle_s * 1e6)};
  }
  constexpr double kCycles = 3;  // an answer is two cycles old when it is judged, and one may be lost
  if (servo.stage_timeout_s < kCycles * cycle_s) {
    return Problem{
        "cia402.sync_divisor",
        fmt::format("the stage would time out between two SYNCs, allowed: at most {}, or stage.timeout_ms "
                    "of at least {:g}",
                    static_cast<int>(servo.stage_timeout_s * servo.rate_Hz / kCycles),
                    kCycles * cycle_s * 1e3)};
  }
  // The stop of a silent bus comes before the core's own, which would only wait behind it.
  if (servo.stage_timeout_s < (can.silence_cycles + 1) * cycle_s) {
    return Problem{
        "cia402.silence_cycles",
        fmt::format("the stage would time out before the bus counts as silent, allowed: at most {}, or "
                    "stage.timeout_ms of at least {:g}",
                    std::max(static_cast<int>(servo.stage_timeout_s / cycle_s + 1e-9) - 1, 2),
                    (can.silence_cycles + 1) * cycle_s * 1e3)};
  }
  if (can.heartbeat_timeout_s < 2 * can.heartbeat_s) {
    return Problem{
        "cia402.heartbeat_timeout_ms",
        fmt::format("one late heartbeat would stop the stage, allowed: at least 2 heartbeat_ms = {:g}",
                    2e3 * can.heartbeat_s)};
  }
  const auto load_of = [&](double cycle) {
    return cia402::bus_load(can.axis_count, can.force_node != 0, 1e-3 / can.bitrate_kbit, cycle,
                            can.heartbeat_s);
  };
  const cia402::BusLoad load = load_of(cycle_s);
  if (!load.fits(cycle_s)) {
    int divisor = can.sync_divisor;
    while (divisor < 64 && !load_of(divisor / servo.rate_Hz).fits(divisor / servo.rate_Hz)) {
      ++divisor;
    }
    return Problem{
        "cia402.sync_divisor",
        fmt::format("the bus cannot carry {} axes: SYNC and PDOs take up to {:.0f} us, an emergency and a "
                    "heartbeat {:.0f} us, of {:.0f} us from SYNC to SYNC at {:g} kbit/s, load {:.0f} %, "
                    "allowed: at least {} (or fewer axes, or a higher bitrate_kbit)",
                    can.axis_count, load.cyclic_s * 1e6, load.spare_s * 1e6, cycle_s * 1e6, can.bitrate_kbit,
                    load.part * 100, divisor)};
  }
  return std::nullopt;
}

Found check_can_stage(const Scene& s) {
  const bool stage = s.devices.stage == kCia402, sensor = s.devices.force_sensor == kCia402;
  if (!s.cia402) {
    return stage || sensor
               ? Found(Problem{
                     stage ? "stage.device" : "force_sensor.device",
                     "\"cia402\" needs to know its drives, allowed: with [cia402] and [[cia402.axis]]"})
               : std::nullopt;
  }
  const cia402::CanStageParams& can = *s.cia402;
  if (!stage) {
    return Problem{"cia402",
                   "no stage uses it, allowed: with device = \"cia402\" in [stage], or leave it out"};
  }
  if (sensor != (can.force_node != 0)) {
    return Problem{"cia402.force_node", sensor
                                            ? "0 is no force sensor, allowed: its node number"
                                            : "no force sensor uses it, allowed: with device = \"cia402\" in "
                                              "[force_sensor], or 0"};
  }
  if (s.servo.mapping.max_tilt_rad != 0) {
    return Problem{"mapping.max_tilt_rad",
                   "no drive of [cia402] tilts the needle, allowed: 0 with stage.device = \"cia402\""};
  }
  if (auto p = check_nodes(can)) {
    return p;
  }
  if (auto p = check_axes(can)) {
    return p;
  }
  return check_bus(can, s.servo);
}

// ---- needle, cell and pipettes of the simulation ----

Found check_cell(const sim::CellParams& c, const sim::NeedleParams& needle) {
  if (needle.radius_m * 4 > c.R_m) {
    return Problem{"sim.needle.radius_um",
                   fmt::format("is too thick for the cell, allowed: at most sim.cell.radius_um / 4 = {:g}",
                               um(c.R_m / 4))};
  }
  if (c.zona_h_m * 4 > c.R_m) {
    return Problem{
        "sim.cell.zona_h_um",
        fmt::format("is too thick for the cell, allowed: at most radius_um / 4 = {:g}", um(c.R_m / 4))};
  }
  if (c.inner && c.zona_h_m + c.inner_gap_m > 0.5 * c.R_m) {
    return Problem{
        "sim.cell.inner.gap_um",
        fmt::format("leaves no room inside the cell, allowed: at most radius_um / 2 - zona_h_um = {:g}",
                    um(0.5 * c.R_m - c.zona_h_m))};
  }
  if (c.zona_puncture_strain <= c.zona_pretension) {
    return Problem{"sim.cell.zona_puncture_strain",
                   fmt::format("is reached before the needle touches, allowed: above zona_pretension = {:g}",
                               c.zona_pretension)};
  }
  return std::nullopt;
}

Found check_start(const sim::SimConfig& sim) {
  const auto& c = *sim.cell;
  const double gap = (sim.stage.start_m - c.centre_m).norm() - c.R_m;
  if (gap < sim.needle.radius_m) {
    return Problem{"sim.stage.start_um",
                   fmt::format("is inside or at the cell, allowed: at least {:g} um from its centre",
                               um(c.R_m + sim.needle.radius_m))};
  }
  // Sizes differ by up to 2.5 sigma; a held cell grows away from its pipette, on both sides towards the
  // needle.
  const double grows_m = (sim.holder ? 5 : 2.5) * c.spread * c.R_m;
  if (gap < sim.needle.radius_m + grows_m) {
    return Problem{
        "sim.stage.start_um",
        fmt::format("would be inside a large cell of this spread, allowed: at least {:g} um from its centre",
                    um(c.R_m + sim.needle.radius_m + grows_m))};
  }
  return std::nullopt;
}

Found check_depth(const sim::SimConfig& sim, const rt::LimitParams& limits) {
  const double R_m = sim.cell->R_m;
  if (um(limits.penetration_depth_m) > um(2 * R_m)) {
    return Problem{
        "limits.penetration_depth_um",
        fmt::format("goes through the cell, allowed: at most 2 * sim.cell.radius_um = {:g}", um(2 * R_m))};
  }
  if (limits.far_wall_m > R_m) {
    return Problem{
        "limits.far_wall_um",
        fmt::format("leaves no room to inject, allowed: at most sim.cell.radius_um = {:g}", um(R_m))};
  }
  if (sim.operator_params.depth_m > limits.penetration_depth_m) {
    return Problem{
        "sim.operator.depth_um",
        fmt::format("is deeper than the limit, allowed: at most limits.penetration_depth_um = {:g}",
                    um(limits.penetration_depth_m))};
  }
  return std::nullopt;
}

Found check_holder(const sim::HolderParams& h, double R_m, const std::optional<rt::VacuumParams>& vacuum) {
  if (h.inner_radius_m >= h.outer_radius_m) {
    return Problem{"sim.holder.inner_radius_um",
                   fmt::format("is not smaller than the outer one, allowed: below outer_radius_um = {:g}",
                               um(h.outer_radius_m))};
  }
  if (h.inner_radius_m >= R_m) {
    return Problem{"sim.holder.inner_radius_um",
                   fmt::format("swallows the cell, allowed: below sim.cell.radius_um = {:g}", um(R_m))};
  }
  if (vacuum && vacuum->min_Pa >= h.vacuum_Pa) {
    return Problem{
        "vacuum.min_Pa",
        fmt::format("is above the suction itself, allowed: below sim.holder.vacuum_Pa = {:g}", h.vacuum_Pa)};
  }
  return std::nullopt;
}

Found check_plant(const Scene& s) {
  if (!s.sim) {
    return std::nullopt;
  }
  const auto& sim = *s.sim;
  if (sim.needle.shaft_radius_m < sim.needle.radius_m) {
    return Problem{"sim.needle.shaft_radius_um",
                   fmt::format("{:g} is smaller than the tip, allowed: at least radius_um = {:g}",
                               um(sim.needle.shaft_radius_m), um(sim.needle.radius_m))};
  }
  if (!sim.cell) {
    return std::nullopt;
  }
  if (auto p = check_cell(*sim.cell, sim.needle)) {
    return p;
  }
  if (auto p = check_start(sim)) {
    return p;
  }
  if (auto p = check_depth(sim, s.servo.limits)) {
    return p;
  }
  return sim.holder ? check_holder(*sim.holder, sim.cell->R_m, s.servo.vacuum) : std::nullopt;
}

// ---- what the haptic device can render ----

std::string device_text(const rt::ServoConfig& servo) {
  const auto& v = servo.velocity;
  return fmt::format(
      "m = haptic.mass_kg {:g}, T = 1/servo.rate_hz = {:g} ms, delay {} ticks, velocity by {}{}",
      servo.device.mass_kg, 1e3 / servo.rate_Hz, servo.device.delay_ticks,
      v.method == rt::VelocityParams::Method::kalman ? "Kalman filter"
                                                     : fmt::format("window of {} at 1 kHz", v.window),
      v.smooth_s > 0 ? fmt::format(" and low-pass of {:g} ms", v.smooth_s * 1e3) : "");
}

struct SpringWords {
  const char* key;
  const char* name;
};
SpringWords words_of(rt::Spring::Of spring) {
  switch (spring) {
    case rt::Spring::Of::cone:
      return {"cone.K_N_m", "cone"};
    case rt::Spring::Of::membrane:
      return {"membrane.E_kPa", "membrane"};
    case rt::Spring::Of::axis:
      return {"axis.K_N_m", "axis"};
    case rt::Spring::Of::repulsive:
      return {"repulsive.K_N_m", "repulsive"};
    case rt::Spring::Of::friction:
      return {"friction.K_N_m", "friction"};
    case rt::Spring::Of::forbidden:
      return {"forbidden.K_N_m", "forbidden"};
  }
  return {"servo", "?"};
}

Problem too_much_damping(const rt::ServoConfig& servo, const rt::NotRenderable& found) {
  using What = rt::NotRenderable::What;
  const double T_s = 1 / servo.rate_Hz;
  const std::string formula =
      fmt::format("at most {:g} m/T = {:g} ({})", rounded_down(found.most * T_s / servo.device.mass_kg),
                  rounded_down(found.most), device_text(servo));
  if (found.what == What::damping_inward) {
    return {"axis.B_inward_Ns_m",
            fmt::format("{:g} beside damping.B2_Ns_m = {:g} cannot be rendered, allowed: together {}",
                        found.asked, found.beside_Ns_m, formula)};
  }
  return {found.what == What::damping_outside ? "damping.B1_Ns_m" : "damping.B2_Ns_m",
          fmt::format("{:g} cannot be rendered, allowed: {}", found.asked, formula)};
}

Problem too_stiff(const rt::ServoConfig& servo, const rt::NotRenderable& found) {
  std::string sum;
  for (int i = 0; i < found.spring_count; ++i) {
    const rt::Spring& spring = found.springs[static_cast<std::size_t>(i)];
    sum += fmt::format("{}{} {:.4g}", sum.empty() ? "" : " + ", words_of(spring.of).name, spring.K_N_m);
  }
  const char* key = words_of(found.stiffest).key;
  const double T_s = 1 / servo.rate_Hz;
  if (found.what == rt::NotRenderable::What::not_passive) {
    return {key, fmt::format("stiffness {} = {:.4g} N/m is not passive, allowed: at most b/(T/2 + delay) = "
                             "{:g} (b = haptic.damping_Ns_m {:g}, {}), or add [guard]",
                             sum, found.asked, rounded_down(found.most), servo.device.damping_Ns_m,
                             device_text(servo))};
  }
  return {key, fmt::format(
                   "stiffness {} = {:.4g} N/m beside B = {:g} Ns/m swings by itself, allowed: at most {:g} "
                   "m/T^2 = {:g}, where a pole of 1 + (K + B V(z)) P(z) z^-delay reaches the unit circle "
                   "(b = haptic.damping_Ns_m {:g}, {})",
                   sum, found.asked, found.beside_Ns_m,
                   rounded_down(found.most * T_s * T_s / servo.device.mass_kg), rounded_down(found.most),
                   servo.device.damping_Ns_m, device_text(servo))};
}

Found check_renderable(const rt::ServoConfig& servo) {
  using What = rt::NotRenderable::What;
  if (servo.damping && servo.damping->B2_Ns_m < servo.damping->B1_Ns_m) {
    return Problem{"damping.B2_Ns_m",
                   fmt::format("is below the damping outside, allowed: at least B1_Ns_m = {:g}",
                               servo.damping->B1_Ns_m)};
  }
  if (const auto found = rt::find_not_renderable(servo)) {
    const bool springs = found->what == What::unstable || found->what == What::not_passive;
    return springs ? too_stiff(servo, *found) : too_much_damping(servo, *found);
  }
  if (servo.vibration && servo.vibration->frequency_Hz > servo.rate_Hz / 4) {
    return Problem{"vibration.frequency_hz",
                   fmt::format("is too fast for the servo, allowed: at most servo.rate_hz / 4 = {:g}",
                               servo.rate_Hz / 4)};
  }
  return std::nullopt;
}

// ---- limits and thresholds of the core ----

Found check_limits(const rt::ServoConfig& servo) {
  const auto& limits = servo.limits;
  if (limits.tip_force_soft_N >= limits.tip_force_hard_N) {
    return Problem{"limits.tip_force_soft_uN",
                   fmt::format("is not below the hard limit, allowed: below tip_force_hard_uN = {:g}",
                               um(limits.tip_force_hard_N))};
  }
  if (servo.device.force_max_N > 0 && limits.hand_force_N > servo.device.force_max_N) {
    return Problem{"limits.hand_force_N", fmt::format("is more than the device can do, allowed: at most "
                                                      "haptic.force_max_N = {:g}",
                                                      servo.device.force_max_N)};
  }
  return std::nullopt;
}

// Against the plant of a simulated stage.
Found check_stage(const rt::ServoConfig& servo, const sim::StageParams& stage) {
  const auto& limits = servo.limits;
  if (limits.stage_velocity_m_s > stage.velocity_max_m_s) {
    return Problem{"limits.stage_velocity_um_s",
                   fmt::format("is more than the stage can do, allowed: at most "
                               "sim.stage.velocity_max_um_s = {:g}",
                               um(stage.velocity_max_m_s))};
  }
  // The drive lags behind at full speed without any fault.
  const double lags_m = limits.stage_velocity_m_s * stage.lag_s;
  if (lags_m > limits.following_error_m) {
    return Problem{"limits.following_error_um",
                   fmt::format("the stage lags further behind at full speed, allowed: at least "
                               "stage_velocity_um_s * sim.stage.lag_ms = {:g}",
                               um(lags_m))};
  }
  const double click_N = rt::stage_click_N(servo, stage.resolution_m);
  if (click_N > rt::kLargestClick_N) {
    return Problem{
        "membrane.E_kPa",
        fmt::format("one step of the stage would be {:.2g} N at the hand, allowed: at most {:g} N (softer, "
                    "less mapping.force_scale or a finer sim.stage.resolution_um)",
                    click_N, rt::kLargestClick_N)};
  }
  return std::nullopt;
}

Found check_forbidden(const rt::ForbiddenParams& forbidden, const sim::StageParams* stage) {
  if (!forbidden.floor && !forbidden.holder) {
    return Problem{"forbidden",
                   "forbids nothing, allowed: add [forbidden.floor] or [forbidden.holder], or leave it out"};
  }
  if (forbidden.shaft_radius_m < forbidden.tip_radius_m) {
    return Problem{"forbidden.shaft_radius_um",
                   fmt::format("{:g} is smaller than the tip, allowed: at least tip_radius_um = {:g}",
                               um(forbidden.shaft_radius_m), um(forbidden.tip_radius_m))};
  }
  const double kept_m = forbidden.clearance_m + forbidden.tip_radius_m;
  if (forbidden.holder && forbidden.felt_m > kept_m) {
    return Problem{
        "forbidden.felt_um",
        fmt::format("the holder's edge would be stiffer than K_N_m, allowed: at most clearance_um + "
                    "tip_radius_um = {:g}",
                    um(kept_m))};
  }
  if (forbidden.floor && std::abs(forbidden.floor->z_m) <= kept_m) {
    return Problem{"forbidden.floor.z_um",
                   fmt::format("leaves the needle no room in the picture's plane, allowed: further than "
                               "clearance_um + tip_radius_um = {:g} from 0",
                               um(kept_m))};
  }
  if (stage == nullptr) {
    return std::nullopt;
  }
  const rt::ForbiddenRegions regions(forbidden);
  const rt::NeedlePose start{stage->start_m + stage->registration_m, stage->axis};
  for (const rt::Region region : rt::kRegions) {
    if (regions.has(region) && regions.widest_gap(region, start).apart_m < 0) {
      return Problem{"sim.stage.start_um",
                     fmt::format("is in a forbidden region, allowed: outside [forbidden.{}]",
                                 region == rt::Region::floor ? "floor" : "holder")};
    }
  }
  return std::nullopt;
}

Found check_position_scale(const rt::MappingParams& m) {
  if (m.position_scale_min != 0 && (m.position_scale_min < 1 || m.position_scale_min > m.position_scale)) {
    return Problem{
        "mapping.position_scale_min",
        fmt::format("{:g} is no lower bound, allowed: 0 (no less), or from 1 to position_scale = {:g}",
                    m.position_scale_min, m.position_scale)};
  }
  if (m.position_scale_max != 0 && m.position_scale_max < m.position_scale) {
    return Problem{
        "mapping.position_scale_max",
        fmt::format("{:g} is no upper bound, allowed: 0 (no more), or from position_scale = {:g} on",
                    m.position_scale_max, m.position_scale)};
  }
  return std::nullopt;
}

Found check_workspace(const rt::MappingParams& m, const sim::StageParams* stage) {
  for (int i = 0; i < 3; ++i) {
    if (m.workspace_min_m[i] >= m.workspace_max_m[i]) {
      return Problem{"mapping.workspace_min_um",
                     fmt::format("is not below workspace_max_um in {}, allowed: below {:g}", "xyz"[i],
                                 um(m.workspace_max_m[i]))};
    }
    if (stage == nullptr) {
      continue;
    }
    if (stage->start_m[i] < m.workspace_min_m[i] || stage->start_m[i] > m.workspace_max_m[i]) {
      return Problem{"sim.stage.start_um",
                     fmt::format("is outside the workspace in {}, allowed: from {:g} to {:g}", "xyz"[i],
                                 um(m.workspace_min_m[i]), um(m.workspace_max_m[i]))};
    }
    if (std::abs(stage->start_m[i]) > stage->travel_m) {
      return Problem{"sim.stage.start_um",
                     fmt::format("is beyond the stage's travel in {}, allowed: within +-{:g}", "xyz"[i],
                                 um(stage->travel_m))};
    }
  }
  return std::nullopt;
}

// A window that is not kept whole, or a limit that it hardly reaches, would be no limit.
Found check_overrun(const rt::ServoConfig& servo) {
  constexpr double kMost = rt::MissedWindow::kMaxTicks;
  const double ticks = servo.overrun_window_s * servo.rate_Hz;
  if (ticks > kMost) {
    return Problem{"servo.overrun_window_s",
                   fmt::format("holds more ticks than are counted, allowed: at most {:g} / rate_hz = {:g}",
                               kMost, rounded_down(kMost / servo.rate_Hz))};
  }
  if (2 * servo.overrun_limit > ticks) {
    return Problem{"servo.overrun_limit",
                   fmt::format("is more than half of the ticks in the window, allowed: at most "
                               "overrun_window_s * rate_hz / 2 = {:g}",
                               std::floor(ticks / 2))};
  }
  return std::nullopt;
}

Found check_core(const Scene& s) {
  const auto& servo = s.servo;
  const sim::StageParams* stage = s.sim && s.devices.stage == kSimulated ? &s.sim->stage : nullptr;
  if (auto p = check_renderable(servo)) {
    return p;
  }
  if (auto p = check_limits(servo)) {
    return p;
  }
  if (auto p = check_overrun(servo)) {
    return p;
  }
  if (stage != nullptr) {
    if (auto p = check_stage(servo, *stage)) {
      return p;
    }
  }
  if (servo.membrane && servo.membrane->c_m * 4 > servo.membrane->R_m) {
    return Problem{"membrane.c_um", fmt::format("is too thick for the cell, allowed: at most R_um / 4 = {:g}",
                                                um(servo.membrane->R_m / 4))};
  }
  if (auto p = check_workspace(servo.mapping, stage)) {
    return p;
  }
  if (auto p = check_position_scale(servo.mapping)) {
    return p;
  }
  if (servo.forbidden) {
    if (auto p = check_forbidden(*servo.forbidden, stage)) {
      return p;
    }
  }
  if (servo.phases && servo.phases->contact_on_m >= servo.phases->indentation_on_m) {
    return Problem{"phases.contact_on_um", fmt::format("is not below indentation_on_um, allowed: below {:g}",
                                                       um(servo.phases->indentation_on_m))};
  }
  if (servo.phases && servo.phases->contact_off_m >= servo.phases->clear_m) {
    return Problem{"phases.contact_off_um",
                   fmt::format("is not below clear_um, allowed: below {:g}", um(servo.phases->clear_m))};
  }
  return std::nullopt;
}

// ---- camera and vision ----

Found check_camera(const Scene& s) {
  const sim::MicroscopeParams* microscope = s.simulated_camera() ? &*s.sim->microscope : nullptr;
  const double fps = s.recorded              ? s.recorded->fps
                     : s.camera              ? s.camera->fps
                     : microscope != nullptr ? microscope->fps
                                             : 0;
  if (fps > s.servo.rate_Hz / 2) {
    return Problem{"camera.fps", fmt::format("is too fast for the servo, allowed: at most rate_hz / 2 = {:g}",
                                             s.servo.rate_Hz / 2)};
  }
  if (s.servo.local_model && fps > 0) {
    const double least = 1.5 / fps + (microscope != nullptr ? microscope->latency_s : 0);
    if (s.servo.local_model->stale_after_s < least) {
      return Problem{
          "local_model.stale_after_s",
          fmt::format("every frame would be stale, allowed: at least 1.5 / fps + latency = {:g}", least)};
    }
  }
  return std::nullopt;
}

Found check_vision(const Scene& s) {
  if (!s.vision) {
    return std::nullopt;
  }
  const auto& v = *s.vision;
  if (v.R_min_m >= v.R_max_m) {
    return Problem{"vision.radius_min_um",
                   fmt::format("is not below radius_max_um, allowed: below {:g}", um(v.R_max_m))};
  }
  if (s.simulated_camera() && s.sim->cell && (s.sim->cell->R_m < v.R_min_m || s.sim->cell->R_m > v.R_max_m)) {
    return Problem{"vision.radius_min_um",
                   fmt::format("the cell's radius of {:g} is not looked for, allowed: a range "
                               "that contains it",
                               um(s.sim->cell->R_m))};
  }
  return std::nullopt;
}

// ---- scheduled failures ----

bool can_fail(const Scene& s, sim::Device device) {
  switch (device) {
    case sim::Device::camera:
    case sim::Device::vision:
      return s.sim->microscope.has_value();
    case sim::Device::injector:
      return s.sim->injector.has_value();
    case sim::Device::vacuum:
      return s.sim->holder.has_value();
    case sim::Device::force_sensor:
      return s.sim->force_sensor.has_value();
    case sim::Device::hand:
      return s.devices.haptic == kSimulated;
    case sim::Device::stage:
      return s.devices.stage == kSimulated;
    case sim::Device::estop:
      return s.devices.estop == kSimulated;
  }
  return false;
}

// The names of an enumeration of [[sim.failure]] that pass.
template <typename Enum, typename Passes>
std::string names_of(Passes passes) {
  std::string out;
  const auto add = [&](const auto& key) {
    if constexpr (requires {
                    key.names;
                    key.first;
                  }) {
      if constexpr (std::is_same_v<decltype(key.first), Enum>) {
        for (std::size_t i = 0; i < key.names.size(); ++i) {
          if (passes(static_cast<Enum>(static_cast<std::size_t>(key.first) + i))) {
            out += fmt::format("{}\"{}\"", out.empty() ? "" : ", ", key.names[i]);
          }
        }
      }
    }
  };
  std::apply([&](const auto&... key) { (add(key), ...); },
             keys_of(static_cast<const sim::ScheduledFailure*>(nullptr)));
  return out;
}
template <typename Enum>
std::string name_of(Enum value) {
  return names_of<Enum>([value](Enum other) { return other == value; });
}

Found check_failure_size(const sim::ScheduledFailure& f, const std::string& name) {
  const auto wrong = [&](const char* allowed) {
    return Problem{name + ".size",
                   fmt::format("{} does not suit kind = {}, allowed: {}", f.size, name_of(f.kind), allowed)};
  };
  using sim::Failure;
  const bool yes_or_no = sim::is_yes_or_no(f.channel);
  switch (f.kind) {
    case Failure::sparse:
    case Failure::repeat:
      if (f.size < 2 || f.size > 1000 || f.size != std::floor(f.size)) {
        return wrong("a whole number, 2 .. 1000");
      }
      return std::nullopt;
    case Failure::creep:
      if (f.size == 0 || std::abs(f.size) > 0.01) {
        return wrong("a speed in m/s, -0.01 .. 0.01, not 0");
      }
      return std::nullopt;
    case Failure::set:
      if (yes_or_no && f.size != 0 && f.size != 1) {
        return wrong("0 (no) or 1 (yes)");
      }
      break;
    case Failure::glitch:
    case Failure::offset:
    case Failure::drift:
      if (yes_or_no != (f.size == 0)) {
        return wrong(yes_or_no ? "0: yes and no are exchanged" : "any number but 0");
      }
      break;
    default:
      if (f.size != 0) {
        return wrong("0: it has no size");
      }
      return std::nullopt;
  }
  if (f.channel == sim::Channel::time && std::abs(f.size) > 1e6) {
    return wrong("-1e6 .. 1e6 s");
  }
  return std::nullopt;
}

Found check_failure(const Scene& s, const sim::ScheduledFailure& f, const std::string& name) {
  using sim::Channel;
  using sim::Component;
  using sim::Failure;
  if (!can_fail(s, f.device)) {
    return Problem{name + ".device", "this scene has no such simulated device, allowed: one that is there"};
  }
  if (!sim::can_have(f.device, f.kind)) {
    return Problem{name + ".kind",
                   fmt::format("{} is no failure of {}, allowed: {}", name_of(f.kind), name_of(f.device),
                               names_of<Failure>([&](Failure k) { return sim::can_have(f.device, k); }))};
  }
  if (!sim::can_concern(f.device, f.kind, f.channel)) {
    const std::string channels =
        names_of<Channel>([&](Channel c) { return sim::can_concern(f.device, f.kind, c); });
    return Problem{name + ".channel",
                   f.channel == Channel::none
                       ? fmt::format("kind = {} needs it, allowed: {}", name_of(f.kind), channels)
                       : fmt::format("{} of {} does not concern {}, allowed: {}", name_of(f.kind),
                                     name_of(f.device), name_of(f.channel), channels)};
  }
  const bool four = f.channel == Channel::orientation;
  if ((f.component == Component::w && !four) || (f.component == Component::all && f.kind == Failure::creep)) {
    return Problem{name + ".component",
                   fmt::format("there is no such component, allowed: \"x\", \"y\", \"z\"{}",
                               f.kind == Failure::creep ? "" : ", \"all\"")};
  }
  if (f.every_s != 0 && f.kind != Failure::glitch) {
    return Problem{name + ".every_s", "only a glitch repeats, allowed: 0"};
  }
  return check_failure_size(f, name);
}

Found check_failures(const Scene& s) {
  for (int i = 0; s.sim && i < s.sim->failure_count; ++i) {
    if (auto p = check_failure(s, s.sim->failures[static_cast<std::size_t>(i)],
                               fmt::format("sim.failure[{}]", i))) {
      return p;
    }
  }
  return std::nullopt;
}

Found check_stream(const Scene& s) {
  if (s.stream && !udp_address(s.stream->to)) {
    return Problem{
        "stream.to",
        fmt::format("\"{}\": no address with a port, allowed: \"192.168.1.7:9000\" or \"[fd00::7]:9000\"",
                    printable(s.stream->to, 60))};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Problem> check_together(const Scene& scene) {
  for (const auto check : {check_needs, check_live_camera, check_gpiod, check_backends, check_can_stage,
                           check_falcon, check_evdev, check_browser, check_zaber, check_plant, check_core,
                           check_camera, check_vision, check_failures, check_stream}) {
    if (auto p = check(scene)) {
      return p;
    }
  }
  return std::nullopt;
}

}  // namespace punctum::tools
