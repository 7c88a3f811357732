// The fault matrix on real kernel drivers: every fault that one of them can show, while the needle is inside
// the cell, the gate is open and the hand trembles. What each cell must lead to is stated before it is run,
// from the table of rt/control/safety_latch.hpp, the invariants of rt/control/README.md, the tables in the
// READMEs of the backends and the time-outs in headers and scene; never from a run. Measured: ticks from the
// fault to the stop, and until nothing moves, pushes or is open any more; the motion of the true needle
// afterwards; and every invariant of tests/support on every tick. A camera that fails stops nothing: there,
// what counts is when the core knows, and that the needle then goes outward only. At the end a table is
// printed, a line for each cell. A cell alone: --gtest_filter=*emergency*.
#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <cctype>
#include <cstdio>
#include <functional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "rt/station/alarm.hpp"
#include "tests/loopback/wired_servo.hpp"

namespace punctum::loopback {
namespace {

using rt::Fault;
using rt::StopStage;

// Of a cell. The fault comes in the middle between two ticks.
constexpr double kFault_ms = 300.5, kReturns_ms = 450.5, kRests_ms = 500, kReset_ms = 520.5,
                 kLetGo_ms = 560.5, kEnd_ms = 630, kEndWithoutReset_ms = 490;

enum class Safe : std::uint8_t {
  stop,     // the stop of the table, the heartbeat goes on
  relay,    // the same, and the heartbeat ends
  goes_on,  // as if nothing were wrong
  blind,    // it goes on, but the gate shuts and the needle goes outward only, until vision is back
};
constexpr const char* kSafeNames[] = {"stop", "stop, relay", "goes on", "outward only, vision_stale"};

enum class Reset : std::uint8_t {
  none,      // is not tried
  takes_up,  // what was wrong is over: the reset button ends the stop
  refused,
};
constexpr const char* kResetNames[] = {"", "takes up", "refused"};

// What the drives do 200 ms after the fault.
enum class Drives : std::uint8_t {
  off,    // without power
  stand,  // they do not follow; power is left to the relay, because nobody can tell them
  any,    // at least one of them disobeys
};

// Ticks from the stop: hand_ramp_ms, and what is on its way, or the link loss of the drives.
constexpr int kRamp = 20 + 12;
constexpr int kRelay = 52;    // the relay takes the force 50 ms after the last edge of the heartbeat
constexpr int kRefused = 10;  // a Falcon that does not answer refuses forces only then

// Of a camera of 60 Hz: the newest picture was exposed up to 17 ms before the fault, and is stale 100 ms
// after its exposure; a tick to notice it, and one that may be under way.
constexpr int kBlind = 102, kSeesUntil = 100 - 17;
// From its return until vision is fresh: what opens it looks every 5 ms and takes some, two pictures, 10 ms
// for each, and a tick.
constexpr int kSees = 5 + 30 + 2 * 17 + 10 + 1;
constexpr double kSeesAgain_ms = 700;

// What else a cell may say.
struct Also {
  std::function<void(WiredServo&)> returns = {};
  Reset reset = Reset::none;
  Drives drives = Drives::off;
  double relay_ms = 120;  // from the stop to the heartbeat's end: power_off_after_ms of the scene, and H1
  double end_ms = reset == Reset::none ? kEndWithoutReset_ms : kEnd_ms;
  bool needle_stands = false;  // it goes on, but nothing moves
  int missed = 0;              // ticks, at most
  int rest = kRamp;            // ticks from the stop until all is still, at most
  double may_move_um = 0.01;   // of itself, whatever it is told
  bool from_return = false;    // the fault is there when the kernel's call has returned
  const char* complaint = "";  // part of what the camera says of it
  std::uint64_t lost = 0;      // pictures, at least, by its own count
};

struct Cell {
  const char* device;
  const char* fault;
  Safe safe;
  Fault cause;  // the first
  int within;   // ticks from the fault to the stop
  const char* why;
  std::function<void(WiredServo&)> fails;
  Also also = {};
};

can_frame frame_of(canid_t id, std::initializer_list<int> bytes) {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data);
  return frame;
}

// Another node on the bus, or the kernel of this one.
class Stranger {
 public:
  explicit Stranger(const char* interface) { EXPECT_EQ(bus_.open(interface), ""); }
  void send(const can_frame& frame) {
    EXPECT_EQ(write(bus_.socket(), &frame, sizeof(frame)), static_cast<ssize_t>(sizeof(frame)));
  }
  // A bus of 1 Mbit/s has room for eight frames in a millisecond.
  void send_all_the_time(WiredServo& s, const can_frame& frame, double until_ms) {
    for (double t_ms = s.now_ms(); t_ms < until_ms; t_ms += 0.125) {
      send(frame);
      s.at(t_ms + 0.125);
    }
  }

