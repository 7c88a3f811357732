// The backend v4l2 on the kernel's virtual camera: behind its device file all of the kernel's video code is
// real. The guest's time follows the instructions it executes (toolchain/rt-guest/run --deterministic).
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>
#include <thread>

#include "hal/v4l2/v4l2_camera.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "tests/loopback/vivid_loop.hpp"

namespace punctum::loopback {
namespace {

using hal::Status;
using v4l2::V4l2Camera;
using v4l2::V4l2Params;
using Format = V4l2Params::Format;

constexpr std::int64_t kLong_ns = 1'000'000'000;

void wait_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

bool says(const std::vector<std::string>& lines, const std::string& what) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string& line) { return line.find(what) != std::string::npos; });
}

// The camera as it is after the driver was loaded, and 25 pictures a second of 640 x 480.
class CameraLoopback : public testing::Test {
 protected:
  CameraLoopback() {
    params.path = vivid.path();
    settings.width = 640;
    settings.height = 480;
    settings.fps = 25;
  }
  ~CameraLoopback() override {
    camera.reset();
    vivid.set("Percentage of Dropped Buffers", 0);
    vivid.set("Timestamp Source", 0);
    vivid.set("Wrap Timestamp", 0);
    vivid.set("Wrap Sequence Number", 0);
    vivid.set("Test Pattern", 0);
    vivid.set("OSD Text Mode", 0);
  }
  [[nodiscard]] std::string opened() {
    camera = std::make_unique<V4l2Camera>(params, settings, clock);
    const auto done = camera->open();
    return done ? "" : done.error();
  }
  // The next picture that is usable.
  [[nodiscard]] Status good_frame() {
    Status status = Status::no_data;
    for (int i = 0; i < 20; ++i) {
      status = camera->next(frame, kLong_ns);
      if (status == Status::ok) {
        break;
      }
    }
    return status;
  }
  [[nodiscard]] std::vector<std::uint8_t> pixels() const {
    std::vector<std::uint8_t> all;
    for (int y = 0; y < frame.height; ++y) {
      const std::uint8_t* const row = frame.pixels + static_cast<std::ptrdiff_t>(y) * frame.stride;
      all.insert(all.end(), row, row + frame.width);
    }
    return all;
  }

  rt::MonotonicClock clock;
  VividNode vivid{V4L2_CAP_VIDEO_CAPTURE};
  V4l2Params params;
  hal::CameraSettings settings;
  std::unique_ptr<V4l2Camera> camera;
  hal::Frame frame;
};

TEST_F(CameraLoopback, frames_come_at_their_rate_each_stamped_before_it_was_here) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  const hal::Frame first = frame;
  const hal::CameraCounts begun = camera->counts();
  std::int64_t before_ns = first.exposure_ns;
  for (int i = 1; i <= 25; ++i) {
    ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok) << camera->last_error();
    EXPECT_EQ(frame.sequence, first.sequence + static_cast<std::uint64_t>(i));
    EXPECT_EQ(frame.width, 640);
    EXPECT_EQ(frame.height, 480);
    EXPECT_GT(frame.exposure_ns, before_ns);
    EXPECT_LE(frame.exposure_ns, clock.now_ns());
    before_ns = frame.exposure_ns;
    camera->release(frame);
  }
  EXPECT_NEAR(static_cast<double>(frame.exposure_ns - first.exposure_ns) * 1e-9, 1.0, 0.04);
  EXPECT_EQ(camera->counts().lost, begun.lost);
  EXPECT_EQ(camera->counts().skipped, begun.skipped);
  EXPECT_EQ(camera->counts().unusable, begun.unusable);
}

TEST_F(CameraLoopback, all_formats_show_the_same_picture) {
  vivid.set("OSD Text Mode", 2);
  vivid.set("Test Pattern", 20);        // a grey ramp
  vivid.set("Horizontal Movement", 3);  // none
  vivid.set("Vertical Movement", 3);
  params.format = Format::grey;
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  const auto grey = pixels();
  params.format = Format::y16;
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  EXPECT_EQ(pixels(), grey);
  params.format = Format::yuyv;
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  const auto yuyv = pixels();
  ASSERT_EQ(yuyv.size(), grey.size());
  // A ramp from black to white; ITU-R BT.601 codes brightness in 16 .. 235.
  for (std::size_t i = 0; i < grey.size(); ++i) {
    ASSERT_NEAR(yuyv[i], 16 + grey[i] * 219.0 / 255, 1) << "pixel " << i;
  }
  EXPECT_EQ(*std::min_element(grey.begin(), grey.end()), 0);
  EXPECT_GT(*std::max_element(grey.begin(), grey.end()), 250);
}

