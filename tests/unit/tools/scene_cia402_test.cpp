// A stage of CAN drives in a scene: what fits together, and the one line where it does not.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tools/core/assembly.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {
namespace {

const std::string kAxes =
    "[[cia402.axis]]\nnode = 1\ncount_um = [0.04, 0, 0]\n"
    "[[cia402.axis]]\nnode = 2\ncount_um = [0, -0.04, 0]\nmin_counts = -2500\n"
    "[[cia402.axis]]\nnode = 3\ncount_um = [0, 0, 0.1]\nhoming_method = 35\n";
const std::string kStage =
    "[haptic]\n[sim.operator]\n[stage]\ndevice = \"cia402\"\n[mapping]\nmax_tilt_rad = 0\n";
const std::string kGood = kStage + "[cia402]\ninterface = \"can1\"\n" + kAxes;

std::string error_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const auto scene = parse_scene(text, "can.toml", overrides);
  return scene ? "" : scene.error();
}

TEST(SceneCia402, a_stage_of_three_drives_is_read_and_written_again) {
  const auto scene = parse_scene(kGood, "can.toml");
  ASSERT_TRUE(scene) << scene.error();
  ASSERT_TRUE(scene->cia402.has_value());
  EXPECT_EQ(scene->cia402->interface, "can1");
  EXPECT_EQ(scene->cia402->axis_count, 3);
  EXPECT_EQ(scene->cia402->axes[1].count_m, hal::Vec3(0, -0.04 / 1e6, 0));
  EXPECT_EQ(scene->cia402->axes[1].min_counts, -2500);
  EXPECT_EQ(scene->cia402->axes[2].homing_method, 35);
  EXPECT_FALSE(scene->cia402->homing);
  EXPECT_TRUE(scene->servo.real_actuators);
  const std::string text = to_toml(*scene);
  const auto again = parse_scene(text, "can.toml");
  ASSERT_TRUE(again) << again.error() << "\n" << text;
  EXPECT_EQ(to_toml(*again), text);
  EXPECT_EQ(again->cia402->axes[2].count_m, scene->cia402->axes[2].count_m);
}

TEST(SceneCia402, its_axes_can_be_overridden_as_a_list) {
  const auto scene = parse_scene(kGood, "can.toml",
                                 {"cia402.axis=[{node=5, count_um=[1,0,0]},{node=6, count_um=[0,1,0]},"
                                  "{node=7, count_um=[0,0,1]}]",
                                  "cia402.bitrate_kbit=800", "cia402.sync_divisor=2"});
  ASSERT_TRUE(scene) << scene.error();
  EXPECT_EQ(scene->cia402->axes[0].node, 5);
  EXPECT_EQ(scene->cia402->bitrate_kbit, 800);
}

TEST(SceneCia402, what_does_not_fit_is_one_line_with_what_is_allowed) {
  const struct {
    const char* what;
    std::string text;
    std::string begins;
  } cases[] = {
      {"no drives", kStage,
       "can.toml:4:10: stage.device: \"cia402\" needs to know its drives, allowed: with [cia402]"},
      {"no stage", "[haptic]\n[sim.operator]\n[stage]\n[sim.needle]\n[cia402]\n" + kAxes,
       "can.toml:5:2: cia402: no stage uses it, allowed: with device = \"cia402\" in [stage]"},
      {"no axis", kStage + "[cia402]\n",
       "can.toml:7:2: cia402.axis: is missing, allowed: from 1 to 6 [[cia402.axis]]"},
      {"one node twice", kGood + "[[cia402.axis]]\nnode = 2\ncount_um = [0, 0, 1]\n",
       "can.toml:21:8: cia402.axis[3].node: 2 is taken, allowed: a number from 1 to 127"},
      {"no node", kGood + "[[cia402.axis]]\ncount_um = [0, 0, 1]\n",
       "can.toml:20:1: cia402.axis[3].node: is missing"},
      {"the master's node", kStage + "[cia402]\nmaster_node = 3\n" + kAxes,
       "can.toml:17:8: cia402.axis[2].node: 3 is taken"},
      {"an axis that moves nothing", kStage + "[cia402]\n" + kAxes + "[[cia402.axis]]\nnode = 9\n",
       "can.toml:19:1: cia402.axis[3].count_um: moves nothing, allowed: how the tip moves with one count"},
      {"limits the wrong way round", kGood + "max_counts = 5\nmin_counts = 6\n",
       "can.toml:21:14: cia402.axis[2].min_counts: is not below max_counts, allowed: below 5"},
      {"a seventh axis", kGood + "[[cia402.axis]]\n[[cia402.axis]]\n[[cia402.axis]]\n[[cia402.axis]]\n",
       "can.toml:23:1: cia402.axis: more than 6 entries, allowed: at most 6"},
      {"a list that is none", kStage + "[cia402]\naxis = 3\n",
       "can.toml:8:1: cia402.axis: not a list, allowed: [[cia402.axis]]"},
      {"an unknown key", kStage + "[cia402]\nbaudrate = 3\n", "can.toml:8:1: cia402.baudrate: unknown key"},
  };
  for (const auto& c : cases) {
    const std::string error = error_of(c.text);
    EXPECT_TRUE(error.starts_with(c.begins)) << c.what << ": " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << c.what;
  }
}

