// A camera that plays recorded pictures: those of a folder or a glob, one picture, or a video file.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "hal/devices.hpp"

namespace punctum::recorded {

// Numbers inside the names are ordered by value: frame2 comes before frame10.
[[nodiscard]] bool natural_less(std::string_view a, std::string_view b) noexcept;

class Camera final : public hal::Camera {
 public:
  // source: a folder (its pictures), a glob (*, ?, [...]) of pictures, one picture, or a video file.
  // fps <= 0: the video's own rate, or 25 for pictures. The first picture sets the size and must be readable.
  [[nodiscard]] static tl::expected<Camera, std::string> open(const std::string& source, double fps = 0);

  ~Camera();
  Camera(Camera&&) noexcept;
  Camera& operator=(Camera&&) noexcept;

  // The next picture, at exposure_ns = sequence / fps. Never waits. `fault`: the picture cannot be read or
  // has another size; its sequence number and time are set, its pixels are not. `disconnected`: there are no
  // more. All 16-bit pictures are scaled like the first.
  [[nodiscard]] hal::Status next(hal::Frame& out, std::int64_t timeout_ns) override;
  void release(const hal::Frame& frame) override;

  [[nodiscard]] const std::string& last_error() const noexcept;  // why the last next() was not ok; or empty
  [[nodiscard]] const std::string& name() const noexcept;  // of the last picture: its file, or "video.avi:12"
  [[nodiscard]] const std::vector<std::string>& files() const noexcept;  // that it plays; of a video none
  [[nodiscard]] int width() const noexcept;
  [[nodiscard]] int height() const noexcept;
  [[nodiscard]] double fps() const noexcept;
  [[nodiscard]] std::int64_t count() const noexcept;  // pictures in all; -1 = unknown (video)

 private:
  struct Impl;
  explicit Camera(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace punctum::recorded
