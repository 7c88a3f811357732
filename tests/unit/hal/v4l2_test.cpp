// The logic of the backend v4l2 on a kernel of this test's own. The real one: tests/loopback.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "hal/v4l2/v4l2_camera.hpp"
#include "tests/support/fake_video.hpp"

namespace punctum::v4l2 {
namespace {

using hal::Status;
using Bytes = std::vector<std::uint8_t>;
using Format = V4l2Params::Format;

constexpr std::int64_t kTimeout_ns = 100'000'000, kFrame_ns = 40'000'000;

class HandClock final : public hal::Clock {
 public:
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now; }
  void sleep_until_ns(std::int64_t t_ns) noexcept override { now = t_ns; }
  std::int64_t now = 1'000'000'000'000;
};

// ---- conversions ----

Bytes some_bytes(std::size_t count) {
  std::mt19937 random(static_cast<unsigned>(count));
  Bytes bytes(count);
  for (auto& b : bytes) {
    b = static_cast<std::uint8_t>(random());
  }
  return bytes;
}

TEST(V4l2Grey, y16_is_the_quotient_of_little_endian_numbers_and_its_bits) {
  for (const int bits : {8, 10, 12, 16}) {
    const Layout layout{Format::y16, 5, 4, 14, bits};
    const Bytes from = some_bytes(bytes_needed(layout));
    ASSERT_EQ(from.size(), 3U * 14 + 10);
    Bytes to(20);
    to_grey(layout, from.data(), to.data());
    for (std::size_t y = 0; y < 4; ++y) {
      for (std::size_t x = 0; x < 5; ++x) {
        const double value = from[y * 14 + 2 * x] + 256.0 * from[y * 14 + 2 * x + 1];
        const double grey = std::floor(value / std::pow(2.0, bits - 8));
        EXPECT_EQ(to[y * 5 + x], std::min(grey, 255.0)) << bits << " bits, " << x << ", " << y;
      }
    }
  }
}

TEST(V4l2Grey, yuyv_gives_the_brightness_of_both_pixels_of_a_pair) {
  // "YUYV: Y'00 Cb00 Y'01 Cr00 ..." (userspace-api/media/v4l/pixfmt-packed-yuv)
  const Layout layout{Format::yuyv, 4, 2, 9, 16};
  const Bytes from = {1, 90, 2, 91, 3, 92, 4, 93, 0, 5, 94, 6, 95, 7, 96, 8, 97};
  ASSERT_EQ(bytes_needed(layout), from.size());
  Bytes to(8);
  to_grey(layout, from.data(), to.data());
  EXPECT_EQ(to, (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST(V4l2Grey, grey_leaves_out_what_is_behind_a_row) {
  const Layout layout{Format::grey, 3, 2, 5, 16};
  const Bytes from = {1, 2, 3, 99, 99, 4, 5, 6};
  ASSERT_EQ(bytes_needed(layout), from.size());
  Bytes to(6);
  to_grey(layout, from.data(), to.data());
  EXPECT_EQ(to, (Bytes{1, 2, 3, 4, 5, 6}));
}

// ---- the camera ----

class V4l2Test : public testing::Test {
 protected:
  V4l2Test() {
    settings.width = 4;
    settings.height = 3;
  }
  [[nodiscard]] std::string opened() {
    camera = std::make_unique<V4l2Camera>(params, settings, clock, video);
    const auto done = camera->open();
    return done ? "" : done.error();
  }
  [[nodiscard]] bool notes_say(const std::string& what) const {
    for (const std::string& note : camera->notes()) {
      if (note.find(what) != std::string::npos) {
        return true;
      }
    }
    return false;
  }
  static Bytes picture(std::uint8_t grey) { return Bytes(12, grey); }
  // A frame later a picture is there, stamped 5 ms ago.
  void arrives(std::uint8_t grey, std::uint32_t flags = 0) {
    clock.now += kFrame_ns;
    ++sequence;
    video.fill(sequence, clock.now - 5'000'000, picture(grey), flags);
  }
  Status next() { return camera->next(frame, kTimeout_ns); }

  HandClock clock;
  tests::FakeVideo video;
  V4l2Params params;
  hal::CameraSettings settings;
  std::unique_ptr<V4l2Camera> camera;
  hal::Frame frame;
  std::uint32_t sequence = 100;
};

TEST_F(V4l2Test, a_picture_is_shown_where_the_kernel_put_it_with_its_time) {
  video.padding = 2;
  ASSERT_EQ(opened(), "");
  EXPECT_TRUE(video.streams);
  clock.now += kFrame_ns;
  const Bytes rows = {1, 2, 3, 4, 0, 0, 5, 6, 7, 8, 0, 0, 9, 10, 11, 12, 0, 0};
  ASSERT_TRUE(video.fill(7, clock.now - 3'000'000, rows));
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.width, 4);
  EXPECT_EQ(frame.height, 3);
  EXPECT_EQ(frame.stride, 6);
  EXPECT_EQ(frame.exposure_ns, clock.now - 3'000'000);
  EXPECT_EQ(frame.deliver_ns, 0);
  EXPECT_EQ(frame.pixels[2 * 6 + 3], 12);
  EXPECT_EQ(video.polled_ms, 100);
}

TEST_F(V4l2Test, only_the_newest_picture_is_shown_and_all_others_go_back) {
  ASSERT_EQ(opened(), "");
  arrives(1);
  arrives(2);
  arrives(3);
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.pixels[0], 3);
  EXPECT_EQ(camera->counts().skipped, 2U);
  EXPECT_EQ(camera->counts().lost, 0U);
  EXPECT_EQ(video.queued.size(), 3U) << "all but the one that is looked at";
  EXPECT_EQ(next(), Status::no_data);
  EXPECT_EQ(video.queued.size(), 4U);
}

TEST_F(V4l2Test, the_picture_stays_until_it_is_released) {
  ASSERT_EQ(opened(), "");
  arrives(1);
  ASSERT_EQ(next(), Status::ok);
  for (std::uint8_t grey = 50; grey < 53; ++grey) {
    arrives(grey);
  }
  EXPECT_TRUE(video.queued.empty());
  EXPECT_EQ(frame.pixels[11], 1);
  camera->release(frame);
  EXPECT_EQ(video.queued.size(), 1U);
  EXPECT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.pixels[11], 52);
}

TEST_F(V4l2Test, a_gap_in_the_kernels_count_is_a_gap_in_ours) {
  ASSERT_EQ(opened(), "");
  arrives(1);
  ASSERT_EQ(next(), Status::ok);
  const std::uint64_t first = frame.sequence;
  sequence += 4;
  arrives(2);
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.sequence, first + 5);
  EXPECT_EQ(camera->counts().lost, 4U);
  sequence = 0xffffffff;
  arrives(3);
  ASSERT_EQ(next(), Status::ok);
  const auto before = frame.sequence;
  arrives(4);
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.sequence, before + 1) << "from 2^32 - 1 to 0";
  const auto lost = camera->counts().lost;
  sequence -= 5;  // its driver counts anew, or not at all
  arrives(5);
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.sequence, before + 2);
  EXPECT_EQ(camera->counts().lost, lost);
}

