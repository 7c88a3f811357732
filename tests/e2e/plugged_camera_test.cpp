// A station whose camera is plugged in: aravis' own, which speaks GigE Vision over the loopback interface.
// It is unplugged while the station runs, and comes back.
#include <gtest/gtest.h>

#include <memory>

#include "tests/support/network_camera.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

constexpr const char* kScene = R"([haptic]
device = "simulated"
[stage]
device = "simulated"
[estop]
device = "simulated"
[scene]
cells = 0
seconds = 60
[camera]
device = "aravis"
width_px = 160
height_px = 120
fps = 5
[aravis]
name = "127.0.0.1"
[vision]
inner = false
[damping]
[sim.operator]
[sim.stage]
[sim.needle]
)";

class PluggedCamera : public Programs {
 protected:
  void SetUp() override {
    Programs::SetUp();
    std::ofstream(scene()) << kScene;
  }
  [[nodiscard]] std::string scene() const { return (folder_ / "plugged.toml").string(); }
  [[nodiscard]] std::string log() const { return read_all(fs::path(report()) / "vision.log"); }
  [[nodiscard]] std::size_t rows() const {
    const std::string csv = read_all(fs::path(report()) / "obs.csv");
    return static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n'));
  }
  // At most 30 s: the library itself takes up to ten to give up a camera that does not answer.
  template <class Condition>
  [[nodiscard]] bool until(Condition holds) const {
    for (int i = 0; i < 300 && !holds(); ++i) {
      std::this_thread::sleep_for(100ms);
    }
    return holds();
  }
};

TEST_F(PluggedCamera, one_that_is_unplugged_is_looked_for_and_used_again_when_it_is_back) {
  const tests::NetworkCameraLock one_at_a_time;
  tests::NetworkCamera camera = tests::plug_in_network_camera();
  Running run({"run", scene(), "--set", kPatientRelay, "--report", report(), "--no-figure", "--no-frames"},
              words());
  ASSERT_TRUE(until([&] { return rows() > 5; })) << run.output() << log();
  camera.reset();
  ASSERT_TRUE(until([&] { return log().find("looking for it") != std::string::npos; })) << log();
  const std::size_t before = rows();
  camera = tests::plug_in_network_camera();
  ASSERT_TRUE(until([&] { return rows() > before + 5; })) << log();
  run.send(SIGINT);
  (void)run.wait();
  EXPECT_NE(log().find("the camera is back after"), std::string::npos) << log();
  EXPECT_NE(log().find("the camera gave "), std::string::npos) << log();
  const auto r = json();
  EXPECT_EQ(r["vision_restarts"].size(), 0U) << run.output();
}

TEST_F(PluggedCamera, check_says_whether_it_is_there_and_devices_how_to_use_it) {
  const tests::NetworkCameraLock one_at_a_time;
  EXPECT_EQ(punctum({"check", scene()}), 2) << said_;
  EXPECT_NE(said_.find("FAIL camera             aravis: 127.0.0.1 is not on USB and does not answer"),
            std::string::npos)
      << said_;
  const tests::NetworkCamera camera = tests::plug_in_network_camera();
  EXPECT_EQ(punctum({"check", scene()}), 0) << said_;
  EXPECT_NE(said_.find("ok   camera             aravis: Aravis "), std::string::npos) << said_;
  EXPECT_NE(said_.find("serial number GV01, at 127.0.0.1)"), std::string::npos) << said_;
  EXPECT_EQ(punctum({"devices"}), 0) << said_;
  EXPECT_NE(said_.find("GigE Vision cameras\n"), std::string::npos) << said_;
  EXPECT_NE(said_.find("      device = \"aravis\"\n      [aravis]\n      name = \"Aravis-Fake-GV01\"\n"),
            std::string::npos)
      << said_;
}

TEST_F(PluggedCamera, one_that_is_not_there_ends_the_run_before_anything_moves) {
  EXPECT_EQ(punctum({"run", scene(), "--set", "aravis.name=Fake_7"}), 2) << said_;
  EXPECT_NE(said_.find("no such camera is found"), std::string::npos) << said_;
  EXPECT_EQ(punctum({"check", scene(), "--set", "camera.device=v4l2", "--set", "aravis=off", "--set",
                     "v4l2=on", "--set", "v4l2.path=/dev/video77"}),
            2)
      << said_;
  EXPECT_NE(said_.find("v4l2: /dev/video77: no such camera is plugged in"), std::string::npos) << said_;
}

}  // namespace
}  // namespace punctum::e2e
