// Whole injections drawn by the renderer in $PUNCTUM_DATA/../frames, or ../shared/frames: other people's
// code, optics and dimple, which is not part of this tree; and in Hoffman's modulation contrast and DIC by
// tests/support/hoffman_renderer.py, written by one who had not seen the tracker. Both need Python's numpy
// and OpenCV.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/by_hand.hpp"
#include "tests/support/foreign_renderer.hpp"
#include "tests/support/pictures.hpp"
#include "vision/tracker.hpp"

namespace {

namespace fs = std::filesystem;
using namespace punctum;
using namespace punctum::vision;
using e2e::python;
using e2e::renderer;
using e2e::renderer_lacks;
using test::distance;
using test::frame_of;

constexpr int kFrames = 40;
constexpr int kSettled = 10;  // frames, until the place of the holding pipette is followed
constexpr double kPixel_um = 0.825;
constexpr double kRight_px = 2, kWrong_px = 4;  // nowhere further away; somewhere further away

Contour contour_of(const nlohmann::json& points) {
  Contour contour;
  for (const auto& p : points) {
    contour.emplace_back(p[0].get<double>(), p[1].get<double>());
  }
  return contour;
}

cv::Mat drawn(const fs::path& folder, int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "frame_%04d.png", frame);
  return cv::imread((folder / name).string(), cv::IMREAD_GRAYSCALE);
}

// As bright as the lumen, and as wide: it sticks to the needle's end.
cv::Mat with_bright_speck(const cv::Mat& picture, const Point& at) {
  constexpr double kRadius_px = 4, kGrey = 35;
  cv::Mat out = picture.clone();
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.cols; ++x) {
      const double more = kGrey / 2 * (1 - std::tanh(std::hypot(x - at.x, y - at.y) - kRadius_px));
      out.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(out.at<std::uint8_t>(y, x) + more);
    }
  }
  return out;
}

constexpr int kSlipped = 15;  // frames out of focus, while the needle waits in the membrane
cv::Mat out_of_focus(const cv::Mat& picture, double noise, unsigned seed) {
  constexpr double kBlur_px = 3;
  cv::Mat out, grain(picture.size(), CV_32F);
  cv::GaussianBlur(picture, out, {}, kBlur_px);
  cv::RNG random(seed);
  random.fill(grain, cv::RNG::NORMAL, 0, noise);
  out.convertTo(out, CV_32F);
  out += grain;
  out.convertTo(out, CV_8U);
  return out;
}

// The first frames of contact and puncture.
using Events = std::map<std::string, std::optional<int>>;
void mark(Events& in, const char* event, bool is, int frame) {
  if (is && !in[event]) {
    in[event] = frame;
  }
}

// Of one membrane in the frames of one phase. A frame in which it is not claimed is not right.
struct Score {
  int frames = 0, right = 0, wrong = 0;
  double sum2_px2 = 0;
  std::size_t points = 0;
  double nodes = 0, within_one = 0, within_two = 0;  // sd; of the claimed contours

  void add(const Contour& truth, const Membrane& seen) {
    ++frames;
    if (!seen.ok) {
      return;
    }
    double furthest = 0;
    for (const Point& p : truth) {
      const double d = distance(p, seen.contour);
      sum2_px2 += d * d;
      furthest = std::max(furthest, d);
    }
    points += truth.size();
    ASSERT_EQ(seen.sd_px.size(), seen.contour.size());
    for (std::size_t i = 0; i < seen.contour.size(); ++i) {
      const double d = distance(seen.contour[i], truth);
      furthest = std::max(furthest, d);
      nodes += 1;
      within_one += d < seen.sd_px[i] ? 1 : 0;
      within_two += d < 1.96 * seen.sd_px[i] ? 1 : 0;
    }
    right += furthest < kRight_px ? 1 : 0;
    wrong += furthest > kWrong_px ? 1 : 0;
  }
  [[nodiscard]] double rms_um() const {
    return kPixel_um * std::sqrt(sum2_px2 / static_cast<double>(std::max<std::size_t>(points, 1)));
  }
};

void print(const char* membrane, const std::string& part, const Score& score) {
  std::printf("%s %-10s %2d frames, %2d right, %d wrong, rms %.3f um, %.0f %% within one sd, %.0f %% in 95\n",
              membrane, part.c_str(), score.frames, score.right, score.wrong, score.rms_um(),
              100 * score.within_one / score.nodes, 100 * score.within_two / score.nodes);
}

