// A CiA 402 servo drive as a CANopen slave, written from CiA 301 and CiA 402 and from nothing of hal/cia402.
//
// Frames in, frames out, at times that the caller gives: it runs over SocketCAN (main.cpp) as well as inside
// a test. Modes: homing (6; methods 35 and 37, and 17 and 18 onto a limit switch) and cyclic synchronous
// position (8).
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tools/emulators/drive/motor.hpp"
#include "tools/emulators/drive/object_dictionary.hpp"
#include "tools/emulators/drive/pdos.hpp"
#include "tools/emulators/drive/sdo_server.hpp"

namespace punctum::emulator {

struct DriveParams {
  int node = 1;
  MotorLimits motor = {};
  double start_counts = 0;
  double switch_counts = -50'000;  // the limit switch of homing methods 17 (negative) and 18 (positive)
  std::uint32_t vendor_id = 0x0000'0402;
  std::uint32_t product_code = 1;
  std::string name = "punctum-drive";
};

// The states of CiA 402, by their statusword (bits 6, 5, 3 .. 0).
enum class DriveState : std::uint8_t {
  switch_on_disabled = 0x40,
  ready_to_switch_on = 0x21,
  switched_on = 0x23,
  operation_enabled = 0x27,
  quick_stop_active = 0x07,
  fault_reaction = 0x0F,
  fault = 0x08,
};

class Drive {
 public:
  explicit Drive(DriveParams params);
  Drive(const Drive&) = delete;
  Drive& operator=(const Drive&) = delete;

  void on_frame(const can_frame& frame, std::int64_t now_ns);
  // Up to now: the motor moves, time-outs run. What it has to send, since the last call and from on_frame().
  [[nodiscard]] std::vector<can_frame> step(std::int64_t now_ns);

  // A fault or a bad habit, as a line of words; `commands` lists them. Empty: done. Otherwise what is wrong.
  [[nodiscard]] std::string command(std::string_view line);
  static const char* const kCommands;

  [[nodiscard]] int node() const { return params_.node; }
  // What such a drive has, as an electronic data sheet for any node (CiA 306).
  [[nodiscard]] static std::string data_sheet(const DriveParams& params);
  [[nodiscard]] DriveState state() const { return state_; }
  [[nodiscard]] std::uint16_t statusword() const;
  [[nodiscard]] int nmt_state() const { return nmt_; }  // as its heartbeat says
  [[nodiscard]] double position() const { return motor_.position(); }
  [[nodiscard]] double speed() const { return motor_.speed(); }
  [[nodiscard]] std::int64_t value(std::uint16_t index, std::uint8_t sub = 0) const;
  [[nodiscard]] bool motor_has_power() const;
  // The largest step of a set-point since operation was enabled, and from where it stood then.
  [[nodiscard]] double largest_step() const { return largest_step_; }

 private:
  void boot();
  void add_communication_objects();
  void add_drive_objects();
  void start_from_stored(std::uint16_t from, std::uint16_t to);
  void store();

  void on_nmt(const can_frame& frame);
  void become(int nmt);
  void on_sync(const can_frame& frame, std::int64_t now_ns);
  void on_sdo(const can_frame& frame);
  void on_written(std::uint16_t index, std::uint8_t sub);
  void refresh();

  void control(std::uint16_t word);
  void raise_fault(std::uint16_t code, std::uint8_t error_register);
  void link_lost(std::uint16_t code);
  void take_mode();
  void end_homing();
  void communication_error(std::uint16_t code);
  void communication_back(std::uint16_t code);
  void emergency(std::uint16_t code);
  void advance(std::int64_t now_ns);
  void follow_set_point(double dt_s, std::int64_t now_ns);
  void home(double dt_s);
  void stop_on_ramp(double dt_s);
  void watch_time_outs(std::int64_t now_ns);
  void go(DriveState state);
  void send(std::uint32_t id, std::uint8_t size, const std::uint8_t* data);

  DriveParams params_;
  ObjectDictionary objects_;
  Motor motor_;
  std::vector<can_frame> out_;
  Pdos pdos_;
  SdoServer sdo_;
  // What object 1010 has stored, and a reset brings back.
  std::map<ObjectDictionary::Key, std::int64_t> stored_;

  int nmt_ = 0;  // 0 before boot-up, 0x7F pre-operational, 5 operational, 4 stopped
  std::int64_t now_ns_ = -1, heartbeat_ns_ = 0, sync_ns_ = -1, master_ns_ = -1;

  DriveState state_ = DriveState::switch_on_disabled;
  std::uint16_t controlword_ = 0;
  int mode_ = 8;
  double demand_ = 0;
  double largest_step_ = 0;
  bool homing_ = false, homed_ = false, homing_error_ = false, limited_ = false;
  bool off_switch_ = false;
  std::int64_t following_since_ns_ = -1;

  // Bad habits.
  bool ignore_quick_stop_ = false, ignore_disable_ = false, ignore_enable_ = false;
  std::uint16_t communication_error_ = 0;  // that lasts
  bool mute_heartbeat_ = false, mute_pdo_ = false, mute_sdo_ = false, mute_emergency_ = false;
  bool frozen_ = false, stuck_encoder_ = false;
  double stuck_at_ = 0, creep_counts_s_ = 0;
};

}  // namespace punctum::emulator
