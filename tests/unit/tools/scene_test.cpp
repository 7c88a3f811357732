// Scenes: a bad file is told in one line, a good one reads back to the same numbers.
#include "tools/scene/scene.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tools/scene/messages.hpp"
#include "tools/scene/scene_keys.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

// The shortest scene that is one.
const std::string kLeast = "[haptic]\n[stage]\n[sim.operator]\n[sim.needle]\n";
const std::string kCell = kLeast + "[sim.cell]\n[camera]\n[vision]\ninner = false\n";  // 8 lines

struct Broken {
  const char* what;
  std::string text;
  std::string message;  // the whole of it
};

std::string many(const std::string& piece, int n) {
  std::string text;
  for (int i = 0; i < n; ++i) {
    text += piece;
  }
  return text;
}

std::string failure(const std::string& device, const std::string& kind, const std::string& rest) {
  return "[[sim.failure]]\ndevice = \"" + device + "\"\nkind = \"" + kind + "\"\nat_s = 1\n" + rest + "\n";
}

std::string many_failures(int n) {
  std::string text;
  for (int i = 0; i < n; ++i) {
    text += "[[sim.failure]]\ndevice = \"stage\"\nkind = \"drop\"\nat_s = 1\n";
  }
  return text;
}

// As a message lists them.
const std::string kTables =
    "scene, servo, haptic, stage, estop, vacuum, injector, force_sensor, camera, positioner, gpiod, cia402, "
    "evdev, zaber, falcon, v4l2, aravis, watchdog, stream, "
    "velocity, mapping, limits, vision, phases, local_model, membrane, cone, axis, damping, repulsive, "
    "friction, vibration, forbidden, guard, enabling, sim";

