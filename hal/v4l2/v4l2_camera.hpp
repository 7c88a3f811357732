// A camera behind the kernel's Video4Linux: its buffers mapped, the newest picture, 8-bit grey. README.md
// says what it does with cameras that cannot do what a scene asks.
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "hal/device_life.hpp"
#include "hal/live_camera.hpp"
#include "hal/v4l2/config.hpp"
#include "hal/v4l2/grey.hpp"
#include "hal/v4l2/kernel.hpp"

namespace punctum::v4l2 {

class V4l2Camera final : public hal::LiveCamera {
 public:
  // clock: the station's, CLOCK_MONOTONIC.
  V4l2Camera(V4l2Params params, const hal::CameraSettings& settings, const hal::Clock& clock,
             Kernel& kernel = this_kernel());
  ~V4l2Camera() override;
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;

  [[nodiscard]] tl::expected<void, std::string> open() override;
  void close() noexcept override;
  // Whether it is there and gives this picture; sets nothing, so that another program may stream meanwhile.
  [[nodiscard]] hal::Findings look();
  // The newest picture that the kernel holds; older ones go back to it unseen. `fault`: there were only
  // damaged ones; sequence and time are of the last of them. `disconnected`: until it is opened again.
  [[nodiscard]] hal::Status next(hal::Frame& out, std::int64_t timeout_ns) override;
  void release(const hal::Frame& frame) override;

  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return notes_; }
  [[nodiscard]] const std::string& last_error() const noexcept override { return error_; }
  [[nodiscard]] const hal::CameraCounts& counts() const noexcept override { return counts_; }

 private:
  using Done = tl::expected<void, std::string>;
  struct Buffer {
    void* memory = nullptr;
    std::size_t bytes = 0;
    bool queued = false;  // the driver's, to be filled
  };
  // What a buffer of the driver says of the picture in it.
  struct Taken {
    std::uint32_t index = 0;
    std::uint64_t sequence = 0;
    std::int64_t exposure_ns = 0;
    const char* damage = nullptr;  // why it cannot be used
  };

  [[nodiscard]] Done check_capability();                 // and its name
  [[nodiscard]] Done ask_format(unsigned long request);  // VIDIOC_S_FMT sets it, VIDIOC_TRY_FMT asks only
  [[nodiscard]] Done set_format();
  [[nodiscard]] Done set_interval();
  [[nodiscard]] Done lock_exposure();
  [[nodiscard]] Done lock_gain();
  [[nodiscard]] Done leave_pictures_plain();
  [[nodiscard]] Done map_buffers();
  [[nodiscard]] Done check_stamps(std::uint32_t flags);
  [[nodiscard]] Done start_streaming();

  [[nodiscard]] Answer call(unsigned long request, void* argument);
  [[nodiscard]] std::string offered_formats();
  [[nodiscard]] bool find_control(std::uint32_t id, v4l2_queryctrl& out);
  [[nodiscard]] Done set_control(std::uint32_t id, int value, std::string_view key);
  [[nodiscard]] Done set_number(std::uint32_t id, double value, double unit, const char* key);

  void give_back();
  [[nodiscard]] Taken judged(const v4l2_buffer& buffer);
  [[nodiscard]] hal::Status lost(const char* what, int error);

  const V4l2Params params_;
  const hal::CameraSettings settings_;
  const hal::Clock& clock_;
  Kernel& kernel_;

  int fd_ = -1;
  std::string name_;
  bool has_usb_units_ = false;  // uvcvideo passes on what the camera understands
  Layout layout_;
  std::vector<Buffer> buffers_;
  std::vector<std::uint8_t> grey_;  // of formats that must be converted
  bool stamped_at_end_ = false;
  double exposure_s_ = 0;  // as it is locked; 0: not known
  std::int64_t stamp_to_exposure_ns_ = 0;

  std::uint32_t driver_sequence_ = 0;  // the driver's own count, of 32 bits
  bool counted_ = false;
  std::uint64_t sequence_ = 0;
  std::int64_t last_exposure_ns_ = 0;
  std::uint32_t held_ = 0;  // the buffer that the caller looks at
  bool holding_ = false;

  std::vector<std::string> notes_;
  std::string error_;
  hal::CameraCounts counts_;
};

}  // namespace punctum::v4l2
