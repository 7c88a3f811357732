// Lies of the simulated devices, as they are read through the interfaces of hal/devices.hpp, and that they
// end. The truth is a second, healthy world beside the one that lies.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "hal/sim/failures.hpp"
#include "hal/sim/world.hpp"
#include "tools/shared/vision_lies.hpp"

namespace punctum::sim {
namespace {

using hal::Status;

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr double kFrom_s = 0.1;
constexpr double kFor_s = 0.1;

// Everything that can be read of a station on one tick.
struct AllReadings {
  std::array<Status, kDevices> status{};
  hal::HandState hand;
  hal::StageState stage;
  hal::EstopState estop;
  hal::InjectorState injector;
  hal::VacuumState vacuum;
  hal::ForceState force;
};

struct LyingStation {
  explicit LyingStation(std::optional<ScheduledFailure> lie, std::uint64_t seed = 1) {
    SimConfig config;
    config.seed = seed;
    config.holder.emplace();
    config.injector.emplace();
    config.force_sensor.emplace();
    if (lie) {
      config.failures[0] = *lie;
      config.failure_count = 1;
    }
    world.emplace(config, nullptr, 0);
  }

  AllReadings tick() {
    world->step(++k * kTick_ns);
    world->estop().heartbeat(k % 2 == 0);
    const auto put = [this](Device d, Status s) { now.status[static_cast<std::size_t>(d)] = s; };
    put(Device::hand, world->hand().read(now.hand));
    put(Device::stage, world->stage().read(now.stage));
    put(Device::estop, world->estop().read(now.estop));
    put(Device::injector, world->injector()->read(now.injector));
    put(Device::vacuum, world->vacuum()->read(now.vacuum));
    put(Device::force_sensor, world->force_sensor()->read(now.force));
    return now;
  }