const std::vector<Broken>& broken() {
  static const std::string cone_keys = "method, K_N_m, d0_um, r0_um, alpha_rad, eps_um, ramp_s, reach_um";
  static const std::string needle = "[stage]\n[sim.needle]\nradius_um = 3.8\n";
  static const std::string gpiod_scene =
      kLeast + "[estop]\ndevice = \"gpiod\"\n[gpiod]\ncontact_a = 1\nreset = 3\n";
  static const std::string vacuum_switch =
      kLeast + "[gpiod]\nvacuum_switch = 5\nvacuum_switch_kPa = 0.5\n[vacuum]\ndevice = \"gpiod\"\n";
  static const std::string sim_tables =
      "sim.operator, sim.haptic, sim.stage, sim.needle, sim.estop, sim.cell, sim.holder, sim.dish, "
      "sim.injector, "
      "sim.force_sensor, sim.camera, sim.failure, sim.estop_press";
  static const std::vector<Broken> list = {
      {"nothing at all", "",
       "b.toml:1:1: haptic: the table is missing, allowed: [haptic] with device, or with any of its keys"},
      {"no stage", "[haptic]\n[sim.operator]\n",
       "b.toml:1:1: stage: the table is missing, allowed: [stage] with device, or with any of its keys"},
      {"a table nobody knows", kLeast + "[magnet]\npower = 1\n",
       "b.toml:5:2: magnet: unknown table, allowed: " + kTables},
      {"a table misspelt", kLeast + "[vacum]\n",
       "b.toml:5:2: vacum: unknown table (did you mean vacuum?), allowed: " + kTables},
      {"a table of the simulation misspelt", kLeast + "[sim.holdr]\n",
       "b.toml:5:6: sim.holdr: unknown table (did you mean sim.holder?), allowed: " + sim_tables},
      {"no operator", "[haptic]\n[stage]\n[sim.needle]\n",
       "b.toml:1:1: sim.operator: the table is missing, allowed: [sim.operator] with any of its keys"},
      {"a table that has moved", kLeast + "[operator]\ndepth_um = 25\n",
       "b.toml:5:2: operator: unknown table (did you mean sim.operator?), allowed: " + kTables},
      {"a list that has moved", kLeast + "[[failure]]\ndevice = \"stage\"\n",
       "b.toml:5:3: failure: unknown table (did you mean sim.failure?), allowed: " + kTables},
      {"a key that has moved", "[haptic]\n[stage]\nstart_um = [90, 6, 0]\n",
       "b.toml:3:1: stage.start_um: unknown key (did you mean sim.stage.start_um?), allowed: device, "
       "timeout_ms"},
      {"a value for the simulation", "sim = 3\n", "b.toml:1:1: sim: not a table, allowed: [sim.TABLE]"},
      {"a simulated injector that the scene has not", kLeast + "[sim.injector]\nopen_ms = 5\n",
       "b.toml:5:6: sim.injector: no simulated device uses it, allowed: with device = \"simulated\" in "
       "[injector], or leave it out"},
      {"optics of a camera that is not simulated",
       kLeast + "[camera]\ndevice = \"recorded\"\nframes = \"f\"\n[vision]\n[sim.camera]\nnoise = 1\n",
       "b.toml:9:6: sim.camera: no simulated device uses it, allowed: with device = \"simulated\" in "
       "[camera], or leave it out"},
      {"a key misspelt", kLeast + "[cone]\nalpha_red = 0.2\n",
       "b.toml:6:1: cone.alpha_red: unknown key (did you mean alpha_rad?), allowed: " + cone_keys},
      {"a key without its unit", kLeast + "[cone]\nd0 = 40\n",
       "b.toml:6:1: cone.d0: unknown key (did you mean d0_um?), allowed: " + cone_keys},
      {"a key nothing like any other", kLeast + "[damping]\ncolour = 3\n",
       "b.toml:6:1: damping.colour: unknown key, allowed: B1_Ns_m, B2_Ns_m, ramp_ms"},
      {"text for a number", kLeast + "[damping]\nB1_Ns_m = \"one\"\n",
       "b.toml:6:11: damping.B1_Ns_m: \"one\" is not a number, allowed: a number from 0 to 100"},
      {"a number for a flag", kCell + "needle = 1\n",
       "b.toml:9:10: vision.needle: 1 is not true or false, allowed: true or false"},
      {"a number for text", "[scene]\ntitle = 7\n" + kLeast,
       "b.toml:2:9: scene.title: 7 is not text, allowed: text in quotes, at most 1000 characters"},
      {"half a node", kCell + "[vision.snake]\nnodes = 16.5\n",
       "b.toml:10:9: vision.snake.nodes: 16.5 is not a whole number, allowed: a whole number from 8 to 1024"},
      {"more points of a contour than vision follows", kCell + "contour_points = 1025\n",
       "b.toml:9:18: vision.contour_points: 1025 is out of range, allowed: a whole number from 128 to 1024"},
      {"a date", kLeast + "[damping]\nB1_Ns_m = 2024-01-01\n",
       "b.toml:6:11: damping.B1_Ns_m: a date or time is not a number, allowed: a number from 0 to 100"},
      {"a list for a number", kLeast + "[damping]\nB1_Ns_m = [1]\n",
       "b.toml:6:11: damping.B1_Ns_m: a list is not a number, allowed: a number from 0 to 100"},
      {"a value for a table", "haptic = 3\n", "b.toml:1:1: haptic: not a table, allowed: [haptic]"},
      {"a list for a table", "[[haptic]]\n", "b.toml:1:3: haptic: not a table, allowed: [haptic]"},
      {"a table for a list", kLeast + "[sim.failure]\n",
       "b.toml:5:6: sim.failure: not a list, allowed: [[sim.failure]]"},
      {"not a number at all", kLeast + "[damping]\nB1_Ns_m = nan\n",
       "b.toml:6:11: damping.B1_Ns_m: nan is not a finite number, allowed: a number from 0 to 100"},
      {"infinity", kLeast + "[damping]\nB1_Ns_m = inf\n",
       "b.toml:6:11: damping.B1_Ns_m: inf is not a finite number, allowed: a number from 0 to 100"},
      {"negative", kLeast + "[damping]\nB1_Ns_m = -1\n",
       "b.toml:6:11: damping.B1_Ns_m: -1 is out of range, allowed: a number from 0 to 100"},
      {"a million times too large", kLeast + "[sim.cell]\nradius_um = 60e6\n",
       "b.toml:6:13: sim.cell.radius_um: 60000000 is out of range, allowed: a number from 5 to 2000"},
      {"larger than any integer", "[scene]\nseed = 9223372036854775808\n" + kLeast,
       "b.toml:2:27: seed: not valid TOML: '9223372036854775808' is not representable in 64 bits"},
      {"a rate that is no rate", kLeast + "[servo]\nrate_hz = 3000\n",
       "b.toml:6:11: servo.rate_hz: 3000 is not one of the choices, allowed: 1000, 2000, 4000 or 8000"},
      {"a method that is none", kLeast + "[cone]\nmethod = \"funnel\"\n",
       "b.toml:6:10: cone.method: \"funnel\" is not one of the choices, allowed: \"potential\" or \"paper\""},
      {"a device that does not exist", "[haptic]\ndevice = \"phantom\"\n",
       "b.toml:2:10: haptic.device: \"phantom\" is not one of the choices, allowed: \"simulated\", "
       "\"falcon\", \"evdev\" or \"browser\""},
      {"a Falcon that nobody holds", kLeast + "[falcon]\nfirmware = \"a.bin\"\n",
       "b.toml:5:2: falcon: no handle uses it, allowed: with device = \"falcon\" in [haptic], or leave it "
       "out"},
      {"a CPU that no machine has", kLeast + "[falcon]\ncpu = 1024\n",
       "b.toml:6:7: falcon.cpu: 1024 is out of range, allowed: a whole number from -1 to 1023"},
      {"a device misspelt", "[camera]\ndevice = \"recoded\"\n",
       "b.toml:2:10: camera.device: \"recoded\" is not one of the choices (did you mean recorded?), allowed: "
       "\"simulated\", \"recorded\", "
       "\"v4l2\" or \"aravis\""},
      {"lines without a device", kLeast + "[gpiod]\n",
       "b.toml:5:2: gpiod: no device uses it, allowed: with device = \"gpiod\" in [estop], [enabling], "
       "[injector] or [vacuum], or leave it out"},
      {"a device without lines", kLeast + "[estop]\ndevice = \"gpiod\"\n",
       "b.toml:6:10: estop.device: \"gpiod\" needs [gpiod] (it says which lines), allowed: add [gpiod]"},
      {"an injector without lines", kLeast + "[injector]\ndevice = \"gpiod\"\n",
       "b.toml:6:10: injector.device: \"gpiod\" needs [gpiod] (it says which lines), allowed: add [gpiod]"},
      {"an enabling switch without lines", kLeast + "[enabling]\ndevice = \"gpiod\"\n",
       "b.toml:6:10: enabling.device: \"gpiod\" needs [gpiod] (it says which lines), allowed: add [gpiod]"},
      {"an enabling switch with one contact",
       kLeast + "[enabling]\ndevice = \"gpiod\"\n[gpiod]\nenabling_a = 5\n",
       "b.toml:7:2: gpiod.enabling_b: is missing, which [enabling] needs, allowed: the offset of a line, "
       "from "
       "0 on"},
      {"an enabling device that is neither", kLeast + "[enabling]\ndevice = \"simulated\"\n",
       "b.toml:6:10: enabling.device: \"simulated\" is not one of the choices, allowed: \"haptic\" or "
       "\"gpiod\""},
      {"an enabling switch in virtual time",
       "[scene]\nclock = \"virtual\"\n" + kLeast +
           "[enabling]\ndevice = \"gpiod\"\n[gpiod]\nenabling_a = 5\nenabling_b = 6\n",
       "b.toml:2:9: scene.clock: \"virtual\" cannot wait for enabling.device = \"gpiod\", allowed: \"real\""},
      {"an enable line without its chain",
       kLeast + "[injector]\ndevice = \"gpiod\"\n[gpiod]\ngate = 5\nenable = 6\n",
       "b.toml:9:10: gpiod.enable: is driven with the emergency stop's lines, allowed: with device = "
       "\"gpiod\" in "
       "[estop], or leave it out"},
      {"an enable line that is the heartbeat's", gpiod_scene + "contact_b = 2\nheartbeat = 4\nenable = 4\n",
       "b.toml:12:10: gpiod.enable: 4 is the line of gpiod.heartbeat too, allowed: a line of its own"},
      {"a vacuum switch without a line", kLeast + "[vacuum]\ndevice = \"gpiod\"\n[gpiod]\nvacuum_gate = 5\n",
       "b.toml:7:2: gpiod.vacuum_switch: is missing, which [vacuum] needs, allowed: the offset of a line, "
       "from "
       "0 on"},
      {"a vacuum switch that is no pressure",
       kLeast + "[vacuum]\ndevice = \"gpiod\"\n[gpiod]\nvacuum_switch = 5\n",
       "b.toml:7:2: gpiod.vacuum_switch_kPa: is missing, which [vacuum] needs, allowed: the pressure below "
       "ambient at which it closes"},
      {"a vacuum that its switch does not tell", vacuum_switch + "min_Pa = 600\nstill_s = 0\n",
       "b.toml:10:10: vacuum.min_Pa: 600, but the switch tells either 0 or 500, allowed: more than 0, at "
       "most "
       "gpiod.vacuum_switch_kPa = 0.5"},
      {"a vacuum that its switch tells always", vacuum_switch + "min_Pa = 0\nstill_s = 0\n",
       "b.toml:10:10: vacuum.min_Pa: 0, but the switch tells either 0 or 500, allowed: more than 0, at most "
       "gpiod.vacuum_switch_kPa = 0.5"},
      {"a vacuum switch that is to flicker", vacuum_switch + "still_s = 1\n",
       "b.toml:10:11: vacuum.still_s: 1, but a switch shows the same as long as it does not switch, allowed: "
       "0 "
       "with vacuum.device = \"gpiod\""},
      {"a contact without a line", gpiod_scene + "contact_b = -1\n",
       "b.toml:10:13: gpiod.contact_b: is missing, which [estop] needs, allowed: the offset of a line, from "
       "0 on"},
      {"no line at all for the heartbeat", gpiod_scene + "contact_b = 2\n",
       "b.toml:7:2: gpiod.heartbeat: is missing, which [estop] needs, allowed: the offset of a line, from 0 "
       "on"},
      {"two contacts on a line", gpiod_scene + "contact_b = 1\nheartbeat = 4\n",
       "b.toml:10:13: gpiod.contact_b: 1 is the line of gpiod.contact_a too, allowed: a line of its own"},
      {"a line below zero", gpiod_scene + "contact_b = -2\n",
       "b.toml:10:13: gpiod.contact_b: -2 is out of range, allowed: a whole number from -1 to 1023"},
      {"a chip without a path", gpiod_scene + "contact_b = 2\nheartbeat = 4\nchip = \"gpiochip0\"\n",
       "b.toml:12:8: gpiod.chip: is no path, allowed: the path of a GPIO chip, such as \"/dev/gpiochip0\""},
      {"contacts that are neither", gpiod_scene + "contacts_closed = \"shut\"\n",
       "b.toml:10:19: gpiod.contacts_closed: \"shut\" is not one of the choices, allowed: \"high\" or "
       "\"low\""},
      {"a real chain in virtual time",
       "[scene]\nclock = \"virtual\"\n" + gpiod_scene + "contact_b = 2\nheartbeat = 4\n",
       "b.toml:2:9: scene.clock: \"virtual\" cannot wait for estop.device = \"gpiod\", allowed: \"real\""},
      {"devices on a serial line without their axes", kLeast + "[positioner]\ndevice = \"zaber\"\n",
       "b.toml:6:10: positioner.device: \"zaber\" needs to know its axes, allowed: with [zaber] and three "
       "[[zaber.axis]]"},
      {"a serial line that nobody uses", kLeast + "[zaber]\n",
       "b.toml:5:2: zaber: no positioner uses it, allowed: with device = \"zaber\" in [positioner], or leave "
       "it "
       "out"},
      {"two axes of three",
       kLeast + "[positioner]\ndevice = \"zaber\"\n[zaber]\n[[zaber.axis]]\ndevice = "
                "1\n[[zaber.axis]]\ndevice = 2\n",
       "b.toml:7:2: zaber.axis: 2 of them, allowed: three [[zaber.axis]], x, y and z in this order"},
      {"an axis named twice",
       kLeast + "[positioner]\ndevice = \"zaber\"\n[zaber]\n[[zaber.axis]]\ndevice = "
                "1\n[[zaber.axis]]\ndevice = 1\naxis "
                "= 2\n[[zaber.axis]]\ndevice = 1\naxis = 1\n",
       "b.toml:15:8: zaber.axis[2].axis: device 1 axis 1 is zaber.axis[0] already, allowed: an axis of its "
       "own"},
      {"a hand of Linux without its table", "[haptic]\ndevice = \"evdev\"\nforce_max_N = 0\n" + needle,
       "b.toml:2:10: haptic.device: \"evdev\" needs [evdev] (it says which device), allowed: add [evdev]"},
      {"a hand of Linux that nobody uses", kLeast + "[evdev]\n",
       "b.toml:5:2: evdev: no hand uses it, allowed: with device = \"evdev\" in [haptic], or leave it out"},
      {"a mouse with force", "[haptic]\ndevice = \"evdev\"\n[evdev]\n" + needle,
       "b.toml:1:2: haptic.force_max_N: 8.5, but mice, gamepads and knobs render no force, allowed: 0 with "
       "haptic.device = \"evdev\""},
      {"a stream to a name", kLeast + "[stream]\nto = \"render:9000\"\n",
       "b.toml:6:6: stream.to: \"render:9000\": no address with a port, allowed: \"192.168.1.7:9000\" or "
       "\"[fd00::7]:9000\""},
      {"a stream to nowhere", kLeast + "[stream]\n",
       "b.toml:5:2: stream.to: \"\": no address with a port, allowed: \"192.168.1.7:9000\" or "
       "\"[fd00::7]:9000\""},
      {"a page with force", "[haptic]\ndevice = \"browser\"\n[enabling]\n" + needle,
       "b.toml:1:2: haptic.force_max_N: 8.5, but a page renders no force, allowed: 0 with haptic.device = "
       "\"browser\""},
      {"a page that may be left alone", "[haptic]\ndevice = \"browser\"\nforce_max_N = 0\n" + needle,
       "b.toml:2:10: haptic.device: \"browser\" needs [enabling] (letting go of the button stops), allowed: "
       "add "
       "[enabling]"},
      {"a page that opens a real injector",
       "[haptic]\ndevice = \"browser\"\nforce_max_N = 0\n[enabling]\n[injector]\ndevice = "
       "\"gpiod\"\n[gpiod]\ngate = "
       "5\n" +
           needle,
       "b.toml:6:10: injector.device: \"gpiod\", but the hand on a page moves simulated devices alone, "
       "allowed: "
       "\"simulated\" with haptic.device = \"browser\""},
      {"a page that moves a real manipulator",
       "[haptic]\ndevice = \"browser\"\nforce_max_N = 0\n[enabling]\n[positioner]\ndevice = "
       "\"zaber\"\n[zaber]\n"
       "[[zaber.axis]]\ndevice = 1\n" +
           needle,
       "b.toml:6:10: positioner.device: \"zaber\", but the hand on a page moves simulated devices alone, "
       "allowed: "
       "\"simulated\" with haptic.device = \"browser\""},
      {"a hand of Linux without a path",
       "[haptic]\ndevice = \"evdev\"\nforce_max_N = 0\n[evdev]\npath = \"event5\"\n" + needle,
       "b.toml:5:8: evdev.path: is no path, allowed: an input device, such as \"/dev/input/event5\", or "
       "empty"},
      {"a mouse in virtual time",
       "[scene]\nclock = \"virtual\"\n[haptic]\ndevice = \"evdev\"\nforce_max_N = 0\n[evdev]\n" + needle,
       "b.toml:2:9: scene.clock: \"virtual\" cannot wait for haptic.device = \"evdev\", allowed: \"real\""},
      {"two numbers for three", "[haptic]\n[stage]\n[sim.stage]\nstart_um = [90, 6]\n",
       "b.toml:4:12: sim.stage.start_um: a list is not a list of three numbers, allowed: [x, y, z], each a "
       "number "
       "from -5000 to 5000"},
      {"an axis of length zero", "[haptic]\n[stage]\n[sim.stage]\naxis = [0, 0, 0]\n",
       "b.toml:4:8: sim.stage.axis: the direction is zero, allowed: a direction [x, y, z] that is not zero, "
       "each "
       "from -1 to 1"},
      {"given twice", kLeast + "[damping]\nB1_Ns_m = 1\nB1_Ns_m = 2\n",
       "b.toml:7:11: B1_Ns_m: given twice, allowed: once"},
      {"a table given twice", kLeast + "[damping]\n[damping]\n",
       "b.toml:6:1: [damping]: given twice, allowed: once"},
      {"not TOML", kLeast + "[damping\n", "b.toml:5:9: [damping: not valid TOML: expected ']', saw '\\n'"},
      {"an open string", "[scene]\ntitle = \"never closed\n", ""},
      {"too deep", "x = " + std::string(40, '[') + "\n",
       "b.toml:1:21: x: brackets are nested too deeply, allowed: 16 levels"},
      {"tables too deep", "x = " + many("{a = ", 100'000) + "\n",
       "b.toml:1:85: x: brackets are nested too deeply, allowed: 16 levels"},
      {"a key of too many parts", many("a.", 100'000) + "a = 1\n",
       "b.toml:1:130: syntax: too many dots, allowed: 64 on a line outside of \"strings\""},
      {"B2 below B1", kLeast + "[damping]\nB1_Ns_m = 4\nB2_Ns_m = 2\n",
       "b.toml:7:11: damping.B2_Ns_m: is below the damping outside, allowed: at least B1_Ns_m = 4"},
      {"more damping than a tick can render", kLeast + "[damping]\nB1_Ns_m = 1\nB2_Ns_m = 80\n",
       "b.toml:7:11: damping.B2_Ns_m: 80 cannot be rendered, allowed: at most 0.2313 m/T = 17.35 (m = "
       "haptic.mass_kg 0.075, T = 1/servo.rate_hz = 1 ms, delay 0 ticks, velocity by Kalman filter)"},
      {"a guide without vision", kLeast + "[cone]\n",
       "b.toml:5:2: cone: needs [local_model] (it says where the entry point is), allowed: add [local_model] "
       "or "
       "leave [cone] out"},
      {"a withdrawal axis without phases", kCell + "[local_model]\n[axis]\n",
       "b.toml:10:2: axis: needs [phases] (withdrawal is a phase), allowed: add [phases] or leave [axis] "
       "out"},
      {"vision without a camera", kLeast + "[vision]\n",
       "b.toml:5:2: vision: needs [camera] (vision looks at pictures), allowed: add [camera] or leave "
       "[vision] out"},
      {"a camera nobody looks through", kLeast + "[sim.cell]\n[camera]\n",
       "b.toml:6:2: camera: needs [vision] (nobody looks at the pictures), allowed: add [vision] or leave "
       "[camera] out"},
      {"a camera and nothing before it", kLeast + "[camera]\n[vision]\n",
       "b.toml:5:2: camera: needs [sim.cell] (there is nothing to look at), allowed: add [sim.cell] or leave "
       "[camera] out"},
      {"suction without a pipette", kLeast + "[vacuum]\n",
       "b.toml:5:2: vacuum: needs [sim.holder] (suction needs a pipette), allowed: add [sim.holder] or leave "
       "[vacuum] out"},
      {"a pipette with nothing to hold", kLeast + "[sim.holder]\n",
       "b.toml:5:6: sim.holder: needs [sim.cell] (there is nothing to hold), allowed: add [sim.cell] or "
       "leave [sim.holder] "
       "out"},
      {"an inner membrane to follow that is not there", kLeast + "[sim.cell]\n[camera]\n[vision]\n",
       "b.toml:7:2: vision.inner: needs [sim.cell.inner] (there is no inner membrane to follow), allowed: "
       "add "
       "[sim.cell.inner] "
       "or leave [vision.inner] out"},
      {"surfaces of contours that nobody looks for",
       kLeast + "[sim.cell]\n[camera]\n[vision]\ninner = false\nmethod = \"truth\"\nsurface = true\n",
       "b.toml:10:11: vision.surface: needs contours, and vision.method = \"truth\" looks for none, allowed: "
       "false"},
      {"a mouth wider than its pipette",
       kLeast + "[sim.cell]\n[sim.holder]\nouter_radius_um = 20\ninner_radius_um = 30\n",
       "b.toml:8:19: sim.holder.inner_radius_um: is not smaller than the outer one, allowed: below "
       "outer_radius_um = 20"},
      {"a needle as thick as the cell",
       "[haptic]\n[stage]\n[sim.operator]\n[sim.needle]\nradius_um = 30\nshaft_radius_um = 40\n[sim.cell]\n",
       "b.toml:5:13: sim.needle.radius_um: is too thick for the cell, allowed: at most sim.cell.radius_um / "
       "4 = 15"},
      {"a shaft thinner than its tip", "[haptic]\n[stage]\n[sim.operator]\n[sim.needle]\nradius_um = 12\n",
       "b.toml:4:6: sim.needle.shaft_radius_um: 9 is smaller than the tip, allowed: at least radius_um = 12"},
      {"a needle that starts inside the cell",
       "[haptic]\n[stage]\n[sim.operator]\n[sim.needle]\n[sim.cell]\n[sim.stage]\nstart_um = [-40, 0, 0]\n",
       "b.toml:7:12: sim.stage.start_um: is inside or at the cell, allowed: at least 63.8 um from its "
       "centre"},
      {"a depth limit beyond the cell", kLeast + "[sim.cell]\n[limits]\npenetration_depth_um = 200\n",
       "b.toml:7:24: limits.penetration_depth_um: goes through the cell, allowed: at most 2 * "
       "sim.cell.radius_um "
       "= 120"},
      {"a wish deeper than the limit",
       "[haptic]\n[stage]\n[sim.needle]\n[sim.cell]\n[sim.operator]\ndepth_um = 95\n",
       "b.toml:6:12: sim.operator.depth_um: is deeper than the limit, allowed: at most "
       "limits.penetration_depth_um = 90"},
      {"a zona that is broken before it is touched", kLeast + "[sim.cell]\nzona_puncture_strain = 0.01\n",
       "b.toml:6:24: sim.cell.zona_puncture_strain: is reached before the needle touches, allowed: above "
       "zona_pretension = 0.2"},
      {"regions of which none is there", kLeast + "[forbidden]\n",
       "b.toml:5:2: forbidden: forbids nothing, allowed: add [forbidden.floor] or [forbidden.holder], or "
       "leave it out"},
      {"a floor in the picture's plane", kLeast + "[forbidden.floor]\nz_um = -3\n",
       "b.toml:6:8: forbidden.floor.z_um: leaves the needle no room in the picture's plane, allowed: further "
       "than clearance_um + tip_radius_um = 8.8 from 0"},
      {"a floor further than any stage", kLeast + "[forbidden.floor]\nz_um = 1e6\n",
       "b.toml:6:8: forbidden.floor.z_um: 1000000 is out of range, allowed: a number from -100000 to 100000"},
      {"a holder that points nowhere", kLeast + "[forbidden.holder]\naxis = [0, 0, 0]\n",
       "b.toml:6:8: forbidden.holder.axis: the direction is zero, allowed: a direction [x, y, z] that is not "
       "zero, each from -1 to 1"},
      {"a wall wider than the holder's edge allows",
       kLeast + "[forbidden.holder]\n[forbidden]\nfelt_um = 20\n",
       "b.toml:7:11: forbidden.felt_um: the holder's edge would be stiffer than K_N_m, allowed: at most "
       "clearance_um + tip_radius_um = 8.8"},
      {"a shaft thinner than its tip in the regions",
       kLeast + "[forbidden.floor]\n[forbidden]\nshaft_radius_um = 2\n",
       "b.toml:7:19: forbidden.shaft_radius_um: 2 is smaller than the tip, allowed: at least tip_radius_um = "
       "3.8"},
      {"a stage that starts in the holder",
       kLeast + "[forbidden.holder]\nmouth_um = [120, 0, 0]\n[sim.stage]\nstart_um = [90, 6, 0]\n",
       "b.toml:8:12: sim.stage.start_um: is in a forbidden region, allowed: outside [forbidden.holder]"},
      {"a wall too stiff for the handle", kLeast + "[forbidden.floor]\n[forbidden]\nK_N_m = 2000\n", ""},
      {"a lowest scale above the scale", kLeast + "[mapping]\nposition_scale_min = 600\n",
       "b.toml:6:22: mapping.position_scale_min: 600 is no lower bound, allowed: 0 (no less), or from 1 to "
       "position_scale = 500"},
      {"a highest scale below the scale", kLeast + "[mapping]\nposition_scale_max = 400\n",
       "b.toml:6:22: mapping.position_scale_max: 400 is no upper bound, allowed: 0 (no more), or from "
       "position_scale = 500 on"},
      {"more ticks than are counted", kLeast + "[servo]\noverrun_window_s = 17\n",
       "b.toml:6:20: servo.overrun_window_s: holds more ticks than are counted, allowed: at most 16384 / "
       "rate_hz = 16.38"},
      {"a limit that is none", kLeast + "[servo]\noverrun_limit = 501\n",
       "b.toml:6:17: servo.overrun_limit: is more than half of the ticks in the window, allowed: at most "
       "overrun_window_s * rate_hz / 2 = 500"},
      {"soft above hard", kLeast + "[limits]\ntip_force_soft_uN = 70\n",
       "b.toml:6:21: limits.tip_force_soft_uN: is not below the hard limit, allowed: below tip_force_hard_uN "
       "= 60"},
      {"a force the device has not", kLeast + "[limits]\nhand_force_N = 9\n",
       "b.toml:6:16: limits.hand_force_N: is more than the device can do, allowed: at most "
       "haptic.force_max_N = 8.5"},
      {"a stage that starts outside its workspace",
       "[haptic]\n[stage]\n[sim.operator]\n[sim.needle]\n[sim.stage]\nstart_um = [900, 0, 0]\n",
       "b.toml:6:12: sim.stage.start_um: is outside the workspace in x, allowed: from -280 to 280"},
      {"every frame stale", kCell + "[local_model]\nstale_after_s = 0.05\n",
       "b.toml:10:17: local_model.stale_after_s: every frame would be stale, allowed: at least 1.5 / fps + "
       "latency = 0.1"},
      {"a plugged camera without its table", kLeast + "[camera]\ndevice = \"v4l2\"\n[vision]\n",
       "b.toml:6:10: camera.device: \"v4l2\" needs [v4l2] (it says which camera), allowed: add [v4l2]"},
      {"the table of another camera", kLeast + "[camera]\ndevice = \"v4l2\"\n[vision]\n[v4l2]\n[aravis]\n",
       "b.toml:9:2: aravis: no camera uses it, allowed: with device = \"aravis\" in [camera], or leave it "
       "out"},
      {"a camera by its number",
       kLeast + "[camera]\ndevice = \"v4l2\"\n[vision]\n[v4l2]\npath = \"video0\"\n",
       "b.toml:9:8: v4l2.path: is no path, allowed: the path of a camera, such as \"/dev/video0\""},
      {"an exposure longer than a frame",
       kLeast + "[camera]\ndevice = \"aravis\"\nfps = 30\nexposure_ms = 40\n[vision]\n[aravis]\n",
       "b.toml:8:15: camera.exposure_ms: is longer than a frame, allowed: at most 1000 / fps = 33.33"},
      {"a plugged camera in virtual time",
       "[scene]\nclock = \"virtual\"\n" + kLeast + "[camera]\ndevice = \"v4l2\"\n[vision]\n[v4l2]\n",
       "b.toml:2:9: scene.clock: \"virtual\" cannot wait for camera.device = \"v4l2\", allowed: \"real\""},
      {"a plugged camera faster than the servo can take",
       kLeast + "[camera]\ndevice = \"v4l2\"\nfps = 900\n[vision]\n[v4l2]\n",
       "b.toml:7:7: camera.fps: is too fast for the servo, allowed: at most rate_hz / 2 = 500"},
      {"a camera faster than the servo can take",
       kLeast + "[sim.cell]\n[vision]\ninner = false\n[camera]\nfps = 900\n",
       "b.toml:9:7: camera.fps: is too fast for the servo, allowed: at most rate_hz / 2 = 500"},
      {"truth of recorded frames",
       kLeast + "[camera]\ndevice = \"recorded\"\nframes = \"f\"\n[vision]\nmethod = \"truth\"\n",
       "b.toml:9:10: vision.method: \"truth\" is known of a simulated camera only, allowed: \"paper\" or "
       "\"tracker\""},
      {"recorded frames from nowhere", kLeast + "[camera]\ndevice = \"recorded\"\n[vision]\n",
       "b.toml:5:2: camera.frames: is missing, allowed: a folder, a glob or a video file"},
      {"recorded frames in virtual time",
       "[scene]\nclock = \"virtual\"\n" + kLeast +
           "[camera]\ndevice = \"recorded\"\nframes = \"f\"\n[vision]\n",
       "b.toml:2:9: scene.clock: \"virtual\" cannot wait for recorded frames, allowed: \"real\""},
      {"a key of the other camera", kLeast + "[camera]\nlatency_ms = 1\ndevice = \"recorded\"\n",
       "b.toml:6:1: camera.latency_ms: unknown key, allowed: device, frames, fps, pixel_um"},
      {"a failure of a device that is not there",
       kLeast + "[[sim.failure]]\ndevice = \"camera\"\nkind = \"drop\"\nat_s = 1\n",
       "b.toml:6:10: sim.failure[0].device: this scene has no such simulated device, allowed: one that is "
       "there"},
      {"a failure without a kind", kLeast + "[[sim.failure]]\ndevice = \"stage\"\nat_s = 1\n",
       "b.toml:5:1: sim.failure[0]: kind is missing, allowed: \"freeze\", \"drop\", \"delay\", \"nan\", "
       "\"disconnect\", \"saturate\", \"noise\", \"glitch\", \"offset\", \"drift\", \"set\", \"stuck\", "
       "\"flicker\", \"sparse\", \"repeat\", \"ignore\" or \"creep\""},
      {"a failure that this device cannot have", kLeast + failure("haptic", "creep", "size = 1e-5"),
       "b.toml:7:8: sim.failure[0].kind: \"creep\" is no failure of \"haptic\", allowed: \"freeze\", "
       "\"drop\", "
       "\"delay\", \"nan\", \"disconnect\", \"saturate\", \"noise\", \"glitch\", \"offset\", \"drift\", "
       "\"set\", "
       "\"stuck\", \"flicker\", \"sparse\", \"repeat\""},
      {"a glitch of nothing", kLeast + failure("stage", "glitch", "size = 1"),
       "b.toml:5:1: sim.failure[0].channel: kind = \"glitch\" needs it, allowed: \"time\", \"position\", "
       "\"axis\", \"following_error\", \"enabled\", \"standstill\""},
      {"a channel of another device", kLeast + failure("stage", "ignore", "channel = \"gate\""),
       "b.toml:9:11: sim.failure[0].channel: \"ignore\" of \"stage\" does not concern \"gate\", allowed: "
       "\"enable\", \"disable\", \"quick_stop\""},
      {"a component that is not there",
       kLeast + failure("haptic", "offset", "size = 1\nchannel = \"position\"\ncomponent = \"w\""),
       "b.toml:11:13: sim.failure[0].component: there is no such component, allowed: \"x\", \"y\", \"z\", "
       "\"all\""},
      {"half a sample", kLeast + failure("haptic", "sparse", "size = 2.5"),
       "b.toml:9:8: sim.failure[0].size: 2.5 does not suit kind = \"sparse\", allowed: a whole number, 2 .. "
       "1000"},
      {"a button pressed twice", kLeast + failure("haptic", "set", "size = 2\nchannel = \"clutch\""),
       "b.toml:9:8: sim.failure[0].size: 2 does not suit kind = \"set\", allowed: 0 (no) or 1 (yes)"},
      {"a lie that is the truth", kLeast + failure("haptic", "drift", "channel = \"position\""),
       "b.toml:5:1: sim.failure[0].size: 0 does not suit kind = \"drift\", allowed: any number but 0"},
      {"a drive that flies", kLeast + failure("stage", "creep", "size = 1"),
       "b.toml:9:8: sim.failure[0].size: 1 does not suit kind = \"creep\", allowed: a speed in m/s, -0.01 .. "
       "0.01, not 0"},
      {"a time beyond all times", kLeast + failure("haptic", "offset", "size = 1e7\nchannel = \"time\""),
       "b.toml:9:8: sim.failure[0].size: 10000000 does not suit kind = \"offset\", allowed: -1e6 .. 1e6 s"},
      {"a size of what has none", kLeast + failure("stage", "drop", "size = 1"),
       "b.toml:9:8: sim.failure[0].size: 1 does not suit kind = \"drop\", allowed: 0: it has no size"},
      {"a drift that repeats",
       kLeast + failure("stage", "drift", "size = 1\nevery_s = 1\nchannel = \"position\""),
       "b.toml:10:11: sim.failure[0].every_s: only a glitch repeats, allowed: 0"},
      {"vision that lies where nobody sees", kLeast + failure("vision", "glitch", "channel = \"contact\""),
       "b.toml:6:10: sim.failure[0].device: this scene has no such simulated device, allowed: one that is "
       "there"},
      {"too many failures", kLeast + many_failures(9),
       "b.toml:37:1: sim.failure: more than 8 entries, allowed: at most 8"},
      {"a newline inside a key", "\"a\\nb\" = 1\n", "b.toml:1:1: a b: unknown table, allowed: " + kTables},
      {"not UTF-8", kLeast + "# \xff\xfe\n", ""},
  };
  return list;
}

TEST(Scene, each_broken_file_is_told_in_one_line) {
  EXPECT_GE(broken().size(), 30U);
  for (const auto& b : broken()) {
    const auto scene = parse_scene(b.text, "b.toml");
    ASSERT_FALSE(scene.has_value()) << b.what;
    const std::string& e = scene.error();
    EXPECT_EQ(e.find('\n'), std::string::npos) << b.what << ": " << e;
    EXPECT_TRUE(e.starts_with("b.toml:")) << b.what << ": " << e;
    if (!b.message.empty()) {
      EXPECT_EQ(e, b.message) << b.what;
    }
  }
}

TEST(Scene, every_built_in_scene_reads_back_to_the_same_numbers) {
  const auto names = builtin_names();
  for (const char* wanted : {"icsi", "zebrafish", "outer-only", "no-holder", "free", "recorded", "hands-on",
                             "own-hand", "loopback"}) {
    EXPECT_NE(std::find(names.begin(), names.end(), wanted), names.end()) << wanted;
  }
  for (const auto name : names) {
    const auto scene = load_scene(name);
    ASSERT_TRUE(scene.has_value()) << scene.error();
    const std::string text = to_toml(*scene);
    auto again = parse_scene(text, "resolved.toml");
    ASSERT_TRUE(again.has_value()) << again.error();
    again->name = scene->name;
    EXPECT_EQ(to_toml(*again), text);
  }
}

TEST(Scene, numbers_of_any_size_survive_the_file) {
  // Thirds, sevenths and the like have no short decimal: the file must carry all their digits.
  const auto digits = [](double v) {
    std::ostringstream text;
    text << std::setprecision(17) << v;
    return text.str();
  };
  for (int i = 1; i < 400; ++i) {
    const auto scene = load_scene(
        "icsi",
        {"sim.cell.radius_um=" + digits(55 + i / 97.0), "damping.ramp_ms=" + digits(1 + i / 3.0),
         "membrane.E_kPa=" + digits(0.3 + i / 7.0), "sim.stage.start_um=[90, " + digits(i / 11.0) + ", 0]"});
    ASSERT_TRUE(scene.has_value()) << scene.error();
    const auto again = parse_scene(to_toml(*scene), "resolved.toml");
    ASSERT_TRUE(again.has_value()) << again.error();
    EXPECT_EQ(again->sim->cell->R_m, scene->sim->cell->R_m);
    EXPECT_EQ(again->servo.membrane->E_Pa, scene->servo.membrane->E_Pa);
    EXPECT_EQ(again->servo.damping->ramp_s, scene->servo.damping->ramp_s);
    EXPECT_EQ(again->sim->stage.start_m[1], scene->sim->stage.start_m[1]);
  }
}

TEST(Scene, a_table_that_is_absent_is_a_thing_that_is_not_there) {
  const auto free = load_scene("free");
  ASSERT_TRUE(free.has_value());
  EXPECT_FALSE(free->vision || free->recorded || free->sim->cell || free->sim->holder ||
               free->sim->microscope);
  EXPECT_FALSE(free->servo.membrane || free->servo.cone || free->servo.axis || free->servo.phases ||
               free->servo.local_model || free->servo.injector || free->servo.vacuum || free->servo.vision);
  EXPECT_TRUE(free->servo.damping.has_value());
  EXPECT_FALSE(free->has_task());

  const auto icsi = load_scene("icsi");
  ASSERT_TRUE(icsi.has_value());
  EXPECT_TRUE(icsi->sim->cell && icsi->sim->cell->inner && icsi->sim->holder && icsi->vision->holder &&
              icsi->servo.vision && icsi->has_task());
  EXPECT_FALSE(load_scene("outer-only")->sim->cell->inner);
  const auto adherent = load_scene("no-holder");
  EXPECT_FALSE(adherent->sim->holder || adherent->vision->holder || adherent->servo.vacuum);
  EXPECT_NEAR(load_scene("zebrafish")->sim->cell->R_m, 0.6e-3, 1e-12);
  EXPECT_NEAR(load_scene("zebrafish")->vision->pixel_m, 3.25e-6, 1e-15);
  EXPECT_TRUE(load_scene("recorded")->recorded.has_value());
}

// A member that no key sets would silently keep its default: of every struct of parameters, each member
// stands in a table of keys of the same file, behind the struct.
TEST(Scene, every_member_of_the_parameters_has_a_key) {
  std::vector<fs::path> files = {"hal/live_camera.hpp",  "hal/v4l2/config.hpp",   "hal/aravis/config.hpp",
                                 "hal/gpiod/config.hpp", "hal/falcon/config.hpp", "hal/cia402/config.hpp",
                                 "hal/evdev/config.hpp", "hal/zaber/config.hpp",  "hal/sim/config.hpp",
                                 "vision/config.hpp",    "tools/scene/scene.hpp"};
  for (const char* room : {"rt/control", "rt/forces"}) {
    for (const auto& entry : fs::directory_iterator(fs::path(PUNCTUM_SOURCE_DIR) / room)) {
      if (entry.path().extension() == ".hpp") {
        files.push_back(fs::path(room) / entry.path().filename());
      }
    }
  }
  const std::regex begins(
      R"(^struct (\w+Params|\w+Config|CameraSettings|HandDevice|HolderVision|RecordedFrames|ScheduledFailure|EstopEvent|Scene) \{)");
  const std::regex member(R"(^  ([\w:]+(?:<[\w:]+>)?)\s+(\w+)(?:\[\d+\])?\s*(?:=.*|\{.*\})?;)");
  // Parts with a table of their own, and what follows from other keys.
  const std::regex part(
      R"(.*(?:Params|Config|CameraSettings|HandDevice|HolderVision|RecordedFrames|DeviceNames|HolderVision>)>?|std::array.*)");
  const std::set<std::string> follows = {"ServoConfig::real_actuators",
                                         "ServoConfig::stage_reach",
                                         "ServoConfig::vision",
                                         "ServoConfig::inner_membrane",
                                         "ServoConfig::force_sensor",
                                         "LocalModelParams::R_min_m",
                                         "LocalModelParams::R_max_m",
                                         "VisionConfig::pixel_m",
                                         "VisionConfig::E_Pa",
                                         "VisionConfig::nu",
                                         "VisionConfig::h_m",
                                         "VisionConfig::c_m",
                                         "SimConfig::seed",
                                         "SimConfig::cells",
                                         "SimConfig::position_scale",
                                         "SimConfig::failure_count",
                                         "SimConfig::estop_event_count",
                                         "CanStageParams::axis_count",
                                         "ZaberParams::axis_count",
                                         "CellParams::inner",
                                         "Scene::name",
                                         "Scene::source"};
  int members = 0;
  for (const fs::path& file : files) {
    std::ifstream in(fs::path(PUNCTUM_SOURCE_DIR) / file);
    const std::string text(std::istreambuf_iterator<char>(in), {});
    ASSERT_FALSE(text.empty()) << file;
    std::istringstream lines(text);
    std::string line, parameters;
    std::smatch m;
    while (std::getline(lines, line)) {
      if (std::regex_search(line, m, begins)) {
        parameters = m[1];
      }
      if (line.starts_with("};")) {
        parameters.clear();
      }
      if (parameters.empty() || !std::regex_search(line, m, member) || m[1] == "return" || m[1] == "using" ||
          std::regex_match(m[1].str(), part)) {
        continue;
      }
      ++members;
      const std::string name = parameters + "::" + m[2].str();
      if (!follows.contains(name)) {
        EXPECT_TRUE(std::regex_search(text, std::regex("&" + name + "\\b"))) << file << ": " << name;
      }
    }
  }
  EXPECT_GT(members, 170);
}

std::vector<Key> all_keys(Scene& scene) {
  std::vector<Key> keys;
  for (const auto& t : scene_tables()) {
    if (t.there(scene)) {
      for (Key& k : t.keys(scene)) {
        k.name = t.name + "." + k.name;
        keys.push_back(std::move(k));
      }
    }
  }
  return keys;
}

// Another value than the one it has.
void change(const Key& key) {
  struct Visitor {
    void operator()(const Real& r) const { *r.target = 0.5 * *r.target + 0.123; }
    void operator()(const Whole& w) const {
      std::visit([](auto* t) { ++*t; }, w.target);
    }
    void operator()(const Flag& f) const { *f.target = !*f.target; }
    void operator()(const Text& t) const { *t.target += "x"; }
    void operator()(const Choice& c) const { c.set(c.get() == 0 ? 1 : 0); }
    void operator()(const Triple& t) const { *t.target += hal::Vec3(0.1, 0.2, 0.3); }
    void operator()(const BackendName&) const {}
  };
  std::visit(Visitor{}, key.value);
}

TEST(Scene, every_key_sets_a_member_of_its_own) {
  auto scene = load_scene("icsi", {"force_sensor=on", "repulsive=on", "friction=on", "vibration=on"});
  ASSERT_TRUE(scene) << scene.error();
  const std::size_t count = all_keys(*scene).size();
  EXPECT_GT(count, 150U);
  for (std::size_t i = 0; i < count; ++i) {
    Scene changed = *scene;
    const std::vector<Key> keys = all_keys(changed);
    if (std::holds_alternative<BackendName>(keys[i].value)) {
      continue;
    }
    std::vector<std::string> before;
    for (const Key& k : keys) {
      before.push_back(value_text(k));
    }
    change(keys[i]);
    for (std::size_t k = 0; k < count; ++k) {
      EXPECT_EQ(value_text(keys[k]) != before[k], k == i) << keys[i].name << " changed " << keys[k].name;
    }
  }
}

TEST(Scene, every_phase_has_a_timeout) {
  auto scene = load_scene("icsi");
  ASSERT_TRUE(scene);
  const auto keys = table_named("phases")->keys(*scene);
  for (int i = 0; i < rt::kPhases; ++i) {
    const std::string name = std::string("timeout_") + rt::name(static_cast<rt::Phase>(i)) + "_s";
    const auto key = std::find_if(keys.begin(), keys.end(), [&](const Key& k) { return k.name == name; });
    ASSERT_NE(key, keys.end()) << name;
    EXPECT_EQ(std::get<Real>(key->value).target, &scene->servo.phases->timeout_s[i]) << name;
  }
}

TEST(Scene, units_of_the_file_become_si) {
  const auto scene = parse_scene(
      "[haptic]\ntimeout_ms = 30\n[stage]\n[sim.operator]\n[sim.stage]\nvelocity_max_um_s = "
      "2000\n[sim.needle]\n"
      "radius_um = 2.5\n[sim.cell]\nradius_um = 50\nzona_E_kPa = 17.9\n[limits]\ntip_force_hard_uN = 45\n",
      "units.toml");
  ASSERT_TRUE(scene.has_value()) << scene.error();
  EXPECT_DOUBLE_EQ(scene->servo.hand_timeout_s, 0.03);
  EXPECT_DOUBLE_EQ(scene->sim->stage.velocity_max_m_s, 2e-3);
  EXPECT_DOUBLE_EQ(scene->sim->needle.radius_m, 2.5e-6);
  EXPECT_DOUBLE_EQ(scene->sim->cell->R_m, 50e-6);
  EXPECT_DOUBLE_EQ(scene->sim->cell->zona_E_Pa, 17.9e3);
  EXPECT_DOUBLE_EQ(scene->servo.limits.tip_force_hard_N, 45e-6);
}

TEST(Scene, overrides_are_read_and_checked_as_the_file_is) {
  auto scene = load_scene("icsi", {"servo.rate_hz=4000", "cone.method=paper", "axis=off", "scene.seed=7",
                                   "mapping.workspace_min_um=[-200, -200, -50]", "vision.snake.nodes=32",
                                   "sim.estop_press=[{at_s=1, for_s=0.2}]"});
  ASSERT_TRUE(scene.has_value()) << scene.error();
  EXPECT_EQ(scene->servo.rate_Hz, 4000);
  EXPECT_EQ(scene->servo.cone->method, rt::ConeParams::Method::paper);
  EXPECT_FALSE(scene->servo.axis.has_value());
  EXPECT_EQ(scene->sim->seed, 7U);
  EXPECT_EQ(scene->vision->snake.nodes, 32);
  EXPECT_EQ(scene->sim->estop_event_count, 1);

  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"servo.rate_hz=3000",
       "--set: servo.rate_hz: 3000 is not one of the choices, allowed: 1000, 2000, 4000 or 8000"},
      {"cone.K=1",
       "--set: cone.K: unknown key (did you mean K_N_m?), allowed: method, K_N_m, d0_um, r0_um, alpha_rad, "
       "eps_um, ramp_s, reach_um"},
      {"cone", "--set: cone: not an override, allowed: table.key=value or table=on|off"},
      {"cone=maybe", "--set: cone: not a table, allowed: on, off or table.key=value"},
      {"haptic=off", "--set: haptic: cannot be left out, allowed: on"},
      {"repulsive.radius_um=1",
       "--set: repulsive: the scene has no [repulsive], allowed: --set repulsive=on first"},
      {"sim.force_sensor.noise_uN=1",
       "--set: sim.force_sensor: no simulated device uses it, allowed: with device = \"simulated\" in "
       "[force_sensor], or leave it out"},
      {"sim.operator=off", "--set: sim.operator: cannot be left out, allowed: on"},
      {"operator.depth_um=25",
       "--set: operator.depth_um: unknown key (did you mean sim.operator.depth_um?), allowed: tables " +
           kTables},
      {"cell.inner.gap_um=4",
       "--set: cell.inner.gap_um: unknown key (did you mean sim.cell.inner.gap_um?), allowed: tables " +
           kTables},
      {"cell=off", "--set: cell: unknown table (did you mean sim.cell?), allowed: " + kTables},
      {"damping.B2_Ns_m=0.5",
       "--set: damping.B2_Ns_m: is below the damping outside, allowed: at least B1_Ns_m = 1"},
      {"damping.B2_Ns_m=", "--set: damping.B2_Ns_m: not valid TOML: expected value, saw '\\n'"},
  };
  for (const auto& [text, message] : wrong) {
    scene = load_scene("icsi", {text});
    ASSERT_FALSE(scene.has_value()) << text;
    EXPECT_EQ(scene.error(), message);
  }
}

