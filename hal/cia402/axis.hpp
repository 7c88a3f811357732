// One drive as the tick sees it: its answers to the SYNC, its heartbeat and emergencies, and the controlword
// for its next cycle. Sends nothing itself.
#pragma once

#include <cstdint>

#include "hal/cia402/canopen.hpp"
#include "hal/cia402/config.hpp"
#include "hal/cia402/power_state.hpp"
#include "hal/realtime.hpp"

namespace punctum::cia402 {

// What the core wants of all drives.
enum class Wanted : std::uint8_t { off, quick_stop, operation };

class Axis {
 public:
  void set_up(const AxisParams& params, bool to_home, double heartbeat_timeout_s);

  // ---- what comes ----
  void take_position(const CanFrame& frame, std::int64_t sync_ns) NONBLOCKING;
  void take_heartbeat(const CanFrame& frame, std::int64_t now_ns) NONBLOCKING;
  void take_emergency(const CanFrame& frame) NONBLOCKING;
  void take_sdo_answer(const CanFrame& frame) NONBLOCKING;

  // ---- once per cycle, before the SYNC ----
  void begin(std::int64_t now_ns) NONBLOCKING;  // the first cycle: everything is heard from here on
  void step(Wanted wanted, std::int64_t now_ns) NONBLOCKING;
  void synced() NONBLOCKING;  // the SYNC went out

  // The controlword acts at the next SYNC.
  [[nodiscard]] CanFrame command() const NONBLOCKING;
  // A request that homing needs, as long as one is due.
  [[nodiscard]] bool request_due() const NONBLOCKING { return request_due_; }
  [[nodiscard]] CanFrame request() const NONBLOCKING;
  void requested() NONBLOCKING { request_due_ = false; }

  void set_target(std::int32_t counts) NONBLOCKING { target_ = counts; }
  // Off at once, whatever the drive says: for a command that cannot wait for the next cycle.
  void urge(Wanted wanted) NONBLOCKING;
  // A quick stop that nobody asked for: off until it was told off. A drive that waits for its power is left
  // so.
  void drop() NONBLOCKING;

  // ---- what it is ----
  [[nodiscard]] int node() const NONBLOCKING { return params_.node; }
  [[nodiscard]] const AxisParams& params() const NONBLOCKING { return params_; }
  [[nodiscard]] PowerState state() const NONBLOCKING { return state_; }
  [[nodiscard]] bool seen() const NONBLOCKING { return seen_; }
  [[nodiscard]] bool fresh() const NONBLOCKING { return fresh_; }  // answered the last SYNC
  [[nodiscard]] std::int32_t position() const NONBLOCKING { return position_; }
  [[nodiscard]] std::int32_t target() const NONBLOCKING { return target_; }
  [[nodiscard]] std::int32_t following_error() const NONBLOCKING;
  [[nodiscard]] bool enabled() const NONBLOCKING;
  [[nodiscard]] bool at_standstill() const NONBLOCKING { return still_; }
  // Silent for too long, restarted, or no longer operational: it must be configured again.
  [[nodiscard]] bool lost() const NONBLOCKING { return lost_; }
  [[nodiscard]] bool has_fault(Wanted wanted, std::int64_t now_ns) const NONBLOCKING;
  [[nodiscard]] Emergency last_emergency() const NONBLOCKING { return emergency_; }
  [[nodiscard]] std::uint32_t emergencies() const NONBLOCKING { return emergencies_; }
  [[nodiscard]] std::uint32_t malformed() const NONBLOCKING { return malformed_; }
  [[nodiscard]] bool homed() const NONBLOCKING { return !to_home_; }

 private:
  // From power off to following set-points.
  enum class Step : std::uint8_t {
    see_it_off,    // the drive must show that it has no power before it gets it again
    walk,          // 06, 07, 0F
    start_homing,  // controlword bit 4
    home,
    to_position_mode,       // 6060 := 8
    confirm_position_mode,  // 6061 = 8?
    follow,
    dropped,  // it left operation unasked, or homing failed: off until it was told off
  };

  void walk(std::int64_t now_ns) NONBLOCKING;
  void home() NONBLOCKING;
  void change_mode(std::int64_t now_ns) NONBLOCKING;
  void next(Step step) NONBLOCKING;

  AxisParams params_;
  bool to_home_ = false, attained_ = false;  // attained: it has homed, and may still be in that mode
  std::int64_t heartbeat_timeout_ns_ = 0;

  std::uint16_t statusword_ = 0;
  PowerState state_ = PowerState::unknown;
  std::int32_t position_ = 0;
  bool seen_ = false, fresh_ = false;
  std::int64_t sample_ns_ = 0;

  std::int32_t still_at_ = 0;  // the drive has been there ...
  std::int64_t still_since_ns_ = 0;
  bool still_ = false;  // ... for long enough

  std::int64_t heard_ns_ = 0;
  bool lost_ = false;
  Emergency emergency_;
  std::uint32_t emergencies_ = 0, malformed_ = 0;

  Step step_ = Step::see_it_off;
  int cycles_ = 0;  // in this step, answered by the drive
  std::uint16_t controlword_ = kDisableVoltage;
  std::int32_t target_ = 0;
  std::int32_t given_ = 0, reached_ = 0;  // the targets that the last SYNC gave, and the one before
  bool reset_tried_ = false;
  std::int64_t reset_ns_ = 0;
  bool request_due_ = false;
  std::int64_t requested_ns_ = 0;
};

}  // namespace punctum::cia402
