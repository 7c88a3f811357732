// Whole injections under a microscope with light from one side (Hoffman modulation contrast), from all round.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/by_hand.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

struct Relief {
  const char* scene;
  int light_deg, seed;
  double contour_px;  // rms at most, in the whole run
  double tip_px;      // by which the tip may be too far ahead or behind, mean before contact
  double aperture = 0.37;
};

class ReliefRuns : public Programs, public testing::WithParamInterface<Relief> {};

TEST_P(ReliefRuns, are_done_and_tell_where_the_membrane_is) {
  if (by_hand::is_left_out()) {
    GTEST_SKIP() << by_hand::kLeftOut;
  }
  const auto& [scene, light_deg, seed, contour_px, tip_px, aperture] = GetParam();
  ASSERT_EQ(punctum({"run", scene, "--clock", "virtual", "--seed", std::to_string(seed), "--no-figure",
                     "--no-frames", "--set", "sim.camera.relief=on", "--set",
                     "sim.camera.relief.light_deg=" + std::to_string(light_deg), "--set",
                     "sim.camera.relief.aperture=" + std::to_string(aperture)}),
            0)
      << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done");
  EXPECT_EQ(r["cells"]["lost"], 0);
  EXPECT_EQ(r["stale_observations"], 0);
  const double pixel_um = std::string(scene) == "zebrafish" ? 3.25 : 0.825;
  EXPECT_LT(r["contour_error_um"]["rms"].get<double>(), contour_px * pixel_um);
  const Table seen(fs::path(report()) / "obs.csv");
  double ahead_um = 0;
  int frames = 0;
  for (std::size_t i = 0; i < seen.rows.size() && seen.text(i, "phase") == "free"; ++i, ++frames) {
    ahead_um += seen.number(i, "tip_error_um");
  }
  ASSERT_GT(frames, 50);
  EXPECT_LT(std::abs(ahead_um / frames), tip_px * pixel_um);
  EXPECT_LT(std::abs(r["contact_delay_ms"].get<double>()), 150);
  EXPECT_GT(r["puncture_delay_ms"].get<double>(), 0);
  EXPECT_LT(r["puncture_delay_ms"].get<double>(), 250);  // the picture comes 40 ms late, every 40 ms
}

std::string name_of(const testing::TestParamInfo<Relief>& of) {
  std::string scene = of.param.scene;
  std::replace(scene.begin(), scene.end(), '-', '_');
  return scene + "_" + std::to_string(of.param.seed) + (of.param.aperture < 0.37 ? "_narrow" : "");
}

// In icsi 3 the outer membrane was once drawn to the ooplasm's edge by 7 um in contact, and told in a dimple
// for nine frames after it had gone back. outer-only was lost every other frame: its one membrane is fainter
// than what lies within. In icsi 9 the tip was once told 0.8 px too far ahead, and in 361, with the light
// along the needle, where its walls fade, 68 px too far back; in 369, ten degrees aside of that, 4 px. In 221
// and 242 the light comes across the needle, and the puncture was once told 0.8 and 1.6 s before it happened.
// In zebrafish 2 the chorion is a fifth as clear as the yolk, which was once taken for it, and with the usual
// aperture fainter: in 4 it was drawn to the glass beside the mouth, in 14 that glass was taken for its look,
// in 47 its shadow. In 71 the puncture was told 0.3 s, in 14 contact 1.1 s before it happened: the tip was
// told 1 and 2 px ahead. In 43 the needle, out of focus within the cell, was told 20 px too far back, and
// nothing was injected.
INSTANTIATE_TEST_SUITE_P(Scenes, ReliefRuns,
                         testing::Values(Relief{"icsi", 180, 361, 0.6, 0.15},
                                         Relief{"zebrafish", -109, 43, 0.6, 0.3}),
                         name_of);
INSTANTIATE_TEST_SUITE_P(
    Further, ReliefRuns,
    testing::Values(Relief{"icsi", 94, 242, 0.6, 0.35}, Relief{"zebrafish", 178, 14, 0.6, 0.2},
                    Relief{"icsi", 51, 3, 0.8, 0.15}, Relief{"icsi", 170, 369, 0.6, 0.15},
                    Relief{"icsi", 153, 9, 0.6, 0.15}, Relief{"icsi", -83, 221, 0.6, 0.35},
                    Relief{"outer-only", -26, 2, 1.2, 0.15}, Relief{"zebrafish", -26, 2, 0.8, 0.3, 0.1},
                    Relief{"zebrafish", -113, 71, 0.6, 0.3}, Relief{"zebrafish", 128, 4, 0.6, 0.2},
                    Relief{"zebrafish", -161, 47, 1.4, 0.4}),
    name_of);

// With the light along it, its walls are seen last 0.4 mm behind its end in the first frame. Once the cell
// has shown that light comes from one side, the line across the end is looked for ahead of them.
TEST_F(Programs, a_needle_whose_walls_end_far_behind_its_tip_is_told_by_its_end_in_relief) {
  (void)punctum({"run", "zebrafish", "--clock", "virtual", "--seed", "115", "--seconds", "1", "--no-figure",
                 "--no-frames", "--set", "sim.camera.relief=on", "--set", "sim.camera.relief.light_deg=180"});
  const Table seen(fs::path(report()) / "obs.csv");
  ASSERT_GT(seen.rows.size(), 20U) << said_;
  for (std::size_t i = 3; i < seen.rows.size(); ++i) {
    EXPECT_LT(std::abs(seen.number(i, "tip_error_um")), 3.25) << i;
  }
}

// The two lines of a wall were once taken for two walls, and the needle refused for being too wide.
TEST_F(Programs, a_thin_needle_is_found_in_relief) {
  (void)punctum({"run", "zebrafish", "--clock", "virtual", "--seed", "3", "--seconds", "1", "--no-figure",
                 "--no-frames", "--set", "sim.camera.relief=on", "--set", "sim.camera.relief.light_deg=51",
                 "--set", "sim.camera.relief.aperture=0.1"});
  const Table seen(fs::path(report()) / "obs.csv");
  ASSERT_GT(seen.rows.size(), 20U) << said_;
  for (std::size_t i = 0; i < seen.rows.size(); ++i) {
    EXPECT_FALSE(seen.text(i, "tip_x_px").empty()) << i << ": " << seen.text(i, "verdict");
  }
}

}  // namespace
}  // namespace punctum::e2e
