#include "tools/emulators/falcon/falcon.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <sstream>

namespace punctum::emulator {
namespace {

// Encoder: 320 slots read four times; the arm is turned by a shaft of 14.25 mm on a sector of 110 mm.
constexpr double kCountsPerTurn = 320 * 4 * 110 / 14.25;
constexpr double kArmAtZero_rad = 35 * std::numbers::pi / 180;
constexpr double kTorquePerMotor_Nm = -1e-4;
constexpr int kMostMotor = 4096;
// Where a grip that was never homed counts from: where its arms were when it got power, here a few hundred
// counts off.
constexpr std::array<int, 3> kUnhomed = {311, -190, 57};

constexpr std::size_t kBuffer = 384;  // of the chip, towards the processor
constexpr std::size_t kHostBuffer = 128;
constexpr std::uint8_t kModemStatus = 0x01;
constexpr std::uint8_t kIdleLine = 0x60, kFramingError = 0x08;

constexpr std::uint8_t kGreeting[] = {0x0A, 0x43, 0x0D};
constexpr std::uint8_t kReply[] = {0x0A, 0x44, 0x2C, 0x0D};
constexpr std::uint8_t kNibble = 0x41;
constexpr double kGreetingBaud = 9600, kImageBaud = 142'857, kFrameBaud = 1'500'000;

constexpr std::size_t kHeadWords = 11;  // key, 8 reserved, entry
constexpr unsigned kKey = 0x08AA;

// The FTDI divisor: 3 MHz by an integer and eighths.
double baud_of(std::uint16_t value) {
  if (value == 0) {
    return 3e6;
  }
  if (value == 1) {
    return 2e6;
  }
  constexpr double kEighths[] = {0, 0.5, 0.25, 0.125};
  return 3e6 / ((value & 0x3FFF) + kEighths[value >> 14]);
}

}  // namespace

void FalconEmulator::power_on() {
  baud_ = 9600;
  latency_ns_ = 16'000'000;
  data_terminal_ready_ = line_error_ = false;
  event_character_.reset();
  to_processor_.clear();
  to_host_.clear();
  packet_ends_.clear();
  processor_ = params_.booted ? Processor::running : Processor::waiting;
  heard_.clear();
  motors_ = {};
  force_N_ = {};
  homed_.fill(params_.homed);
  origin_ = params_.homed ? std::array<int, 3>{} : kUnhomed;
  was_below_.reset();
  homing_asked_ns_ = -1;
  frozen_ = mute_ = hung_ = false;
}

void FalconEmulator::motors_off(std::int64_t now_ns) {
  motors_ = {};
  force_N_ = {};
  hand_.push(force_N_, now_ns);
}

bool FalconEmulator::baud_is(double rate) const { return std::abs(baud_ - rate) < 0.03 * rate; }
std::int64_t FalconEmulator::byte_ns() const { return std::llround(10e9 / baud_); }

bool FalconEmulator::request(std::uint8_t request, std::uint16_t value, std::int64_t now_ns) {
  advance(now_ns);
  switch (request) {
    case 0:  // reset, purge what was received, purge what is to be sent
      if (value == 0 || value == 1) {
        to_host_.clear();
        packet_ends_.clear();
      }
      if (value == 0 || value == 2) {
        to_processor_.clear();
      }
      return value <= 2;
    case 1:  // modem lines; the upper byte says which
      if ((value & 0x0100U) != 0) {
        const bool ready = (value & 1U) != 0;
        if (ready && !data_terminal_ready_) {  // it resets the processor
          processor_ = Processor::waiting;
          hung_ = false;
          heard_.clear();
          homed_ = {};
          origin_ = kUnhomed;
          homing_asked_ns_ = -1;
          motors_off(now_ns);
        }
        data_terminal_ready_ = ready;
      }
      return true;
    case 2:
    case 4:
      return true;
    case 3:
      baud_ = baud_of(value);
      return true;
    case 6:
      event_character_ =
          (value & 0x0100U) != 0 ? std::optional(static_cast<std::uint8_t>(value)) : std::nullopt;
      return true;
    case 7:  // error character
      return true;
    case 9: {
      constexpr std::int64_t kMillisecond_ns = 1'000'000;
      if (value < 1 || value > 255) {
        return false;
      }
      latency_ns_ = value * kMillisecond_ns;
      return true;
    }
    default:
      return false;
  }
}

std::optional<std::vector<std::uint8_t>> FalconEmulator::answer(std::uint8_t request, std::uint16_t /*value*/,
                                                                std::size_t most) const {
  std::vector<std::uint8_t> bytes;
  switch (request) {
    case 5:
      bytes = {kModemStatus, kIdleLine};
      break;
    case 10:
      bytes = {static_cast<std::uint8_t>(latency_ns_ / 1'000'000)};
      break;
    case 0x90:  // its memory of settings is empty
      bytes = {0xFF, 0xFF};
      break;
    default:
      return std::nullopt;
  }
  bytes.resize(std::min(bytes.size(), most));
  return bytes;
}

bool FalconEmulator::out(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  advance(now_ns);
  if (to_processor_.size() + bytes.size() > kBuffer) {
    return false;
  }
  std::int64_t at_ns = std::max(now_ns, to_processor_.empty() ? now_ns : to_processor_.back().at_ns);
  for (const std::uint8_t byte : bytes) {
    at_ns += byte_ns();
    to_processor_.push_back({byte, at_ns});
  }
  return true;
}

void FalconEmulator::advance(std::int64_t now_ns) {
  while (!to_processor_.empty() && to_processor_.front().at_ns <= now_ns) {
    const Byte byte = to_processor_.front();
    to_processor_.pop_front();
    processor_takes(byte);
  }
}

void FalconEmulator::say(std::span<const std::uint8_t> bytes, std::int64_t at_ns) {
  at_ns = to_host_.empty() ? at_ns : std::max(at_ns, to_host_.back().at_ns);
  for (const std::uint8_t byte : bytes) {
    at_ns += byte_ns();
    if (to_host_.size() < kHostBuffer) {
      to_host_.push_back({byte, at_ns});
    }
  }
}

bool FalconEmulator::spend(int& left) const {
  if (left <= 0) {
    return false;
  }
  --left;
  return true;
}

void FalconEmulator::processor_takes(Byte byte) {
  if (hung_) {
    return;
  }
  switch (processor_) {
    case Processor::waiting:
      if (!baud_is(kGreetingBaud)) {
        heard_.clear();
        return;
      }
      heard_.push_back(byte.value);
      if (heard_.size() > std::size(kGreeting)) {
        heard_.erase(heard_.begin());
      }
      if (std::ranges::equal(heard_, kGreeting)) {
        heard_.clear();
        processor_ = Processor::greeted;
        say(kReply, byte.at_ns);
      }
      return;
    case Processor::greeted:
      if (baud_is(kGreetingBaud)) {  // the host has not understood
        processor_ = Processor::waiting;
        processor_takes(byte);
      } else if (baud_is(kImageBaud) && byte.value == 'A') {
        processor_ = Processor::loading;
        stream_.clear();
        stream_word_ = block_left_ = loaded_words_ = 0;
        low_byte_.reset();
        say(std::array{byte.value}, byte.at_ns);
      }
      return;
    case Processor::loading: {
      const std::uint8_t echo = spend(bad_echo_) ? static_cast<std::uint8_t>(~byte.value) : byte.value;
      say(std::array{echo}, byte.at_ns);
      load(byte.value);
      return;
    }
    case Processor::dead:
      return;
    case Processor::running:
      if (!baud_is(kFrameBaud)) {
        heard_.clear();
        return;
      }
      if (heard_.empty() && byte.value != '<') {
        ++refused_;
        return;
      }
      heard_.push_back(byte.value);
      if (heard_.size() == kFrameSize) {
        take_frame(byte.at_ns);
        heard_.clear();
      }
      return;
  }
}

// The processor's loader: words, low byte first; a block of size 0 ends it.
void FalconEmulator::load(std::uint8_t byte) {
  if (!low_byte_) {
    low_byte_ = byte;
    return;
  }
  const auto word = static_cast<std::uint16_t>(*low_byte_ | (byte << 8U));
  low_byte_.reset();
  if (stream_word_ == 0 && word != kKey) {
    processor_ = Processor::dead;
    return;
  }
  ++stream_word_;
  if (stream_word_ <= kHeadWords) {
    return;
  }
  if (block_left_ > 0) {
    if (stream_.size() < 2) {
      stream_.push_back(word);  // the block's address
    } else {
      --block_left_;
      ++loaded_words_;
    }
    return;
  }
  stream_.clear();
  block_left_ = word;
  if (word == 0) {
    processor_ = Processor::running;
    heard_.clear();
  }
}

void FalconEmulator::take_frame(std::int64_t at_ns) {
  bool whole = heard_.back() == '>';
  for (std::size_t i = 1; i + 1 < kFrameSize; ++i) {
    whole = whole && heard_[i] >= kNibble && heard_[i] < kNibble + 16;
  }
  if (!whole) {
    refused_ += kFrameSize;
    return;
  }
  ++frames_;
  for (std::size_t i = 0; i < 3; ++i) {
    int value = 0;
    for (std::size_t nibble = 4; nibble-- > 0;) {
      value = value * 16 + (heard_[1 + 4 * i + nibble] - kNibble);
    }
    motors_[i] = std::clamp(value < 0x8000 ? value : value - 0x10000, -kMostMotor, kMostMotor);
  }
  const unsigned flags = heard_[13] - kNibble;
  lights_ = flags & 0x0EU;
  if ((flags & 1U) == 0) {
    homing_asked_ns_ = -1;
  } else if (homing_asked_ns_ < 0) {
    homing_asked_ns_ = at_ns;
  }
  if (!mute_) {
    reply(at_ns);
  }
}

// An arm is homed when it passes its mark while homing is asked for; from then on it counts from the mark.
void FalconEmulator::home(std::int64_t at_ns, const Triple& arms_rad) {
  if (lose_homing_) {
    lose_homing_ = false;
    homed_ = {};
    origin_ = kUnhomed;
    homing_asked_ns_ = -1;
    return;
  }
  const bool asked = homing_asked_ns_ >= 0;
  const bool moved_by_hand = home_now_ || (asked && params_.homes_after_ns >= 0 &&
                                           at_ns - homing_asked_ns_ >= params_.homes_after_ns);
  std::array<bool, 3> below{};
  for (std::size_t i = 0; i < 3; ++i) {
    below[i] = arms_rad[i] < kArmAtZero_rad;
    if (asked && !homed_[i] && (moved_by_hand || (was_below_ && (*was_below_)[i] != below[i]))) {
      homed_[i] = true;
      origin_[i] = 0;
    }
  }
  was_below_ = below;
  home_now_ = home_now_ && !asked;
}

void FalconEmulator::reply(std::int64_t at_ns) {
  const Grip grip = hand_.grip(at_ns);
  const auto arms = falcon_arms(grip.position_m);
  if (arms) {
    home(at_ns, *arms);
    if (!frozen_) {
      for (std::size_t i = 0; i < 3; ++i) {
        true_counts_[i] = static_cast<int>(
            std::lround(((*arms)[i] - kArmAtZero_rad) / (2 * std::numbers::pi) * kCountsPerTurn));
      }
    }
  }
  Triple torques_Nm{};
  for (std::size_t i = 0; i < 3; ++i) {
    torques_Nm[i] = kTorquePerMotor_Nm * motors_[i];
    encoders_[i] = true_counts_[i] + origin_[i];
  }
  force_N_ = falcon_push(grip.position_m, torques_Nm).value_or(Triple{});
  hand_.push(force_N_, at_ns);

  std::array<std::uint8_t, kFrameSize> frame{};
  frame.fill(kNibble);
  frame[0] = '<';
  frame[15] = '>';
  for (std::size_t i = 0; i < 3; ++i) {
    unsigned bits = static_cast<unsigned>(encoders_[i]) & 0xFFFFU;
    for (std::size_t nibble = 0; nibble < 4; ++nibble, bits >>= 4U) {
      frame[1 + 4 * i + nibble] = static_cast<std::uint8_t>(kNibble + (bits & 0xFU));
    }
  }
  unsigned flags = grip.buttons & 0x0FU;
  for (std::size_t i = 0; i < 3; ++i) {
    flags |= homed_[i] ? 0x10U << i : 0;
  }
  frame[13] = static_cast<std::uint8_t>(kNibble + flags);
  if (spend(corrupt_)) {
    frame[5] = 0xE7;
  }
  if (spend(short_)) {
    say(std::span(frame).first(9), at_ns);
    return;
  }
  line_error_ = spend(line_errors_);
  if (spend(long_)) {
    say(std::span(frame).first(15), at_ns);
    say(std::span(frame).subspan(1), at_ns);
    return;
  }
  if (spend(split_)) {
    packet_ends_.push_back(to_host_.size() + 7);
  }
  say(frame, at_ns);
}

std::optional<std::vector<std::uint8_t>> FalconEmulator::in(std::int64_t now_ns) {
  advance(now_ns);
  if (next_in_ns(now_ns) > now_ns) {
    return std::nullopt;
  }
  last_in_ns_ = now_ns;
  std::size_t most = kPacketSize - kStatusSize;
  if (!packet_ends_.empty()) {
    most = std::min(most, packet_ends_.front());
    packet_ends_.pop_front();
  }
  std::vector<std::uint8_t> packet = {
      kModemStatus, static_cast<std::uint8_t>(kIdleLine | (line_error_ ? kFramingError : 0))};
  while (packet.size() < kStatusSize + most && !to_host_.empty() && to_host_.front().at_ns <= now_ns) {
    packet.push_back(to_host_.front().value);
    to_host_.pop_front();
  }
  if (packet.size() > kStatusSize) {
    line_error_ = false;
    if (spend(oversized_)) {
      packet.resize(2 * kPacketSize, 0x55);
    }
  }
  return packet;
}

std::int64_t FalconEmulator::next_in_ns(std::int64_t now_ns) const {
  std::int64_t next_ns = last_in_ns_ + latency_ns_;
  if (!to_processor_.empty()) {
    next_ns = std::min(next_ns, to_processor_.back().at_ns);
  }
  if (to_host_.size() >= kPacketSize - kStatusSize) {
    next_ns = std::min(next_ns, to_host_[kPacketSize - kStatusSize - 1].at_ns);
  }
  if (!packet_ends_.empty() && packet_ends_.front() > 0 && to_host_.size() >= packet_ends_.front()) {
    next_ns = std::min(next_ns, to_host_[packet_ends_.front() - 1].at_ns);
  }
  if (event_character_) {
    const auto ends = std::ranges::find(to_host_, *event_character_, &Byte::value);
    next_ns = ends != to_host_.end() ? std::min(next_ns, ends->at_ns) : next_ns;
  }
  return std::max(next_ns, now_ns);
}

std::string FalconEmulator::command(const std::string& line) {
  std::istringstream words(line);
  std::string what, rest;
  words >> what;
  const struct {
    const char* name;
    int& left;
  } counted[] = {{"short", short_},      {"oversized", oversized_},    {"corrupt", corrupt_},
                 {"long", long_},        {"line-error", line_errors_}, {"split", split_},
                 {"bad-echo", bad_echo_}};
  for (const auto& each : counted) {
    if (what == each.name) {
      int number = 0;
      if (!(words >> number) || number < 0 || words >> rest) {
        return "\"" + line + "\": how many? A number from 0 on";
      }
      each.left = number;
      return {};
    }
  }
  const struct {
    const char* name;
    bool& flag;
    bool value;
  } switches[] = {{"mute", mute_, true},    {"speak", mute_, false},   {"freeze", frozen_, true},
                  {"thaw", frozen_, false}, {"home", home_now_, true}, {"lose-homing", lose_homing_, true},
                  {"hang", hung_, true}};
  for (const auto& each : switches) {
    if (what == each.name && !(words >> rest)) {
      each.flag = each.value;
      return {};
    }
  }
  return "\"" + line + "\" is none of: " + kCommands;
}

}  // namespace punctum::emulator