struct Sequence {
  int seed, noise;  // grey levels
  // rms at most: where nothing moves the membrane, and of the outer one in contact. The needle's motion and
  // the frames before tell more of it than one frame does.
  double outer_um, inner_um, contact_um;
  int halo = 0;  // grey levels, beside the cell
  int frames = kFrames;
  double blur_px = 1.2;  // as in focus
};

// rms at most, and seen in most frames.
void expect_near_truth(const char* what, const std::vector<double>& error_px, double most_px) {
  double squares = 0;
  for (const double e : error_px) {
    squares += e * e;
  }
  const double rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(error_px.size(), 1)));
  std::printf("%s: rms %.3f px in %zu frames\n", what, rms, error_px.size());
  EXPECT_GE(error_px.size(), 5U) << what;
  EXPECT_LT(rms, most_px) << what;
}

// Frames from the one in which it begins to the one in which it is told; negative: told too early.
int late(const std::optional<int>& begun, const std::optional<int>& told) {
  return begun ? told.value_or(2 * kFrames) - *begun : kFrames;
}

class ForeignFrames : public testing::TestWithParam<Sequence> {
 protected:
  void SetUp() override {
    if (by_hand::is_left_out()) {
      GTEST_SKIP() << by_hand::kLeftOut;
    }
    if (const std::string lacks = renderer_lacks(); !lacks.empty()) {
      GTEST_SKIP() << lacks;
    }
    const auto& [seed, noise, outer_um, inner_um, contact_um, halo, frames, blur_px] = GetParam();
    // Its own: the sanitizers' build of this test may run at the same time.
    folder =
        fs::path(testing::TempDir()) / ("foreign_" + std::to_string(seed) + "_" + std::to_string(getpid()));
    ASSERT_EQ(
        python({renderer().string(), folder.string(), std::to_string(seed), std::to_string(noise),
                std::to_string(frames), "rim=" + std::to_string(halo), "blur=" + std::to_string(blur_px)}),
        0);
  }
  void TearDown() override { fs::remove_all(folder); }

  fs::path folder;
};

