// A camera that plays recorded pictures: a folder, a glob, one picture or a video file.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "hal/devices.hpp"

namespace punctum::recorded {

// Larger pictures are refused before they are decoded: 8192 x 8192 pixels, 512 MiB of file.
inline constexpr std::int64_t kMaxPixels = std::int64_t{8192} * 8192;
inline constexpr int kMaxSide = 16384;
inline constexpr std::int64_t kMaxFileBytes = std::int64_t{512} << 20;

// One picture in 8-bit grey, without padding between rows.
struct Picture {
  std::vector<std::uint8_t> pixels;
  int width = 0;
  int height = 0;
};

// The order a person expects: frame2 before frame10.
[[nodiscard]] bool natural_less(std::string_view a, std::string_view b) noexcept;

// Decodes PNG, JPEG, TIFF, BMP, PGM or WebP. 16 bits become 8 by their high byte, colour becomes grey. A file
// that ends early, or whose size is not allowed, is an error that says so.
[[nodiscard]] tl::expected<Picture, std::string> decode(std::span<const std::uint8_t> file);
[[nodiscard]] tl::expected<Picture, std::string> read_picture(const std::string& path);

class Camera final : public hal::Camera {
 public:
  // source: a folder (its pictures), a glob (*, ?, [...]) of pictures, one picture, or a video file.
  // fps <= 0: the video's own rate, 25 for pictures. The first picture must be good: it sets the size.
  [[nodiscard]] static tl::expected<Camera, std::string> open(const std::string& source, double fps = 0);

  ~Camera();
  Camera(Camera&&) noexcept;
  Camera& operator=(Camera&&) noexcept;

  // Never waits: the next picture, at exposure_ns = sequence / fps. `fault` for one that cannot be read or
  // has another size (its sequence number and time are set, its pixels are not), `disconnected` at the end.
  [[nodiscard]] hal::Status next(hal::Frame& out, std::int64_t timeout_ns) override;
  void release(const hal::Frame& frame) override;

  [[nodiscard]] const std::string& last_error() const noexcept;  // of the last `fault`, else empty
  [[nodiscard]] const std::string& name() const noexcept;        // file of the last picture, "video.avi:12"
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
