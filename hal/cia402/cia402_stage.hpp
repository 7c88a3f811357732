// A stage of CiA 402 drives on a CAN bus, and a force sensor beside them: one CANopen master.
//
// One cycle: at the beginning of a tick the answers to the last SYNC are taken, what was not sent in the tick
// before is sent, and the next SYNC goes out; at its end the new set-points go out, which act at the next
// SYNC. Whatever ends the bus (bus-off, a drive that restarts, a heartbeat that stays away) is latched as
// Status::disconnected until the device is opened again. A drive's fault is Status::fault until the drive is
// told off; it is reset, once, when the drive is told on again. While nothing at all is heard nothing is sent
// but a stop, so that no old set-points wait for the contact to return.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hal/cia402/axis.hpp"
#include "hal/cia402/calibration.hpp"
#include "hal/cia402/can_bus.hpp"
#include "hal/cia402/config.hpp"
#include "hal/cia402/configuration.hpp"
#include "hal/device_life.hpp"

namespace punctum::cia402 {

// Counted from open() on.
struct Health {
  std::uint32_t not_sent = 0;    // the queue was full: txqueuelen
  std::uint32_t bus_errors = 0;  // error frames
  std::uint32_t floods = 0;      // ticks with more frames than are read in one
  std::uint32_t silences = 0;    // nothing was heard, and the drives were stopped
  std::uint32_t malformed = 0;   // frames of another length than agreed
  bool bus_off = false;
};

class Cia402Stage final : public hal::Device, public hal::Stage, public hal::ForceSensor {
 public:
  // clock: the station's. tick_s: between two calls of read(). clock.sleep_until_ns is used by open, start,
  // safe_state and close only.
  Cia402Stage(const CanStageParams& params, double tick_s, hal::Clock& clock, std::unique_ptr<CanBus> bus);

  [[nodiscard]] tl::expected<void, std::string> open() override;
  [[nodiscard]] hal::Served served() noexcept override;
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t first_tick_ns) override;
  [[nodiscard]] std::int64_t longest_start_ns() const noexcept override;
  void safe_state() noexcept override;
  void close() noexcept override;

  // Once per tick: it is this that drives the bus.
  [[nodiscard]] hal::Status read(hal::StageState& out) NONBLOCKING override;
  [[nodiscard]] hal::Status command(const hal::StageCommand& set_point) NONBLOCKING override;
  void quick_stop() NONBLOCKING override;
  void enable(bool on) NONBLOCKING override;
  [[nodiscard]] hal::Status read(hal::ForceState& out) NONBLOCKING override;

  [[nodiscard]] Health health() const NONBLOCKING;
  [[nodiscard]] std::span<const Axis> axes() const NONBLOCKING { return {axes_.data(), count_}; }
  // What went wrong since open(), a line each; empty if nothing did.
  [[nodiscard]] std::string report() const;

 private:
  [[nodiscard]] tl::expected<void, std::string> configure();
  [[nodiscard]] tl::expected<void, std::string> configure(SdoClient& sdo, const AxisParams& axis) const;
  [[nodiscard]] tl::expected<void, std::string> check_identity(SdoClient& sdo, const AxisParams& axis) const;
  [[nodiscard]] static tl::expected<void, std::string> take_power(SdoClient& sdo, int node);
  [[nodiscard]] std::vector<std::uint16_t> identifiers() const;
  void wait_off(std::int64_t longest_ns, bool for_standstill) noexcept;

  void drain(std::int64_t now_ns) NONBLOCKING;
  void take(const CanFrame& frame, std::int64_t now_ns) NONBLOCKING;
  void take_force(const CanFrame& frame) NONBLOCKING;
  void cycle(std::int64_t now_ns) NONBLOCKING;
  void fall_silent() NONBLOCKING;
  void send_commands() NONBLOCKING;
  void send_sync(std::int64_t now_ns) NONBLOCKING;
  void send_stop(std::int64_t now_ns) NONBLOCKING;
  [[nodiscard]] bool send(const CanFrame& frame) NONBLOCKING;
  void tell(Wanted wanted) NONBLOCKING;
  [[nodiscard]] hal::Status judge(std::int64_t now_ns) NONBLOCKING;
  [[nodiscard]] hal::StageState state() const NONBLOCKING;
  [[nodiscard]] bool all_enabled() const NONBLOCKING;

  CanStageParams params_;
  double tick_s_, cycle_s_;
  hal::Clock& clock_;
  std::unique_ptr<CanBus> bus_;
  Calibration calibration_;
  std::int64_t heartbeat_period_ns_;
  std::array<Axis, kMaxAxes> axes_{};
  std::size_t count_;

  bool open_ = false, started_ = false, begun_ = false;
  bool disconnected_ = false;  // until it is opened again
  bool bus_gone_ = false;      // nothing can be sent
  bool flooded_ = false;       // on this tick: which answer is the newest is not known
  Wanted wanted_ = Wanted::off;
  bool holding_ = false;  // all drives follow; set-points are counted from here:
  Counts anchor_ = Counts::Zero();
  hal::Vec3 anchor_m_ = hal::Vec3::Zero();
  std::array<bool, kMaxAxes> unsent_{};  // commands for the next SYNC
  int ticks_to_sync_ = 0;
  int unheard_ = 0;                  // SYNCs since the last frame of a node
  bool silent_ = false;              // too many: nothing goes out but a stop
  bool stop_due_ = false;            // in this silence: the stop still waits for its SYNC
  bool excused_ = false;             // the drives were stopped for it, and have not all answered since
  Wanted told_ = Wanted::operation;  // in this silence: what was sent last
  std::int64_t sync_ns_ = 0;
  std::int64_t heartbeat_ns_ = 0;  // of the master's last one

  hal::ForceState force_;
  bool force_fresh_ = false;
  Health health_;
};

}  // namespace punctum::cia402