TEST(Scene, an_enabling_device_is_a_button_of_the_handle_or_a_switch_of_its_own_and_written_again) {
  const std::string lines = "[gpiod]\nenabling_a = 5\nenabling_b = 6\n";
  for (const std::string device : {"", "haptic", "gpiod"}) {
    const bool on_lines = device == "gpiod";
    const auto scene =
        parse_scene(kLeast + "[enabling]\nrelease_ms = 10\n" +
                        (device.empty() ? "" : "device = \"" + device + "\"\n") + (on_lines ? lines : ""),
                    "e.toml");
    ASSERT_TRUE(scene) << scene.error();
    EXPECT_EQ(scene->devices.enabling, on_lines ? "gpiod" : "");
    EXPECT_EQ(scene->servo.enabling->release_s, 0.01);
    EXPECT_FALSE(scene->servo.real_actuators) << "a switch moves nothing";
    const std::string text = to_toml(*scene);
    EXPECT_NE(text.find(on_lines ? "[enabling]\ndevice = \"gpiod\"" : "[enabling]\ndevice = \"haptic\""),
              std::string::npos)
        << text;
    const auto again = parse_scene(text, "e.toml");
    ASSERT_TRUE(again) << again.error();
    EXPECT_EQ(to_toml(*again), text);
    EXPECT_EQ(again->devices.enabling, scene->devices.enabling);
  }
}

