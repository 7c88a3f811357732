// Scenes: a bad file is told in one line, a good one reads back to the same numbers.
#include "tools/scene.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

// The shortest scene that is one.
const std::string kLeast = "[haptic]\n[operator]\n[stage]\n[needle]\n";
const std::string kCell = kLeast + "[cell]\n[camera]\n[vision]\ninner = false\n";  // 8 lines

struct Broken {
  const char* what;
  std::string text;
  std::string message;  // the whole of it
};

std::string many_failures(int n) {
  std::string text;
  for (int i = 0; i < n; ++i) text += "[[failure]]\ndevice = \"stage\"\nkind = \"drop\"\nat_s = 1\n";
  return text;
}

const std::vector<Broken>& broken() {
  static const std::string cone_keys = "method, K_N_m, d0_um, r0_um, alpha_rad, eps_um, ramp_s, reach_um";
  static const std::string all_tables =
      "scene, servo, haptic, operator, stage, needle, estop, velocity, mapping, limits, cell, holder, "
      "vacuum, "
      "injector, force_sensor, camera, vision, phases, local_model, membrane, cone, axis, damping, "
      "repulsive, friction, vibration, guard, failure, "
      "estop_press";
  static const std::vector<Broken> list = {
      {"nothing at all", "",
       "b.toml:1:1: haptic: the table is missing, allowed: [haptic] with device, or with any of its keys"},
      {"no stage", "[haptic]\n[operator]\n",
       "b.toml:1:1: stage: the table is missing, allowed: [stage] with device, or with any of its keys"},
      {"a table nobody knows", kLeast + "[laser]\npower = 1\n",
       "b.toml:5:2: laser: unknown table, allowed: " + all_tables},
      {"a table misspelt", kLeast + "[holdr]\n",
       "b.toml:5:2: holdr: unknown table (did you mean holder?), allowed: " + all_tables},
      {"a key misspelt", kLeast + "[cone]\nalpha_red = 0.2\n",
       "b.toml:6:1: cone.alpha_red: unknown key (did you mean alpha_rad?), allowed: " + cone_keys},
      {"a key without its unit", kLeast + "[cone]\nd0 = 40\n",
       "b.toml:6:1: cone.d0: unknown key (did you mean d0_um?), allowed: " + cone_keys},
      {"a key nothing like any other", kLeast + "[damping]\ncolour = 3\n",
       "b.toml:6:1: damping.colour: unknown key, allowed: B1_Ns_m, B2_Ns_m, ramp_ms"},
      {"text for a number", kLeast + "[damping]\nB1_Ns_m = \"one\"\n",
       "b.toml:6:11: damping.B1_Ns_m: \"one\" is not a number, allowed: a number from 0 to 100"},
      {"a number for a flag", kCell + "refine = 1\n",
       "b.toml:9:10: vision.refine: 1 is not true or false, allowed: true or false"},
      {"a number for text", "[scene]\ntitle = 7\n" + kLeast,
       "b.toml:2:9: scene.title: 7 is not text, allowed: text in quotes, at most 1000 characters"},
      {"half a node", kCell + "[vision.snake]\nnodes = 16.5\n",
       "b.toml:10:9: vision.snake.nodes: 16.5 is not a whole number, allowed: a whole number from 8 to 1024"},
      {"a date", kLeast + "[damping]\nB1_Ns_m = 2024-01-01\n",
       "b.toml:6:11: damping.B1_Ns_m: a date or time is not a number, allowed: a number from 0 to 100"},
      {"a list for a number", kLeast + "[damping]\nB1_Ns_m = [1]\n",
       "b.toml:6:11: damping.B1_Ns_m: a list is not a number, allowed: a number from 0 to 100"},
      {"a value for a table", "haptic = 3\n", "b.toml:1:1: haptic: not a table, allowed: [haptic]"},
      {"a list for a table", "[[haptic]]\n", "b.toml:1:3: haptic: not a table, allowed: [haptic]"},
      {"a table for a list", kLeast + "[failure]\n", "b.toml:5:2: failure: not a list, allowed: [[failure]]"},
      {"not a number at all", kLeast + "[damping]\nB1_Ns_m = nan\n",
       "b.toml:6:11: damping.B1_Ns_m: nan is not a finite number, allowed: a number from 0 to 100"},
      {"infinity", kLeast + "[damping]\nB1_Ns_m = inf\n",
       "b.toml:6:11: damping.B1_Ns_m: inf is not a finite number, allowed: a number from 0 to 100"},
      {"negative", kLeast + "[damping]\nB1_Ns_m = -1\n",
       "b.toml:6:11: damping.B1_Ns_m: -1 is out of range, allowed: a number from 0 to 100"},
      {"a million times too large", kLeast + "[cell]\nradius_um = 60e6\n",
       "b.toml:6:13: cell.radius_um: 60000000 is out of range, allowed: a number from 5 to 2000"},
      {"larger than any integer", "[scene]\nseed = 9223372036854775808\n" + kLeast,
       "b.toml:2:27: seed: not valid TOML: '9223372036854775808' is not representable in 64 bits"},
      {"a rate that is no rate", kLeast + "[servo]\nrate_hz = 3000\n",
       "b.toml:6:11: servo.rate_hz: 3000 is not one of the choices, allowed: 1000, 2000, 4000 or 8000"},
      {"a method that is none", kLeast + "[cone]\nmethod = \"funnel\"\n",
       "b.toml:6:10: cone.method: \"funnel\" is not one of the choices, allowed: \"potential\" or \"paper\""},
      {"a device that does not exist", "[haptic]\ndevice = \"falcon\"\n",
       "b.toml:2:10: haptic.device: \"falcon\" is not one of the choices, allowed: \"simulated\""},
      {"two numbers for three", "[haptic]\n[operator]\n[stage]\nstart_um = [90, 6]\n",
       "b.toml:4:12: stage.start_um: a list is not a list of three numbers, allowed: [x, y, z], each a "
       "number "
       "from -5000 to 5000"},
      {"an axis of length zero", "[haptic]\n[operator]\n[stage]\naxis = [0, 0, 0]\n",
       "b.toml:4:8: stage.axis: the direction is zero, allowed: a direction [x, y, z] that is not zero, each "
       "from -1 to 1"},
      {"given twice", kLeast + "[damping]\nB1_Ns_m = 1\nB1_Ns_m = 2\n",
       "b.toml:7:11: B1_Ns_m: given twice, allowed: once"},
      {"a table given twice", kLeast + "[damping]\n[damping]\n",
       "b.toml:6:1: [damping]: given twice, allowed: once"},
      {"not TOML", kLeast + "[damping\n", "b.toml:5:9: [damping: not valid TOML: expected ']', saw '\\n'"},
      {"an open string", "[scene]\ntitle = \"never closed\n", ""},
      {"too deep", std::string(40, '[') + "\n",
       "b.toml:1:17: syntax: brackets are nested too deeply, allowed: 16 levels"},
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
      {"a camera nobody looks through", kLeast + "[cell]\n[camera]\n",
       "b.toml:6:2: camera: needs [vision] (nobody looks at the pictures), allowed: add [vision] or leave "
       "[camera] out"},
      {"a camera and nothing before it", kLeast + "[camera]\n[vision]\n",
       "b.toml:5:2: camera: needs [cell] (there is nothing to look at), allowed: add [cell] or leave "
       "[camera] out"},
      {"suction without a pipette", kLeast + "[vacuum]\n",
       "b.toml:5:2: vacuum: needs [holder] (suction needs a pipette), allowed: add [holder] or leave "
       "[vacuum] out"},
      {"a pipette with nothing to hold", kLeast + "[holder]\n",
       "b.toml:5:2: holder: needs [cell] (there is nothing to hold), allowed: add [cell] or leave [holder] "
       "out"},
      {"an inner membrane to follow that is not there", kLeast + "[cell]\n[camera]\n[vision]\n",
       "b.toml:7:2: vision.inner: needs [cell.inner] (there is no inner membrane to follow), allowed: add "
       "[cell.inner] "
       "or leave [vision.inner] out"},
      {"a mouth wider than its pipette",
       kLeast + "[cell]\n[holder]\nouter_radius_um = 20\ninner_radius_um = 30\n",
       "b.toml:8:19: holder.inner_radius_um: is not smaller than the outer one, allowed: below "
       "outer_radius_um = 20"},
      {"a needle as thick as the cell",
       "[haptic]\n[operator]\n[stage]\n[needle]\nradius_um = 30\nshaft_radius_um = 40\n[cell]\n",
       "b.toml:5:13: needle.radius_um: is too thick for the cell, allowed: at most cell.radius_um / 4 = 15"},
      {"a shaft thinner than its tip", "[haptic]\n[operator]\n[stage]\n[needle]\nradius_um = 12\n",
       "b.toml:4:2: needle.shaft_radius_um: 9 is smaller than the tip, allowed: at least radius_um = 12"},
      {"a needle that starts inside the cell",
       "[haptic]\n[operator]\n[needle]\n[cell]\n[stage]\nstart_um = [-40, 0, 0]\n",
       "b.toml:6:12: stage.start_um: is inside or at the cell, allowed: at least 63.8 um from its centre"},
      {"a depth limit beyond the cell", kLeast + "[cell]\n[limits]\npenetration_depth_um = 200\n",
       "b.toml:7:24: limits.penetration_depth_um: goes through the cell, allowed: at most 2 * cell.radius_um "
       "= 120"},
      {"a wish deeper than the limit", "[haptic]\n[stage]\n[needle]\n[cell]\n[operator]\ndepth_um = 95\n",
       "b.toml:6:12: operator.depth_um: is deeper than the limit lets her, allowed: at most "
       "limits.penetration_depth_um = 90"},
      {"a zona that is broken before it is touched", kLeast + "[cell]\nzona_puncture_strain = 0.01\n",
       "b.toml:6:24: cell.zona_puncture_strain: is reached before the needle touches, allowed: above "
       "zona_pretension = 0.2"},
      {"soft above hard", kLeast + "[limits]\ntip_force_soft_uN = 70\n",
       "b.toml:6:21: limits.tip_force_soft_uN: is not below the hard limit, allowed: below tip_force_hard_uN "
       "= 60"},
      {"a force the device has not", kLeast + "[limits]\nhand_force_N = 9\n",
       "b.toml:6:16: limits.hand_force_N: is more than the device can do, allowed: at most "
       "haptic.force_max_N = 8.5"},
      {"a stage that starts outside its workspace",
       "[haptic]\n[operator]\n[needle]\n[stage]\nstart_um = [900, 0, 0]\n",
       "b.toml:5:12: stage.start_um: is outside the workspace in x, allowed: from -280 to 280"},
      {"every frame stale", kCell + "[local_model]\nstale_after_s = 0.05\n",
       "b.toml:10:17: local_model.stale_after_s: every frame would be stale, allowed: at least 1.5 / fps + "
       "latency = 0.1"},
      {"a camera faster than the servo can take",
       kLeast + "[cell]\n[vision]\ninner = false\n[camera]\nfps = 900\n",
       "b.toml:9:7: camera.fps: is too fast for the servo, allowed: at most rate_hz / 2 = 500"},
      {"truth of recorded frames",
       kLeast + "[camera]\ndevice = \"recorded\"\nframes = \"f\"\n[vision]\nmethod = \"truth\"\n",
       "b.toml:9:10: vision.method: \"truth\" is known of a simulated camera only, allowed: \"paper\""},
      {"recorded frames from nowhere", kLeast + "[camera]\ndevice = \"recorded\"\n[vision]\n",
       "b.toml:5:2: camera.frames: is missing, allowed: a folder, a glob or a video file"},
      {"recorded frames in virtual time",
       "[scene]\nclock = \"virtual\"\n" + kLeast +
           "[camera]\ndevice = \"recorded\"\nframes = \"f\"\n[vision]\n",
       "b.toml:2:9: scene.clock: \"virtual\" cannot wait for recorded frames, allowed: \"real\""},
      {"a key of the other camera", kLeast + "[camera]\nlatency_ms = 1\ndevice = \"recorded\"\n",
       "b.toml:6:1: camera.latency_ms: unknown key, allowed: device, frames, fps, pixel_um"},
      {"a failure of a device that is not there",
       kLeast + "[[failure]]\ndevice = \"camera\"\nkind = \"drop\"\nat_s = 1\n",
       "b.toml:6:10: failure[0].device: this scene has no such device, allowed: one that is there"},
      {"a failure without a kind", kLeast + "[[failure]]\ndevice = \"stage\"\nat_s = 1\n",
       "b.toml:5:1: failure[0]: kind is missing, allowed: \"freeze\", \"drop\", \"delay\", \"nan\", "
       "\"disconnect\", \"saturate\" or \"noise\""},
      {"too many failures", kLeast + many_failures(9),
       "b.toml:37:1: failure: more than 8 entries, allowed: at most 8"},
      {"a newline inside a key", "\"a\\nb\" = 1\n", "b.toml:1:1: a b: unknown table, allowed: " + all_tables},
      {"not UTF-8", kLeast + "# \xff\xfe\n", ""},
  };
  return list;
}

