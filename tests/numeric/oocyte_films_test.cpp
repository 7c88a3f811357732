// Whole injections made of real stills, in $PUNCTUM_DATA or ../shared/data, against where the stills were
// pushed: oocytes in relief (tests/support/warped_oocytes.py) and eggs of zebrafish (warped_embryos.py).
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
#include <vector>

#include "tests/support/foreign_renderer.hpp"
#include "tests/support/pictures.hpp"
#include "vision/tracker.hpp"

namespace {

namespace fs = std::filesystem;
using namespace punctum;
using namespace punctum::vision;

fs::path data() { return e2e::renderer().parent_path() / "../data"; }

// What was seen of a film, and when the membrane was touched and gave way.
struct Story {
  std::optional<int> begins, gives_way, contact, puncture;
  int lost = 0;                          // frames without the outer membrane
  double too_deep = 0, too_shallow = 0;  // the dimple in the last frames before it gives way, px
};

template <class Param>
class Films : public testing::TestWithParam<Param> {
 protected:
  // stills: folders in data().
  void make(const char* generator, const std::vector<std::string>& stills,
            const std::vector<std::string>& how) {
    std::vector<std::string> words{PUNCTUM_SOURCE_DIR "/tests/support/" + std::string(generator),
                                   folder.string()};
    for (const std::string& name : stills) {
      if (!fs::is_directory(data() / name)) {
        GTEST_SKIP() << data() / name << " is not there: set PUNCTUM_DATA to the folder of real frames";
      }
      words.push_back((data() / name).string());
    }
    if (const std::string lacks = e2e::renderer_lacks(false); !lacks.empty()) {
      GTEST_SKIP() << lacks;
    }
    words.insert(words.end(), how.begin(), how.end());
    ASSERT_EQ(e2e::python(words), 0);
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

  // posed: the manipulator tells where it has the needle.
  [[nodiscard]] Story follow(const VisionConfig& config, int frames, bool posed) const {
    Story s{first("contact"), first("puncture"), {}, {}};
    std::optional<Tracker> tracker;
    for (int k = 0; k < frames; ++k) {
      char name[32];
      std::snprintf(name, sizeof name, "frame_%04d.png", k);
      const cv::Mat picture = cv::imread((folder / name).string(), cv::IMREAD_GRAYSCALE);
      if (picture.empty()) {
        ADD_FAILURE() << name;
        return s;
      }
      if (!tracker) {
        tracker.emplace(config, picture.cols, picture.rows);
      }
      const nlohmann::json& t = truth["frames"][static_cast<std::size_t>(k)];
      const Point tip(t["tip"][0].get<double>(), t["tip"][1].get<double>()), off(2.7, -1.5);
      const Result& seen = tracker->process(test::frame_of(picture, static_cast<std::uint64_t>(k)),
                                            posed ? std::optional(tip + off) : std::nullopt);
      s.lost += seen.outer.ok ? 0 : 1;
      s.contact = !s.contact && seen.contact ? k : s.contact;
      s.puncture = !s.puncture && seen.punctured ? k : s.puncture;
      if (s.gives_way && k >= *s.gives_way - 4 && k < *s.gives_way && seen.wd_px) {
        const double deeper = *seen.wd_px - t["wd_px"].get<double>();
        s.too_deep = std::max(s.too_deep, deeper);
        s.too_shallow = std::max(s.too_shallow, -deeper);
      }
    }
    return s;
  }

  // Contact is told at most one frame early, the puncture never.
  static void expect_in_order(const Story& s, int contact_late, int puncture_late) {
    ASSERT_TRUE(s.begins && s.gives_way && s.contact && s.puncture);
    std::printf(
        "contact %+d frames late, puncture %+d; the dimple at most %.1f px too deep, %.1f too shallow\n",
        *s.contact - *s.begins, *s.puncture - *s.gives_way, s.too_deep, s.too_shallow);
    EXPECT_GE(*s.contact, *s.begins - 1);
    EXPECT_LE(*s.contact, *s.begins + contact_late);
    EXPECT_GE(*s.puncture, *s.gives_way);
    EXPECT_LE(*s.puncture, *s.gives_way + puncture_late);
  }

  fs::path folder =
      fs::path(testing::TempDir()) / ("film_" + std::to_string(getpid()) + "_" + std::to_string(std::rand()));
  nlohmann::json truth;
};

struct OocyteFilm {
  const char* still;
  int seed;
  int frames;       // until some after the puncture
  bool posed;       // the manipulator tells where it has the needle
  double depth_px;  // by which the dimple may be told too shallow, before the membrane gives way
};

class OocyteFilms : public Films<OocyteFilm> {
 protected:
  void SetUp() override {
    make("warped_oocytes.py", {"icsi"},
         {GetParam().still, std::to_string(GetParam().seed), "3", std::to_string(GetParam().frames),
          "drift=0.03"});
  }
};

// The zona hardly shows: the scene has no inner membrane, and its outer one is the edge of the ooplasm.
TEST_P(OocyteFilms, are_followed_into_deep_dimples_and_punctured_when_the_membrane_gives_way) {
  VisionConfig config;
  config.pixel_m = 0.85e-6;
  config.inner = false;
  config.R_min_m = 40e-6;
  config.R_max_m = 95e-6;
  const Story s = follow(config, GetParam().frames, GetParam().posed);
  EXPECT_LE(s.lost, 2);
  expect_in_order(s, 9, 3);
  EXPECT_LT(s.too_deep, 3);
  EXPECT_LT(s.too_shallow, GetParam().depth_px);
}

// The point of a real needle is faint. In 16 of 01 the puncture was once told eight frames early, and the
// membrane lost in its dimple, in 1 two frames early; in 15 the tip was told 9 px too far back and no contact
// before the membrane gave way; in 3 and 12 of 03 the puncture was told 18 and 4 frames early with the
// manipulator's pose.
INSTANTIATE_TEST_SUITE_P(Stills, OocyteFilms,
                         testing::Values(OocyteFilm{"01", 1, 62, false, 4},
                                         OocyteFilm{"01", 16, 60, false, 4},
                                         OocyteFilm{"01", 15, 62, false, 6.5},
                                         OocyteFilm{"01", 15, 62, true, 6.5},
                                         OocyteFilm{"03", 3, 58, true, 4}, OocyteFilm{"03", 12, 60, true, 5},
                                         OocyteFilm{"06", 14, 60, false, 4}),
                         [](const auto& of) {
                           return std::string("icsi_") + of.param.still + "_" +
                                  std::to_string(of.param.seed) + (of.param.posed ? "_posed" : "");
                         });

struct EggFilm {
  const char* egg;
  int seed;
  int frames;  // until some after the puncture
  double c_m;  // radius of the needle, by the scene
};

class EggFilms : public Films<EggFilm> {
 protected:
  void SetUp() override {
    make("warped_embryos.py", {"zebrafish-timelapse", "pipette-focus"},
         {GetParam().egg, std::to_string(GetParam().seed), "2", std::to_string(GetParam().frames)});
  }
};

// Of the eggs that are looked for here: others, and what goes wrong in them, are in vision/MEASURED.md. The
// glass was melted round: its walls seem to end 5 px before it does.
TEST_P(EggFilms, of_zebrafish_are_punctured_when_the_chorion_gives_way) {
  VisionConfig config;
  config.pixel_m = 3.25e-6;
  config.h_m = 4e-6;
  config.c_m = GetParam().c_m;
  config.holder.reset();
  config.R_min_m = 400e-6;
  config.R_max_m = 800e-6;
  for (const bool posed : {false, true}) {
    const Story s = follow(config, GetParam().frames, posed);
    EXPECT_EQ(s.lost, 0);
    expect_in_order(s, 3, 3);
  }
}

INSTANTIATE_TEST_SUITE_P(Stills, EggFilms,
                         testing::Values(EggFilm{"A", 1, 85, 7.5e-6}, EggFilm{"I", 2, 70, 14e-6}),
                         [](const auto& of) { return of.param.egg + std::to_string(of.param.seed); });

}  // namespace