TEST(Scene, a_plugged_camera_is_read_and_written_again) {
  const auto scene =
      parse_scene(kLeast +
                      "[camera]\ndevice = \"v4l2\"\nwidth_px = 727\nheight_px = 485\nfps = 25\n"
                      "pixel_um = 0.5\nexposure_ms = 12.5\ngain = 3\n[vision]\n"
                      "[v4l2]\npath = \"/dev/video2\"\nformat = \"y16\"\nbits = 12\n",
                  "c.toml");
  ASSERT_TRUE(scene) << scene.error();
  ASSERT_TRUE(scene->camera && scene->v4l2);
  EXPECT_FALSE(scene->aravis || scene->recorded || scene->simulated_camera());
  EXPECT_EQ(scene->camera->width, 727);
  EXPECT_EQ(scene->camera->exposure_s, 12.5 / 1e3);
  EXPECT_EQ(scene->vision->pixel_m, 0.5 / 1e6);
  EXPECT_EQ(scene->v4l2->format, v4l2::V4l2Params::Format::y16);
  EXPECT_EQ(scene->v4l2->bits, 12);
  EXPECT_FALSE(scene->servo.real_actuators) << "a camera moves nothing";
  const auto again = parse_scene(to_toml(*scene), "c.toml");
  ASSERT_TRUE(again) << again.error();
  EXPECT_EQ(to_toml(*again), to_toml(*scene));
  EXPECT_EQ(again->v4l2->path, "/dev/video2");
}

