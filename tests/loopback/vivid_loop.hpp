// The kernel's virtual camera (vivid), and its video output, whose pictures it gives back as a camera:
//
//   VividLoop loop(727, 485, 25);   // before the camera is opened: input, timings and format of both sides
//   v4l2::V4l2Camera camera(...);   // path loop.path(), GREY, the same size, fps 0 or the same
//   loop.show(pixels);              // some frames later the camera gives this picture, bit for bit, and
//                                   // again and again until the next one
//
// Any width from 16 to 1280 and height from 16 to 720, odd ones too (the driver then leaves out the last
// column), at 24, 25, 30, 50 or 60 pictures a
// second. Both sides are HDMI with the timings of 1280 x 720 at that rate (CEA-861) and the format GREY; the
// picture is the upper left corner of the signal, cut out, not scaled. vivid takes pictures from its output
// at that rate too, so what is shown faster waits for a free buffer. Needs root, and the guest's device
// "camera" with no module parameters.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <string>
#include <vector>

namespace punctum::loopback {

// A node of the driver: its inputs or outputs, and its controls by their names.
class VividNode {
 public:
  // The first one that has this capability.
  explicit VividNode(std::uint32_t capability) {
    for (int i = 0; i < 64 && fd_ < 0; ++i) {
      path_ = "/dev/video" + std::to_string(i);
      fd_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
      v4l2_capability about{};
      if (fd_ >= 0 && (::ioctl(fd_, VIDIOC_QUERYCAP, &about) != 0 ||
                       std::strcmp(reinterpret_cast<const char*>(about.driver), "vivid") != 0 ||
                       (about.device_caps & capability) == 0)) {
        ::close(fd_);
        fd_ = -1;
      }
    }
    EXPECT_GE(fd_, 0) << "vivid has no node with capability " << capability;
  }
  ~VividNode() { close(); }
  VividNode(const VividNode&) = delete;
  VividNode& operator=(const VividNode&) = delete;

  void close() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
    fd_ = -1;
  }
  void reopen() {
    close();
    fd_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    EXPECT_GE(fd_, 0) << path_ << ": " << std::strerror(errno);
  }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] int fd() const { return fd_; }
  template <class Argument>
  [[nodiscard]] bool call(unsigned long request, Argument& argument) const {
    return ::ioctl(fd_, request, &argument) == 0;
  }

  [[nodiscard]] bool has(const std::string& name) const { return find(name) != 0; }
  void set(const std::string& name, int value) const {
    v4l2_control control{id_of(name), value};
    EXPECT_TRUE(call(VIDIOC_S_CTRL, control)) << name << ": " << std::strerror(errno);
  }
  [[nodiscard]] int get(const std::string& name) const {
    v4l2_control control{id_of(name), 0};
    EXPECT_TRUE(call(VIDIOC_G_CTRL, control)) << name << ": " << std::strerror(errno);
    return control.value;
  }
  // "HDMI" is also "HDMI 0".
  void use_input(const std::string& name) const {
    v4l2_input input{};
    for (; call(VIDIOC_ENUMINPUT, input); ++input.index) {
      if (std::string(reinterpret_cast<const char*>(input.name)).starts_with(name)) {
        int index = static_cast<int>(input.index);
        EXPECT_TRUE(call(VIDIOC_S_INPUT, index)) << std::strerror(errno);
        return;
      }
    }
    ADD_FAILURE() << "vivid has no input " << name;
  }
  void use_output(const std::string& name) const {
    v4l2_output output{};
    for (; call(VIDIOC_ENUMOUTPUT, output); ++output.index) {
      if (std::string(reinterpret_cast<const char*>(output.name)).starts_with(name)) {
        int index = static_cast<int>(output.index);
        EXPECT_TRUE(call(VIDIOC_S_OUTPUT, index)) << std::strerror(errno);
        return;
      }
    }
    ADD_FAILURE() << "vivid has no output " << name;
  }

 private:
  [[nodiscard]] std::uint32_t id_of(const std::string& name) const {
    const std::uint32_t id = find(name);
    EXPECT_NE(id, 0U) << path_ << " has no control " << name;
    return id;
  }
  [[nodiscard]] std::uint32_t find(const std::string& name) const {
    v4l2_queryctrl control{};
    control.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    while (call(VIDIOC_QUERYCTRL, control)) {
      if (name == reinterpret_cast<const char*>(control.name)) {
        return control.id;
      }
      control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    return 0;
  }

  std::string path_;
  int fd_ = -1;
};

