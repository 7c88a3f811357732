// An outline carried over frames, against a curve that is known: drawn here, seen with errors drawn here.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include "vision/image/polar_contour.hpp"
#include "vision/membrane/carried_outline.hpp"
#include "vision/membrane/rest_shape.hpp"

namespace {

using namespace punctum::vision;

constexpr int kRays = 256;

// An oval with a dent at `dent_at`.
struct Cell {
  Point centre{120, 118};
  double turn = 0;  // rad
  double dent = 0;  // px
  [[nodiscard]] double r(double t) const {
    const double u = std::remainder(t - 0.4, 2 * std::numbers::pi) / 0.15;
    return 74 + 3 * std::cos(2 * (t - turn)) + 1.2 * std::cos(3 * (t - turn) + 1) -
           dent * std::exp(-u * u / 2);
  }
};

// Smooth errors of that sd, as a contour with 12 periods has.
Vector<double> errors(double sd, std::mt19937& random) {
  constexpr int kModes = 12;
  std::normal_distribution<double> normal(0, sd / std::sqrt(kModes + 0.5));
  Vector<double> out(kRays, normal(random));
  for (int k = 1; k <= kModes; ++k) {
    const double a = normal(random), b = normal(random);
    for (int i = 0; i < kRays; ++i) {
      const double t = polar_angle(i, kRays) * k;
      out[static_cast<std::size_t>(i)] += a * std::cos(t) + b * std::sin(t);
    }
  }
  return out;
}

SeenOutline seen(const Cell& cell, const Vector<double>& off, double variance, double lasting) {
  SeenOutline out{{}, Vector<double>(kRays, variance), Vector<double>(kRays, lasting)};
  for (int i = 0; i < kRays; ++i) {
    out.contour.push_back(
        on_ray(cell.centre, i, kRays, cell.r(polar_angle(i, kRays)) + off[static_cast<std::size_t>(i)]));
  }
  return out;
}

struct Judged {
  double square = 0;
  int points = 0, within_one = 0, within_two = 0, wrong = 0;
  double half = 4;  // rad to either side of the dent: where it is judged
  void take(const CarriedOutline& outline, const Cell& cell) {
    const Contour c = outline.contour();
    const Vector<double> sd = outline.sd();
    ASSERT_EQ(c.size(), sd.size());
    for (std::size_t i = 0; i < c.size(); ++i) {
      const Point d = c[i] - cell.centre;
      if (angle_between(std::atan2(d.y, d.x), 0.4) > half) {
        continue;
      }
      const double off = std::abs(cv::norm(d) - cell.r(std::atan2(d.y, d.x)));
      square += off * off;
      ++points;
      within_one += off < sd[i];
      within_two += off < 1.96 * sd[i];
      wrong += off > 2;
    }
  }
  [[nodiscard]] double rms() const { return std::sqrt(square / points); }
  [[nodiscard]] double share(int n) const { return static_cast<double>(n) / points; }
};

const CarriedOutline::Change kStill{Vector<double>(kRays, 0.0), Vector<double>(kRays, 0.0)};

TEST(CarriedOutline, is_better_than_its_frames_while_the_cell_drifts_and_turns) {
  for (const double sd : {0.06, 0.1, 0.2, 0.4}) {
    Judged judged;
    for (unsigned seed = 1; seed <= 12; ++seed) {
      std::mt19937 random(seed);
      CarriedOutline outline;
      Cell cell;
      for (int frame = 0; frame < 40; ++frame) {
        cell.centre += Point(0.2, -0.2);
        cell.turn += 0.3 / 74;
        outline.update(seen(cell, errors(sd, random), sd * sd, 0), kStill);
        if (frame >= 12) {
          judged.take(outline, cell);
        }
      }
    }
    EXPECT_LT(judged.rms(), 0.7 * sd) << sd;
    EXPECT_NEAR(judged.share(judged.within_one), 0.68, 0.12) << sd;
    EXPECT_GT(judged.share(judged.within_two), 0.88) << sd;
  }
}

// Of errors that are smooth along the contour some are large by chance somewhere in every frame: those are no
// new shape.
TEST(CarriedOutline, of_a_cell_at_rest_is_the_mean_of_its_frames) {
  constexpr double kSd = 0.2;
  Judged judged;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    std::mt19937 random(seed);
    CarriedOutline outline;
    for (int frame = 0; frame < 40; ++frame) {
      outline.update(seen({}, errors(kSd, random), kSd * kSd, 0), kStill);
      if (frame >= 20) {
        judged.take(outline, {});
      }
    }
  }
  EXPECT_LT(judged.rms(), 0.47 * kSd);
}

