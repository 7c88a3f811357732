#include "tools/emulators/world/picture_output.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

namespace punctum::emulator {
namespace {

constexpr int kMostNodes = 64;
constexpr int kRates[] = {24, 25, 30, 50, 60};

template <std::size_t N>
std::string_view text(const std::uint8_t (&field)[N]) {
  return {reinterpret_cast<const char*>(field), strnlen(reinterpret_cast<const char*>(field), N)};
}

bool is_vivid(const v4l2_capability& about) { return text(about.driver) == "vivid"; }

std::string refused(const VideoNode& node, const char* what) {
  return node.path() + ": " + what + ": " + std::strerror(errno);
}

// CEA-861: rates differ in the front porch of a line, and in the clock.
v4l2_dv_timings timings_720p(int fps) {
  v4l2_dv_timings timings{};
  timings.type = V4L2_DV_BT_656_1120;
  v4l2_bt_timings& bt = timings.bt;
  bt.width = 1280;
  bt.height = 720;
  bt.polarities = V4L2_DV_VSYNC_POS_POL | V4L2_DV_HSYNC_POS_POL;
  bt.pixelclock = fps == 24 ? 59'400'000 : 74'250'000;
  bt.hfrontporch = fps == 24 || fps == 30 ? 1760 : fps == 25 ? 2420 : fps == 50 ? 440 : 110;
  bt.hsync = 40;
  bt.hbackporch = 220;
  bt.vfrontporch = 5;
  bt.vsync = 5;
  bt.vbackporch = 20;
  bt.standards = V4L2_DV_BT_STD_CEA861;
  return timings;
}

v4l2_buffer buffer_about(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

}  // namespace

// ---- a node ----

tl::expected<VideoNode, std::string> VideoNode::open(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) {
    return tl::make_unexpected(path + ": " + std::strerror(errno));
  }
  VideoNode node(path, fd);
  v4l2_capability about{};
  if (!node.call(VIDIOC_QUERYCAP, about)) {
    return tl::make_unexpected(path + ": is no video device");
  }
  return node;
}

tl::expected<VideoNode, std::string> VideoNode::open_vivid(std::uint32_t capability, const std::string& bus) {
  for (int i = 0; i < kMostNodes; ++i) {
    auto node = open("/dev/video" + std::to_string(i));
    if (!node) {
      continue;
    }
    const v4l2_capability about = node->about();
    if (is_vivid(about) && (about.device_caps & capability) != 0 &&
        (bus.empty() || text(about.bus_info) == bus)) {
      return node;
    }
  }
  return tl::make_unexpected("vivid has no node with capability " + std::to_string(capability));
}

VideoNode::VideoNode(VideoNode&& other) noexcept
    : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)) {}

void VideoNode::close() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
  fd_ = -1;
}

bool VideoNode::reopen() {
  close();
  fd_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  return fd_ >= 0;
}

v4l2_capability VideoNode::about() const {
  v4l2_capability about{};
  (void)call(VIDIOC_QUERYCAP, about);
  return about;
}