 private:
  emulator::DriveBus bus_;
};

void take_down(WiredServo& s, std::optional<CanInterface>& can) {
  s.let_kernel([&] { can->down(); });
}
void bring_up(WiredServo& s, std::optional<CanInterface>& can, const char* name) {
  s.let_kernel([&] {
    can.reset();
    can.emplace(name);
  });
}
void stop_with_habit(WiredServo& s, const char* habit) {
  s.stage_lies = true;
  s.drive(1, habit);
  s.contacts(false, false);
}
void pulse(WiredServo& s, int contact) {
  s.board->drive(contact, false);
  s.board->drive(contact, true);
}
void close_contacts(WiredServo& s) { s.contacts(true, true); }
void drop_pictures(WiredServo& s, int percent) {
  s.camera->vivid.set("Percentage of Dropped Buffers", percent);
}
// Each press of the driver's button damages the next picture.
void damage_pictures(WiredServo& s, double until_ms) {
  do {
    s.camera->vivid.set("Inject V4L2_BUF_FLAG_ERROR", 1);
    s.at(s.now_ms() + 4);
  } while (s.now_ms() < until_ms);
}

// haptic.timeout_ms and stage.timeout_ms are 20, servo.overrun_limit is 20 in a second, estop.discrepancy_ms
// 50; estop.power_off_after_ms is 100 here. A tick reads every level that was there before it: 1; the tick
// may be under way: 2. What a drive says of the time after a SYNC is read two ticks later.
const std::vector<Cell>& cells() {
  using W = WiredServo;
  using enum Safe;
  static const std::vector<Cell> all = {
      // ---- e-stop chain and injector: gpio-sim ----
      {"e-stop",
       "both contacts open",
       stop,
       Fault::estop,
       2,
       "L3",
       [](W& s) { s.contacts(false, false); },
       {.returns = close_contacts, .reset = Reset::takes_up}},
      {"e-stop",
       "contact a alone, for 150 ms",
       stop,
       Fault::estop,
       2,
       "L3; discrepancy: both must have opened before a reset",
       [](W& s) { s.contacts(false, true); },
       {.returns = close_contacts, .reset = Reset::refused}},
      {"e-stop",
       "contact b alone (a is stuck), 150 ms",
       stop,
       Fault::estop,
       2,
       "L3; discrepancy",
       [](W& s) { s.contacts(true, false); },
       {.returns = close_contacts, .reset = Reset::refused}},
      {"e-stop",
       "contact b 30 ms later than a",
       stop,
       Fault::estop,
       2,
       "L3; within discrepancy_ms",
       [](W& s) {
         s.contacts(false, true);
         s.at(kFault_ms + 30);
         s.contacts(false, false);
       },
       {.returns = close_contacts, .reset = Reset::takes_up}},
      {"e-stop",
       "pulse of a, shorter than a tick",
       stop,
       Fault::estop,
       2,
       "L3; gpiod: edges are kept",
       [](W& s) { pulse(s, kContactA); },
       {.reset = Reset::takes_up}},
      {"e-stop",
       "pulse of b, shorter than a tick",
       stop,
       Fault::estop,
       2,
       "L3; gpiod: edges are kept",
       [](W& s) { pulse(s, kContactB); },
       {.reset = Reset::takes_up}},
      {"e-stop",
       "bounces for 5 ms, then closed",
       stop,
       Fault::estop,
       2,
       "L3; L1: bouncing is no reset",
       [](W& s) {
         for (double t_ms = kFault_ms; t_ms < kFault_ms + 5; t_ms += 0.4) {
           s.contacts(false, false);
           s.at(t_ms + 0.2);
           s.contacts(true, true);
           s.at(t_ms + 0.4);
         }
       },
       {.reset = Reset::takes_up}},
      {"e-stop", "chip gone", relay, Fault::estop_lost, 2, "gpiod: disconnected from the next reading on",
       [](W& s) { s.pull_chip(); }},
      {"injector",
       "contact of the valve cut, gate shut",
       relay,
       Fault::injector_open,
       275,
       "a tick to the handle and one to its reading, 21 until the release has lasted, one to the gate, "
       "251 past shut_within_ms",
       [](W& s) {
         s.valve_cut = true;
         s.releases_ms = kFault_ms;
       },
       {.end_ms = 720}},

      // ---- drives: kvaser_pci ----
      {"CAN",
       "interface down",
       relay,
       Fault::stage_lost,
       2,
       "cia402: interface down is disconnected",
       [](W& s) { take_down(s, s.can0); },
       {.returns = [](W& s) { bring_up(s, s.can0, "can0"); },
        .reset = Reset::refused,
        .drives = Drives::stand,
        .from_return = true}},
      {"CAN",
       "bus-off, as an error frame tells it",
       relay,
       Fault::stage_lost,
       2,
       "cia402: bus-off is disconnected",
       [](W&) { Stranger("can0").send(frame_of(CAN_ERR_FLAG | CAN_ERR_BUSOFF, {0, 0, 0, 0, 0, 0, 0, 0})); },
       {.reset = Reset::refused, .drives = Drives::stand}},
      {"CAN", "error frames, one in each tick", goes_on, Fault::none, 0, "cia402: counted",
       [](W& s) {
         Stranger bus("can0");
         for (double t_ms = kFault_ms; t_ms < kFault_ms + 100; t_ms += 1) {
           bus.send(frame_of(CAN_ERR_FLAG | CAN_ERR_CRTL, {0, CAN_ERR_CRTL_TX_PASSIVE, 0, 0, 0, 0, 0, 0}));
           s.at(t_ms + 1);
         }
       }},
      {"CAN",
       "cable cut (the drives' end down)",
       relay,
       Fault::stage_lost,
       22,
       "L4",
       [](W& s) { take_down(s, s.can1); },
       {.drives = Drives::stand}},
      {"CAN",
       "no SYNC reaches the drives",
       relay,
       Fault::stage_lost,
       22,
       "L4; the drives stop by their link loss",
       [](W& s) { s.drives->lose(0x80); },
       {.drives = Drives::stand}},
      {"CAN", "flood of a stranger, identifier 0x010", goes_on, Fault::none, 0,
       "cia402: only the drives' identifiers reach the core",
       [](W& s) {
         Stranger("can1").send_all_the_time(s, frame_of(0x010, {1, 2, 3, 4, 5, 6, 7, 8}), kFault_ms + 100);
       }},
      {"CAN",
       "a stranger sends positions as drive 1",
       relay,
       Fault::stage_following,
       3,
       "following.hpp: told further away than following_error_um",
       [](W& s) {
         s.stage_lies = true;
         Stranger("can1").send_all_the_time(s, frame_of(0x181, {0x37, 0x12, 0, 0x10, 0, 0}), kFault_ms + 100);
       },
       {.drives = Drives::any}},
      {"drive",
       "supply cut",
       relay,
       Fault::stage_lost,
       22,
       "L4: its answers stay away",
       [](W& s) { s.drive(1, "freeze"); },
       {.returns = [](W& s) { s.drive(1, "thaw"); }, .reset = Reset::refused, .drives = Drives::any}},
      {"drive",
       "no heartbeat, all else as before",
       relay,
       Fault::stage_lost,
       62,
       "cia402: heartbeat_timeout_ms is 60",
       [](W& s) { s.drive(2, "mute heartbeat"); },
       {.returns = [](W& s) { s.drive(2, "speak"); }, .reset = Reset::refused}},
      {"drive", "emergency message, no fault", goes_on, Fault::none, 0, "cia402: a line in core.log",
       [](W& s) { s.drive(0, "emergency 0x4210"); }},
      {"drive",
       "fault while it moves",
       relay,
       Fault::stage_fault,
       3,
       "safety_latch.hpp",
       [](W& s) { s.drive(0, "fault 0x2310"); },
       {.reset = Reset::takes_up}},
      {"drive", "its safe torque off", relay, Fault::stage_fault, 3, "cia402: leaves operation by itself",
       [](W& s) { s.drive(2, "switch-off"); }},
      {"drive",
       "restarts",
       relay,
       Fault::stage_lost,
       3,
       "cia402: restarts is disconnected",
       [](W& s) { s.drive(1, "reset"); },
       {.reset = Reset::refused}},
      {"drive",
       "encoder stands still, hand draws back",
       relay,
       Fault::stage_following,
       165,
       "10 um at 100 um/s, 37 ms behind the hand, 20 ms of a reading's age",
       [](W& s) {
         s.stage_lies = true;
         s.drive(0, "stick");
         s.draws_back_ms = kFault_ms;
       },
       {.drives = Drives::any, .end_ms = 620}},
      {"drive", "ignores the quick stop of an e-stop", stop, Fault::estop, 2,
       "L3; without set-points it stands, and it gives up its power",
       [](W& s) { stop_with_habit(s, "ignore quick-stop"); }},
      {"drive",
       "keeps its power after an e-stop",
       relay,
       Fault::estop,
       2,
       "L3; H2",
       [](W& s) { stop_with_habit(s, "ignore disable"); },
       {.drives = Drives::any, .relay_ms = 150}},
      {"drive",
       "creeps without power after an e-stop",
       relay,
       Fault::estop,
       2,
       "L3; H2",
       [](W& s) { stop_with_habit(s, "creep 2500"); },
       {.drives = Drives::any, .relay_ms = 200, .end_ms = 580, .rest = 1000, .may_move_um = 1e3}},

      // ---- handle: vhci_hcd ----
      {"hand",
       "unplugged, plugged in again",
       relay,
       Fault::hand_lost,
       22,
       "L4; it takes no force: H5",
       [](W& s) { s.falcon->unplug(); },
       {.returns = [](W& s) { s.falcon->plug_in(); }, .reset = Reset::refused, .rest = kRelay}},
      {"hand",
       "silent",
       relay,
       Fault::hand_lost,
       22,
       "L4; falcon: no answer for 10 ms is a refused force: H5",
       [](W& s) { s.handle("mute"); },
       {.returns = [](W& s) { s.handle("speak"); }, .reset = Reset::takes_up}},
      {"hand",
       "hangs with its motors on",
       relay,
       Fault::hand_lost,
       22,
       "L4; falcon: no answer for 10 ms is a refused force: H5",
       [](W& s) { s.handle("hang"); },
       {.reset = Reset::refused, .rest = kRefused + kRelay}},
      {"hand",
       "encoders stand still",
       goes_on,
       Fault::none,
       0,
       "falcon: not told from a hand that rests",
       [](W& s) {
         s.hand_hidden = true;
         s.handle("freeze");
       },
       {.needle_stands = true}},
      {"hand", "three short frames", goes_on, Fault::none, 0, "falcon: cost readings, 4 ms each",
       [](W& s) { s.handle("short 3"); }},
      {"hand",
       "short frames only",
       relay,
       Fault::hand_lost,
       22,
       "L4; falcon: no whole answer for 10 ms: H5",
       [](W& s) { s.handle("short 100000"); },
       {.returns = [](W& s) { s.handle("short 0"); }, .reset = Reset::takes_up}},
      {"hand", "three frames of garbage", goes_on, Fault::none, 0, "falcon: cost readings, 4 ms each",
       [](W& s) { s.handle("corrupt 3"); }},
      {"hand",
       "garbage only",
       relay,
       Fault::hand_lost,
       22,
       "L4; falcon: no whole answer for 10 ms: H5",
       [](W& s) { s.handle("corrupt 100000"); },
       {.returns = [](W& s) { s.handle("corrupt 0"); }, .reset = Reset::takes_up}},
      {"hand",
       "packets that are too long",
       relay,
       Fault::hand_lost,
       22,
       "L4; falcon: no whole answer for 10 ms: H5",
       [](W& s) { s.handle("oversized 100000"); },
       {.returns = [](W& s) { s.handle("oversized 0"); }, .reset = Reset::takes_up}},
      {"hand",
       "loses its homing",
       relay,
       Fault::hand_lost,
       3,
       "falcon: fault, no force; H5",
       [](W& s) { s.handle("lose-homing"); },
       {.reset = Reset::refused}},
      {"hand", "half rate", goes_on, Fault::none, 0, "hal/README: devices have rates of their own",
       [](W& s) { s.falcon->slow_down(std::chrono::microseconds(1500)); }},

      // ---- camera: vivid, 60 pictures a second, stale after 100 ms ----
      {"camera",
       "stalls, gives pictures again",
       blind,
       Fault::none,
       kBlind,
       "M11, G5; alarm vision_stale",
       [](W& s) { drop_pictures(s, 100); },
       {.returns = [](W& s) { drop_pictures(s, 0); }, .end_ms = kSeesAgain_ms, .lost = 8}},
      {"camera",
       "damaged pictures only, for 150 ms",
       blind,
       Fault::none,
       kBlind,
       "M11, G5; v4l2: a damaged picture is a fault",
       [](W& s) { damage_pictures(s, kReturns_ms); },
       {.end_ms = kSeesAgain_ms, .complaint = "damaged"}},
      {"camera",
       "unplugged, plugged in again",
       blind,
       Fault::none,
       kBlind,
       "M11, G5; v4l2: disconnected, until it is opened again",
       [](W& s) { s.camera->unplug(); },
       {.returns = [](W& s) { s.camera->plug_in(); },
        .end_ms = kSeesAgain_ms,
        .complaint = "stopped streaming"}},
      {"camera",
       "stream breaks down, is opened again",
       blind,
       Fault::none,
       kBlind,
       "M11, G5; v4l2: disconnected, until it is opened again",
       [](W& s) { s.camera->vivid.set("Inject Fatal Streaming Error", 1); },
       {.returns = [](W& s) { s.camera->may_be_back = true; },
        .end_ms = kSeesAgain_ms,
        .complaint = "stopped streaming"}},
      {"camera",
       "one damaged picture",
       goes_on,
       Fault::none,
       0,
       "v4l2: the next one counts; three of them are 50 ms",
       [](W& s) { damage_pictures(s, kFault_ms); },
       {.complaint = "damaged"}},
      {"camera",
       "two pictures lost, and again",
       goes_on,
       Fault::none,
       0,
       "v4l2: gaps in the count; three frames are 50 ms",
       [](W& s) {
         for (const double from_ms : {kFault_ms, kFault_ms + 75}) {
           s.at(from_ms);
           drop_pictures(s, 100);
           s.at(from_ms + 35);
           drop_pictures(s, 0);
         }
       },
       {.lost = 4}},

      // ---- the core ----
      {"core",
       "overloaded: 3.6 of each 5 ms taken",
       relay,
       Fault::overrun,
       36,
       "config.hpp: overrun_limit, three missed in five",
       [](W& s) {
         become(95);
         for (int i = 0; i < 9; ++i) {
           s.at(kFault_ms + 5 * i);
           s.occupy(kFault_ms + 5 * i + 3.6);
         }
         become(kOutsidePriority);
       },
       {.missed = 40}},
      {"core",
       "stalls for 50 ms",
       relay,
       Fault::stage_lost,
       52,
       "servo.cpp: devices before missed ticks; the drives by their link loss",
       [](W& s) {
         s.stall_ms = 50;
         s.at(kFault_ms + 1 + 10 + 2);  // a force holds for 10 ms; a frame is on its way
         s.falcon->with([](emulator::FalconEmulator& f, WatchedHand&) {
           EXPECT_EQ(f.motors(), (std::array<int, 3>{})) << "a core that stalls pushes nobody";
         });
       },
       {.reset = Reset::refused, .drives = Drives::stand, .missed = 52}},
  };
  return all;
}

void PrintTo(const Cell& cell, std::ostream* out) { *out << cell.device << ", " << cell.fault; }

struct Measured {
  int reached = 0;  // ticks from the fault to the stop; 0: never
  int rest = 0;     // and until nothing moves, pushes or is open any more
  Fault first = Fault::none;
  double moved_um = 0;  // the true needle, from then on, braking aside
  std::uint64_t missed = 0;
  std::string left;        // of what the state asks for
  std::string broken;      // invariants
  std::uint64_t from = 0;  // the last tick before the fault
};

class MatrixLoopback : public testing::TestWithParam<Cell> {
 protected:
  static void TearDownTestSuite() {
    std::printf("%-9s%-39s%-28s%6s%7s%6s%7s  %-9s %s\n%s", "device", "fault", "state", "ticks", "within",
                "rest", "um", "reset", "invariants, what is left", table.c_str());
  }
  inline static std::string table;

