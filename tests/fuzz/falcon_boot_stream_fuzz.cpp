// Any firmware file: the check crashes on none, and what it lets through is a stream that the loader of the
// emulated processor takes to its last byte, with as many words as the check found.
#include <array>
#include <cstdint>
#include <initializer_list>

#include "hal/falcon/boot_stream.hpp"
#include "tests/fuzz/must.hpp"
#include "tools/emulators/falcon/falcon.hpp"

namespace {

using namespace punctum;
using Processor = emulator::FalconEmulator::Processor;

class NoHand final : public emulator::Hand {
 public:
  emulator::Grip grip(std::int64_t) override { return {}; }
  void push(const emulator::Triple&, std::int64_t) override {}
};

// A device that was greeted and waits for its image.
class Loader {
 public:
  Loader() {
    must(falcon_.request(1, 0x0100, 0) && falcon_.request(1, 0x0101, 0) && falcon_.request(3, 0x4138, 0),
         "set up");
    for (const std::uint8_t byte : std::array<std::uint8_t, 3>{0x0A, 0x43, 0x0D}) {
      give(byte);
    }
    must(falcon_.request(3, 0x0015, now_ns_), "its baud rate");
    give('A');
  }
  void give(std::uint8_t byte) {
    must(falcon_.out({&byte, 1}, now_ns_), "room for a byte");
    now_ns_ += 2'000'000;
    (void)falcon_.in(now_ns_);
  }
  [[nodiscard]] Processor state() const { return falcon_.processor(); }
  [[nodiscard]] std::size_t words() const { return falcon_.loaded_words(); }

 private:
  NoHand hand_;
  emulator::FalconEmulator falcon_{{}, hand_};
  std::int64_t now_ns_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto checked = falcon::check_boot_stream({data, size});
  must(checked || !checked.error().empty(), "a refusal without a word");
  Loader loader;
  must(loader.state() == Processor::loading, "it does not load");
  for (std::size_t i = 0; i < size && i < 4096; ++i) {
    must(!checked || loader.state() == Processor::loading, "the loader ends before the stream");
    loader.give(data[i]);
  }
  if (checked && size <= 4096) {
    must(loader.state() == Processor::running && loader.words() == checked->words,
         "the loader read it otherwise");
  }
  return 0;
}
