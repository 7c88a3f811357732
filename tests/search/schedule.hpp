// One case of the search: where it starts, how long it takes, and what is done to the servo meanwhile. Made
// of a seed, run, shrunk to the shortest that still breaks the same invariant, and printed as source text.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/invariants.hpp"
#include "tests/support/lying_devices.hpp"

namespace punctum::rt::test {

// Where a schedule takes up the run.
enum class From : std::uint8_t {
  start,
  approach,
  contact,
  indentation,
  inside,
  injection,
  withdrawal,
  clear,
  stopped_outside,
  stopped_inside,
  depth_limit,
  blind,
  count
};
inline constexpr std::size_t kFroms = static_cast<std::size_t>(From::count);
inline constexpr std::array<const char*, kFroms> kFromNames{
    "start",      "approach", "contact",         "indentation",    "inside",      "injection",
    "withdrawal", "clear",    "stopped_outside", "stopped_inside", "depth_limit", "blind"};

struct Schedule {
  From from = From::start;
  int ticks = 0;
  std::vector<Event> events;
  int setup = 0;
};

// As it is pasted into found_cases.inc.
inline std::string print(const Schedule& s) {
  char line[160];
  std::snprintf(line, sizeof line, "{From::%s, %d, {", kFromNames[static_cast<std::size_t>(s.from)], s.ticks);
  std::string text = line;
  for (std::size_t i = 0; i < s.events.size(); ++i) {
    const Event& e = s.events[i];
    std::string value;
    for (int digits = 1; digits <= 17; ++digits) {
      std::snprintf(line, sizeof line, "%.*g", digits, e.value);
      value = line;
      if (std::stod(value) == e.value) {
        break;
      }
    }
    std::snprintf(line, sizeof line, "%s{%d, %d, Lie::%s, %s, %d}", i > 0 ? ", " : "", e.at, e.lasts,
                  kLieNames[static_cast<std::size_t>(e.lie)], std::isfinite(e.value) ? value.c_str() : "kNaN",
                  e.axis);
    text += line;
  }
  return text + (s.setup == 0 ? "}}" : "}, " + std::to_string(s.setup) + "}");
}

// ---- random schedules ----

// splitmix64: the same schedules on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  int below(int n) { return static_cast<int>(uniform() * n); }
  double log_uniform(double low, double high) { return low * std::exp(uniform() * std::log(high / low)); }
  int duration(int shortest, int longest) {
    return std::clamp(static_cast<int>(log_uniform(shortest, longest + 0.999)), shortest, longest);
  }
  bool chance(double p) { return uniform() < p; }

 private:
  std::uint64_t state_;
};

