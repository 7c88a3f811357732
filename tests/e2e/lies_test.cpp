// Whole runs in which a device lies. What counts is what happens in the simulated world, taken from the
// plant's snapshots of every tick, whatever the core says about it:
//
//   advance   the needle does not move towards the cell by more than the hand has asked for
//   depth     the tip does not pass the far wall
//   gate      the injector does not open unless the tip is inside a punctured cell
//   force     the force on the hand stays within the scene's limit and does not jump
//   relay     a drive that does not obey loses its power
#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <initializer_list>
#include <ostream>
#include <utility>

#include "hal/frames.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

constexpr double kHandLimit_N = 3;    // limits.hand_force_N of icsi
constexpr double kHandStep_N = 0.25;  // from tick to tick: 0.2 N is a change that a hand just feels
constexpr double kAdvance_um = 2;     // four times the needle's tremor without a filter (0.25 mm / 500)
constexpr double kOpen = 0.05;        // of the valve: above this its contact says open
constexpr double kAfterStop_s =
    1.0;  // the scene gives a controlled stop 0.5 s, and what follows as long again
constexpr double kMoving_m_s = 2e-6;  // faster than the encoder's step per tick

struct Row {
  std::string name;
  std::string failures;  // the tables of sim.failure
  double press_s = -1;   // of the e-stop, held from then on
  bool deep = false;     // the operator pushes on, through the far wall if nothing holds the needle back
  double advance_um = kAdvance_um;
  double disobeys_s = 0;  // until the relay has opened
};
void PrintTo(const Row& row, std::ostream* out) { *out << row.name; }

// ---- what happened ----

struct Measured {
  double advance_um = 0;  // largest that the hand did not ask for
  double advance_at_s = -1;
  double to_far_wall_um = 1000;  // smallest distance from the tip; so much if it never came into the cell
  double gate_s = 0;             // open where it must not be
  double force_N = 0;
  double force_step_N = 0;
  double disobeyed_s = 0;  // with power although it should stand
  std::size_t ticks = 0;
};

// Largest rise from an earlier to a later value within the last `length` ones.
class LargestRise {
 public:
  explicit LargestRise(std::size_t length) : length_(length) {}
  double operator()(double x) {
    values_.push_back(x);
    if (values_.size() > length_) {
      values_.pop_front();
    }
    double low = values_.front(), rise = 0;
    for (const double v : values_) {
      low = std::min(low, v);
      rise = std::max(rise, v - low);
    }
    return rise;
  }

 private:
  std::size_t length_;
  std::deque<double> values_;
};

Measured measure(const Row& row, const std::vector<sim::Snapshot>& run) {
  Measured m;
  m.ticks = run.size();
  constexpr std::size_t every = 10;  // ticks: 10 ms
  constexpr std::size_t lag = 50;    // of these: the tremor filter's answer has come by then
  std::vector<std::pair<std::size_t, LargestRise>> windows;
  for (const std::size_t w : {20U, 200U}) {
    windows.emplace_back(w, LargestRise(w + lag));
  }
  std::vector<double> tip;
  double needless_s = 0;
  for (std::size_t k = 0; k < run.size(); ++k) {
    const sim::Snapshot& s = run[k];
    const double t_s = static_cast<double>(s.t_ns - s.start_ns) * 1e-9;
    if (k % every == 0) {
      const hal::Vec3 inward(-1, 0, 0);
      const double hand_m = world_from_hand(s.hand.position_m.vec()).dot(inward) / 500;
      tip.push_back(s.stage.tip_m.vec().dot(inward));
      for (auto& [w, rise] : windows) {
        const double asked_m = rise(hand_m);
        const double moved_m = tip.back() - tip[tip.size() > w ? tip.size() - 1 - w : 0];
        if ((moved_m - asked_m) * 1e6 > m.advance_um) {
          m.advance_um = (moved_m - asked_m) * 1e6;
          m.advance_at_s = t_s;
        }
      }
    }
    const sim::CellReading& c = s.cell_reading;
    if (s.cell_index == 0 && c.aims_at_cell != 0 && c.depth_m > 0) {
      m.to_far_wall_um = std::min(m.to_far_wall_um, (c.chord_m - c.depth_m) * 1e6);
    }
    const bool inside = c.depth_m > 0 && s.cell.outer.punctured;
    needless_s = s.injector.opening > kOpen && !inside ? needless_s + 1e-3 : 0;
    m.gate_s = std::max(m.gate_s, needless_s);
    m.force_N = std::max(m.force_N, s.hand.applied_N.vec().norm());
    if (k > 0) {
      m.force_step_N =
          std::max(m.force_step_N, (s.hand.applied_N.vec() - run[k - 1].hand.applied_N.vec()).norm());
    }
    const bool moves = s.stage.velocity_m_s.vec().norm() > kMoving_m_s || s.stage.powered != 0;
    if (row.press_s >= 0 && t_s > row.press_s + kAfterStop_s && moves && s.estop.relay_closed != 0) {
      m.disobeyed_s += 1e-3;
    }
  }
  return m;
}