  static constexpr int kBraked = 30;  // ticks: link loss of the drives, and their ramp

  static Measured run(const Cell& cell) {
    Measured m;
    WiredServo s(cell.device == std::string_view("camera"));
    s.rests_ms = cell.safe == Safe::blind ? 1e9 : kRests_ms;
    s.run(static_cast<std::uint64_t>(cell.also.end_ms), [&] {
      s.at(kFault_ms);
      cell.fails(s);
      m.from = static_cast<std::uint64_t>(cell.also.from_return ? s.now_ms() : kFault_ms);
      s.at(kReturns_ms);
      if (cell.also.returns) {
        cell.also.returns(s);
      }
      if (cell.also.reset != Reset::none) {
        s.at(kReset_ms);
        s.board->drive(kReset, true);
        s.at(kLetGo_ms);
        s.board->drive(kReset, false);
      }
    });
    m.missed = s.missed;
    for (const rt::test::Broken& b : s.checker->broken()) {
      m.broken += std::string(m.broken.empty() ? "" : " ") + rt::test::name(b.what).number;
    }
    // Else the checker would judge neither acceleration nor jerk.
    EXPECT_GE(s.regular, 0.9 * static_cast<double>(s.ticks.size()) - 2 * cell.also.missed) << cell.fault;
    if (s.ticks.empty()) {
      m.left = "did not run";
      return m;
    }
    if (s.camera && s.camera->complaint().find(cell.also.complaint) == std::string::npos) {
      m.left = "the camera says '" + s.camera->complaint() + "'";
    }
    leave(m, s.camera && s.camera->lost() < cell.also.lost, "no pictures were lost");
    if (cell.safe == Safe::blind) {
      judge_blind(s.ticks, m);
    } else {
      judge(cell, s.ticks, m);
    }
    return m;
  }

