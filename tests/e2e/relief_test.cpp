// Whole injections under a microscope with light from one side (Hoffman modulation contrast), from all round.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

struct Relief {
  const char* scene;
  int light_deg, seed;
  double contour_px;  // rms at most, in the whole run
};

class ReliefRuns : public Programs, public testing::WithParamInterface<Relief> {};

TEST_P(ReliefRuns, are_done_and_tell_where_the_membrane_is) {
  const auto& [scene, light_deg, seed, contour_px] = GetParam();
  const bool fish = std::string(scene) == "zebrafish";
  ASSERT_EQ(punctum({"run", scene, "--clock", "virtual", "--seed", std::to_string(seed), "--no-figure",
                     "--no-frames", "--set", "sim.camera.relief=on", "--set",
                     "sim.camera.relief.light_deg=" + std::to_string(light_deg), "--set",
                     std::string("sim.camera.relief.aperture=") + (fish ? "0.1" : "0.37")}),
            0)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done");
  EXPECT_EQ(r["cells"]["lost"], 0);
  EXPECT_EQ(r["stale_observations"], 0);
  const double pixel_um = fish ? 3.25 : 0.825;
  EXPECT_LT(r["contour_error_um"]["rms"].get<double>(), contour_px * pixel_um);
  EXPECT_LT(std::abs(r["contact_delay_ms"].get<double>()), 150);
  EXPECT_GT(r["puncture_delay_ms"].get<double>(), 0);
  EXPECT_LT(r["puncture_delay_ms"].get<double>(), 250);  // the picture comes 40 ms late, every 40 ms
}

// In icsi 3 and 7 the outer membrane was once drawn to the ooplasm's edge by 7 um in contact, and told in
// a dimple for nine frames after it had gone back. Of zebrafish 1 the yolk was once taken for the chorion, 80
// um inside of it; in 2 the chorion is a fifth as clear as the yolk; in 3 the needle was not found.
// outer-only was lost every other frame: its one membrane is fainter than what lies within.
INSTANTIATE_TEST_SUITE_P(Scenes, ReliefRuns,
                         testing::Values(Relief{"icsi", 51, 3, 0.8}, Relief{"icsi", -1, 7, 0.7},
                                         Relief{"outer-only", -26, 2, 1.2}, Relief{"zebrafish", -103, 1, 0.6},
                                         Relief{"zebrafish", -26, 2, 0.8}, Relief{"zebrafish", 51, 3, 0.6}),
                         [](const auto& of) {
                           std::string scene = of.param.scene;
                           std::replace(scene.begin(), scene.end(), '-', '_');
                           return scene + "_" + std::to_string(of.param.seed);
                         });

}  // namespace
}  // namespace punctum::e2e