// How a lie is drawn: its value, log-uniform, of both signs or not; how long it lasts; how often it is taken
// among those of its group.
struct Draw {
  Lie lie;
  int group;  // 0 hand's motion, 1 buttons, 2 hand, 3 stage, 4 e-stop, 5 vision, 6 other devices, 7 clock, 8
              // commands, 9 the switch that only set-up 3 has
  double low, high;
  bool both_signs;
  int shortest, longest;
};
inline constexpr std::array<Draw, kLies> kDraws{{
    {Lie::moves, 0, 1e-4, 60e-3, true, 30, 800},
    {Lie::trembles, 0, 5e-5, 3e-3, false, 50, 1000},
    {Lie::lets_go, 0, 1, 1, false, 50, 1000},
    {Lie::clutches, 1, 1, 1, false, 1, 500},
    {Lie::injects, 1, 1, 1, false, 1, 800},
    {Lie::next_cell, 1, 1, 1, false, 1, 300},
    {Lie::enable_up, 1, 1, 1, false, 1, 300},
    {Lie::squeezes, 1, 1, 1, false, 1, 300},
    {Lie::hand_glitch, 2, 1e-4, 0.03, true, 1, 60},
    {Lie::hand_no_data, 2, 1, 1, false, 1, 900},
    {Lie::hand_gone, 2, 1, 1, false, 1, 100},
    {Lie::hand_fault, 2, 1, 1, false, 1, 100},
    {Lie::hand_repeats, 2, 1, 1, false, 1, 900},
    {Lie::hand_stuck, 2, 1, 1, false, 1, 300},
    {Lie::hand_late, 2, 1, 40, false, 1, 300},
    {Lie::hand_every, 2, 2, 16, false, 10, 1000},
    {Lie::hand_every_silent, 2, 2, 16, false, 10, 1000},
    {Lie::hand_nan, 2, 1, 1, false, 1, 10},
    {Lie::hand_absurd, 2, 0.1, 1e300, true, 1, 10},
    {Lie::hand_time, 2, 1e-4, 10, true, 1, 100},
    {Lie::hand_refuses_force, 2, 1, 1, false, 1, 100},
    {Lie::hand_takes_no_force, 2, 1, 1, false, 1, 900},
    {Lie::stage_no_data, 3, 1, 1, false, 1, 900},
    {Lie::stage_gone, 3, 1, 1, false, 1, 900},
    {Lie::stage_fault, 3, 1, 1, false, 1, 100},
    {Lie::stage_repeats, 3, 1, 1, false, 1, 900},
    {Lie::stage_stuck, 3, 1, 1, false, 1, 300},
    {Lie::stage_late, 3, 1, 40, false, 1, 300},
    {Lie::stage_every, 3, 2, 16, false, 10, 1000},
    {Lie::stage_nan, 3, 1, 1, false, 1, 10},
    {Lie::stage_absurd, 3, 1e-4, 1e300, true, 1, 10},
    {Lie::stage_offset, 3, 1e-7, 30e-6, true, 1, 300},
    {Lie::stage_error, 3, 1e-7, 1, true, 1, 300},
    {Lie::stage_refuses, 3, 1, 1, false, 1, 100},
    {Lie::stage_deaf, 3, 1, 1, false, 1, 500},
    {Lie::stage_runs_away, 3, 1e-5, 1e-3, true, 1, 500},
    {Lie::stage_ignores_stop, 3, 1, 1, false, 10, 2000},
    {Lie::stage_ignores_power_off, 3, 1, 1, false, 10, 2000},
    {Lie::stage_sinks, 3, 1e-5, 1e-3, true, 10, 2000},
    {Lie::stage_never_enables, 3, 1, 1, false, 10, 2000},
    {Lie::stage_drops_power, 3, 1, 1, false, 1, 300},
    {Lie::stage_never_stands, 3, 1, 1, false, 10, 2000},
    {Lie::stage_axis, 3, 1e-3, 3.1416, true, 1, 300},
    {Lie::contact_a, 4, 1, 1, false, 1, 300},
    {Lie::contact_b, 4, 1, 1, false, 1, 300},
    {Lie::contacts, 4, 1, 1, false, 1, 600},
    {Lie::pulse, 4, 1, 1, false, 1, 3},
    {Lie::estop_no_data, 4, 1, 1, false, 1, 900},
    {Lie::estop_gone, 4, 1, 1, false, 1, 900},
    {Lie::estop_time, 4, 1e-4, 10, true, 1, 300},
    {Lie::reset, 4, 1, 1, false, 1, 300},
    {Lie::switch_a, 9, 1, 1, false, 1, 300},
    {Lie::switch_b, 9, 1, 1, false, 1, 300},
    {Lie::switch_welded, 9, 1, 1, false, 1, 600},
    {Lie::switch_pulse, 9, 1, 1, false, 1, 3},
    {Lie::switch_no_data, 9, 1, 1, false, 1, 300},
    {Lie::switch_gone, 9, 1, 1, false, 1, 300},
    {Lie::vision_gone, 5, 1, 1, false, 40, 1200},
    {Lie::vision_late, 5, 1e-3, 1, false, 40, 800},
    {Lie::vision_jumps, 5, 1e-6, 100e-6, true, 40, 800},
    {Lie::picture_shifts, 5, 1e-6, 100e-6, true, 40, 800},
    {Lie::vision_recedes, 5, 1e-6, 300e-6, true, 40, 1500},
    {Lie::vision_grows, 5, 1e-6, 300e-6, true, 40, 1500},
    {Lie::false_puncture, 5, 1, 1, false, 1, 400},
    {Lie::false_inner_puncture, 5, 1, 1, false, 1, 400},
    {Lie::false_contact, 5, 1, 1, false, 1, 400},
    {Lie::no_puncture, 5, 1, 1, false, 40, 1000},
    {Lie::vision_future, 5, 1e-3, 10, false, 1, 400},
    {Lie::vision_past, 5, 1e-3, 10, false, 1, 400},
    {Lie::vision_frozen, 5, 1, 1, false, 40, 1000},
    {Lie::vision_nan, 5, 1, 1, false, 1, 400},
    {Lie::vision_absurd, 5, 1e-3, 1e300, true, 1, 400},
    {Lie::injector_stuck_open, 6, 1, 1, false, 10, 1000},
    {Lie::injector_stuck_shut, 6, 1, 1, false, 10, 1000},
    {Lie::injector_time, 6, 1e-4, 10, true, 1, 300},
    {Lie::vacuum_lost, 6, 1, 1, false, 10, 500},
    {Lie::vacuum_time, 6, 1e-4, 10, true, 1, 300},
    {Lie::sensor_pushed, 6, 1e-6, 1e3, true, 1, 500},
    {Lie::sensor_nan, 6, 1, 1, false, 1, 300},
    {Lie::sensor_time, 6, 1e-4, 10, true, 1, 300},
    {Lie::stall, 7, 2e-3, 0.3, false, 1, 1},
    {Lie::start_late, 7, 1e-5, 0.05, false, 1, 100},
    {Lie::clock_back, 7, 1e-5, 0.5, false, 1, 10},
    {Lie::period_told, 7, 1e-9, 1e9, true, 1, 10},
    {Lie::command_stop, 8, 1, 1, false, 1, 1},
    {Lie::command_end, 8, 1, 1, false, 1, 1},
    {Lie::command_scale, 8, 1e-3, 10, true, 1, 1},
    {Lie::command_odd, 8, 1, 1, false, 1, 1},
    {Lie::command_position_scale, 8, 150, 1500, false, 1, 1},
    {Lie::command_depth_limit, 8, 1e-7, 1e-3, true, 1, 1},
}};
static_assert([] {
  for (std::size_t i = 0; i < kLies; ++i) {
    if (kDraws[i].lie != static_cast<Lie>(i)) {
      return false;
    }
  }
  return true;
}());
// Of a hundred events.
inline constexpr std::array<int, 9> kGroupWeights{23, 12, 16, 14, 8, 16, 3, 6, 2};

