#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "hal/sim/failures.hpp"
#include "hal/sim/plant/estop.hpp"
#include "hal/sim/plant/force_sensor.hpp"
#include "hal/sim/plant/hand.hpp"
#include "hal/sim/plant/injector.hpp"
#include "hal/sim/plant/stage.hpp"
#include "hal/sim/plant/vacuum.hpp"

namespace punctum::sim {
namespace {

using hal::Status;

// What is read of a device whose truth runs through 0, 1, 2, ... while it fails from the tenth reading on.
struct Reads {
  Status status{};
  double value = 0;
  std::int64_t sample_ns = 0;
};
Reads read_counter(Failure failure, int good, int failing) {
  FailingReader<double> reader;
  int k = 0;
  for (; k < good; ++k) {
    reader.push(k * 1'000'000, k, Failure::none);
  }
  for (int i = 0; i < failing; ++i, ++k) {
    reader.push(k * 1'000'000, k, failure);
  }
  Sample<double> sample;
  const Status status = reader.read(sample);
  return {status, sample.reading, sample.sample_ns};
}

TEST(Failures, freeze_repeats_the_last_good_reading) {
  EXPECT_EQ(read_counter(Failure::freeze, 10, 5).status, Status::ok);
  EXPECT_EQ(read_counter(Failure::freeze, 10, 5).value, 9);
}
TEST(Failures, freeze_and_delay_keep_the_time_of_the_reading) {
  EXPECT_EQ(read_counter(Failure::none, 10, 5).sample_ns, 14'000'000);
  EXPECT_EQ(read_counter(Failure::freeze, 10, 5).sample_ns, 9'000'000);
  EXPECT_EQ(read_counter(Failure::delay, 100, 1).sample_ns, 80'000'000);
}
TEST(Failures, drop_is_silence) { EXPECT_EQ(read_counter(Failure::drop, 10, 1).status, Status::no_data); }
TEST(Failures, delay_shows_the_past) {
  EXPECT_EQ(read_counter(Failure::delay, 100, 1).value, 80);  // 20 ms at 1 kHz before the hundredth
  EXPECT_EQ(read_counter(Failure::delay, 5, 1).value, 0);     // nothing older is known
}
TEST(Failures, disconnect_says_so) {
  EXPECT_EQ(read_counter(Failure::disconnect, 10, 1).status, Status::disconnected);
}
TEST(Failures, nothing_is_read_before_the_first_tick) {
  FailingReader<double> reader;
  Sample<double> sample;
  EXPECT_EQ(reader.read(sample), Status::no_data);
}

TEST(Failures, come_and_go_as_scheduled) {
  SimConfig config;
  config.failures[0] = {Device::stage, Failure::freeze, 2.0, 1.0};
  config.failures[1] = {Device::hand, Failure::nan, 5.0, 0};
  config.failure_count = 2;
  const auto of = [&](Device d, double t) {
    return failures_at(config, nullptr, t)[static_cast<std::size_t>(d)];
  };
  EXPECT_EQ(of(Device::stage, 1.999), Failure::none);
  EXPECT_EQ(of(Device::stage, 2.0), Failure::freeze);
  EXPECT_EQ(of(Device::stage, 3.0), Failure::none);
  EXPECT_EQ(of(Device::hand, 4.9), Failure::none);
  EXPECT_EQ(of(Device::hand, 5000), Failure::nan);
}

TEST(Failures, a_live_switch_overrules_the_schedule) {
  SimConfig config;
  config.failures[0] = {Device::stage, Failure::freeze, 0, 0};
  config.failure_count = 1;
  FailureSwitches live;
  const auto stage = [&] { return failures_at(config, &live, 1)[static_cast<std::size_t>(Device::stage)]; };
  EXPECT_EQ(stage(), Failure::freeze);
  live.set(Device::stage, Failure::none);
  EXPECT_EQ(stage(), Failure::none);
  live.set(Device::stage, Failure::disconnect);
  EXPECT_EQ(stage(), Failure::disconnect);
  live.as_scheduled(Device::stage);
  EXPECT_EQ(stage(), Failure::freeze);
  live.word[static_cast<std::size_t>(Device::stage)].store(999);
  EXPECT_EQ(stage(), Failure::freeze);
}

constexpr Failure kAll[] = {Failure::none, Failure::freeze,     Failure::drop,     Failure::delay,
                            Failure::nan,  Failure::disconnect, Failure::saturate, Failure::noise};

// The status every device gives while it fails; no-number means a fault where there are only yes and no.
Status expected(Failure f, bool yes_or_no) {
  if (f == Failure::drop) {
    return Status::no_data;
  }
  if (f == Failure::disconnect) {
    return Status::disconnected;
  }
  if (f == Failure::nan && yes_or_no) {
    return Status::fault;
  }
  return Status::ok;
}

TEST(Failures, of_the_hand_are_seen) {
  for (const Failure f : kAll) {
    SimHand hand(HandParams{}, {250, 6});
    std::int64_t t = 0;
    const auto run = [&](int ticks, Failure now) {  // the arm pulls it outwards at 0.1 m/s
      for (int i = 0; i < ticks; ++i) {
        const double p = 0.1e-9 * static_cast<double>(t);
        hand.step(t += 1'000'000, 0.001, Vec3(p, 0, 0), Vec3(p + 1e-4, 0, 0), true, now);
      }
    };
    run(300, Failure::none);
    const double at_failure = hand.state().position_m.x;
    run(100, f);
    hal::HandState seen;
    ASSERT_EQ(hand.read(seen), expected(f, false)) << static_cast<int>(f);
    const double x = seen.position_m.x();
    const double now = hand.state().position_m.x;
    const double step = HandParams{}.encoder_step_m;
    if (f == Failure::none) {
      EXPECT_NEAR(x, now, step);
    }
    if (f == Failure::freeze) {
      EXPECT_NEAR(x, at_failure, step);
    }
    if (f == Failure::delay) {
      EXPECT_NEAR(x, now - 0.1 * kFailureDelay_s, 2 * step);
    }
    if (f == Failure::nan) {
      EXPECT_TRUE(std::isnan(x));
    }
    if (f == Failure::saturate) {
      EXPECT_NEAR(x, SimHand::kSaturatedReach_m, step);
    }
    // The force commanded now, after one more tick.
    const Status wrote = hand.write_force(Vec3(0, 2, 0));
    EXPECT_EQ(wrote, f == Failure::disconnect ? Status::disconnected : Status::ok);
    run(1, f);
    const bool arrives =
        f == Failure::none || f == Failure::delay || f == Failure::nan || f == Failure::noise;
    EXPECT_NEAR(hand.state().applied_N.y,
                arrives                  ? 2
                : f == Failure::saturate ? 0.85
                                         : 0,
                1e-12)
        << static_cast<int>(f);
  }
}

TEST(Failures, a_frozen_hand_keeps_pushing) {
  SimHand hand(HandParams{}, {250, 6});
  ASSERT_EQ(hand.write_force(Vec3(1, 0, 0)), Status::ok);
  hand.step(1'000'000, 0.001, Vec3::Zero(), Vec3::Zero(), true, Failure::freeze);
  ASSERT_EQ(hand.write_force(Vec3(0, 0, 0)), Status::ok);
  hand.step(2'000'000, 0.001, Vec3::Zero(), Vec3::Zero(), true, Failure::freeze);
  EXPECT_EQ(hand.state().applied_N.x, 1);
}

TEST(Failures, of_the_stage_are_seen) {
  for (const Failure f : kAll) {
    StageParams params;
    params.registration_m = Vec3::Zero();
    SimStage stage(params);
    stage.enable(true);
    std::int64_t t = 0;
    Vec3 goal = params.start_m;
    const auto run = [&](int ticks, Failure now) {  // led outwards at 100 um/s
      for (int i = 0; i < ticks; ++i) {
        stage.step(t += 1'000'000, 0.001, true, now);
        goal.x() += 0.1e-6;
        const Status s = stage.command({goal, params.axis});
        EXPECT_EQ(s, now == Failure::disconnect ? Status::disconnected : Status::ok);
      }
    };
    run(500, Failure::none);
    const double at_failure = stage.state().tip_m.x;
    run(200, f);
    hal::StageState seen;
    ASSERT_EQ(stage.read(seen), expected(f, false)) << static_cast<int>(f);
    const double x = seen.tip_m.x();
    const double now = stage.state().tip_m.x;
    const double fine = params.resolution_m;
    if (f == Failure::none) {
      EXPECT_NEAR(x, now, fine);
    }
    if (f == Failure::freeze) {
      EXPECT_NEAR(x, at_failure, fine);  // and the drive hangs: it braked
      EXPECT_NEAR(now, at_failure, 0.5e-6);
    }
    if (f == Failure::disconnect) {
      EXPECT_NEAR(now, at_failure, 0.5e-6);
    }
    if (f == Failure::drop) {  // finished its last set-point
      EXPECT_NEAR(now, at_failure, 1e-6);
    }
    if (f == Failure::delay) {
      EXPECT_NEAR(x, now - 100e-6 * kFailureDelay_s, 2 * fine);
    }
    if (f == Failure::nan) {
      EXPECT_TRUE(std::isnan(x));
    }
    if (f == Failure::saturate) {
      EXPECT_LT(now - at_failure, 200e-3 * SimStage::kSaturatedSpeed * params.velocity_max_m_s + 0.5e-6);
      EXPECT_GT(seen.following_error_m.x(), 10e-6);
    }
  }
}

TEST(Failures, of_the_estop_chain_are_seen) {
  for (const Failure f : kAll) {
    SimConfig config;
    config.estop_events[0] = {0.2, 1, true, true, false};
    config.estop_event_count = 1;
    SimEstop chain(config);
    const auto run = [&](int from, int to, Failure now) {
      for (int k = from; k < to; ++k) {
        chain.step(k * 1'000'000, 0.001 * (k - 1), 0.001 * k, false, now);
        chain.heartbeat(k % 2 == 0);
      }
    };
    run(1, 100, Failure::none);
    run(100, 211, f);  // pressed 10 ms ago
    hal::EstopState seen;
    ASSERT_EQ(chain.read(seen), expected(f, true)) << static_cast<int>(f);
    if (f == Failure::none) {
      EXPECT_FALSE(seen.contact_a_closed);
    }
    if (f == Failure::freeze || f == Failure::delay) {
      EXPECT_TRUE(seen.contact_a_closed);
    }
    if (f == Failure::saturate) {
      EXPECT_TRUE(seen.contact_a_closed);  // welded
      EXPECT_FALSE(seen.contact_b_closed);
    }
    const bool deaf = f == Failure::freeze || f == Failure::drop || f == Failure::disconnect;
    EXPECT_EQ(chain.power(), !deaf) << static_cast<int>(f);
  }
}

TEST(Failures, of_the_injector_are_seen) {
  for (const Failure f : kAll) {
    SimInjector valve(InjectorParams{0.005});
    std::int64_t t = 0;
    const auto run = [&](int ticks, Failure now) {
      for (int i = 0; i < ticks; ++i) {
        valve.step(t += 1'000'000, 0.001, true, now);
      }
    };
    run(100, Failure::none);
    run(1, f);
    valve.gate(true);
    run(30, f);
    hal::InjectorState seen;
    ASSERT_EQ(valve.read(seen), expected(f, true)) << static_cast<int>(f);
    const bool deaf = f == Failure::freeze || f == Failure::drop || f == Failure::disconnect;
    EXPECT_EQ(valve.state().opening > 0.9, !deaf) << static_cast<int>(f);
    if (f == Failure::saturate) {
      valve.gate(false);
      run(100, f);
      ASSERT_EQ(valve.read(seen), Status::ok);
      EXPECT_TRUE(seen.open);
    }
  }
}

TEST(Failures, a_disconnected_injector_shuts) {
  SimInjector valve(InjectorParams{0.005});
  valve.gate(true);
  for (int k = 1; k <= 100; ++k) {
    valve.step(k * 1'000'000, 0.001, true, Failure::none);
  }
  for (int k = 101; k <= 200; ++k) {
    valve.step(k * 1'000'000, 0.001, true, Failure::disconnect);
  }
  EXPECT_LT(valve.state().opening, 1e-6);
}

TEST(Failures, of_the_vacuum_are_seen) {
  for (const Failure f : kAll) {
    SimVacuum pump(HolderParams{}, 1);
    std::int64_t t = 0;
    hal::VacuumState before;
    for (int i = 0; i < 100; ++i) {
      pump.step(t += 1'000'000, 0.001, Failure::none);
    }
    ASSERT_EQ(pump.read(before), Status::ok);
    EXPECT_NEAR(before.pressure_Pa, 600, 12);
    for (int i = 0; i < 1000; ++i) {
      pump.step(t += 1'000'000, 0.001, f);
    }
    hal::VacuumState seen;
    ASSERT_EQ(pump.read(seen), expected(f, false)) << static_cast<int>(f);
    if (f == Failure::freeze) {
      EXPECT_EQ(seen.pressure_Pa, before.pressure_Pa);
    }
    if (f == Failure::nan) {
      EXPECT_TRUE(std::isnan(seen.pressure_Pa));
    }
    if (f == Failure::saturate) {
      EXPECT_NEAR(pump.state().pressure_Pa, 600 * std::exp(-10.0), 1e-9);
    }
    if (f != Failure::saturate) {  // only the gauge failed
      EXPECT_EQ(pump.state().pressure_Pa, 600);
    }
  }
}

TEST(Failures, of_the_force_sensor_are_seen) {
  for (const Failure f : kAll) {
    SimForceSensor sensor(ForceSensorParams{0, 0.01}, 1);
    std::int64_t t = 0;
    for (int i = 0; i < 10; ++i) {
      sensor.step(t += 1'000'000, 0.001, 10e-6, Failure::none);
    }
    const double lagged = 10e-6 * (1 - std::exp(-1.0));
    for (int i = 0; i < 100; ++i) {
      sensor.step(t += 1'000'000, 0.001, 10e-6, f);
    }
    hal::ForceState seen;
    ASSERT_EQ(sensor.read(seen), expected(f, false)) << static_cast<int>(f);
    if (f == Failure::none) {
      EXPECT_NEAR(seen.axial_force_N, 10e-6 * (1 - std::exp(-11.0)), 1e-15);
    }
    if (f == Failure::freeze) {
      EXPECT_NEAR(seen.axial_force_N, lagged, 1e-15);
    }
    if (f == Failure::delay) {
      EXPECT_NEAR(seen.axial_force_N, 10e-6 * (1 - std::exp(-9.0)), 1e-15);
    }
    if (f == Failure::nan) {
      EXPECT_TRUE(std::isnan(seen.axial_force_N));
    }
    if (f == Failure::saturate) {
      EXPECT_EQ(seen.axial_force_N, SimForceSensor::kFullScale_N);
    }
  }
}

// What a device says about the time of its reading after 100 good steps of 1 ms and five failing ones.
// `device` is stepped by step(t_ns, failure) and read by read(sample_ns), which leaves sample_ns alone where
// the device leaves its reading alone.
template <typename Step, typename Read>
void expect_sample_times(Step step, Read read, Failure failure, bool yes_or_no) {
  constexpr std::int64_t ms = 1'000'000;
  std::int64_t sample_ns = -1;
  for (std::int64_t k = 1; k <= 100; ++k) {
    step(k * ms, Failure::none);
    ASSERT_EQ(read(sample_ns), Status::ok);
    ASSERT_EQ(sample_ns, k * ms);
  }
  for (std::int64_t k = 101; k <= 105; ++k) {
    step(k * ms, failure);
    ASSERT_EQ(read(sample_ns), expected(failure, yes_or_no));
    const bool silent = expected(failure, yes_or_no) != Status::ok;
    const std::int64_t of = failure == Failure::freeze || silent ? 100
                            : failure == Failure::delay          ? k - 20
                                                                 : k;
    ASSERT_EQ(sample_ns, of * ms) << "failure " << static_cast<int>(failure);
  }
}

template <typename State, typename Device>
auto time_of(Device& device) {
  return [&device](std::int64_t& sample_ns) {
    State seen;
    seen.sample_ns = sample_ns;
    const Status status = device.read(seen);
    sample_ns = seen.sample_ns;
    return status;
  };
}

TEST(Failures, every_device_says_when_it_took_a_reading_that_is_fresh_frozen_or_late) {
  for (const Failure f : kAll) {
    SimHand hand(HandParams{}, {250, 6});
    expect_sample_times(
        [&](std::int64_t t, Failure now) { hand.step(t, 0.001, Vec3::Zero(), Vec3::Zero(), true, now); },
        time_of<hal::HandState>(hand), f, false);
    SimStage stage(StageParams{});
    expect_sample_times([&](std::int64_t t, Failure now) { stage.step(t, 0.001, true, now); },
                        time_of<hal::StageState>(stage), f, false);
    SimEstop chain{SimConfig{}};
    expect_sample_times([&](std::int64_t t, Failure now) { chain.step(t, 0, 0.001, false, now); },
                        time_of<hal::EstopState>(chain), f, true);
    SimInjector valve(InjectorParams{0.005});
    expect_sample_times([&](std::int64_t t, Failure now) { valve.step(t, 0.001, true, now); },
                        time_of<hal::InjectorState>(valve), f, true);
    SimVacuum pump(HolderParams{}, 1);
    expect_sample_times([&](std::int64_t t, Failure now) { pump.step(t, 0.001, now); },
                        time_of<hal::VacuumState>(pump), f, false);
    SimForceSensor sensor(ForceSensorParams{}, 1);
    expect_sample_times([&](std::int64_t t, Failure now) { sensor.step(t, 0.001, 0, now); },
                        time_of<hal::ForceState>(sensor), f, false);
  }
}

// Mean and standard deviation of a reading while its device stands still and is disturbed.
struct Spread {
  double mean = 0, deviation = 0;
};
template <typename Read>
Spread spread_of(Read read) {
  constexpr int n = 4000;
  std::vector<double> x;
  for (int i = 0; i < n; ++i) {
    x.push_back(read());
  }
  Spread s;
  for (const double v : x) {
    s.mean += v / n;
  }
  for (const double v : x) {
    s.deviation += (v - s.mean) * (v - s.mean) / n;
  }
  s.deviation = std::sqrt(s.deviation);
  return s;
}

TEST(Failures, noise_is_as_large_as_each_device_says) {
  std::int64_t t = 0;
  constexpr double rough = 0.05;  // 4000 readings: 1.1 % standard error
  HandParams handle;
  SimHand hand(handle, {250, 6});
  Vec3 before = Vec3::Zero();
  int repeated = 0;
  const Spread x = spread_of([&] {
    hand.step(t += 1'000'000, 0.001, Vec3::Zero(), Vec3::Zero(), true, Failure::noise);
    hal::HandState seen, again;
    EXPECT_EQ(hand.read(seen), Status::ok);
    EXPECT_EQ(hand.read(again), Status::ok);
    EXPECT_EQ(seen.position_m, again.position_m);  // of one tick the same, however often it is read
    if (seen.position_m == before) {
      ++repeated;
    }
    before = seen.position_m;
    return seen.position_m.y();
  });
  EXPECT_NEAR(x.deviation, 4 * handle.encoder_step_m, rough * 4 * handle.encoder_step_m);
  EXPECT_LT(std::abs(x.mean), handle.encoder_step_m);
  EXPECT_LT(repeated, 40);  // from tick to tick another
  EXPECT_EQ(hand.state().position_m.y, 0);

  StageParams params;
  SimStage stage(params);
  const Spread tip = spread_of([&] {
    stage.step(t += 1'000'000, 0.001, true, Failure::noise);
    hal::StageState seen;
    EXPECT_EQ(stage.read(seen), Status::ok);
    return seen.tip_m.x();
  });
  EXPECT_NEAR(tip.deviation, 4 * params.resolution_m, rough * 4 * params.resolution_m);
  EXPECT_NEAR(tip.mean, params.start_m.x() + params.registration_m.x(), params.resolution_m);

  SimVacuum pump(HolderParams{}, 1);
  const Spread gauge = spread_of([&] {
    hal::VacuumState seen;
    pump.step(t += 1'000'000, 0.001, Failure::noise);
    EXPECT_EQ(pump.read(seen), Status::ok);
    return seen.pressure_Pa;
  });
  EXPECT_NEAR(gauge.deviation, SimVacuum::kInterference_Pa, rough * SimVacuum::kInterference_Pa);
  EXPECT_EQ(pump.state().pressure_Pa, 600);

  SimForceSensor sensor(ForceSensorParams{0, 0.001}, 1);
  const Spread force = spread_of([&] {
    hal::ForceState seen;
    sensor.step(t += 1'000'000, 0.001, 0, Failure::noise);
    EXPECT_EQ(sensor.read(seen), Status::ok);
    return seen.axial_force_N;
  });
  EXPECT_NEAR(force.deviation, SimForceSensor::kInterference_N, rough * SimForceSensor::kInterference_N);

  SimInjector valve(InjectorParams{0.005});
  const Spread contact = spread_of([&] {
    hal::InjectorState seen;
    valve.step(t += 1'000'000, 0.001, true, Failure::noise);
    EXPECT_EQ(valve.read(seen), Status::ok);
    return seen.open ? 1.0 : 0.0;
  });
  EXPECT_NEAR(contact.mean, 0.5, rough);
  EXPECT_EQ(valve.state().opening, 0);

  SimEstop chain{SimConfig{}};
  double both = 0;
  const Spread a = spread_of([&] {
    hal::EstopState seen;
    chain.step(t += 1'000'000, 0, 0.001, false, Failure::noise);
    EXPECT_EQ(chain.read(seen), Status::ok);
    both += !seen.contact_a_closed && !seen.contact_b_closed ? 1.0 / 4000 : 0;
    return seen.contact_a_closed ? 1.0 : 0.0;
  });
  EXPECT_NEAR(a.mean, 0.5, rough);
  EXPECT_NEAR(both, 0.25, rough);
}

TEST(SimForceSensor, is_as_noisy_as_the_scene_says) {
  SimForceSensor sensor(ForceSensorParams{0.15e-6, 0.001}, 5);
  double square = 0;
  const std::int64_t n = 20'000;
  for (std::int64_t i = 1; i <= n; ++i) {
    sensor.step(i * 1'000'000, 0.001, 0, Failure::none);
    square += sensor.state().reading_N * sensor.state().reading_N / static_cast<double>(n);
  }
  EXPECT_NEAR(std::sqrt(square), 0.15e-6, 0.15e-6 * 0.03);
}

}  // namespace
}  // namespace punctum::sim