TEST_P(ForeignFrames, show_both_membranes_where_they_are) {
  nlohmann::json truth;
  std::ifstream(folder / "truth.json") >> truth;
  const int frames = GetParam().frames;
  ASSERT_EQ(truth.size(), frames);
  VisionConfig config;
  config.pixel_m = kPixel_um * 1e-6;
  std::optional<Tracker> tracker, with_pose, with_speck;
  const Point off(2.6, -1.9);  // of the pose, px
  std::map<std::string, Score> outer, inner;
  std::vector<double> tip_px, depth_px;        // seen minus true: along the axis before contact, in contact
  std::vector<double> told_px, told_depth_px;  // likewise in all phases, and in contact, with the pose
  std::vector<double> touching_px;             // tip in contact
  double furthest_px = 0;                      // of those
  std::vector<double> speck_depth_px;          // in contact, with the pose, a speck on the tip
  double surest = 0;                           // tip, when the membrane gives way: deviations off
  Events begun, seen_in, told_in;
  std::optional<Point> mouth_off;  // of the holding pipette
  double mouth_steps2_px2 = 0;     // by which that changes from frame to frame
  for (int k = 0; k < frames; ++k) {
    const cv::Mat picture = drawn(folder, k);
    ASSERT_FALSE(picture.empty()) << k;
    if (!tracker) {
      tracker.emplace(config, picture.cols, picture.rows);
      with_pose.emplace(config, picture.cols, picture.rows);
      with_speck.emplace(config, picture.cols, picture.rows);
    }
    const hal::Frame frame = frame_of(picture, static_cast<std::uint64_t>(k));
    const Result& seen = tracker->process(frame);
    const nlohmann::json& t = truth[static_cast<std::size_t>(k)];
    const Point off_now =
        seen.holder.mouth - Point(t["holder"][0].get<double>(), t["holder"][1].get<double>());
    if (seen.holder.ok && mouth_off && k > kSettled) {
      mouth_steps2_px2 += (off_now - *mouth_off).dot(off_now - *mouth_off);
    }
    mouth_off = seen.holder.ok ? std::optional(off_now) : std::nullopt;
    const std::string phase = t["phase"];
    const std::string part = phase == "contact" || phase == "puncture" ? phase : "at rest";
    outer[part].add(contour_of(t["outer"]), seen.outer);
    inner[part].add(contour_of(t["inner"]), seen.inner);
    const Point tip(t["tip"][0].get<double>(), t["tip"][1].get<double>());
    const Result& told = with_pose->process(frame, tip + off);
    for (const char* event : {"contact", "puncture"}) {
      mark(begun, event, phase == event, k);
    }
    for (const auto& [of, in] : {std::pair(&seen, &seen_in), {&told, &told_in}}) {
      mark(*in, "contact", of->contact, k);
      mark(*in, "puncture", of->punctured, k);
    }
    if (told.needle.ok) {
      told_px.push_back((told.needle.tip - tip).dot(told.needle.axis));
    }
    if (phase == "contact" && told.wd_px) {
      told_depth_px.push_back(*told.wd_px - t["wd_px"].get<double>());
    }
    const cv::Mat stuck = begun["contact"] && k > *begun["contact"] + 3
                              ? with_bright_speck(picture, tip + 2 * seen.needle.axis)
                              : picture;
    const Result& beside_speck =
        with_speck->process(frame_of(stuck, static_cast<std::uint64_t>(k)), tip + off);
    if (phase == "contact" && beside_speck.wd_px) {
      speck_depth_px.push_back(*beside_speck.wd_px - t["wd_px"].get<double>());
    }
    const double ahead = (seen.needle.tip - tip).dot(seen.needle.axis);
    if (phase == "approach" && seen.needle.ok) {
      tip_px.push_back(ahead);
    } else if (phase == "contact" && seen.needle.ok) {
      touching_px.push_back(ahead);
      furthest_px = std::max(furthest_px, std::abs(touching_px.back()));
    } else if (phase == "puncture" && seen.needle.ok) {
      surest = std::max(surest, std::abs(ahead) / seen.needle.sd);
    }
    if (phase == "contact" && seen.wd_px) {
      depth_px.push_back(*seen.wd_px - t["wd_px"].get<double>());
    }
  }
  int right = 0, wrong = 0;
  for (const auto& [membrane, parts] : {std::pair{"outer", outer}, std::pair{"inner", inner}}) {
    for (const auto& [part, score] : parts) {
      print(membrane, part, score);
      right += score.right;
      wrong += score.wrong;
    }
  }
  EXPECT_EQ(outer["at rest"].right, outer["at rest"].frames);
  EXPECT_GE(inner["at rest"].right, inner["at rest"].frames * 8 / 10);
  EXPECT_LT(outer["at rest"].rms_um(), GetParam().outer_um);
  EXPECT_LT(outer["contact"].rms_um(), GetParam().contact_um);
  EXPECT_LT(inner["at rest"].rms_um(), GetParam().inner_um);
  for (const Score& score : {outer["at rest"], inner["at rest"]}) {
    EXPECT_GT(score.within_one / score.nodes, 0.5);
    EXPECT_LT(score.within_one / score.nodes, 0.9);
    EXPECT_GT(score.within_two / score.nodes, 0.82);
  }
  EXPECT_GE(right, 2 * frames * 8 / 10) << "of both membranes in all frames";
  EXPECT_LE(wrong, 2 * frames / 20) << "claimed";
  if (GetParam().noise <= 5) {  // the needle is not found in more
    EXPECT_GE(outer["contact"].right, outer["contact"].frames - 1);
  }
  for (const auto& [whose, in] : {std::pair("picture alone", &seen_in), {"with the pose", &told_in}}) {
    const int contact = late(begun["contact"], (*in)["contact"]),
              puncture = late(begun["puncture"], (*in)["puncture"]);
    std::printf("%s: contact %+d frames late, puncture %+d\n", whose, contact, puncture);
    EXPECT_LE(std::abs(contact), 1) << whose;
    EXPECT_GE(puncture, 0) << whose;
    EXPECT_LE(puncture, 2) << whose;
  }
  const double mouth_step_px = std::sqrt(mouth_steps2_px2 / (frames - 1 - kSettled));
  std::printf("holding pipette: %.3f px from frame to frame\n", mouth_step_px);
  EXPECT_LT(mouth_step_px, 0.007 * GetParam().noise) << "it does not move";
  const bool sharp = GetParam().blur_px < 2;
  EXPECT_LT(outer["puncture"].rms_um(), sharp ? 0.2 : 0.4);
  EXPECT_EQ(outer["puncture"].wrong, 0);
  // The membrane is drawn through the glass, 0.65 px behind its outermost part.
  expect_near_truth("tip that touches", touching_px, !sharp ? 1.5 : GetParam().halo > 0 ? 0.7 : 0.5);
  if (sharp) {
    EXPECT_LT(furthest_px, 1);
  }
  std::printf("tip that touches: at most %.2f px off\n", furthest_px);
  std::printf("tip when the membrane gives way: %.1f deviations off at most\n", surest);
  EXPECT_LT(surest, 3.2);
  if (!sharp) {
    expect_near_truth("tip", tip_px, 1.5);
    expect_near_truth("depth of the dimple", depth_px, 1.8);
  } else if (GetParam().noise <= 5) {
    expect_near_truth("tip", tip_px, 0.4);
    expect_near_truth("depth of the dimple", depth_px, 0.3);
    expect_near_truth("tip with the pose", told_px, 0.26);
    expect_near_truth("depth of the dimple with the pose", told_depth_px, 0.26);
    expect_near_truth("depth of the dimple beside a speck, with the pose", speck_depth_px,
                      GetParam().halo > 0 ? 1.6 : 0.9);
  }
  if (sharp) {
    ASSERT_TRUE(begun["puncture"]);
    const int deepest = *begun["puncture"] - 1;
    Tracker refocused(config, drawn(folder, 0).cols, drawn(folder, 0).rows);
    for (int k = 0; k < deepest + kSlipped; ++k) {
      cv::Mat picture = drawn(folder, std::min(k, deepest));
      if (k > deepest) {
        picture = out_of_focus(picture, GetParam().noise, static_cast<unsigned>(k));
      }
      EXPECT_FALSE(refocused.process(frame_of(picture, static_cast<std::uint64_t>(k))).punctured) << k;
    }
  }
}