TEST(SceneCia402, a_tilt_that_no_drive_can_make_is_refused) {
  const std::string error = error_of(kGood, {"mapping.max_tilt_rad=0.1"});
  EXPECT_EQ(
      error,
      "--set: mapping.max_tilt_rad: no drive of [cia402] tilts the needle, allowed: 0 with stage.device = "
      "\"cia402\"");
}

TEST(SceneCia402, axes_that_hardly_span_space_are_refused) {
  const std::string error =
      error_of(kGood, {"cia402.axis=[{node=5, count_um=[1,0,0]},{node=6, count_um=[1,0.05,0]},"
                       "{node=7, count_um=[0,0,1]}]"});
  EXPECT_TRUE(
      error.starts_with("--set: cia402.axis: the axes' directions count_um hardly span space, condition 40"))
      << error;
}

TEST(SceneCia402, one_or_two_axes_along_the_needle_are_read_and_tell_the_servo_what_they_can_reach) {
  EXPECT_FALSE(parse_scene(kGood, "can.toml")->servo.stage_reach);
  const auto one = parse_scene(kStage + kAxes.substr(0, kAxes.find("[[", 2)), "can.toml");
  ASSERT_TRUE(one) << one.error();
  EXPECT_EQ(one->servo.stage_reach.value(), hal::Mat3(hal::Vec3(1, 0, 0).asDiagonal()));
  const auto two = parse_scene(kStage + kAxes.substr(0, kAxes.rfind("[[")), "can.toml");
  ASSERT_TRUE(two) << two.error();
  EXPECT_EQ(two->servo.stage_reach.value(), hal::Mat3(hal::Vec3(1, 1, 0).asDiagonal()));
  const auto again = parse_scene(to_toml(*one), "can.toml");
  ASSERT_TRUE(again) << again.error();
  EXPECT_EQ(again->servo.stage_reach, one->servo.stage_reach);
}

TEST(SceneCia402, one_or_two_axes_that_do_not_move_the_needle_along_itself_are_refused) {
  EXPECT_EQ(
      error_of(kStage + "[cia402]\n[[cia402.axis]]\nnode = 1\ncount_um = [0.04, 0.002, 0]\n"),
      "can.toml:7:2: cia402.needle: lies 4.99 um beside what the axis can do on a way of 100 um, allowed: at "
      "most 2; one or two [[cia402.axis]] must move the needle along its own axis");
  EXPECT_EQ(error_of(kStage + "[cia402]\nneedle = [-1, 0.05, 0]\n[[cia402.axis]]\nnode = 1\n"
                              "count_um = [0.04, -0.0025, 0]\n"),
            "")
      << "0.7 degrees";
  const std::string across =
      "[[cia402.axis]]\nnode = 1\ncount_um = [0, 0.04, 0]\n"
      "[[cia402.axis]]\nnode = 2\ncount_um = [0, 0, 0.04]\n";
  EXPECT_EQ(
      error_of(kStage + across),
      "can.toml:7:3: cia402.needle: lies 100 um beside what the axes can do on a way of 100 um, allowed: "
      "at most 2; one or two [[cia402.axis]] must move the needle along its own axis");
}

TEST(SceneCia402, two_axes_that_hardly_span_a_plane_are_refused) {
  const std::string error =
      error_of(kGood, {"cia402.axis=[{node=5, count_um=[1,0,0]},{node=6, count_um=[-1,0.05,0]}]"});
  EXPECT_TRUE(error.starts_with(
      "--set: cia402.axis: the axes' directions count_um hardly span a plane, condition 40"))
      << error;
}

