// Every device of the station times every fault. What each cell must lead to is stated before it is run, from
// the table of rt/control/safety_latch.hpp, the invariants of rt/control/README.md (L4, M11, F5) and the
// time-outs in the headers of rt/control; never from a run. Measured: ticks from the first one of the fault
// to the state, the motion of the true needle afterwards, and every invariant of tests/support. The table is
// printed, a line for each cell.
//
// The needle is inside the cell, in phase injection with the gate open, and the hand trembles, so that a
// needle that still follows it shows. A tick is 1 ms.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "rt/station/alarm.hpp"
#include "rt/station/fault.hpp"
#include "tests/support/lying_devices.hpp"

namespace punctum::rt::test {
namespace {

using hal::Status;

enum class Fails : std::uint8_t {
  absent,
  silent,
  late,
  wrong,
  nan,
  frozen,
  garbage,
  half_rate,
  unplugged,
  returns
};
constexpr int kFails = 10;
constexpr const char* kFailNames[kFails] = {"absent", "silent",  "late",      "wrong",     "NaN",
                                            "frozen", "garbage", "half rate", "unplugged", "returns"};

enum class Part : std::uint8_t { hand, stage, estop, enabling, injector, vacuum, sensor, camera, vision };
constexpr int kParts = 9;
constexpr const char* kPartNames[kParts] = {"hand",   "stage",        "e-stop", "enabling", "injector",
                                            "vacuum", "force sensor", "camera", "vision"};

// The state that a cell must lead to.
enum class Safe : std::uint8_t {
  stop,      // the stop of the table, the heartbeat goes on
  relay,     // the same, and the heartbeat ends
  withdraw,  // vision is stale: the gate is shut, nothing moves inwards, forces of the cell are gone
  alarm,     // it goes on, and somebody sees the alarm
  goes_on,   // as if nothing were wrong
  senseless,
};

struct Cell {
  Part part;
  Fails fails;
  Safe safe;
  Fault cause;          // of a stop: the first
  std::uint32_t alarm;  // otherwise
  int within;           // ticks
  const char* why;      // where the expectation is from; of a senseless cell the reason
};

constexpr Fault kNone = Fault::none;

// Time-outs: hand and stage 20 ms (`timeout_ms`), and 2 T by L4; e-stop 50 ms by L4; vacuum 100 ms to be read
// as lost and 100 ms of `window_ms`; injector's contact and force sensor 100 ms; vision stale 300 ms from the
// last exposure and 30 ms by M11. `disconnected` and `fault` are told at once: on the first tick.
constexpr Cell kCells[] = {
    {Part::hand, Fails::absent, Safe::relay, Fault::hand_lost, 0, 1,
     "fault.hpp: disconnected; it takes no force: H5"},
    {Part::hand, Fails::silent, Safe::stop, Fault::hand_lost, 0, 22, "L4"},
    {Part::hand, Fails::late, Safe::stop, Fault::hand_lost, 0, 22,
     "sample_clock.hpp: older than the time-out is silent"},
    {Part::hand, Fails::wrong, Safe::stop, Fault::hand_invalid, 0, 22,
     "fault.hpp: jumped further than a hand can"},
    {Part::hand, Fails::nan, Safe::stop, Fault::hand_invalid, 0, 22, "fault.hpp: not finite"},
    {Part::hand, Fails::frozen, Safe::stop, Fault::hand_lost, 0, 22, "hal/README: its old time shows it; L4"},
    {Part::hand, Fails::garbage, Safe::stop, Fault::hand_invalid, 0, 22, "fault.hpp"},
    {Part::hand, Fails::half_rate, Safe::goes_on, kNone, 0, 0, "hal/README: devices have rates of their own"},
    {Part::hand, Fails::unplugged, Safe::relay, Fault::hand_lost, 0, 1,
     "fault.hpp: disconnected; it takes no force: H5"},
    {Part::hand, Fails::returns, Safe::relay, Fault::hand_lost, 0, 1,
     "safety_latch.hpp: release_and_reset; H5"},

    {Part::stage, Fails::absent, Safe::relay, Fault::stage_lost, 0, 1, "safety_latch.hpp"},
    {Part::stage, Fails::silent, Safe::relay, Fault::stage_lost, 0, 22, "L4"},
    {Part::stage, Fails::late, Safe::relay, Fault::stage_lost, 0, 22, "sample_clock.hpp"},
    {Part::stage, Fails::wrong, Safe::relay, Fault::stage_following, 0, 1,
     "following.hpp: further than following_error_um"},
    {Part::stage, Fails::nan, Safe::relay, Fault::stage_fault, 0, 1, "README: each channel has a range"},
    {Part::stage, Fails::frozen, Safe::relay, Fault::stage_lost, 0, 22, "L4"},
    {Part::stage, Fails::garbage, Safe::relay, Fault::stage_fault, 0, 1, "README: each channel has a range"},
    {Part::stage, Fails::half_rate, Safe::goes_on, kNone, 0, 0, "hal/README"},
    {Part::stage, Fails::unplugged, Safe::relay, Fault::stage_lost, 0, 1, "safety_latch.hpp"},
    {Part::stage, Fails::returns, Safe::relay, Fault::stage_lost, 0, 1,
     "safety_latch.hpp: release_and_reset"},

    {Part::estop, Fails::absent, Safe::relay, Fault::estop_lost, 0, 1, "safety_latch.hpp"},
    {Part::estop, Fails::silent, Safe::relay, Fault::estop_lost, 0, 50, "L4"},
    {Part::estop, Fails::late, Safe::relay, Fault::estop_lost, 0, 50, "L4, sample_clock.hpp"},
    {Part::estop, Fails::wrong, Safe::stop, Fault::estop, 0, 1, "L3: one contact told open"},
    {Part::estop, Fails::nan, Safe::relay, Fault::estop_lost, 0, 1,
     "it has no numbers: it reports a fault (failures.hpp)"},
    {Part::estop, Fails::frozen, Safe::relay, Fault::estop_lost, 0, 50, "L4"},
    {Part::estop, Fails::garbage, Safe::stop, Fault::estop, 0, 3,
     "L3: one of three random bits on nearly every tick"},
    {Part::estop, Fails::half_rate, Safe::goes_on, kNone, 0, 0, "hal/README"},
    {Part::estop, Fails::unplugged, Safe::relay, Fault::estop_lost, 0, 1, "safety_latch.hpp"},
    {Part::estop, Fails::returns, Safe::relay, Fault::estop_lost, 0, 1,
     "safety_latch.hpp: release_and_reset"},

    {Part::enabling, Fails::absent, Safe::stop, Fault::enabling_fault, 0, 1, "fault.hpp: cannot be read"},
    {Part::enabling, Fails::silent, Safe::stop, Fault::enabling_fault, 0, 22, "L4"},
    {Part::enabling, Fails::late, Safe::stop, Fault::enabling_fault, 0, 22,
     "sample_clock.hpp: older than the time-out is silent"},
    {Part::enabling, Fails::wrong, Safe::stop, Fault::enabling_released, 0, 22,
     "L9: one contact told open for release_ms"},
    {Part::enabling, Fails::nan, Safe::stop, Fault::enabling_fault, 0, 1,
     "it has no numbers: it reports a fault"},
    {Part::enabling, Fails::frozen, Safe::stop, Fault::enabling_fault, 0, 22,
     "hal/README: its old time shows it; L4"},
    {Part::enabling, Fails::garbage, Safe::stop, Fault::enabling_released, 0, 1000,
     "let go on 7 of 8 readings: for release_ms in a row about every 107 ticks"},
    {Part::enabling, Fails::half_rate, Safe::goes_on, kNone, 0, 0, "hal/README"},
    {Part::enabling, Fails::unplugged, Safe::stop, Fault::enabling_fault, 0, 1, "fault.hpp: cannot be read"},
    {Part::enabling, Fails::returns, Safe::stop, Fault::enabling_fault, 0, 1,
     "safety_latch.hpp: release_and_reset"},

    {Part::injector, Fails::absent, Safe::alarm, kNone, alarm_sensor, 1,
     "alarm.hpp; its gate was never opened"},
    {Part::injector, Fails::silent, Safe::relay, Fault::injector_open, 0, 352,
     "an injector that fell silent with its gate open counts as open: 100 ms, then shut_within_ms"},
    {Part::injector, Fails::late, Safe::relay, Fault::injector_open, 0, 352,
     "older than 100 ms is silent, then shut_within_ms"},
    {Part::injector, Fails::wrong, Safe::relay, Fault::injector_open, 0, 272,
     "config.hpp: shut_within_ms, after a release that has lasted (lasting_button.hpp)"},
    {Part::injector, Fails::nan, Safe::relay, Fault::injector_open, 0, 352,
     "it has no numbers: it reports a fault; 100 ms, then shut_within_ms"},
    {Part::injector, Fails::frozen, Safe::relay, Fault::injector_open, 0, 352,
     "hal/README: its old time shows it; 100 ms, then shut_within_ms"},
    {Part::injector, Fails::garbage, Safe::goes_on, kNone, 0, 0,
     "config.hpp: a fault is open for longer than shut_within_ms"},
    {Part::injector, Fails::half_rate, Safe::goes_on, kNone, 0, 0, "hal/README"},
    {Part::injector, Fails::unplugged, Safe::relay, Fault::injector_open, 0, 352,
     "100 ms, then shut_within_ms"},
    {Part::injector, Fails::returns, Safe::relay, Fault::injector_open, 0, 352,
     "safety_latch.hpp: release_and_reset"},

    {Part::vacuum, Fails::absent, Safe::stop, Fault::vacuum_lost, 0, 102, "config.hpp: window_ms"},
    {Part::vacuum, Fails::silent, Safe::stop, Fault::vacuum_lost, 0, 102, "config.hpp: window_ms"},
    {Part::vacuum, Fails::late, Safe::stop, Fault::vacuum_lost, 0, 202,
     "older than window_ms is silent, then window_ms"},
    {Part::vacuum, Fails::wrong, Safe::stop, Fault::vacuum_lost, 0, 102, "config.hpp: min_Pa for window_ms"},
    {Part::vacuum, Fails::nan, Safe::stop, Fault::vacuum_lost, 0, 102,
     "README: each channel has a range; window_ms"},
    {Part::vacuum, Fails::frozen, Safe::stop, Fault::vacuum_lost, 0, 202,
     "silent after window_ms, then window_ms"},
    {Part::vacuum, Fails::garbage, Safe::stop, Fault::vacuum_lost, 0, 102,
     "README: each channel has a range"},
    {Part::vacuum, Fails::half_rate, Safe::goes_on, kNone, 0, 0, "hal/README"},
    {Part::vacuum, Fails::unplugged, Safe::stop, Fault::vacuum_lost, 0, 102, "config.hpp: window_ms"},
    {Part::vacuum, Fails::returns, Safe::stop, Fault::vacuum_lost, 0, 102,
     "safety_latch.hpp: release_and_reset"},

    {Part::sensor, Fails::absent, Safe::alarm, kNone, alarm_sensor, 1,
     "README: the law's force counts beside it"},
    {Part::sensor, Fails::silent, Safe::alarm, kNone, alarm_sensor, 1, "alarm.hpp"},
    {Part::sensor, Fails::late, Safe::alarm, kNone, alarm_sensor, 101, "alarm.hpp: unusable data"},
    {Part::sensor, Fails::wrong, Safe::stop, Fault::tip_force, 0, 22,
     "limits.hpp: tip_force_hard_uN, a low-pass of 5 ms"},
    {Part::sensor, Fails::nan, Safe::alarm, kNone, alarm_sensor, 1, "alarm.hpp: unusable data"},
    {Part::sensor, Fails::frozen, Safe::alarm, kNone, alarm_sensor, 101, "alarm.hpp"},
    {Part::sensor, Fails::garbage, Safe::alarm, kNone, alarm_sensor, 1, "README: each channel has a range"},
    {Part::sensor, Fails::half_rate, Safe::goes_on, kNone, 0, 0, "hal/README"},
    {Part::sensor, Fails::unplugged, Safe::alarm, kNone, alarm_sensor, 1, "alarm.hpp"},
    {Part::sensor, Fails::returns, Safe::alarm, kNone, alarm_sensor, 1,
     "alarm.hpp: goes when its cause goes"},

    {Part::camera, Fails::absent, Safe::withdraw, kNone, alarm_vision_stale, 330, "M11"},
    {Part::camera, Fails::silent, Safe::withdraw, kNone, alarm_vision_stale, 330, "M11"},
    {Part::camera, Fails::late, Safe::withdraw, kNone, alarm_vision_stale, 330,
     "M11: exposures older than stale_after_s"},
    {Part::camera, Fails::wrong, Safe::withdraw, kNone, alarm_vision_stale, 330,
     "a shifted picture is refused, then stale"},
    {Part::camera, Fails::nan, Safe::senseless, kNone, 0, 0, "a pixel is a byte"},
    {Part::camera, Fails::frozen, Safe::senseless, kNone, 0, 0, "told by vision: see vision, frozen"},
    {Part::camera, Fails::garbage, Safe::withdraw, kNone, alarm_vision_stale, 330,
     "vision finds neither tip nor cell"},
    {Part::camera, Fails::half_rate, Safe::goes_on, kNone, 0, 0,
     "architecture: whatever rate the camera gives"},
    {Part::camera, Fails::unplugged, Safe::withdraw, kNone, alarm_vision_stale, 330, "M11"},
    {Part::camera, Fails::returns, Safe::withdraw, kNone, alarm_vision_stale, 330, "M11"},

    {Part::vision, Fails::absent, Safe::withdraw, kNone, alarm_vision_stale, 330, "M11"},
    {Part::vision, Fails::silent, Safe::withdraw, kNone, alarm_vision_stale, 330, "M11"},
    {Part::vision, Fails::late, Safe::withdraw, kNone, alarm_vision_stale, 330, "M11"},
    {Part::vision, Fails::wrong, Safe::alarm, kNone, alarm_vision_implausible, 200,
     "README: claims more, is refused"},
    {Part::vision, Fails::nan, Safe::withdraw, kNone, alarm_vision_stale, 330, "N1, M11: cannot be believed"},
    {Part::vision, Fails::frozen, Safe::senseless, kNone, 0, 0,
     "with fresh times it is a needle and a cell at rest; "
     "with its old time it is silent"},
    {Part::vision, Fails::garbage, Safe::withdraw, kNone, alarm_vision_stale, 330, "M11: cannot be believed"},
    {Part::vision, Fails::half_rate, Safe::goes_on, kNone, 0, 0,
     "architecture: whatever rate the camera gives"},
    {Part::vision, Fails::unplugged, Safe::withdraw, kNone, alarm_vision_stale, 330,
     "M11: its process is gone"},
    {Part::vision, Fails::returns, Safe::withdraw, kNone, alarm_vision_stale, 330, "M11"},
};

// A device that answers, and fails from a tick on; one reading per tick.
template <class Reading>
struct Failing {
  Fails fails;
  std::function<void(Reading&, int tick)> wrong, garbage;
  int late_ticks;
  int tick = 0;
  std::vector<Reading> past{};

