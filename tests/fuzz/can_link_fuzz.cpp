// Any bytes in place of the kernel's answer about an interface: read within their bounds, and every line that
// a look makes of them says something.
#include <cstdint>
#include <cstring>
#include <vector>

#include "hal/cia402/look.hpp"
#include "tests/fuzz/must.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::byte> message(size);
  if (size > 0) {
    std::memcpy(message.data(), data, size);
  }
  const auto link = punctum::cia402::can_link_of(message);
  for (const auto& finding : punctum::cia402::look({}, link)) {
    must(!finding.line.empty(), "a line says nothing");
  }
  return 0;
}
