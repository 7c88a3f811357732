// Devices between servo and input sample. With a device behind them they write down what it answers; without
// one they answer what was written down.
#pragma once

#include <algorithm>
#include <cstdint>

#include "hal/devices.hpp"
#include "rt/control/devices.hpp"
#include "rt/station/input.hpp"

namespace punctum::tools {

// Of one tick; `input` is set before each.
class Taped {
 public:
  rt::InputSample* input = nullptr;

 protected:
  ~Taped() = default;
  hal::Status wrote(rt::InputSample::Answer which, hal::Status status) NONBLOCKING {
    const std::uint32_t place = 2U * which;
    input->answers = (input->answers & ~(3U << place)) | (static_cast<std::uint32_t>(status) << place);
    return status;
  }
  [[nodiscard]] hal::Status answer(rt::InputSample::Answer which) const NONBLOCKING {
    return static_cast<hal::Status>(input->answers >> (2U * which) & 3U);
  }
  void set(rt::InputSample::Flag flag, bool on) NONBLOCKING {
    input->flags = on ? input->flags | flag : input->flags & ~flag;
  }
  [[nodiscard]] bool is(rt::InputSample::Flag flag) const NONBLOCKING { return (input->flags & flag) != 0; }
  static void copy(const hal::Vec3& from, double (&to)[3]) NONBLOCKING {
    to[0] = from.x();
    to[1] = from.y();
    to[2] = from.z();
  }
  [[nodiscard]] static hal::Vec3 vec(const double (&v)[3]) NONBLOCKING { return {v[0], v[1], v[2]}; }
};

struct TapedHand final : hal::HapticDevice, Taped {
  hal::HapticDevice* device = nullptr;
  hal::Status read(hal::HandState& out) NONBLOCKING override {
    if (device != nullptr) {
      const hal::Status status = device->read(out);
      copy(out.position_m, input->hand_m);
      const hal::Quat& q = out.orientation;
      const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
      std::copy(wxyz, wxyz + 4, input->hand_wxyz);
      input->buttons = out.buttons;
      input->hand_ns = out.sample_ns;
      return wrote(rt::InputSample::hand_read, status);
    }
    const hal::Status status = answer(rt::InputSample::hand_read);
    if (status == hal::Status::ok) {
      out.position_m = vec(input->hand_m);
      out.orientation =
          hal::Quat(input->hand_wxyz[0], input->hand_wxyz[1], input->hand_wxyz[2], input->hand_wxyz[3]);
      out.buttons = input->buttons;
      out.sample_ns = input->hand_ns;
    }
    return status;
  }
  hal::Status write_force(const hal::Vec3& force_N) NONBLOCKING override {
    return device != nullptr ? wrote(rt::InputSample::hand_write, device->write_force(force_N))
                             : answer(rt::InputSample::hand_write);
  }
};

struct TapedStage final : hal::Stage, Taped {
  hal::Stage* device = nullptr;
  hal::Status read(hal::StageState& out) NONBLOCKING override {
    if (device != nullptr) {
      const hal::Status status = device->read(out);
      copy(out.tip_m, input->tip_m);
      copy(out.axis, input->axis);
      copy(out.following_error_m, input->following_error_m);
      set(rt::InputSample::stage_enabled, out.enabled);
      set(rt::InputSample::stage_powered, out.powered);
      set(rt::InputSample::stage_at_standstill, out.at_standstill);
      input->stage_ns = out.sample_ns;
      return wrote(rt::InputSample::stage_read, status);
    }
    const hal::Status status = answer(rt::InputSample::stage_read);
    if (status == hal::Status::ok) {
      out = {.tip_m = vec(input->tip_m),
             .axis = vec(input->axis),
             .following_error_m = vec(input->following_error_m),
             .enabled = is(rt::InputSample::stage_enabled),
             .powered = is(rt::InputSample::stage_powered),
             .at_standstill = is(rt::InputSample::stage_at_standstill),
             .sample_ns = input->stage_ns};
    }
    return status;
  }
  hal::Status command(const hal::StageCommand& set_point) NONBLOCKING override {
    return device != nullptr ? wrote(rt::InputSample::stage_write, device->command(set_point))
                             : answer(rt::InputSample::stage_write);
  }
  void quick_stop() NONBLOCKING override {
    if (device != nullptr) {
      device->quick_stop();
    }
  }
  void enable(bool on) NONBLOCKING override {
    if (device != nullptr) {
      device->enable(on);
    }
  }
};

struct TapedEstop final : hal::EstopChain, Taped {
  hal::EstopChain* device = nullptr;
  hal::Status read(hal::EstopState& out) NONBLOCKING override {
    if (device != nullptr) {
      const hal::Status status = device->read(out);
      set(rt::InputSample::estop_a_closed, out.contact_a_closed);
      set(rt::InputSample::estop_b_closed, out.contact_b_closed);
      set(rt::InputSample::estop_reset, out.reset_pressed);
      set(rt::InputSample::estop_pulse, out.pulse_seen);
      input->estop_ns = out.sample_ns;
      return wrote(rt::InputSample::estop_read, status);
    }
    const hal::Status status = answer(rt::InputSample::estop_read);
    if (status == hal::Status::ok) {
      out = {.contact_a_closed = is(rt::InputSample::estop_a_closed),
             .contact_b_closed = is(rt::InputSample::estop_b_closed),
             .reset_pressed = is(rt::InputSample::estop_reset),
             .pulse_seen = is(rt::InputSample::estop_pulse),
             .sample_ns = input->estop_ns};
    }
    return status;
  }
  void heartbeat(bool level) NONBLOCKING override {
    if (device != nullptr) {
      device->heartbeat(level);
    }
  }
  void drive_power(bool on) NONBLOCKING override {
    if (device != nullptr) {
      device->drive_power(on);
    }
  }
};

struct TapedEnabling final : hal::EnablingSwitch, Taped {
  hal::EnablingSwitch* device = nullptr;
  hal::Status read(hal::EnablingState& out) NONBLOCKING override {
    if (device != nullptr) {
      const hal::Status status = device->read(out);
      set(rt::InputSample::enabling_a_closed, out.contact_a_closed);
      set(rt::InputSample::enabling_b_closed, out.contact_b_closed);
      set(rt::InputSample::enabling_pulse, out.pulse_seen);
      input->enabling_ns = out.sample_ns;
      return wrote(rt::InputSample::enabling_read, status);
    }
    const hal::Status status = answer(rt::InputSample::enabling_read);
    if (status == hal::Status::ok) {
      out = {.contact_a_closed = is(rt::InputSample::enabling_a_closed),
             .contact_b_closed = is(rt::InputSample::enabling_b_closed),
             .pulse_seen = is(rt::InputSample::enabling_pulse),
             .sample_ns = input->enabling_ns};
    }
    return status;
  }
};

struct TapedInjector final : hal::Injector, Taped {
  hal::Injector* device = nullptr;
  // Without a device: opens and shuts at once when asked to, instead of when it did.
  bool obeys = false;
  bool gate_open = false;
  void gate(bool open) NONBLOCKING override {
    gate_open = open;
    if (device != nullptr) {
      device->gate(open);
    }
  }
  hal::Status read(hal::InjectorState& out) NONBLOCKING override {
    if (device != nullptr) {
      const hal::Status status = device->read(out);
      set(rt::InputSample::injector_open, out.open);
      input->injector_ns = out.sample_ns;
      return wrote(rt::InputSample::injector_read, status);
    }
    const hal::Status status = answer(rt::InputSample::injector_read);
    if (status == hal::Status::ok) {
      out.open = obeys ? gate_open : is(rt::InputSample::injector_open);
      out.sample_ns = input->injector_ns;
    }
    return status;
  }
};

// Holding vacuum or force sensor: one number.
template <class Device, class Reading, double Reading::* value, double rt::InputSample::* number,
          std::int64_t rt::InputSample::* sample_ns, rt::InputSample::Answer which>
struct TapedNumber final : Device, Taped {
  Device* device = nullptr;
  hal::Status read(Reading& out) NONBLOCKING override {
    if (device != nullptr) {
      const hal::Status status = device->read(out);
      input->*number = out.*value;
      input->*sample_ns = out.sample_ns;
      return wrote(which, status);
    }
    const hal::Status status = answer(which);
    if (status == hal::Status::ok) {
      out.*value = input->*number;
      out.sample_ns = input->*sample_ns;
    }
    return status;
  }
};

struct TapedDevices {
  TapedHand hand;
  TapedStage stage;
  TapedEstop estop;
  TapedEnabling enabling;
  TapedInjector injector;
  TapedNumber<hal::HoldingVacuum, hal::VacuumState, &hal::VacuumState::pressure_Pa,
              &rt::InputSample::vacuum_Pa, &rt::InputSample::vacuum_ns, rt::InputSample::vacuum_read>
      vacuum;
  TapedNumber<hal::ForceSensor, hal::ForceState, &hal::ForceState::axial_force_N, &rt::InputSample::axial_N,
              &rt::InputSample::force_sensor_ns, rt::InputSample::force_sensor_read>
      force_sensor;