inline Schedule random_schedule(std::uint64_t seed, std::uint64_t number) {
  Random random(seed * 0x2545f4914f6cdd1dULL + number);
  (void)random.next();
  Schedule s;
  s.from = static_cast<From>(random.below(static_cast<int>(kFroms)));
  const double setup = random.uniform();
  s.setup = setup < 0.1 ? 3 : setup < 0.2 ? 1 : setup < 0.4 ? 2 : setup < 0.55 ? 4 : 0;
  s.events.reserve(16);
  s.ticks = random.duration(300, 2000);
  // Most schedules keep to two or three groups: what is combined is then combined often.
  std::array<bool, 9> groups{};
  const bool all = random.chance(0.3);
  groups[0] = true;
  groups[1] = random.chance(0.5);
  for (int i = 0; i < 2; ++i) {
    groups[static_cast<std::size_t>(2 + random.below(7))] = true;
  }
  const int events = random.duration(1, 12) + 1;
  // Many defects show only to a hand that pushes on.
  if (random.chance(0.3)) {
    s.events.push_back(
        {random.below(100), random.duration(200, 1500), Lie::moves, -random.log_uniform(5e-3, 80e-3), 0});
  }
  if (s.setup == 2) {
    // To the floor or to the holder, and another scale with or without the clutch.
    if (random.chance(0.6)) {
      const bool to_floor = random.chance(0.4);
      s.events.push_back({random.below(s.ticks), random.duration(50, 800), Lie::moves,
                          (to_floor ? -1 : 1) * random.log_uniform(3e-3, 20e-3), to_floor ? 2 : 1});
    }
    if (random.chance(0.4)) {
      const int at = random.below(s.ticks);
      s.events.push_back({at, 1, Lie::command_position_scale, random.log_uniform(200, 1200), 0});
      if (random.chance(0.7)) {
        s.events.push_back(
            {std::max(at - 50, 0) + random.below(200), random.duration(20, 400), Lie::clutches, 1, 0});
      }
    }
  }
  // No drive is waited for so long as one that is to be enabled.
  if (random.chance(0.01)) {
    s.ticks = random.duration(3500, 4500);
    s.setup = 0;
    s.from = From::start;
    s.events.push_back({0, s.ticks, Lie::stage_never_enables, 1, 0});
  }
  if (s.setup == 3) {
    constexpr auto kFirst = static_cast<std::size_t>(Lie::switch_a);
    constexpr int kSwitchLies = static_cast<int>(Lie::switch_gone) - static_cast<int>(Lie::switch_a) + 1;
    for (int i = random.below(4); i > 0; --i) {
      const Draw& draw = kDraws[kFirst + static_cast<std::size_t>(random.below(kSwitchLies))];
      s.events.push_back(
          {random.below(s.ticks), random.duration(draw.shortest, draw.longest), draw.lie, 1, 0});
    }
  }
  // A real hand is never still.
  if (random.chance(0.4)) {
    s.events.push_back(
        {0, s.ticks, Lie::trembles, random.log_uniform(1e-4, 1e-3), random.chance(0.6) ? 0 : 1});
  }
  while (static_cast<int>(s.events.size()) < events) {
    int w = random.below(100);
    std::size_t group = 0;
    while (w >= kGroupWeights[group]) {
      w -= kGroupWeights[group++];
    }
    if (!all && !groups[group]) {
      continue;
    }
    int members = 0;
    for (const Draw& d : kDraws) {
      members += d.group == static_cast<int>(group) ? 1 : 0;
    }
    int member = random.below(members);
    const Draw* draw = nullptr;
    for (const Draw& d : kDraws) {
      if (d.group == static_cast<int>(group) && member-- == 0) {
        draw = &d;
      }
    }
    Event e;
    e.lie = draw->lie;
    e.at = random.below(s.ticks);
    e.lasts = random.duration(draw->shortest, draw->longest);
    e.value = draw->low < draw->high ? random.log_uniform(draw->low, draw->high) : draw->low;
    if (draw->both_signs && random.chance(0.5)) {
      e.value = -e.value;
    }
    // Most motions go along the axis; more of them into the cell.
    e.axis = random.chance(0.6) ? 0 : random.below(3);
    if (e.lie == Lie::moves && e.axis == 0 && random.chance(0.4)) {
      e.value = -std::abs(e.value);
    }
    if (e.lie == Lie::moves && e.axis != 0) {
      e.value *= 0.3;
    }
    if ((e.lie == Lie::period_told || e.lie == Lie::command_scale) && random.chance(0.2)) {
      e.value = random.chance(0.5) ? std::numeric_limits<double>::quiet_NaN() : 0.0;
    }
    s.events.push_back(e);
  }
  std::sort(s.events.begin(), s.events.end(), [](const Event& a, const Event& b) { return a.at < b.at; });
  return s;
}