// Backends that exist only here: a scene with real devices only, and one of both kinds.
const Backends kRealOnes = {{"haptic", {"simulated", "wire"}},
                            {"stage", {"simulated", "rail"}},
                            {"estop", {"simulated", "loop"}},
                            {"injector", {"simulated", "valve"}},
                            {"camera", {"simulated", "recorded", "lens"}}};
const std::string kReal =
    "[haptic]\ndevice = \"wire\"\n[stage]\ndevice = \"rail\"\n[estop]\ndevice = \"loop\"\n";

TEST(Scene, without_a_simulated_device_nothing_is_simulated) {
  const auto scene = parse_scene(kReal + "[damping]\nB2_Ns_m = 2\n", "real.toml", {}, {}, kRealOnes);
  ASSERT_TRUE(scene) << scene.error();
  EXPECT_FALSE(scene->sim.has_value());
  EXPECT_EQ(scene->devices.haptic, "wire");
  EXPECT_EQ(scene->devices.stage, "rail");
  EXPECT_EQ(scene->devices.estop, "loop");
  EXPECT_EQ(
      scene->devices.camera + scene->devices.injector + scene->devices.vacuum + scene->devices.force_sensor,
      "");
  EXPECT_TRUE(scene->servo.real_actuators);
  EXPECT_EQ(scene->servo.damping->B2_Ns_m, 2);
  const std::string text = to_toml(*scene);
  EXPECT_EQ(text.find("[sim"), std::string::npos) << text;
  const auto again = parse_scene(text, "real.toml", {}, {}, kRealOnes);
  ASSERT_TRUE(again) << again.error();
  EXPECT_FALSE(again->sim.has_value());
  EXPECT_EQ(to_toml(*again), text);

  const auto unknown_here = parse_scene(kReal, "real.toml");
  ASSERT_FALSE(unknown_here);
  EXPECT_EQ(unknown_here.error(),
            "real.toml:6:10: estop.device: \"loop\" is not one of the choices, allowed: \"simulated\" or "
            "\"gpiod\"");
}