TEST_F(CameraLoopback, dropped_frames_are_gaps_in_the_count) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  const std::uint64_t first = frame.sequence;
  const hal::CameraCounts begun = camera->counts();
  vivid.set("Percentage of Dropped Buffers", 40);
  std::uint64_t seen = 0;
  for (int i = 0; i < 40; ++i) {
    if (camera->next(frame, kLong_ns) == Status::ok) {
      ++seen;
      camera->release(frame);
    }
  }
  EXPECT_EQ(frame.sequence - first,
            seen + camera->counts().lost - begun.lost + camera->counts().skipped - begun.skipped);
  EXPECT_GT(camera->counts().lost, 5U);
  EXPECT_EQ(camera->counts().unusable, 0U);
}

TEST_F(CameraLoopback, who_comes_late_gets_the_newest_frame) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  const std::uint64_t before = frame.sequence;
  const hal::CameraCounts begun = camera->counts();
  camera->release(frame);
  wait_ms(130);  // three frames of 40 ms
  ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok);
  EXPECT_GE(frame.sequence, before + 3);
  EXPECT_LT(clock.now_ns() - frame.exposure_ns, 70'000'000) << "not the newest";
  const hal::CameraCounts& now = camera->counts();
  EXPECT_EQ(now.skipped - begun.skipped + now.lost - begun.lost, frame.sequence - before - 1);
}

TEST_F(CameraLoopback, a_picture_stays_as_it_is_while_it_is_looked_at) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  const auto before = pixels();
  wait_ms(300);  // the pattern moves, and all other buffers were filled
  EXPECT_EQ(pixels(), before);
}

TEST_F(CameraLoopback, a_damaged_buffer_is_a_fault_and_the_next_frame_is_good) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  camera->release(frame);
  vivid.set("Inject V4L2_BUF_FLAG_ERROR", 1);
  int faults = 0;
  for (int i = 0; i < 5; ++i) {
    if (camera->next(frame, kLong_ns) == Status::fault) {
      ++faults;
      EXPECT_NE(camera->last_error().find("damaged"), std::string::npos) << camera->last_error();
    }
    camera->release(frame);
  }
  EXPECT_EQ(faults, 1);
  EXPECT_EQ(camera->counts().unusable, 1U);
  EXPECT_EQ(camera->next(frame, kLong_ns), Status::ok);
}

TEST_F(CameraLoopback, a_camera_that_stalls_is_silent_and_comes_back) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  vivid.set("Percentage of Dropped Buffers", 100);
  wait_ms(100);
  (void)camera->next(frame, 1);
  for (int i = 0; i < 3; ++i) {
    const std::int64_t before_ns = clock.now_ns();
    EXPECT_EQ(camera->next(frame, 100'000'000), Status::no_data);
    EXPECT_GE(clock.now_ns() - before_ns, 100'000'000);
    EXPECT_LT(clock.now_ns() - before_ns, 110'000'000);
  }
  vivid.set("Percentage of Dropped Buffers", 0);
  EXPECT_EQ(camera->next(frame, kLong_ns), Status::ok);
}

// The button takes the device away; it is back once nobody has it open any more.
TEST_F(CameraLoopback, an_unplugged_camera_is_lost_at_once_and_can_be_opened_again_after_its_return) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  vivid.set("Disconnect", 1);
  const std::int64_t before_ns = clock.now_ns();
  EXPECT_EQ(camera->next(frame, kLong_ns), Status::disconnected);
  EXPECT_LT(clock.now_ns() - before_ns, 10'000'000);
  EXPECT_EQ(camera->next(frame, kLong_ns), Status::disconnected) << "until it is opened again";
  const auto still_gone = camera->open();
  ASSERT_FALSE(still_gone);
  EXPECT_NE(still_gone.error().find("no such camera is plugged in"), std::string::npos) << still_gone.error();
  vivid.close();
  vivid.reopen();
  const auto back = camera->open();
  ASSERT_TRUE(back) << back.error();
  EXPECT_EQ(good_frame(), Status::ok);
}

TEST_F(CameraLoopback, a_stream_that_breaks_down_is_lost_and_streams_again_after_it_is_opened) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  vivid.set("Inject Fatal Streaming Error", 1);
  EXPECT_EQ(camera->next(frame, kLong_ns), Status::disconnected);
  const auto again = camera->open();
  ASSERT_TRUE(again) << again.error();
  EXPECT_EQ(good_frame(), Status::ok);
}

TEST_F(CameraLoopback, a_driver_that_fails_while_it_is_set_up_is_one_line) {
  vivid.set("Inject VIDIOC_REQBUFS Error", 1);
  EXPECT_NE(opened().find("it gives no buffers"), std::string::npos);
  vivid.set("Inject VIDIOC_STREAMON Error", 1);
  EXPECT_NE(opened().find("it does not stream"), std::string::npos);
  vivid.set("Inject VIDIOC_QBUF Error", 1);
  EXPECT_NE(opened().find("it does not take its buffers"), std::string::npos);
  EXPECT_EQ(opened(), "");
}

TEST_F(CameraLoopback, a_buffer_that_is_refused_once_is_offered_again) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  vivid.set("Inject VIDIOC_QBUF Error", 1);
  camera->release(frame);
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok) << camera->last_error();
    camera->release(frame);
  }
}

