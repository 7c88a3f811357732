#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>

#include "hal/sim/plant/estop.hpp"
#include "hal/sim/plant/injector.hpp"

namespace punctum::sim {
namespace {

class SimEstopTest : public testing::Test {
 protected:
  // One tick of 1 ms; toggles the heartbeat after it if `beats`.
  void tick(SimEstop& chain, bool beats = true) {
    ++ticks;
    chain.step(ticks * 1'000'000, 0.001 * static_cast<double>(ticks - 1), 0.001 * static_cast<double>(ticks),
               false, Failure::none);
    if (beats) {
      chain.heartbeat(level = !level);
    }
  }
  void run(SimEstop& chain, int n, bool beats = true) {
    for (int i = 0; i < n; ++i) {
      tick(chain, beats);
    }
  }
  static hal::EstopState read(SimEstop& chain) {
    hal::EstopState s;
    EXPECT_EQ(chain.read(s), hal::Status::ok);
    return s;
  }
  // A chain whose contacts open as the script says.
  SimEstop scripted(std::initializer_list<EstopEvent> events) {
    std::copy(events.begin(), events.end(), config.estop_events.begin());
    config.estop_event_count = static_cast<int>(events.size());
    return SimEstop(config);
  }
  SimConfig config;
  std::int64_t ticks = 0;
  bool level = false;
};

TEST_F(SimEstopTest, opens_the_contacts_that_the_script_names) {
  SimEstop chain = scripted({{0.010, 0.005, true, false, false}});
  run(chain, 9);
  EXPECT_TRUE(read(chain).contact_a_closed);
  tick(chain);
  EXPECT_FALSE(read(chain).contact_a_closed);
  EXPECT_TRUE(read(chain).contact_b_closed);
  run(chain, 5);
  EXPECT_TRUE(read(chain).contact_a_closed);
}

TEST_F(SimEstopTest, presses_reset_after_the_release_if_the_script_says_so) {
  SimEstop chain = scripted({{0.010, 0.100, true, true, true}});
  int pressed = 0;
  int first = 0;
  for (int i = 1; i <= 600; ++i) {
    tick(chain);
    if (read(chain).reset_pressed) {
      ++pressed;
      if (first == 0) {
        first = i;
      }
    }
  }
  EXPECT_EQ(first, 310);  // 10 + 100 + 200 ms
  EXPECT_EQ(pressed, 100);
}

TEST_F(SimEstopTest, sees_a_pulse_shorter_than_a_tick) {
  SimEstop chain = scripted({{0.0103, 0.0004, true, true, false}});
  run(chain, 10);
  EXPECT_FALSE(read(chain).pulse_seen);
  tick(chain);
  EXPECT_TRUE(read(chain).pulse_seen);
  EXPECT_TRUE(read(chain).contact_a_closed);
  tick(chain);
  EXPECT_FALSE(read(chain).pulse_seen);
}

TEST_F(SimEstopTest, keeps_a_pulse_until_it_is_read) {
  SimEstop chain = scripted({{0.0103, 0.0004, true, false, false}, {0.0203, 0.0015, true, false, false}});
  for (const int until : {15, 25}) {  // both lie within one late tick
    run(chain, until - static_cast<int>(ticks));
    EXPECT_TRUE(read(chain).pulse_seen);
    EXPECT_TRUE(read(chain).contact_a_closed);
    tick(chain);
    EXPECT_FALSE(read(chain).pulse_seen);
  }
}

TEST_F(SimEstopTest, gives_power_only_once_the_heartbeat_runs) {
  SimEstop chain(config);
  run(chain, 100, false);
  EXPECT_FALSE(chain.power());
  run(chain, 2);
  EXPECT_TRUE(chain.power());
}

TEST_F(SimEstopTest, takes_power_away_fifty_milliseconds_after_the_last_beat) {
  SimEstop chain(config);
  run(chain, 10);
  const std::int64_t last_beat = ticks;
  while (chain.power() && ticks < 1000) {
    tick(chain, false);
  }
  EXPECT_EQ(ticks - last_beat, 51);  // the first tick past 50 ms
  EXPECT_EQ(chain.state().opened_ns, (last_beat + 50) * 1'000'000);
}

TEST_F(SimEstopTest, a_level_that_does_not_change_is_no_heartbeat) {
  SimEstop chain(config);
  run(chain, 10);
  for (int i = 0; i < 60; ++i) {
    tick(chain, false);
    chain.heartbeat(level);
  }
  EXPECT_FALSE(chain.power());
}

TEST_F(SimEstopTest, needs_a_reset_before_power_comes_back) {
  SimEstop chain = scripted({{0.100, 0.100, true, true, true}});  // reset pressed from 0.4 to 0.5 s
  run(chain, 10);
  run(chain, 60, false);
  ASSERT_FALSE(chain.power());
  run(chain, 300);
  EXPECT_FALSE(chain.power());
  run(chain, 40);
  EXPECT_TRUE(chain.power());
}

TEST_F(SimEstopTest, a_dropped_chain_hears_no_heartbeat) {
  SimEstop chain(config);
  run(chain, 10);
  for (int i = 0; i < 60; ++i) {
    ++ticks;
    chain.step(ticks * 1'000'000, 0.001 * static_cast<double>(ticks - 1), 0.001 * static_cast<double>(ticks),
               false, Failure::drop);
    chain.heartbeat(level = !level);
  }
  EXPECT_FALSE(chain.power());
}

TEST(SimInjector, opens_and_shuts_with_its_lag_and_counts_what_it_delivered) {
  SimInjector valve(InjectorParams{0.01});
  std::int64_t t = 0;
  const auto run = [&](int ticks, bool power) {
    for (int i = 0; i < ticks; ++i) {
      valve.step(t += 1'000'000, 0.001, power, Failure::none);
    }
  };
  valve.gate(true);
  run(10, true);
  EXPECT_NEAR(valve.state().opening, 1 - std::exp(-1.0), 1e-15);
  EXPECT_NEAR(valve.state().delivered_s, 0.01 - 0.01 * (1 - std::exp(-1.0)), 1e-15);
  hal::InjectorState seen;
  ASSERT_EQ(valve.read(seen), hal::Status::ok);
  EXPECT_TRUE(seen.open);
  valve.gate(false);
  run(50, true);
  ASSERT_EQ(valve.read(seen), hal::Status::ok);
  EXPECT_FALSE(seen.open);
}

TEST(SimInjector, shuts_without_power) {
  SimInjector valve(InjectorParams{0.01});
  valve.gate(true);
  for (int i = 1; i <= 100; ++i) {
    valve.step(i * 1'000'000, 0.001, true, Failure::none);
  }
  ASSERT_GT(valve.state().opening, 0.99);
  for (int i = 101; i <= 200; ++i) {
    valve.step(i * 1'000'000, 0.001, false, Failure::none);
  }
  EXPECT_LT(valve.state().opening, 1e-4);
}

}  // namespace
}  // namespace punctum::sim