TEST_F(V4l2Test, a_damaged_picture_is_a_fault_unless_a_good_one_is_there_too) {
  ASSERT_EQ(opened(), "");
  arrives(1, V4L2_BUF_FLAG_ERROR);
  EXPECT_EQ(next(), Status::fault);
  EXPECT_NE(camera->last_error().find("damaged"), std::string::npos);
  EXPECT_EQ(frame.pixels, nullptr);
  EXPECT_EQ(frame.exposure_ns, clock.now - 5'000'000);
  EXPECT_EQ(video.queued.size(), 4U);
  arrives(2);
  arrives(3, V4L2_BUF_FLAG_ERROR);
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.pixels[0], 2);
  EXPECT_EQ(camera->counts().unusable, 2U);
  EXPECT_EQ(camera->counts().delivered, 1U);
}

TEST_F(V4l2Test, a_picture_of_too_few_or_too_many_bytes_is_a_fault) {
  ASSERT_EQ(opened(), "");
  for (const std::size_t bytes : {11U, 0U, 13U}) {
    clock.now += kFrame_ns;
    ++sequence;
    ASSERT_TRUE(video.fill(sequence, clock.now, Bytes(bytes)));
    EXPECT_EQ(next(), Status::fault) << bytes;
    EXPECT_NE(camera->last_error().find("incomplete"), std::string::npos) << camera->last_error();
  }
  EXPECT_EQ(camera->counts().unusable, 3U);
  arrives(1);
  EXPECT_EQ(next(), Status::ok);
}

