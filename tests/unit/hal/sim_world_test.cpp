#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "hal/frames.hpp"
#include "hal/sim/truth.hpp"
#include "hal/sim/world.hpp"
#include "rt/platform/allocation_trap.hpp"

namespace punctum::sim {
namespace {

constexpr std::int64_t kTick_ns = 1'000'000;

SimConfig whole_station() {
  SimConfig c;
  c.cell.emplace();
  c.holder.emplace();
  c.injector.emplace();
  c.force_sensor.emplace();
  c.microscope.emplace();
  return c;
}

// The least core that closes the loop: filtered hand to stage, membrane force and damping to the hand.
class LeastCore {
 public:
  LeastCore(const SimConfig& config, World& world) : config_(config), world_(world) {}

  void tick() {
    world_.estop().heartbeat(beat_ = !beat_);
    hal::HandState hand;
    hal::StageState stage;
    if (world_.hand().read(hand) != hal::Status::ok || world_.stage().read(stage) != hal::Status::ok) {
      return;
    }
    if (first_) {
      world_.stage().enable(true);
    }
    const bool clutched = (hand.buttons & hal::kButtonClutch) != 0;
    if (first_ || clutched || was_clutched_) {
      hand_anchor_ = hand.position_m;
      stage_anchor_ = stage.tip_m;
      filtered_[0] = filtered_[1] = hand.position_m;
      last_ = first_ ? hand.position_m : last_;
    }
    first_ = false;
    was_clutched_ = clutched;
    const double part = 1 - std::exp(-0.001 * 2 * 3.14159 * 3);
    filtered_[0] += part * (hand.position_m - filtered_[0]);
    filtered_[1] += part * (filtered_[0] - filtered_[1]);
    const Vec3 goal = stage_anchor_ + world_from_hand(filtered_[1] - hand_anchor_) / config_.position_scale;
    if (!frozen) {
      (void)world_.stage().command({goal, config_.stage.axis});
    }
    velocity_ += 0.17 * ((hand.position_m - last_) / 0.001 - velocity_);
    last_ = hand.position_m;
    const Truth truth = truth_of(config_, world_.snapshot());
    const Vec3 membrane = -1e5 * world_.snapshot().cell_reading.membrane_N * hand_from_world(truth.axis);
    (void)world_.hand().write_force(membrane - (truth.punctured ? 4.0 : 1.0) * velocity_);
    if (world_.injector() != nullptr) {
      world_.injector()->gate((hand.buttons & hal::kButtonInject) != 0);
    }
  }

  bool frozen = false;

 private:
  const SimConfig& config_;
  World& world_;
  bool beat_ = false;
  bool first_ = true;
  bool was_clutched_ = false;
  Vec3 filtered_[2] = {Vec3::Zero(), Vec3::Zero()};
  Vec3 hand_anchor_ = Vec3::Zero(), stage_anchor_ = Vec3::Zero(), last_ = Vec3::Zero();
  Vec3 velocity_ = Vec3::Zero();
};

// Steps and calls `each` after every tick, until it returns false.
template <typename Each>
void work(const SimConfig& config, World& world, double most_s, Each each) {
  LeastCore core(config, world);
  const std::int64_t start = world.snapshot().t_ns;
  for (std::int64_t t = kTick_ns; t <= to_ns(most_s); t += kTick_ns) {
    world.step(start + t);
    core.tick();
    if (!each(world.snapshot(), core)) {
      return;
    }
  }
}

TEST(World, takes_an_injection_from_start_to_end) {
  SimConfig config = whole_station();
  config.seed = 2;
  const auto world = std::make_unique<World>(config, nullptr, 0);
  Truth last;
  double deepest = 0;
  double peak_N = 0;
  std::vector<Activity> done;
  work(config, *world, 60, [&](const Snapshot& s, LeastCore&) {
    last = truth_of(config, s);
    deepest = std::max(deepest, -last.gap_m);
    peak_N = std::max(peak_N, last.axial_force_N);
    if (done.empty() || done.back() != s.operator_state.activity) {
      done.push_back(s.operator_state.activity);
    }
    return s.operator_state.activity != Activity::rest;
  });
  const std::vector<Activity> expected = {Activity::settle,  Activity::approach, Activity::indent,
                                          Activity::push_on, Activity::inject,   Activity::withdraw,
                                          Activity::rest};
  EXPECT_EQ(done, expected);
  EXPECT_TRUE(last.punctured);
  EXPECT_GT(last.puncture_s, 4);
  EXPECT_FALSE(last.lost);
  EXPECT_GT(last.gap_m, 20e-6);
  EXPECT_GT(deepest, 30e-6);
  EXPECT_LT(deepest, 80e-6);
  EXPECT_GT(peak_N, 0.5e-6);
  EXPECT_NEAR(world->snapshot().injector.delivered_s, config.operator_params.dwell_s, 0.01);
}

TEST(World, is_the_same_for_the_same_seed_and_another_for_another) {
  const auto run = [](std::uint64_t seed) {
    SimConfig config = whole_station();
    config.seed = seed;
    const auto world = std::make_unique<World>(config, nullptr, 0);
    std::vector<double> trace;
    work(config, *world, 12, [&](const Snapshot& s, LeastCore&) {
      for (const double x : {s.hand.position_m.x, s.hand.velocity_m_s.z, s.stage.tip_m.y,
                             s.cell_reading.membrane_N, s.force_sensor.reading_N, s.vacuum.reading_Pa}) {
        trace.push_back(x);
      }
      return true;
    });
    return trace;
  };
  const std::vector<double> a = run(5);
  const std::vector<double> b = run(5);
  const std::vector<double> c = run(6);
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(double)), 0);
  EXPECT_NE(std::memcmp(a.data(), c.data(), a.size() * sizeof(double)), 0);
}

