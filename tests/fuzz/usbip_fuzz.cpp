// Any bytes from the kernel's end of USB/IP, in pieces of any size: the emulated device crashes on none,
// keeps little, and what it answers are whole replies, one for each transfer at the most.
//
// The input is read as pieces: a byte with the time until then in tenths of a millisecond, a byte with the
// size, then the bytes.
#include <array>
#include <cstdint>

#include "tests/fuzz/must.hpp"
#include "tools/emulators/falcon/usbip.hpp"

namespace {

using namespace punctum;

class NoHand final : public emulator::Hand {
 public:
  emulator::Grip grip(std::int64_t) override { return {}; }
  void push(const emulator::Triple&, std::int64_t) override {}
};

std::uint32_t word_of(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) << 24U | static_cast<std::uint32_t>(bytes[at + 1]) << 16U |
         static_cast<std::uint32_t>(bytes[at + 2]) << 8U | bytes[at + 3];
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  NoHand hand;
  emulator::FalconEmulator falcon({.booted = true, .homed = true}, hand);
  emulator::UsbIpDevice device(falcon);
  std::int64_t now_ns = 0;
  std::vector<std::uint8_t> said;
  bool alive = true;
  for (std::size_t at = 0; at + 2 <= size && alive;) {
    now_ns += 100'000LL * data[at];
    const std::size_t piece = std::min<std::size_t>(data[at + 1], size - at - 2);
    alive = device.take({data + at + 2, piece}, now_ns);
    at += 2 + piece;
    device.step(now_ns);
    must(device.next_ns(now_ns) >= now_ns, "a time that is over");
    must(device.waiting() <= 64, "more transfers than it takes");
    must(alive == device.problem().empty(), "an end without a reason");
    said.insert(said.end(), device.output().begin(), device.output().end());
    device.output().clear();
  }
  for (std::size_t at = 0; at < said.size();) {
    must(said.size() - at >= 48, "half a reply");
    const std::uint32_t command = word_of(said, at), length = word_of(said, at + 24);
    must(command == 3 || command == 4, "a reply that is none");
    must(length <= 16384, "a reply that is too long");
    const auto status = static_cast<std::int32_t>(word_of(said, at + 20));
    must(status <= 0 && status > -200, "a status that is no error number");
    // Only what was read carries data: a reply to a packet out says how much was taken. They cannot be told
    // apart here, so this walk ends at the first of those.
    if (command == 3 && length > 0) {
      break;
    }
    at += 48;
  }
  return 0;
}
