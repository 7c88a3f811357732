#include "hal/v4l2/v4l2_camera.hpp"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>
#include <utility>

namespace punctum::v4l2 {
namespace {

constexpr std::uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
// One is looked at, one is filled, and two more bridge a picture that takes vision long.
constexpr std::uint32_t kBuffers = 4;
// A driver may say when a frame ends by its nominal rate, and deliver it before: that is no later than now.
// More than a slow camera's frame ahead is another clock.
constexpr std::int64_t kMostAhead_ns = 100'000'000;
constexpr double kExposureUnit_s = 100e-6;  // of V4L2_CID_EXPOSURE_ABSOLUTE

tl::unexpected<std::string> wrong(std::string what) { return tl::unexpected<std::string>(std::move(what)); }

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

std::string size_text(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

std::uint32_t fourcc_of(V4l2Params::Format format) {
  return format == V4l2Params::Format::grey  ? V4L2_PIX_FMT_GREY
         : format == V4l2Params::Format::y16 ? V4L2_PIX_FMT_Y16
                                             : V4L2_PIX_FMT_YUYV;
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) {
    const auto c = static_cast<char>(fourcc >> shift & 0x7f);
    text += c > ' ' && c < 0x7f ? c : '?';
  }
  text.resize(text.find_last_not_of('?') + 1);
  return text;
}

std::string reason(int error) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "no such camera is plugged in";
    case EACCES:
    case EPERM:
      return "may not be opened: add the user to the group of the device (video)";
    case EBUSY:
      return "another program uses it";
    case ENOSPC:
      return "its bus has no room for this size and frame rate";
    case ENOLINK:
      return "it has no signal";
    default:
      return std::strerror(error);
  }
}

}  // namespace

V4l2Camera::V4l2Camera(V4l2Params params, const hal::CameraSettings& settings, const hal::Clock& clock,
                       Kernel& kernel)
    : params_(std::move(params)), settings_(settings), clock_(clock), kernel_(kernel) {}

V4l2Camera::~V4l2Camera() { close(); }

Answer V4l2Camera::call(unsigned long request, void* argument) {
  return kernel_.ioctl(fd_, request, argument);
}

// ---- open ----

V4l2Camera::Done V4l2Camera::open() {
  close();
  notes_.clear();
  counted_ = false;
  const Answer opened = kernel_.open(params_.path.c_str());
  if (opened.value < 0) {
    return wrong(params_.path + ": " + reason(opened.error));
  }
  fd_ = opened.value;
  for (const auto step :
       {&V4l2Camera::check_capability, &V4l2Camera::set_format, &V4l2Camera::set_interval,
        &V4l2Camera::lock_exposure, &V4l2Camera::lock_gain, &V4l2Camera::leave_pictures_plain,
        &V4l2Camera::map_buffers, &V4l2Camera::start_streaming}) {
    if (const Done done = (this->*step)(); !done) {
      close();
      return wrong(params_.path + ": " + done.error());
    }
  }
  return {};
}

hal::Findings V4l2Camera::look() {
  using Is = hal::Finding::Is;
  close();
  const Answer opened = kernel_.open(params_.path.c_str());
  if (opened.value < 0) {
    return {{Is::missing, params_.path + ": " + reason(opened.error)}};
  }
  fd_ = opened.value;
  Done done = check_capability();
  if (done) {
    done = ask_format(VIDIOC_TRY_FMT);
  }
  kernel_.close(std::exchange(fd_, -1));  // not close(): it would end a stream
  if (!done) {
    return {{Is::missing, params_.path + ": " + done.error()}};
  }
  std::string found = params_.path;
  found.append(" (").append(name_).append("), ").append(fourcc_text(fourcc_of(params_.format))).append(" ");
  found.append(
      size_text(static_cast<std::uint32_t>(settings_.width), static_cast<std::uint32_t>(settings_.height)));
  return {{Is::found, found.append(" px")}};
}

