// The cell as the core knows it, from observations and the needle's way between them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "rt/control/cell_observer.hpp"
#include "rt/station/alarm.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

struct Observed {
  explicit Observed(const ServoConfig& config = ServoConfig{}) : cell(config, station->station) {
    readings.has_stage = readings.stage_seen = readings.stage_fresh = true;
    readings.stage.tip_m = Vec3(60e-6, 0, 0);
  }
  const CellFacts& tick() {
    now_ns += 1'000'000;
    readings.stage.sample_ns = now_ns - stage_age_ns;
    const TickTime time{.now_ns = now_ns, .elapsed_s = 1e-3, .dt_s = 1e-3, .first = first};
    first = false;
    return cell.step(time, readings, Vec3::Zero(), last);
  }
  // A cell of 60 um radius, its undeformed membrane at x = 20 um; seen as it is now.
  void see(std::uint32_t more = 0) const {
    Observation o;
    o.exposure_ns = now_ns;
    o.flags = Observation::tip_ok | Observation::outer_ok | more;
    o.tip_m[0] = readings.stage.tip_m.x();
    o.centre_m[0] = -40e-6;
    o.R_m = 60e-6;
    o.gap_m = readings.stage.tip_m.x() - 20e-6;
    station->observation.slot.push(o);
  }

  std::unique_ptr<LocalStation> station = std::make_unique<LocalStation>();
  Readings readings;
  LastPhase last;
  std::int64_t now_ns = 1'000'000'000;
  std::int64_t stage_age_ns = 0;
  bool first = true;
  CellObserver cell;
};

TEST(CellObserver, knows_no_cell_and_no_fresh_vision_before_the_first_observation) {
  Observed o;
  EXPECT_FALSE(o.cell.facts().vision_fresh);
  const CellFacts& facts = o.tick();
  EXPECT_FALSE(facts.membrane.known || facts.vision_fresh);
  EXPECT_EQ(facts.observation_age_s, -1);
  EXPECT_EQ(facts.force_gain, 0);
}

TEST(CellObserver, needs_no_vision_in_a_scene_without_it) {
  ServoConfig config;
  config.vision = false;
  Observed o(config);
  const CellFacts& facts = o.tick();
  EXPECT_TRUE(facts.vision_fresh);
  EXPECT_FALSE(facts.membrane.known);
  EXPECT_EQ(facts.alarms, 0U);
}

// Two pictures in a row that show it.
void see_puncture(Observed& o) {
  o.readings.stage.tip_m.x() = 0;
  for (int k = 0; k < 2; ++k) {
    (void)o.tick();
    o.see(Observation::contact | Observation::punctured);
    (void)o.tick();
  }
}

TEST(CellObserver, forgets_a_puncture_when_the_needle_is_outside_again) {
  ServoConfig config;
  config.phases.emplace();
  Observed o(config);
  o.last.outside = false;
  see_puncture(o);
  EXPECT_TRUE(o.cell.facts().puncture_seen);
  o.last.outside = true;
  EXPECT_FALSE(o.tick().puncture_seen);
  o.last.outside = false;
  EXPECT_FALSE(o.tick().puncture_seen);
  see_puncture(o);
  EXPECT_TRUE(o.cell.facts().puncture_seen);
}

TEST(CellObserver, believes_a_puncture_in_a_scene_without_phases) {
  ServoConfig config;
  config.phases.reset();
  Observed o(config);
  o.last.outside = true;  // as the task says without phases
  see_puncture(o);
  EXPECT_TRUE(o.cell.facts().puncture_seen);
}

TEST(CellObserver, follows_the_depth_with_the_needle_between_two_observations) {
  Observed o;
  (void)o.tick();
  o.see();
  (void)o.tick();
  EXPECT_TRUE(o.cell.facts().vision_fresh);
  EXPECT_EQ(o.cell.facts().observations, 1U);
  EXPECT_NEAR(o.cell.facts().depth_m, -40e-6, 1e-9);
  o.readings.stage.tip_m.x() = 15e-6;
  const CellFacts& facts = o.tick();
  EXPECT_NEAR(facts.depth_m, 5e-6, 1e-9);
  EXPECT_EQ(facts.depth_correction_m, 0);  // the needle moved, not the picture
  EXPECT_EQ(facts.observations, 1U);
}