  std::optional<World> world;
  std::int64_t k = 0;
  AllReadings now;
};

// Bit for bit, so that what is not a number, or minus zero, is told apart.
bool same(const AllReadings& a, const AllReadings& b) {
  const auto bits = [](const auto& x, const auto& y) { return std::memcmp(&x, &y, sizeof x) == 0; };
  return a.status == b.status && bits(a.hand.position_m, b.hand.position_m) &&
         bits(a.hand.orientation, b.hand.orientation) && a.hand.buttons == b.hand.buttons &&
         a.hand.sample_ns == b.hand.sample_ns && bits(a.stage.tip_m, b.stage.tip_m) &&
         bits(a.stage.axis, b.stage.axis) && bits(a.stage.following_error_m, b.stage.following_error_m) &&
         a.stage.enabled == b.stage.enabled && a.stage.at_standstill == b.stage.at_standstill &&
         a.stage.sample_ns == b.stage.sample_ns && a.estop.contact_a_closed == b.estop.contact_a_closed &&
         a.estop.contact_b_closed == b.estop.contact_b_closed &&
         a.estop.reset_pressed == b.estop.reset_pressed && a.estop.pulse_seen == b.estop.pulse_seen &&
         a.estop.sample_ns == b.estop.sample_ns && a.injector.open == b.injector.open &&
         a.injector.sample_ns == b.injector.sample_ns && bits(a.vacuum.pressure_Pa, b.vacuum.pressure_Pa) &&
         a.vacuum.sample_ns == b.vacuum.sample_ns && bits(a.force.axial_force_N, b.force.axial_force_N) &&
         a.force.sample_ns == b.force.sample_ns;
}

ScheduledFailure lie(Device device, Failure kind, Channel channel, double size,
                     Component which = Component::x, double every_s = 0) {
  return {device, kind, kFrom_s, kFor_s, channel, which, size, every_s};
}

// What is told on each tick of 0.3 s; the lie lasts from tick 100 to 199.
std::vector<AllReadings> told(const std::optional<ScheduledFailure>& f, std::uint64_t seed = 1) {
  LyingStation station(f, seed);
  std::vector<AllReadings> all;
  for (int k = 1; k <= 300; ++k) {
    all.push_back(station.tick());
  }
  return all;
}
std::vector<int> wrong_ticks(const std::vector<AllReadings>& told, const std::vector<AllReadings>& truth) {
  std::vector<int> wrong;
  for (std::size_t i = 0; i < told.size(); ++i) {
    if (!same(told[i], truth[i])) {
      wrong.push_back(static_cast<int>(i) + 1);
    }
  }
  return wrong;
}

TEST(Lies, every_one_that_a_device_can_tell_is_heard_and_ends) {
  const auto truth = told(std::nullopt);
  int heard = 0;
  for (int d = 0; d < static_cast<int>(Device::camera); ++d) {
    for (int k = static_cast<int>(Failure::glitch); k <= static_cast<int>(Failure::repeat); ++k) {
      for (int c = 0; c <= static_cast<int>(kLastChannel); ++c) {
        const auto device = static_cast<Device>(d);
        const auto kind = static_cast<Failure>(k);
        const auto channel = static_cast<Channel>(c);
        if (!can_concern(device, kind, channel)) {
          continue;
        }
        SCOPED_TRACE(std::to_string(d) + " " + std::to_string(k) + " " + std::to_string(c));
        std::vector<int> wrong;
        for (const double size : {0.0, 1.0, 4.0}) {
          for (const int i : wrong_ticks(told(lie(device, kind, channel, size)), truth)) {
            wrong.push_back(i);
            EXPECT_GE(i, 100);
            EXPECT_LT(i, 200);
          }
        }
        // Stuck at what never changes is the truth.
        EXPECT_TRUE(!wrong.empty() || kind == Failure::stuck);
        heard += wrong.empty() ? 0 : 1;
      }
    }
  }
  EXPECT_GT(heard, 60);
}

TEST(Lies, a_glitch_is_one_sample_of_any_size_on_any_component) {
  const auto truth = told(std::nullopt);
  for (const double size : {0.03e-3, 1e-2, -7.0, 1e308}) {
    for (const Component which : {Component::x, Component::y, Component::z}) {
      const auto heard = told(lie(Device::hand, Failure::glitch, Channel::position, size, which));
      ASSERT_EQ(wrong_ticks(heard, truth), std::vector<int>{100});
      const int i = static_cast<int>(which);
      EXPECT_EQ(heard[99].hand.position_m[i], truth[99].hand.position_m[i] + size);
      EXPECT_EQ(heard[99].hand.position_m[(i + 1) % 3], truth[99].hand.position_m[(i + 1) % 3]);
    }
  }
}

TEST(Lies, a_glitch_comes_again_with_its_period) {
  const auto truth = told(std::nullopt);
  EXPECT_EQ(
      wrong_ticks(told(lie(Device::stage, Failure::glitch, Channel::position, 1e-6, Component::x, 0.03)),
                  truth),
      (std::vector<int>{100, 130, 160, 190}));
}

TEST(Lies, a_glitch_is_told_twice_to_whoever_reads_twice) {
  LyingStation station(lie(Device::vacuum, Failure::glitch, Channel::pressure, 1000));
  for (int k = 1; k < 100; ++k) {
    (void)station.tick();
  }
  hal::VacuumState again;
  const AllReadings first = station.tick();
  ASSERT_EQ(station.world->vacuum()->read(again), Status::ok);
  EXPECT_EQ(again.pressure_Pa, first.vacuum.pressure_Pa);
  EXPECT_GT(again.pressure_Pa, 1500);
}

TEST(Lies, an_offset_stays_and_a_drift_grows) {
  const auto truth = told(std::nullopt);
  const auto offset = told(lie(Device::stage, Failure::offset, Channel::position, 5e-6, Component::y));
  const auto drift = told(lie(Device::stage, Failure::drift, Channel::position, 30e-6, Component::all));
  for (std::size_t i = 99; i < 199; ++i) {
    EXPECT_EQ(offset[i].stage.tip_m.y(), truth[i].stage.tip_m.y() + 5e-6);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(drift[i].stage.tip_m[axis] - truth[i].stage.tip_m[axis],
                  30e-6 * static_cast<double>(i - 99) * 1e-3, 1e-18);
    }
  }
}

TEST(Lies, a_stuck_sensor_goes_on_with_fresh_times) {
  const auto truth = told(std::nullopt);
  const auto one = told(lie(Device::hand, Failure::stuck, Channel::position, 0, Component::all));
  const auto all = told(lie(Device::hand, Failure::stuck, Channel::all, 0));
  for (std::size_t i = 99; i < 199; ++i) {
    EXPECT_EQ(one[i].hand.position_m, truth[99].hand.position_m);
    EXPECT_EQ(one[i].hand.orientation.coeffs(), truth[i].hand.orientation.coeffs());
    EXPECT_EQ(one[i].hand.sample_ns, truth[i].hand.sample_ns);
    EXPECT_EQ(all[i].hand.position_m, truth[99].hand.position_m);
    EXPECT_EQ(all[i].hand.sample_ns, truth[i].hand.sample_ns);
  }
  EXPECT_NE(truth[198].hand.position_m, truth[99].hand.position_m);  // it trembles
}

TEST(Lies, a_device_sampled_at_a_fraction_is_silent_or_repeats_itself_between) {
  const auto truth = told(std::nullopt);
  for (const int n : {2, 4, 8}) {
    const auto sparse = told(lie(Device::hand, Failure::sparse, Channel::none, n));
    const auto repeat = told(lie(Device::hand, Failure::repeat, Channel::none, n));
    for (std::size_t i = 99; i < 199; ++i) {
      const std::size_t newest = i - (i - 99) % static_cast<std::size_t>(n);
      EXPECT_EQ(sparse[i].status[0], newest == i ? Status::ok : Status::no_data);
      EXPECT_EQ(repeat[i].status[0], Status::ok);
      for (const auto* heard : {&sparse[i], &repeat[i]}) {  // without data the reader keeps what it has
        EXPECT_EQ(heard->hand.position_m, truth[newest].hand.position_m);
        EXPECT_EQ(heard->hand.sample_ns, truth[newest].hand.sample_ns);
      }
    }
  }
}

TEST(Lies, absurd_numbers_are_told_as_they_are) {
  for (const double absurd : {1e308, -1e308, std::numeric_limits<double>::denorm_min(), 0.0}) {
    const auto hand = told(lie(Device::hand, Failure::set, Channel::position, absurd, Component::all))[120];
    const auto turn =
        told(lie(Device::hand, Failure::set, Channel::orientation, absurd, Component::all))[120];
    const auto axis = told(lie(Device::stage, Failure::set, Channel::axis, absurd, Component::all))[120];
    const auto force = told(lie(Device::force_sensor, Failure::set, Channel::force, absurd))[120];
    EXPECT_EQ(hand.hand.position_m, Vec3::Constant(absurd));
    EXPECT_EQ(turn.hand.orientation.coeffs(), Eigen::Vector4d::Constant(absurd));
    EXPECT_EQ(axis.stage.axis, Vec3::Constant(absurd));
    EXPECT_EQ(force.force.axial_force_N, absurd);
  }
  const auto off = told(lie(Device::stage, Failure::offset, Channel::axis, 1e-3))[120];
  EXPECT_NEAR(off.stage.axis.norm(), 1 - 1e-3, 1e-12);
  const auto truth = told(std::nullopt)[120];
  const auto turned = told(lie(Device::hand, Failure::offset, Channel::orientation, 1e-3, Component::w))[120];
  EXPECT_EQ(turned.hand.orientation.w(), truth.hand.orientation.w() + 1e-3);
  EXPECT_EQ(turned.hand.orientation.x(), truth.hand.orientation.x());
}

TEST(Lies, sample_times_lie_in_the_future_go_back_or_stand_still) {
  const auto future = told(lie(Device::hand, Failure::offset, Channel::time, 3600));
  const auto back = told(lie(Device::hand, Failure::drift, Channel::time, -2));
  const auto still = told(lie(Device::hand, Failure::stuck, Channel::time, 0));
  const auto never = told(lie(Device::hand, Failure::set, Channel::time, -1e6));
  for (std::int64_t i = 99; i < 199; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const std::int64_t t_ns = (i + 1) * kTick_ns;
    EXPECT_EQ(future[at].hand.sample_ns, t_ns + 3'600'000'000'000);
    EXPECT_EQ(back[at].hand.sample_ns, t_ns - 2 * (i - 99) * kTick_ns);
    EXPECT_EQ(still[at].hand.sample_ns, 100 * kTick_ns);
    EXPECT_EQ(never[at].hand.sample_ns, -1'000'000'000'000'000);
  }
}

TEST(Lies, buttons_are_held_stuck_or_bounce) {
  const auto held = told(lie(Device::hand, Failure::set, Channel::inject, 1));
  const auto bounces = told(lie(Device::hand, Failure::flicker, Channel::clutch, 0));
  const auto once = told(lie(Device::hand, Failure::glitch, Channel::next_cell, 0));
  const auto truth = told(std::nullopt);
  int pressed = 0, edges = 0;
  for (std::size_t i = 99; i < 199; ++i) {
    EXPECT_EQ(held[i].hand.buttons, truth[i].hand.buttons | hal::kButtonInject);
    pressed += (bounces[i].hand.buttons & hal::kButtonClutch) != 0 ? 1 : 0;
    edges += bounces[i].hand.buttons != bounces[i - 1].hand.buttons ? 1 : 0;
  }
  EXPECT_NEAR(pressed, 50, 15);  // three sigma of 100 throws
  EXPECT_NEAR(edges, 50, 15);
  EXPECT_EQ(once[99].hand.buttons, truth[99].hand.buttons | hal::kButtonNextCell);
  EXPECT_EQ(once[100].hand.buttons, truth[100].hand.buttons);
}

TEST(Lies, one_seed_tells_one_story) {
  const ScheduledFailure flicker = lie(Device::estop, Failure::flicker, Channel::contact_a, 0);
  const auto at = [&](std::uint64_t seed) {
    std::vector<bool> closed;
    for (const auto& r : told(flicker, seed)) {
      closed.push_back(r.estop.contact_a_closed);
    }
    return closed;
  };
  EXPECT_EQ(at(3), at(3));
  EXPECT_NE(at(3), at(4));
}

TEST(Lies, a_press_that_a_sparse_chain_did_not_tell_is_told_later) {
  SimConfig config;
  config.estop_events[0] = {0.1021, 0.0003, true, true, false};  // between two readings
  config.estop_event_count = 1;
  config.failures[0] = lie(Device::estop, Failure::sparse, Channel::none, 8);
  config.failure_count = 1;
  World world(config, nullptr, 0);
  int pulses = 0;
  for (std::int64_t k = 1; k <= 300; ++k) {
    world.step(k * kTick_ns);
    hal::EstopState seen;
    pulses += world.estop().read(seen) == Status::ok && seen.pulse_seen ? 1 : 0;
  }
  EXPECT_EQ(pulses, 1);
}

TEST(Lies, a_live_switch_carries_the_whole_lie) {
  const SimConfig config;
  FailureSwitches live;
  const Failing glitch(Failure::glitch, Channel::position, 1e-3, Component::z, 0.5);
  live.set(Device::hand, glitch);
  EXPECT_EQ(failures_at(config, &live, 0)[0], glitch);
  live.as_scheduled(Device::hand);
  EXPECT_EQ(failures_at(config, &live, 0)[0], Failing());
  for (const std::uint64_t word : {0xFF02ULL, 0xFF'00'02ULL, 0xFFULL}) {  // no such channel, component, kind
    live.word[0].store(word);
    EXPECT_EQ(failures_at(config, &live, 0)[0], Failing());
  }
}

// ---- drives and valves that disobey ----

struct Drive {
  SimStage stage{StageParams{}};
  std::int64_t k = 0;
  bool power = true;
  bool leads = true;  // a set-point 100 um/s ahead
  hal::StageState seen;

  void run(int ticks, const Failing& failing) {
    for (int i = 0; i < ticks; ++i) {
      stage.step(++k * kTick_ns, 1e-3, power, failing);
      ASSERT_EQ(stage.read(seen), Status::ok);
      if (leads) {
        ASSERT_EQ(stage.command({seen.tip_m + Vec3(-1e-6, 0, 0), Vec3(-1, 0, 0)}), Status::ok);
      }
    }
  }
  double moves_um(int ticks, const Failing& failing) {
    const double before_m = stage.state().tip_m.x;
    run(ticks, failing);
    return (stage.state().tip_m.x - before_m) * 1e6;
  }
};

TEST(Lies, a_drive_that_ignores_quick_stop_goes_on_until_its_power_is_cut) {
  for (const bool lies : {false, true}) {
    const Failing f = lies ? Failing(Failure::ignore, Channel::quick_stop) : Failing();
    Drive d;
    d.stage.enable(true);
    d.run(50, f);
    d.stage.quick_stop();
    d.run(20, f);
    EXPECT_EQ(d.seen.enabled, lies);
    EXPECT_EQ(d.moves_um(50, f) < -1, lies);
    d.power = false;
    d.run(20, f);
    EXPECT_EQ(d.moves_um(50, f), 0);
    EXPECT_TRUE(d.seen.at_standstill);
  }
}

TEST(Lies, a_drive_that_ignores_disable_goes_on_until_its_power_is_cut) {
  for (const bool lies : {false, true}) {
    const Failing f = lies ? Failing(Failure::ignore, Channel::disable) : Failing();
    Drive d;
    d.stage.enable(true);
    d.run(50, f);
    d.stage.enable(false);
    d.run(20, f);
    EXPECT_EQ(d.seen.enabled, lies);
    EXPECT_EQ(d.moves_um(50, f) < -1, lies);
    d.power = false;
    d.run(20, f);
    EXPECT_EQ(d.moves_um(50, f), 0);
  }
}

TEST(Lies, a_drive_that_ignores_enable_never_says_enabled) {
  Drive d;
  d.run(10, Failing(Failure::ignore, Channel::enable));
  d.stage.enable(true);
  EXPECT_EQ(d.moves_um(100, Failing(Failure::ignore, Channel::enable)), 0);
  EXPECT_FALSE(d.seen.enabled);
  d.run(10, {});
  d.stage.enable(true);
  d.run(10, {});
  EXPECT_TRUE(d.seen.enabled);
}

TEST(Lies, a_drive_that_creeps_moves_after_a_stop_as_long_as_it_has_power) {
  const Failing f(Failure::creep, Channel::none, -20e-6, Component::x);
  Drive d;
  d.stage.enable(true);
  EXPECT_LT(d.moves_um(50, f), -1);  // it follows as it should
  d.stage.quick_stop();
  d.run(20, f);
  EXPECT_NEAR(d.moves_um(1000, f), -20, 1e-9);
  EXPECT_FALSE(d.seen.at_standstill);
  EXPECT_FALSE(d.seen.enabled);
  d.power = false;
  d.run(20, f);
  EXPECT_EQ(d.moves_um(1000, f), 0);
  d.power = true;
  d.run(20, f);
  EXPECT_NEAR(d.moves_um(100, f), -2, 1e-9);
  d.run(20, {});
  EXPECT_EQ(d.moves_um(100, {}), 0);
}

TEST(Lies, a_valve_that_ignores_its_gate_stays_as_it_was_until_its_power_is_cut) {
  const Failing f(Failure::ignore, Channel::gate);
  SimInjector valve(InjectorParams{});
  std::int64_t t_ns = 0;
  const auto open_after = [&](int ticks, bool power, const Failing& now) {
    for (int i = 0; i < ticks; ++i) {
      valve.step(t_ns += kTick_ns, 1e-3, power, now);
    }
    hal::InjectorState seen;
    EXPECT_EQ(valve.read(seen), Status::ok);
    return seen.open;
  };
  valve.gate(true);
  EXPECT_TRUE(open_after(100, true, {}));
  (void)open_after(1, true, f);
  valve.gate(false);
  EXPECT_TRUE(open_after(100, true, f));
  EXPECT_FALSE(open_after(100, false, f));
}

// ---- vision ----

rt::Observation seen_at(std::int64_t frame) {
  rt::Observation o;
  o.frame = static_cast<std::uint64_t>(frame);
  o.exposure_ns = frame * 40 * kTick_ns;
  o.flags = rt::Observation::tip_ok | rt::Observation::outer_ok;
  o.tip_m[0] = 50e-6 - 1e-6 * static_cast<double>(frame);
  o.entry_m[0] = 20e-6;
  o.gap_m = o.tip_m[0] - o.entry_m[0];
  o.R_m = 60e-6;
  return o;
}

// Twenty frames; the lie is told on frames 5 to 14.
std::vector<std::optional<rt::Observation>> vision_says(const Failing& failing) {
  tools::VisionLiar liar(1);
  std::vector<std::optional<rt::Observation>> all;
  for (std::int64_t i = 0; i < 20; ++i) {
    Snapshot s;
    s.failure[static_cast<std::size_t>(Device::vision)] = i >= 5 && i < 15 ? failing : Failing();
    all.push_back(liar.tell(s, seen_at(i)));
  }
  return all;
}

TEST(LiesOfVision, end) {
  for (int k = static_cast<int>(Failure::glitch); k <= static_cast<int>(Failure::repeat); ++k) {
    for (int c = 0; c <= static_cast<int>(kLastChannel); ++c) {
      const Failing failing(static_cast<Failure>(k), static_cast<Channel>(c), 3);
      if (!can_concern(Device::vision, failing.kind, failing.channel)) {
        continue;
      }
      const auto all = vision_says(failing);
      bool lied = false;
      for (std::int64_t i = 0; i < 20; ++i) {
        const auto& o = all[static_cast<std::size_t>(i)];
        const rt::Observation truth = seen_at(i);
        const bool honest = o && std::memcmp(&*o, &truth, sizeof truth) == 0;
        EXPECT_TRUE(honest || (i >= 5 && i < 15)) << k << " " << c << " frame " << i;
        lied = lied || !honest;
      }
      EXPECT_TRUE(lied || failing.kind == Failure::stuck) << k << " " << c;
    }
  }
}

TEST(LiesOfVision, the_entry_recedes_and_the_gap_grows_with_it) {
  const auto all = vision_says({Failure::drift, Channel::entry, -30e-6, Component::x});
  for (std::size_t i = 5; i < 15; ++i) {
    const double receded_m = 30e-6 * 0.04 * static_cast<double>(i - 5);
    const rt::Observation truth = seen_at(static_cast<std::int64_t>(i));
    EXPECT_NEAR(all[i]->entry_m[0], truth.entry_m[0] - receded_m, 1e-18);
    EXPECT_NEAR(all[i]->gap_m, truth.gap_m + receded_m, 1e-18);
    EXPECT_EQ(all[i]->tip_m[0], truth.tip_m[0]);
  }
}

TEST(LiesOfVision, the_whole_cell_goes_away) {
  const auto all = vision_says({Failure::drift, Channel::cell, -30e-6, Component::x});
  for (std::size_t i = 5; i < 15; ++i) {
    const double gone_m = 30e-6 * 0.04 * static_cast<double>(i - 5);
    const rt::Observation truth = seen_at(static_cast<std::int64_t>(i));
    EXPECT_NEAR(all[i]->centre_m[0], truth.centre_m[0] - gone_m, 1e-18);
    EXPECT_NEAR(all[i]->entry_m[0], truth.entry_m[0] - gone_m, 1e-18);
    EXPECT_NEAR(all[i]->gap_m, truth.gap_m + gone_m, 1e-18);
  }
}

TEST(LiesOfVision, the_cell_grows) {
  const auto all = vision_says({Failure::drift, Channel::radius, 5e-6});
  EXPECT_EQ(all[5]->R_m, 60e-6);
  EXPECT_NEAR(all[14]->R_m, 60e-6 + 9 * 0.04 * 5e-6, 1e-18);
}

TEST(LiesOfVision, one_frame_says_punctured) {
  const auto all = vision_says({Failure::glitch, Channel::punctured});
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(all[i]->has(rt::Observation::punctured), i == 5);
  }
}

TEST(LiesOfVision, one_frame_says_that_the_inner_membrane_is_through) {
  const auto all = vision_says({Failure::glitch, Channel::inner_punctured});
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(all[i]->has(rt::Observation::inner_punctured), i == 5);
    EXPECT_FALSE(all[i]->has(rt::Observation::punctured));
  }
}