  Status operator()(Reading& out) {
    if constexpr (requires { out.pressure_Pa; }) {
      out.pressure_Pa += 0.01 * (tick % 7);  // a gauge's last digits, also at half the rate
    }
    if (past.empty()) {
      past.push_back(out);  // what was told last before
      past.back().sample_ns -= 1'000'000;
    }
    past.push_back(out);
    ++tick;
    const std::size_t now = past.size() - 1;
    switch (fails) {
      case Fails::absent:
      case Fails::unplugged:
        return Status::disconnected;
      case Fails::returns:
        return tick <= 500 ? Status::disconnected : Status::ok;
      case Fails::silent:
        return Status::no_data;
      case Fails::late:
        // What it told before stays the newest until then.
        out = past[now - std::min(now, static_cast<std::size_t>(late_ticks))];
        return Status::ok;
      case Fails::wrong:
        wrong(out, tick);
        return Status::ok;
      case Fails::nan:
        if constexpr (requires { out.pressure_Pa; }) {
          out.pressure_Pa = std::numeric_limits<double>::quiet_NaN();
        } else if constexpr (requires { out.axial_force_N; }) {
          out.axial_force_N = std::numeric_limits<double>::quiet_NaN();
        } else {
          return Status::fault;
        }
        return Status::ok;
      case Fails::frozen:
        out = past.front();
        return Status::ok;
      case Fails::garbage:
        garbage(out, tick);
        return Status::ok;
      case Fails::half_rate:
        out = past[now - now % 2];
        return Status::ok;
    }
    return Status::ok;
  }
};

std::uint64_t random_bits(int tick) {
  std::uint64_t z = static_cast<std::uint64_t>(tick) * 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  return z ^ (z >> 27);
}

ServoConfig whole_station(bool with_switch) {
  ServoConfig c = searched_config();
  c.force_sensor = true;
  c.injector->max_open_s = 60;
  if (with_switch) {
    c.enabling.emplace();
  }
  return c;
}

class FaultMatrix : public testing::Test {
 protected:
  static constexpr double kHandIn_m = -35e-3;
  static constexpr int kBraked = 60;   // after a quick stop: the stage of the test lags by 4 ms
  static constexpr int kTicks = 1600;  // of a cell