  static void leave(Measured& m, bool is, const char* what) {
    if (is && m.left.find(what) == std::string::npos) {
      m.left += std::string(m.left.empty() ? "" : ", ") + what;
    }
  }

  // The station runs on, blind from the alarm until vision is back.
  static void judge_blind(const std::vector<WiredTick>& ticks, Measured& m) {
    constexpr auto kBefore = static_cast<std::uint64_t>(kFault_ms);
    constexpr auto kBack = static_cast<std::uint64_t>(kReturns_ms);
    std::uint64_t blind_from = 0;
    double follows_um = 0;
    for (std::size_t i = 1; i < ticks.size(); ++i) {
      const WiredTick& was = ticks[i - 1];
      const WiredTick& now = ticks[i];
      const bool stale = (now.alarms & rt::alarm_vision_stale) != 0;
      leave(m, now.stage != StopStage::running || now.fault != Fault::none, "stopped");
      if (now.index <= kBefore) {
        leave(m, stale && now.phase == rt::Phase::injection, "blind before the fault");
        leave(m, now.index == kBefore && (now.phase != rt::Phase::injection || !now.gate),
              "no injection before");
        continue;
      }
      leave(m, now.level == was.level && now.index == was.index + 1, "no heartbeat");
      if (stale && blind_from == 0) {
        blind_from = now.index;
        m.reached = static_cast<int>(now.index - m.from);
        leave(m, m.reached < kSeesUntil, "blind too early");
      }
      if (blind_from == 0) {
        continue;
      }
      leave(m, now.gate, "gate open");
      m.rest = now.gate ? static_cast<int>(now.index - m.from) : std::max(m.rest, m.reached);
      const Vec3 way = 1e6 * (now.tip_m - was.tip_m);
      const double not_outward_um = std::max(0.0, -way.x()) + std::hypot(way.y(), way.z());
      if (now.index <= kBack) {
        leave(m, !stale, "sees by itself");
        m.moved_um += now.index > blind_from + kBraked ? not_outward_um : 0;
      } else if (now.index > kBack + kSees) {
        leave(m, stale, "does not see again");
        follows_um += not_outward_um;
      }
    }
    leave(m, follows_um < 1, "does not follow the hand again");
  }

