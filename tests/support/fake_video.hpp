// A kernel with one V4L2 camera, as the documentation of its interface (userspace-api/media/v4l) describes
// it: what it offers, what it was told, and pictures when a test says so.
#pragma once

#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "hal/v4l2/kernel.hpp"

namespace punctum::tests {

class FakeVideo final : public v4l2::Kernel {
 public:
  struct Control {
    int minimum = 0, maximum = 1, step = 1, value = 0;
    std::uint32_t flags = 0;
    bool keeps = true;  // what it is set to
  };

  // What the camera is.
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::string driver = "uvcvideo";
  std::vector<std::uint32_t> formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y16};
  std::uint32_t width = 4, height = 3;
  std::uint32_t padding = 0;   // bytes behind each row
  std::uint32_t row_says = 0;  // another number of bytes for a row; 0: the true one
  std::uint32_t field = V4L2_FIELD_NONE;
  std::uint32_t fps_numerator = 25, fps_denominator = 1;
  bool has_rate = true;
  std::map<std::uint32_t, Control> controls;
  std::uint32_t buffer_count = 4;
  std::uint32_t buffer_bytes = 0;  // 0: as many as a picture takes
  std::uint32_t buffer_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  std::map<unsigned long, int> errors;  // of a request: errno
  int open_error = 0, poll_error = 0;
  bool unplugged = false, maps = true;
  short events = 0;  // besides that a picture is there

  // What happened to it.
  bool is_open = false, streams = false, was_set = false;
  int stream_offs = 0, mapped = 0, refusals_of_qbuf = 0, polled_ms = -1;
  std::vector<std::vector<std::uint8_t>> memory;
  std::deque<std::uint32_t> queued;  // the driver's, in this order
  std::deque<v4l2_buffer> filled;    // and to be dequeued

  // The next queued buffer gets these bytes. False: there is none, the picture is lost.
  bool fill(std::uint32_t sequence, std::int64_t stamp_ns, const std::vector<std::uint8_t>& bytes,
            std::uint32_t flags = 0) {
    if (queued.empty()) {
      return false;
    }
    v4l2_buffer buffer{};
    buffer.index = queued.front();
    queued.pop_front();
    auto& into = memory[buffer.index];
    std::copy_n(bytes.begin(), std::min(bytes.size(), into.size()), into.begin());
    buffer.bytesused = static_cast<std::uint32_t>(bytes.size());
    buffer.sequence = sequence;
    buffer.flags = buffer_flags | flags;
    buffer.timestamp.tv_sec = stamp_ns / 1'000'000'000;
    buffer.timestamp.tv_usec = stamp_ns % 1'000'000'000 / 1000;
    filled.push_back(buffer);
    return true;
  }

  v4l2::Answer open(const char*) override {
    if (open_error != 0 || unplugged) {
      return {-1, open_error != 0 ? open_error : ENODEV};
    }
    is_open = true;
    return {7, 0};
  }
  void close(int) override {
    is_open = streams = false;
    queued.clear();
    filled.clear();
  }
  v4l2::Answer poll(int, int timeout_ms, short& out) override {
    polled_ms = timeout_ms;
    if (poll_error != 0) {
      return {-1, poll_error};
    }
    out = static_cast<short>(unplugged ? POLLERR | POLLHUP : events | (filled.empty() ? 0 : POLLIN));
    return {out != 0 ? 1 : 0, 0};
  }
  void* map(int, std::size_t bytes, std::int64_t offset) override {
    const auto i = static_cast<std::size_t>(offset) / kSpacing;
    if (!maps || i >= memory.size() || bytes != memory[i].size()) {
      return nullptr;
    }
    ++mapped;
    return memory[i].data();
  }
  void unmap(void*, std::size_t) override { --mapped; }
  v4l2::Answer ioctl(int, unsigned long request, void* argument) override {
    if (const auto wrong = errors.find(request); wrong != errors.end()) {
      return {-1, wrong->second};
    }
    const int error = unplugged ? ENODEV : answer(request, argument);
    return {error == 0 ? 0 : -1, error};
  }

 private:
  static constexpr std::size_t kSpacing = 1U << 20U;