// 4 axes at 1 kHz and 1 Mbit/s: 55 + 8 * 115 = 975 us, and 135 + 65 = 200 us beside them, of 1000 us.
TEST(SceneCia402, a_bus_that_is_too_full_is_refused_with_its_load_and_what_is_allowed) {
  const std::string fourth = kGood + "[[cia402.axis]]\nnode = 4\ncount_um = [0.04, 0.04, 0]\n";
  EXPECT_EQ(
      error_of(fourth),
      "can.toml:7:2: cia402.sync_divisor: the bus cannot carry 4 axes: SYNC and PDOs take up to 975 us, an "
      "emergency and a heartbeat 200 us, of 1000 us from SYNC to SYNC at 1000 kbit/s, load 99 %, allowed: at "
      "least 2 (or fewer axes, or a higher bitrate_kbit)");
  EXPECT_EQ(error_of(fourth, {"cia402.sync_divisor=2"}), "");
  const std::string slow = error_of(kGood, {"cia402.bitrate_kbit=250"});
  EXPECT_NE(slow.find("load 303 %, allowed: at least 4 ("), std::string::npos) << slow;
  const std::string fast = error_of(kGood, {"servo.rate_hz=8000"});
  EXPECT_NE(fast.find("allowed: at least 8 ("), std::string::npos) << fast;
}

TEST(SceneCia402, a_sync_that_is_too_slow_for_the_stage_or_for_drives_is_refused) {
  const std::string slow = error_of(kGood, {"cia402.sync_divisor=60"});
  EXPECT_NE(slow.find("cia402.sync_divisor: the stage would time out between two SYNCs, allowed: at most"),
            std::string::npos)
      << slow;
  const std::string odd = error_of(kGood, {"servo.rate_hz=8000", "cia402.sync_divisor=11"});
  EXPECT_NE(odd.find("a period of 1375 us is none that drives can interpolate"), std::string::npos) << odd;
  const std::string heartbeat = error_of(kGood, {"cia402.heartbeat_ms=50"});
  EXPECT_NE(heartbeat.find("one late heartbeat would stop the stage, allowed: at least 2 heartbeat_ms = 100"),
            std::string::npos)
      << heartbeat;
}

TEST(SceneCia402, a_silence_that_the_stage_would_not_outlast_is_refused) {
  EXPECT_EQ(error_of(kGood, {"cia402.silence_cycles=10"}), "");
  EXPECT_EQ(
      error_of(kGood, {"cia402.silence_cycles=10", "stage.timeout_ms=10"}),
      "--set: cia402.silence_cycles: the stage would time out before the bus counts as silent, allowed: at "
      "most 9, or stage.timeout_ms of at least 11");
  EXPECT_EQ(error_of(kGood, {"cia402.silence_cycles=9", "stage.timeout_ms=10"}), "");
  EXPECT_EQ(
      error_of(kGood, {"cia402.silence_cycles=10", "cia402.sync_divisor=2"}),
      "--set: cia402.silence_cycles: the stage would time out before the bus counts as silent, allowed: at "
      "most 9, or stage.timeout_ms of at least 22");
  EXPECT_NE(error_of(kGood, {"cia402.silence_cycles=1"}).find("cia402.silence_cycles"), std::string::npos);
}

TEST(SceneCia402, a_force_sensor_on_the_bus_needs_its_node_and_the_stage) {
  const std::string sensor = "[force_sensor]\ndevice = \"cia402\"\n";
  EXPECT_NE(error_of(kGood + sensor).find("cia402.force_node: 0 is no force sensor"), std::string::npos);
  EXPECT_EQ(error_of(kGood + sensor, {"cia402.force_node=30", "cia402.sync_divisor=2"}), "");
  EXPECT_NE(error_of(kGood, {"cia402.force_node=30"}).find("no force sensor uses it"), std::string::npos);
  EXPECT_NE(error_of(kGood + sensor, {"cia402.force_node=2"}).find("cia402.force_node: 2 is taken"),
            std::string::npos);
}

TEST(SceneCia402, cannot_run_in_virtual_time) {
  const std::string error = error_of(kGood, {"scene.clock=virtual"});
  EXPECT_NE(error.find("\"virtual\" cannot wait for stage.device = \"cia402\""), std::string::npos) << error;
}

class PatientClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return t_ns; }
  void sleep_until_ns(std::int64_t until_ns) noexcept override { t_ns = until_ns; }
  std::int64_t t_ns = 0;
};

TEST(SceneCia402, a_missing_interface_is_named_and_nothing_starts) {
  const auto scene = parse_scene(kGood, "can.toml", {"cia402.interface=nosuchcan0"});
  ASSERT_TRUE(scene) << scene.error();
  PatientClock clock;
  const auto assembly = Assembly::open({*scene, clock, nullptr});
  ASSERT_FALSE(assembly);
  EXPECT_TRUE(assembly.error().starts_with("stage: cia402: nosuchcan0: ")) << assembly.error();
  EXPECT_EQ(assembly.error().find('\n'), std::string::npos);
}

}  // namespace
}  // namespace punctum::tools
