// Between servo and devices: passes everything on, and notes for the invariants what the servo is told and
// what it writes.
#pragma once

#include "hal/devices.hpp"
#include "rt/control/servo.hpp"
#include "tests/support/invariants.hpp"

namespace punctum::tests {

class WatchedDevices {
 public:
  explicit WatchedDevices(const rt::Devices& real) : real_(real) {}

  [[nodiscard]] rt::Devices devices() {
    return {hand_, real_.stage != nullptr ? &stage_ : nullptr, real_.estop != nullptr ? &estop_ : nullptr,
            real_.injector != nullptr ? &injector_ : nullptr};
  }

  rt::test::Seen seen;
  hal::Vec3 asked_N = hal::Vec3::Zero();
  bool power = false, enable_line = false, gate = false;

 private:
  struct Hand final : hal::HapticDevice {
    explicit Hand(WatchedDevices& w) : at(w) {}
    WatchedDevices& at;
    hal::Status read(hal::HandState& out) noexcept override {
      at.seen.hand_status = at.real_.hand.read(out);
      at.seen.hand = out;
      return at.seen.hand_status;
    }
    hal::Status write_force(const hal::Vec3& force_N) noexcept override {
      ++at.seen.hand_writes;
      at.asked_N = force_N;
      return at.real_.hand.write_force(force_N);
    }
  };
  struct Stage final : hal::Stage {
    explicit Stage(WatchedDevices& w) : at(w) {}
    WatchedDevices& at;
    hal::Status read(hal::StageState& out) noexcept override {
      at.seen.stage_status = at.real_.stage->read(out);
      at.seen.stage = out;
      return at.seen.stage_status;
    }
    hal::Status command(const hal::StageCommand& set_point) noexcept override {
      ++at.seen.commands;
      at.seen.command = set_point;
      return at.real_.stage->command(set_point);
    }
    void quick_stop() noexcept override {
      ++at.seen.quick_stops;
      at.real_.stage->quick_stop();
    }
    void enable(bool on) noexcept override {
      at.power = on;
      at.real_.stage->enable(on);
    }
  };
  struct Estop final : hal::EstopChain {
    explicit Estop(WatchedDevices& w) : at(w) {}
    WatchedDevices& at;
    hal::Status read(hal::EstopState& out) noexcept override {
      at.seen.estop_status = at.real_.estop->read(out);
      at.seen.estop = out;
      return at.seen.estop_status;
    }
    void heartbeat(bool level) noexcept override { at.real_.estop->heartbeat(level); }
    void drive_power(bool on) noexcept override {
      at.enable_line = on;
      at.real_.estop->drive_power(on);
    }
  };
  struct Injector final : hal::Injector {
    explicit Injector(WatchedDevices& w) : at(w) {}
    WatchedDevices& at;
    void gate(bool open) noexcept override {
      at.gate = open;
      at.real_.injector->gate(open);
    }
    hal::Status read(hal::InjectorState& out) noexcept override {
      at.seen.injector_status = at.real_.injector->read(out);
      at.seen.injector = out;
      return at.seen.injector_status;
    }
  };

  const rt::Devices real_;
  Hand hand_{*this};
  Stage stage_{*this};
  Estop estop_{*this};
  Injector injector_{*this};
};

}  // namespace punctum::tests
