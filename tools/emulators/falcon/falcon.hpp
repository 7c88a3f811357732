// A Novint Falcon as a USB host sees it: an FTDI chip (its requests, latency timer, baud rate, status bytes)
// in front of a processor that is booted over a serial line and then exchanges frames.
//
// It is given requests, bytes and times, and gives packets back; no thread, no clock of its own. Whoever
// implements Hand is the hand on the grip, or a simulated world.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/emulators/falcon/kinematics.hpp"

namespace punctum::emulator {

struct Grip {
  // From the middle of the base: x right, y up, z towards the operator. What can be reached is a cylinder of
  // about 50 mm round the axis, z from 75 to 170 mm.
  Triple position_m{0, 0, 0.12};
  std::uint8_t buttons = 0;  // four bits
};

// On the time that the emulator was given last, as far as a frame takes it.
class Hand {
 public:
  virtual ~Hand() = default;
  [[nodiscard]] virtual Grip grip(std::int64_t now_ns) = 0;  // asked for each frame
  // Told with each frame, and when the motors are off.
  virtual void push(const Triple& force_N, std::int64_t now_ns) = 0;
};

struct FalconParams {
  bool booted = false;  // it has its firmware from the start
  bool homed = false;
  // How long after homing is first asked for the person has moved all three arms past their marks; negative:
  // an arm is homed only when the grip moves it past.
  std::int64_t homes_after_ns = 100'000'000;
};

class FalconEmulator {
 public:
  static constexpr std::size_t kPacketSize = 64, kStatusSize = 2, kFrameSize = 16;
  enum class Processor : std::uint8_t { waiting, greeted, loading, dead, running };

  FalconEmulator(const FalconParams& params, Hand& hand) : params_(params), hand_(hand) { power_on(); }

  void power_on();                       // as after it was plugged in
  void motors_off(std::int64_t now_ns);  // as when its plug is pulled; the hand is told

  // Requests to the FTDI chip without and with an answer. False, nothing: it knows no such request.
  [[nodiscard]] bool request(std::uint8_t request, std::uint16_t value, std::int64_t now_ns);
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> answer(std::uint8_t request, std::uint16_t value,
                                                                std::size_t most) const;
  // A packet from the host; false: its buffer is full, ask again.
  [[nodiscard]] bool out(std::span<const std::uint8_t> bytes, std::int64_t now_ns);
  // The packet that it sends when the host asks now, if it has one. It may be longer than the host expects.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> in(std::int64_t now_ns);
  // When next it may have one; never before now_ns.
  [[nodiscard]] std::int64_t next_in_ns(std::int64_t now_ns) const;

  // A line as a person types it. Empty, or what is wrong with it.
  [[nodiscard]] std::string command(const std::string& line);
  static constexpr const char* kCommands =
      "short N, oversized N, corrupt N, long N, line-error N (the next N frames), split N, mute, speak, "
      "hang (the motors keep their torque; its supply or a reset ends it), freeze, thaw, home, lose-homing, "
      "bad-echo N";

  [[nodiscard]] Processor processor() const { return processor_; }
  [[nodiscard]] bool homed() const { return homed_[0] && homed_[1] && homed_[2]; }
  [[nodiscard]] std::array<int, 3> motors() const { return motors_; }
  [[nodiscard]] Triple force_N() const { return force_N_; }
  [[nodiscard]] unsigned lights() const { return lights_; }
  [[nodiscard]] std::uint64_t frames() const { return frames_; }           // that it took
  [[nodiscard]] std::uint64_t refused() const { return refused_; }         // bytes that belong to no frame
  [[nodiscard]] std::array<int, 3> encoders() const { return encoders_; }  // of the last frame
  [[nodiscard]] std::size_t loaded_words() const { return loaded_words_; }

 private:
  struct Byte {
    std::uint8_t value;
    std::int64_t at_ns;  // when it is through the serial line
  };

  void advance(std::int64_t now_ns);
  void processor_takes(Byte byte);
  void say(std::span<const std::uint8_t> bytes, std::int64_t at_ns);
  void load(std::uint8_t byte);
  void take_frame(std::int64_t at_ns);
  void reply(std::int64_t at_ns);
  void home(std::int64_t at_ns, const Triple& arms_rad);
  [[nodiscard]] bool baud_is(double rate) const;
  [[nodiscard]] std::int64_t byte_ns() const;
  [[nodiscard]] bool spend(int& left) const;

  const FalconParams params_;
  Hand& hand_;

  // The chip.
  double baud_ = 9600;
  std::int64_t latency_ns_ = 16'000'000, last_in_ns_ = 0;
  bool data_terminal_ready_ = false, line_error_ = false;
  std::optional<std::uint8_t> event_character_;
  std::deque<Byte> to_processor_, to_host_;
  std::deque<std::size_t> packet_ends_;  // faults: a packet ends here whatever the timer says

  // The processor.
  Processor processor_ = Processor::waiting;
  std::vector<std::uint8_t> heard_;
  std::vector<std::uint16_t> stream_;  // what of the boot stream's present part is there
  std::size_t stream_word_ = 0, block_left_ = 0, loaded_words_ = 0;
  std::optional<std::uint8_t> low_byte_;
  std::array<int, 3> motors_{}, encoders_{}, origin_{}, true_counts_{};
  std::array<bool, 3> homed_{};
  std::optional<std::array<bool, 3>> was_below_;
  std::int64_t homing_asked_ns_ = -1;
  Triple force_N_{};
  unsigned lights_ = 0;
  std::uint64_t frames_ = 0, refused_ = 0;

  // Faults.
  int short_ = 0, oversized_ = 0, corrupt_ = 0, long_ = 0, line_errors_ = 0, split_ = 0, bad_echo_ = 0;
  bool mute_ = false, hung_ = false, frozen_ = false, lose_homing_ = false, home_now_ = false;
};

}  // namespace punctum::emulator