TEST(CellObserver, tells_a_correction_by_vision_apart_from_the_way_of_the_needle) {
  Observed o;
  (void)o.tick();
  o.see();
  (void)o.tick();
  Observation o2;
  ASSERT_EQ(o.station->observation.slot.head(), 1U);
  o.see();
  std::uint64_t index = 0;
  ASSERT_EQ(o.station->observation.slot.newest(o2, index), hal::Read::ok);
  o2.exposure_ns = o.now_ns;
  o2.centre_m[0] += 3e-6;  // the cell is nearer than it was thought
  o2.gap_m -= 3e-6;
  o.station->observation.slot.push(o2);
  const double before_m = o.cell.facts().depth_m;
  const CellFacts& facts = o.tick();
  EXPECT_GT(facts.depth_correction_m, 0);
  EXPECT_NEAR(facts.depth_m - before_m, facts.depth_correction_m, 1e-15);
}

// A needle at 0.4 mm/s whose drives answer late: each reading is where it was when it was measured.
TEST(CellObserver, compares_a_picture_with_where_the_needle_was_then_however_late_the_stage_is_read) {
  for (const std::int64_t age_ns : {0, 5'000'000, 10'000'000}) {
    Observed o;
    o.stage_age_ns = age_ns;
    constexpr double kSpeed_m_s = -0.4e-3;
    const auto place_m = [&](std::int64_t t_ns) {
      return 160e-6 + kSpeed_m_s * 1e-9 * static_cast<double>(t_ns - 1'000'000'000);
    };
    double entry_m = 0;
    for (int k = 0; k < 200; ++k) {
      if (k % 40 == 39) {  // of 30 ms ago
        Observation seen;
        seen.exposure_ns = o.now_ns - 30'000'000;
        seen.flags = Observation::tip_ok | Observation::outer_ok;
        seen.tip_m[0] = place_m(seen.exposure_ns);
        seen.centre_m[0] = -40e-6;
        seen.R_m = 60e-6;
        seen.gap_m = seen.tip_m[0] - 20e-6;
        o.station->observation.slot.push(seen);
      }
      o.readings.stage.tip_m.x() = place_m(o.now_ns + 1'000'000 - age_ns);
      entry_m = o.tick().membrane.entry_m.x();
    }
    EXPECT_NEAR(entry_m, 20e-6, 1e-9) << age_ns;
  }
}

TEST(CellObserver, raises_the_alarm_and_counts_the_ticks_once_an_observation_is_too_old) {
  Observed o;
  (void)o.tick();
  o.see();
  (void)o.tick();
  for (int k = 0; k < 310; ++k) {
    (void)o.tick();
  }
  EXPECT_FALSE(o.cell.facts().vision_fresh);
  EXPECT_NE(o.cell.facts().alarms & alarm_vision_stale, 0U);
  EXPECT_NEAR(static_cast<double>(o.cell.facts().stale_ticks), 10, 3);
}

TEST(CellObserver, freezes_the_approach_axis_from_contact_on) {
  Observed o;
  (void)o.tick();
  o.readings.stage.axis = Vec3(-1, 0.1, 0).normalized();
  o.last.outside = false;
  EXPECT_EQ(o.tick().approach_axis, -Vec3::UnitX());
  o.last.outside = true;
  EXPECT_NEAR(o.tick().approach_axis.y(), o.readings.stage.axis.y(), 1e-15);
}

TEST(CellObserver, measures_the_outward_speed_of_the_tip) {
  Observed o;
  for (int k = 0; k < 300; ++k) {
    o.readings.stage.tip_m.x() += 50e-6 * 1e-3;
    (void)o.tick();
  }
  EXPECT_NEAR(o.cell.facts().outward_m_s, 50e-6, 1e-8);  // after ten time constants
}

TEST(CellObserver, forgets_the_old_cell_on_a_restart) {
  Observed o;
  (void)o.tick();
  o.see();
  (void)o.tick();
  ASSERT_TRUE(o.cell.facts().membrane.known);
  o.cell.restart(o.now_ns);
  EXPECT_FALSE(o.cell.facts().membrane.known || o.cell.facts().vision_fresh);
}

TEST(CellObserver, counts_the_depth_past_the_first_contact_by_the_encoders_alone) {
  Observed o;
  ServoConfig config;
  (void)o.tick();
  for (int k = 0; k < 6; ++k) {
    o.see();
    (void)o.tick();
  }
  // The far wall of the cell as it was first seen.
  EXPECT_NEAR(o.cell.facts().inward_limit_m, -20e-6 + 120e-6 - config.limits.far_wall_m, 1e-9);
  o.readings.stage.tip_m.x() = 19e-6;
  (void)o.tick();
  EXPECT_NEAR(o.cell.facts().contact_depth_m, 1e-6, 1e-9);
  o.last.outside = false;
  (void)o.tick();
  EXPECT_NEAR(o.cell.facts().contact_inward_m, -20e-6, 1e-9);
  // Vision lets the entry recede with the needle.
  double entry_x = 20e-6;
  for (int k = 0; k < 1000; ++k) {
    o.readings.stage.tip_m.x() -= 50e-9;
    entry_x -= 50e-9;
    if (k % 20 == 0) {
      Observation seen;
      seen.exposure_ns = o.now_ns;
      seen.flags = Observation::tip_ok | Observation::outer_ok | Observation::contact;
      seen.tip_m[0] = o.readings.stage.tip_m.x() + 50e-9;
      seen.centre_m[0] = entry_x - 60e-6;
      seen.R_m = 60e-6;
      seen.gap_m = seen.tip_m[0] - entry_x;
      o.station->observation.slot.push(seen);
    }
    (void)o.tick();
  }
  EXPECT_NEAR(o.cell.facts().contact_depth_m, 51e-6, 1e-9);
  EXPECT_LT(std::abs(o.cell.facts().depth_m - o.cell.facts().contact_depth_m), 8e-6);
  EXPECT_NEAR(o.cell.facts().contact_inward_m, -20e-6, 1e-9);
  EXPECT_NE(o.cell.facts().alarms & alarm_vision_implausible, 0U);
  EXPECT_FALSE(o.cell.facts().vision_fresh);
  // Out by less than clears the cell: it is the same contact still.
  o.readings.stage.tip_m.x() = 25e-6;
  o.last.outside = true;
  (void)o.tick();
  (void)o.tick();
  EXPECT_NEAR(o.cell.facts().contact_depth_m, -5e-6, 1e-9);
  EXPECT_NEAR(o.cell.facts().contact_inward_m, -20e-6, 1e-9);
  // Out and clear of where it was touched, the next contact counts from where it will be.
  o.readings.stage.tip_m.x() = 31e-6;
  o.last.outside = true;
  (void)o.tick();
  (void)o.tick();
  EXPECT_NEAR(o.cell.facts().inward_limit_m, -20e-6 + 120e-6 - config.limits.far_wall_m, 1e-9);
  EXPECT_EQ(o.cell.facts().contact_inward_m, std::numeric_limits<double>::infinity());
}

TEST(CellObserver, takes_one_observation_on_a_tick_however_many_are_written) {
  Observed o;
  (void)o.tick();
  for (int k = 0; k < 1000; ++k) {
    o.see();
  }
  EXPECT_EQ(o.tick().observations, 1U);
  EXPECT_EQ(o.tick().observations, 1U);
}

TEST(CellObserver, survives_whatever_a_hostile_peer_leaves_in_the_segment) {
  std::mt19937_64 random(6);
  Observed o;
  (void)o.tick();
  for (int k = 0; k < 8; ++k) {
    o.see();
    (void)o.tick();
  }
  o.last.outside = false;
  auto& slot = o.station->observation.slot;
  std::vector<std::uint64_t> words(sizeof(slot) / 8);
  const std::uint64_t special[] = {
      0,    1, 0x7ff8000000000000ULL, 0x7fe1ccf385ebc8a0ULL, 0x7ff0000000000000ULL,
      ~0ULL};  // the third to fifth: NaN, 1e308, infinity
  Vec3 entry = o.cell.facts().membrane.entry_m;
  for (int k = 0; k < 20000; ++k) {
    if (k % 2 == 0) {  // garbage of words, or a whole observation of garbage
      for (auto& w : words) {
        w = random() % 3 == 0 ? special[random() % 6] : random();
      }
      std::memcpy(static_cast<void*>(&slot), words.data(), sizeof(slot));
    } else {
      Observation seen;
      std::array<std::uint64_t, sizeof(seen) / 8> raw;
      for (auto& w : raw) {
        w = random() % 2 == 0 ? special[random() % 6] : random() >> (random() % 64);
      }
      std::memcpy(static_cast<void*>(&seen), raw.data(), sizeof(seen));
      seen.exposure_ns = o.now_ns - static_cast<std::int64_t>(random() % 50'000'000);
      seen.flags |= Observation::tip_ok | Observation::outer_ok;
      slot.push(seen);
    }
    const CellFacts& facts = o.tick();
    ASSERT_TRUE(facts.membrane.entry_m.allFinite() && std::isfinite(facts.depth_m) &&
                std::isfinite(facts.membrane.R_m) && std::isfinite(facts.contact_depth_m));
    ASSERT_LE((facts.membrane.entry_m - entry).norm(), 8e-6);
    ASSERT_NEAR(facts.inward_limit_m, 70e-6, 30.1e-6);
  }
}

}  // namespace
}  // namespace punctum::rt