// ---- what was reached ----

struct Coverage {
  static constexpr std::size_t kStates = kPhases * 3 * kFaults;
  std::array<std::uint64_t, kStates> ticks{};
  std::vector<bool> transitions = std::vector<bool>(kStates * kStates);
  std::array<std::uint64_t, kLies> lies{};
  std::size_t last = kStates;

  static std::size_t index(const TelemetrySample& t) {
    return (static_cast<std::size_t>(t.phase) * 3 + static_cast<std::size_t>(t.stop)) * kFaults +
           static_cast<std::size_t>(t.fault);
  }
  void see(const TelemetrySample& t) {
    const std::size_t i = index(t);
    ++ticks[i];
    if (last < kStates && last != i) {
      transitions[last * kStates + i] = true;
    }
    last = i;
  }
  void add(const Coverage& other) {
    for (std::size_t i = 0; i < kStates; ++i) {
      ticks[i] += other.ticks[i];
    }
    for (std::size_t i = 0; i < kStates * kStates; ++i) {
      transitions[i] = transitions[i] || other.transitions[i];
    }
    for (std::size_t i = 0; i < kLies; ++i) {
      lies[i] += other.lies[i];
    }
  }
};

// ---- running ----

class Search {
 public:
  explicit Search(int setup = 0)
      : station_(searched_config(setup), setup == 3),
        rate_Hz_(searched_config(setup).rate_Hz),
        inner_membrane_(searched_config(setup).inner_membrane) {
    prepare();
  }