// Granules beside the membrane move with it, and shift every frame alike: they do not average out.
TEST(CarriedOutline, does_not_take_what_every_frame_repeats_for_new) {
  Judged judged;
  constexpr double kNoise = 0.1, kGrains = 0.2;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    CarriedOutline outline;
    const Vector<double> grains = errors(kGrains, random);
    for (int frame = 0; frame < 20; ++frame) {
      Vector<double> off = errors(kNoise, random);
      for (std::size_t i = 0; i < off.size(); ++i) {
        off[i] += grains[i];
      }
      outline.update(seen({}, off, kNoise * kNoise + kGrains * kGrains, kGrains * kGrains), kStill);
    }
    judged.take(outline, {});
  }
  EXPECT_NEAR(judged.share(judged.within_one), 0.68, 0.1);
  EXPECT_GT(judged.share(judged.within_two), 0.9);
}

TEST(CarriedOutline, follows_at_once_what_changes_its_shape) {
  constexpr double kSd = 0.1;
  std::mt19937 random(3);
  for (const bool expected : {true, false}) {
    CarriedOutline::Change pushed = kStill;
    for (int i = 0; i < kRays && expected; ++i) {
      if (angle_between(polar_angle(i, kRays), 0.4) < 0.6) {
        pushed.sd[static_cast<std::size_t>(i)] = 2;
      }
    }
    CarriedOutline outline;
    Cell cell;
    for (int frame = 0; frame < 30; ++frame) {
      cell.dent = std::max(0, frame - 15);
      outline.update(seen(cell, errors(kSd, random), kSd * kSd, 0), pushed);
      Judged judged;
      judged.take(outline, cell);
      EXPECT_LT(judged.rms(), expected ? 0.12 : 0.25) << frame;
      EXPECT_EQ(judged.wrong, 0) << frame;
    }
  }
}

// Where the needle tells by how much a dimple deepens, the frames before tell its shape; a recoil that was
// not told is seen all the same.
TEST(CarriedOutline, carries_a_dimple_along_as_far_as_its_change_is_told) {
  constexpr double kSd = 0.2, kDeepens = 1;
  CarriedOutline::Change anything = kStill, told = kStill;
  for (std::size_t i = 0; i < kRays; ++i) {
    const double u = angle_between(polar_angle(static_cast<int>(i), kRays), 0.4) / 0.15;
    if (u < 4) {
      anything.sd[i] = 2;
      told.sd[i] = 0.2;
    }
    told.by[i] = -kDeepens * std::exp(-u * u / 2);
  }
  Judged with{.half = 0.4}, without{.half = 0.4};
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    CarriedOutline outline, other;
    Cell cell;
    for (int frame = 0; frame < 15; ++frame) {
      cell.dent += kDeepens;
      const SeenOutline now = seen(cell, errors(kSd, random), kSd * kSd, 0);
      outline.update(now, told);
      other.update(now, anything);
      if (frame > 4) {
        with.take(outline, cell);
        without.take(other, cell);
      }
    }
    cell.dent = 6;
    outline.update(seen(cell, errors(kSd, random), kSd * kSd, 0), told);
    Judged recoiled;
    recoiled.take(outline, cell);
    EXPECT_EQ(recoiled.wrong, 0) << seed;
  }
  EXPECT_LT(with.rms(), 0.75 * without.rms());
  EXPECT_NEAR(with.share(with.within_one), 0.68, 0.12);
}

