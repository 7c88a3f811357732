// What the report measures, from samples and snapshots made up for the purpose.
#include "tools/punctum/measures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace punctum::tools {
namespace {

Scene scene_of(const char* name) { return *load_scene(name); }

// Gain of the band at one frequency, after it has settled.
double gain(double f_Hz, double rate_Hz) {
  TremorBand band(rate_Hz);
  double in2 = 0, out2 = 0;
  for (int i = 0; i < static_cast<int>(20 * rate_Hz); ++i) {
    const double x = std::sin(2 * std::numbers::pi * f_Hz * i / rate_Hz);
    const double y = band.next(x);
    if (i > 10 * rate_Hz) {
      in2 += x * x, out2 += y * y;
    }
  }
  return std::sqrt(out2 / in2);
}

TEST(TremorBand, passes_eight_to_twelve_hertz_and_little_else) {
  for (const double rate : {1000.0, 8000.0}) {
    EXPECT_NEAR(gain(std::sqrt(96.0), rate), 1, 1e-3);
    EXPECT_NEAR(gain(8, rate), 0.5, 0.02);  // two sections of half power each
    EXPECT_NEAR(gain(12, rate), 0.5, 0.02);
    EXPECT_LT(gain(1, rate), 2e-3);
    EXPECT_LT(gain(50, rate), 0.02);
  }
}

TEST(TremorBand, an_offset_at_the_start_rings_nothing) {
  TremorBand band(1000);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(band.next(0.3), 0);
  }
}

TEST(Measures, the_tremor_ratio_is_the_motion_of_the_tip_scaled_back_to_the_hand) {
  const Scene scene = scene_of("free");
  Measures m(scene);
  sim::Snapshot world;
  for (int i = 0; i < 20'000; ++i) {
    rt::TelemetrySample s;
    s.tick = static_cast<std::uint64_t>(i);
    s.t_s = i * 1e-3;
    const double shake = std::sin(2 * std::numbers::pi * 10 * s.t_s);
    world.hand.position_m.y = 0.3e-3 * shake + 0.01 * s.t_s;  // and a slow wander
    world.stage.tip_m.y = 0.25 * 0.3e-3 * shake / scene.servo.mapping.position_scale + 1e-6 * s.t_s;
    m.tick(s, &world);
  }
  m.finish();
  ASSERT_TRUE(m.tremor_ratio().has_value());
  EXPECT_NEAR(*m.tremor_ratio(), 0.25, 1e-3);
}

TEST(Measures,
     the_least_clearance_is_that_of_the_tip_from_the_floor_and_of_tip_and_shaft_from_the_holder_in_truth) {
  Scene scene = scene_of("icsi");
  scene.servo.forbidden.reset();  // what the core believes does not matter
  Measures m(scene);
  sim::Snapshot world;
  rt::TelemetrySample s;
  const auto at = [&](double x_um, double y_um, double z_um) {
    ++s.tick;
    world.stage.tip_m = hal::Vec3(x_um, y_um, z_um) * 1e-6;
    world.stage.axis = hal::Vec3(-1, 0, 0);
    m.tick(s, &world);
  };
  // The needle's tip is 3.8 um thick, its shaft 9 um 160 um behind it; the mouth is at x = -100, 45 um in
  // radius.
  at(0, 0, 20);
  EXPECT_NEAR(*m.least_floor_m, (65 - 20 - 3.8) * 1e-6, 1e-12);
  EXPECT_NEAR(*m.least_holder_m, (100 - 3.8) * 1e-6, 1e-12);
  at(-300, 60, 0);  // the shaft passes the mouth's rim
  EXPECT_NEAR(*m.least_holder_m, (60 - 45 - 9) * 1e-6, 0.1e-6);
  at(-120, 0, 63);  // in the floor
  EXPECT_NEAR(*m.least_floor_m, (65 - 63 - 3.8) * 1e-6, 1e-12);
  at(0, 0, 0);
  EXPECT_LT(*m.least_floor_m, 0);
  Measures none(scene_of("free"));
  none.tick(s, &world);
  EXPECT_FALSE(none.least_floor_m || none.least_holder_m);
}

