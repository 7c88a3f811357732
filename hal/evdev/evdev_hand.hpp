// A mouse, a gamepad or a SpaceMouse as a hand without force, read from the kernel's input device. README.md
// says what is which axis and button.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "hal/device_life.hpp"
#include "hal/evdev/config.hpp"
#include "hal/evdev/hand_motion.hpp"
#include "hal/realtime.hpp"

namespace punctum::evdev {

class EvdevHand final : public hal::Device, public hal::HapticDevice {
 public:
  // clock: the station's, CLOCK_MONOTONIC.
  EvdevHand(EvdevParams params, const hal::Clock& clock) : params_(std::move(params)), clock_(clock) {}
  ~EvdevHand() override { EvdevHand::close(); }
  EvdevHand(const EvdevHand&) = delete;
  EvdevHand& operator=(const EvdevHand&) = delete;

  // Nobody else gets the device's events from here on.
  [[nodiscard]] tl::expected<void, std::string> open() override;
  [[nodiscard]] hal::Served served() noexcept override;
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t first_tick_ns) override;
  void safe_state() noexcept override {}
  void close() noexcept override;

  // A device that rests says nothing; that the kernel still has it is a sample of where it is.
  [[nodiscard]] hal::Status read(hal::HandState& out) NONBLOCKING override;
  // Takes any force and renders none. Also when the device is gone: there is none that would stay on a hand.
  [[nodiscard]] hal::Status write_force(const hal::Vec3& /*force_N*/) NONBLOCKING override {
    return hal::Status::ok;
  }

 private:
  [[nodiscard]] hal::Status drain(std::int64_t now_ns) NONBLOCKING;
  [[nodiscard]] hal::Status ask() NONBLOCKING;

  static constexpr std::size_t kAtOnce = 64;  // events; a mouse sends some 24 in a millisecond at most

  const EvdevParams params_;
  const hal::Clock& clock_;
  int file_ = -1;
  const Layout* layout_ = nullptr;
  std::optional<HandMotion> motion_;
  std::array<input_event, kAtOnce> events_{};
  hal::Status gone_ = hal::Status::ok;  // for good
};

}  // namespace punctum::evdev
