// One sample for every tick.
#include <gtest/gtest.h>

#include <memory>

#include "rt/control/telemetry_writer.hpp"

namespace punctum::rt {
namespace {

using hal::Vec3;

struct Told {
  Told() {
    ServoConfig config;
    config.damping.emplace();
    rendering = std::make_unique<Rendering>(config);
  }
  void publish() {
    writer.publish(
        {now, 5, readings, requested, velocity, cell, task, *rendering, modulus, safety, set_point});
  }
  // A second of damping at 1 cm/s.
  void render() {
    for (int k = 0; k < 1000; ++k) {
      (void)rendering->sum_effects({.dt_s = 1e-3, .coupled = true, .hand_velocity_m_s = Vec3(0.01, 0, 0)},
                                   readings, cell, task);
    }
  }
  std::unique_ptr<LocalStation> station = std::make_unique<LocalStation>();
  TickInfo now{.tick = 7, .release_ns = 5'000'000'000};
  Readings readings;
  Requested requested;
  Vec3 velocity = Vec3(1, 2, 3);
  CellFacts cell;
  TaskFacts task;
  std::unique_ptr<Rendering> rendering;
  ModulusEstimate modulus{.E_Pa = 30e3, .sd_Pa = 2e3};
  SafetyOutput safety;
  hal::StageCommand set_point{.tip_m = Vec3(4, 5, 6)};
  TelemetryWriter writer{station->station};
};

TEST(TelemetryWriter, publishes_one_sample_per_tick_with_the_time_since_the_first) {
  Told t;
  t.publish();
  t.now.tick = 9;
  t.now.release_ns += 2'000'000;
  t.publish();
  ASSERT_EQ(t.station->core.telemetry.head(), 2U);
  TelemetrySample s;
  ASSERT_EQ(t.station->core.telemetry.read(1, s), hal::Read::ok);
  EXPECT_EQ(s.tick, 9U);
  EXPECT_NEAR(s.t_s, 2e-3, 1e-12);
  EXPECT_EQ(s.alarms, 5U);
  EXPECT_EQ(s.v_m_s[2], 3);
  EXPECT_EQ(s.cmd_m[0], 4);
  EXPECT_EQ(s.obs_age_s, -1);
}

TEST(TelemetryWriter, tells_the_standard_deviations) {
  Told t;
  t.cell.depth_sd_m = 1;
  t.cell.R_sd_m = 2;
  t.cell.observed_a_m = 3;
  t.cell.observed_a_sd_m = 4;
  t.publish();
  const TelemetrySample& s = t.writer.sample();
  EXPECT_EQ(s.wd_sd_m, 1);
  EXPECT_EQ(s.R_sd_m, 2);
  EXPECT_EQ(s.obs_a_m, 3);
  EXPECT_EQ(s.obs_a_sd_m, 4);
  EXPECT_EQ(s.E_fit_Pa, 30e3);
  EXPECT_EQ(s.E_fit_sd_Pa, 2e3);
  EXPECT_EQ(s.tip_force_sd_N, 0) << "no membrane";
}

TEST(TelemetryWriter, tells_each_effect_in_the_place_that_the_list_gives_it) {
  Told t;
  t.render();
  t.publish();
  for (std::size_t i = 0; i < kMaxEffects; ++i) {
    EXPECT_NEAR(t.writer.sample().effect_N[i], i == effect_damping ? 0.01 : 0, 1e-12) << i;
  }
}

TEST(TelemetryWriter, tells_no_force_of_the_effects_during_a_stop_and_on_the_tick_that_clears_it) {
  for (const bool cleared : {false, true}) {
    Told t;
    t.render();
    t.safety.running = cleared;
    t.safety.latch.cleared = cleared;
    t.publish();
    EXPECT_EQ(t.writer.sample().effect_N[effect_damping], 0);
  }
}

TEST(TelemetryWriter, tells_depth_and_radius_only_of_a_known_cell) {
  Told t;
  t.cell.depth_m = 3e-6;
  t.cell.membrane.R_m = 60e-6;
  t.publish();
  EXPECT_EQ(t.writer.sample().wd_m, 0);
  EXPECT_EQ(t.writer.sample().R_m, 0);
  t.cell.membrane.known = true;
  t.publish();
  EXPECT_EQ(t.writer.sample().wd_m, 3e-6);
  t.cell.depth_m = -3e-6;
  t.publish();
  EXPECT_EQ(t.writer.sample().wd_m, 0);
}

TEST(TelemetryWriter, keeps_the_core_status_in_step) {
  Told t;
  t.safety.cause = Fault::vacuum_lost;
  t.safety.faults_latched = 6;
  t.task.phase = Phase::withdrawal;
  t.task.done = true;
  t.requested.refused = 3;
  t.readings.estop = {.contact_a_closed = false, .contact_b_closed = true, .reset_pressed = true};
  t.publish();
  const CoreStatus& core = t.station->core.status;
  EXPECT_EQ(core.fault.load(), static_cast<std::uint64_t>(Fault::vacuum_lost));
  EXPECT_EQ(core.faults_latched.load(), 6U);
  EXPECT_EQ(core.phase.load(), static_cast<std::uint64_t>(Phase::withdrawal));
  EXPECT_EQ(core.task_finished.load(), 1U);
  EXPECT_EQ(core.commands_refused.load(), 3U);
  EXPECT_EQ(t.writer.sample().estop, 5);
}

TEST(TelemetryWriter, tells_once_what_changes_and_when) {
  Told t;
  t.publish();  // alarms 5: bits 0 and 2
  t.publish();
  t.now.tick = 8;
  t.now.release_ns += 1'000'000;
  t.safety.cause = Fault::tip_force;
  t.task.phase = Phase::contact;
  t.requested.taken[0] = {{Command::force_scale, 0.5}, 1, true};
  t.requested.taken_count = 1;
  t.publish();
  t.requested.taken_count = 0;
  t.safety.cause = Fault::none;
  t.publish();
  const struct {
    Event::Kind kind;
    std::uint64_t what;
    std::uint64_t tick;
  } expected[] = {{Event::alarm_on, 0, 7},
                  {Event::alarm_on, 2, 7},
                  {Event::command, Command::force_scale, 8},
                  {Event::fault, static_cast<std::uint64_t>(Fault::tip_force), 8},
                  {Event::phase, static_cast<std::uint64_t>(Phase::contact), 8},
                  {Event::fault_cleared, static_cast<std::uint64_t>(Fault::tip_force), 8}};
  hal::Follower events(t.station->core.events);
  Event e;
  for (const auto& x : expected) {
    ASSERT_EQ(events.next(e), hal::Read::ok);
    EXPECT_EQ(e.kind, x.kind);
    EXPECT_EQ(e.what, x.what);
    EXPECT_EQ(e.tick, x.tick);
    EXPECT_NEAR(e.t_s, x.tick == 7 ? 0 : 1e-3, 1e-12);
  }
  EXPECT_EQ(events.next(e), hal::Read::not_yet);
}

}  // namespace
}  // namespace punctum::rt
