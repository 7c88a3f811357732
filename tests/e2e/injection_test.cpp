// Whole injections: parent, core and vision.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;
const Strings kOrder = {"free", "contact", "indentation", "puncture", "injection", "withdrawal", "clear"};

TEST_F(Programs, an_injection_that_the_relay_breaks_off_is_begun_anew) {
  EXPECT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--set", "vision.method=truth", "--no-figure",
                     "--no-frames", "--set",
                     "sim.failure=[{device=\"estop\", kind=\"drop\", at_s=11.3, for_s=0.06}]"}),
            3)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done after a fault") << said_;
  EXPECT_EQ(r["faults"].size(), 1U);
}

TEST_F(Programs, an_injection_goes_through_its_phases_in_order) {
  for (const char* method : {"truth", "tracker"}) {
    ASSERT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--set", std::string("vision.method=") + method}),
              0)
        << said_;
    const auto r = json();
    EXPECT_EQ(r["outcome"], "done");
    EXPECT_EQ(phase_names(r), kOrder) << method;
    EXPECT_EQ(r["cells"]["done"], 1);
    EXPECT_EQ(r["cells"]["lost"], 0);
    EXPECT_GT(r["cell_list"][0]["injected_s"], 0);
    EXPECT_EQ(r["stale_observations"], 0);
    EXPECT_LT(r["max_depth_um"], 90);
    EXPECT_LT(r["peak_force_N"], 60e-6);
    EXPECT_LT(std::abs(r["contact_delay_ms"].get<double>()), 500);
    EXPECT_LT(std::abs(r["puncture_delay_ms"].get<double>()), 500);
    EXPECT_GT(r["withdrawal_s"], 0);
    EXPECT_LT(r["tremor_ratio"], 0.3);
  }
}

TEST_F(Programs, a_cell_that_cannot_be_injected_is_not_pierced) {
  EXPECT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--set", "vision.method=truth", "--set",
                     "sim.failure=[{device=\"injector\", kind=\"disconnect\", at_s=2}]"}),
            1)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "time limit");
  EXPECT_EQ(r["cells"]["without_injection"], 0);
  EXPECT_EQ(r["phases"].size(), 1U) << "it never touches";
}

TEST_F(Programs, an_injection_of_nothing_is_not_done) {
  EXPECT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--set", "vision.method=truth", "--set",
                     "sim.failure=[{device=\"injector\", kind=\"disconnect\", at_s=10.7}]"}),
            1)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "not injected");
  EXPECT_EQ(r["cells"]["done"], 0);
  EXPECT_EQ(r["cells"]["without_injection"], 1);
}

TEST_F(Programs, every_built_in_cell_scene_is_done_with_the_truth_as_observer) {
  for (const char* scene : {"zebrafish", "outer-only", "no-holder"}) {  // icsi: above
    EXPECT_EQ(punctum({"run", scene, "--clock", "virtual", "--set", "vision.method=truth"}), 0)
        << scene << "\n"
        << said_;
    EXPECT_EQ(phase_names(json()), kOrder) << scene;
  }
}

TEST_F(Programs, several_cells_are_injected_one_after_the_other) {
  ASSERT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--set", "vision.method=truth", "--set",
                     "scene.cells=3"}),
            0)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["cells"]["done"], 3);
  EXPECT_EQ(r["cell_list"].size(), 3U);
}

TEST_F(Programs, a_time_limit_before_the_task_is_done_is_not_an_end_that_is_well) {
  EXPECT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--seconds", "3", "--set", "vision.method=truth"}),
            1)
      << said_;
  EXPECT_EQ(json()["outcome"], "time limit");
}

}  // namespace
}  // namespace punctum::e2e
