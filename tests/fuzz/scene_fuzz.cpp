// Any text is either a scene, which then survives being written and read again, or one line that says what is
// wrong.
#include <cstdint>
#include <string>
#include <string_view>

#include "tests/fuzz/must.hpp"
#include "tools/scene/scene.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace punctum::tools;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto scene = parse_scene(text, "input.toml");
  if (!scene) {
    must(!scene.error().empty(), "an error without a word", scene.error());
    must(scene.error().find('\n') == std::string::npos, "an error of more than one line", scene.error());
    return 0;
  }
  const std::string written = to_toml(*scene);
  const auto again = parse_scene(written, "input.toml");
  must(again.has_value(), again ? "" : again.error().c_str(), written);
  must(to_toml(*again) == written, "reads back to something else", written);
  return 0;
}