  // All violations, the first of each invariant. With `only`: stops at the first of that one.
  std::vector<Broken> run(const Schedule& s, Coverage* coverage = nullptr,
                          Invariant only = Invariant::count) {
    station_.restore(*states_[static_cast<std::size_t>(s.from)]);
    station_.checker().begin();
    if (coverage != nullptr) {
      coverage->last = Coverage::kStates;
      for (const Event& e : s.events) {
        ++coverage->lies[static_cast<std::size_t>(e.lie)];
      }
    }
    for (int k = 0; k < s.ticks; ++k) {
      station_.tick(k, s.events);
      if (coverage != nullptr) {
        coverage->see(station_.sample());
      }
      if (only != Invariant::count && !station_.checker().holds(only)) {
        break;
      }
    }
    const auto broken = station_.checker().broken();
    return {broken.begin(), broken.end()};
  }

  [[nodiscard]] const Broken* find(const std::vector<Broken>& all, Invariant what) const {
    for (const Broken& b : all) {
      if (b.what == what) {
        return &b;
      }
    }
    return nullptr;
  }

  // The shortest schedule round this one that still breaks the invariant: fewer events, fewer ticks, shorter,
  // earlier and rounder events.
  Schedule shrink(Schedule s, Invariant what) {
    const auto breaks = [&](const Schedule& c) { return find(run(c, nullptr, what), what) != nullptr; };
    const auto take = [&](Schedule& best, const Schedule& candidate) {
      if (!breaks(candidate)) {
        return false;
      }
      best = candidate;
      return true;
    };
    bool better = true;
    for (int round = 0; better && round < 20; ++round) {
      better = false;
      const std::vector<Broken> all = run(s, nullptr, what);
      const Broken* b = find(all, what);
      if (b != nullptr && b->tick + 1 < s.ticks) {
        s.ticks = b->tick + 1;
        better = true;
      }
      for (std::size_t i = s.events.size(); i-- > 0;) {
        Schedule c = s;
        c.events.erase(c.events.begin() + static_cast<std::ptrdiff_t>(i));
        better = take(s, c) || better;
      }
      // Everything sooner: what is waited for at the beginning is cut off.
      for (int cut = s.ticks / 2; cut > 0; cut /= 2) {
        for (std::size_t i = 0; i < s.events.size(); ++i) {
          if (s.events[i].at >= cut) {
            Schedule c = s;
            for (std::size_t j = i; j < c.events.size(); ++j) {
              c.events[j].at -= std::min(cut, c.events[j].at);
            }
            c.ticks -= std::min(cut, c.ticks - 1);
            better = take(s, c) || better;
          }
        }
      }
      for (std::size_t i = 0; i < s.events.size(); ++i) {
        for (const int lasts :
             {1, s.events[i].lasts / 2, s.events[i].lasts * 9 / 10, s.events[i].lasts - 1}) {
          if (lasts >= 1 && lasts < s.events[i].lasts) {
            Schedule c = s;
            c.events[i].lasts = lasts;
            better = take(s, c) || better;
          }
        }
        for (const double value : simpler(s.events[i].value)) {
          Schedule c = s;
          c.events[i].value = value;
          better = take(s, c) || better;
        }
        if (s.events[i].axis != 0) {
          Schedule c = s;
          c.events[i].axis = 0;
          better = take(s, c) || better;
        }
      }
    }
    return s;
  }

