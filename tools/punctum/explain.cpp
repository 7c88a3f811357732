#include "tools/punctum/explain.hpp"

#include <fmt/format.h>
#include <glob.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "rt/control/device_limits.hpp"
#include "rt/forces/list.hpp"
#include "rt/platform/real_time_rights.hpp"
#include "tools/punctum/device_looks.hpp"
#include "tools/scene/messages.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/shared/child.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

// Where one frame comes from.
std::string camera_text(const Scene& s) {
  if (s.recorded) {
    return fmt::format("  recorded frames       {} at {:g} per s", s.recorded->frames, s.recorded->fps);
  }
  if (s.camera) {
    const hal::CameraSettings& c = *s.camera;
    const std::string which = s.v4l2                                ? s.v4l2->path
                              : s.aravis && !s.aravis->name.empty() ? s.aravis->name
                                                                    : "";
    return fmt::format("  camera                {}{}{}, {} x {} px, {:g} um/px{}", s.devices.camera,
                       which.empty() ? "" : " ", which, c.width, c.height, c.pixel_m * 1e6,
                       c.fps > 0 ? fmt::format(", {:g} per s", c.fps) : "");
  }
  if (!s.simulated_camera()) {
    return fmt::format("  camera                {}", s.devices.camera);
  }
  const sim::MicroscopeParams& m = *s.sim->microscope;
  return fmt::format("  simulated microscope  {} x {} px, {:g} um/px, {:g} per s, seen {:g} ms later{}",
                     m.width, m.height, m.pixel_m * 1e6, m.fps, m.latency_s * 1e3,
                     m.relief ? fmt::format(", in relief, lit from {:g} degrees", m.relief->light_deg) : "");
}

std::string cpu(int n) { return n < 0 ? "any CPU" : fmt::format("CPU {}", n); }

// Of one frame, once everything is found and far from the cell: the picture, pipettes, what hides membranes,
// the membranes, the undeformed cell.
int vision_stages(const vision::VisionConfig& v) {
  return 4 + (v.holder ? 1 : 0) + (v.needle ? 1 : 0) + (v.inner ? 1 : 0);
}

// What each absent table would have cost. Sizes are of the order of magnitude, for orientation.
struct Saving {
  const char* table;
  const char* saves;
};
constexpr Saving kSavings[] = {
    {"sim.cell", "no membrane is solved and tabled, no contact is stepped"},
    {"sim.cell.inner", "one membrane table and one contact less per tick"},
    {"sim.holder", "no suction to hold or lose the cell"},
    {"vacuum", "no pressure is read or watched"},
    {"injector", "no gate is driven; the inject button does nothing"},
    {"gpiod", "no GPIO line is claimed"},
    {"force_sensor", "no force is read besides the estimate"},
    {"camera", "no pictures"},
    {"vision", "no vision process: no OpenCV in memory, the second CPU stays free"},
    {"vision.holder", "no correlation for the holding pipette"},
    {"phases", "no phase detection: always `free`"},
    {"local_model", "no membrane model between frames, no pose history"},
    {"membrane", "no membrane force"},
    {"cone", "no cone guide"},
    {"axis", "no withdrawal axis"},
    {"damping", "no viscous damping"},
    {"guard", "no passivity guard: the device must be passive with these effects by itself"},
    {"enabling", "no enabling device: drives get power as soon as the core runs"},
    {"repulsive", "no region is kept free"},
    {"friction", "no dry friction"},
    {"vibration", "no burst marks contact and puncture"},
    {"forbidden", "nothing keeps the needle from dish floor and holding pipette but the workspace"},
    {"forbidden.floor", "nothing keeps the needle from the dish floor but the workspace"},
    {"forbidden.holder", "nothing keeps the needle from the holding pipette"},
    {"sim.dish", "the simulated dish has no floor"},
    {"sim.camera.relief", "the simulated microscope shows bright field"},
    {"cia402", "no CAN bus"},
    {"watchdog", "a machine that hangs stays as it is, with the drives off by the relay"},
    {"stream", "no other machine is told positions and forces"},
    {"v4l2", "no camera of the kernel's is opened"},
    {"aravis", "no GenICam camera is looked for, and its library is not loaded"},
    {"falcon", "no firmware is loaded into a USB handle"},
    {"positioner", "no slow manipulator is held"},
    {"zaber", "no serial line"},
    {"evdev", "no input device is taken from the desktop"},
};

