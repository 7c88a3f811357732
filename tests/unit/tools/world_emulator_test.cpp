// What a station's GPIO lines are wired to in the emulated world: the relay, the contacts and the injector. A
// folder of files stands for the chip's folder in sysfs.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "tools/emulators/world/safety_chain.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::emulator {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr int kLineA = 0, kLineB = 1, kLineReset = 2, kLineHeartbeat = 3, kLineGate = 4;

class SafetyChainTest : public testing::Test {
 protected:
  SafetyChainTest()
      : folder(fs::temp_directory_path() / fs::path("punctum_chip_" + std::to_string(getpid()))) {
    for (int line = 0; line < 5; ++line) {
      fs::create_directories(folder / ("sim_gpio" + std::to_string(line)));
      write(line, "pull", "");
      write(line, "value", "0");
    }
    const auto scene = tools::load_scene("free", {"injector=on"});
    EXPECT_TRUE(scene) << scene.error();
    world = std::make_unique<WiredWorld>(*scene->sim, nullptr);
    chain = std::make_unique<SafetyChain>(*scene->sim, GpioWires(folder), *world, now);
  }
  ~SafetyChainTest() override { fs::remove_all(folder); }

  void write(int line, const char* file, const std::string& text) const {
    std::ofstream(folder / ("sim_gpio" + std::to_string(line)) / file) << text;
  }
  [[nodiscard]] std::string pull(int line) const {
    std::ifstream in(folder / ("sim_gpio" + std::to_string(line)) / "pull");
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    // A word that was written over a longer one leaves its end behind.
    return text.starts_with("pull-up") ? "pull-up" : text;
  }
  void pass(std::int64_t for_ns, bool beats) {
    for (const std::int64_t until = now + for_ns; now < until; now += kTick_ns) {
      if (beats) {
        level = !level;
        write(kLineHeartbeat, "value", level ? "1" : "0");
      }
      EXPECT_TRUE(chain->step(now));
    }
  }
  // When it was told last; -1: never.
  [[nodiscard]] std::int64_t told(const std::string& what) const {
    const auto events = world->events();
    const auto found = std::find_if(events.rbegin(), events.rend(),
                                    [&](const WorldEvent& event) { return event.what == what; });
    return found == events.rend() ? -1 : found->t_ns;
  }

  fs::path folder;
  std::unique_ptr<WiredWorld> world;
  std::unique_ptr<SafetyChain> chain;
  std::int64_t now = 1000 * kTick_ns;
  bool level = false;
};

TEST_F(SafetyChainTest, the_relay_waits_for_the_heartbeat_and_opens_50_ms_after_its_last_edge) {
  pass(200 * kTick_ns, false);
  EXPECT_FALSE(chain->power());
  pass(100 * kTick_ns, true);
  EXPECT_TRUE(chain->power());
  const std::int64_t last_ns = now - kTick_ns;
  pass(200 * kTick_ns, false);
  EXPECT_FALSE(chain->power());
  const std::int64_t opened_ns = told("the relay opens: the drives are without power");
  EXPECT_GE(opened_ns - last_ns, 49 * kTick_ns);
  EXPECT_LE(opened_ns - last_ns, 52 * kTick_ns);
}

TEST_F(SafetyChainTest, a_relay_that_has_opened_needs_the_reset_button_and_a_heartbeat) {
  pass(10 * kTick_ns, true);
  pass(100 * kTick_ns, false);
  pass(500 * kTick_ns, true);
  EXPECT_FALSE(chain->power());
  EXPECT_TRUE(chain->command("reset", now));
  pass(50 * kTick_ns, true);
  EXPECT_TRUE(chain->power());
  EXPECT_EQ(pull(kLineReset), "pull-up");
  pass(60 * kTick_ns, true);
  EXPECT_EQ(told("reset is let go") - told("reset is pressed"), 100 * kTick_ns);
}

TEST_F(SafetyChainTest, contacts_open_and_close_as_they_are_told) {
  pass(10 * kTick_ns, true);
  EXPECT_EQ(pull(kLineA), "pull-up");
  EXPECT_EQ(pull(kLineB), "pull-up");
  write(kLineA, "pull", "");
  write(kLineB, "pull", "");
  EXPECT_TRUE(chain->command("contact a open", now));
  pass(10 * kTick_ns, true);
  EXPECT_EQ(pull(kLineA), "pull-down");
  EXPECT_EQ(pull(kLineB), "") << "nobody touches the other one";
  write(kLineA, "pull", "");
  EXPECT_TRUE(chain->command("contact a closed", now));
  EXPECT_TRUE(chain->command("contact b open", now));
  pass(10 * kTick_ns, true);
  EXPECT_EQ(pull(kLineA), "pull-up");
  EXPECT_EQ(pull(kLineB), "pull-down");
  EXPECT_FALSE(chain->command("contact c open", now));
  EXPECT_FALSE(chain->command("contact a", now));
}