  LyingStation& station() { return station_; }

 private:
  // Rounder values, the roundest first; only those that change anything.
  static std::vector<double> simpler(double value) {
    std::vector<double> values;
    if (!std::isfinite(value) || value == 0 || value == 1) {
      return values;
    }
    for (int digits = 1; digits <= 3; ++digits) {
      const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - digits + 1);
      const double round = std::strtod(number(std::round(value / unit) * unit, digits).c_str(), nullptr);
      if (round == value) {
        break;
      }
      values.push_back(round);
    }
    return values;
  }
  static std::string number(double value, int digits) {
    char text[40];
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return text;
  }

  void keep(From from) { states_[static_cast<std::size_t>(from)] = station_.state(); }
  void rest(double seconds, std::span<const Event> events = {}) {
    const int n = static_cast<int>(seconds * rate_Hz_);
    for (int k = 0; k < n; ++k) {
      station_.tick(k, events);
    }
  }
  // The operator moves the needle by speed, at most so far, until the phase is there.
  void go(double speed_m_s, double way_m, Phase until) {
    for (double gone = 0; gone < way_m && station_.servo().phase() != until;
         gone += std::abs(speed_m_s) / rate_Hz_) {
      station_.truth.intention.x() += speed_m_s / rate_Hz_ * 500;
      station_.tick(0, {});
    }
  }
  void expect(Phase phase) {
    if (station_.servo().phase() != phase) {
      throw std::runtime_error(std::string("the prepared run is in phase ") + name(station_.servo().phase()) +
                               " instead of " + name(phase));
    }
  }
  void stop(From begin, From end) {
    station_.restore(*states_[static_cast<std::size_t>(begin)]);
    const Event pressed{0, static_cast<int>(0.7 * rate_Hz_), Lie::contacts, 1, 0};
    rest(0.8, {&pressed, 1});
    keep(end);
  }
  void prepare() {
    keep(From::start);
    rest(1);
    go(-30e-6, 15e-6, Phase::contact);
    rest(0.5);
    expect(Phase::free);
    keep(From::approach);
    go(-15e-6, 60e-6, Phase::contact);
    rest(0.5);
    expect(Phase::contact);
    keep(From::contact);
    go(-10e-6, 30e-6, Phase::indentation);
    go(-10e-6, 2e-6, Phase::puncture);
    rest(0.5);
    expect(Phase::indentation);
    keep(From::indentation);
    go(-10e-6, 60e-6, Phase::puncture);
    rest(0.5);
    expect(Phase::puncture);
    keep(From::inside);
    if (inner_membrane_) {
      go(-10e-6, 12e-6, Phase::clear);
      rest(0.5);
    }
    const Event pressed{100, 60, Lie::injects, 1, 0};
    rest(0.8, {&pressed, 1});
    expect(Phase::injection);
    keep(From::injection);
    go(20e-6, 100e-6, Phase::withdrawal);
    rest(0.5);
    expect(Phase::withdrawal);
    keep(From::withdrawal);
    go(30e-6, 100e-6, Phase::clear);
    rest(0.5);
    expect(Phase::clear);
    keep(From::clear);
    station_.restore(*states_[static_cast<std::size_t>(From::inside)]);
    go(-30e-6, 110e-6, Phase::clear);
    rest(0.5);
    expect(Phase::puncture);
    if ((station_.sample().alarms & alarm_depth_limited) == 0) {
      throw std::runtime_error("the prepared run does not reach the depth limit");
    }
    keep(From::depth_limit);
    station_.restore(*states_[static_cast<std::size_t>(From::inside)]);
    const Event unseen{0, static_cast<int>(rate_Hz_), Lie::vision_gone, 1, 0};
    rest(0.6, {&unseen, 1});
    keep(From::blind);
    stop(From::approach, From::stopped_outside);
    stop(From::inside, From::stopped_inside);
  }

  LyingStation station_;
  double rate_Hz_;
  bool inner_membrane_;
  std::array<std::optional<LyingStation::State>, kFroms> states_;
};

}  // namespace punctum::rt::test