V4l2Camera::Done V4l2Camera::check_capability() {
  v4l2_capability about{};
  if (const Answer a = call(VIDIOC_QUERYCAP, &about); a.value < 0) {
    return wrong(a.error == ENOTTY || a.error == EINVAL ? "is no video device" : reason(a.error));
  }
  // Of a driver that ends it by no zero, as much as there is room for.
  const auto* card = reinterpret_cast<const char*>(about.card);
  name_.assign(card, strnlen(card, sizeof about.card));
  has_usb_units_ =
      std::strncmp(reinterpret_cast<const char*>(about.driver), "uvcvideo", sizeof about.driver) == 0;
  const std::uint32_t can =
      (about.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? about.device_caps : about.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    return wrong((can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
                     ? "gives pictures in several planes, allowed: a device with one"
                     : "gives no pictures, allowed: a camera (another node of the same camera may be it)");
  }
  if ((can & V4L2_CAP_STREAMING) == 0) {
    return wrong("cannot stream into mapped buffers, allowed: a camera that can");
  }
  return {};
}

std::string V4l2Camera::offered_formats() {
  std::string names;
  v4l2_fmtdesc format{};
  format.type = kCapture;
  for (; format.index < 64 && call(VIDIOC_ENUM_FMT, &format).value >= 0; ++format.index) {
    names += (names.empty() ? "" : ", ") + fourcc_text(format.pixelformat);
  }
  return names.empty() ? "none" : names;
}

V4l2Camera::Done V4l2Camera::set_format() { return ask_format(VIDIOC_S_FMT); }

V4l2Camera::Done V4l2Camera::ask_format(unsigned long request) {
  v4l2_format format{};
  format.type = kCapture;
  format.fmt.pix.width = static_cast<std::uint32_t>(settings_.width);
  format.fmt.pix.height = static_cast<std::uint32_t>(settings_.height);
  format.fmt.pix.pixelformat = fourcc_of(params_.format);
  format.fmt.pix.field = V4L2_FIELD_NONE;
  const Answer a = call(request, &format);
  const v4l2_pix_format& got = format.fmt.pix;
  if (a.value < 0 && a.error != EINVAL) {
    return wrong(reason(a.error));
  }
  if (a.value < 0 || got.pixelformat != fourcc_of(params_.format)) {
    return wrong("v4l2.format: it does not give " + fourcc_text(fourcc_of(params_.format)) +
                 ", it offers: " + offered_formats());
  }
  if (got.width != static_cast<std::uint32_t>(settings_.width) ||
      got.height != static_cast<std::uint32_t>(settings_.height)) {
    return wrong(
        "camera.width_px and height_px: it does not give " +
        size_text(static_cast<std::uint32_t>(settings_.width), static_cast<std::uint32_t>(settings_.height)) +
        " px, nearest: " + size_text(got.width, got.height));
  }
  if (got.field != V4L2_FIELD_NONE) {
    return wrong("its pictures are interlaced, allowed: progressive ones");
  }
  layout_ = {params_.format, settings_.width, settings_.height, static_cast<int>(got.bytesperline),
             params_.bits};
  // Also where the driver does not say (0), or says nonsense.
  constexpr std::uint32_t kMostStride = 1U << 20U;
  if (got.bytesperline < row_bytes(layout_) || got.bytesperline > kMostStride) {
    return wrong("its driver says that a row of " + std::to_string(settings_.width) + " px has " +
                 std::to_string(got.bytesperline) + " bytes");
  }
  grey_.assign(params_.format == V4l2Params::Format::grey
                   ? 0
                   : static_cast<std::size_t>(layout_.width) * static_cast<std::size_t>(layout_.height),
               0);
  return {};
}

V4l2Camera::Done V4l2Camera::set_interval() {
  if (settings_.fps <= 0) {
    return {};
  }
  // In thousandths, so that 59.94 is asked for as such.
  v4l2_streamparm parameters{};
  parameters.type = kCapture;
  parameters.parm.capture.timeperframe = {1000,
                                          static_cast<std::uint32_t>(std::lround(settings_.fps * 1000))};
  const Answer a = call(VIDIOC_S_PARM, &parameters);
  if (a.value < 0 && a.error != ENOTTY && a.error != EINVAL) {
    return wrong(reason(a.error));
  }
  const v4l2_fract& got = parameters.parm.capture.timeperframe;
  if (a.value < 0 || (parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) == 0 ||
      got.numerator == 0) {
    return wrong("camera.fps: its frame rate cannot be set, allowed: 0 (as it is)");
  }
  const double fps = static_cast<double>(got.denominator) / got.numerator;
  constexpr double kSameRate = 5e-3;
  if (std::abs(fps - settings_.fps) > kSameRate * settings_.fps) {
    return wrong("camera.fps: it does not give " + number(settings_.fps) + ", nearest: " + number(fps));
  }
  return {};
}

bool V4l2Camera::find_control(std::uint32_t id, v4l2_queryctrl& out) {
  out = {};
  out.id = id;
  return call(VIDIOC_QUERYCTRL, &out).value >= 0 && (out.flags & V4L2_CTRL_FLAG_DISABLED) == 0;
}

V4l2Camera::Done V4l2Camera::set_control(std::uint32_t id, int value, std::string_view key) {
  v4l2_control control{id, value};
  if (const Answer a = call(VIDIOC_S_CTRL, &control); a.value < 0) {
    return wrong(std::string(key) + ": cannot be set: " + reason(a.error));
  }
  control.value = 0;
  if (call(VIDIOC_G_CTRL, &control).value < 0 || control.value != value) {
    return wrong(std::string(key) + ": it does not keep what it is set to");
  }
  return {};
}

// `value` in units of `unit`, as near as the control's steps allow.
V4l2Camera::Done V4l2Camera::set_number(std::uint32_t id, double value, double unit, const char* key) {
  v4l2_queryctrl about{};
  if (!find_control(id, about) || (about.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) {
    return wrong(std::string(key) + ": it cannot be set on this camera, allowed: leave it out (as it is)");
  }
  const int step = std::max(about.step, 1);
  const double wanted = value / unit;
  if (!(wanted >= about.minimum - 0.5 * step && wanted <= about.maximum + 0.5 * step)) {
    // In the unit of the scene's key: ms for a time, the camera's own otherwise.
    const double shown = unit == kExposureUnit_s ? unit * 1e3 : unit;
    return wrong(std::string(key) + ": is out of range, allowed: from " + number(about.minimum * shown) +
                 " to " + number(about.maximum * shown));
  }
  const std::int64_t steps = std::llround((wanted - about.minimum) / step);
  return set_control(
      id, static_cast<int>(std::min<std::int64_t>(about.minimum + steps * step, about.maximum)), key);
}

V4l2Camera::Done V4l2Camera::lock_exposure() {
  exposure_s_ = 0;
  const bool asked = settings_.exposure_s > 0;
  v4l2_queryctrl about{};
  const bool automatic = find_control(V4L2_CID_EXPOSURE_AUTO, about);
  const bool absolute = find_control(V4L2_CID_EXPOSURE_ABSOLUTE, about);
  if (!automatic && !absolute && !asked) {
    notes_.push_back(params_.path + ": it has no exposure to lock");
    return {};
  }
  if (automatic) {
    const Done done = set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, "camera.exposure_ms");
    if (!done && asked) {
      return done;
    }
    if (!done) {
      notes_.push_back(params_.path + ": its exposure stays automatic; frames may become brighter or darker");
      return {};
    }
  }
  // A driver may lower the frame rate for a longer exposure.
  if (find_control(V4L2_CID_EXPOSURE_AUTO_PRIORITY, about)) {
    (void)set_control(V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, "camera.fps");
  }
  if (asked) {
    if (const Done done = set_number(V4L2_CID_EXPOSURE_ABSOLUTE, settings_.exposure_s, kExposureUnit_s,
                                     "camera.exposure_ms");
        !done) {
      return done;
    }
  }
  v4l2_control now{V4L2_CID_EXPOSURE_ABSOLUTE, 0};
  if (absolute && call(VIDIOC_G_CTRL, &now).value >= 0 && now.value > 0) {
    exposure_s_ = now.value * kExposureUnit_s;
  }
  return {};
}

V4l2Camera::Done V4l2Camera::lock_gain() {
  const bool asked = settings_.gain != hal::kAsItIs;
  v4l2_queryctrl about{};
  const bool automatic = find_control(V4L2_CID_AUTOGAIN, about);
  if (automatic) {
    const Done done = set_control(V4L2_CID_AUTOGAIN, 0, "camera.gain");
    if (!done && asked) {
      return done;
    }
    if (!done) {
      notes_.push_back(params_.path + ": its gain stays automatic; frames may become brighter or darker");
    }
  }
  if (asked) {
    return set_number(V4L2_CID_GAIN, settings_.gain, 1, "camera.gain");
  }
  if (!automatic && !find_control(V4L2_CID_GAIN, about)) {
    notes_.push_back(params_.path + ": it has no gain to lock");
  }
  return {};
}

// What a camera does to its pictures moves edges, and the standard deviations do not know of it.
V4l2Camera::Done V4l2Camera::leave_pictures_plain() {
  const auto set = [this](std::uint32_t id, const char* name, std::optional<int> plain) {
    v4l2_queryctrl about{};
    v4l2_control now{id, 0};
    if (!find_control(id, about) || call(VIDIOC_G_CTRL, &now).value < 0) {
      return;
    }
    const int wanted = plain.value_or(about.minimum);
    if (now.value == wanted) {
      return;
    }
    if (wanted < about.minimum || wanted > about.maximum || !set_control(id, wanted, name)) {
      notes_.push_back(params_.path + ": its " + name + " stays " + std::to_string(now.value) + ", not " +
                       std::to_string(wanted) +
                       "; membranes and needle may be told off by more than they say");
      return;
    }
    notes_.push_back(params_.path + ": its " + name + " is set from " + std::to_string(now.value) + " to " +
                     std::to_string(wanted) + ", so that edges stay where the lens shows them");
  };
  set(V4L2_CID_SHARPNESS, "sharpness", std::nullopt);
  set(V4L2_CID_BACKLIGHT_COMPENSATION, "backlight compensation", std::nullopt);
  if (has_usb_units_) {
    constexpr int kLinear = 100;  // hundredths (USB Video Class 1.5, gamma control)
    set(V4L2_CID_GAMMA, "gamma", kLinear);
  }
  return {};
}

V4l2Camera::Done V4l2Camera::map_buffers() {
  v4l2_requestbuffers wanted{};
  wanted.count = kBuffers;
  wanted.type = kCapture;
  wanted.memory = V4L2_MEMORY_MMAP;
  if (const Answer a = call(VIDIOC_REQBUFS, &wanted); a.value < 0) {
    return wrong("it gives no buffers: " + reason(a.error));
  }
  constexpr std::uint32_t kMost = 32;
  if (wanted.count < 2 || wanted.count > kMost) {
    return wrong("it gives " + std::to_string(wanted.count) + " buffers, needed: at least 2");
  }
  for (std::uint32_t i = 0; i < wanted.count; ++i) {
    v4l2_buffer about{};
    about.index = i;
    about.type = kCapture;
    about.memory = V4L2_MEMORY_MMAP;
    if (const Answer a = call(VIDIOC_QUERYBUF, &about); a.value < 0) {
      return wrong("it does not say where its buffers are: " + reason(a.error));
    }
    if (const Done done = check_stamps(about.flags); !done) {
      return done;
    }
    if (about.length < bytes_needed(layout_)) {
      return wrong("its buffers have " + std::to_string(about.length) + " bytes, a picture needs " +
                   std::to_string(bytes_needed(layout_)));
    }
    Buffer buffer;
    buffer.bytes = about.length;
    buffer.memory = kernel_.map(fd_, buffer.bytes, about.m.offset);
    if (buffer.memory == nullptr) {
      return wrong("its buffers cannot be mapped");
    }
    buffers_.push_back(buffer);
  }
  return {};
}

V4l2Camera::Done V4l2Camera::check_stamps(std::uint32_t flags) {
  if ((flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
    return wrong(
        "its driver does not stamp frames with the monotonic clock: when one was taken is not known");
  }
  stamped_at_end_ = (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) != V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  stamp_to_exposure_ns_ = stamped_at_end_ ? -std::llround((exposure_s_ + settings_.readout_s) * 1e9) : 0;
  return {};
}

V4l2Camera::Done V4l2Camera::start_streaming() {
  if (stamped_at_end_ && (exposure_s_ == 0 || settings_.readout_s == 0)) {
    notes_.push_back(params_.path +
                     ": frames are stamped at their end; when they were taken is late by the " +
                     (exposure_s_ != 0           ? ""
                      : settings_.readout_s != 0 ? "exposure"
                                                 : "exposure and the ") +
                     (settings_.readout_s != 0 ? "" : "readout (camera.readout_ms)"));
  }
  give_back();
  if (std::any_of(buffers_.begin(), buffers_.end(), [](const Buffer& b) { return !b.queued; })) {
    return wrong("it does not take its buffers: " + error_);
  }
  int type = kCapture;
  if (const Answer a = call(VIDIOC_STREAMON, &type); a.value < 0) {
    return wrong("it does not stream: " + reason(a.error));
  }
  return {};
}

void V4l2Camera::close() noexcept {
  if (fd_ < 0) {
    return;
  }
  int type = kCapture;
  (void)call(VIDIOC_STREAMOFF, &type);
  for (const Buffer& buffer : buffers_) {
    kernel_.unmap(buffer.memory, buffer.bytes);
  }
  buffers_.clear();
  holding_ = false;
  kernel_.close(fd_);
  fd_ = -1;
}

// ---- frames ----

// Every buffer that is neither looked at nor the driver's. One that it refuses is offered again next time.
void V4l2Camera::give_back() {
  for (std::uint32_t i = 0; i < buffers_.size(); ++i) {
    if (buffers_[i].queued || (holding_ && i == held_)) {
      continue;
    }
    v4l2_buffer buffer{};
    buffer.index = i;
    buffer.type = kCapture;
    buffer.memory = V4L2_MEMORY_MMAP;
    const Answer a = call(VIDIOC_QBUF, &buffer);
    buffers_[i].queued = a.value >= 0;
    if (a.value < 0) {
      error_ = reason(a.error);
    }
  }
}

hal::Status V4l2Camera::lost(const char* what, int error) {
  error_ = params_.path + ": " + what + (error != 0 ? ": " + reason(error) : "");
  return hal::Status::disconnected;
}

V4l2Camera::Taken V4l2Camera::judged(const v4l2_buffer& buffer) {
  Taken taken;
  taken.index = buffer.index;
  // A driver that does not count repeats its number; one that starts anew jumps back. After a replug the
  // count goes on.
  const std::uint32_t gap = buffer.sequence - driver_sequence_;
  if (!counted_ || gap == 0 || gap > 0x7fffffffU) {
    sequence_ += 1;
  } else {
    sequence_ += gap;
    counts_.lost += gap - 1;
  }
  driver_sequence_ = buffer.sequence;
  counted_ = true;
  taken.sequence = sequence_;
  const std::int64_t now_ns = clock_.now_ns();
  const std::int64_t stamp_ns = static_cast<std::int64_t>(buffer.timestamp.tv_sec) * 1'000'000'000 +
                                static_cast<std::int64_t>(buffer.timestamp.tv_usec) * 1000 +
                                stamp_to_exposure_ns_;
  taken.exposure_ns = std::min(stamp_ns, now_ns);
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) {
    taken.damage = "its driver says that the picture is damaged";
  } else if (buffer.bytesused < bytes_needed(layout_) || buffer.bytesused > buffers_[buffer.index].bytes) {
    taken.damage = "the picture is incomplete";
  } else if (stamp_ns - now_ns > kMostAhead_ns) {
    taken.damage = "the picture is stamped ahead of the clock";
  } else if (taken.exposure_ns <= last_exposure_ns_) {
    taken.damage = "the picture is not stamped later than the one before";
  }
  if (taken.damage == nullptr) {
    last_exposure_ns_ = taken.exposure_ns;
  }
  return taken;
}

hal::Status V4l2Camera::next(hal::Frame& out, std::int64_t timeout_ns) {
  holding_ = false;
  if (fd_ < 0) {
    return hal::Status::disconnected;
  }
  give_back();
  if (std::none_of(buffers_.begin(), buffers_.end(), [](const Buffer& b) { return b.queued; })) {
    return lost("it takes its buffers no more", 0);
  }
  error_.clear();
  short events = 0;
  const std::int64_t wait_ms = std::clamp<std::int64_t>((timeout_ns + 999'999) / 1'000'000, 0, 60'000);
  const Answer polled = kernel_.poll(fd_, static_cast<int>(wait_ms), events);
  if (polled.value < 0) {
    return polled.error == EINTR ? hal::Status::no_data : lost("it cannot be waited for", polled.error);
  }
  if ((events & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
    return lost("it is unplugged, or has stopped streaming", 0);
  }
  if (polled.value == 0) {
    return hal::Status::no_data;
  }

  // All that are ready; none is given back before the end, so there are no more of them than buffers.
  Taken newest;
  Taken damaged;
  bool any = false;
  for (;;) {
    v4l2_buffer buffer{};
    buffer.type = kCapture;
    buffer.memory = V4L2_MEMORY_MMAP;
    const Answer a = call(VIDIOC_DQBUF, &buffer);
    if (a.value < 0 && a.error == EAGAIN) {
      break;
    }
    if (a.value < 0) {
      return lost("it has stopped streaming", a.error);
    }
    if (buffer.index >= buffers_.size() || !buffers_[buffer.index].queued) {
      return lost("its driver gives a buffer that it does not have", 0);
    }
    buffers_[buffer.index].queued = false;
    const Taken taken = judged(buffer);
    if (taken.damage != nullptr) {
      ++counts_.unusable;
      damaged = taken;
      continue;
    }
    counts_.skipped += any ? 1U : 0U;
    newest = taken;
    any = true;
  }
  if (!any && damaged.damage == nullptr) {
    return hal::Status::no_data;
  }
  const Taken& shown = any ? newest : damaged;
  out = {};
  out.sequence = shown.sequence;
  out.exposure_ns = shown.exposure_ns;
  out.width = layout_.width;
  out.height = layout_.height;
  if (!any) {
    give_back();
    error_ = params_.path + ": " + damaged.damage;
    return hal::Status::fault;
  }
  ++counts_.delivered;
  const auto* const memory = static_cast<const std::uint8_t*>(buffers_[newest.index].memory);
  if (layout_.format == V4l2Params::Format::grey) {
    held_ = newest.index;
    holding_ = true;
    out.pixels = memory;
    out.stride = layout_.stride;
  } else {
    to_grey(layout_, memory, grey_.data());
    out.pixels = grey_.data();
    out.stride = layout_.width;
  }
  give_back();
  return hal::Status::ok;
}

void V4l2Camera::release(const hal::Frame&) {
  if (fd_ >= 0) {
    holding_ = false;
    give_back();
  }
}

}  // namespace punctum::v4l2