TEST_F(V4l2Test, a_stamp_that_cannot_be_true_is_a_fault) {
  ASSERT_EQ(opened(), "");
  arrives(1);
  ASSERT_EQ(next(), Status::ok);
  const std::int64_t before_ns = frame.exposure_ns;
  clock.now += kFrame_ns;
  video.fill(++sequence, before_ns, picture(2));
  EXPECT_EQ(next(), Status::fault) << "not later than the one before";
  clock.now += kFrame_ns;
  video.fill(++sequence, clock.now + 200'000'000, picture(3));
  EXPECT_EQ(next(), Status::fault) << "far ahead";
  clock.now += kFrame_ns;
  video.fill(++sequence, clock.now + 20'000'000, picture(4));
  ASSERT_EQ(next(), Status::ok) << "the nominal end of a frame that is here";
  EXPECT_EQ(frame.exposure_ns, clock.now) << "but no picture is of later than now";
}

TEST_F(V4l2Test, a_stamp_of_the_frames_end_is_led_back_by_exposure_and_readout) {
  video.buffer_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  video.controls[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 1000, 1, 50};
  settings.exposure_s = 10e-3;
  settings.readout_s = 7e-3;
  ASSERT_EQ(opened(), "");
  EXPECT_FALSE(notes_say("stamped at their end"));
  arrives(1);
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.exposure_ns, clock.now - 5'000'000 - 17'000'000);
  settings.readout_s = 0;
  ASSERT_EQ(opened(), "");
  EXPECT_TRUE(notes_say("late by the readout (camera.readout_ms)"));
  video.controls.clear();
  settings.exposure_s = 0;
  ASSERT_EQ(opened(), "");
  EXPECT_TRUE(notes_say("late by the exposure and the readout (camera.readout_ms)"));
}

TEST_F(V4l2Test, stamps_of_another_clock_are_refused) {
  for (const std::uint32_t flags : {V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, V4L2_BUF_FLAG_TIMESTAMP_COPY}) {
    video.buffer_flags = flags;
    EXPECT_NE(opened().find("does not stamp frames with the monotonic clock"), std::string::npos);
    EXPECT_FALSE(video.is_open);
    EXPECT_EQ(video.mapped, 0);
  }
}

TEST_F(V4l2Test, other_formats_are_converted_and_their_buffers_go_back_at_once) {
  params.format = Format::y16;
  params.bits = 12;
  ASSERT_EQ(opened(), "");
  clock.now += kFrame_ns;
  Bytes raw(24, 0);
  raw[2] = 0x80;
  raw[3] = 0x0a;  // 0x0a80 of 12 bits
  ASSERT_TRUE(video.fill(1, clock.now, raw));
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.stride, 4);
  EXPECT_EQ(frame.pixels[0], 0);
  EXPECT_EQ(frame.pixels[1], 0xa8);
  EXPECT_EQ(video.queued.size(), 4U);
}

TEST_F(V4l2Test, what_is_unplugged_is_lost_until_it_is_opened_again) {
  ASSERT_EQ(opened(), "");
  arrives(1);
  ASSERT_EQ(next(), Status::ok);
  const auto before = frame;
  video.unplugged = true;
  EXPECT_EQ(next(), Status::disconnected);
  EXPECT_NE(camera->last_error(), "");
  EXPECT_FALSE(camera->open());
  EXPECT_EQ(video.mapped, 0);
  EXPECT_EQ(next(), Status::disconnected);
  video.unplugged = false;
  ASSERT_TRUE(camera->open());
  sequence = 0;
  arrives(2);
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(frame.sequence, before.sequence + 1) << "the count goes on";
  EXPECT_EQ(camera->counts().delivered, 2U);
}