  void at(rt::InputSample& input) NONBLOCKING {
    hand.input = stage.input = estop.input = enabling.input = injector.input = vacuum.input =
        force_sensor.input = &input;
  }
  // Writes down what these answer; returns what the servo is to have in their place.
  [[nodiscard]] rt::Devices before(const rt::Devices& devices) {
    hand.device = &devices.hand;
    stage.device = devices.stage;
    estop.device = devices.estop;
    enabling.device = devices.enabling;
    injector.device = devices.injector;
    vacuum.device = devices.vacuum;
    force_sensor.device = devices.force_sensor;
    return of(flags_of(devices));
  }
  // What there was when `flags` were written.
  [[nodiscard]] rt::Devices of(std::uint32_t flags) {
    const auto has = [flags](rt::InputSample::Flag flag) { return (flags & flag) != 0; };
    return {hand,
            has(rt::InputSample::has_stage) ? &stage : nullptr,
            has(rt::InputSample::has_estop) ? &estop : nullptr,
            has(rt::InputSample::has_injector) ? &injector : nullptr,
            has(rt::InputSample::has_vacuum) ? &vacuum : nullptr,
            has(rt::InputSample::has_force_sensor) ? &force_sensor : nullptr,
            has(rt::InputSample::has_enabling) ? &enabling : nullptr};
  }
  [[nodiscard]] static std::uint32_t flags_of(const rt::Devices& d) {
    return (d.stage != nullptr ? rt::InputSample::has_stage : 0U) |
           (d.estop != nullptr ? rt::InputSample::has_estop : 0U) |
           (d.injector != nullptr ? rt::InputSample::has_injector : 0U) |
           (d.vacuum != nullptr ? rt::InputSample::has_vacuum : 0U) |
           (d.force_sensor != nullptr ? rt::InputSample::has_force_sensor : 0U) |
           (d.enabling != nullptr ? rt::InputSample::has_enabling : 0U);
  }
};

}  // namespace punctum::tools