class VividLoop {
 public:
  VividLoop(int width, int height, int fps) : width_(width), height_(height) {
    camera_.use_input("HDMI");
    output_.use_output("HDMI");
    camera_.set("Enable Capture Scaler", 0);
    output_.set("Enable Output Scaler", 0);
    set_up(camera_, V4L2_BUF_TYPE_VIDEO_CAPTURE, fps);
    set_up(output_, V4L2_BUF_TYPE_VIDEO_OUTPUT, fps);
    loop(true);
    camera_.set("OSD Text Mode", 2);  // none: it would be written into the picture

    v4l2_requestbuffers wanted{};
    wanted.count = kBuffers;
    wanted.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    wanted.memory = V4L2_MEMORY_MMAP;
    EXPECT_TRUE(output_.call(VIDIOC_REQBUFS, wanted)) << std::strerror(errno);
    EXPECT_EQ(wanted.count, kBuffers);
    for (std::uint32_t i = 0; i < kBuffers; ++i) {
      v4l2_buffer buffer = about(i);
      EXPECT_TRUE(output_.call(VIDIOC_QUERYBUF, buffer)) << std::strerror(errno);
      bytes_ = buffer.length;
      memory_[i] = static_cast<std::uint8_t*>(
          ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, output_.fd(), buffer.m.offset));
      EXPECT_NE(memory_[i], MAP_FAILED);
    }
  }
  ~VividLoop() {
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    (void)output_.call(VIDIOC_STREAMOFF, type);
    for (std::uint8_t* memory : memory_) {
      ::munmap(memory, bytes_);
    }
    output_.close();   // its buffers keep the format
    camera_.reopen();  // a device that was unplugged is back once nobody has it open
    loop(false);
    camera_.set("OSD Text Mode", 0);
    camera_.set("Enable Capture Scaler", 1);
    camera_.use_input("Webcam");
  }
  VividLoop(const VividLoop&) = delete;
  VividLoop& operator=(const VividLoop&) = delete;

  [[nodiscard]] const std::string& path() const { return camera_.path(); }
  [[nodiscard]] const VividNode& camera() const { return camera_; }

  // width * height bytes, rows without padding. Waits for a free buffer, at most a second.
  void show(const std::vector<std::uint8_t>& pixels) {
    ASSERT_EQ(pixels.size(), static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    v4l2_buffer buffer = about(used_);
    if (used_ < kBuffers) {
      ++used_;
    } else {
      pollfd free{output_.fd(), POLLOUT, 0};
      ASSERT_EQ(::poll(&free, 1, 1000), 1) << "vivid gives no output buffer back";
      ASSERT_TRUE(output_.call(VIDIOC_DQBUF, buffer)) << std::strerror(errno);
    }
    std::memcpy(memory_[buffer.index], pixels.data(), pixels.size());
    buffer.bytesused = static_cast<std::uint32_t>(pixels.size());
    buffer.field = V4L2_FIELD_NONE;
    ASSERT_TRUE(output_.call(VIDIOC_QBUF, buffer)) << std::strerror(errno);
    if (!streams_) {
      int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
      ASSERT_TRUE(output_.call(VIDIOC_STREAMON, type)) << std::strerror(errno);
      streams_ = true;
    }
  }

 private:
  static constexpr std::uint32_t kBuffers = 3;

  // Newer kernels have a menu: the test picture, nothing, and the first output of HDMI.
  void loop(bool on) const {
    const std::string menu = "HDMI 000-0 Is Connected To";
    if (camera_.has(menu)) {
      camera_.set(menu, on ? 2 : 0);
    } else {
      camera_.set("Loop Video", on ? 1 : 0);
    }
  }
  static v4l2_buffer about(std::uint32_t index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    return buffer;
  }
  // CEA-861: rates differ in the front porch of a line, and in the clock.
  static v4l2_dv_timings timings_720p(int fps) {
    v4l2_dv_timings timings{};
    timings.type = V4L2_DV_BT_656_1120;
    v4l2_bt_timings& bt = timings.bt;
    bt.width = 1280;
    bt.height = 720;
    bt.polarities = V4L2_DV_VSYNC_POS_POL | V4L2_DV_HSYNC_POS_POL;
    bt.pixelclock = fps == 24 ? 59'400'000 : 74'250'000;
    bt.hfrontporch = fps == 24 || fps == 30 ? 1760 : fps == 25 ? 2420 : fps == 50 ? 440 : fps == 60 ? 110 : 0;
    bt.hsync = 40;
    bt.hbackporch = 220;
    bt.vfrontporch = 5;
    bt.vsync = 5;
    bt.vbackporch = 20;
    bt.standards = V4L2_DV_BT_STD_CEA861;
    return timings;
  }
  void set_up(const VividNode& node, std::uint32_t type, int fps) const {
    // Other ones first: what was cut out before is whole again only when they change.
    for (const int rate : {fps == 50 ? 60 : 50, fps}) {
      v4l2_dv_timings timings = timings_720p(rate);
      ASSERT_NE(timings.bt.hfrontporch, 0U) << "no such rate: " << fps;
      ASSERT_TRUE(node.call(VIDIOC_S_DV_TIMINGS, timings)) << std::strerror(errno);
    }
    v4l2_format format{};
    format.type = type;
    format.fmt.pix.width = static_cast<std::uint32_t>(width_);
    format.fmt.pix.height = static_cast<std::uint32_t>(height_);
    format.fmt.pix.pixelformat = V4L2_PIX_FMT_GREY;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    ASSERT_TRUE(node.call(VIDIOC_S_FMT, format)) << std::strerror(errno);
    ASSERT_EQ(format.fmt.pix.width, static_cast<std::uint32_t>(width_));
    ASSERT_EQ(format.fmt.pix.height, static_cast<std::uint32_t>(height_));
    ASSERT_EQ(format.fmt.pix.pixelformat, V4L2_PIX_FMT_GREY);
    for (const std::uint32_t target : {V4L2_SEL_TGT_CROP, V4L2_SEL_TGT_COMPOSE}) {
      v4l2_selection part{};
      part.type = type;
      part.target = target;
      ASSERT_TRUE(node.call(VIDIOC_G_SELECTION, part)) << std::strerror(errno);
      ASSERT_EQ(part.r.width, static_cast<std::uint32_t>(width_)) << "it would be scaled";
      ASSERT_EQ(part.r.height, static_cast<std::uint32_t>(height_)) << "it would be scaled";
    }
  }

  int width_, height_;
  VividNode camera_{V4L2_CAP_VIDEO_CAPTURE}, output_{V4L2_CAP_VIDEO_OUTPUT};
  std::array<std::uint8_t*, kBuffers> memory_{};
  std::size_t bytes_ = 0;
  std::uint32_t used_ = 0;
  bool streams_ = false;
};

}  // namespace punctum::loopback