TEST_F(SafetyChainTest, the_valve_opens_with_the_gate_and_only_while_the_relay_is_closed) {
  pass(10 * kTick_ns, true);
  write(kLineGate, "value", "1");
  pass(300 * kTick_ns, true);
  write(kLineGate, "value", "0");
  pass(200 * kTick_ns, true);
  EXPECT_EQ(told("the injector's gate shuts") - told("the injector's gate opens"), 300 * kTick_ns);
  EXPECT_NE(told("its valve is shut; it was open for 300 ms"), -1);
  pass(100 * kTick_ns, false);  // the relay opens
  const std::size_t before = world->events().size();
  write(kLineGate, "value", "1");
  pass(300 * kTick_ns, false);
  write(kLineGate, "value", "0");
  pass(300 * kTick_ns, false);
  EXPECT_EQ(world->events().size() - before, 2U) << "the gate, and no valve";
}

TEST_F(SafetyChainTest, says_when_the_chip_is_gone) {
  EXPECT_TRUE(chain->step(now));
  EXPECT_TRUE(chain->command("contact a open", now));
  fs::remove_all(folder);
  EXPECT_FALSE(chain->step(now + kTick_ns));
}

// A world with drives that stand still, and a hand on a handle.
class HandOnGripTest : public testing::Test {
 protected:
  HandOnGripTest() {
    const auto scene = tools::load_scene("free", {});
    EXPECT_TRUE(scene) << scene.error();
    world = std::make_unique<WiredWorld>(*scene->sim, nullptr);
    hand = std::make_unique<HandOnGrip>(*world);
    for (int node = 1; node <= WiredWorld::kAxes; ++node) {
      drives.add({.node = node});
    }
    world->begin(now);
    hand->push({0, 0, 2}, now);
    pass(10 * kTick_ns);
    EXPECT_EQ(world->now().force_N, 2);
  }
  void pass(std::int64_t for_ns) {
    for (const std::int64_t until = now + for_ns; now < until;) {
      now += kTick_ns;
      world->step(drives, now);
    }
  }
  // When the handle's force was told to be gone; -1: it was not.
  [[nodiscard]] std::int64_t without_force() const {
    for (const WorldEvent& event : world->events()) {
      if (event.what == "the handle is without force") {
        return event.t_ns;
      }
    }
    return -1;
  }

  std::unique_ptr<WiredWorld> world;
  std::unique_ptr<HandOnGrip> hand;
  DriveBus drives;
  std::int64_t now = 1000 * kTick_ns;
};

TEST_F(HandOnGripTest, the_force_ends_with_the_power_of_the_amplifier_though_no_frame_follows) {
  const std::int64_t off_ns = now;
  hand->power(false, off_ns);
  EXPECT_EQ(world->now().force_N, 0);
  hand->push({0, 0, 2}, now);
  EXPECT_EQ(world->now().force_N, 0);
  pass(300 * kTick_ns);
  EXPECT_EQ(without_force(), off_ns);
  hand->power(true, now);
  EXPECT_EQ(world->now().force_N, 0) << "until the next frame";
  hand->push({0, 0, 2}, now);
  EXPECT_EQ(world->now().force_N, 2);
}

TEST_F(HandOnGripTest, the_force_ends_when_the_handle_is_unplugged) {
  FalconEmulator falcon({.booted = true}, *hand);
  const std::int64_t off_ns = now;
  falcon.motors_off(off_ns);
  EXPECT_EQ(world->now().force_N, 0);
  pass(300 * kTick_ns);
  EXPECT_EQ(without_force(), off_ns);
}

TEST(GpioWiresTest, refuses_what_is_no_simulated_chip_in_one_line) {
  const auto nothing = GpioWires::of("/dev/nothing");
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error(), "/dev/nothing: there is no such chip");
  const auto other = GpioWires::of("/dev/null");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error(), "/dev/null: is no chip of gpio-sim: its wires cannot be reached");
}

}  // namespace
}  // namespace punctum::emulator