std::string name_of_sequence(const testing::TestParamInfo<Sequence>& of) {
  return "seed_" + std::to_string(of.param.seed) + "_noise_" + std::to_string(of.param.noise) +
         (of.param.halo > 0 ? "_halo" : "") + (of.param.blur_px > 2 ? "_out_of_focus" : "");
}

// In 7 and 107 the inner membrane was once held in its dimple; 106, 108 and 109 were never tuned on. In 1 the
// needle begins further away, and its tip was once 2 px off from the third frame on. In 134 the membrane that
// gave way was once taken for one on the tip, 12 px off. In 110 the tip is told 4 px too far ahead in one
// frame, and once drew the membrane after it in three more.
INSTANTIATE_TEST_SUITE_P(Seeds, ForeignFrames,
                         testing::Values(Sequence{107, 5, 0.055, 0.35, 0.09},
                                         Sequence{108, 10, 0.12, 0.4, 0.128},
                                         Sequence{110, 5, 0.2, 0.7, 0.25, 0, 40, 2.5}),
                         name_of_sequence);
INSTANTIATE_TEST_SUITE_P(Further, ForeignFrames,
                         testing::Values(Sequence{109, 5, 0.085, 0.35, 0.09, 25},
                                         Sequence{7, 2, 0.05, 0.3, 0.08}, Sequence{106, 2, 0.065, 0.3, 0.085},
                                         Sequence{1, 2, 0.04, 0.3, 0.085, 0, 80},
                                         Sequence{134, 5, 0.06, 0.35, 0.1, 0, 80}),
                         name_of_sequence);

enum class Light { hoffman, dic, sheets };
struct Relief {
  int seed;
  Light light;
  double outer_um = 0, inner_um = 0, tip_px = 0;  // rms at most before contact; of the tip in contact 1.25
  int astray = 0;        // frames in contact whose outer membrane is somewhere off by 4 px
  int early = 3;         // frames at most, of contact
  int dented = 0;        // frames at least in contact whose outer membrane is right
  double covered = 0.8;  // of the tips, by 1.96 of their deviations, at least
  int frames = 44;
};