// Of a cell that never drifts the frames tell its place ever better; one that begins to is followed at once.
TEST(CarriedOutline, learns_whether_the_cell_drifts) {
  constexpr double kSd = 0.2;
  const auto centre_of = [](const CarriedOutline& outline) { return centroid(outline.contour()); };
  double square = 0, late = 0;
  constexpr unsigned kCells = 20;
  for (unsigned seed = 1; seed <= kCells; ++seed) {
    std::mt19937 random(seed);
    CarriedOutline outline;
    Cell cell;
    const Point off = [&] {
      CarriedOutline exact;
      exact.update(seen(cell, Vector<double>(kRays, 0.0), 1e-6, 0), kStill);
      return centre_of(exact) - cell.centre;
    }();
    for (int frame = 0; frame < 60; ++frame) {
      outline.update(seen(cell, errors(kSd, random), kSd * kSd, 0), kStill);
    }
    square += std::pow(cv::norm(centre_of(outline) - off - cell.centre), 2) / (2 * kCells);
    for (int frame = 0; frame < 5; ++frame) {
      cell.centre += Point(0.3, 0.3);
      outline.update(seen(cell, errors(kSd, random), kSd * kSd, 0), kStill);
      late = std::max(late, cv::norm(centre_of(outline) - off - cell.centre));
    }
  }
  // One frame alone tells it to the mean of two modes of the errors.
  const double alone = kSd * std::sqrt(2 / 12.5);
  EXPECT_LT(std::sqrt(square), 0.7 * alone);
  EXPECT_LT(late, 0.25);
}

// A cell that was let go of, or a stage that was moved.
TEST(CarriedOutline, follows_a_jump_of_the_whole_cell) {
  constexpr double kSd = 0.1;
  std::mt19937 random(4);
  CarriedOutline outline;
  Cell cell;
  for (int frame = 0; frame < 20; ++frame) {
    if (frame == 10) {
      cell.centre += Point(4, 3);
    }
    outline.update(seen(cell, errors(kSd, random), kSd * kSd, 0), kStill);
    Judged judged;
    judged.take(outline, cell);
    EXPECT_LT(judged.rms(), 0.3) << frame;
  }
}

TEST(CarriedOutline, of_another_number_of_points_begins_anew) {
  CarriedOutline outline;
  std::mt19937 random(5);
  outline.update(seen({}, errors(0.1, random), 0.01, 0), kStill);
  SeenOutline coarse;
  for (int i = 0; i < 128; ++i) {
    coarse.contour.push_back(on_ray({50, 60}, i, 128, 30));
  }
  coarse.variance.assign(128, 0.04);
  coarse.lasting.assign(128, 0.01);
  outline.update(coarse, {Vector<double>(128, 0.0), Vector<double>(128, 0.0)});
  ASSERT_EQ(outline.contour().size(), 128U);
  EXPECT_NEAR(cv::norm(outline.contour().front() - Point(80, 60)), 0, 0.05);
  EXPECT_NEAR(outline.sd().front(), 0.2, 1e-12);
}

// By how much the outline at rest is off where the needle enters: rms over 20 frames in contact, px. The cell
// turns by so many px of its rim in a frame, before and in contact.
double off_at_entry(double before_px, double in_contact_px, unsigned seed) {
  constexpr double kEntry = 0.4, kHidden = 0.9;  // rad
  const int at = polar_index(Point(std::cos(kEntry), std::sin(kEntry)), kRays);
  std::vector<double> weight;
  for (int i = 0; i < kRays; ++i) {
    weight.push_back(angle_between(polar_angle(i, kRays), kEntry) > kHidden ? 1 : 0);
  }
  std::mt19937 random(seed);
  Cell cell;
  RestOutline rest;
  double square = 0;
  for (int frame = -30; frame < 20; ++frame) {
    cell.turn += (frame < 0 ? before_px : in_contact_px) / 74;
    cell.dent = std::max(0, frame);
    const Contour now = seen(cell, errors(0.08, random), 0, 0).contour;
    if (frame < 0) {
      rest.learn(cell.centre, polar_radii(now, cell.centre, kRays));
      continue;
    }
    (void)rest.turn_with(now, weight);
    Cell untouched = cell;
    untouched.dent = 0;
    square += std::pow(rest.r[static_cast<std::size_t>(at)] - untouched.r(polar_angle(at, kRays)), 2);
  }
  return std::sqrt(square / 20);
}

