// Any frames, to an emulated drive and to the master of the stage: nothing crashes, and whatever the drives
// say, a stage that was told to stop sends no set-point that would move them.
//
// The input is read byte by byte as steps: what to do in its low three bits, then the bytes of a frame.
#include <cstdint>

#include "hal/cia402/cia402_stage.hpp"
#include "tests/fuzz/must.hpp"
#include "tests/support/virtual_can.hpp"

namespace {

using namespace punctum;

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  [[nodiscard]] bool left() const { return at_ < size_; }
  std::uint8_t byte() { return left() ? data_[at_++] : 0; }
  can_frame frame() {
    // Identifiers that somebody listens to are met often enough to get anywhere.
    constexpr std::uint32_t kIds[] = {0x000, 0x080, 0x081, 0x181, 0x182, 0x201,
                                      0x581, 0x601, 0x701, 0x702, 0x77F};
    can_frame frame{};
    const std::uint8_t id = byte();
    frame.can_id = id < 0xF0 ? kIds[id % std::size(kIds)] : static_cast<std::uint32_t>(byte()) << 3U;
    frame.can_dlc = byte() % 9;
    for (std::uint8_t& data : frame.data) {
      data = byte();
    }
    return frame;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::int64_t kTick_ns = 1'000'000;
  constexpr int kMostSteps = 400;
  cia402::CanStageParams params;
  params.axis_count = 3;
  tests::VirtualCan can;
  for (int i = 0; i < 3; ++i) {
    params.axes[static_cast<std::size_t>(i)].node = i + 1;
    params.axes[static_cast<std::size_t>(i)].count_m[i] = 40e-9;
    emulator::DriveParams drive;
    drive.node = i + 1;
    can.add(drive);
  }
  can.sleep_until_ns(can.now_ns() + kTick_ns);
  Input input(data, size);
  params.homing = (input.byte() & 1U) != 0;
  cia402::Cia402Stage stage(params, 1e-3, can, can.master());
  if (!stage.open() || !stage.start(can.now_ns())) {
    must(false, "the drives do not open although nothing was done to them");
  }
  can.record = true;
  bool told_on = false;
  for (int step = 0; input.left() && step < kMostSteps; ++step) {
    can.sent.clear();
    hal::StageState state;
    (void)stage.read(state);
    must(state.tip_m.allFinite(), "a tip that is no number");
    switch (const std::uint8_t what = input.byte(); what & 7U) {
      case 0:
        can.inject(input.frame());
        break;
      case 1: {
        const can_frame frame = input.frame();
        for (std::size_t i = 0; i < 3; ++i) {
          can.drive(i).on_frame(frame, can.now_ns());
        }
        break;
      }
      case 2:
        stage.enable(true);
        told_on = true;
        break;
      case 3:
        stage.quick_stop();
        told_on = false;
        break;
      case 4:
        stage.quick_stop();
        stage.enable(false);
        told_on = false;
        break;
      case 5: {
        const double x_m = 1e-6 * static_cast<std::int8_t>(input.byte());
        (void)stage.command({state.tip_m + hal::Vec3(x_m, 0, 0), -hal::Vec3::UnitX()});
        break;
      }
      case 6:
        for (int i = what >> 3U; i >= 0; --i) {
          can.inject_error();
        }
        break;
      default:
        break;
    }
    can.sent.clear();
    hal::StageState after;
    (void)stage.read(after);
    for (const can_frame& frame : can.sent) {
      const bool command = frame.can_id > 0x200 && frame.can_id <= 0x203;
      must(!command || told_on || (frame.data[0] & 0x0DU) == 0, "a drive is driven although nobody wants it");
    }
    can.sleep_until_ns(can.now_ns() + kTick_ns);
  }
  stage.safe_state();
  return 0;
}