  static void judge(const Cell& cell, const std::vector<WiredTick>& ticks, Measured& m) {
    constexpr auto kBefore = static_cast<std::uint64_t>(kFault_ms);
    const auto left = [&m](bool is, const char* what) { leave(m, is, what); };
    // At least the very next one: what takes the kernel some time may be noticed before it is over.
    const auto after = [&m](std::uint64_t index) {
      return std::max(1, static_cast<int>(index) - static_cast<int>(m.from));
    };
    const bool stops = cell.safe != Safe::goes_on;
    int edges = 0, edges_after_reset = 0, ticks_after = 0;
    double way_um = 0, after_reset_um = 0;
    std::uint64_t stopped_at = 0;
    for (std::size_t i = 1; i < ticks.size(); ++i) {
      const WiredTick& was = ticks[i - 1];
      const WiredTick& now = ticks[i];
      const double step_um = 1e6 * (now.tip_m - was.tip_m).norm();
      if (now.index <= kBefore) {
        left(now.stage != StopStage::running, "stopped before the fault");
        left(now.index == kBefore && (now.phase != rt::Phase::injection || !now.gate), "no injection before");
        continue;
      }
      const bool runs = now.stage == StopStage::running;
      if (!runs && stopped_at == 0) {
        stopped_at = now.index;
        m.reached = after(now.index);
        m.first = now.fault;
        left(now.gate, "gate open on the tick of the stop");
      }
      const bool before_reset =
          now.index < static_cast<std::uint64_t>(kReset_ms) || cell.also.reset == Reset::none;
      if (!stops) {
        way_um += step_um;
        left(!runs, "stopped");
        left(!now.gate, "gate shut");
        continue;
      }
      if (stopped_at == 0) {
        continue;
      }
      if (before_reset) {
        left(runs, "running again by itself");
        left(now.fault != m.first, "another cause");
        if (now.moves || now.pushes || now.gate) {
          m.rest = after(now.index);
        }
      }
      if (now.index > stopped_at + kBraked && before_reset) {
        m.moved_um += step_um;
      }
      if (now.index > stopped_at + static_cast<std::uint64_t>(cell.also.relay_ms) && before_reset) {
        ++ticks_after;
        edges += now.level != was.level ? 1 : 0;
      }
      if (now.index == static_cast<std::uint64_t>(kRests_ms) ||
          (now.index == static_cast<std::uint64_t>(cell.also.end_ms) - 1 && cell.also.reset == Reset::none)) {
        for (std::size_t d = 0; d < 3; ++d) {
          left(cell.also.drives == Drives::off && now.has_power[d], "a drive has power");
          left(cell.also.drives == Drives::stand && now.follows[d], "a drive follows");
        }
      }
      if (!before_reset) {
        after_reset_um += step_um;
        edges_after_reset += now.level != was.level ? 1 : 0;
      }
    }
    if (!stops) {
      m.first = ticks.back().fault;
      m.moved_um = way_um;
      left(!cell.also.needle_stands && way_um < 3, "does not follow the hand");
      left(cell.also.needle_stands && way_um > 2, "moves");
      return;
    }
    left(cell.safe == Safe::stop && edges < ticks_after - 1, "no heartbeat");
    left(cell.safe == Safe::relay && edges > 0, "heartbeat");
    left(ticks_after < 20, "too short a cell");
    if (cell.also.reset == Reset::none) {
      return;
    }
    const WiredTick& end = ticks.back();
    const bool up = end.stage == StopStage::running;
    left(up != (cell.also.reset == Reset::takes_up), up ? "reset" : "not running after the reset");
    left(up && !(end.follows[0] && end.follows[1] && end.follows[2]), "drives without power after the reset");
    left(up && edges_after_reset < 30, "no heartbeat after the reset");
    left(after_reset_um > 0.1, "moves after the reset");
    left(end.gate, "gate open after the reset");
  }
};

TEST_P(MatrixLoopback, leads_to_the_state_that_is_written_down) {
  const Cell& cell = GetParam();
  const Measured m = run(cell);
  const bool acts = cell.safe != Safe::goes_on;
  const std::string state = std::string(kSafeNames[static_cast<std::size_t>(cell.safe)]) +
                            (m.first != Fault::none ? std::string(" ") + rt::name(m.first) : "");
  std::array<char, 300> line;
  std::snprintf(line.data(), line.size(), "%-9s%-39s%-28s%6d%7d%6d%7.2f  %-9s %s %s\n", cell.device,
                cell.fault, state.c_str(), m.reached, cell.within, m.rest, m.moved_um,
                kResetNames[static_cast<std::size_t>(cell.also.reset)],
                m.broken.empty() ? "hold" : m.broken.c_str(), m.left.c_str());
  table += line.data();
  EXPECT_EQ(rt::name(m.first), std::string(rt::name(cell.cause)));
  EXPECT_LE(m.reached, cell.within);
  EXPECT_EQ(m.reached > 0, acts);
  EXPECT_EQ(m.broken, "") << "invariants";
  EXPECT_EQ(m.left, "");
  EXPECT_LE(m.missed, static_cast<std::uint64_t>(cell.also.missed));
  if (acts) {
    EXPECT_LE(m.rest, m.reached + cell.also.rest);
    EXPECT_LE(m.moved_um, cell.also.may_move_um) << "the needle stands";
  }
}
INSTANTIATE_TEST_SUITE_P(EveryFault, MatrixLoopback, testing::ValuesIn(cells()),
                         [](const testing::TestParamInfo<Cell>& at) {
                           std::string name = std::string(at.param.device) + "_" + at.param.fault;
                           std::erase_if(name,
                                         [](char c) { return c != ' ' && c != '_' && std::isalnum(c) == 0; });
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace punctum::loopback
