// The dialogue with one Falcon, from the first request to its end: firmware, homing, then a frame out and a
// frame back, again and again. It has no thread: one calls pass(), the servo calls read() and write_force().
//
// A force is sent as soon as the device has answered the frame before; of several the newest. One that is
// older than 10 ms, or that meets no reading as young, is not sent: zero is. Where no answer is as young, a
// force is refused (no_data): nobody knows which one acts. Whatever ends the dialogue (unplugged, homing
// lost) is latched until a new session.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "hal/devices.hpp"
#include "hal/falcon/frame.hpp"
#include "hal/falcon/kinematics.hpp"
#include "hal/falcon/usb_link.hpp"
#include "hal/ipc/exchange.hpp"

namespace punctum::falcon {

struct SessionCounts {
  std::uint32_t packets = 0;
  std::uint32_t oversized = 0;
  std::uint32_t unanswered = 0;   // frames out
  std::uint32_t unreachable = 0;  // replies with encoders that no place of the grip has
};

// What thread and servo hand each other.
struct Reading {
  double position_m[3] = {};  // hand frame
  std::uint64_t buttons = 0;
  std::int64_t sample_ns = 0;
  std::uint64_t reachable = 0;
};
struct Force {
  double force_N[3] = {};
  std::int64_t written_ns = 0;
};

class Session {
 public:
  Session(UsbLink& link, const hal::Clock& clock) : link_(link), clock_(clock) {}

  // Boots it if it does not answer and there is an image, waits for its homing, 8 s in all; the grip may be
  // unhomed afterwards. The link is closed again if this fails. The error is one line.
  [[nodiscard]] tl::expected<void, std::string> open(std::span<const std::uint8_t> firmware);

  // Waits for what happens next, a millisecond at the most, and acts on it. False: the device is gone.
  bool pass();
  // From here on only zero is sent, whatever is written.
  void release() { released_ = true; }
  [[nodiscard]] bool released() const { return zero_sent_ || gone_; }  // and the device has the zero

  [[nodiscard]] hal::Status read(hal::HandState& out) NONBLOCKING;
  [[nodiscard]] hal::Status write_force(const hal::Vec3& force_N) NONBLOCKING;

  [[nodiscard]] bool homed() const { return homed_; }
  // Of what pass() counts: for its thread, and when that has ended.
  [[nodiscard]] const SessionCounts& counts() const { return counts_; }
  [[nodiscard]] const FrameCounts& frames() const { return reader_.counts(); }
  // What went wrong, a line each; empty if nothing did.
  [[nodiscard]] std::string report() const;

 private:
  [[nodiscard]] bool normal_mode();
  [[nodiscard]] bool answers_within(std::int64_t longest_ns);
  [[nodiscard]] tl::expected<void, std::string> boot(std::span<const std::uint8_t> image,
                                                     std::int64_t until_ns);
  [[nodiscard]] bool boot_mode(std::int64_t until_ns);
  [[nodiscard]] bool echoes(std::span<const std::uint8_t> out, std::span<const std::uint8_t> answer,
                            std::int64_t until_ns);

  void take(const Reply& reply, std::int64_t received_ns);
  [[nodiscard]] std::int64_t until_send_ns(std::int64_t now_ns) const;
  void send(std::int64_t now_ns);
  [[nodiscard]] Counts motors(std::int64_t now_ns) const;

  UsbLink& link_;
  const hal::Clock& clock_;
  FrameReader reader_;
  Packet packet_;
  std::optional<Pose> pose_;  // of the newest reading
  std::int64_t pose_ns_ = 0, sent_ns_ = 0;
  std::uint64_t forces_sent_ = 0;
  bool answered_ = true, zero_on_its_way_ = false, asked_to_home_ = false;
  SessionCounts counts_;

  // Between the thread and the servo.
  hal::SeqRing<Reading, 8> readings_;
  hal::SeqRing<Force, 8> forces_;
  std::uint64_t taken_ = 0;                   // readings, by the servo
  std::atomic<std::int64_t> answered_ns_{0};  // the newest answer came in
  std::atomic<bool> gone_{false}, homed_{false}, homing_lost_{false}, released_{false}, zero_sent_{false};
};

}  // namespace punctum::falcon