TEST_F(V4l2Test, each_sign_of_a_lost_camera_is_taken_for_it) {
  for (const short event : {short{POLLERR}, short{POLLHUP}, short{POLLNVAL}}) {
    ASSERT_EQ(opened(), "");
    arrives(1);
    video.events = event;
    EXPECT_EQ(next(), Status::disconnected) << event;
    video.events = 0;
  }
  for (const int error : {ENODEV, EIO, EINVAL}) {
    ASSERT_EQ(opened(), "");
    arrives(1);
    video.errors[VIDIOC_DQBUF] = error;
    EXPECT_EQ(next(), Status::disconnected) << error;
    video.errors.clear();
  }
  ASSERT_EQ(opened(), "");
  video.poll_error = EBADF;
  EXPECT_EQ(next(), Status::disconnected);
  video.poll_error = EINTR;
  EXPECT_EQ(next(), Status::no_data) << "a signal is no loss";
}

TEST_F(V4l2Test, a_buffer_that_the_kernel_refuses_is_offered_again) {
  ASSERT_EQ(opened(), "");
  arrives(1);
  ASSERT_EQ(next(), Status::ok);
  video.refusals_of_qbuf = 1;
  camera->release(frame);
  EXPECT_EQ(video.queued.size(), 3U);
  EXPECT_EQ(next(), Status::no_data);
  EXPECT_EQ(video.queued.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    arrives(2);
  }
  video.errors[VIDIOC_QBUF] = EINVAL;
  EXPECT_EQ(next(), Status::ok);
  EXPECT_EQ(next(), Status::disconnected) << "it takes none at all";
}

TEST_F(V4l2Test, a_kernel_that_invents_buffers_is_not_believed) {
  ASSERT_EQ(opened(), "");
  v4l2_buffer invented{};
  invented.index = 4;
  video.filled.push_back(invented);
  EXPECT_EQ(next(), Status::disconnected);
  ASSERT_EQ(opened(), "");
  arrives(1);
  video.filled.push_back(video.filled.front());
  EXPECT_EQ(next(), Status::disconnected) << "the same one twice";
}