// An effect in one phrase; by its name alone where there is nothing more to say.
template <class Params>
std::string text_of(const char* name, const Params& /*params*/) {
  return name;
}
std::string text_of(const char* /*name*/, const rt::MembraneParams& m) {
  return fmt::format("membrane ({}, E {:g} kPa, h {:g} um, c {:g} um)",
                     m.law == rt::MembraneParams::Law::paper ? "paper" : "large deflection", m.E_Pa * 1e-3,
                     m.h_m * 1e6, m.c_m * 1e6);
}
std::string text_of(const char* /*name*/, const rt::ConeParams& c) {
  return fmt::format("cone guide ({}, {:g} N/m)",
                     c.method == rt::ConeParams::Method::paper ? "paper" : "potential", c.K_N_m);
}
std::string text_of(const char* /*name*/, const rt::AxisParams& a) {
  return fmt::format("withdrawal axis ({:g} N/m)", a.K_N_m);
}
std::string text_of(const char* /*name*/, const rt::DampingParams& d) {
  return fmt::format("damping ({:g} outside, {:g} Ns/m inside)", d.B1_Ns_m, d.B2_Ns_m);
}
std::string text_of(const char* /*name*/, const rt::RepulsiveParams& r) {
  return fmt::format("repulsive region (radius {:g} um, {:g} N/m)", r.radius_m * 1e6, r.K_N_m);
}
std::string text_of(const char* /*name*/, const rt::FrictionParams& f) {
  return fmt::format("friction ({:g} N, {:g} N/m before it slides)", f.F_c_N, f.K_N_m);
}
std::string text_of(const char* /*name*/, const rt::VibrationParams& v) {
  return fmt::format("vibration at contact and puncture ({:g} Hz, {:g} N)", v.frequency_Hz, v.amplitude_N);
}
std::string text_of(const char* /*name*/, const rt::ForbiddenParams& f) {
  return fmt::format("walls of forbidden regions ({}{}{}, {:g} N/m)", f.floor ? "floor" : "",
                     f.floor && f.holder ? ", " : "", f.holder ? "holder" : "", f.K_N_m);
}

// One line per staged failure: its keys, without those that are as if not given.
std::string failures(Scene s) {
  Scene unset = s;
  unset.sim->failures = {};
  const List& list = *list_named("sim.failure");
  std::string out;
  for (int i = 0; i < s.sim->failure_count; ++i) {
    const auto keys = list.keys(s, i);
    const auto defaults = list.keys(unset, i);
    std::string text;
    for (std::size_t k = 0; k < keys.size(); ++k) {
      const std::string value = value_text(keys[k]);
      if (k < 3 || value != value_text(defaults[k])) {  // device, kind and time are always given
        text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", keys[k].name, value);
      }
    }
    out += fmt::format("                 {}\n", text);
  }
  return out;
}

std::string task_text(const Scene& s) {
  return fmt::format("  task       {}{}\n  clock      {}\n",
                     !s.servo.phases     ? "none, runs until its time limit"
                     : s.servo.cells > 0 ? fmt::format("inject {} cell(s)", s.servo.cells)
                                         : "open-ended",
                     s.seconds > 0 ? fmt::format(", at most {} s", s.seconds) : ", no time limit",
                     s.clock == ClockKind::real ? "real" : "virtual: as fast as everybody is ready");
}