TEST(LiesOfVision, contact_flickers) {
  const auto all = vision_says({Failure::flicker, Channel::contact});
  int contacts = 0;
  for (const auto& o : all) {
    contacts += o->has(rt::Observation::contact) ? 1 : 0;
  }
  EXPECT_GT(contacts, 0);
  EXPECT_LT(contacts, 10);
}

TEST(LiesOfVision, exposures_lie_in_the_future) {
  const auto all = vision_says({Failure::offset, Channel::time, 0.5});
  EXPECT_EQ(all[7]->exposure_ns, seen_at(7).exposure_ns + 500'000'000);
}

TEST(LiesOfVision, one_observation_comes_again_as_if_it_were_new) {
  const auto all = vision_says({Failure::stuck, Channel::all});
  for (std::size_t i = 5; i < 15; ++i) {
    EXPECT_EQ(all[i]->tip_m[0], seen_at(5).tip_m[0]);
    EXPECT_EQ(all[i]->frame, i);
    EXPECT_EQ(all[i]->exposure_ns, seen_at(static_cast<std::int64_t>(i)).exposure_ns);
  }
}

TEST(LiesOfVision, one_observation_comes_again_with_its_own_time_and_number) {
  const auto all = vision_says({Failure::repeat, Channel::none, 4});
  EXPECT_EQ(all[8]->frame, 5U);
  EXPECT_EQ(all[8]->exposure_ns, seen_at(5).exposure_ns);
  EXPECT_EQ(all[9]->frame, 9U);
}

}  // namespace
}  // namespace punctum::sim