TEST(Scene, EachBrokenFileIsToldInOneLine) {
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

TEST(Scene, EveryBuiltInSceneReadsBackToTheSameNumbers) {
  const auto names = builtin_names();
  for (const char* wanted : {"icsi", "zebrafish", "outer-only", "no-holder", "free", "recorded"})
    EXPECT_NE(std::find(names.begin(), names.end(), wanted), names.end()) << wanted;
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

TEST(Scene, NumbersOfAnySizeSurviveTheFile) {
  // Thirds, sevenths and the like have no short decimal: the file must carry all their digits.
  const auto digits = [](double v) {
    std::ostringstream text;
    text << std::setprecision(17) << v;
    return text.str();
  };
  for (int i = 1; i < 400; ++i) {
    const auto scene = load_scene(
        "icsi",
        {"cell.radius_um=" + digits(55 + i / 97.0), "damping.ramp_ms=" + digits(1 + i / 3.0),
         "membrane.E_kPa=" + digits(0.3 + i / 7.0), "stage.start_um=[90, " + digits(i / 11.0) + ", 0]"});
    ASSERT_TRUE(scene.has_value()) << scene.error();
    const auto again = parse_scene(to_toml(*scene), "resolved.toml");
    ASSERT_TRUE(again.has_value()) << again.error();
    EXPECT_EQ(again->sim->cell->R_m, scene->sim->cell->R_m);
    EXPECT_EQ(again->servo.membrane->E_Pa, scene->servo.membrane->E_Pa);
    EXPECT_EQ(again->servo.damping->ramp_s, scene->servo.damping->ramp_s);
    EXPECT_EQ(again->sim->stage.start_m[1], scene->sim->stage.start_m[1]);
  }
}

TEST(Scene, ATableThatIsAbsentIsAThingThatIsNotThere) {
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

// A field that no key reaches would silently keep its default.
TEST(Scene, EveryNumberOfTheConfigurationsHasAKey) {
  const auto read = [](const char* file) {
    std::ifstream in(fs::path(PUNCTUM_SOURCE_DIR) / file);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string keys = read("tools/scene_keys.cpp");
  ASSERT_FALSE(keys.empty());
  const std::regex field(R"(^\s+(?:double|int|bool|Vec3|std::string|std::uint64_t)\s+(\w+)\s*[={;\[])");
  int fields = 0;
  for (const char* file : {"rt/control/config.hpp", "hal/sim/config.hpp", "vision/config.hpp"}) {
    std::istringstream lines(read(file));
    std::string line;
    std::smatch m;
    while (std::getline(lines, line))
      if (std::regex_search(line, m, field)) {
        ++fields;
        const std::string name = m[1];
        if (name == "real_actuators") continue;  // follows from the devices
        EXPECT_TRUE(std::regex_search(keys, std::regex("[.>]" + name + "\\b"))) << file << ": " << name;
      }
  }
  EXPECT_GT(fields, 120);
}

TEST(Scene, UnitsOfTheFileBecomeSi) {
  const auto scene = parse_scene(
      "[haptic]\ntimeout_ms = 30\n[operator]\n[stage]\nvelocity_max_um_s = 2000\n[needle]\nradius_um = 2.5\n"
      "[cell]\nradius_um = 50\nzona_E_kPa = 17.9\n[limits]\ntip_force_hard_uN = 45\n",
      "units.toml");
  ASSERT_TRUE(scene.has_value()) << scene.error();
  EXPECT_DOUBLE_EQ(scene->servo.hand_timeout_s, 0.03);
  EXPECT_DOUBLE_EQ(scene->sim->stage.velocity_max_m_s, 2e-3);
  EXPECT_DOUBLE_EQ(scene->sim->needle.radius_m, 2.5e-6);
  EXPECT_DOUBLE_EQ(scene->sim->cell->R_m, 50e-6);
  EXPECT_DOUBLE_EQ(scene->sim->cell->zona_E_Pa, 17.9e3);
  EXPECT_DOUBLE_EQ(scene->servo.limits.tip_force_hard_N, 45e-6);
}

TEST(Scene, OverridesAreReadAndCheckedAsTheFileIs) {
  auto scene = load_scene("icsi", {"servo.rate_hz=4000", "cone.method=paper", "axis=off", "scene.seed=7",
                                   "mapping.workspace_min_um=[-200, -200, -50]", "vision.snake.nodes=32",
                                   "estop_press=[{at_s=1, for_s=0.2}]"});
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
      {"force_sensor.noise_uN=1",
       "--set: force_sensor: the scene has no [force_sensor], allowed: --set force_sensor=on first"},
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

// The numbers are those of device_limits_reference.py: 489.7 N/m beside B = 1 with two ticks of delay, 17.35
// and 13.79 Ns/m without.
TEST(Scene, WhatTheHapticDeviceCannotRenderIsRefusedWithTheFormula) {
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

TEST(Scene, NoMutationOfABuiltInSceneCrashesOrSaysMoreThanALine) {
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
  for (const auto name : builtin_names())
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
  EXPECT_GT(good, 100);  // changes within comments do no harm
}

TEST(Scene, APathOfAFrameFolderIsSeenFromTheScenesOwnFolder) {
  const auto scene =
      parse_scene(kLeast + "[camera]\ndevice = \"recorded\"\nframes = \"pictures\"\n[vision]\n", "s.toml", {},
                  "/some/folder");
  ASSERT_TRUE(scene.has_value()) << scene.error();
  EXPECT_EQ(scene->recorded->frames, "/some/folder/pictures");
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

TEST_F(SceneFiles, WhatIsNoSceneFileIsRefusedInOneLine) {
  EXPECT_EQ(load_scene("icis").error(),
            "icis: unknown scene (did you mean icsi?), allowed: free, icsi, no-holder, outer-only, recorded, "
            "zebrafish, or a path");
  EXPECT_EQ(load_scene("/nowhere/a.toml").error(),
            "/nowhere/a.toml: no such file, allowed: a path, or free, icsi, no-holder, outer-only, recorded, "
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

TEST_F(SceneFiles, ASceneFileIsNamedAfterItself) {
  const fs::path file = folder_ / "my-cell.toml";
  std::ofstream(file) << kLeast;
  const auto scene = load_scene(file.string());
  ASSERT_TRUE(scene.has_value()) << scene.error();
  EXPECT_EQ(scene->name, "my-cell");
  EXPECT_EQ(scene->source, file.string());
}

}  // namespace
}  // namespace punctum::tools