  // In phase injection, the gate open.
  void prepare() {
    from_start = std::make_unique<LyingStation::State>(station->state());
    LyingStation& s = *station;
    const std::vector<Event> in = {{1000, 3500, Lie::moves, kHandIn_m, 0}, {5200, 400, Lie::injects, 1, 0}};
    for (int k = 0; k < 5600; ++k) {
      s.tick(k, in);
    }
    s.truth.intention.x() = kHandIn_m;
    ASSERT_EQ(s.sample().phase, Phase::injection);
    ASSERT_TRUE(s.truth.gate);
    ASSERT_EQ(s.sample().alarms & (alarm_sensor | alarm_vision_stale | alarm_vision_implausible), 0U);
    injecting = std::make_unique<LyingStation::State>(s.state());
  }

  // The lies of hand, stage and vision; the other devices get a Failing.
  std::vector<Event> begin(Part part, Fails fails) {
    LyingStation& s = *station;
    std::vector<Event> e = {{0, kTicks, Lie::trembles, 0.25e-3, 0}, {0, kTicks, Lie::trembles, 0.25e-3, 1}};
    if (fails != Fails::absent) {
      e.push_back({0, kTicks, Lie::injects, 1, 0});
    }
    const int lasts = fails == Fails::returns ? 500 : kTicks;
    const bool gone = fails == Fails::absent || fails == Fails::unplugged || fails == Fails::returns;
    const auto lie = [&](Lie what, double value = 1, int axis = 0) {
      e.push_back({0, lasts, what, value, axis});
    };
    switch (part) {
      case Part::hand:
        if (gone) {
          lie(Lie::hand_gone);
          lie(Lie::hand_refuses_force);
        } else if (fails == Fails::silent) {
          lie(Lie::hand_no_data);
        } else if (fails == Fails::late) {
          lie(Lie::hand_late, 30);
        } else if (fails == Fails::wrong) {
          lie(Lie::hand_glitch, 20e-3);
        } else if (fails == Fails::nan) {
          lie(Lie::hand_nan);
        } else if (fails == Fails::frozen) {
          lie(Lie::hand_repeats);
        } else if (fails == Fails::half_rate) {
          lie(Lie::hand_every, 2);
        } else {
          for (int k = 0; k < kTicks; ++k) {
            e.push_back({k, 1, Lie::hand_absurd, static_cast<double>(random_bits(k + 1) >> 40), k % 3});
          }
        }
        break;
      case Part::stage:
        if (gone) {
          lie(Lie::stage_gone);
          lie(Lie::stage_refuses);
        } else if (fails == Fails::silent) {
          lie(Lie::stage_no_data);
        } else if (fails == Fails::late) {
          lie(Lie::stage_late, 30);
        } else if (fails == Fails::wrong) {
          lie(Lie::stage_offset, 50e-6, 1);
        } else if (fails == Fails::nan) {
          lie(Lie::stage_nan);
        } else if (fails == Fails::frozen) {
          lie(Lie::stage_repeats);
        } else if (fails == Fails::half_rate) {
          lie(Lie::stage_every, 2);
        } else {
          for (int k = 0; k < kTicks; ++k) {
            e.push_back({k, 1, Lie::stage_absurd, static_cast<double>(random_bits(k + 1) >> 40), k % 3});
          }
        }
        break;
      case Part::estop:
        s.tell_estop =
            Failing<hal::EstopState>{fails, [](hal::EstopState& r, int) { r.contact_a_closed = false; },
                                     [](hal::EstopState& r, int tick) {
                                       r.contact_a_closed = (random_bits(tick) & 1) != 0;
                                       r.contact_b_closed = (random_bits(tick) & 2) != 0;
                                       r.pulse_seen = (random_bits(tick) & 4) != 0;
                                     },
                                     60};
        break;
      case Part::enabling:
        s.tell_switch =
            Failing<hal::EnablingState>{fails, [](hal::EnablingState& r, int) { r.contact_a_closed = false; },
                                        [](hal::EnablingState& r, int tick) {
                                          r.contact_a_closed = (random_bits(tick) & 1) != 0;
                                          r.contact_b_closed = (random_bits(tick) & 2) != 0;
                                          r.pulse_seen = (random_bits(tick) & 4) != 0;
                                        },
                                        60};
        break;
      case Part::injector:
        s.tell_injector = Failing<hal::InjectorState>{
            fails, [](hal::InjectorState& r, int) { r.open = true; },
            [](hal::InjectorState& r, int tick) { r.open = (random_bits(tick) & 1) != 0; }, 150};
        break;
      case Part::vacuum:
        s.tell_vacuum = Failing<hal::VacuumState>{
            fails, [](hal::VacuumState& r, int) { r.pressure_Pa -= 550; },
            [](hal::VacuumState& r, int tick) { r.pressure_Pa = static_cast<double>(random_bits(tick)); },
            150};
        break;
      case Part::sensor:
        s.tell_sensor =
            Failing<hal::ForceState>{fails, [](hal::ForceState& r, int) { r.axial_force_N = 100e-6; },
                                     [](hal::ForceState& r, int tick) {
                                       r.axial_force_N = 1e-3 * static_cast<double>(random_bits(tick) >> 32);
                                     },
                                     150};
        break;
      case Part::camera:
      case Part::vision:
        if (gone || fails == Fails::silent) {
          lie(Lie::vision_gone);
        } else if (fails == Fails::late) {
          lie(Lie::vision_late, 0.5);
        } else if (fails == Fails::wrong) {
          lie(part == Part::camera ? Lie::picture_shifts : Lie::vision_jumps, 50e-6, 1);
        } else if (fails == Fails::nan) {
          lie(Lie::vision_nan);
        } else if (fails == Fails::half_rate) {
          s.frame_divisor = 2;
        } else {
          lie(Lie::vision_absurd, 1e9);
        }
        break;
    }
    return e;
  }

