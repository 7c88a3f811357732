// Anything that a serial line may bring, to the parser of replies and to the driver that waits for them:
// nothing crashes, no position that is no number, and an answer of another device or command is never taken.
#include <cstdint>
#include <string>
#include <string_view>

#include "hal/zaber/zaber_positioner.hpp"
#include "tests/fuzz/must.hpp"
#include "tests/support/virtual_zaber.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace punctum;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto reply = zaber::parse_reply(text.substr(0, text.find('\n')))) {
    must(reply->device >= 1 && reply->device <= 99 && reply->axis >= 0 && reply->axis <= 9,
         "an address that is none");
    must(!reply->data.empty(), "a reply without data");
    (void)zaber::number_of(reply->data);
  }
  tests::VirtualZaber line({.max_microsteps = 1000, .start = 500});
  zaber::ZaberParams params;
  params.answer_s = 0.01;
  params.axis_count = zaber::kAxes;
  for (int i = 0; i < zaber::kAxes; ++i) {
    params.axes[static_cast<std::size_t>(i)] = {.device = i + 1, .axis = 1, .microstep_m = 1e-6};
  }
  zaber::ZaberPositioner positioner(params, line, line.wire());
  must(positioner.open().has_value(), "it does not open although nothing was done to it");
  line.come += text;
  line.come += "\n";
  hal::PositionerState state;
  if (positioner.read(state) == hal::Status::ok) {
    must(state.position_m.allFinite(), "a position that is no number");
  }
  (void)positioner.move_to(hal::Vec3(4e-4, 4e-4, 4e-4));
  positioner.stop();
  return 0;
}
