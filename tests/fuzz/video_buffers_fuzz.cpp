// Any V4L2 camera: sizes, strides, buffers and controls of its own making, and whatever it says of the
// pictures in them. Nothing is read beyond a buffer, and what counts as a picture is one: not ahead of the
// clock, later than the one before, all of its pixels there.
//
// The input is read byte by byte: the camera first, then steps.
#include <cstdint>

#include "hal/v4l2/v4l2_camera.hpp"
#include "tests/fuzz/must.hpp"
#include "tests/support/fake_video.hpp"

namespace {

using namespace punctum;

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  [[nodiscard]] bool left() const { return at_ < size_; }
  std::uint8_t byte() { return left() ? data_[at_++] : 0; }
  std::uint32_t word() {
    std::uint32_t w = 0;
    for (int i = 0; i < 4; ++i) {
      w = w << 8U | byte();
    }
    return w;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

class HandClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now; }
  void sleep_until_ns(std::int64_t t_ns) noexcept override { now = t_ns; }
  std::int64_t now = 1'000'000'000'000;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr int kMostSteps = 300;
  Input input(data, size);
  tests::FakeVideo video;
  v4l2::V4l2Params params;
  hal::CameraSettings settings;
  params.format = static_cast<v4l2::V4l2Params::Format>(input.byte() % 3);
  params.bits = 8 + input.byte() % 9;
  // Mostly a camera that does what it is asked, so that there are pictures.
  settings.width = 1 + input.byte() % 64;
  settings.height = 1 + input.byte() % 64;
  const std::uint8_t odd = input.byte();
  video.width = (odd & 1U) != 0 ? input.word() % 4096 : static_cast<std::uint32_t>(settings.width);
  video.height = (odd & 2U) != 0 ? input.word() % 64 : static_cast<std::uint32_t>(settings.height);
  video.padding = (odd & 4U) != 0 ? input.byte() : 0;
  video.row_says = (odd & 8U) != 0 ? input.word() : 0;
  video.buffer_bytes = (odd & 16U) != 0 ? input.word() % 20000 : 0;
  video.buffer_count = (odd & 32U) != 0 ? input.byte() : 4;
  video.buffer_flags = (odd & 64U) != 0 ? input.word() : video.buffer_flags;
  if ((odd & 128U) != 0) {
    video.controls[V4L2_CID_GAIN] = {static_cast<int>(input.word()), static_cast<int>(input.word()),
                                     static_cast<int>(input.word()), 0};
    video.controls[V4L2_CID_EXPOSURE_ABSOLUTE] = {
        static_cast<int>(input.word()), static_cast<int>(input.word()), static_cast<int>(input.word()), 0};
    settings.gain = static_cast<int>(input.word() % 1'000'000);
    settings.exposure_s = input.byte() * 1e-3;
  }

  HandClock clock;
  v4l2::V4l2Camera camera(params, settings, clock, video);
  bool open = static_cast<bool>(camera.open());
  std::int64_t before_ns = 0;
  std::uint64_t sequence = 0;
  for (int step = 0; input.left() && step < kMostSteps; ++step) {
    clock.now += 1'000'000 * static_cast<std::int64_t>(1 + input.byte() % 50);
    switch (const std::uint8_t what = input.byte(); what % 8) {
      case 0:
      case 1: {
        const std::int64_t stamp_ns =
            clock.now + static_cast<std::int8_t>(input.byte()) * std::int64_t{2'000'000};
        const std::size_t bytes =
            (what & 8U) != 0 || video.memory.empty() ? input.word() % 20000 : video.memory.front().size();
        (void)video.fill((what & 16U) != 0 ? input.word() : static_cast<std::uint32_t>(step), stamp_ns,
                         std::vector<std::uint8_t>(bytes, what), (what & 32U) != 0 ? input.word() : 0);
        break;
      }
      case 2: {
        v4l2_buffer invented{};
        invented.index = input.byte();
        invented.bytesused = input.word();
        invented.sequence = input.word();
        invented.timestamp.tv_sec = input.word();
        invented.timestamp.tv_usec = input.word();
        video.filled.push_back(invented);
        break;
      }
      case 3:
        video.events = static_cast<short>(input.byte());
        break;
      case 4:
        video.refusals_of_qbuf = input.byte() % 8;
        break;
      case 5:
        video.unplugged = !video.unplugged;
        break;
      case 6:
        open = static_cast<bool>(camera.open());
        break;
      default:
        camera.release({});
        break;
    }
    hal::Frame frame;
    const hal::Status status = camera.next(frame, 1'000'000);
    must(open || status == hal::Status::disconnected, "a camera that is not open gives something");
    if (status != hal::Status::ok) {
      must(frame.pixels == nullptr, "what is no picture has pixels");
      continue;
    }
    must(frame.width == settings.width && frame.height == settings.height, "a picture of another size");
    must(frame.exposure_ns <= clock.now && frame.exposure_ns > before_ns, "a time that cannot be");
    must(frame.sequence > sequence, "a sequence that does not grow");
    before_ns = frame.exposure_ns;
    sequence = frame.sequence;
    unsigned sum = 0;
    for (int y = 0; y < frame.height; ++y) {
      for (int x = 0; x < frame.width; ++x) {
        sum += frame.pixels[static_cast<std::ptrdiff_t>(y) * frame.stride + x];
      }
    }
    must(sum < 1U << 31U, "the sanitizer looks at what is read");
  }
  return 0;
}