std::string processes_text(const Scene& s) {
  const bool falcon = s.devices.haptic == kFalcon;
  std::string out = fmt::format(
      "{} processes of one thread each{}, and one that writes to the terminal\n"
      "  punctum         ordinary, memory not locked: starts, watches, records, reports\n"
      "  punctum-core    one real-time thread: SCHED_FIFO {}, {}, memory locked, {} Hz (every "
      "{:g} us)\n",
      s.vision ? 3 : 2, falcon ? ", one of the handle" : "", s.core_priority, cpu(s.core_cpu),
      s.servo.rate_Hz, 1e6 / s.servo.rate_Hz);
  if (falcon) {
    const int own_cpu = s.falcon ? s.falcon->cpu : -1;
    out += fmt::format("                  and the Falcon's: SCHED_FIFO {}, {}, a frame out and one back\n",
                       std::max(s.core_priority - 1, 1),
                       own_cpu < 0 && s.core_cpu >= 0 ? "any other CPU" : cpu(own_cpu));
  }
  if (s.vision) {
    out += fmt::format("  punctum-vision  nice {}, {}, one observation per frame\n", s.vision_nice,
                       cpu(s.vision_cpu));
  }
  return out + "  they meet in    the station segment" +
         (s.sim ? " and the bench segment of the simulated world" : "") + "\n";
}

std::string velocity_text(const rt::VelocityParams& v) {
  return (v.method == rt::VelocityParams::Method::kalman
              ? fmt::format("Kalman filter, jerk {:g} m/s^3/sqrt(Hz), encoder step {:g} mm", v.jerk_m_s3_rtHz,
                            v.d_m * 1e3)
              : fmt::format("FOAW, window {} at 1 kHz, +-{:g} mm", v.window, v.d_m * 1e3)) +
         (v.smooth_s > 0 ? fmt::format(", low-pass {:g} ms", v.smooth_s * 1e3) : "");
}

std::string effects_text(const rt::ServoConfig& servo) {
  std::string effects;
  int there = 0;
#define PUNCTUM_EFFECT(name, Class)                                         \
  if (servo.name) {                                                         \
    effects += (effects.empty() ? "" : ", ") + text_of(#name, *servo.name); \
    ++there;                                                                \
  }
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
  return there == 0 ? std::string("none") : fmt::format("{}: {}", there, effects);
}

std::string tick_text(const Scene& s) {
  const rt::ServoConfig& servo = s.servo;
  const double rate = servo.rate_Hz;
  std::string out = "one tick of the core, in this order\n";
  const auto line = [&out](const std::string& text) { out += text + "\n"; };
  if (s.sim) {
    line("  the simulated plant steps to now");
  }
  line(std::string("  read devices          hand, stage, e-stop contacts") +
       (s.devices.enabling.empty() ? "" : ", enabling switch") + (servo.vacuum ? ", holding vacuum" : "") +
       (servo.force_sensor ? ", force sensor" : ""));
  if (s.vision) {
    line("  newest observation    from vision, compared with the pose at its exposure");
  }
  line("  velocity              " + velocity_text(servo.velocity));
  if (servo.phases) {
    line("  phase                 free > contact > indentation > puncture > injection > withdrawal > clear");
  }
  line("  force effects         " + effects_text(servo));
  if (const auto& g = servo.guard) {
    line(
        fmt::format("  passivity guard       stiffness up to {:g} N/m, {:g} of what the device keeps passive",
                    g->margin * rt::passive_stiffness_N_m(servo.device, 1 / rate), g->margin));
  }
  line(fmt::format(
      "  limits                hand {:g} N, stage {:g} um/s, depth {:g} um, far wall {:g} um, tip {:g} uN",
      servo.limits.hand_force_N, servo.limits.stage_velocity_m_s * 1e6,
      servo.limits.penetration_depth_m * 1e6, servo.limits.far_wall_m * 1e6,
      servo.limits.tip_force_hard_N * 1e6));
  line(fmt::format(
      "  stage set-point       every {} tick ({:g} Hz), hand / {:g}, tremor filter {}", servo.stage_divisor,
      rate / servo.stage_divisor, servo.mapping.position_scale,
      servo.mapping.tremor_cutoff_Hz > 0 ? fmt::format("{:g} Hz", servo.mapping.tremor_cutoff_Hz) : "off"));
  line(std::string("  write devices         ") +
       (s.hand_feels() ? "force to the hand" : "no force (the hand is a device without; it is shown)") +
       ", stage, heartbeat" +
       (servo.injector ? fmt::format(", injector gate (at most {:g} s)", servo.injector->max_open_s) : ""));
  line("  telemetry             one sample, no system call");
  return out;
}

std::string frame_text(const Scene& s) {
  const vision::VisionConfig& v = *s.vision;
  std::string out = "one frame of vision\n" + camera_text(s) + "\n";
  if (const int by = s.vision->binning(); by > 1) {
    out += fmt::format(
        "                        {0} x {0} pixels are looked at as one: finer ones only blur\n", by);
  }
  if (v.method == vision::Method::truth) {
    return out + "  truth                 the simulated world's own; no picture is drawn or looked at\n";
  }
  out += fmt::format("  {}{}impurities, outer membrane{} ({}), {}w_d, a, R\n",
                     v.holder ? "holding pipette (correlation), " : "",
                     v.needle ? "injection pipette and tip, erase pipettes, " : "",
                     v.inner ? " and inner membrane" : "",
                     v.method == vision::Method::tracker ? fmt::format("{} points", v.contour_points)
                                                         : fmt::format("snake, {} nodes", v.snake.nodes),
                     v.needle ? "contact, puncture, " : "");
  if (v.surface) {
    out += "  control nets of the membranes' surfaces\n";
  }
  const int far = vision_stages(v);
  return out + (v.needle
                    ? fmt::format("  {} stages far from the cell, where no contact is looked for, {} at it\n",
                                  far, far + 1)
                    : fmt::format("  {} stages\n", far));
}

// Empty where nothing is left out.
std::string left_out_text(const Scene& s) {
  std::string absent;
  for (const auto& t : tables(s)) {
    if (t.present) {
      continue;
    }
    for (const auto& saving : kSavings) {
      if (t.name == saving.table) {
        absent += fmt::format("  {:<15} {}\n", t.name, saving.saves);
      }
    }
  }
  if (s.vision && s.vision->method != vision::Method::truth && !s.vision->inner) {
    absent += fmt::format("  {:<15} {}\n", "vision.inner", "no edge is looked for inside the outer membrane");
  }
  if (s.vision && s.vision->method != vision::Method::truth && !s.vision->surface) {
    absent += fmt::format("  {:<15} {}\n", "vision.surface", "no surface is reconstructed from the contours");
  }
  return absent.empty() ? ""
                        : "left out, and nothing is spent on it (`punctum-report scenes` counts)\n" + absent;
}

}  // namespace