  struct Measured {
    int reached = 0;  // ticks of the fault until the state; 0: never
    Fault first = Fault::none;
    double moved_um = 0;   // the true needle, from kBraked after the state was reached
    double inward_um = 0;  // of it, into the cell
    std::string broken;
    std::string left;  // of what the state asks for
  };

  Measured run(const Cell& cell) {
    LyingStation& s = *station;
    Measured m;
    s.tell_estop = {};
    s.tell_switch = {};
    s.tell_injector = {};
    s.tell_vacuum = {};
    s.tell_sensor = {};
    s.frame_divisor = 1;
    std::vector<Event> events = begin(cell.part, cell.fails);
    if (cell.fails == Fails::absent) {
      station->restore(*from_start);
    } else {
      station->restore(*injecting);
    }
    // The injector's contact is told open while its gate is shut.
    const bool released = cell.part == Part::injector && cell.fails == Fails::wrong;
    if (released) {
      std::erase_if(events, [](const Event& e) { return e.lie == Lie::injects; });
    }
    s.checker().begin();
    const bool stops = cell.safe == Safe::stop || cell.safe == Safe::relay;
    // At the end the hand goes out by 10 um of the needle: a needle that sees nothing still comes out.
    const bool comes_out =
        cell.safe == Safe::withdraw && cell.fails != Fails::absent && cell.fails != Fails::returns;
    if (comes_out) {
      events.push_back({1000, 300, Lie::moves, 5e-3, 0});
    }
    hal::Vec3 was = s.truth.tip;
    double inward_from = 0;
    int toggles = 0;
    bool level = s.truth.level;
    bool shut_at_once = true;
    for (int k = 0; k < kTicks; ++k) {
      if (cell.fails == Fails::returns && k == 1000) {
        EXPECT_EQ(s.sample().stop == StopStage::running, !stops) << "a device that is back ends no stop";
        events.push_back({1001, 100, Lie::reset, 1, 0});
      }
      s.tick(k, events);
      const TelemetrySample& t = s.sample();
      const bool there = stops ? t.stop != StopStage::running : (t.alarms & cell.alarm) != 0;
      if (m.reached == 0 && there && cell.safe != Safe::goes_on) {
        m.reached = k + 1;
        m.first = t.fault;
        shut_at_once = !stops || !s.truth.gate;
      }
      const bool settled =
          m.reached != 0 && k >= m.reached + kBraked && (cell.fails != Fails::returns || k < 1000);
      if (settled) {
        m.moved_um += 1e6 * (s.truth.tip - was).norm();
        m.inward_um = std::max(m.inward_um, 1e6 * (inward_from - s.truth.tip.x()));
        // The heartbeat ends once the stop is over: power_off_after_ms where the stage is not known to stand.
        toggles += s.truth.level != level && k > m.reached + 520 ? 1 : 0;
        const bool powered = s.truth.power && k > m.reached + 520;                // power_off_after_ms
        const bool pushes = s.truth.force.norm() > 0 && cell.part != Part::hand;  // it may refuse the force
        if (stops && (pushes || s.truth.gate || powered)) {
          m.left = s.truth.gate ? "gate open" : powered ? "power on" : "force on the hand";
        }
        if (cell.safe == Safe::withdraw && s.truth.gate) {
          m.left = "gate open";
        }
      } else {
        inward_from = s.truth.tip.x();
      }
      was = s.truth.tip;
      level = s.truth.level;
    }
    if (!shut_at_once) {
      m.left = "gate open on the tick of the stop";
    }
    if (cell.safe == Safe::stop && toggles == 0) {
      m.left = "no heartbeat";
    }
    if (cell.safe == Safe::relay && toggles > 0 && cell.fails != Fails::returns) {
      m.left = "heartbeat";
    }
    if (cell.safe == Safe::goes_on) {
      m.first = s.sample().fault;
      m.left = s.sample().stop != StopStage::running                            ? "stopped"
               : !s.truth.gate                                                  ? "gate shut"
               : (s.sample().alarms & (alarm_sensor | alarm_vision_stale)) != 0 ? "alarm"
                                                                                : "";
    }
    if (comes_out && s.truth.tip.x() - inward_from < 5e-6) {
      m.left = "no withdrawal";
    }
    if ((cell.safe == Safe::alarm || cell.safe == Safe::withdraw) && s.sample().stop != StopStage::running) {
      m.left = "stopped";
    }
    if (cell.fails == Fails::returns) {
      const TelemetrySample& t = s.sample();
      if (t.stop != StopStage::running) {
        m.left = "not running after the reset";
      } else if (!stops && (t.alarms & cell.alarm) != 0) {
        m.left = "the alarm stays";
      }
    }
    for (const Broken& b : s.checker().broken()) {
      m.broken += std::string(m.broken.empty() ? "" : " ") + name(b.what).number;
    }
    return m;
  }

