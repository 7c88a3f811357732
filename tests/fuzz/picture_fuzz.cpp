// Any bytes are either a picture of the size it says, or one line that says what is wrong.
#include <cstddef>
#include <cstdint>
#include <string>

#include "hal/recorded/picture.hpp"
#include "tests/fuzz/must.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto picture = punctum::recorded::decode({data, size});
  if (picture) {
    const auto expected =
        static_cast<std::size_t>(picture->width) * static_cast<std::size_t>(picture->height);
    must(expected > 0 && picture->pixels.size() == expected, "pixels are missing or too many");
    must(picture->bits >= 8 && picture->bits <= 16, "fewer than 8 bits or more than 16");
  } else {
    must(!picture.error().empty() && picture.error().find('\n') == std::string::npos,
         "a refusal of no line or of several");
  }
  return 0;
}
