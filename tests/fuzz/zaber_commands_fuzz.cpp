// Any bytes as commands, and as lines on the standard input, to the emulated devices: nothing crashes, every
// answer is a whole line, and no axis leaves its limits unless they were set anew.
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "tests/fuzz/must.hpp"
#include "tools/emulators/positioner/positioner.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace punctum;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  emulator::Positioner devices({.devices = 2, .axes = 2, .max_microsteps = 1000, .start = 500});
  std::int64_t now_ns = 0;
  std::string said;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size() - 1);
    const std::string_view line = text.substr(at, end + 1 - at);
    at = end + 1;
    if (line.starts_with('!')) {
      (void)devices.command(line.substr(1));
    } else {
      devices.receive(line, now_ns);
    }
    now_ns += 20'000'000;
    said += devices.step(now_ns);
  }
  const bool whole = said.empty() || said.ends_with('\n');
  const bool left = text.find("set") == std::string_view::npos &&
                    !(devices.position(2, 1) >= -1 && devices.position(2, 1) <= 1001);
  must(whole, "half a line");
  must(!left && std::isfinite(devices.position(1, 2)), "an axis beyond its limits");
  return 0;
}
