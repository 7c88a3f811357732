// Whole injections made of real stills of oocytes in relief (tests/support/warped_oocytes.py), in
// $PUNCTUM_DATA or ../shared/data, against where the stills were pushed. The zona hardly shows there, so the
// scene has no inner membrane, and its outer one is the edge of the ooplasm.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>

#include "tests/support/foreign_renderer.hpp"
#include "tests/support/pictures.hpp"
#include "vision/tracker.hpp"

namespace {

namespace fs = std::filesystem;
using namespace punctum;
using namespace punctum::vision;

fs::path stills() { return e2e::renderer().parent_path() / "../data/icsi"; }

struct Film {
  const char* still;
  int seed;
  int frames;       // until some after the puncture
  bool posed;       // the manipulator tells where it has the needle
  double depth_px;  // by which the dimple may be told too shallow, before the membrane gives way
};

class OocyteFilms : public testing::TestWithParam<Film> {
 protected:
  void SetUp() override {
    if (!fs::is_directory(stills())) {
      GTEST_SKIP() << stills() << " is not there: set PUNCTUM_DATA to the folder of real frames";
    }
    if (const std::string lacks = e2e::renderer_lacks(false); !lacks.empty()) {
      GTEST_SKIP() << lacks;
    }
    folder =
        fs::path(testing::TempDir()) / ("oocyte_" + std::string(GetParam().still) + "_" +
                                        std::to_string(GetParam().seed) + "_" + std::to_string(getpid()));
    ASSERT_EQ(e2e::python({PUNCTUM_SOURCE_DIR "/tests/support/warped_oocytes.py", folder.string(),
                           stills().string(), GetParam().still, std::to_string(GetParam().seed), "3",
                           std::to_string(GetParam().frames), "drift=0.03"}),
              0);
    std::ifstream(folder / "truth.json") >> truth;
  }
  void TearDown() override { fs::remove_all(folder); }
  [[nodiscard]] std::optional<int> first(const char* phase) const {
    for (int k = 0; k < static_cast<int>(truth["frames"].size()); ++k) {
      if (truth["frames"][static_cast<std::size_t>(k)]["phase"] == phase) {
        return k;
      }
    }
    return std::nullopt;
  }

  fs::path folder;
  nlohmann::json truth;
};

TEST_P(OocyteFilms, are_followed_into_deep_dimples_and_punctured_when_the_membrane_gives_way) {
  VisionConfig config;
  config.pixel_m = 0.85e-6;
  config.inner = false;
  config.R_min_m = 40e-6;
  config.R_max_m = 95e-6;
  std::optional<Tracker> tracker;
  std::optional<int> contact, puncture;
  int lost = 0;
  double too_deep = 0, too_shallow = 0;  // in the last frames before the puncture
  const auto begins = first("contact"), gives_way = first("puncture");
  ASSERT_TRUE(begins && gives_way);
  for (int k = 0; k < GetParam().frames; ++k) {
    char name[32];
    std::snprintf(name, sizeof name, "frame_%04d.png", k);
    const cv::Mat picture = cv::imread((folder / name).string(), cv::IMREAD_GRAYSCALE);
    ASSERT_FALSE(picture.empty()) << k;
    if (!tracker) {
      tracker.emplace(config, picture.cols, picture.rows);
    }
    const nlohmann::json& t = truth["frames"][static_cast<std::size_t>(k)];
    const Point tip(t["tip"][0].get<double>(), t["tip"][1].get<double>()), off(2.7, -1.5);
    const Result& seen = tracker->process(test::frame_of(picture, static_cast<std::uint64_t>(k)),
                                          GetParam().posed ? std::optional(tip + off) : std::nullopt);
    lost += seen.outer.ok ? 0 : 1;
    contact = !contact && seen.contact ? k : contact;
    puncture = !puncture && seen.punctured ? k : puncture;
    if (k >= *gives_way - 4 && k < *gives_way && seen.wd_px) {
      const double deeper = *seen.wd_px - t["wd_px"].get<double>();
      too_deep = std::max(too_deep, deeper);
      too_shallow = std::max(too_shallow, -deeper);
    }
  }
  EXPECT_LE(lost, 2);
  ASSERT_TRUE(contact && puncture);
  std::printf(
      "contact %+d frames late, puncture %+d; the dimple at most %.1f px too deep, %.1f too shallow\n",
      *contact - *begins, *puncture - *gives_way, too_deep, too_shallow);
  EXPECT_GE(*contact, *begins - 1);
  EXPECT_LE(*contact, *begins + 9);
  EXPECT_GE(*puncture, *gives_way);
  EXPECT_LE(*puncture, *gives_way + 3);
  EXPECT_LT(too_deep, 3);
  EXPECT_LT(too_shallow, GetParam().depth_px);
}

// The point of a real needle is faint. In 16 of 01 the puncture was once told eight frames early, and the
// membrane lost in its dimple, in 1 two frames early; in 15 the tip was told 9 px too far back and no contact
// before the membrane gave way; in 3 and 12 of 03 the puncture was told 18 and 4 frames early with the
// manipulator's pose.
INSTANTIATE_TEST_SUITE_P(Stills, OocyteFilms,
                         testing::Values(Film{"01", 1, 62, false, 4}, Film{"01", 16, 60, false, 4},
                                         Film{"01", 15, 62, false, 6.5}, Film{"01", 15, 62, true, 6.5},
                                         Film{"03", 3, 58, true, 4}, Film{"03", 12, 60, true, 5},
                                         Film{"06", 14, 60, false, 4}),
                         [](const auto& of) {
                           return std::string("icsi_") + of.param.still + "_" +
                                  std::to_string(of.param.seed) + (of.param.posed ? "_posed" : "");
                         });

}  // namespace