TEST(Scene, the_size_of_a_lie_reads_back_to_the_same_bits) {
  for (const std::string size : {"5e-324", "1e-310", "-9.87e307", "1e308", "0.1", "30e-6"}) {
    const auto scene = load_scene(
        "icsi",
        {"sim.failure=[{device=\"haptic\", kind=\"set\", at_s=1, channel=\"position\", size=" + size + "}]"});
    ASSERT_TRUE(scene) << scene.error();
    EXPECT_EQ(scene->sim->failures[0].size, std::strtod(size.c_str(), nullptr));
    const auto again = parse_scene(to_toml(*scene), "again.toml");
    ASSERT_TRUE(again) << again.error();
    EXPECT_EQ(again->sim->failures[0].size, scene->sim->failures[0].size);
  }
}

TEST(Scene, a_table_of_the_simulation_needs_a_simulated_device_that_uses_it) {
  for (const char* table : {"operator", "haptic", "stage", "needle", "estop", "cell", "cell.inner", "holder",
                            "injector", "force_sensor", "camera"}) {
    const auto scene = parse_scene(kReal + "[sim." + table + "]\n", "real.toml", {}, {}, kRealOnes);
    ASSERT_FALSE(scene) << table;
    EXPECT_NE(scene.error().find("no simulated device uses it, allowed: with device = \"simulated\" in ["),
              std::string::npos)
        << scene.error();
  }
  for (const char* list : {"failure", "estop_press"}) {
    const auto scene =
        parse_scene(kReal + "[[sim." + list + "]]\nat_s = 1\n", "real.toml", {}, {}, kRealOnes);
    ASSERT_FALSE(scene) << list;
    EXPECT_NE(scene.error().find("no simulated device uses it"), std::string::npos) << scene.error();
  }
}

