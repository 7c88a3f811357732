// Whole injections whose numbers are looked at: contact, puncture, depth, modulus, and their bytes.
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

// Its lens resolves no more than that of the usual camera.
TEST_F(Programs, an_injection_is_seen_as_well_by_a_camera_with_finer_pixels) {
  const Strings fine = {"--set", "camera.width_px=1454",   "--set", "camera.height_px=970",
                        "--set", "camera.pixel_um=0.4125", "--set", "sim.camera.psf_px=2.4"};
  Strings explain = {"explain", "icsi"},
          run = {"run", "icsi", "--clock", "virtual", "--no-figure", "--no-frames"};
  for (Strings* words : {&explain, &run}) {
    words->insert(words->end(), fine.begin(), fine.end());
  }
  EXPECT_EQ(punctum(explain), 0);
  EXPECT_NE(said_.find("2 x 2 pixels are looked at as one"), std::string::npos) << said_;
  ASSERT_EQ(punctum(run), 0) << said_;
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done");
  EXPECT_EQ(r["stale_observations"], 0);
  EXPECT_LT(r["contour_error_um"]["rms"].get<double>(), 0.2);
  EXPECT_LT(std::abs(r["contact_delay_ms"].get<double>()), 150);
  EXPECT_LT(r["puncture_delay_ms"].get<double>(), 250);
}

TEST_F(Programs, a_force_sensor_tells_the_modulus_of_the_cell) {
  for (const double E_kPa : {17.9, 42.2}) {
    ASSERT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--no-figure", "--no-frames", "--set",
                       "force_sensor=on", "--set", "force_sensor.device=simulated", "--set",
                       "sim.cell.spread=0", "--set", "sim.cell.zona_E_kPa=" + std::to_string(E_kPa)}),
              0)
        << said_;
    const auto r = json();
    const double sd_kPa = r["E_fit_sd_kPa"];
    EXPECT_NEAR(r["E_fit_kPa"].get<double>(), E_kPa, 1.96 * sd_kPa);
    EXPECT_LT(sd_kPa, 0.05 * E_kPa);
    EXPECT_NE(said_.find("by the force sensor"), std::string::npos);
  }
}

TEST_F(Programs, the_same_seed_gives_the_same_bytes_with_vision_in_the_loop) {
  for (const char* method : {"truth", "tracker"}) {
    const Strings args{"run",     "icsi",
                       "--clock", "virtual",
                       "--seed",  "3",
                       "--set",   std::string("vision.method=") + method,
                       "--set",   "scene.seconds=12"};
    (void)punctum(args, "a");
    (void)punctum(args, "b");
    const std::string a = read_all(fs::path(report("a")) / "samples.csv");
    EXPECT_GT(a.size(), 1'000'000U);
    EXPECT_TRUE(a == read_all(fs::path(report("b")) / "samples.csv")) << method;
  }
}

// By the stage's pose of the needle and the station's own pictures. In zebrafish the needle's walls at the
// tip are thinner than the blur, and the depth was once told 9 um too small there, more than a tenth of the
// force.
TEST_F(Programs, the_depth_of_the_dimple_is_right_while_the_needle_pushes) {
  for (const auto& [scene, seed, rms_um] :
       {std::tuple{"icsi", "201", 0.4}, std::tuple{"zebrafish", "201", 4.0},
        std::tuple{"zebrafish", "203", 4.0}}) {
    ASSERT_EQ(punctum({"run", scene, "--clock", "virtual", "--seed", seed, "--no-figure", "--no-frames"}), 0)
        << said_;
    const Table seen(fs::path(report()) / "obs.csv");
    double sum_um2 = 0;
    int frames = 0;
    for (std::size_t i = 0; i < seen.rows.size(); ++i) {
      if (seen.number(i, "contact") > 0 && seen.number(i, "punctured") < 1 &&
          !seen.text(i, "wd_error_um").empty()) {
        sum_um2 += std::pow(seen.number(i, "wd_error_um"), 2);
        ++frames;
      }
    }
    EXPECT_GT(frames, 20) << scene;
    EXPECT_LT(std::sqrt(sum_um2 / frames), rms_um) << scene << " " << seed;
  }
}

// In the first frame the tip touches a speck, which is taken for its end and stays while the needle moves. It
// was once found there again, and the needle learnt from it: contact was told 0.5 s late, the force wrong by
// 59 uN.
TEST_F(Programs, a_speck_on_the_tip_is_not_taken_for_its_end_twice) {
  ASSERT_EQ(punctum({"run", "zebrafish", "--clock", "virtual", "--seed", "34", "--no-figure", "--no-frames"}),
            0)
      << said_;
  EXPECT_LT(json()["contact_delay_ms"].get<double>(), 200);
  EXPECT_LT(json()["force_error_rms_N"].get<double>(), 20e-6);
}

}  // namespace
}  // namespace punctum::e2e