  [[nodiscard]] std::uint32_t pixel_bytes(std::uint32_t format) const {
    return format == V4L2_PIX_FMT_GREY ? 1 : 2;
  }
  int answer(unsigned long request, void* argument) {
    switch (request) {
      case VIDIOC_QUERYCAP:
        static_cast<v4l2_capability*>(argument)->capabilities = capabilities | V4L2_CAP_DEVICE_CAPS;
        static_cast<v4l2_capability*>(argument)->device_caps = capabilities;
        std::memcpy(static_cast<v4l2_capability*>(argument)->card, "a microscope camera", 20);
        driver.copy(reinterpret_cast<char*>(static_cast<v4l2_capability*>(argument)->driver), 15);
        return 0;
      case VIDIOC_ENUM_FMT: {
        auto& format = *static_cast<v4l2_fmtdesc*>(argument);
        if (format.index >= formats.size()) {
          return EINVAL;
        }
        format.pixelformat = formats[format.index];
        return 0;
      }
      case VIDIOC_TRY_FMT:
      case VIDIOC_S_FMT: {
        was_set = was_set || request == VIDIOC_S_FMT;
        auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
        if (std::find(formats.begin(), formats.end(), pix.pixelformat) == formats.end()) {
          pix.pixelformat = formats.empty() ? 0 : formats.front();
        }
        pix.width = width;
        pix.height = height;
        pix.field = field;
        const std::uint32_t row = width * pixel_bytes(pix.pixelformat) + padding;
        pix.bytesperline = row_says != 0 ? row_says : row;
        pix.sizeimage = picture_ = row * height;
        return 0;
      }
      case VIDIOC_S_PARM: {
        auto& capture = static_cast<v4l2_streamparm*>(argument)->parm.capture;
        capture.capability = has_rate ? V4L2_CAP_TIMEPERFRAME : 0;
        capture.timeperframe = {fps_denominator, fps_numerator};
        return 0;
      }
      case VIDIOC_QUERYCTRL: {
        auto& query = *static_cast<v4l2_queryctrl*>(argument);
        const auto found = controls.find(query.id);
        if (found == controls.end()) {
          return EINVAL;
        }
        query.minimum = found->second.minimum;
        query.maximum = found->second.maximum;
        query.step = found->second.step;
        query.flags = found->second.flags;
        return 0;
      }
      case VIDIOC_S_CTRL:
      case VIDIOC_G_CTRL: {
        auto& control = *static_cast<v4l2_control*>(argument);
        const auto found = controls.find(control.id);
        if (found == controls.end()) {
          return EINVAL;
        }
        if (request == VIDIOC_G_CTRL) {
          control.value = found->second.value;
        } else if (control.value < found->second.minimum || control.value > found->second.maximum) {
          return ERANGE;
        } else if (found->second.keeps) {
          found->second.value = control.value;
        }
        return 0;
      }
      case VIDIOC_REQBUFS: {
        auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
        wanted.count = buffer_count;
        memory.assign(buffer_count, std::vector<std::uint8_t>(buffer_bytes != 0 ? buffer_bytes : picture_));
        return 0;
      }
      case VIDIOC_QUERYBUF: {
        auto& buffer = *static_cast<v4l2_buffer*>(argument);
        if (buffer.index >= memory.size()) {
          return EINVAL;
        }
        buffer.length = static_cast<std::uint32_t>(memory[buffer.index].size());
        buffer.flags = buffer_flags;
        buffer.m.offset = static_cast<std::uint32_t>(buffer.index * kSpacing);
        return 0;
      }
      case VIDIOC_QBUF: {
        const std::uint32_t index = static_cast<v4l2_buffer*>(argument)->index;
        if (refusals_of_qbuf > 0) {
          --refusals_of_qbuf;
          return EINVAL;
        }
        if (index >= memory.size() || std::find(queued.begin(), queued.end(), index) != queued.end()) {
          return EINVAL;
        }
        queued.push_back(index);
        return 0;
      }
      case VIDIOC_DQBUF:
        if (filled.empty()) {
          return EAGAIN;
        }
        *static_cast<v4l2_buffer*>(argument) = filled.front();
        filled.pop_front();
        return 0;
      case VIDIOC_STREAMON:
        streams = true;
        return 0;
      case VIDIOC_STREAMOFF:
        ++stream_offs;
        streams = false;
        return 0;
      default:
        return ENOTTY;
    }
  }

  std::uint32_t picture_ = 0;
};

}  // namespace punctum::tests
