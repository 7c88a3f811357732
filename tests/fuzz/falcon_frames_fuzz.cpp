// Any packets from a Falcon: nothing crashes, no position is anything but a place of the grip, and no motor
// is driven before all arms are homed, or after one was not any more.
//
// The input is read as packets: a byte with their size (0x40: one that did not fit), then their bytes.
#include <cmath>
#include <cstdint>
#include <string>

#include "hal/falcon/session.hpp"
#include "tests/fuzz/must.hpp"

namespace {

using namespace punctum;

// A device that says what the input says, and ends with it.
class Script final : public hal::Clock, public falcon::UsbLink {
 public:
  Script(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ns_; }
  void sleep_until_ns(std::int64_t t_ns) noexcept override { now_ns_ = t_ns; }
  tl::expected<void, std::string> open() override { return {}; }
  void close() noexcept override {}
  bool control(std::uint8_t, std::uint16_t) override { return true; }
  bool send(std::span<const std::uint8_t> bytes) override {
    drives = false;
    for (std::size_t i = 1; i <= 12 && i < bytes.size(); ++i) {
      drives = drives || bytes[i] != 0x41;
    }
    return true;
  }
  bool sending() const override { return false; }
  bool sent() const override { return true; }
  falcon::Event wait(std::int64_t longest_ns, falcon::Packet& out) override {
    now_ns_ += std::min<std::int64_t>(longest_ns, 300'000) + 1;
    if (at_ >= size_) {
      return falcon::Event::gone;
    }
    const std::size_t wanted = data_[at_++];
    if (wanted == 0x40) {
      return falcon::Event::oversized;
    }
    out.size = std::min({wanted % (falcon::kPacketSize + 1), size_ - at_, falcon::kPacketSize});
    std::copy_n(data_ + at_, out.size, out.bytes.begin());
    out.received_ns = now_ns_;
    at_ += out.size;
    return falcon::Event::packet;
  }
  void wake() noexcept override {}
  bool drives = false;

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
  std::int64_t now_ns_ = 1;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  falcon::Session session(script, script);
  bool lost = false;
  hal::HandState state;
  while (session.pass()) {
    const hal::Status status = session.read(state);
    must(state.position_m.allFinite() && state.position_m.norm() < 0.2, "a place that no grip reaches");
    must(status != hal::Status::ok || session.homed(), "a hand before it is homed");
    lost = lost || session.report().find("lost its homing") != std::string::npos;
    must(!lost || status == hal::Status::fault, "a hand after its homing was lost");
    must(!script.drives || (session.homed() && !lost), "a motor is driven without homing");
    (void)session.write_force({1, -2, 3});
  }
  must(session.read(state) == hal::Status::disconnected, "a device that is gone");
  return 0;
}
