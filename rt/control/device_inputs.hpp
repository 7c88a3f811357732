// Reads every device on every tick, keeps the last good values, and judges whether they are fresh and can be
// true. Nothing is written here.
#pragma once

#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "rt/control/config.hpp"
#include "rt/control/contact_pair.hpp"
#include "rt/control/devices.hpp"
#include "rt/control/enabling_device.hpp"
#include "rt/control/following.hpp"
#include "rt/control/hand_check.hpp"
#include "rt/control/hand_watch.hpp"
#include "rt/control/lasting_button.hpp"
#include "rt/control/sample_clock.hpp"
#include "rt/control/tick_timing.hpp"
#include "rt/station/alarm.hpp"
#include "rt/station/device.hpp"
#include "rt/station/fault.hpp"

namespace punctum::rt {

// The values of this tick, or the last good ones where a device gave none.
struct Readings {
  hal::HandState hand;
  bool hand_seen = false;     // at least once
  bool hand_fresh = false;    // a new sample arrived on this tick
  bool hand_begins = false;   // it is the first one: it has nothing to do with what was before
  bool hand_leaps = false;    // far from where it was going: what lies between is not believed
  bool hand_stuck = false;    // a changing force does not move it
  double hand_age_s = 0;      // of `hand`
  double between_hand_s = 0;  // between the two newest samples, by their own times; > 0
  bool enabled = true;  // the enabling device was pressed since the start or the last stop, or there is none
  bool pressed_anew = false;  // the enabling device, on this tick

  bool inject_down = false;  // as read; the button of `hand`: once it has lasted

  bool has_stage = false;
  hal::StageState stage;
  bool stage_seen = false;
  bool stage_fresh = false;  // a new sample arrived on this tick
  double stage_age_s = 0;    // of `stage`

  bool has_estop = false;
  hal::EstopState estop;
  bool reset_down = false;         // as read; estop.reset_pressed: for as long as a finger presses
  bool estop_readable = false;     // read on this tick, by a sample that is new enough
  bool estop_discrepancy = false;  // an open contact, and the two have disagreed for too long before

  bool injector_open = false;  // as the injector reports
  bool injector_known = true;  // it reported within its time limit, or there is none
  bool injected = false;       // it was open on this tick while its gate was
  double vacuum_Pa = 0;
  double sensor_N = 0;  // force sensor
  double sensor_filtered_N = 0;
  bool sensor_fresh = false;  // a good value within its time limit

  Fault estop_fault = Fault::none;
  Causes device_faults;  // of the other devices
  std::uint32_t alarms = 0;
  std::uint8_t unusable = 0;  // DeviceBits: whose data alarm_sensor is about

  [[nodiscard]] bool button(std::uint32_t b) const NONBLOCKING { return (hand.buttons & b) != 0; }
  // The needle's position is known, or there is no stage to know it from.
  [[nodiscard]] bool needle_known() const NONBLOCKING { return !has_stage || stage_seen; }
  // The stage holds its position under power, and the operator lets it move.
  [[nodiscard]] bool stage_ready() const NONBLOCKING { return enabled && (!has_stage || stage.enabled); }
  [[nodiscard]] bool at_standstill() const NONBLOCKING { return !has_stage || stage.at_standstill; }
};

inline constexpr double kSensorTau_s = 0.005;  // of sensor_filtered_N

// What the last tick did: the readings of this tick are judged by it.
struct LastOutput {
  hal::Vec3 hand_force_N = hal::Vec3::Zero();  // device frame
  bool running = true;                         // no stop was latched
  bool between_cells = false;                  // the phase was `clear`
  bool gate_open = false;
  bool uncoupled = false;        // the hand did not move the needle: set-points begin anew where it is
  bool stage_commanded = false;  // a set-point was sent
  hal::Vec3 set_point_m = hal::Vec3::Zero();
};

class DeviceInputs {
 public:
  DeviceInputs(const ServoConfig& config, const Devices& devices) NONBLOCKING;

  const Readings& read(const TickTime& time, const LastOutput& last) NONBLOCKING;
  [[nodiscard]] const Readings& readings() const NONBLOCKING { return readings_; }

 private:
  // Each returns what is wrong, Fault::none if nothing is.
  [[nodiscard]] Fault read_estop(const TickTime& time) NONBLOCKING;
  [[nodiscard]] Fault read_hand(const TickTime& time, const LastOutput& last) NONBLOCKING;
  [[nodiscard]] Fault judge_enabling(const TickTime& time, const LastOutput& last) NONBLOCKING;
  [[nodiscard]] Fault read_enabling_switch(const TickTime& time) NONBLOCKING;
  [[nodiscard]] Fault read_stage(const TickTime& time, const LastOutput& last) NONBLOCKING;
  void unusable(DeviceBit device) NONBLOCKING {
    readings_.alarms |= alarm_sensor;
    readings_.unusable |= device;
  }
  void take_hand(const hal::HandState& read, const LastOutput& last) NONBLOCKING;
  void release_buttons() NONBLOCKING;
  [[nodiscard]] bool axis_can_be_true(const hal::Vec3& axis, const LastOutput& last) NONBLOCKING;
  // The axis that is told, no further from the last one than drives turn a needle.
  [[nodiscard]] hal::Vec3 turned(const hal::Vec3& axis, std::int64_t sample_ns, const LastOutput& last) const
      NONBLOCKING;
  [[nodiscard]] Fault judge_stage(const LastOutput& last) NONBLOCKING;
  [[nodiscard]] Fault not_enabled(const TickTime& time, const LastOutput& last) NONBLOCKING;
  [[nodiscard]] Fault read_vacuum(const TickTime& time, const LastOutput& last) NONBLOCKING;
  [[nodiscard]] Fault read_injector(const TickTime& time, const LastOutput& last) NONBLOCKING;
  void read_force_sensor(const TickTime& time) NONBLOCKING;

  const ServoConfig config_;
  const Devices devices_;
  Readings readings_;

  SampleClock hand_clock_;
  HandCheck hand_check_;
  HandCheck::Is hand_is_ = HandCheck::Is::ignored;  // the newest sample
  hal::Vec3 newest_hand_m_ = hal::Vec3::Zero();
  HandWatch hand_watch_;
  LastingButton inject_, next_cell_;
  SampleClock stage_clock_;
  hal::Vec3 mounted_axis_ = -hal::Vec3::UnitX();  // before the station moved
  hal::Vec3 last_told_axis_ = hal::Vec3::Zero();  // believed or not; zero before the first
  std::optional<EnablingDevice> enabling_;
  SampleClock enabling_clock_;  // of a switch of its own
  ContactPair enabling_contacts_;
  std::int64_t enabling_ns_ = 0;
  FollowingCheck following_;
  bool stage_was_enabled_ = false;
  double not_enabled_s_ = 0;
  SampleClock estop_clock_;
  ContactPair estop_contacts_;
  double reset_held_s_ = 0;
  SampleClock vacuum_clock_;
  double vacuum_low_s_ = 0;
  double vacuum_same_s_ = 0;  // the gauge has shown the same digits
  SampleClock injector_clock_;
  bool opened_unseen_ = false;  // its gate was open since it reported that it is shut
  double open_unasked_s_ = 0;   // the injector is, or may be, open although its gate is shut
  SampleClock sensor_clock_;
  bool sensor_seen_ = false;
  std::int64_t sensor_ns_ = 0;
};

}  // namespace punctum::rt