std::string explain(const Scene& s) {
  std::string out =
      fmt::format("{}: {}\n", printable(s.name), printable(s.title.empty() ? s.source : s.title, 200));
  out += task_text(s) + processes_text(s) + tick_text(s);
  if (s.vision) {
    out += frame_text(s);
  }
  out += left_out_text(s);
  if (s.sim && s.sim->failure_count + s.sim->estop_event_count > 0) {
    out += fmt::format("staged           {} device failures, {} e-stop presses\n", s.sim->failure_count,
                       s.sim->estop_event_count) +
           failures(s);
  }
  return out;
}

std::string explain_keys(const Scene& scene) {
  Scene everything = scene;
  std::string out;
  for (const auto& t : scene_tables()) {
    const bool there = t.there(scene);
    if (!there) {
      t.put(everything, true);
    }
    if (!t.there(everything)) {
      continue;
    }
    out += fmt::format("\n[{}]{}\n", t.name,
                       t.kind == Kind::required ? "  (must be there)"
                       : there                  ? ""
                                                : "  (not in this scene)");
    for (const auto& k : t.keys(everything)) {
      out += fmt::format("  {:<24} {:<16} {}\n", k.name, value_text(k), allowed(k));
    }
  }
  return out;
}

tl::expected<std::string, std::string> files_of(const Scene& s) {
  std::string found;
  if (s.recorded) {
    std::error_code ec;
    const std::string& f = s.recorded->frames;
    std::size_t n = 0;
    bool readable = false;
    if (fs::is_directory(f, ec)) {
      for (auto it = fs::directory_iterator(f, ec); !ec && it != fs::directory_iterator(); it.increment(ec)) {
        n += it->is_regular_file(ec) ? 1U : 0U;
      }
      readable = access(f.c_str(), R_OK | X_OK) == 0;
    } else {
      glob_t matches{};
      if (glob(f.c_str(), 0, nullptr, &matches) == 0) {
        n = matches.gl_pathc;
        readable = n > 0 && access(matches.gl_pathv[0], R_OK) == 0;
      }
      globfree(&matches);
    }
    if (n == 0) {
      return tl::unexpected(fmt::format(
          "camera.frames: {}: nothing there, allowed: a folder of pictures, a glob or a video file", f));
    }
    if (!readable) {
      return tl::unexpected(fmt::format("camera.frames: {}: cannot be read, check its permissions", f));
    }
    found = fmt::format("{}: {} file(s)", f, n);
  }
  if (s.vision && s.vision->holder && !s.vision->holder->template_path.empty()) {
    const std::string& f = s.vision->holder->template_path;
    std::error_code ec;
    if (!fs::is_regular_file(f, ec) || access(f.c_str(), R_OK) != 0) {
      return tl::unexpected(
          fmt::format("vision.holder.template: {}: cannot be read, allowed: a picture of the pipette", f));
    }
    found += (found.empty() ? "" : ", ") + f;
  }
  return found;
}