class ReliefFrames : public testing::TestWithParam<Relief> {
 protected:
  void SetUp() override {
    if (by_hand::is_left_out()) {
      GTEST_SKIP() << by_hand::kLeftOut;
    }
    const bool others = GetParam().light == Light::sheets;
    if (const std::string lacks = renderer_lacks(others); !lacks.empty()) {
      GTEST_SKIP() << lacks;
    }
    const std::string seed = std::to_string(GetParam().seed), support = PUNCTUM_SOURCE_DIR "/tests/support/";
    folder = fs::path(testing::TempDir()) / ("relief_" + seed + "_" + std::to_string(getpid()));
    ASSERT_EQ(others ? python({support + "sheets_in_relief.py", renderer().string(), folder.string(), seed,
                               "5", std::to_string(kFrames)})
                     : python({support + "hoffman_renderer.py", folder.string(), seed, "5",
                               std::to_string(GetParam().frames),
                               GetParam().light == Light::dic ? "dic=1" : "dic=0"}),
              0);
  }
  void TearDown() override { fs::remove_all(folder); }

  fs::path folder;
};

cv::Mat moved(const cv::Mat& picture, const cv::Point& by) {
  cv::Mat out;
  const int x = std::abs(by.x), y = std::abs(by.y);
  cv::copyMakeBorder(picture, out, y, y, x, x, cv::BORDER_REPLICATE);
  return out(cv::Rect(x - by.x, y - by.y, picture.cols, picture.rows)).clone();
}

