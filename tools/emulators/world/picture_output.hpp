// Pictures that a video device of the kernel gives back as a camera.
//
//   auto output = PictureOutput::open("/dev/video0", 480, 320, 25);  // before the camera is opened
//   (*output)->show(pixels);  // some frames later the camera gives this picture, bit for bit, and again and
//                             // again until the next one
//
// vivid, the kernel's virtual camera with its video output: any width from 16 to 1280 and height from 16 to
// 720, odd ones too (the driver then leaves out the last column), at 24, 25, 30, 50 or 60 pictures a second.
// Both sides are HDMI with the timings of 1280 x 720 at that rate (CEA-861) and the format GREY; the picture
// is the upper left corner of the signal, cut out, not scaled. It takes pictures at that rate too, so what is
// shown faster waits for a free buffer. Any other device that takes pictures (v4l2loopback) is given the
// format GREY and the pictures.
#pragma once

#include <linux/videodev2.h>
#include <sys/ioctl.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

namespace punctum::emulator {

// A device file of V4L2: its inputs or outputs, and its controls by their names.
class VideoNode {
 public:
  // The error is one line.
  [[nodiscard]] static tl::expected<VideoNode, std::string> open(const std::string& path);
  // The first one of vivid that has this capability; of the device on this bus, if any is named.
  [[nodiscard]] static tl::expected<VideoNode, std::string> open_vivid(std::uint32_t capability,
                                                                       const std::string& bus = {});
  ~VideoNode() { close(); }
  VideoNode(VideoNode&& other) noexcept;
  VideoNode& operator=(VideoNode&&) = delete;

  void close();
  [[nodiscard]] bool reopen();
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] int fd() const { return fd_; }
  template <class Argument>
  [[nodiscard]] bool call(unsigned long request, Argument& argument) const {
    return ::ioctl(fd_, request, &argument) == 0;
  }
  // Its driver, the bus it is on, and what it can.
  [[nodiscard]] v4l2_capability about() const;

  [[nodiscard]] std::uint32_t control(const std::string& name) const;  // its id; 0: there is none
  // False: there is none of this name, or it refuses.
  [[nodiscard]] bool set(const std::string& name, int value) const;
  // The first whose name begins so.
  [[nodiscard]] bool use_input(const std::string& name) const;
  [[nodiscard]] bool use_output(const std::string& name) const;

 private:
  VideoNode(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}

  std::string path_;
  int fd_ = -1;
};

class PictureOutput {
 public:
  // Either node of vivid, or one that takes pictures. The error is one line.
  [[nodiscard]] static tl::expected<std::unique_ptr<PictureOutput>, std::string> open(const std::string& path,
                                                                                      int width, int height,
                                                                                      int fps);
  ~PictureOutput();
  PictureOutput(const PictureOutput&) = delete;
  PictureOutput& operator=(const PictureOutput&) = delete;

  // width * height bytes, rows without padding. Waits for a free buffer, at most a second. Empty, or what is
  // wrong.
  [[nodiscard]] std::string show(std::span<const std::uint8_t> pixels);

  // Where the camera is: of vivid its own node, otherwise the one that takes the pictures.
  [[nodiscard]] const VideoNode& camera() const { return camera_ ? *camera_ : output_; }

 private:
  static constexpr std::uint32_t kBuffers = 3;

  PictureOutput(VideoNode output, int width, int height)
      : width_(width), height_(height), output_(std::move(output)) {}
  [[nodiscard]] std::string set_up(int fps);
  [[nodiscard]] std::string set_timings(const VideoNode& node, int fps) const;
  [[nodiscard]] std::string set_format(const VideoNode& node, std::uint32_t type, bool cut) const;
  [[nodiscard]] std::string make_buffers();
  [[nodiscard]] bool loop(bool on) const;

  int width_, height_;
  VideoNode output_;
  std::optional<VideoNode> camera_;  // of vivid
  std::array<std::uint8_t*, kBuffers> memory_{};
  std::size_t bytes_ = 0;
  std::uint32_t made_ = 0, used_ = 0;
  bool streams_ = false;
};

}  // namespace punctum::emulator