int check(const Scene& s, std::string& text) {
  bool good = true;
  const auto row = [&text](bool ok, const std::string& what, const std::string& detail) {
    text += fmt::format("  {} {:<18} {}\n", ok ? "ok  " : "FAIL", what, detail);
    return ok;
  };
  text += fmt::format("{}: reads and fits together\n", s.name);
  for (const char* program : {"punctum-core", "punctum-vision"}) {
    if (!s.vision && std::string_view(program) == "punctum-vision") {
      continue;
    }
    const auto path = find_program(program);
    good = row(!path.empty(), program, path.empty() ? "not found beside this program nor in PATH" : path) &&
           good;
  }
  for (const auto& [device, finding] : look_at_devices(s)) {
    using Is = hal::Finding::Is;
    text += fmt::format("  {} {:<18} {}\n",
                        finding.is == Is::found  ? "ok  "
                        : finding.is == Is::note ? "note"
                                                 : "FAIL",
                        device, finding.line);
    good = good && finding.is != Is::missing;
  }
  if (s.recorded || (s.vision && s.vision->holder && !s.vision->holder->template_path.empty())) {
    const auto files = files_of(s);
    good = row(files.has_value(), "files", files ? *files : files.error()) && good;
  }
  if (s.falcon && !s.falcon->firmware.empty()) {
    const std::string& file = s.falcon->firmware;
    const bool there = std::filesystem::is_regular_file(file) && access(file.c_str(), R_OK) == 0;
    good =
        row(there, "firmware",
            there ? file
                  : fmt::format("falcon.firmware: {}: cannot be read, allowed: a C2000 boot stream", file)) &&
        good;
  }
  if (s.vision_cpu >= 0) {  // that of the core is one of its rights
    const std::vector<int> online = rt::read_kernel_facts().online_cpus;
    const bool there = std::count(online.begin(), online.end(), s.vision_cpu) > 0;
    text += fmt::format("  {} {:<18} CPU {} of {}{}\n", there ? "ok  " : "note", "vision.cpu", s.vision_cpu,
                        online.size(), there ? "" : ": vision runs wherever it may");
  }

  // Without the required rights the core runs degraded, and says so.
  rt::RightsWanted wanted;
  wanted.priority = s.core_priority;
  wanted.cpu = s.core_cpu;
  const auto rights = rt::RealTimeRights::examine(wanted);
  for (const auto& r : rights.table()) {
    text += fmt::format("  {} {:<18} {}{}\n",
                        r.got        ? "ok  "
                        : r.required ? "MISS"
                                     : "note",
                        r.name, r.detail, r.got || r.remedy.empty() ? "" : "; " + r.remedy);
  }
  text += good ? "can run\n" : "cannot run\n";
  return good ? 0 : 2;
}

}  // namespace punctum::tools
