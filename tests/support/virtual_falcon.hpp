// An emulated Falcon at the other end of a USB link in memory, under a virtual clock: it passes while
// somebody waits for the link, and for nothing else.
#pragma once

#include <algorithm>
#include <atomic>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "hal/devices.hpp"
#include "hal/falcon/usb_link.hpp"
#include "tools/emulators/falcon/falcon.hpp"

namespace punctum::tests {

class RestingHand final : public emulator::Hand {
 public:
  emulator::Grip grip(std::int64_t) override { return at; }
  void push(const emulator::Triple& force_N, std::int64_t) override { force = force_N; }
  emulator::Grip at;
  emulator::Triple force{};
};

class VirtualFalcon final : public hal::Clock, public falcon::UsbLink {
 public:
  static constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();

  explicit VirtualFalcon(const emulator::FalconParams& params) : falcon(params, hand) {}

  // ---- the clock ----
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ns_; }
  void sleep_until_ns(std::int64_t t_ns) noexcept override { now_ns_ = std::max(now_ns_, t_ns); }

  // ---- the link ----
  tl::expected<void, std::string> open() override {
    if (unplugged) {
      return tl::unexpected(std::string("no Falcon is plugged in"));
    }
    is_open = true;
    ++opened;
    return {};
  }
  void close() noexcept override { is_open = false; }
  bool control(std::uint8_t request, std::uint16_t value) override {
    now_ns_ += kPacket_ns;
    requests.push_back({request, value});
    return !unplugged && falcon.request(request, value, now_ns_);
  }
  bool send(std::span<const std::uint8_t> bytes) override {
    if (unplugged || sending() || bytes.size() > falcon::kPacketSize) {
      return false;
    }
    out_.assign(bytes.begin(), bytes.end());
    out_ends_ns_ = now_ns_ + kPacket_ns;
    out_taken_ = false;
    packets_out.push_back(out_);
    return true;
  }
  bool sending() const override { return !out_.empty(); }
  bool sent() const override { return out_taken_; }
  falcon::Event wait(std::int64_t longest_ns, falcon::Packet& packet) override {
    const std::int64_t until_ns = std::max(now_ns_, std::min(now_ns_ + longest_ns, wait_until_ns));
    for (;;) {
      if (unplugged) {
        return falcon::Event::gone;
      }
      if (!out_.empty() && out_ends_ns_ <= now_ns_ && !out_hangs &&
          (out_fails > 0 || falcon.out(out_, now_ns_))) {
        out_taken_ = out_fails == 0;
        out_fails -= out_taken_ ? 0 : 1;
        out_.clear();
        return falcon::Event::nothing;
      }
      if (auto in = falcon.in(now_ns_)) {
        if (in->size() > falcon::kPacketSize) {
          return falcon::Event::oversized;
        }
        std::copy(in->begin(), in->end(), packet.bytes.begin());
        packet.size = in->size();
        packet.received_ns = now_ns_;
        return falcon::Event::packet;
      }
      if (woken_) {
        woken_ = false;
        return falcon::Event::nothing;
      }
      if (now_ns_ >= until_ns) {
        return falcon::Event::nothing;
      }
      std::int64_t next_ns = std::min(until_ns, falcon.next_in_ns(now_ns_));
      if (!out_.empty() && !out_hangs) {
        next_ns = std::min(next_ns, std::max(out_ends_ns_, now_ns_ + 1000));
      }
      now_ns_ = std::max(next_ns, now_ns_ + 1000);
    }
  }
  void wake() NONBLOCKING override { woken_ = true; }

  // ---- what a test sees and does ----
  struct Request {
    std::uint8_t request;
    std::uint16_t value;
    bool operator==(const Request&) const = default;
  };
  RestingHand hand;
  emulator::FalconEmulator falcon;
  bool unplugged = false, is_open = false, out_hangs = false;
  int out_fails = 0;  // so many of the next packets out end with an error, as on an endpoint that is halted
  int opened = 0;
  std::int64_t wait_until_ns = kNever_ns;  // and no longer
  std::vector<Request> requests;
  std::vector<std::vector<std::uint8_t>> packets_out;

 private:
  static constexpr std::int64_t kPacket_ns = 60'000;  // on the wire, and the host's part of it
  std::int64_t now_ns_ = 1'000'000'000, out_ends_ns_ = 0;
  std::vector<std::uint8_t> out_;
  bool out_taken_ = false;
  std::atomic<bool> woken_{false};
};

}  // namespace punctum::tests
