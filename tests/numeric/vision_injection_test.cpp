// Whole injections by the tests' own microscope (tests/support/drawn_microscope.hpp), in bright field and in
// relief, by a needle that is cut obliquely: what is seen from the picture alone. $PUNCTUM_INJECTION_SEEDS
// "101-108" measures more of them than the few of every day, and then requires nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/drawn_microscope.hpp"
#include "tests/support/pictures.hpp"
#include "vision/tracker.hpp"

namespace {

using namespace punctum::vision;
using test::DrawnMicroscope;
using test::frame_of;
using test::furthest;
using test::mean_square;
using test::Microscope;

constexpr double kRight_px = 2;

// Of the needle in a frame.
struct Stage {
  double gap_px, dimple_px;  // to the membrane at rest; of the membrane
  std::string phase;
};

// It comes by 1 px per frame, pushes the membrane until that gives way, goes on, rests, and goes back faster.
Stage stage(int frame, double breaks_px) {
  constexpr double kFrom_px = 14, kPast_px = 8, kRest = 6, kBack_px = 2.5, kRecoil = 2, kSeenAgain = 5;
  const double stops = kFrom_px + breaks_px + kPast_px, back = stops + kRest;
  const double gap_px =
      frame < back ? kFrom_px - std::min<double>(frame, stops) : kFrom_px - stops + kBack_px * (frame - back);
  const double since = frame - kFrom_px - breaks_px;
  if (since < 0) {
    return {gap_px, std::max(0.0, -gap_px), gap_px > 0 ? "before contact" : "in contact"};
  }
  return {gap_px, breaks_px * std::exp(-since / kRecoil),
          since < kSeenAgain ? "after the puncture" : "inside"};
}

struct Seen {
  int frames = 0, outer_claimed = 0, inner_claimed = 0, outer_right = 0, inner_right = 0, depths = 0,
      deep_right = 0, deep_covered = 0;
  double outer = 0, inner = 0, depth = 0;  // sums of squares, px^2; of what is claimed
};

bool right(std::span<const Point> seen, std::span<const Point> truth) {
  return furthest(seen, truth) <= kRight_px && furthest(truth, seen) <= kRight_px;
}

// Of one kind of pictures.
struct Injections {
  std::map<std::string, Seen> in;      // phases
  std::vector<int> contact, puncture;  // frames by which they are told late; 99: never
};

// drift: px per frame, of all that is in the picture.
void inject(Microscope m, Injections& out, const cv::Point2d& drift = {}) {
  std::mt19937 random(m.seed + 7);
  const auto between = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  m.relief_deg = between(0, 360);
  m.needle_deg = between(-15, 15);
  const double breaks_px = std::round(between(10, 18));
  VisionConfig config;
  config.pixel_m = DrawnMicroscope::kPixel_um * 1e-6;
  Tracker tracker(config, DrawnMicroscope::kW, DrawnMicroscope::kH);
  std::optional<int> touched, broke, touched_seen, broke_seen;
  constexpr int kFrames = 44;
  for (int k = 0; k < kFrames; ++k) {
    const Stage at = stage(k, breaks_px);
    m.gap_px = at.gap_px;
    m.dimple_px = at.dimple_px;
    m.shot = static_cast<unsigned>(k) + 1;
    m.moved = k * drift;
    const auto [picture, truth] = DrawnMicroscope(m).draw();
    const Result& r = tracker.process(frame_of(picture, static_cast<std::uint64_t>(k)));
    if (at.phase == "in contact" && !touched) {
      touched = k;
    }
    if (at.phase == "after the puncture" && !broke) {
      broke = k;
    }
    touched_seen = r.contact && !touched_seen ? k : touched_seen;
    broke_seen = r.punctured && !broke_seen ? k : broke_seen;

    Seen& seen = out.in[at.phase];
    ++seen.frames;
    if (r.outer.ok) {
      ++seen.outer_claimed;
      seen.outer += mean_square(r.outer.contour, truth.outer);
      seen.outer_right += right(r.outer.contour, truth.outer) ? 1 : 0;
    }
    if (r.inner.ok) {
      ++seen.inner_claimed;
      seen.inner += mean_square(r.inner.contour, truth.inner);
      seen.inner_right += right(r.inner.contour, truth.inner) ? 1 : 0;
    }
    if (at.phase == "in contact" && r.wd_px && at.dimple_px >= 1) {
      const double off = *r.wd_px - at.dimple_px;
      ++seen.depths;
      seen.depth += off * off;
      seen.deep_right += std::abs(off) < 1 ? 1 : 0;
      seen.deep_covered += std::abs(off) < 1.96 * r.wd_sd_px ? 1 : 0;
    }
  }
  out.contact.push_back(touched_seen.value_or(99) - *touched);
  out.puncture.push_back(broke_seen.value_or(99) - *broke);
}

void print(const char* name, const Injections& all) {
  for (const auto& [phase, s] : all.in) {
    const double n = s.frames;
    std::printf(
        "%s, %s: %d frames; outer claimed %d, right %.0f %%, %.2f um rms; inner claimed %d, right %.0f %%, "
        "%.2f um",
        name, phase.c_str(), s.frames, s.outer_claimed, 100 * s.outer_right / n,
        DrawnMicroscope::kPixel_um * std::sqrt(s.outer / s.outer_claimed), s.inner_claimed,
        100 * s.inner_right / n, DrawnMicroscope::kPixel_um * std::sqrt(s.inner / s.inner_claimed));
    if (s.depths > 0) {
      std::printf("; depth of the dimple %.2f px rms, within 1 px %d of %d, covered %d",
                  std::sqrt(s.depth / s.depths), s.deep_right, s.depths, s.deep_covered);
    }
    std::printf("\n");
  }
  for (const auto& [what, late] :
       {std::pair("contact", &all.contact), std::pair("puncture", &all.puncture)}) {
    std::printf("%s, %s late by", name, what);
    for (const int frames : *late) {
      std::printf(" %+d", frames);
    }
    std::printf("\n");
  }
}

class DrawnInjection : public testing::TestWithParam<bool> {};

TEST_P(DrawnInjection, shows_the_dimple_and_when_the_membrane_gives_way) {
  unsigned first = 1, last = 2;
  const char* const named = std::getenv("PUNCTUM_INJECTION_SEEDS");
  const bool measured = named != nullptr && std::sscanf(named, "%u-%u", &first, &last) == 2;
  Injections all;
  for (unsigned seed = first; seed <= last; ++seed) {
    Microscope m;
    m.relief = GetParam();
    m.seed = seed;
    inject(m, all);
  }
  print(GetParam() ? "relief" : "bright field", all);
  if (measured) {
    return;
  }
  const Seen& pushed = all.in["in contact"];
  EXPECT_GE(pushed.depths, pushed.frames - 4);
  EXPECT_LT(std::sqrt(pushed.depth / pushed.depths), 0.6);
  EXPECT_GE(pushed.deep_right, pushed.depths - 1);
  EXPECT_GE(pushed.deep_covered, 9 * pushed.depths / 10);
  EXPECT_GE(pushed.outer_right, pushed.frames - 1);
  for (const char* phase : {"before contact", "inside"}) {
    EXPECT_EQ(all.in[phase].outer_right, all.in[phase].frames) << phase;
    EXPECT_LT(std::sqrt(all.in[phase].outer / all.in[phase].outer_claimed), GetParam() ? 0.3 : 0.25) << phase;
  }
  for (const int late : all.contact) {
    EXPECT_TRUE(late >= -1 && late <= (GetParam() ? 2 : 1)) << late;
  }
  for (const int late : all.puncture) {
    EXPECT_TRUE(late >= 0 && late <= 2) << late;
  }
}

// The stage creeps: the outline at rest goes with the cell.
TEST(DriftingInjection, shows_the_dimple_as_deep_as_it_is) {
  for (const cv::Point2d& drift : {cv::Point2d(0.2, 0.2), cv::Point2d(-0.25, 0)}) {
    Injections all;
    Microscope m;
    m.seed = 1;
    inject(m, all, drift);
    print("drift", all);
    const Seen& pushed = all.in["in contact"];
    EXPECT_GE(pushed.depths, pushed.frames - 2);
    EXPECT_LT(std::sqrt(pushed.depth / pushed.depths), 0.6);
    EXPECT_GE(pushed.deep_covered, 8 * pushed.depths / 10);
    EXPECT_LE(std::abs(all.contact[0]), 1);
  }
}

INSTANTIATE_TEST_SUITE_P(Light, DrawnInjection, testing::Bool(),
                         [](const auto& of) { return of.param ? "relief" : "bright_field"; });

}  // namespace