  bool has_switch = false;
  std::unique_ptr<LyingStation> station;
  std::unique_ptr<LyingStation::State> from_start, injecting;
};

TEST_F(FaultMatrix, every_fault_of_every_device_leads_to_the_state_that_is_written_down) {
  std::printf("%-13s%-10s %-27s%6s %6s  %9s  %s\n", "device", "fault", "state", "ticks", "within", "moved/um",
              "invariants, what is left");
  std::array<std::array<bool, kFails>, kParts> seen{};
  constexpr const char* kSafeNames[] = {"stop", "stop, relay", "withdraw", "alarm", "goes on", ""};
  for (const Cell& cell : kCells) {
    const auto part = static_cast<std::size_t>(cell.part), fails = static_cast<std::size_t>(cell.fails);
    const bool with_switch = cell.part == Part::enabling;
    if (!station || with_switch != has_switch) {
      has_switch = with_switch;
      station = std::make_unique<LyingStation>(whole_station(with_switch), with_switch);
      ASSERT_NO_FATAL_FAILURE(prepare());
    }
    EXPECT_FALSE(seen[part][fails]);
    seen[part][fails] = true;
    const std::string title = std::string(kPartNames[part]) + ", " + kFailNames[fails];
    if (cell.safe == Safe::senseless) {
      std::printf("%-13s%-10s makes no sense: %s\n", kPartNames[part], kFailNames[fails], cell.why);
      continue;
    }
    const Measured m = run(cell);
    const std::string state = std::string(kSafeNames[static_cast<std::size_t>(cell.safe)]) +
                              (cell.cause != Fault::none ? std::string(" ") + rt::name(m.first) : "");
    std::printf("%-13s%-10s %-27s%6d %6d  %9.3f  %s %s\n", kPartNames[part], kFailNames[fails], state.c_str(),
                m.reached, cell.within, m.moved_um, m.broken.empty() ? "hold" : m.broken.c_str(),
                m.left.c_str());
    EXPECT_EQ(rt::name(m.first), std::string(rt::name(cell.cause))) << title;
    EXPECT_LE(m.reached, cell.within) << title;
    EXPECT_EQ(m.reached > 0, cell.safe != Safe::goes_on) << title;
    EXPECT_EQ(m.broken, "") << title;
    EXPECT_EQ(m.left, "") << title;
    if (cell.safe == Safe::stop || cell.safe == Safe::relay) {
      EXPECT_LE(m.moved_um, 0.01) << title << ": the needle stands";
    }
    if (cell.safe == Safe::withdraw) {
      EXPECT_LE(m.inward_um, 0.1) << title << ": M11";
    }
  }
  for (std::size_t part = 0; part < kParts; ++part) {
    for (std::size_t fails = 0; fails < kFails; ++fails) {
      EXPECT_TRUE(seen[part][fails]) << kPartNames[part] << ", " << kFailNames[fails]
                                     << " is not in the table";
    }
  }
}

}  // namespace
}  // namespace punctum::rt::test