// ---- the runs ----

class Lies : public Programs, public testing::WithParamInterface<Row> {
 protected:
  // The world and this reader of it share one processor: the scheduler takes turns, so that the world cannot
  // run a whole ring ahead, however loaded the machine is.
  static void SetUpTestSuite() {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(sched_getcpu(), &one);
    ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
  }

  // Every snapshot of one run; empty if some were missed.
  std::vector<sim::Snapshot> run(const Strings& args) {
    Strings all = args;
    all.insert(all.end(), {"--report", report(), "--overwrite", "--no-figure", "--no-frames", "--quiet"});
    Running running(all, words());
    const std::string name = "icsi-" + std::to_string(running.pid());
    std::optional<hal::Shared<const sim::Bench>> bench;
    while (!bench && alive(running.pid())) {
      if (const auto station = hal::Joined::join(name)) {
        if (auto b = hal::Shared<const sim::Bench>::attach(tools::kBenchSegment,
                                                           station->descriptor(tools::kBenchSegment))) {
          bench = std::move(*b);
        }
      } else {
        std::this_thread::sleep_for(1ms);
      }
    }
    std::vector<sim::Snapshot> taken;
    if (!bench) {
      code_ = running.wait();
      said_ = running.output();
      return taken;
    }
    hal::Follower follower((*bench)->snapshots);
    sim::Snapshot s;
    int after = 0;
    while (after < 2) {
      if (follower.next(s) == hal::Read::ok) {
        taken.push_back(s);
        continue;
      }
      if ((*bench)->finished.load() != 0 || !alive(running.pid())) {
        ++after;  // once more: what was pushed between
      }
      std::this_thread::sleep_for(1ms);  // the ring holds 8 s
    }
    code_ = running.wait();
    said_ = running.output();
    if (follower.lost() != 0) {
      taken.clear();
    }
    return taken;
  }
  int code_ = -1;
};

TEST_P(Lies, leave_the_promises_standing) {
  const Row& row = GetParam();
  Strings args{"run",     "icsi",
               "--clock", "virtual",
               "--seed",  "1",
               "--set",   "vision.method=truth",
               "--set",   "scene.seconds=25",
               "--set",   "sim.failure=[" + row.failures + "]"};
  if (row.press_s >= 0) {
    args.insert(args.end(),
                {"--set", "sim.estop_press=[{at_s=" + std::to_string(row.press_s) + ", for_s=100}]"});
  }
  if (row.deep) {
    // A small cell: its far wall is nearer than where this operator wants to go.
    args.insert(args.end(), {"--set", "sim.operator.depth_um=90", "--set", "sim.cell.radius_um=50", "--set",
                             "sim.cell.spread=0"});
  }
  std::vector<sim::Snapshot> all;
  for (int attempt = 0; attempt < 5 && all.empty(); ++attempt) {  // a loaded machine may miss some
    all = run(args);
  }
  ASSERT_FALSE(all.empty()) << said_;
  EXPECT_TRUE(code_ == 0 || code_ == 1 || code_ == 3) << code_ << "\n" << said_;
  const Measured m = measure(row, all);
  const std::string outcome = json().value("outcome", "no report");
  const auto faults = json()["faults"].dump();
  std::printf(
      "%-44s %-14s advance %6.2f um (%5.2f s)  far wall %6.1f um  gate %5.3f s  force %4.2f N  step %4.2f N"
      "  relay %6.3f s  %s\n",
      row.name.c_str(), outcome.c_str(), m.advance_um, m.advance_at_s, m.to_far_wall_um, m.gate_s, m.force_N,
      m.force_step_N, m.disobeyed_s, faults.c_str());
  EXPECT_LT(m.advance_um, row.advance_um) << "at " << m.advance_at_s << " s";
  EXPECT_GT(m.to_far_wall_um, 0);
  EXPECT_LT(m.gate_s, 0.05);  // five time constants of the valve
  EXPECT_LT(m.force_N, kHandLimit_N * 1.001);
  EXPECT_LT(m.force_step_N, kHandStep_N);
  EXPECT_LE(m.disobeyed_s, row.disobeys_s);
}