TEST(Scene, simulated_and_real_devices_mix) {
  const std::string mixed =
      "[haptic]\ndevice = \"wire\"\n[stage]\n[sim.needle]\n[injector]\ndevice = \"valve\"\n";
  const auto scene = parse_scene(mixed, "mixed.toml", {}, {}, kRealOnes);
  ASSERT_TRUE(scene) << scene.error();
  ASSERT_TRUE(scene->sim.has_value());
  EXPECT_FALSE(scene->sim->injector.has_value());
  EXPECT_TRUE(scene->servo.injector.has_value());
  EXPECT_TRUE(scene->servo.real_actuators);
  const std::string text = to_toml(*scene);
  EXPECT_EQ(text.find("[sim.operator]"), std::string::npos);
  EXPECT_NE(text.find("[sim.stage]"), std::string::npos);
  const auto again = parse_scene(text, "mixed.toml", {}, {}, kRealOnes);
  ASSERT_TRUE(again) << again.error();
  EXPECT_EQ(to_toml(*again), text);

  const auto waits = parse_scene("[scene]\nclock = \"virtual\"\n" + mixed, "mixed.toml", {}, {}, kRealOnes);
  ASSERT_FALSE(waits);
  EXPECT_EQ(
      waits.error(),
      "mixed.toml:2:9: scene.clock: \"virtual\" cannot wait for haptic.device = \"wire\", allowed: \"real\"");
}

TEST(Scene, a_device_that_is_switched_off_takes_its_part_of_the_simulation_along) {
  const auto scene =
      load_scene("icsi", {"camera=off", "vision=off", "phases=off", "local_model=off", "membrane=off",
                          "cone=off", "axis=off", "injector=off", "vacuum=off"});
  ASSERT_TRUE(scene) << scene.error();
  EXPECT_FALSE(scene->sim->microscope || scene->sim->injector || scene->servo.injector ||
               scene->servo.vacuum);
  EXPECT_EQ(scene->devices.camera + scene->devices.injector + scene->devices.vacuum, "");
  EXPECT_TRUE(scene->sim->holder.has_value());
}

// [haptic] is the handle as the core believes it, [sim.haptic] the handle as it is.
TEST(Scene, the_handle_of_the_core_is_not_the_simulated_one) {
  const auto apart = load_scene("free", {"haptic.mass_kg=0.09", "sim.haptic.delay_ticks=1"});
  ASSERT_TRUE(apart) << apart.error();
  EXPECT_EQ(apart->servo.device.mass_kg, 0.09);
  EXPECT_EQ(apart->sim->hand.mass_kg, 0.075);
  EXPECT_EQ(apart->servo.device.delay_ticks, 0);
  EXPECT_EQ(apart->sim->hand.delay_ticks, 1);
  for (const auto name : builtin_names()) {
    const auto scene = load_scene(name);
    ASSERT_TRUE(scene);
    if (scene->devices.haptic != kSimulated) {
      continue;
    }
    const rt::HandDevice& believed = scene->servo.device;
    const sim::HandParams& handle = scene->sim->hand;
    EXPECT_EQ(believed.mass_kg, handle.mass_kg) << name;
    EXPECT_EQ(believed.damping_Ns_m, handle.damping_Ns_m) << name;
    EXPECT_EQ(believed.encoder_step_m, handle.encoder_step_m) << name;
    EXPECT_EQ(believed.force_max_N, handle.force_max_N) << name;
    EXPECT_EQ(believed.delay_ticks, handle.delay_ticks) << name;
  }
}

