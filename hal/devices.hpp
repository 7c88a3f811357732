// The ground of the house: what the core may touch of the world, as plain types and interfaces.
//
// SI units. World frame = microscope frame: origin at the centre of the picture, x to the right,
// y down (as pixel rows run), z away from the observer along the optical axis; needle and cell live in it.
// Every method here is safe to call from the real-time tick: it never blocks, allocates or throws,
// unless its comment says otherwise. How a device is opened, started and closed is in device_life.hpp.
//
// Every reading carries sample_ns: the time on the station's clock at which the device took it. Devices have
// rates of their own, so a reading with Status::ok may be older than the tick; a device that repeats an old
// value repeats its time. A reading with another status leaves `out` as it was. The core takes a sample once,
// by its time, and lets it age: a device that leaves sample_ns out, or ahead of the station's clock, is
// silent to it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::hal {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaternion<double, Eigen::DontAlign>;

// Of three numbers: times zero, infinity is no number.
template <class Vector>
[[nodiscard]] bool is_finite(const Vector& v) NONBLOCKING {
  return 0 * v.x() + 0 * v.y() + 0 * v.z() == 0;
}

enum class Status : std::uint8_t {
  ok,            // fresh, valid data
  no_data,       // nothing new since the last call; the caller keeps what it has and its age grows
  fault,         // the device reports a fault of its own
  disconnected,  // the device is gone
};

// CLOCK_MONOTONIC in nanoseconds, or a virtual time with the same meaning.
class Clock {
 public:
  [[nodiscard]] virtual std::int64_t now_ns() const NONBLOCKING = 0;
  virtual void sleep_until_ns(std::int64_t t_ns) noexcept = 0;  // absolute; returns at or after t_ns

 protected:
  ~Clock() = default;
};

// Buttons of the haptic handle.
inline constexpr std::uint32_t kButtonClutch = 1U << 0;    // pressed: hand and stage are uncoupled
inline constexpr std::uint32_t kButtonInject = 1U << 1;    // pressed: deposit the substance
inline constexpr std::uint32_t kButtonNextCell = 1U << 2;  // rising edge: a fresh cell is in place
inline constexpr std::uint32_t kButtonEnable = 1U << 3;    // enabling device, held: the station may move
inline constexpr std::uint32_t kButtonPanic = 1U << 4;     // its third position: squeezed

struct HandState {
  Vec3 position_m = Vec3::Zero();  // device frame: x right, y up, z towards the operator
  Quat orientation = Quat::Identity();
  std::uint32_t buttons = 0;
  std::int64_t sample_ns = 0;
};

// A force-feedback device: six-degree-of-freedom pose in, three-degree-of-freedom force out.
class HapticDevice {
 public:
  [[nodiscard]] virtual Status read(HandState& out) NONBLOCKING = 0;
  // no_data: it takes none now, and the force before goes on.
  [[nodiscard]] virtual Status write_force(const Vec3& force_N) NONBLOCKING = 0;

 protected:
  ~HapticDevice() = default;
};

struct StageState {
  Vec3 tip_m = Vec3::Zero();   // needle tip by the stage's own encoders
  Vec3 axis = -Vec3::UnitX();  // unit vector of the needle, pointing out of its tip
  Vec3 following_error_m = Vec3::Zero();
  bool enabled = false;  // it takes set-points
  bool powered = false;  // its motors have power, also while a quick stop holds it
  bool at_standstill = false;
  std::int64_t sample_ns = 0;
};

struct StageCommand {
  Vec3 tip_m = Vec3::Zero();
  Vec3 axis = -Vec3::UnitX();
};

// A stage whose drives take a new set-point on every tick, for the servo.
class Stage {
 public:
  [[nodiscard]] virtual Status read(StageState& out) NONBLOCKING = 0;
  [[nodiscard]] virtual Status command(const StageCommand& set_point) NONBLOCKING = 0;
  virtual void quick_stop() NONBLOCKING = 0;     // brake on the drive's own ramp, then hold
  virtual void enable(bool on) NONBLOCKING = 0;  // drive power; off only at standstill or past the limit

 protected:
  ~Stage() = default;
};

struct PositionerState {
  Vec3 position_m = Vec3::Zero();  // the positioner's own frame
  int queued = 0;                  // moves that wait behind the present one
  bool moving = false;
  bool fault = false;  // it refuses every move until it is opened again
  std::int64_t sample_ns = 0;
};

// A slow manipulator behind a serial line or a network, too slow for the tick: it makes point-to-point moves
// that it queues and profiles by itself. For click-to-position and parking, never for the servo: every method
// may block, and one ordinary thread calls them.
class QueuedPositioner {
 public:
  [[nodiscard]] virtual Status read(PositionerState& out) = 0;
  // Queues a straight move that begins when the ones before it have ended. False, and nothing is queued: the
  // queue is full, the target is outside the travel or not a number, or the positioner has a fault.
  [[nodiscard]] virtual bool move_to(const Vec3& position_m) = 0;
  virtual void stop() = 0;  // brakes on the positioner's own ramp and empties the queue

 protected:
  ~QueuedPositioner() = default;
};

// Two normally closed contacts, a reset button, a heartbeat output that feeds a monitored relay, and where it
// is wired an output that enables the drives.
struct EstopState {
  bool contact_a_closed = true;  // false = stop; a cut wire reads false
  bool contact_b_closed = true;
  bool reset_pressed = false;
  bool pulse_seen = false;  // a contact has opened and closed again since the last reading
  std::int64_t sample_ns = 0;
};

class EstopChain {
 public:
  [[nodiscard]] virtual Status read(EstopState& out) NONBLOCKING = 0;
  virtual void heartbeat(bool level) NONBLOCKING = 0;
  virtual void drive_power(bool /*on*/) NONBLOCKING {}  // whatever Stage::enable() is told

 protected:
  ~EstopChain() = default;
};

// A three-position enabling switch beside the handle: two contacts, both closed in its middle position only.
struct EnablingState {
  bool contact_a_closed = false;  // false = let go or squeezed; a cut wire reads false
  bool contact_b_closed = false;
  bool pulse_seen = false;  // a contact has opened and closed again since the last reading
  std::int64_t sample_ns = 0;
};

class EnablingSwitch {
 public:
  [[nodiscard]] virtual Status read(EnablingState& out) NONBLOCKING = 0;

 protected:
  ~EnablingSwitch() = default;
};

struct InjectorState {
  bool open = false;  // by the valve's own contact
  std::int64_t sample_ns = 0;
};

class Injector {
 public:
  virtual void gate(bool open) NONBLOCKING = 0;  // fail-safe shut
  [[nodiscard]] virtual Status read(InjectorState& out) NONBLOCKING = 0;

 protected:
  ~Injector() = default;
};

struct VacuumState {
  double pressure_Pa = 0;  // below ambient, positive
  std::int64_t sample_ns = 0;
};

// Suction that holds the cell. It is never released by a stop: releasing it loses the cell.
class HoldingVacuum {
 public:
  [[nodiscard]] virtual Status read(VacuumState& out) NONBLOCKING = 0;

 protected:
  ~HoldingVacuum() = default;
};

struct ForceState {
  double axial_force_N = 0;  // compression positive
  std::int64_t sample_ns = 0;
};

class ForceSensor {
 public:
  [[nodiscard]] virtual Status read(ForceState& out) NONBLOCKING = 0;

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
