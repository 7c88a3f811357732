// `punctum move` with emulated devices behind a pseudo-terminal.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/support/positioner_process.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

class Move : public testing::Test {
 protected:
  Move() {
    std::ofstream scene(folder_ / "slow.toml");
    scene << "[haptic]\n[stage]\n[damping]\n[sim.operator]\n[sim.needle]\nradius_um = 3.8\n"
             "[positioner]\ndevice = \"zaber\"\n[zaber]\nanswer_ms = 2000\npark_um = [9900, 9900, "
             "9900]\nport = \""
          << devices_.path() << "\"\n";
    for (int i = 1; i <= 3; ++i) {
      scene << "[[zaber.axis]]\ndevice = " << i << "\naxis = 1\nmicrostep_um = 0.05\n";
    }
  }
  ~Move() override { fs::remove_all(folder_); }
  int punctum(std::vector<std::string> args) {
    args.insert(args.begin(), {"move", (folder_ / "slow.toml").string()});
    Running program(args, folder_ / "said");
    const int code = program.wait();
    said_ = read_all(folder_ / "said");
    return code;
  }

  static fs::path made() {
    std::string name = (fs::temp_directory_path() / "punctum-move-XXXXXX").string();
    return mkdtemp(name.data()) != nullptr ? name : "";
  }
  fs::path folder_ = made();
  tests::PositionerProcess devices_;
  std::string said_;
};

TEST_F(Move, goes_to_a_point_parks_and_refuses_what_is_outside) {
  EXPECT_EQ(punctum({"--to", "10100,10200,10300"}), 0) << said_;
  EXPECT_NE(said_.find("there, at [10100.00, 10200.00, 10300.00] um"), std::string::npos) << said_;
  EXPECT_EQ(punctum({"--park"}), 0) << said_;
  EXPECT_NE(said_.find("there, at [9900.00, 9900.00, 9900.00] um"), std::string::npos) << said_;
  EXPECT_EQ(punctum({"--to", "10000,-5,10000"}), 2);
  EXPECT_NE(said_.find("[10000.00, -5.00, 10000.00] um is outside, allowed: from [0.00, 0.00, 0.00] um to"),
            std::string::npos)
      << said_;
  EXPECT_EQ(punctum({}), 2);
  EXPECT_EQ(punctum({"--park", "--to", "1,2,3"}), 2);
}

TEST_F(Move, an_interrupt_stops_it_on_the_way_and_a_fault_ends_it) {
  Running moving({"move", (folder_ / "slow.toml").string(), "--to", "26000,10000,10000"}, folder_ / "moving");
  std::this_thread::sleep_for(700ms);
  moving.send(SIGINT);
  EXPECT_EQ(moving.wait(), 1);
  EXPECT_NE(read_all(folder_ / "moving").find("stopped at ["), std::string::npos);
  devices_.tell("reject BADDATA");
  EXPECT_EQ(punctum({"--park"}), 3);
  EXPECT_NE(said_.find("positioner: device 1 axis 1: rejected: BADDATA"), std::string::npos) << said_;
}

TEST_F(Move, what_something_else_stopped_on_the_way_is_not_there) {
  Running moving({"move", (folder_ / "slow.toml").string(), "--to", "26000,10000,10000"}, folder_ / "moving");
  std::this_thread::sleep_for(700ms);
  devices_.tell("knob 1");
  EXPECT_EQ(moving.wait(), 3);
  const std::string said = read_all(folder_ / "moving");
  EXPECT_NE(said.find("positioner: it came to rest at [1"), std::string::npos) << said;
  EXPECT_NE(said.find(", not at [26000.00, 10000.00, 10000.00] um: something else"), std::string::npos)
      << said;
}

TEST_F(Move, an_axis_that_hangs_is_not_waited_for) {
  devices_.tell("stick 1");
  EXPECT_EQ(punctum({"--to", "10100,10000,10000"}), 3);
  EXPECT_NE(
      said_.find("positioner: it says that it moves, stands at [10000.00, 10000.00, 10000.00] um and comes "
                 "no nearer: it was told to stop"),
      std::string::npos)
      << said_;
}

TEST_F(Move, a_second_interrupt_does_not_wait_for_an_axis_that_does_not_stop) {
  Running moving({"move", (folder_ / "slow.toml").string(), "--to", "26000,10000,10000"}, folder_ / "moving");
  std::this_thread::sleep_for(700ms);
  devices_.tell("stick 1");  // at speed
  std::this_thread::sleep_for(100ms);
  const auto begun = std::chrono::steady_clock::now();
  moving.send(SIGINT);
  std::this_thread::sleep_for(300ms);
  moving.send(SIGINT);
  EXPECT_EQ(moving.wait(), 3);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 2s);
  EXPECT_NE(read_all(folder_ / "moving").find("has not said that it stopped"), std::string::npos);
}

}  // namespace
}  // namespace punctum::e2e
