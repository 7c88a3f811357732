// Where a face lies in what turns with the light: profiles that are computed here, a sheet's as a Gaussian
// line, a round body's by integrating over the depth below its face.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "vision/membrane/edge_profiles.hpp"
#include "vision/membrane/relief_steps.hpp"

namespace {

using namespace punctum::vision;

double line(double off, double blur) { return std::exp(-0.5 * off * off / (blur * blur)); }

// Of a body of unit slope: the light's path below the face grows as the root of the depth, and is blurred the
// more the deeper it lies. off: outwards from the face.
double body(double off, double blur) {
  constexpr double kDeepest = 60, kStep = 1e-3;  // of the root of the depth in blurs
  double sum = 0;
  for (double root = 0.5 * kStep; root * root < kDeepest; root += kStep) {
    const double sd = std::sqrt(1 + root * root), z = (off / blur + root * root) / sd;
    sum += 2 * kStep * std::exp(-0.5 * z * z) / (sd * std::sqrt(2 * std::numbers::pi));
  }
  return sum;
}

struct Told {
  std::optional<ReliefSteps::Fit> fit;
  double flatness;  // positive: as a sheet
};
Told tell(const EdgeShape& edge, const std::function<double(double)>& turning) {
  Vector<double> samples;
  for (double s = -edge.inside; s <= edge.outside; s += EdgeProfiles::kStep_px) {
    samples.push_back(turning(s));
  }
  Told out{};
  out.fit = ReliefSteps(samples, edge).fit(1, out.flatness);
  return out;
}

TEST(ReliefSteps, tell_where_the_edge_of_a_sheet_is) {
  for (const double own : {-2.6, -1.7, -0.6, 0.3, 1.4}) {
    for (const double blur : {0.9, 1.4, 2.3}) {
      const auto [fit, flatness] = tell({}, [&](double s) { return 3 - 20 * line(s - own, blur); });
      ASSERT_TRUE(fit) << own << ' ' << blur;
      EXPECT_NEAR(fit->own, own, 0.02) << blur;
      EXPECT_GT(flatness, 0);
    }
  }
}

TEST(ReliefSteps, tell_it_beside_another_one) {
  EdgeShape edge;
  edge.nearby = {-5.5, 1.5};
  for (const double own : {-1.9, -0.7, 0.2, 1.3}) {
    for (const double apart : {-4.6, -5.5, -6.3}) {
      const auto [fit, flatness] =
          tell(edge, [&](double s) { return 8 * line(s - own - apart, 1.3) - 20 * line(s - own, 1.3); });
      ASSERT_TRUE(fit) << own << ' ' << apart;
      EXPECT_NEAR(fit->own, own, 0.1) << apart;
      EXPECT_GT(flatness, 0);
    }
  }
}

TEST(ReliefSteps, tell_where_the_face_of_a_round_body_is) {
  for (const double own : {-1.9, -0.8, 0.4, 1.2}) {
    for (const double blur : {1.1, 1.8}) {
      const auto [fit, flatness] = tell({}, [&](double s) { return 3 - 20 * body(s - own, blur); });
      ASSERT_TRUE(fit) << own << ' ' << blur;
      EXPECT_NEAR(fit->own, own, 0.05) << blur;
      EXPECT_LT(flatness, 0);
    }
  }
}

TEST(ReliefSteps, of_the_inner_flank_of_another_face_are_none) {
  EXPECT_FALSE(tell({}, [](double s) { return 20 * line(s, 1.4); }).fit);
}

}  // namespace
