#include "hal/falcon/session.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

namespace punctum::falcon {
namespace {

using hal::Status;
using Unexpected = tl::unexpected<std::string>;

constexpr std::int64_t kMillisecond_ns = 1'000'000;
// The program that starts the core ends one that is silent for 10 s.
constexpr std::int64_t kBootWithin_ns = 7'000 * kMillisecond_ns, kHomedWithin_ns = 8'000 * kMillisecond_ns;
constexpr std::int64_t kLooksWithin_ns = 300 * kMillisecond_ns;    // whether it was booted before
constexpr std::int64_t kAwakeWithin_ns = 2'000 * kMillisecond_ns;  // after it was booted
constexpr std::int64_t kEchoWithin_ns = 200 * kMillisecond_ns;     // latency timer 16 ms, 62 bytes 4 ms
// A frame without new force, for its answer: slower than the slowest servo, or it would be in its way.
constexpr std::int64_t kIdle_ns = 1'500'000;
constexpr std::int64_t kAnswer_ns = 4 * kMillisecond_ns;  // longer: the frame or its answer is lost
// A force, the reading that it is meant for, and the answer that tells that forces arrive. Two lost answers
// in a row are shorter. The core ends its heartbeat only when refusals have lasted for its time-out of the
// hand: a silence that the time-out bears is over by then. It may let a force that it did not write act for
// that time-out and 20 ms.
constexpr std::int64_t kHolds_ns = 10 * kMillisecond_ns;

constexpr int kBootTries = 3, kGreetings = 20;
constexpr std::size_t kChunk = 62;  // with the two status bytes its echo fills a packet

// Requests to the FTDI chip (its application notes, and the facts that libnifalcon collected).
struct Request {
  std::uint8_t request;
  std::uint16_t value;
};
constexpr Request kPurgeReceived{0, 1}, kPurgeSent{0, 2};
constexpr Request kDtrLow{1, 0x0100}, kDtrHigh{1, 0x0101}, kRtsLow{1, 0x0200};
constexpr Request kNoFlowControl{2, 0}, kEightBits{4, 0x0008};
constexpr Request kBaudFrames{3, 0x0002}, kBaudGreeting{3, 0x4138}, kBaudImage{3, 0x0015};
constexpr Request kLatencyFrames{9, 1}, kLatencyBoot{9, 16};
constexpr Request kFlushAtEnd{6, 0x0100 | '>'};  // a packet is sent when a frame ends, AN232B-04

void say(const char* what) { std::fprintf(stderr, "falcon: %s\n", what); }

}  // namespace

// ---- opening ----

tl::expected<void, std::string> Session::open(std::span<const std::uint8_t> firmware) {
  const std::int64_t begun_ns = clock_.now_ns();
  if (auto opened = link_.open(); !opened) {
    return opened;
  }
  const auto failed = [this](std::string why) {
    link_.close();
    return Unexpected(std::move(why));
  };
  if (!normal_mode()) {
    return failed("the Falcon refuses to be set up: unplug it and plug it in again");
  }
  if (!answers_within(kLooksWithin_ns)) {
    if (firmware.empty()) {
      return failed(
          "the Falcon does not answer, it has no firmware: give falcon.firmware = \"PATH\" "
          "(hal/falcon/README.md "
          "says which), or look whether its power supply is on");
    }
    if (auto booted = boot(firmware, begun_ns + kBootWithin_ns); !booted) {
      return failed(booted.error());
    }
    if (!normal_mode() || !answers_within(kAwakeWithin_ns)) {
      return failed(
          "the Falcon took its firmware and does not answer: is falcon.firmware an image for a Falcon?");
    }
  }
  counts_ = {};  // of a device without firmware they tell nothing
  asked_to_home_ = !homed_;
  if (asked_to_home_) {
    say("not homed: pull the grip all the way out, then push it all the way in");
  }
  while (!homed_ && clock_.now_ns() < begun_ns + kHomedWithin_ns) {
    if (!pass()) {
      return failed("the Falcon was unplugged while it was opened");
    }
  }
  if (!homed_) {
    say("still not homed: the station has no hand until it is");
  }
  return {};
}

bool Session::normal_mode() {
  for (const Request& r : {kLatencyFrames, kBaudFrames, kPurgeReceived, kPurgeSent}) {
    if (!link_.control(r.request, r.value)) {
      return false;
    }
  }
  // Without it an answer waits for the latency timer, up to a millisecond.
  (void)link_.control(kFlushAtEnd.request, kFlushAtEnd.value);
  reader_.restart();
  answered_ = true;
  return true;
}

bool Session::answers_within(std::int64_t longest_ns) {
  const std::int64_t until_ns = clock_.now_ns() + longest_ns;
  const std::uint32_t before = reader_.counts().frames;
  while (clock_.now_ns() < until_ns && pass()) {
    if (reader_.counts().frames != before) {
      return true;
    }
  }
  return false;
}

tl::expected<void, std::string> Session::boot(std::span<const std::uint8_t> image, std::int64_t until_ns) {
  std::string why;
  for (int i = 0; i < kBootTries && clock_.now_ns() < until_ns; ++i) {
    if (!boot_mode(until_ns)) {
      why = "the Falcon does not answer its boot request: is its power supply on?";
      continue;
    }
    std::size_t at = 0;
    while (at < image.size()) {
      const auto chunk = image.subspan(at, std::min(kChunk, image.size() - at));
      if (!echoes(chunk, chunk, std::min(until_ns, clock_.now_ns() + kEchoWithin_ns))) {
        break;
      }
      at += chunk.size();
    }
    if (at == image.size()) {
      return {};
    }
    why = "the Falcon did not repeat its firmware from byte " + std::to_string(at) + " on";
  }
  return Unexpected(why + " (tried " + std::to_string(kBootTries) + " times)");
}

bool Session::boot_mode(std::int64_t until_ns) {
  for (const Request& r : {kPurgeReceived, kPurgeSent, kLatencyBoot, kBaudGreeting, kEightBits,
                           kNoFlowControl, kRtsLow, kDtrLow, kDtrHigh}) {
    if (!link_.control(r.request, r.value)) {
      return false;
    }
  }
  constexpr std::uint8_t kGreeting[] = {0x0A, 0x43, 0x0D}, kReply[] = {0x0A, 0x44, 0x2C, 0x0D};
  constexpr std::uint8_t kMeasureBaud[] = {0x41};
  const auto soon = [&] { return std::min(until_ns, clock_.now_ns() + kEchoWithin_ns); };
  bool greeted = false;
  for (int i = 0; i < kGreetings && !greeted && clock_.now_ns() < until_ns; ++i) {
    greeted = echoes(kGreeting, kReply, soon());
  }
  return greeted && link_.control(kDtrLow.request, kDtrLow.value) &&
         link_.control(kBaudImage.request, kBaudImage.value) && echoes(kMeasureBaud, kMeasureBaud, soon());
}

// Sends, and waits for exactly this answer; a zero before it is what a line gives that was just opened.
bool Session::echoes(std::span<const std::uint8_t> out, std::span<const std::uint8_t> answer,
                     std::int64_t until_ns) {
  const auto time_left_ns = [&] {
    return std::clamp<std::int64_t>(until_ns - clock_.now_ns(), 0, kMillisecond_ns);
  };
  while (link_.sending() && time_left_ns() > 0) {
    if (link_.wait(time_left_ns(), packet_) == Event::gone) {
      return false;
    }
  }
  if (!link_.send(out)) {
    return false;
  }
  std::size_t same = 0;
  while (same < answer.size() && time_left_ns() > 0) {
    const Event event = link_.wait(time_left_ns(), packet_);
    if (event == Event::gone || event == Event::oversized) {
      return false;
    }
    if (event != Event::packet) {
      continue;
    }
    for (std::size_t i = kStatusSize; i < packet_.size; ++i) {
      const std::uint8_t byte = packet_.bytes[i];
      if (same == 0 && byte == 0 && answer[0] != 0) {
        continue;
      }
      if (same == answer.size() || byte != answer[same]) {
        return false;
      }
      ++same;
    }
  }
  return same == answer.size();
}

// ---- frames ----

bool Session::pass() {
  if (gone_) {
    return false;
  }
  std::int64_t now_ns = clock_.now_ns();
  switch (link_.wait(std::min(until_send_ns(now_ns), kMillisecond_ns), packet_)) {
    case Event::packet:
      count(counts_.packets);
      if (const auto reply = reader_.take({packet_.bytes.data(), packet_.size})) {
        take(*reply, packet_.received_ns);
      }
      break;
    case Event::oversized:
      count(counts_.oversized);
      reader_.restart();
      break;
    case Event::nothing:
      break;
    case Event::gone:
      gone_ = true;
      return false;
  }
  if (zero_on_its_way_ && !link_.sending()) {
    // A zero that ended in an error left the force on: it is sent again.
    zero_sent_ = zero_sent_ || link_.sent();
    zero_on_its_way_ = zero_sent_;
  }
  now_ns = clock_.now_ns();
  if (until_send_ns(now_ns) == 0) {
    send(now_ns);
  }
  return true;
}

void Session::take(const Reply& reply, std::int64_t received_ns) {
  answered_ = true;
  answered_ns_ = received_ns;
  pose_.reset();
  if (!reply.homed) {
    homing_lost_ = homing_lost_ || homed_;
    return;
  }
  if (homing_lost_) {
    return;
  }
  if (!homed_) {
    homed_ = true;
    if (asked_to_home_) {
      say("homed: positions count from here on");
    }
  }
  pose_ = solve(arm_angles(reply.encoders));
  Reading reading;
  reading.sample_ns = received_ns;
  reading.buttons = reply.buttons;
  if (pose_) {
    pose_ns_ = received_ns;
    reading.reachable = 1;
    for (int i = 0; i < 3; ++i) {
      reading.position_m[i] = pose_->position_m[i] - kCentre_m[i];
    }
  } else {
    count(counts_.unreachable);
  }
  readings_.push(reading);
}

// 0: now.
std::int64_t Session::until_send_ns(std::int64_t now_ns) const {
  if (link_.sending()) {
    return kMillisecond_ns;
  }
  const bool new_force = forces_.head() != forces_sent_ || (released_ && !zero_on_its_way_);
  const std::int64_t due_ns = sent_ns_ + (answered_ ? (new_force ? 0 : kIdle_ns) : kAnswer_ns);
  return std::max<std::int64_t>(due_ns - now_ns, 0);
}

void Session::send(std::int64_t now_ns) {
  if (!answered_) {
    count(counts_.unanswered);
  }
  const bool releasing = released_;
  forces_sent_ = forces_.head();
  const Counts values = releasing ? Counts{} : motors(now_ns);
  const bool queued = link_.send(command_frame(values, homed_ ? Light::green : Light::red));
  zero_on_its_way_ = zero_on_its_way_ || (queued && releasing);
  answered_ = false;  // one that could not be queued either: it is tried again as one that was lost
  sent_ns_ = now_ns;
}

Counts Session::motors(std::int64_t now_ns) const {
  Force force;
  std::uint64_t number = 0;
  if (!pose_ || homing_lost_ || now_ns - pose_ns_ > kHolds_ns ||
      forces_.newest(force, number) != hal::Read::ok || now_ns - force.written_ns > kHolds_ns) {
    return {};
  }
  return motors_for(*pose_, {force.force_N[0], force.force_N[1], force.force_N[2]});
}

// ---- the tick ----

Status Session::read(hal::HandState& out) NONBLOCKING {
  if (gone_) {
    return Status::disconnected;
  }
  if (homing_lost_) {
    return Status::fault;
  }
  Reading reading;
  std::uint64_t number = 0;
  if (readings_.newest(reading, number) != hal::Read::ok || number + 1 == taken_) {
    return Status::no_data;
  }
  taken_ = number + 1;
  if (reading.reachable == 0) {
    return Status::fault;
  }
  out.position_m = {reading.position_m[0], reading.position_m[1], reading.position_m[2]};
  out.orientation = hal::Quat::Identity();
  out.buttons = static_cast<std::uint32_t>(reading.buttons);
  out.sample_ns = reading.sample_ns;
  return Status::ok;
}

Status Session::write_force(const hal::Vec3& force_N) NONBLOCKING {
  if (gone_) {
    return Status::disconnected;
  }
  const bool valid = force_N.allFinite();
  Force force;
  force.written_ns = clock_.now_ns();
  for (int i = 0; i < 3; ++i) {
    force.force_N[i] = valid ? force_N[i] : 0;
  }
  forces_.push(force);
  link_.wake();
  if (!valid || homing_lost_) {
    return Status::fault;
  }
  // A device that does not answer may have hung with the last force on its motors.
  const bool answers = force.written_ns - answered_ns_ <= kHolds_ns;
  return homed_ && answers ? Status::ok : Status::no_data;
}

std::string Session::report() const {
  std::string text;
  const auto line = [&](const std::string& what) { text += "falcon: " + what + "\n"; };
  if (gone_) {
    line("was unplugged, or its USB connection failed");
  }
  if (homing_lost_) {
    line("lost its homing while it ran: its supply or its firmware failed");
  }
  if (released_ && !zero_sent_) {
    line("did not take the zero at the end: its motors may push until its supply is off");
  }
  const FrameCounts& f = reader_.counts();
  if (f.malformed + f.line_errors + counts_.oversized > 0) {
    line(std::to_string(f.malformed) + " malformed frames, " + std::to_string(f.line_errors) +
         " packets with line errors, " + std::to_string(counts_.oversized) + " oversized, of " +
         std::to_string(counts_.packets));
  }
  if (counts_.unanswered > 0) {
    line(std::to_string(counts_.unanswered) + " frames without an answer");
  }
  if (counts_.unreachable > 0) {
    line(std::to_string(counts_.unreachable) + " readings from where no grip can be");
  }
  return text;
}

}  // namespace punctum::falcon