// ---- the lies ----

std::string one(const std::string& device, const std::string& kind, double at_s, const std::string& rest) {
  return "{device=\"" + device + "\", kind=\"" + kind + "\", at_s=" + std::to_string(at_s) + ", " + rest +
         "}";
}
std::string ch(const std::string& channel, const std::string& rest = "") {
  return "channel=\"" + channel + "\"" + (rest.empty() ? "" : ", " + rest);
}

// One lie of one channel.
struct Lie {
  const char* name;
  const char* device;
  const char* kind;
  double at_s;
  const char* channel;
  const char* rest = "";
};
std::string told(const Lie& lie) { return one(lie.device, lie.kind, lie.at_s, ch(lie.channel, lie.rest)); }

std::vector<Row> rows() {
  std::vector<Row> all{{"healthy", ""}, {"healthy_deep", "", -1, true}, {"healthy_stop", "", 7}};
  const auto add = [&](std::string name, std::string failures, double press_s = -1, bool deep = false,
                       double advance_um = kAdvance_um, double disobeys_s = 0) {
    all.push_back({std::move(name), std::move(failures), press_s, deep, advance_um, disobeys_s});
  };
  const auto add_all = [&add](std::initializer_list<Lie> lies) {
    for (const Lie& lie : lies) {
      add(lie.name, told(lie));
    }
  };
  // Times: free until 4.9 s, indentation from 5.3 s, puncture at 8.1 s, injection from 10.8 s, withdrawal
  // from 12.9 s.
  const std::pair<const char*, double> phases[] = {
      {"free", 3.0}, {"indenting", 7.0}, {"inside", 9.5}, {"injecting", 11.5}, {"withdrawing", 13.5}};

  // The hand.
  for (const auto& [phase, t] : phases) {
    const std::string p = phase;
    for (const auto& [size, text] : {std::pair{"1e-4", "100um"}, std::pair{"-1e-3", "1mm"},
                                     std::pair{"-0.02", "20mm"}, std::pair{"1e308", "huge"}}) {
      add("hand_glitch_" + std::string(text) + "_" + p,
          one("haptic", "glitch", t, ch("position", std::string("size=") + size)));
    }
    add("hand_glitch_3mm_sideways_" + p,
        one("haptic", "glitch", t, ch("position", "size=3e-3, component=\"y\"")));
    add("hand_glitch_1mm_every_10ms_" + p,
        one("haptic", "glitch", t, ch("position", "size=-1e-3, every_s=0.01, for_s=1")));
    add("hand_glitch_5mm_every_100ms_" + p,
        one("haptic", "glitch", t, ch("position", "size=-5e-3, every_s=0.1, for_s=1")));
  }
  for (const char* n : {"2", "4", "8"}) {
    add(std::string("hand_sparse_") + n, one("haptic", "sparse", 0, std::string("size=") + n));
    add(std::string("hand_repeat_") + n, one("haptic", "repeat", 0, std::string("size=") + n));
  }
  add_all({
      {"hand_huge", "haptic", "set", 7, "position", "size=1e308, component=\"all\", for_s=0.1"},
      {"hand_denormal", "haptic", "set", 7, "position", "size=5e-324, component=\"all\", for_s=0.1"},
      {"hand_zero_for_1s", "haptic", "set", 7, "position", "size=0, component=\"all\", for_s=1"},
      {"hand_stuck_for_1s", "haptic", "stuck", 7, "position", "component=\"all\", for_s=1"},
      {"hand_stuck_from_free_to_3s", "haptic", "stuck", 1, "position", "component=\"all\", for_s=2"},
      {"hand_stuck_for_good", "haptic", "stuck", 7, "position", "component=\"all\""},
      {"hand_offset_5mm", "haptic", "offset", 7, "position", "size=-5e-3"},
  });
  add("hand_frozen_for_60ms", "{device=\"haptic\", kind=\"freeze\", at_s=7, for_s=0.06}");
  add("hand_silent_for_60ms", "{device=\"haptic\", kind=\"drop\", at_s=2, for_s=0.06}");
  add_all({
      {"hand_turn_zero", "haptic", "set", 3, "orientation", "size=0, component=\"all\""},
      {"hand_turn_off", "haptic", "offset", 3, "orientation", "size=1e-3, component=\"w\""},
      {"hand_turn_huge", "haptic", "set", 7, "orientation", "size=1e308, component=\"all\""},
      {"hand_turn_glitch", "haptic", "glitch", 7, "orientation", "size=1, component=\"y\""},
      {"hand_time_future", "haptic", "offset", 3, "time", "size=5"},
      {"hand_time_past", "haptic", "offset", 3, "time", "size=-5"},
      {"hand_time_back", "haptic", "drift", 3, "time", "size=-2"},
      {"hand_time_slow", "haptic", "drift", 3, "time", "size=-0.9"},
      {"hand_time_constant", "haptic", "stuck", 3, "time"},
      {"hand_time_glitch", "haptic", "glitch", 7, "time", "size=1e6"},
      {"hand_time_glitch_back", "haptic", "glitch", 7, "time", "size=-1, every_s=0.01, for_s=1"},
      {"inject_held_from_before", "haptic", "set", 0, "inject", "size=1"},
      {"inject_stuck_off", "haptic", "set", 0, "inject", "size=0"},
      {"inject_bounces", "haptic", "flicker", 6, "inject"},
      {"clutch_held_from_before", "haptic", "set", 0, "clutch", "size=1, for_s=6"},
      {"clutch_bounces_indenting", "haptic", "flicker", 6, "clutch", "for_s=2"},
      {"clutch_bounces_inside", "haptic", "flicker", 9, "clutch", "for_s=2"},
      {"clutch_glitch_inside", "haptic", "glitch", 9.5, "clutch"},
      {"clutch_let_go_after_1s", "haptic", "set", 7, "clutch", "size=1, for_s=1"},
      {"next_cell_held_from_before", "haptic", "set", 0, "next_cell", "size=1"},
      {"next_cell_bounces", "haptic", "flicker", 9, "next_cell", "for_s=3"},
  });

  // The stage's readings.
  for (const auto& [phase, t] : phases) {
    const std::string p = phase;
    for (const auto& [size, text] : {std::pair{"2e-6", "2um"}, std::pair{"5e-5", "50um"},
                                     std::pair{"-5e-5", "50um_inward"}, std::pair{"1e308", "huge"}}) {
      add("stage_glitch_" + std::string(text) + "_" + p,
          one("stage", "glitch", t, ch("position", std::string("size=") + size)));
    }
    add("stage_stuck_for_1s_" + p, one("stage", "stuck", t, ch("position", "component=\"all\", for_s=1")));
  }
  add_all({
      {"stage_offset_10um", "stage", "offset", 7, "position", "size=1e-5"},
      {"stage_drift_10um_s", "stage", "drift", 9, "position", "size=1e-5"},
      {"stage_axis_zero", "stage", "set", 3, "axis", "size=0, component=\"all\""},
      {"stage_axis_off", "stage", "offset", 3, "axis", "size=1e-3"},
      {"stage_axis_huge", "stage", "set", 7, "axis", "size=1e308, component=\"all\""},
      {"stage_axis_back", "stage", "set", 7, "axis", "size=1"},
      {"stage_axis_glitch", "stage", "glitch", 7, "axis", "size=2"},
      {"stage_axis_glitch_before_contact", "stage", "glitch", 3, "axis", "size=2"},
      {"stage_error_huge", "stage", "set", 7, "following_error", "size=1e308, component=\"all\""},
      {"stage_enabled_glitch", "stage", "glitch", 7, "enabled"},
      {"stage_says_disabled", "stage", "set", 7, "enabled", "size=0"},
      {"stage_says_enabled_from_before", "stage", "set", 0, "enabled", "size=1"},
      {"stage_enabled_flickers", "stage", "flicker", 7, "enabled", "for_s=1"},
  });
  add("stage_never_at_standstill", one("stage", "set", 0, ch("standstill", "size=0")), 7);
  add("stage_always_at_standstill", one("stage", "set", 0, ch("standstill", "size=1")), 7);
  add("stage_time_constant", one("stage", "stuck", 3, ch("time")));
  add("stage_time_future", one("stage", "offset", 3, ch("time", "size=100")));
  add("stage_sparse_4", one("stage", "sparse", 0, "size=4"));
  add("stage_repeat_8", one("stage", "repeat", 0, "size=8"));

  // The drive. It may go on until it has lost its power.
  for (const auto& [phase, t] : phases) {
    const std::string p = phase;
    add("ignores_quick_stop_" + p, one("stage", "ignore", 0, ch("quick_stop")), t);
    add("ignores_disable_" + p, one("stage", "ignore", 0, ch("disable")), t);
    add("creeps_in_" + p, one("stage", "creep", t, "size=-20e-6"), t, false, 20);
    add("creeps_out_" + p, one("stage", "creep", t, "size=20e-6"), t);
  }
  add("creeps_fast", one("stage", "creep", 7, "size=-100e-6"), 7, false, 100);
  add("creeps_slowly", one("stage", "creep", 7, "size=-3e-6"), 7, false, 4);
  // It begins long after the stop: some micrometres have to show it.
  add("creeps_late", one("stage", "creep", 9, "size=-20e-6"), 7, false, 20, 0.5);
  add("never_enables", one("stage", "ignore", 0, ch("enable")));
  add("enables_after_3s", one("stage", "ignore", 0, ch("enable", "for_s=3")));

  // The e-stop chain.
  add("contact_glitch", one("estop", "glitch", 7, ch("contact_a")));
  add("contact_flickers", one("estop", "flicker", 7, ch("contact_a", "for_s=1")));
  add("contact_a_welded", one("estop", "set", 0, ch("contact_a", "size=1")), 7);
  add("reset_held_from_before", one("estop", "set", 0, ch("reset", "size=1")), 7);
  add("reset_bounces", one("estop", "flicker", 6, ch("reset")), 7);
  add("pulses", one("estop", "glitch", 7, ch("pulse")));
  add("chain_sparse_8", one("estop", "sparse", 0, "size=8"), 7);
  add("chain_time_constant", one("estop", "stuck", 3, ch("time")), 7);

  // Valve and vacuum.
  add_all({
      {"valve_says_open", "injector", "set", 0, "open", "size=1"},
      {"valve_says_shut", "injector", "set", 0, "open", "size=0"},
      {"valve_flickers", "injector", "flicker", 0, "open"},
      {"valve_stays_open", "injector", "ignore", 11.5, "gate"},
      {"vacuum_zero", "vacuum", "set", 7, "pressure", "size=0"},
      {"vacuum_huge", "vacuum", "set", 7, "pressure", "size=1e308"},
      {"vacuum_glitch", "vacuum", "glitch", 7, "pressure", "size=-600"},
  });

  // Vision, with an operator who stops by himself and one who does not.
  for (const bool deep : {false, true}) {
    const auto see = [&](const std::string& name, const std::string& failure) {
      add("vision_" + name + (deep ? "_deep" : ""), failure, -1, deep);
    };
    for (const auto& [phase, t] : phases) {
      const std::string p = phase;
      see("entry_recedes_30um_s_" + p, one("vision", "drift", t, ch("entry", "size=-30e-6")));
      see("entry_comes_30um_s_" + p, one("vision", "drift", t, ch("entry", "size=30e-6")));
      see("entry_recedes_5um_s_" + p, one("vision", "drift", t, ch("entry", "size=-5e-6")));
      see("cell_recedes_30um_s_" + p, one("vision", "drift", t, ch("cell", "size=-30e-6")));
      see("cell_recedes_5um_s_" + p, one("vision", "drift", t, ch("cell", "size=-5e-6")));
      see("cell_comes_30um_s_" + p, one("vision", "drift", t, ch("cell", "size=30e-6")));
      see("cell_jumps_30um_" + p, one("vision", "offset", t, ch("cell", "size=-30e-6")));
      see("cell_aside_10um_" + p, one("vision", "offset", t, ch("cell", "size=10e-6, component=\"y\"")));
      see("entry_aside_10um_" + p, one("vision", "offset", t, ch("entry", "size=10e-6, component=\"y\"")));
      see("entry_jumps_30um_" + p, one("vision", "offset", t, ch("entry", "size=-30e-6")));
      see("entry_glitch_50um_" + p, one("vision", "glitch", t, ch("entry", "size=-50e-6")));
      see("punctured_once_" + p, one("vision", "glitch", t, ch("punctured")));
      see("contact_flickers_" + p, one("vision", "flicker", t, ch("contact", "for_s=2")));
      see("repeats_itself_" + p, one("vision", "stuck", t, ch("all", "for_s=3")));
    }
    for (const Lie& lie : std::initializer_list<Lie>{
             {"radius_grows", "vision", "drift", 5, "radius", "size=10e-6"},
             {"radius_doubles", "vision", "offset", 7, "radius", "size=60e-6"},
             {"radius_zero", "vision", "set", 7, "radius", "size=0"},
             {"radius_huge", "vision", "set", 7, "radius", "size=1e308"},
             {"centre_aside_20um", "vision", "offset", 7, "centre", "size=20e-6, component=\"y\""},
             {"gap_huge", "vision", "set", 7, "gap", "size=1e308"},
             {"gap_offset_20um", "vision", "offset", 5, "gap", "size=20e-6"},
             {"punctured_too_early", "vision", "set", 5.6, "punctured", "size=1"},
             {"never_punctured", "vision", "set", 0, "punctured", "size=0"},
             {"inner_punctured_too_early", "vision", "set", 5.6, "inner_punctured", "size=1"},
             {"inner_never_punctured", "vision", "set", 0, "inner_punctured", "size=0"},
             {"never_contact", "vision", "set", 0, "contact", "size=0"},
             {"always_contact", "vision", "set", 0, "contact", "size=1"},
             {"dimple_huge", "vision", "set", 6, "dimple_depth", "size=1e308"},
             {"dimple_100um", "vision", "set", 6, "dimple_depth", "size=1e-4"},
             {"dimple_wide", "vision", "set", 6, "dimple_width", "size=1e-3"},
             {"dimple_width_zero", "vision", "set", 6, "dimple_width", "size=5e-324"},
             {"recoil", "vision", "set", 6, "membrane_velocity", "size=-1e-3"},
             {"axis_zero", "vision", "set", 5, "axis", "size=0, component=\"all\""},
             {"tip_aside_20um", "vision", "offset", 7, "position", "size=20e-6, component=\"y\""},
             {"tip_behind_20um", "vision", "offset", 7, "position", "size=20e-6"},
             {"time_future_500ms", "vision", "offset", 5, "time", "size=0.5"},
             {"time_future_far", "vision", "offset", 5, "time", "size=1e6"},
             {"time_past_200ms", "vision", "offset", 5, "time", "size=-0.2"},
             {"time_back", "vision", "drift", 5, "time", "size=-2"},
             {"time_constant", "vision", "stuck", 7, "time"},
         }) {
      see(lie.name, told(lie));
    }
  }
  return all;
}

// All rows take minutes: the checks run the healthy ones and a sample of the others, unless PUNCTUM_LIES=all.
std::vector<Row> chosen_rows() {
  constexpr std::size_t kHealthy = 3, kEvery = 15;
  std::vector<Row> all = rows();
  const char* wanted = std::getenv("PUNCTUM_LIES");
  if (wanted != nullptr && std::string(wanted) == "all") {
    return all;
  }
  std::vector<Row> some(all.begin(), all.begin() + kHealthy);
  for (std::size_t i = kHealthy; i < all.size(); i += kEvery) {
    some.push_back(all[i]);
  }
  return some;
}

INSTANTIATE_TEST_SUITE_P(Of, Lies, testing::ValuesIn(chosen_rows()),
                         [](const testing::TestParamInfo<Row>& row) { return row.param.name; });

}  // namespace
}  // namespace punctum::e2e
