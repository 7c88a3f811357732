// Any bytes are either a picture of the size it says, or one line that says what is wrong.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "hal/recorded/picture.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto picture = punctum::recorded::decode({data, size});
  if (picture) {
    const auto expected =
        static_cast<std::size_t>(picture->width) * static_cast<std::size_t>(picture->height);
    if (expected == 0 || picture->pixels.size() != expected || picture->bits < 8 || picture->bits > 16) {
      std::abort();
    }
  } else if (picture.error().empty() || picture.error().find('\n') != std::string::npos) {
    std::abort();
  }
  return 0;
}