TEST(Measures, phases_cells_faults_and_gaps_are_counted_and_listed) {
  const Scene scene = scene_of("icsi");
  Measures m(scene);
  std::uint64_t tick = 0;
  const auto run = [&](rt::Phase phase, std::uint32_t cell, int ticks, rt::Fault fault = rt::Fault::none) {
    for (int i = 0; i < ticks; ++i) {
      rt::TelemetrySample s;
      s.tick = tick++;
      s.t_s = static_cast<double>(s.tick) * 1e-3;
      s.phase = phase;
      s.cell = cell;
      s.fault = fault;
      m.tick(s, nullptr);
    }
  };
  using rt::Phase;
  run(Phase::free, 0, 100);
  run(Phase::contact, 0, 100);
  run(Phase::indentation, 0, 100, rt::Fault::estop);
  run(Phase::puncture, 0, 100);
  tick += 7;  // missed
  run(Phase::withdrawal, 0, 500);
  run(Phase::clear, 0, 100);
  run(Phase::free, 1, 100);
  m.finish();

  ASSERT_EQ(m.phases.size(), 7U);
  EXPECT_EQ(m.phases[4].phase, Phase::withdrawal);
  EXPECT_NEAR(m.phases[4].end_s - m.phases[4].start_s, 0.5, 1e-9);
  EXPECT_EQ(m.phases[6].cell, 1U);
  EXPECT_EQ(m.gaps, 7U);
  EXPECT_EQ(m.cell_count, 2U);
  EXPECT_EQ(m.cells_done, 1U);
  ASSERT_EQ(m.faults.size(), 1U);
  EXPECT_EQ(m.faults[0].fault, rt::Fault::estop);
  EXPECT_NEAR(m.faults[0].t_s, 0.2, 1e-9);
  EXPECT_NEAR(m.withdrawal_s.mean, 0.5, 1e-9);
}

// A station whose cell nobody simulates: the core alone tells of it.
Scene scene_without_a_simulated_cell() {
  Scene scene = scene_of("icsi");
  scene.sim->cell.reset();
  return scene;
}

TEST(Measures, the_dose_is_what_the_injector_gave_of_what_the_button_asked_inside_the_cell) {
  const Scene scene = scene_without_a_simulated_cell();
  Measures m(scene);
  rt::TelemetrySample s;
  const auto run = [&](rt::Phase phase, int ticks, bool pressed, bool open) {
    for (int i = 0; i < ticks; ++i) {
      s.tick++;
      s.t_s += 1e-3;
      s.phase = phase;
      s.buttons = pressed ? hal::kButtonInject : 0U;
      s.injector_open = open ? 1 : 0;
      m.tick(s, nullptr);
    }
  };
  run(rt::Phase::free, 100, true, false);  // a press outside asks for nothing
  run(rt::Phase::puncture, 100, false, false);
  run(rt::Phase::injection, 390, true, true);
  run(rt::Phase::injection, 1110, true, false);
  run(rt::Phase::withdrawal, 100, false, false);
  run(rt::Phase::clear, 100, false, false);
  m.finish();
  EXPECT_NEAR(m.asked_s, 1.5, 1e-9);
  EXPECT_NEAR(m.injected_s, 0.39, 1e-9);
  EXPECT_EQ(m.cells_underdosed, 1U);
  EXPECT_EQ(m.cells_done, 0U);
}

TEST(Measures, ticks_without_a_sample_count_for_the_dose_too) {
  Measures m(scene_without_a_simulated_cell());
  rt::TelemetrySample s;
  s.phase = rt::Phase::injection;
  s.buttons = hal::kButtonInject;
  s.injector_open = 1;
  for (int i = 0; i < 100; ++i) {  // every tenth tick was recorded
    s.tick += 10;
    s.t_s += 10e-3;
    m.tick(s, nullptr);
  }
  m.finish();
  EXPECT_NEAR(m.asked_s, 1, 0.01);
  EXPECT_NEAR(m.injected_s, 1, 0.01);
}

TEST(Measures, a_fault_that_is_there_from_the_first_tick_is_counted) {
  Measures m(scene_of("icsi"));
  rt::TelemetrySample s;
  s.fault = rt::Fault::estop;
  for (int i = 0; i < 10; ++i, ++s.tick) {
    m.tick(s, nullptr);
  }
  m.finish();
  EXPECT_EQ(m.fault_count, 1U);
  ASSERT_EQ(m.faults.size(), 1U);
  EXPECT_EQ(m.faults[0].fault, rt::Fault::estop);
}

