// The ground of the house: what the core may touch of the world, as plain types and interfaces.
//
// SI units. World frame = microscope frame: origin at the centre of the picture, x to the right,
// y down (as pixel rows run), z away from the observer along the optical axis; needle and cell live in it.
// Every method here is safe to call from the real-time tick: it never blocks, allocates or throws,
// unless its comment says otherwise.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

namespace punctum::hal {

using Vec3 = Eigen::Vector3d;
using Quat = Eigen::Quaternion<double, Eigen::DontAlign>;

enum class Status : std::uint8_t {
  ok,            // fresh, valid data
  no_data,       // nothing new since the last call; the caller keeps what it has and its age grows
  fault,         // the device reports a fault of its own
  disconnected,  // the device is gone
};

// CLOCK_MONOTONIC in nanoseconds, or a virtual time with the same meaning.
class Clock {
 public:
  [[nodiscard]] virtual std::int64_t now_ns() const noexcept = 0;
  virtual void sleep_until_ns(std::int64_t t_ns) noexcept = 0;  // absolute; returns at or after t_ns

 protected:
  ~Clock() = default;
};

// Buttons of the haptic handle.
inline constexpr std::uint32_t kButtonClutch = 1U << 0;    // pressed: hand and stage are uncoupled
inline constexpr std::uint32_t kButtonInject = 1U << 1;    // pressed: deposit the substance
inline constexpr std::uint32_t kButtonNextCell = 1U << 2;  // rising edge: a fresh cell is in place

struct HandState {
  Vec3 position_m = Vec3::Zero();  // device frame: x right, y up, z towards the operator
  Quat orientation = Quat::Identity();
  std::uint32_t buttons = 0;
};

// A force-feedback device: six-degree-of-freedom pose in, three-degree-of-freedom force out.
class HapticDevice {
 public:
  [[nodiscard]] virtual Status read(HandState& out) noexcept = 0;
  [[nodiscard]] virtual Status write_force(const Vec3& force_N) noexcept = 0;

 protected:
  ~HapticDevice() = default;
};

struct StageState {
  Vec3 tip_m = Vec3::Zero();   // needle tip by the stage's own encoders
  Vec3 axis = -Vec3::UnitX();  // unit vector of the needle, pointing out of its tip
  Vec3 following_error_m = Vec3::Zero();
  bool enabled = false;
  bool at_standstill = false;
};

struct StageCommand {
  Vec3 tip_m = Vec3::Zero();
  Vec3 axis = -Vec3::UnitX();
};

class Stage {
 public:
  [[nodiscard]] virtual Status read(StageState& out) noexcept = 0;
  [[nodiscard]] virtual Status command(const StageCommand& set_point) noexcept = 0;
  virtual void quick_stop() noexcept = 0;     // brake on the drive's own ramp, then hold
  virtual void enable(bool on) noexcept = 0;  // drive power; off only at standstill or past the limit

 protected:
  ~Stage() = default;
};

// Two normally closed contacts, a reset button, a heartbeat output that feeds a monitored relay.
struct EstopState {
  bool contact_a_closed = true;  // false = stop; a cut wire reads false
  bool contact_b_closed = true;
  bool reset_pressed = false;
  bool pulse_seen = false;  // an open pulse shorter than a tick was queued as an event
};

class EstopChain {
 public:
  [[nodiscard]] virtual Status read(EstopState& out) noexcept = 0;
  virtual void heartbeat(bool level) noexcept = 0;

 protected:
  ~EstopChain() = default;
};

class Injector {
 public:
  virtual void gate(bool open) noexcept = 0;  // fail-safe shut
  [[nodiscard]] virtual Status read(bool& open) noexcept = 0;

 protected:
  ~Injector() = default;
};

// Suction that holds the cell. It is never released by a stop: releasing it loses the cell.
class HoldingVacuum {
 public:
  [[nodiscard]] virtual Status read(double& pressure_Pa) noexcept = 0;  // below ambient, positive

 protected:
  ~HoldingVacuum() = default;
};

class ForceSensor {
 public:
  [[nodiscard]] virtual Status read(double& axial_force_N) noexcept = 0;  // compression positive

 protected:
  ~ForceSensor() = default;
};

// One picture, 8-bit grey. The pixels stay valid until the next call of next() or release().
struct Frame {
  const std::uint8_t* pixels = nullptr;
  int width = 0;
  int height = 0;
  int stride = 0;                // bytes from row to row
  std::uint64_t sequence = 0;    // gaps are lost frames
  std::int64_t exposure_ns = 0;  // on the clock of the station
  std::int64_t deliver_ns = 0;   // simulated latency: the observation may not be seen before; 0 in real time
};

// Used by the vision program only; may block and allocate.
class Camera {
 public:
  // Waits at most timeout_ns for the next picture: ok, no_data (time-out), fault (this one cannot be
  // used: say so and go on), disconnected (there will be no more).
  [[nodiscard]] virtual Status next(Frame& out, std::int64_t timeout_ns) = 0;
  virtual void release(const Frame& frame) = 0;  // after its observation is published

 protected:
  ~Camera() = default;
};

}  // namespace punctum::hal