TEST_P(ReliefFrames, show_the_cell_and_a_needle_that_is_ground_sharp) {
  nlohmann::json truth;
  std::ifstream(folder / "truth.json") >> truth;
  VisionConfig config;
  config.pixel_m = kPixel_um * 1e-6;
  std::optional<Tracker> tracker;
  std::map<std::string, Score> outer, inner;
  std::map<std::string, std::vector<double>> tip_px;
  std::vector<double> depth_px;
  int covered = 0, needles = 0, depth_covered = 0;
  Events begun, told;
  for (int k = 0; k < static_cast<int>(truth.size()); ++k) {
    const cv::Mat picture = drawn(folder, k);
    ASSERT_FALSE(picture.empty()) << k;
    if (!tracker) {
      tracker.emplace(config, picture.cols, picture.rows);
    }
    const Result& seen = tracker->process(frame_of(picture, static_cast<std::uint64_t>(k)));
    const nlohmann::json& t = truth[static_cast<std::size_t>(k)];
    const std::string phase = t["phase"];
    outer[phase].add(contour_of(t["outer"]), seen.outer);
    inner[phase].add(contour_of(t["inner"]), seen.inner);
    if (phase == "contact" && seen.contact && seen.wd_px) {
      const double off_px = *seen.wd_px - t["wd_px"].get<double>();
      depth_px.push_back(off_px);
      depth_covered += std::abs(off_px) < 1.96 * seen.wd_sd_px ? 1 : 0;
    }
    const Point tip(t["tip"][0].get<double>(), t["tip"][1].get<double>());
    if (seen.needle.ok) {
      tip_px[phase].push_back((seen.needle.tip - tip).dot(seen.needle.axis));
      covered += std::abs(tip_px[phase].back()) < 1.96 * seen.needle.sd ? 1 : 0;
      ++needles;
    }
    for (const char* event : {"contact", "puncture"}) {
      mark(begun, event, phase == event, k);
    }
    mark(told, "contact", seen.contact, k);
    mark(told, "puncture", seen.punctured, k);
  }
  for (const auto& [membrane, phases] : {std::pair{"outer", outer}, std::pair{"inner", inner}}) {
    for (const auto& [phase, score] : phases) {
      print(membrane, phase, score);
    }
  }
  const Score &outer_before = outer["approach"], &inner_before = inner["approach"];
  for (const Score& score : {outer_before, inner_before, outer["inside"], inner["inside"]}) {
    EXPECT_EQ(score.points, static_cast<std::size_t>(score.frames) * truth[0]["outer"].size()) << "claimed";
    EXPECT_LE(score.wrong, 1);
  }
  EXPECT_GE(inner_before.right, inner_before.frames - 1);
  EXPECT_LT(outer_before.rms_um(), GetParam().outer_um);
  EXPECT_LT(inner_before.rms_um(), GetParam().inner_um);
  for (const Score& score : {outer_before, inner_before}) {
    EXPECT_GT(score.within_two / score.nodes, 0.82);
  }
  expect_near_truth("tip", tip_px["approach"], GetParam().tip_px);
  expect_near_truth("tip in contact", tip_px["contact"], 1.25 * GetParam().tip_px);
  std::printf("tip within 1.96 of its deviation in %d of %d\n", covered, needles);
  EXPECT_GE(covered, GetParam().covered * needles);
  std::printf("depth within 1.96 of its deviation in %d of %zu\n", depth_covered, depth_px.size());
  if (GetParam().light != Light::sheets) {
    expect_near_truth("depth of the dimple", depth_px, 1.25 * GetParam().tip_px + 0.5);
    EXPECT_GE(depth_covered, 0.75 * static_cast<double>(depth_px.size()));
  }
  const int contact = late(begun["contact"], told["contact"]),
            puncture = late(begun["puncture"], told["puncture"]);
  std::printf("contact %+d frames late, puncture %+d\n", contact, puncture);
  EXPECT_GE(contact, -GetParam().early);
  EXPECT_LE(contact, 3);
  EXPECT_GE(puncture, 0);
  EXPECT_LE(puncture, 2);
  EXPECT_LE(outer["contact"].wrong, GetParam().astray);
  EXPECT_GE(outer["contact"].right, GetParam().dented);

  // A hand that turns back just before the membrane gives way, at once and three times as fast.
  ASSERT_TRUE(begun["puncture"]);
  const int deepest = *begun["puncture"] - 1, back = 3;
  const cv::Size size = drawn(folder, 0).size();
  Tracker turned(config, size.width, size.height);
  for (int k = 0; k <= deepest + deepest / back; ++k) {
    const cv::Mat picture = drawn(folder, k <= deepest ? k : deepest - back * (k - deepest));
    EXPECT_FALSE(turned.process(frame_of(picture, static_cast<std::uint64_t>(k))).punctured) << k;
  }

  // A table that shakes, by one pixel from frame to frame.
  Tracker shaken(config, size.width, size.height);
  for (int k = 0; k <= deepest; ++k) {
    const cv::Mat still = drawn(folder, k);
    cv::Mat picture = still.clone();
    if (k % 2 == 1) {
      still.colRange(0, still.cols - 1).copyTo(picture.colRange(1, picture.cols));
    }
    EXPECT_FALSE(shaken.process(frame_of(picture, static_cast<std::uint64_t>(k))).punctured) << k;
  }

  // A knock while the needle pushes: from then on the picture lies elsewhere.
  ASSERT_TRUE(begun["contact"]);
  const int pushes = (*begun["contact"] + deepest) / 2;
  VisionConfig no_holder = config;
  no_holder.holder.reset();
  for (const VisionConfig& scene : {config, no_holder}) {
    for (const cv::Point by : {cv::Point(6, 0), {-5, 0}, {-9, 4}, {20, -8}, {-25, 0}}) {
      Tracker knocked(scene, size.width, size.height);
      for (int k = 0; k <= deepest; ++k) {
        const cv::Mat still = drawn(folder, k), picture = k < pushes ? still : moved(still, by);
        EXPECT_FALSE(knocked.process(frame_of(picture, static_cast<std::uint64_t>(k))).punctured)
            << by << k << (scene.holder ? "" : "no holding pipette");
      }
    }
  }
}

std::string name_of_film(const testing::TestParamInfo<Relief>& of) {
  return (of.param.light == Light::hoffman ? "hoffman_"
          : of.param.light == Light::dic   ? "dic_"
                                           : "sheets_") +
         std::to_string(of.param.seed);
}