std::uint32_t VideoNode::control(const std::string& name) const {
  v4l2_queryctrl about{};
  about.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (call(VIDIOC_QUERYCTRL, about)) {
    if (text(about.name) == name) {
      return about.id;
    }
    about.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return 0;
}

bool VideoNode::set(const std::string& name, int value) const {
  v4l2_control wanted{control(name), value};
  return wanted.id != 0 && call(VIDIOC_S_CTRL, wanted);
}

bool VideoNode::use_input(const std::string& name) const {
  v4l2_input input{};
  for (; call(VIDIOC_ENUMINPUT, input); ++input.index) {
    if (text(input.name).starts_with(name)) {
      int index = static_cast<int>(input.index);
      return call(VIDIOC_S_INPUT, index);
    }
  }
  return false;
}

bool VideoNode::use_output(const std::string& name) const {
  v4l2_output output{};
  for (; call(VIDIOC_ENUMOUTPUT, output); ++output.index) {
    if (text(output.name).starts_with(name)) {
      int index = static_cast<int>(output.index);
      return call(VIDIOC_S_OUTPUT, index);
    }
  }
  return false;
}

// ---- the output ----

tl::expected<std::unique_ptr<PictureOutput>, std::string> PictureOutput::open(const std::string& path,
                                                                              int width, int height,
                                                                              int fps) {
  auto named = VideoNode::open(path);
  if (!named) {
    return tl::make_unexpected(named.error());
  }
  const v4l2_capability about = named->about();
  const bool vivid = is_vivid(about);
  if (!vivid && (about.device_caps & V4L2_CAP_VIDEO_OUTPUT) == 0) {
    return tl::make_unexpected(path + ": takes no pictures, allowed: a device of vivid or v4l2loopback");
  }
  const std::string bus(text(about.bus_info));
  auto output = vivid ? VideoNode::open_vivid(V4L2_CAP_VIDEO_OUTPUT, bus) : std::move(named);
  if (!output) {
    return tl::make_unexpected(output.error());
  }
  std::unique_ptr<PictureOutput> made(new PictureOutput(std::move(*output), width, height));
  if (vivid) {
    auto camera = VideoNode::open_vivid(V4L2_CAP_VIDEO_CAPTURE, bus);
    if (!camera) {
      return tl::make_unexpected(camera.error());
    }
    made->camera_.emplace(std::move(*camera));
  }
  if (const std::string problem = made->set_up(fps); !problem.empty()) {
    return tl::make_unexpected(problem);
  }
  return made;
}

std::string PictureOutput::set_up(int fps) {
  if (camera_) {
    if (!camera_->use_input("HDMI") || !output_.use_output("HDMI")) {
      return refused(*camera_, "has no HDMI");
    }
    if (!camera_->set("Enable Capture Scaler", 0) || !output_.set("Enable Output Scaler", 0)) {
      return refused(*camera_, "would scale the pictures");
    }
    for (const auto& [node, type] : {std::pair{&*camera_, V4L2_BUF_TYPE_VIDEO_CAPTURE},
                                     std::pair{&output_, V4L2_BUF_TYPE_VIDEO_OUTPUT}}) {
      std::string problem = set_timings(*node, fps);
      if (problem.empty()) {
        problem = set_format(*node, type, true);
      }
      if (!problem.empty()) {
        return problem;
      }
    }
    // Without text, which would be written into the picture.
    if (!loop(true) || !camera_->set("OSD Text Mode", 2)) {
      return refused(*camera_, "does not show what its output is given");
    }
  } else if (std::string problem = set_format(output_, V4L2_BUF_TYPE_VIDEO_OUTPUT, false); !problem.empty()) {
    return problem;
  }
  return make_buffers();
}

std::string PictureOutput::set_timings(const VideoNode& node, int fps) const {
  bool known = false;
  for (const int rate : kRates) {
    known = known || rate == fps;
  }
  if (!known) {
    return node.path() + ": no such rate: " + std::to_string(fps) + ", allowed: 24, 25, 30, 50, 60";
  }
  // Other ones first: what was cut out before is whole again only when they change.
  for (const int rate : {fps == 50 ? 60 : 50, fps}) {
    v4l2_dv_timings timings = timings_720p(rate);
    if (!node.call(VIDIOC_S_DV_TIMINGS, timings)) {
      return refused(node, "refuses the timings of 1280 x 720");
    }
  }
  return {};
}

// cut: out of a larger signal, so that it may be scaled.
std::string PictureOutput::set_format(const VideoNode& node, std::uint32_t type, bool cut) const {
  const auto width = static_cast<std::uint32_t>(width_), height = static_cast<std::uint32_t>(height_);
  v4l2_format format{};
  format.type = type;
  format.fmt.pix.width = width;
  format.fmt.pix.height = height;
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_GREY;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (!node.call(VIDIOC_S_FMT, format)) {
    return refused(node, "refuses the format GREY");
  }
  if (format.fmt.pix.width != width || format.fmt.pix.height != height ||
      format.fmt.pix.pixelformat != V4L2_PIX_FMT_GREY) {
    return node.path() + ": cannot show " + std::to_string(width) + " x " + std::to_string(height) + " GREY";
  }
  for (const std::uint32_t target : {V4L2_SEL_TGT_CROP, V4L2_SEL_TGT_COMPOSE}) {
    v4l2_selection part{};
    part.type = type;
    part.target = target;
    if (cut && (!node.call(VIDIOC_G_SELECTION, part) || part.r.width != width || part.r.height != height)) {
      return node.path() + ": would scale the pictures";
    }
  }
  return {};
}

std::string PictureOutput::make_buffers() {
  v4l2_requestbuffers wanted{};
  wanted.count = kBuffers;
  wanted.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  wanted.memory = V4L2_MEMORY_MMAP;
  if (!output_.call(VIDIOC_REQBUFS, wanted) || wanted.count < kBuffers) {
    return refused(output_, "gives no buffers");
  }
  for (std::uint32_t i = 0; i < kBuffers; ++i) {
    v4l2_buffer buffer = buffer_about(i);
    if (!output_.call(VIDIOC_QUERYBUF, buffer)) {
      return refused(output_, "gives no buffers");
    }
    bytes_ = buffer.length;
    void* memory = ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, output_.fd(), buffer.m.offset);
    if (memory == MAP_FAILED) {
      return refused(output_, "gives no memory");
    }
    memory_[i] = static_cast<std::uint8_t*>(memory);
    ++made_;
  }
  return {};
}