TEST_F(V4l2Test, exposure_and_gain_are_locked_as_the_scene_says) {
  video.controls[V4L2_CID_EXPOSURE_AUTO] = {0, 3, 1, V4L2_EXPOSURE_APERTURE_PRIORITY};
  video.controls[V4L2_CID_EXPOSURE_AUTO_PRIORITY] = {0, 1, 1, 1};
  video.controls[V4L2_CID_EXPOSURE_ABSOLUTE] = {3, 2047, 4, 250};
  video.controls[V4L2_CID_AUTOGAIN] = {0, 1, 1, 1};
  video.controls[V4L2_CID_GAIN] = {0, 100, 1, 50};
  settings.exposure_s = 12.5e-3;
  settings.gain = 20;
  ASSERT_EQ(opened(), "");
  EXPECT_EQ(video.controls[V4L2_CID_EXPOSURE_AUTO].value, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(video.controls[V4L2_CID_EXPOSURE_AUTO_PRIORITY].value, 0);
  EXPECT_EQ(video.controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 127) << "12.5 ms on a grid of 0.4 from 0.3";
  EXPECT_EQ(video.controls[V4L2_CID_AUTOGAIN].value, 0);
  EXPECT_EQ(video.controls[V4L2_CID_GAIN].value, 20);
  EXPECT_TRUE(camera->notes().empty());
  settings.exposure_s = 0;
  settings.gain = hal::kAsItIs;
  ASSERT_EQ(opened(), "");
  EXPECT_EQ(video.controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 127) << "as it is";
  EXPECT_EQ(video.controls[V4L2_CID_GAIN].value, 20);
}

TEST_F(V4l2Test, a_control_that_is_not_there_is_an_error_only_if_the_scene_asks_for_it) {
  ASSERT_EQ(opened(), "");
  EXPECT_TRUE(notes_say("no exposure to lock"));
  EXPECT_TRUE(notes_say("no gain to lock"));
  settings.exposure_s = 10e-3;
  EXPECT_EQ(opened(),
            "/dev/video0: camera.exposure_ms: it cannot be set on this camera, allowed: leave it out (as it "
            "is)");
  video.controls[V4L2_CID_EXPOSURE_ABSOLUTE] = {10, 200, 1, 50};
  EXPECT_EQ(opened(), "");
  settings.exposure_s = 30e-3;
  EXPECT_EQ(opened(), "/dev/video0: camera.exposure_ms: is out of range, allowed: from 1 to 20");
  settings.exposure_s = 10e-3;
  settings.gain = 3;
  EXPECT_NE(opened().find("camera.gain: it cannot be set"), std::string::npos);
  video.controls[V4L2_CID_GAIN] = {0, 2, 1, 0};
  EXPECT_EQ(opened(), "/dev/video0: camera.gain: is out of range, allowed: from 0 to 2");
  video.controls[V4L2_CID_GAIN] = {0, 20, 1, 0, V4L2_CTRL_FLAG_READ_ONLY};
  EXPECT_NE(opened().find("camera.gain: it cannot be set"), std::string::npos);
  video.controls[V4L2_CID_GAIN] = {0, 20, 1, 0, V4L2_CTRL_FLAG_DISABLED};
  EXPECT_NE(opened().find("camera.gain: it cannot be set"), std::string::npos);
}

TEST_F(V4l2Test, a_control_that_does_not_keep_its_value_is_noticed) {
  video.controls[V4L2_CID_GAIN] = {0, 20, 1, 5};
  video.controls[V4L2_CID_GAIN].keeps = false;
  settings.gain = 7;
  EXPECT_EQ(opened(), "/dev/video0: camera.gain: it does not keep what it is set to");
  settings.gain = hal::kAsItIs;
  video.controls[V4L2_CID_EXPOSURE_AUTO] = {0, 3, 1, V4L2_EXPOSURE_AUTO};
  video.controls[V4L2_CID_EXPOSURE_AUTO].keeps = false;
  ASSERT_EQ(opened(), "");
  EXPECT_TRUE(notes_say("its exposure stays automatic"));
}

TEST_F(V4l2Test, a_camera_does_not_sharpen_or_bend_its_pictures) {
  const auto as_bought = [&] {
    video.controls[V4L2_CID_SHARPNESS] = {1, 7, 1, 3};
    video.controls[V4L2_CID_GAMMA] = {72, 500, 1, 220};
    video.controls[V4L2_CID_BACKLIGHT_COMPENSATION] = {0, 2, 1, 1};
  };
  as_bought();
  ASSERT_EQ(opened(), "");
  EXPECT_EQ(video.controls[V4L2_CID_SHARPNESS].value, 1);
  EXPECT_EQ(video.controls[V4L2_CID_GAMMA].value, 100);
  EXPECT_EQ(video.controls[V4L2_CID_BACKLIGHT_COMPENSATION].value, 0);
  EXPECT_TRUE(notes_say("its sharpness is set from 3 to 1"));
  EXPECT_TRUE(notes_say("its gamma is set from 220 to 100"));
  ASSERT_EQ(opened(), "");
  EXPECT_FALSE(notes_say("sharpness")) << "nothing to do";

  as_bought();
  video.driver = "another";
  video.controls[V4L2_CID_SHARPNESS].keeps = false;
  ASSERT_EQ(opened(), "");
  EXPECT_EQ(video.controls[V4L2_CID_GAMMA].value, 220) << "in a unit that is not known";
  EXPECT_TRUE(notes_say("its sharpness stays 3, not 1"));

  video.driver = "uvcvideo";
  video.controls[V4L2_CID_GAMMA] = {110, 500, 1, 220};
  ASSERT_EQ(opened(), "");
  EXPECT_TRUE(notes_say("its gamma stays 220, not 100"));
}

TEST_F(V4l2Test, what_it_cannot_do_is_one_line) {
  video.formats = {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV};
  EXPECT_EQ(opened(), "/dev/video0: v4l2.format: it does not give GREY, it offers: MJPG, YUYV");
  params.format = Format::yuyv;
  EXPECT_EQ(opened(), "");
  settings.width = 8;
  EXPECT_EQ(opened(),
            "/dev/video0: camera.width_px and height_px: it does not give 8 x 3 px, nearest: 4 x 3");
  settings.width = 4;
  settings.height = 4;
  EXPECT_NE(opened().find("it does not give 4 x 4 px"), std::string::npos);
  settings.height = 3;
  settings.fps = 30;
  EXPECT_EQ(opened(), "/dev/video0: camera.fps: it does not give 30, nearest: 25");
  settings.fps = 25.05;
  EXPECT_EQ(opened(), "");
  video.has_rate = false;
  EXPECT_EQ(opened(), "/dev/video0: camera.fps: its frame rate cannot be set, allowed: 0 (as it is)");
  settings.fps = 0;
  video.field = V4L2_FIELD_INTERLACED;
  EXPECT_EQ(opened(), "/dev/video0: its pictures are interlaced, allowed: progressive ones");
  video.field = V4L2_FIELD_NONE;
  video.row_says = 7;
  EXPECT_EQ(opened(), "/dev/video0: its driver says that a row of 4 px has 7 bytes");
  video.row_says = 0;
  video.buffer_bytes = 23;
  EXPECT_EQ(opened(), "/dev/video0: its buffers have 23 bytes, a picture needs 24");
  video.buffer_bytes = 0;
  video.buffer_count = 1;
  EXPECT_EQ(opened(), "/dev/video0: it gives 1 buffers, needed: at least 2");
  video.buffer_count = 4;
  video.maps = false;
  EXPECT_EQ(opened(), "/dev/video0: its buffers cannot be mapped");
  video.maps = true;
  video.capabilities = V4L2_CAP_VIDEO_CAPTURE;
  EXPECT_NE(opened().find("cannot stream"), std::string::npos);
  video.capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  EXPECT_NE(opened().find("gives no pictures"), std::string::npos);
  video.capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  EXPECT_NE(opened().find("several planes"), std::string::npos);
  EXPECT_FALSE(video.is_open);
  EXPECT_EQ(video.mapped, 0);
}

TEST_F(V4l2Test, a_kernel_that_refuses_says_why_in_one_line) {
  struct Case {
    unsigned long request;
    int error;
    const char* line;
  };
  const Case cases[] = {
      {VIDIOC_QUERYCAP, ENOTTY, "/dev/video0: is no video device"},
      {VIDIOC_S_FMT, EBUSY, "/dev/video0: another program uses it"},
      {VIDIOC_REQBUFS, ENOMEM, "/dev/video0: it gives no buffers: Cannot allocate memory"},
      {VIDIOC_QUERYBUF, EINVAL, "/dev/video0: it does not say where its buffers are: Invalid argument"},
      {VIDIOC_QBUF, EINVAL, "/dev/video0: it does not take its buffers: Invalid argument"},
      {VIDIOC_STREAMON, ENOSPC,
       "/dev/video0: it does not stream: its bus has no room for this size and frame rate"},
  };
  for (const Case& c : cases) {
    video.errors = {{c.request, c.error}};
    EXPECT_EQ(opened(), c.line);
    EXPECT_FALSE(video.is_open);
    EXPECT_EQ(video.mapped, 0);
  }
  video.errors.clear();
  video.open_error = ENOENT;
  EXPECT_EQ(opened(), "/dev/video0: no such camera is plugged in");
  video.open_error = EACCES;
  EXPECT_EQ(opened(), "/dev/video0: may not be opened: add the user to the group of the device (video)");
}

TEST_F(V4l2Test, nothing_is_left_behind) {
  ASSERT_EQ(opened(), "");
  arrives(1);
  ASSERT_EQ(next(), Status::ok);
  EXPECT_EQ(video.mapped, 4);
  camera.reset();
  EXPECT_EQ(video.mapped, 0);
  EXPECT_FALSE(video.is_open);
}

}  // namespace
}  // namespace punctum::v4l2
