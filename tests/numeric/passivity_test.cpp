// The passivity guard in closed loop with the simulated device; the limits it is held to are the published
// ones, computed here.
#include "rt/control/passivity.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "rt/control/device_limits.hpp"
#include "tools/report/closed_loop.hpp"

namespace punctum::rt {
namespace {

using report::faithful;
using report::LoopCell;
using report::LoopResult;
using report::run_loop;
using report::sweep_cell;

constexpr std::uint64_t kCells = 1200;  // `punctum-report stability` runs 20 000

std::vector<LoopResult> sweep(bool guarded, std::uint64_t n) {
  std::vector<LoopResult> results(n);
  std::atomic<std::uint64_t> next{0};
  std::vector<std::jthread> threads;
  for (int i = 0; i < 2; ++i) {
    threads.emplace_back([&] {
      for (std::uint64_t k = next++; k < n; k = next++) {
        results[k] = run_loop(sweep_cell(k + 1, guarded));
      }
    });
  }
  threads.clear();
  return results;
}

TEST(Passivity, no_cell_of_the_sweep_is_unstable_with_the_guard_and_none_is_faded_away) {
  const auto results = sweep(true, kCells);
  int stiff = 0;
  for (std::uint64_t i = 0; i < kCells; ++i) {
    const LoopCell cell = sweep_cell(i + 1, true);
    const LoopResult& r = results[i];
    EXPECT_FALSE(r.unstable()) << "cell " << i + 1 << ": " << r.peak_to_peak_m << " m, " << r.surplus_J
                               << " J";
    EXPECT_FALSE(r.active_at_rest) << "cell " << i + 1;
    EXPECT_TRUE(faithful(cell, r)) << "cell " << i + 1 << ": " << r.rendered_N_m << " of " << r.commanded_N_m;
    stiff += r.commanded_N_m > r.passive_N_m ? 1 : 0;
  }
  EXPECT_GT(stiff, 400);  // the sweep asks for what the device cannot give
}

TEST(Passivity, most_of_the_same_cells_are_unstable_without_it) {
  int unstable = 0;
  for (const LoopResult& r : sweep(false, 300)) {
    unstable += r.unstable() ? 1 : 0;
  }
  EXPECT_GT(unstable, 150);
}

TEST(Passivity, no_wall_that_moves_gives_the_hand_more_than_the_bound_and_it_comes_to_rest_afterwards) {
  constexpr std::uint64_t kMoving = 500;  // `punctum-report stability` runs as many as of the others
  for (std::uint64_t n = 1; n <= kMoving; ++n) {
    const LoopCell cell = report::moving_cell(n, true);
    const LoopResult r = run_loop(cell);
    EXPECT_FALSE(r.unstable()) << "cell " << n << ": " << r.peak_to_peak_m << " m, " << r.net_J << " J";
    EXPECT_TRUE(faithful(cell, r)) << "cell " << n << ": " << r.rendered_N_m << " of " << r.commanded_N_m;
  }
}

// The core's own limit of the force's rate under walls for which it is too slow.
TEST(Passivity, a_force_that_comes_down_slowly_gives_no_more_than_the_bound_while_it_does) {
  for (const std::uint64_t n : {3737, 5999, 13967, 15582}) {
    const LoopCell cell = report::moving_cell(n, true);
    ASSERT_EQ(cell.slew_N_s, 300);
    const LoopResult r = run_loop(cell);
    EXPECT_FALSE(r.unstable()) << "cell " << n << ": " << r.peak_to_peak_m << " m, " << r.net_J << " J";
    EXPECT_TRUE(faithful(cell, r)) << "cell " << n << ": " << r.rendered_N_m << " of " << r.commanded_N_m;
  }
}

// A Falcon: 1 kHz under ticks of 4 kHz.
TEST(Passivity, a_hand_that_is_sampled_more_slowly_than_the_ticks_comes_to_rest_at_a_stiff_wall) {
  for (const int ticks : {2, 4, 8}) {
    for (const double K : {150.0, 300.0, 700.0, 3000.0}) {
      LoopCell cell;
      cell.rate_Hz = 4000;
      cell.ticks_per_sample = ticks;
      cell.device.encoder_step_m = 0.01e-3;
      cell.holder = report::Holder::nobody;
      cell.stiffness_N_m = K;
      cell.speed_m_s = 0.05;
      const LoopResult r = run_loop(cell);
      EXPECT_FALSE(r.unstable()) << ticks << " ticks, " << K << " N/m: swings by " << r.peak_to_peak_m
                                 << " m";
      EXPECT_TRUE(faithful(cell, r)) << ticks << " ticks, " << K << " N/m: " << r.rendered_N_m;
    }
  }
}

// The hand is moved by A sin(wt) against a spring that is never stiffer than the device keeps passive. Each
// cycle of the hand would give pi/2 K_1 A^2 = 7.9 mJ without delay, K_1 the amplitude of the stiffness.
TEST(Passivity, a_spring_that_is_modulated_gives_the_hand_no_more_than_the_bound) {
  for (const int delay : {0, 3}) {
    HandDevice device;
    device.delay_ticks = delay;
    device.encoder_step_m = 1e-6;
    PassivityGuard guard({}, device, {}, 1000);
    constexpr double A = 10e-3, w = 2 * std::numbers::pi, T = 1e-3;
    constexpr double kAllowed_J = 2e-3, kAllowed_W = 2e-3;  // as README promises
    const double K = 0.5 * passive_stiffness_N_m(device, T);
    std::array<double, 8> written{};
    double work_J = 0, most_J = 0, before = 0, least_J = 0;
    for (std::size_t k = 0; k < 60000; ++k) {
      const double t = T * static_cast<double>(k);
      const double x = A * std::sin(w * t);
      work_J += written[(k + 7 - static_cast<std::size_t>(delay)) % 8] * (x - before) - kAllowed_W * T;
      before = x;
      const double stiffness = K * (1 - 0.5 * std::sin(2 * w * t));
      GuardInput in;
      in.position_m = {x, 0, 0};
      in.storing[0] = {{-stiffness * x, 0, 0}, in.position_m};
      in.stored_J = 0.5 * stiffness * x * x;
      in.stiffness_N_m = stiffness;
      in.elapsed_s = T;
      const hal::Vec3 force_N = guard.step(in);
      guard.wrote(force_N);
      written[k % 8] = force_N.x();
      // The stored energy, by the whole of the effect's stiffness, is more than what is rendered.
      least_J = std::min(least_J, work_J + in.stored_J);
      most_J = std::max(most_J, work_J - least_J);
    }
    EXPECT_LT(most_J, 1.1 * kAllowed_J) << delay;
  }
}

// Below what the device keeps passive the loop is stable without the guard, and there it is not to be felt.
TEST(Passivity, a_wall_that_is_stable_by_itself_gives_back_all_but_a_hundredth_of_what_the_hand_put_in) {
  for (const double rate : {1000.0, 4000.0}) {
    for (const int delay : {0, 1, 5}) {
      for (const int ticks : {1, 4}) {
        LoopCell cell;
        cell.rate_Hz = rate;
        cell.ticks_per_sample = ticks;
        cell.device.delay_ticks = delay;
        for (const double part : {0.1, 0.5, 0.85}) {
          cell.stiffness_N_m = part * cell.device.damping_Ns_m * rate / (0.5 * ticks + delay);
          const double lost = report::lost_part(cell);
          EXPECT_LT(lost, 0.01) << rate << " Hz, " << delay << ", " << ticks << ", " << cell.stiffness_N_m;
          EXPECT_GT(lost, -0.01) << rate << " Hz, " << delay << ", " << ticks << ", " << cell.stiffness_N_m;
        }
      }
    }
  }
}

// A spring of 100 N/m pressed by 1 mm; the hand's newest sample grows old.
TEST(Passivity, the_force_is_gone_after_four_periods_of_a_silent_hand_and_whole_after_two) {
  constexpr double kPeriod_s = 1e-3;
  PassivityGuard guard({}, {}, {}, 1 / kPeriod_s);
  GuardInput in;
  in.stiffness_N_m = 100;
  in.position_m = {1e-3, 0, 0};
  in.storing[0] = {{-0.1, 0, 0}, in.position_m};
  in.elapsed_s = kPeriod_s;
  for (int k = 0; k < 100; ++k) {
    guard.wrote(guard.step(in));
  }
  in.fresh = false;
  double before_N = -0.1;
  for (int k = 1; k <= 4; ++k) {
    in.age_s = k * kPeriod_s;
    const double force_N = guard.step(in).x();
    guard.wrote({force_N, 0, 0});
    EXPECT_GE(force_N, before_N) << k;
    if (k <= 2) {
      EXPECT_NEAR(force_N, -0.1, 1e-6) << k;
    }
    before_N = force_N;
  }
  EXPECT_EQ(before_N, 0);
}

TEST(Passivity, a_device_of_1_kHz_feels_no_fading_between_its_samples_under_faster_ticks) {
  for (const double rate : {4000.0, 8000.0}) {
    PassivityGuard guard({}, {}, {}, rate);
    GuardInput in;
    in.stiffness_N_m = 100;
    in.position_m = {1e-3, 0, 0};
    in.storing[0] = {{-0.1, 0, 0}, in.position_m};
    in.elapsed_s = 1 / rate;
    in.between_s = 1e-3;
    const int per_sample = static_cast<int>(rate / 1000);
    for (int k = 0; k < 100 * per_sample; ++k) {
      in.fresh = k % per_sample == 0;
      in.age_s = in.elapsed_s * (k % per_sample);
      const double force_N = guard.step(in).x();
      guard.wrote({force_N, 0, 0});
      if (k > 10 * per_sample) {
        ASSERT_NEAR(force_N, -0.1, 1e-6) << rate << " Hz, tick " << k;
      }
    }
  }
}

// A push of 0.5 N on a wall that moves by 5 mm or swings by nine tenths of its stiffness. The handle alone
// would fall at 5 m/s.
TEST(Passivity, a_handle_that_is_pushed_sinks_slowly_through_a_wall_that_is_lowered) {
  for (const bool moving : {true, false}) {
    for (const double Hz : {0.5, 2.0, 10.0}) {
      for (const double K : {100.0, 1000.0}) {
        constexpr int kTicks = 20000, kLast = 5000;
        const HandDevice device;
        PassivityGuard guard({}, device, {}, 1000);
        double x = 0, v = 0, from = 0;
        for (int k = 0; k < kTicks; ++k) {
          const double swing = std::sin(2 * std::numbers::pi * Hz * 1e-3 * k);
          const double wall = moving ? std::min(5e-3, 0.3 / (2 * std::numbers::pi * Hz)) * swing : 0;
          const double stiffness = moving ? K : K * (1 + 0.9 * swing);
          const double told = device.encoder_step_m * std::round(x / device.encoder_step_m);
          const double inside = std::max(0.0, told - wall);
          GuardInput in;
          in.position_m = {told, 0, 0};
          in.elapsed_s = 1e-3;
          in.stiffness_N_m = inside > 0 ? stiffness : 0;
          in.storing[0] = {{-stiffness * inside, 0, 0}, in.position_m};
          in.stored_J = 0.5 * stiffness * inside * inside;
          const hal::Vec3 force_N = guard.step(in);
          guard.wrote(force_N);
          for (int i = 0; i < 10; ++i) {
            v += (force_N.x() + 0.5 - device.damping_Ns_m * v) / device.mass_kg * 1e-4;
            x += v * 1e-4;
          }
          from = k == kTicks - kLast ? x : from;
        }
        EXPECT_LT((x - from) / (1e-3 * kLast), 1e-3) << moving << " " << Hz << " Hz, " << K << " N/m";
      }
    }
  }
}

// Hannaford & Ryu's bookkeeping on paper: a spring K, two ticks, one step of 1 mm into it.
TEST(Passivity, surplus_is_the_work_of_the_held_force_less_what_the_spring_took_up) {
  HandDevice device;
  device.encoder_step_m = 0;
  PassivityGuard guard({}, device, {}, 1000);
  GuardInput in;
  in.elapsed_s = 1e-3;
  in.stiffness_N_m = 100;
  const auto tick = [&](double x, double applied_N) {
    in.position_m = {x, 0, 0};
    in.storing[0] = {{-100 * x, 0, 0}, in.position_m};
    (void)guard.step(in);
    guard.wrote({applied_N, 0, 0});
  };
  tick(1e-3, -0.1);
  tick(2e-3, -0.2);
  // W = -0.1 N * 1 mm; the spring took (0.1 + 0.2)/2 N * 1 mm: 0.05 mJ too much came back.
  EXPECT_NEAR(guard.surplus_J(), 0.05e-3, 1e-6);
}

TEST(Passivity, the_force_that_acts_is_the_one_written_before_the_delay) {
  HandDevice device;
  device.encoder_step_m = 0;
  device.delay_ticks = 2;
  PassivityGuard guard({}, device, {}, 1000);
  GuardInput in;
  in.elapsed_s = 1e-3;
  const double written_N[] = {0.1, 0.2, 0.4, 0.8, 1.6};
  for (const double force_N : written_N) {
    (void)guard.step(in);
    guard.wrote({force_N, 0, 0});
  }
  in.position_m = {1e-3, 0, 0};
  (void)guard.step(in);
  EXPECT_NEAR(guard.surplus_J(), 0.4e-3, 1e-6);  // the last one acts two ticks from now
}

TEST(Passivity, a_late_needle_is_seen_where_the_handle_alone_would_not_show_it) {
  // The membrane's force follows the needle, which follows the handle 50 ms late: each cycle gives energy.
  const auto surplus = [](bool late) {
    HandDevice device;
    device.encoder_step_m = 0;
    PassivityGuard guard({}, device, {}, 1000);
    GuardInput in;
    in.elapsed_s = 1e-3;
    in.stiffness_N_m = 20;
    double needle = 0, most = 0;
    for (int k = 0; k < 4000; ++k) {
      const double x = 5e-3 + 5e-3 * std::sin(6.28 * k * 1e-3);
      needle += late ? (x - needle) * 0.02 : x - needle;
      in.position_m = {x, 0, 0};
      in.storing[1] = {{-20 * needle, 0, 0}, {needle, 0, 0}};
      guard.wrote(guard.step(in));
      most = std::max(most, guard.damper_Ns_m());
    }
    return most;
  };
  EXPECT_LT(surplus(false), 0.1);
  EXPECT_GT(surplus(true), 0.5);  // K tau = 1 Ns/m is what it takes
}

// A spring of 100 N/m, pressed in by 2 mm: its 0.2 N are held for 5 ms while the handle comes out of it.
// They give 0.4 mJ where the spring had 0.2. The velocity is hardly known then: more than the surplus is
// taken.
TEST(Passivity, after_a_late_sample_the_damper_takes_back_more_than_was_given) {
  HandDevice device;
  device.encoder_step_m = 0;
  PassivityGuard guard({}, device, {}, 1000);
  GuardInput in;
  double taken_J = 0;
  const auto tick = [&](double x, double elapsed_s) {
    taken_J -= guard.damper_N().x() * (x - in.position_m.x());
    in.position_m = {x, 0, 0};
    in.elapsed_s = elapsed_s;
    const double inside = std::max(0.0, x);
    in.stiffness_N_m = inside > 0 ? 100 : 0;
    in.storing[0] = {{-100 * inside, 0, 0}, in.position_m};
    in.stored_J = 50 * inside * inside;
    guard.wrote(guard.step(in));
  };
  for (int k = 0; k < 1000; ++k) {
    tick(std::min(2e-3, 1e-5 * k), 1e-3);
  }
  taken_J = 0;
  tick(0, 5e-3);
  for (int k = 1; k < 300; ++k) {
    tick(-0.2e-3 * k, 1e-3);
  }
  EXPECT_GT(taken_J, 1.2 * 0.2e-3);
  EXPECT_LT(taken_J, 2 * 0.2e-3);
}

TEST(Passivity, no_damper_acts_on_the_velocity_of_a_leap) {
  for (const bool leaps : {true, false}) {
    HandDevice device;
    device.encoder_step_m = 0;
    PassivityGuard guard({}, device, {}, 1000);
    GuardInput in;
    in.elapsed_s = 1e-3;
    in.between_s = 4e-3;
    in.stiffness_N_m = 100;
    double damper_N = 0;
    for (int k = 0; k < 420; ++k) {
      // A hand of 250 Hz that stands at 2 mm, is told to be at 4 mm once, and is told at 2 mm again.
      const double x = k >= 400 && k < 404 ? 4e-3 : 2e-3;
      in.fresh = k % 4 == 0;
      in.age_s = 1e-3 * (k % 4);
      in.leaps = leaps && in.fresh && k >= 400;
      in.position_m = {x, 0, 0};
      in.storing[0] = {{-100 * x, 0, 0}, in.position_m};
      in.stored_J = 50 * x * x;
      const hal::Vec3 force_N = guard.step(in);
      guard.wrote(force_N);
      damper_N = std::max(damper_N, k < 400 ? 0 : std::abs(force_N.x() + guard.gain() * 100 * x));
    }
    if (leaps) {
      EXPECT_LT(damper_N, 1e-12);
    } else {
      EXPECT_GT(damper_N, 0.05);
    }
  }
}

// A handle of 75 g that is thrown at 1.2 m/s into a strong damper and then pulled back by an arm with 14 N:
// it turns round within 7 ms, in which a limit of 300 N/s takes back 2 N of the 3.
TEST(Passivity, a_damper_that_cannot_come_down_in_time_does_not_push_a_handle_that_turns_round) {
  constexpr double T = 1e-3, kSlew_N_s = 300, kMass_kg = 0.075, kMost_N = 3, B = 4;
  HandDevice device;
  device.mass_kg = kMass_kg;
  PassivityGuard guard({}, device, {}, 1 / T, kSlew_N_s);
  double x = 0, v = -1.2, acts_N = 0, work_J = 0, least_J = 0, pushed_J = 0, largest_N = 0;
  for (int k = 0; k < 60; ++k) {
    const double arm_N = k < 15 ? 2.5 : 14.0;
    for (int i = 0; i < 10; ++i) {
      v += (acts_N + (k < 15 ? -arm_N : arm_N)) / kMass_kg * T / 10;
      x += v * T / 10;
      work_J += acts_N * v * T / 10;
    }
    least_J = std::min(least_J, work_J);
    pushed_J = std::max(pushed_J, work_J - least_J);
    largest_N = std::max(largest_N, acts_N);
    GuardInput in;
    in.elapsed_s = T;
    in.position_m = {device.encoder_step_m * std::round(x / device.encoder_step_m), 0, 0};
    in.damping_Ns_m = B;
    in.dissipative_N = {-B * v, 0, 0};
    const double asked_N = std::clamp(guard.step(in).x(), -kMost_N, kMost_N);
    acts_N = std::clamp(asked_N, acts_N - kSlew_N_s * T, acts_N + kSlew_N_s * T);
    guard.wrote({acts_N, 0, 0});
  }
  EXPECT_GT(largest_N, 2.5);
  EXPECT_GT(v, 1);
  EXPECT_LT(pushed_J, PassivityGuard::kAllowed_J);
}

// An active force of 0.5 N that always goes with a hand at up to 20 mm/s: 6 mW, of which it may give
// kActive_W.
TEST(Passivity, an_effect_that_may_give_energy_gives_no_more_than_it_is_allowed) {
  HandDevice device;
  device.encoder_step_m = 0;
  PassivityGuard guard({}, device, {}, 1000);
  GuardInput in;
  in.elapsed_s = 1e-3;
  double x = 0, work_J = 0, acts_N = 0;
  for (int k = 0; k < 10000; ++k) {
    const double v = 20e-3 * std::sin(2 * std::numbers::pi * k * 1e-3);
    work_J += acts_N * v * in.elapsed_s;
    x += v * in.elapsed_s;
    in.position_m = {x, 0, 0};
    in.active_N = {v > 0 ? 0.5 : -0.5, 0, 0};
    const hal::Vec3 force_N = guard.step(in);
    if (k < 50) {
      ASSERT_EQ(force_N, in.active_N) << "the first ticks give next to nothing: " << k;
    }
    guard.wrote(force_N);
    acts_N = force_N.x();
    const double one_tick_J = 0.5 * 20e-3 * in.elapsed_s;
    ASSERT_LE(work_J,
              PassivityGuard::kActive_J + PassivityGuard::kActive_W * k * in.elapsed_s + 2 * one_tick_J)
        << k;
  }
  EXPECT_GT(work_J, 0.5 * PassivityGuard::kActive_W * 10);
}

TEST(Passivity, eight_hours_at_rest_and_in_gentle_motion_wind_nothing_up) {
  HandDevice device;
  PassivityGuard guard({}, device, {}, 1000);
  GuardInput in;
  in.elapsed_s = 1e-3;
  in.stiffness_N_m = 100;
  constexpr long kHour = 3'600'000;
  const auto reaction_N = [&](double shove_m) {
    // A sudden swing: what the guard adds to it.
    double most = 0;
    PassivityGuard copy = guard;
    for (int k = 0; k < 200; ++k) {
      const double x = 2e-3 + shove_m * std::sin(0.4 * k);
      in.position_m = {x, 0, 0};
      in.storing[0] = {{-100 * x, 0, 0}, in.position_m};
      const hal::Vec3 f = copy.step(in);
      copy.wrote(f);
      most = std::max(most, copy.damper_N().norm());
    }
    return most;
  };
  double fresh = 0;
  for (long k = 0; k < 8 * kHour; ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    const double x = 3e-5 * std::round((2e-3 + 1e-3 * std::sin(0.2 * std::numbers::pi * t)) / 3e-5);
    in.position_m = {x, 0, 0};
    in.storing[0] = {{-100 * x, 0, 0}, in.position_m};
    in.dissipative_N = {-6.3e-4 * std::cos(0.2 * std::numbers::pi * t), 0, 0};  // 1 Ns/m
    const hal::Vec3 f = guard.step(in);
    guard.wrote(f);
    if (k + 1 == 60000) {
      fresh = reaction_N(1e-3);
    }
  }
  EXPECT_EQ(guard.gain(), 1);
  EXPECT_LT(std::abs(guard.surplus_J()), 1e-4);
  EXPECT_NEAR(reaction_N(1e-3), fresh, 0.05 * fresh);
}

TEST(Passivity, input_that_is_not_finite_passes_through_and_leaves_no_trace) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  PassivityGuard guard({}, {}, {}, 1000), twin({}, {}, {}, 1000);
  GuardInput in;
  in.elapsed_s = 1e-3;
  in.stiffness_N_m = 1000;
  for (int k = 0; k < 50; ++k) {
    in.position_m = {1e-4 * k, 0, 0};
    in.storing[0] = {{-0.1 * k, 0, 0}, in.position_m};
    const hal::Vec3 a = guard.step(in), b = twin.step(in);
    EXPECT_EQ(a, b);
    if (k == 20) {
      GuardInput broken = in;
      broken.storing[0].force_N.x() = nan;
      EXPECT_FALSE(guard.step(broken).allFinite());
    }
    guard.wrote(a);
    twin.wrote(b);
  }
}

TEST(Passivity, a_stiffness_falls_at_once_and_returns_slowly_to_the_passive_one) {
  HandDevice device;  // b = 0.1 Ns/m at 1 kHz: passive up to 200 N/m
  PassivityGuard guard({}, device, {}, 1000);
  GuardInput in;
  in.elapsed_s = 1e-3;
  in.stiffness_N_m = 1000;
  (void)guard.step(in);
  EXPECT_NEAR(guard.gain() * 1000, 0.9 * 200, 1e-9);
  in.stiffness_N_m = 0;
  (void)guard.step(in);
  EXPECT_LT(guard.gain(), 0.19);
  for (int k = 0; k < 10000; ++k) {
    (void)guard.step(in);
  }
  EXPECT_GT(guard.gain(), 0.98);
}

TEST(Passivity, late_ticks_lower_the_stiffness_without_a_click_and_only_while_they_come) {
  PassivityGuard guard({}, {}, {}, 1000);
  GuardInput in;
  in.stiffness_N_m = 180;
  double before = 1, click = 0, least = 1;
  const auto run = [&](int ticks, int late_every) {
    for (int k = 1; k <= ticks; ++k) {
      in.elapsed_s = k % late_every == 0 ? 5e-3 : 1e-3;
      (void)guard.step(in);
      click = std::max(click, before - guard.gain());
      before = guard.gain();
      least = std::min(least, before);
    }
  };
  run(1, 2);
  EXPECT_EQ(guard.gain(), 1);
  run(20000, 50);  // a mean period of 1.08 ms
  EXPECT_LT(least, 1 / 1.08);
  EXPECT_LT(click, 0.02);
  run(60000, 100000);
  EXPECT_GT(guard.gain(), 0.99);
}

TEST(Passivity, forces_that_are_finite_but_huge_leave_a_finite_surplus) {
  PassivityGuard guard({}, {}, {}, 1000);
  GuardInput in;
  in.elapsed_s = 1e-3;
  for (int k = 0; k < 3; ++k) {
    in.position_m = {1e-3 * k, 0, 0};
    in.storing[0] = {{-1e308, 0, 0}, in.position_m};
    in.storing[1] = in.storing[0];
    (void)guard.step(in);
    guard.wrote({-3, 0, 0});
  }
  EXPECT_TRUE(std::isfinite(guard.surplus_J()));
}

TEST(Passivity, damping_is_kept_up_to_half_of_what_the_device_renders_at_every_rate) {
  VelocityParams foaw;
  foaw.method = VelocityParams::Method::foaw;
  for (const VelocityParams& velocity : {VelocityParams{}, foaw}) {
    for (const double rate : {1000.0, 2000.0, 4000.0}) {
      const double limit = stable_damping_Ns_m(HandDevice{}, 1 / rate, velocity);
      for (const double part : {0.45, 1.0}) {
        PassivityGuard guard({}, {}, velocity, rate);
        GuardInput in;
        in.elapsed_s = 1 / rate;
        in.dissipative_N = {-1, 0, 0};
        in.damping_Ns_m = part * limit;
        EXPECT_NEAR(guard.step(in).x(), -std::min(1.0, 0.5 / part), 1e-9) << rate << " " << part;
      }
    }
  }
}

// Gil 2009 and Colgate & Schenkel, by simulation against the formulas.
TEST(Passivity, measured_boundaries_are_the_published_ones) {
  HandDevice device;
  device.damping_Ns_m = 0.1;
  for (const double rate : {1000.0, 8000.0}) {
    const double T = 1 / rate;
    for (int d = 0; d <= 2; ++d) {
      device.delay_ticks = d;
      const double B = 0.01 * device.mass_kg / T;
      const double Gil = (device.damping_Ns_m + B) / (T * (0.5 + d));
      EXPECT_NEAR(report::measured_boundary_N_m(device, T, B) / Gil, 1, 0.05) << rate << " " << d;
    }
  }
  // b = 0 and no delay, exactly: K T^2/m = 2 beta (2 - beta)/(2 + beta).
  device.damping_Ns_m = 1e-9;
  device.delay_ticks = 0;
  for (const double beta : {0.05, 0.4, 0.828, 1.5}) {
    const double m = device.mass_kg, T = 1e-3;
    const double K = m / (T * T) * 2 * beta * (2 - beta) / (2 + beta);
    EXPECT_NEAR(report::measured_boundary_N_m(device, T, beta * m / T) / K, 1, 0.005) << beta;
  }
  const auto e = report::cycle_energy(1000, 2, 0.00531, 1e-3, 0);
  EXPECT_NEAR(e.triangle_Ns_m / (1000 * 0.5e-3 + 2 * 1e-3 / (1e-3 + 2 * 0.00531)), 1, 0.01);
  EXPECT_LT(e.sinusoid_Ns_m, e.triangle_Ns_m);
}

}  // namespace
}  // namespace punctum::rt