PictureOutput::~PictureOutput() {
  int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  (void)output_.call(VIDIOC_STREAMOFF, type);
  for (std::uint32_t i = 0; i < made_; ++i) {
    ::munmap(memory_[i], bytes_);
  }
  output_.close();  // its buffers keep the format
  // A device that was unplugged is back once nobody has it open.
  if (camera_ && camera_->reopen()) {
    (void)loop(false);
    (void)camera_->set("OSD Text Mode", 0);
    (void)camera_->set("Enable Capture Scaler", 1);
    (void)camera_->use_input("Webcam");
  }
}

// Newer kernels have a menu: the test picture, nothing, and the first output of HDMI.
bool PictureOutput::loop(bool on) const {
  const std::string menu = "HDMI 000-0 Is Connected To";
  return camera_->control(menu) != 0 ? camera_->set(menu, on ? 2 : 0)
                                     : camera_->set("Loop Video", on ? 1 : 0);
}

std::string PictureOutput::show(std::span<const std::uint8_t> pixels) {
  if (pixels.size() != static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) ||
      pixels.size() > bytes_) {
    return output_.path() + ": a picture of " + std::to_string(pixels.size()) + " bytes";
  }
  v4l2_buffer buffer = buffer_about(used_);
  if (used_ < kBuffers) {
    ++used_;
  } else {
    pollfd free{output_.fd(), POLLOUT, 0};
    if (::poll(&free, 1, 1000) != 1) {
      return output_.path() + ": gives no buffer back";
    }
    if (!output_.call(VIDIOC_DQBUF, buffer)) {
      return refused(output_, "gives no buffer back");
    }
  }
  std::memcpy(memory_[buffer.index], pixels.data(), pixels.size());
  buffer.bytesused = static_cast<std::uint32_t>(pixels.size());
  buffer.field = V4L2_FIELD_NONE;
  if (!output_.call(VIDIOC_QBUF, buffer)) {
    return refused(output_, "takes no picture");
  }
  if (!streams_) {
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    if (!output_.call(VIDIOC_STREAMON, type)) {
      return refused(output_, "does not stream");
    }
    streams_ = true;
  }
  return {};
}

}  // namespace punctum::emulator