TEST(RestOutline, turns_with_the_cell_also_while_the_needle_hides_a_part_of_it) {
  double still = 0, turning = 0, stopped = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    still = std::max(still, off_at_entry(0, 0, seed));
    turning = std::max({turning, off_at_entry(0.3, 0.3, seed), off_at_entry(-0.3, -0.3, seed)});
    stopped = std::max({stopped, off_at_entry(0.3, 0, seed), off_at_entry(0, -0.3, seed)});
  }
  // The outline itself turns by 6 px of its rim in contact, which is 0.5 px where the needle enters.
  EXPECT_LT(still, 0.08);
  EXPECT_LT(turning, 0.1);
  EXPECT_LT(stopped, 0.13) << "the needle may hold it";
}

// Turned by a fraction of an angle a thousand times, it is still the cell, elsewhere.
TEST(RestOutline, keeps_its_form_however_often_it_is_turned) {
  constexpr double kBy = 0.3 / 74;  // rad
  for (const double sign : {1.0, -1.0}) {
    Cell cell;
    RestOutline rest;
    rest.learn(cell.centre,
               polar_radii(seen(cell, Vector<double>(kRays, 0.0), 0, 0).contour, cell.centre, kRays));
    for (int i = 0; i < 1000; ++i) {
      rest.turn(sign * kBy);
      cell.turn += sign * kBy;
    }
    for (int i = 0; i < kRays; ++i) {
      EXPECT_NEAR(rest.r[static_cast<std::size_t>(i)], cell.r(polar_angle(i, kRays)), 0.05) << i;
    }
  }
}

// Noise alone looks like any turn of what is hardly less than round.
TEST(RestOutline, of_a_cell_that_is_almost_round_does_not_turn_with_noise) {
  constexpr double kNoise = 0.4;  // px, each angle by itself
  const Point centre(120, 118);
  for (unsigned seed = 1; seed <= 8; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> off(0, kNoise);
    RestOutline rest;
    const auto radii = [&] {
      Vector<double> r;
      for (int i = 0; i < kRays; ++i) {
        r.push_back(74 + 0.3 * std::cos(2 * polar_angle(i, kRays)) + off(random));
      }
      return r;
    };
    for (int frame = 0; frame < 25; ++frame) {
      rest.learn(centre, radii());
    }
    for (int frame = 0; frame < 200; ++frame) {
      (void)rest.turn_with(from_polar(centre, radii()), Vector<double>(kRays, 1.0));
      ASSERT_LT(std::abs(rest.spin) * 74, 0.3) << "px per frame, seed " << seed << ", frame " << frame;
    }
    for (const double r : rest.r) {
      EXPECT_NEAR(r, 74, 1) << seed;
    }
  }
}

TEST(RestOutline, of_a_round_cell_is_what_it_was) {
  RestOutline rest;
  const Point centre(120, 118);
  for (int frame = 0; frame < 30; ++frame) {
    rest.learn(centre, Vector<double>(kRays, 74.0));
  }
  Contour dented;
  for (int i = 0; i < kRays; ++i) {
    dented.push_back(on_ray(centre, i, kRays, i < 40 ? 74.0 - i : 74.0));
  }
  std::vector<double> weight(kRays, 1.0);
  std::fill(weight.begin(), weight.begin() + 40, 0.0);
  EXPECT_NEAR(rest.turn_with(dented, weight), 0, 1e-6);
  for (const double r : rest.r) {
    EXPECT_NEAR(r, 74, 0.05);
  }
}

}  // namespace
