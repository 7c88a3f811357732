// The pointer on the operator's page as a hand without force. Whoever writes the fingers is another process,
// and beyond it a network: what is old, not finite or too far is nobody's, and after a gap the enabling
// button counts when it was let go and pressed again.
#pragma once

#include "hal/browser/fingers.hpp"
#include "hal/device_life.hpp"
#include "hal/hand_follower.hpp"
#include "hal/realtime.hpp"

namespace punctum::browser {

class BrowserHand final : public hal::Device, public hal::HapticDevice {
 public:
  static constexpr double kSpeed_m_s = 0.1;                // the hand goes no faster
  static constexpr double kFarthest_m = 0.5;               // between two messages; further is no hand
  static constexpr std::int64_t kSilent_ns = 500'000'000;  // so long after the last message nobody has it

  // clock: the station's, CLOCK_MONOTONIC.
  BrowserHand(const FingersSegment& fingers, const hal::Clock& clock) : fingers_(fingers), clock_(clock) {}

  [[nodiscard]] tl::expected<void, std::string> open() override { return {}; }
  [[nodiscard]] hal::Served served() noexcept override;
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t /*first_tick_ns*/) override { return {}; }
  void safe_state() noexcept override {}
  void close() noexcept override {}

  // Fresh on every tick: where nobody has the hand it rests, with no button pressed.
  [[nodiscard]] hal::Status read(hal::HandState& out) NONBLOCKING override;
  // Takes any force and renders none.
  [[nodiscard]] hal::Status write_force(const hal::Vec3& /*force_N*/) NONBLOCKING override {
    return hal::Status::ok;
  }

 private:
  [[nodiscard]] std::uint32_t follow(const Fingers& now) NONBLOCKING;

  const FingersSegment& fingers_;
  const hal::Clock& clock_;
  hal::HandFollower follower_{kSpeed_m_s};
  std::uint64_t session_ = 0;
  double moved_m_[3] = {};  // of that session, as far as it was followed
  bool let_go_ = false;     // in that session: whoever held the button through a gap has to press it anew
};

}  // namespace punctum::browser