// In 106 the needle's tip was once told 6 px too far back, in 2 of DIC 7 px; in 104 it was once seen inside
// the cell long before it was there, and contact told five frames early. Of 106 the light comes along the
// needle. Into the mouth of the holding pipette the membrane bulges unseen. In 103 and in the
// sheets 104 the puncture was once told six and seven frames before it happens, for a dimple hardly shows
// where the light comes along the needle, and in 104 the membrane was drawn to a tip that is seen 2 px too
// far ahead; in the sheets 213 no ooplasm was found before contact; in the sheets 4 it was once told ten
// frames late. In 112 the ooplasm was once taken for the outer membrane, 16 px off, since its zona lies
// eccentrically; in 101 and 129 the tip was once told 2 and 8 px too far back, and so was contact, eleven
// frames late in 129: of four lines three were taken for the needle, and its cut, hardly steeper than usual,
// for a right angle. In 207 it was found turned by a degree, in 131 it is by half of one; both were made
// narrower frame by frame, in 207 until the tip was 3 px too far back. In 103 the dimple's flank is somewhere
// 4 px too deep in two frames. In 106 the dimple was once blunt and on the needle's axis, in the sheets 10 it
// was drawn to a tip that is seen 4 px too far ahead. In 158 the membrane once drew the tip back by 4 px. In
// 112 the needle's taper is not seen.
INSTANTIATE_TEST_SUITE_P(Seeds, ReliefFrames,
                         testing::Values(Relief{207, Light::hoffman, 0.6, 0.4, 0.25},
                                         Relief{2, Light::dic, 0.7, 0.45, 0.35},
                                         Relief{104, Light::sheets, 0.35, 0.4, 1.3}),
                         name_of_film);
INSTANTIATE_TEST_SUITE_P(
    Further, ReliefFrames,
    testing::Values(Relief{101, Light::hoffman, 0.6, 0.35, 0.5}, Relief{129, Light::hoffman, 0.8, 0.4, 0.6},
                    Relief{106, Light::hoffman, 0.55, 0.45, 2, 0, 3, 5},
                    Relief{103, Light::hoffman, 0.6, 0.4, 0.6, 2}, Relief{112, Light::hoffman, 0.6, 0.4, 0.9},
                    Relief{158, Light::hoffman, 0.6, 0.4, 0.6}, Relief{131, Light::hoffman, 0.6, 0.4, 1.1},
                    Relief{104, Light::hoffman, 0.6, 0.4, 1.9},
                    Relief{4, Light::sheets, 0.35, 0.4, 2, 0, 3, 0, 0.65},
                    Relief{213, Light::sheets, 0.25, 0.35, 1.3}, Relief{10, Light::sheets, 0.4, 0.5, 2.1, 3}),
    name_of_film);

// Of 229 the outer membrane once ran along the ooplasm for an eighth of its way, where the light runs along
// it; of 322 and 345 the sharp needle was taken for one in bright field, and its tip told 4 px off. Into the
// mouth of the holding pipette the membrane bulges unseen.
class FirstPictures : public ReliefFrames {};

TEST_P(FirstPictures, in_relief_show_the_cell_and_the_point_of_the_needle) {
  nlohmann::json truth;
  std::ifstream(folder / "truth.json") >> truth;
  const nlohmann::json& t = truth[0];
  const cv::Mat picture = drawn(folder, 0);
  ASSERT_FALSE(picture.empty());
  VisionConfig config;
  config.pixel_m = kPixel_um * 1e-6;
  Tracker tracker(config, picture.cols, picture.rows);
  const Result& seen = tracker.process(frame_of(picture, 0));
  const Point mouth(t["holder"][0].get<double>(), t["holder"][1].get<double>());
  for (const auto& [name, membrane] : {std::pair{"outer", &seen.outer}, std::pair{"inner", &seen.inner}}) {
    ASSERT_TRUE(membrane->ok) << name;
    double furthest_px = 0;
    for (const Point& p : contour_of(t[name])) {
      constexpr double kMouth_px = 20;
      furthest_px =
          std::max(furthest_px, cv::norm(p - mouth) < kMouth_px ? 0 : distance(p, membrane->contour));
    }
    EXPECT_LT(furthest_px, kRight_px) << name;
  }
  ASSERT_TRUE(seen.needle.ok);
  EXPECT_LT(std::abs((seen.needle.tip - Point(t["tip"][0].get<double>(), t["tip"][1].get<double>()))
                         .dot(seen.needle.axis)),
            1);
}

INSTANTIATE_TEST_SUITE_P(Seeds, FirstPictures,
                         testing::Values(Relief{.seed = 229, .light = Light::hoffman, .frames = 1},
                                         Relief{.seed = 322, .light = Light::hoffman, .frames = 1},
                                         Relief{.seed = 345, .light = Light::hoffman, .frames = 1}),
                         name_of_film);

}  // namespace