TEST(World, goes_on_from_a_snapshot_as_if_it_had_never_stopped) {
  SimConfig config = whole_station();
  config.seed = 3;
  const auto one = std::make_unique<World>(config, nullptr, 1000);
  LeastCore core(config, *one);
  for (std::int64_t k = 1; k <= 9000; ++k) {
    one->step(1000 + k * kTick_ns);
    core.tick();
  }
  const auto two = std::make_unique<World>(config, nullptr, 0);
  one->step(1000 + 9001 * kTick_ns);  // the last commands are in this snapshot
  two->restore(one->snapshot());
  for (std::int64_t k = 9002; k <= 12'000; ++k) {  // nobody commands any more
    one->step(1000 + k * kTick_ns);
    two->step(1000 + k * kTick_ns);
    const Snapshot& a = one->snapshot();
    const Snapshot& b = two->snapshot();
    ASSERT_EQ(Vec3(a.hand.position_m), Vec3(b.hand.position_m)) << k;
    ASSERT_EQ(Vec3(a.stage.tip_m), Vec3(b.stage.tip_m)) << k;
    ASSERT_EQ(a.cell_reading.membrane_N, b.cell_reading.membrane_N) << k;
    ASSERT_EQ(a.force_sensor.reading_N, b.force_sensor.reading_N) << k;
    ASSERT_EQ(a.estop.relay_closed, b.estop.relay_closed) << k;
  }
}