TEST_F(CameraLoopback, gain_is_locked_and_read_back_and_exposure_is_said_not_to_be_there) {
  vivid.set("Gain, Automatic", 1);
  settings.gain = 77;
  ASSERT_EQ(opened(), "");
  EXPECT_EQ(vivid.get("Gain, Automatic"), 0);
  EXPECT_EQ(vivid.get("Gain"), 77);
  EXPECT_TRUE(says(camera->notes(), "no exposure to lock"));
  settings.gain = 300;
  EXPECT_NE(opened().find("camera.gain: is out of range, allowed: from 0 to 255"), std::string::npos);
  settings.gain = hal::kAsItIs;
  settings.exposure_s = 0.01;
  EXPECT_NE(opened().find("camera.exposure_ms: it cannot be set on this camera"), std::string::npos);
}

TEST_F(CameraLoopback, a_stamp_of_the_exposure_is_taken_and_one_of_the_frames_end_is_said) {
  vivid.set("Timestamp Source", 1);
  ASSERT_EQ(opened(), "");
  EXPECT_FALSE(says(camera->notes(), "stamped at their end"));
  ASSERT_EQ(good_frame(), Status::ok);
  vivid.set("Timestamp Source", 0);
  ASSERT_EQ(opened(), "");
  EXPECT_TRUE(says(camera->notes(), "stamped at their end"));
}

TEST_F(CameraLoopback, a_stamp_of_another_clock_is_no_time) {
  vivid.set("Wrap Timestamp", 2);  // years ahead
  ASSERT_EQ(opened(), "");
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(camera->next(frame, kLong_ns), Status::fault);
    EXPECT_NE(camera->last_error().find("ahead of the clock"), std::string::npos) << camera->last_error();
  }
  EXPECT_EQ(camera->counts().delivered, 0U);
}

TEST_F(CameraLoopback, the_count_goes_on_where_the_drivers_wraps) {
  vivid.set("Wrap Sequence Number", 1);
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok);
  std::uint64_t before = frame.sequence;
  for (int i = 0; i < 150; ++i) {  // it begins 128 before the wrap
    camera->release(frame);
    ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok);
    ASSERT_EQ(frame.sequence, before + 1);
    before = frame.sequence;
  }
  EXPECT_EQ(camera->counts().lost, 0U);
}

TEST_F(CameraLoopback, what_it_cannot_do_is_one_line) {
  settings.width = 641;
  EXPECT_NE(opened().find("it does not give 641 x 480 px, nearest: 640 x 480"), std::string::npos);
  settings.width = 640;
  settings.fps = 29;
  EXPECT_NE(opened().find("camera.fps: it does not give 29, nearest: "), std::string::npos);
  settings.fps = 25;
  params.path = "/dev/video99";
  EXPECT_EQ(opened(), "/dev/video99: no such camera is plugged in");
  params.path = "/dev/null";
  EXPECT_EQ(opened(), "/dev/null: is no video device");
  params.path = VividNode(V4L2_CAP_VIDEO_OUTPUT).path();
  EXPECT_NE(opened().find("gives no pictures"), std::string::npos);
  params.path = vivid.path();
  ASSERT_EQ(opened(), "");
  V4l2Camera second(params, settings, clock);
  const auto busy = second.open();
  ASSERT_FALSE(busy);
  EXPECT_EQ(busy.error(), vivid.path() + ": another program uses it");
  EXPECT_EQ(good_frame(), Status::ok);
}

TEST_F(CameraLoopback, what_is_shown_on_the_output_comes_back_bit_for_bit) {
  struct Size {
    int width, height, fps;
  };
  for (const Size size : {Size{727, 485, 25}, Size{640, 480, 50}}) {
    VividLoop loop(size.width, size.height, size.fps);
    settings.width = size.width;
    settings.height = size.height;
    settings.fps = size.fps;
    ASSERT_EQ(opened(), "");
    std::mt19937 random(1);
    std::vector<std::uint8_t> picture(static_cast<std::size_t>(size.width) *
                                      static_cast<std::size_t>(size.height));
    int latest = 0;
    for (int shown = 0; shown < 8; ++shown) {
      for (std::uint8_t& pixel : picture) {
        pixel = static_cast<std::uint8_t>(random());
      }
      loop.show(picture);
      int frames = 1;  // until it is back
      for (; frames <= 10; ++frames) {
        ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok) << camera->last_error();
        auto back = pixels();
        for (std::size_t at = picture.size(); size.width % 2 != 0 && at > 0;
             at -= static_cast<std::size_t>(size.width)) {
          back[at - 1] = picture[at - 1];
        }
        if (back == picture) {
          break;
        }
      }
      latest = std::max(latest, frames);
      ASSERT_LE(frames, 10) << "picture " << shown << " never came back";
    }
    std::printf("loop %d x %d at %d/s: a picture is back after at most %d frames\n", size.width, size.height,
                size.fps, latest);
    camera.reset();
  }
}

}  // namespace
}  // namespace punctum::loopback