// The numbers are those of device_limits_reference.py: 489.7 N/m beside B = 1 with two ticks of delay, 17.35
// and 13.79 Ns/m without.
TEST(Scene, what_the_haptic_device_cannot_render_is_refused_with_the_formula) {
  const std::vector<std::string> late = {"haptic.delay_ticks=2", "friction=on"};
  const auto with = [](std::vector<std::string> all, const std::string& one) {
    all.push_back(one);
    return all;
  };
  const auto refused = load_scene("free", with(late, "friction.K_N_m=490"));
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error(),
            "--set: friction.K_N_m: stiffness friction 490 = 490 N/m beside B = 1 Ns/m swings by itself, "
            "allowed: at most 0.006529 m/T^2 = 489.7, where a pole of 1 + (K + B V(z)) P(z) z^-delay reaches "
            "the unit circle (b = haptic.damping_Ns_m 0.1, m = haptic.mass_kg 0.075, T = 1/servo.rate_hz = 1 "
            "ms, delay 2 ticks, velocity by Kalman filter)");

  // b / (T/2 + delay) = 0.1 / 2.5 ms where no guard sees to it.
  EXPECT_NE(load_scene("free", with(late, "friction.K_N_m=41"))
                .error()
                .find("= 41 N/m is not passive, allowed: at most b/(T/2 + delay) = 40 "),
            std::string::npos);
  EXPECT_TRUE(load_scene("free", with(late, "friction.K_N_m=39")).has_value());
  EXPECT_TRUE(load_scene("free", with(with(late, "friction.K_N_m=41"), "guard=on")).has_value());

  const std::vector<std::string> most = {"damping.B1_Ns_m=17.35", "damping.B2_Ns_m=17.35"};
  EXPECT_TRUE(load_scene("free", most).has_value());
  EXPECT_FALSE(load_scene("free", {"damping.B1_Ns_m=17.36", "damping.B2_Ns_m=17.36"}).has_value());
  EXPECT_NE(
      load_scene("free", {"velocity.method=foaw", "velocity.smooth_ms=3", "damping.B1_Ns_m=13.8",
                          "damping.B2_Ns_m=13.8"})
          .error()
          .find("at most 0.1838 m/T = 13.78 (m = haptic.mass_kg 0.075, T = 1/servo.rate_hz = 1 ms, delay "
                "0 ticks, velocity by window of 16 at 1 kHz and low-pass of 3 ms)"),
      std::string::npos);
  const auto one_way = load_scene("icsi", {"axis.B_inward_Ns_m=14"});
  ASSERT_FALSE(one_way.has_value());
  EXPECT_TRUE(one_way.error().starts_with(
      "--set: axis.B_inward_Ns_m: 14 beside damping.B2_Ns_m = 4 cannot be rendered, allowed: together at "
      "most 0.2313 m/T = 17.35"))
      << one_way.error();
}

TEST(Scene, no_mutation_of_a_built_in_scene_crashes_or_says_more_than_a_line) {
  std::uint64_t state = 0x9e3779b97f4a7c15ULL;
  const auto random = [&state](std::size_t below) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return static_cast<std::size_t>(state % below);
  };
  static const char* const pieces[] = {"[",     "]",    "=",           "\"", "\n", "nan",          "-",
                                       "1e308", "[[",   "{",           "}",  ".",  "\x27\x27\x27", "\\u",
                                       "#",     "true", "999999999999"};
  int good = 0;
  for (const auto name : builtin_names()) {
    for (int i = 0; i < 300; ++i) {
      std::string text(*builtin_text(name));
      for (std::size_t n = 1 + random(3); n > 0; --n) {
        const std::size_t at = random(text.size());
        switch (random(4)) {
          case 0:
            text[at] = static_cast<char>(random(256));
            break;
          case 1:
            text.erase(at, 1 + random(20));
            break;
          case 2:
            text.insert(at, pieces[random(std::size(pieces))]);
            break;
          default:
            text.insert(at, text.substr(random(text.size()), random(60)));
            break;
        }
      }
      const auto scene = parse_scene(text, "m.toml");
      if (scene) {
        ++good;
        ASSERT_TRUE(parse_scene(to_toml(*scene), "m.toml").has_value()) << text;
      } else {
        ASSERT_FALSE(scene.error().empty()) << text;
        ASSERT_EQ(scene.error().find('\n'), std::string::npos) << scene.error();
      }
    }
  }
  EXPECT_GT(good, 100);  // changes within comments do no harm
}

TEST(Scene, a_path_of_a_frame_folder_is_seen_from_the_scenes_own_folder) {
  const auto scene =
      parse_scene(kLeast + "[camera]\ndevice = \"recorded\"\nframes = \"pictures\"\n[vision]\n", "s.toml", {},
                  "/some/folder");
  ASSERT_TRUE(scene.has_value()) << scene.error();
  EXPECT_EQ(scene->recorded->frames, "/some/folder/pictures");
}

TEST(Scene, a_falcon_is_the_handle_and_its_firmware_is_seen_from_the_scenes_own_folder) {
  const auto scene = parse_scene(
      "[haptic]\ndevice = \"falcon\"\n[falcon]\nfirmware = \"falcon.bin\"\ncpu = 2\n[stage]\n[sim.needle]\n",
      "s.toml", {}, "/some/folder");
  ASSERT_TRUE(scene.has_value()) << scene.error();
  EXPECT_EQ(scene->falcon->firmware, "/some/folder/falcon.bin");
  EXPECT_EQ(scene->falcon->cpu, 2);
  EXPECT_TRUE(scene->servo.real_actuators);
  const auto again = parse_scene(to_toml(*scene), "s.toml");
  ASSERT_TRUE(again.has_value()) << again.error();
  EXPECT_EQ(to_toml(*again), to_toml(*scene));
  const auto booted = parse_scene("[haptic]\ndevice = \"falcon\"\n[stage]\n[sim.needle]\n", "s.toml");
  ASSERT_TRUE(booted.has_value()) << booted.error();
  EXPECT_FALSE(booted->falcon.has_value());
}

class SceneFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "punctum-scene-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(SceneFiles, what_is_no_scene_file_is_refused_in_one_line) {
  EXPECT_EQ(load_scene("icis").error(),
            "icis: unknown scene (did you mean icsi?), allowed: free, hands-on, icsi, loopback, no-holder, "
            "outer-only, own-hand, "
            "recorded, "
            "zebrafish, or a path");
  EXPECT_EQ(load_scene("/nowhere/a.toml").error(),
            "/nowhere/a.toml: no such file, allowed: a path, or free, hands-on, icsi, loopback, no-holder, "
            "outer-only, own-hand, "
            "recorded, "
            "zebrafish");
  EXPECT_EQ(load_scene(folder_.string()).error(),
            folder_.string() + ": not a file, allowed: a scene file (TOML)");
  EXPECT_FALSE(load_scene("").has_value());
  EXPECT_FALSE(load_scene("/dev/zero").has_value());
  EXPECT_EQ(load_scene("a\nb").error().find('\n'), std::string::npos);

  const fs::path large = folder_ / "large.toml";
  std::ofstream(large) << std::string(300 * 1024, '#');
  EXPECT_EQ(load_scene(large.string()).error(),
            large.string() + ": too large for a scene, allowed: at most 256 kB");

  const fs::path fifo = folder_ / "fifo.toml";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_EQ(load_scene(fifo.string()).error(), fifo.string() + ": not a file, allowed: a scene file (TOML)");
}

TEST_F(SceneFiles, a_scene_file_is_named_after_itself) {
  const fs::path file = folder_ / "my-cell.toml";
  std::ofstream(file) << kLeast;
  const auto scene = load_scene(file.string());
  ASSERT_TRUE(scene.has_value()) << scene.error();
  EXPECT_EQ(scene->name, "my-cell");
  EXPECT_EQ(scene->source, file.string());
}

TEST(SceneText, a_byte_order_mark_before_the_text_changes_nothing) {
  const std::string text(*builtin_text("free"));
  const auto plain = parse_scene(text, "a.toml");
  const auto marked = parse_scene("\xEF\xBB\xBF" + text, "a.toml");
  ASSERT_TRUE(plain && marked) << (marked ? "" : marked.error());
  EXPECT_EQ(to_toml(*plain), to_toml(*marked));
  const auto wrong = parse_scene("\xEF\xBB\xBFnonsense = 1\n", "a.toml");
  ASSERT_FALSE(wrong);
  EXPECT_TRUE(wrong.error().starts_with("a.toml:1:1: ")) << wrong.error();
}

TEST(SceneText, what_is_printed_of_a_scene_gives_a_terminal_no_orders) {
  EXPECT_EQ(printable("a\x1b[31mb\x07\x7f"
                      "c"),
            "a [31mb  c");
  EXPECT_EQ(printable("\xc2\x9b"
                      "2J caf\xc3\xa9 \xc2\xb5m"),
            " 2J caf\xc3\xa9 \xc2\xb5m");
}

}  // namespace
}  // namespace punctum::tools