TEST(Measures, a_dose_that_lacks_no_more_than_the_valve_may_take_is_whole) {
  CellMeasures cell;
  cell.asked_s = 1.5;
  cell.injected_s = 1.36;
  EXPECT_FALSE(cell.underdosed());
  cell.injected_s = 1.3;
  EXPECT_TRUE(cell.underdosed());
  cell.asked_s = 0;
  cell.injected_s = 0;
  EXPECT_FALSE(cell.underdosed()) << "nothing was asked";
}

TEST(Measures, the_needle_is_where_the_core_last_saw_it_and_unknown_where_it_saw_nothing) {
  const Scene scene = scene_without_a_simulated_cell();
  const auto ended_in = [&scene](rt::Phase phase, bool stale) {
    Measures m(scene);
    rt::TelemetrySample s;
    s.phase = phase;
    s.alarms = stale ? rt::alarm_vision_stale : 0U;
    s.R_m = 60e-6;
    s.axis[0] = -1;
    s.entry_m[0] = 20e-6;
    s.tip_m[0] = -3e-6;  // 23 um further along the axis
    m.tick(s, nullptr);
    m.finish();
    return m.whereabouts();
  };
  EXPECT_EQ(ended_in(rt::Phase::injection, false).where, Whereabouts::inside);
  EXPECT_EQ(ended_in(rt::Phase::injection, true).where, Whereabouts::inside) << "blind, it is still inside";
  EXPECT_NEAR(ended_in(rt::Phase::injection, false).depth_m.value_or(0), 23e-6, 1e-12);
  EXPECT_EQ(ended_in(rt::Phase::indentation, false).where, Whereabouts::touching);
  EXPECT_EQ(ended_in(rt::Phase::clear, false).where, Whereabouts::outside);
  EXPECT_EQ(ended_in(rt::Phase::free, true).where, Whereabouts::unknown);
  EXPECT_EQ(ended_in(rt::Phase::free, false).source, Whereabouts::core);
  EXPECT_EQ(Measures(scene_of("free")).whereabouts().where, Whereabouts::no_cell);
}

TEST(Measures, keeps_the_last_modulus_of_each_cell) {
  Measures m(scene_of("icsi"));
  rt::TelemetrySample s;
  const auto tick = [&](std::uint32_t cell, rt::Phase phase, double E_Pa) {
    s.tick++;
    s.t_s += 1e-3;
    s.cell = cell;
    s.phase = phase;
    s.E_fit_Pa = E_Pa;
    s.E_fit_sd_Pa = 0.1 * E_Pa;
    m.tick(s, nullptr);
  };
  tick(0, rt::Phase::indentation, 20e3);
  tick(0, rt::Phase::indentation, 30e3);
  tick(0, rt::Phase::clear, 0);
  tick(1, rt::Phase::indentation, 50e3);
  tick(2, rt::Phase::indentation, 0);
  m.finish();
  ASSERT_EQ(m.cells.size(), 3U);
  EXPECT_EQ(m.cells[0].E_fit_Pa, 30e3);
  EXPECT_EQ(m.cells[0].E_fit_sd_Pa, 3e3);
  EXPECT_EQ(m.cells[2].E_fit_Pa, 0);
  EXPECT_EQ(m.E_fit_Pa.n, 2U);
  EXPECT_NEAR(m.E_fit_Pa.mean, 40e3, 1e-6);
}

TEST(Measures, eight_hours_of_cells_take_no_more_memory_than_one) {
  const Scene scene = scene_of("icsi");
  Measures m(scene);
  rt::TelemetrySample s;
  for (std::uint32_t cell = 0; cell < 5000; ++cell) {
    for (int p = 0; p < rt::kPhases; ++p) {
      s.tick++;
      s.t_s += 1e-3;
      s.cell = cell;
      s.phase = static_cast<rt::Phase>(p);
      s.fault = p == 3 ? rt::Fault::estop : rt::Fault::none;
      m.tick(s, nullptr);
    }
  }
  m.finish();
  EXPECT_EQ(m.phase_count, 35'000U);
  EXPECT_EQ(m.cell_count, 5000U);
  EXPECT_EQ(m.cells_done, 5000U);
  EXPECT_EQ(m.fault_count, 5000U);
  EXPECT_LE(m.phases.size(), Measures::kKept);
  EXPECT_LE(m.cells.size(), Measures::kKept);
  EXPECT_LE(m.faults.size(), Measures::kKept);
}

}  // namespace
}  // namespace punctum::tools