TEST(World, neither_allocates_nor_grows_in_a_tick) {
  SimConfig config = whole_station();
  config.cells = 2;
  const auto bench = std::make_unique<Bench>();
  const auto world = std::make_unique<World>(config, bench.get(), 0);
  LeastCore core(config, *world);
  world->step(kTick_ns);
  core.tick();
  rt::allocation_trap::arm(rt::allocation_trap::On::allocation_count);
  for (std::int64_t k = 2; k <= 40'000; ++k) {
    world->step(k * kTick_ns);
    core.tick();
  }
  EXPECT_EQ(rt::allocation_trap::disarm(), 0U);
  EXPECT_EQ(bench->snapshots.head(), 40'000U);
}

TEST(World, may_have_its_first_tick_at_the_start_itself) {
  const SimConfig config = whole_station();
  const auto bench = std::make_unique<Bench>();
  World world(config, bench.get(), 7 * kTick_ns);
  world.step(7 * kTick_ns);
  EXPECT_EQ(world.snapshot().tick, 1U);
  EXPECT_EQ(bench->exposed.load(), 1U);
  hal::HandState hand;
  hal::StageState stage;
  hal::EstopState chain;
  EXPECT_EQ(world.hand().read(hand), hal::Status::ok);
  EXPECT_EQ(world.stage().read(stage), hal::Status::ok);
  EXPECT_EQ(world.estop().read(chain), hal::Status::ok);
  world.step(7 * kTick_ns);  // no time has passed
  world.step(6 * kTick_ns);
  EXPECT_EQ(bench->snapshots.head(), 1U);
}

TEST(World, exposes_at_the_first_tick_of_each_frames_time) {
  SimConfig config = whole_station();
  config.microscope->fps = 30;
  const auto bench = std::make_unique<Bench>();
  const auto world = std::make_unique<World>(config, bench.get(), 0);
  std::uint64_t frames = 0;
  for (std::int64_t k = 1; k <= 1000; ++k) {
    world->step(k * kTick_ns);
    if (bench->exposed.load() > frames) {
      Exposure e;
      ASSERT_EQ(bench->exposures.read(frames, e), hal::Read::ok);
      EXPECT_EQ(e.frame, frames);
      EXPECT_EQ(e.exposure_ns, k * kTick_ns);
      EXPECT_GE(e.exposure_ns, static_cast<std::int64_t>(frames) * 33'333'333);
      if (frames > 0) {
        EXPECT_LT(e.exposure_ns - kTick_ns, static_cast<std::int64_t>(frames) * 33'333'333);
      }
      EXPECT_EQ(e.world.t_ns, e.exposure_ns);
      EXPECT_EQ(e.deliver_ns, 0);
      ++frames;
    }
  }
  EXPECT_EQ(frames, 31U);  // 0 .. 30
}

TEST(World, skips_frames_instead_of_bursting_after_a_long_halt) {
  SimConfig config = whole_station();
  const auto bench = std::make_unique<Bench>();
  const auto world = std::make_unique<World>(config, bench.get(), 0);
  world->step(kTick_ns);
  world->step(3600'000 * kTick_ns);
  EXPECT_EQ(bench->exposed.load(), 2U);
  EXPECT_EQ(bench->snapshots.head(), 2U);
  EXPECT_TRUE(std::isfinite(world->snapshot().hand.position_m.x));
}

TEST(World, puts_the_next_cell_on_the_button_when_the_needle_is_out) {
  SimConfig config = whole_station();
  config.cells = 2;
  const auto world = std::make_unique<World>(config, nullptr, 0);
  double first_R = world->snapshot().cell_reading.R_m;
  bool punctured_again = false;
  work(config, *world, 120, [&](const Snapshot& s, LeastCore&) {
    if (s.cell_index == 1 && truth_of(config, s).punctured) {
      punctured_again = true;
    }
    if (s.cell_index == 0) {
      first_R = s.cell_reading.R_m;
    }
    return s.operator_state.activity != Activity::rest;
  });
  EXPECT_EQ(world->snapshot().cell_index, 1U);
  EXPECT_NE(world->snapshot().cell_reading.R_m, first_R);  // another individual
  EXPECT_TRUE(punctured_again);
}

TEST(World, lets_the_operator_start_over_when_the_needle_was_refused_for_a_while) {
  SimConfig config = whole_station();
  config.seed = 4;
  const auto world = std::make_unique<World>(config, nullptr, 0);
  bool withdrew = false;
  std::int64_t indents_ns = 0;
  work(config, *world, 90, [&](const Snapshot& s, LeastCore& core) {
    if (s.operator_state.activity == Activity::indent && indents_ns == 0) {
      indents_ns = s.t_ns;
    }
    // Inward motion is refused for five seconds of the indentation.
    core.frozen = indents_ns != 0 && s.t_ns > indents_ns + to_ns(2) && s.t_ns < indents_ns + to_ns(7);
    if (core.frozen && s.operator_state.activity == Activity::withdraw) {
      withdrew = true;
    }
    return s.operator_state.activity != Activity::rest;
  });
  EXPECT_TRUE(withdrew);
  EXPECT_EQ(world->snapshot().operator_state.activity, Activity::rest);
  EXPECT_TRUE(truth_of(config, world->snapshot()).punctured);
  EXPECT_EQ(world->snapshot().operator_state.given_up, 0U);
}

TEST(World, runs_without_what_the_scene_leaves_out) {
  const SimConfig config;  // no cell, holder, injector, sensor, microscope
  const auto bench = std::make_unique<Bench>();
  const auto world = std::make_unique<World>(config, bench.get(), 0);
  EXPECT_EQ(world->injector(), nullptr);
  EXPECT_EQ(world->vacuum(), nullptr);
  EXPECT_EQ(world->force_sensor(), nullptr);
  double least = 0;
  work(config, *world, 10, [&](const Snapshot& s, LeastCore&) {
    least = std::min(least, s.hand.position_m.x);
    return true;
  });
  EXPECT_LT(least, -0.02);  // strokes
  EXPECT_EQ(bench->exposed.load(), 0U);
  EXPECT_FALSE(truth_of(config, world->snapshot()).cell);
}

TEST(World, stamps_every_reading_with_the_time_of_its_step) {
  const SimConfig config = whole_station();
  World world(config, nullptr, 5000);
  for (const std::int64_t t : {5000 + kTick_ns, 5000 + 2 * kTick_ns, 5000 + 9 * kTick_ns}) {
    world.step(t);
    hal::HandState hand;
    hal::StageState stage;
    hal::EstopState chain;
    hal::InjectorState injector;
    hal::VacuumState vacuum;
    hal::ForceState force;
    ASSERT_EQ(world.hand().read(hand), hal::Status::ok);
    ASSERT_EQ(world.stage().read(stage), hal::Status::ok);
    ASSERT_EQ(world.estop().read(chain), hal::Status::ok);
    ASSERT_EQ(world.injector()->read(injector), hal::Status::ok);
    ASSERT_EQ(world.vacuum()->read(vacuum), hal::Status::ok);
    ASSERT_EQ(world.force_sensor()->read(force), hal::Status::ok);
    for (const std::int64_t sample_ns : {hand.sample_ns, stage.sample_ns, chain.sample_ns, injector.sample_ns,
                                         vacuum.sample_ns, force.sample_ns}) {
      EXPECT_EQ(sample_ns, t);
    }
  }
}

// Some devices real: the plant is told where they are, or does without.

SimulatedParts all_but(bool SimulatedParts::* part) {
  SimulatedParts parts;
  parts.*part = false;
  return parts;
}

hal::StageState stage_at(const Vec3& tip_m) {
  hal::StageState s;
  s.tip_m = tip_m;
  s.enabled = true;
  return s;
}

TEST(MixedWorld, runs_with_every_choice_of_real_devices) {
  const SimConfig config = whole_station();
  for (unsigned mask = 0; mask < 64; ++mask) {
    SimulatedParts parts;
    parts.hand = (mask & 1U) != 0;
    parts.stage = (mask & 2U) != 0;
    parts.estop = (mask & 4U) != 0;
    parts.injector = (mask & 8U) != 0;
    parts.vacuum = (mask & 16U) != 0;
    parts.force_sensor = (mask & 32U) != 0;
    World world(config, nullptr, parts);
    EXPECT_EQ(world.injector() != nullptr, parts.injector);
    EXPECT_EQ(world.vacuum() != nullptr, parts.vacuum);
    EXPECT_EQ(world.force_sensor() != nullptr, parts.force_sensor);
    world.begin(0);
    for (std::int64_t k = 1; k <= 200; ++k) {
      world.step(k * kTick_ns);
      if (k > 50) {  // a real device is read some time after the start
        if (!parts.hand) {
          world.follow_hand({});
        }
        if (!parts.stage) {
          world.follow_stage(stage_at(config.stage.start_m + Vec3(-1e-9 * static_cast<double>(k), 0, 0)));
        }
      }
    }
    const Snapshot& s = world.snapshot();
    EXPECT_TRUE(s.hand.position_m.vec().allFinite() && s.stage.tip_m.vec().allFinite()) << mask;
    EXPECT_FALSE(truth_of(config, s).lost) << mask;
  }
}

TEST(MixedWorld, dents_the_simulated_cell_with_a_real_stage) {
  SimConfig config = whole_station();
  config.cell->spread = 0;
  World world(config, nullptr, all_but(&SimulatedParts::stage));
  world.begin(0);
  const double entry_x = config.cell->centre_m.x() + config.cell->R_m;
  for (std::int64_t k = 1; k <= 1000; ++k) {  // straight in, to 10 um of depth
    const Vec3 tip(entry_x + 20e-6 - 30e-9 * static_cast<double>(k), 0, 0);
    world.follow_stage(stage_at(tip + config.stage.registration_m));
    world.step(k * kTick_ns);
  }
  const Truth truth = truth_of(config, world.snapshot());
  EXPECT_NEAR(truth.tip_m.x(), entry_x - 10e-6, 1e-12);
  EXPECT_TRUE(truth.contact);
  EXPECT_NEAR(truth.wd_m, 10e-6, 1e-9);
  EXPECT_GT(truth.axial_force_N, 0.1e-6);
  EXPECT_NEAR(world.snapshot().stage.velocity_m_s.x, -30e-6, 1e-9);
}

TEST(MixedWorld, takes_the_first_reading_of_a_real_stage_as_a_place_and_not_as_a_motion) {
  const SimConfig config = whole_station();
  World world(config, nullptr, all_but(&SimulatedParts::stage));
  world.begin(0);
  world.step(kTick_ns);
  world.follow_stage(stage_at(Vec3(-100e-6, -80e-6, 0)));  // beside the cell
  world.step(2 * kTick_ns);
  EXPECT_EQ(world.snapshot().stage.velocity_m_s.vec().norm(), 0);
  EXPECT_FALSE(truth_of(config, world.snapshot()).contact);
  EXPECT_EQ(world.snapshot().cell_reading.force_N.vec().norm(), 0);
}

TEST(MixedWorld, leaves_a_real_handle_to_its_operator_and_hears_its_buttons) {
  SimConfig config = whole_station();
  World world(config, nullptr, all_but(&SimulatedParts::hand));
  world.begin(0);
  hal::HandState hand;
  hand.position_m = Vec3(0.01, -0.02, 0.03);
  for (std::int64_t k = 1; k <= 8000; ++k) {
    hand.buttons = k > 100 && k < 200 ? hal::kButtonNextCell : 0U;
    world.follow_hand(hand);
    world.step(k * kTick_ns);
  }
  EXPECT_EQ(Vec3(world.snapshot().hand.position_m), hand.position_m);
  EXPECT_EQ(world.snapshot().operator_state.activity, Activity::settle);
  EXPECT_EQ(world.snapshot().cell_index, 1U);
}

TEST(MixedWorld, powers_the_simulated_drives_when_the_estop_chain_is_real) {
  const SimConfig config = whole_station();
  World world(config, nullptr, all_but(&SimulatedParts::estop));
  world.begin(0);
  world.stage().enable(true);
  world.step(kTick_ns);
  world.step(2 * kTick_ns);
  hal::StageState stage;
  ASSERT_EQ(world.stage().read(stage), hal::Status::ok);
  EXPECT_TRUE(stage.enabled);
  EXPECT_FALSE(run_unattended(config, world.snapshot(), nullptr, 0.5).last.stage.powered);
}

TEST(World, lets_the_operator_press_reset_when_the_relay_has_opened) {
  for (const double silent_from_s : {0.0, 2.0}) {  // before the drives ever had power, and in motion
    const SimConfig config = whole_station();
    World world(config, nullptr);
    world.begin(0);
    bool beat = false;
    bool lost = false;
    double back_s = 0;
    for (std::int64_t tick = 1; tick <= 8000 && back_s == 0; ++tick) {
      world.step(tick * kTick_ns);
      const double t_s = 0.001 * static_cast<double>(tick);
      if (t_s < silent_from_s + 0.01 || t_s > silent_from_s + 0.1) {
        world.estop().heartbeat(beat = !beat);
      }
      hal::HandState hand;
      ASSERT_EQ(world.hand().read(hand), hal::Status::ok);
      world.stage().enable((hand.buttons & hal::kButtonEnable) != 0);
      lost = lost || (t_s > silent_from_s + 0.1 && world.snapshot().stage.powered == 0);
      back_s = lost && world.snapshot().stage.powered != 0 ? t_s : 0;
    }
    EXPECT_TRUE(lost) << silent_from_s;
    EXPECT_GT(back_s, silent_from_s + 1);
    EXPECT_LT(back_s, silent_from_s + 4);
  }
}

TEST(World, creates_no_energy_at_the_handle) {
  // Arm and tremor off: what the handle has, the amplifier has done.
  SimConfig config;
  config.operator_params.arm_stiffness_N_m = 0;
  config.operator_params.arm_damping_Ns_m = 0;
  const auto world = std::make_unique<World>(config, nullptr, 0);
  const Noise noise(1, Noise::Stream::free_use);
  for (std::int64_t k = 1; k <= 5000; ++k) {
    world->step(k * kTick_ns);
    world->estop().heartbeat(k % 2 == 0);
    const auto n = static_cast<std::uint64_t>(3 * k);
    (void)world->hand().write_force(Vec3(noise.gaussian(n), noise.gaussian(n + 1), noise.gaussian(n + 2)));
    const double kinetic_J =
        0.5 * config.hand.mass_kg * world->snapshot().hand.velocity_m_s.vec().squaredNorm();
    ASSERT_LE(kinetic_J, world->snapshot().hand.work_J + 1e-12);
  }
}

TEST(Unattended, comes_to_the_safe_state_by_itself) {
  SimConfig config = whole_station();
  config.seed = 2;
  const auto bench = std::make_unique<Bench>();
  {
    const auto world = std::make_unique<World>(config, bench.get(), 0);
    bool injecting = false;
    work(config, *world, 60, [&](const Snapshot& s, LeastCore&) {
      injecting = s.injector.opening > 0.9;  // dies with the gate open and the needle inside
      return !injecting;
    });
    ASSERT_TRUE(injecting);
  }
  const UnattendedEnd end = run_unattended(config, *bench, 1.0);
  EXPECT_TRUE(end.safe);
  EXPECT_GT(end.relay_opened_s, 0.045);
  EXPECT_LE(end.relay_opened_s, 0.055);
  EXPECT_LT(end.stage_at_rest_s, 0.1);
  EXPECT_LT(end.gate_shut_s, 0.2);
  EXPECT_LT(end.hand_force_off_s, 0.06);
  EXPECT_LT(end.stage_moved_m, 10e-6);
  EXPECT_TRUE(end.vacuum_kept);
  EXPECT_TRUE(end.cell_held);
  EXPECT_EQ(end.last.injector.gate, 1U);  // nobody shut it: the relay did
  EXPECT_EQ(bench->finished.load(), 1U);
}

TEST(Unattended, says_so_when_there_was_no_tick) {
  const auto bench = std::make_unique<Bench>();
  EXPECT_FALSE(run_unattended(SimConfig{}, *bench, 1.0).safe);
}

TEST(Truth, reads_what_geometry_says_before_contact) {
  SimConfig config = whole_station();
  config.cell->spread = 0;
  config.stage.start_m = Vec3(90e-6, 12e-6, 0);
  const World world(config, nullptr, 0);
  const Truth t = truth_of(config, world.snapshot());
  ASSERT_TRUE(t.cell);
  EXPECT_FALSE(t.contact);
  EXPECT_NEAR((t.centre_m - config.cell->centre_m).norm(), 0, 1e-12);
  EXPECT_NEAR(t.R_m, 60e-6, 1e-12);
  EXPECT_NEAR(t.lateral_m, 12e-6, 1e-12);
  const double x = -40e-6 + std::sqrt(60e-6 * 60e-6 - 12e-6 * 12e-6);
  EXPECT_NEAR(t.entry_m.x(), x, 1e-12);
  EXPECT_NEAR(t.entry_m.y(), 12e-6, 1e-12);
  EXPECT_NEAR(t.gap_m, 90e-6 - x, 1e-12);
  EXPECT_EQ(t.wd_m, 0);
  EXPECT_EQ(t.axial_force_N, 0);
  EXPECT_FALSE(t.punctured);
  EXPECT_LT(t.puncture_s, 0);
}

TEST(Truth, holder_touches_the_cell_from_the_left_like_the_cell_says) {
  SimConfig config = whole_station();
  config.holder->drop_m = 5e-6;
  const Cell cell(*config.cell, config.needle, config.holder, config.seed, 0);
  ASSERT_TRUE(holder_mouth(config).has_value());
  EXPECT_NEAR((*holder_mouth(config) - cell.holder_mouth_m()).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace punctum::sim
