// The backend aravis against the library's own cameras: one inside it, and one that speaks GigE Vision over
// the loopback interface. Both are foreign to this tree.
#include <arv.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hal/aravis/module.hpp"
#include "hal/aravis/stamps.hpp"
#include "rt/executive/monotonic_clock.hpp"
#include "tests/support/network_camera.hpp"

namespace punctum::aravis {
namespace {

using hal::Status;

constexpr std::int64_t kLong_ns = 2'000'000'000;

TEST(AravisStamps, a_clock_that_is_elsewhere_is_seen_through_the_jitter_of_arrivals) {
  for (const int drift_ppm : {-100, 100}) {
    CameraClock clock;
    constexpr std::int64_t kApart_ns = 123'456'789'000, kFastest_ns = 2'000'000;
    std::int64_t worst_ns = 0;
    for (int i = 0; i < 1500; ++i) {
      const std::int64_t run_ns = i * std::int64_t{40'000'000};
      const std::int64_t true_ns = 1'000'000'000'000 + run_ns;
      const std::int64_t stamp_ns = true_ns - kApart_ns + run_ns / 1'000'000 * drift_ppm;
      const std::int64_t late_ns = kFastest_ns + (i * 7919) % 30 * 1'000'000;
      const std::int64_t seen_ns = clock.on_station_ns(stamp_ns, true_ns + late_ns);
      if (i > 30) {
        worst_ns = std::max(worst_ns, std::abs(seen_ns - true_ns - kFastest_ns));
      }
    }
    EXPECT_LT(worst_ns, 1'200'000) << drift_ppm << " ppm";
  }
}

TEST(AravisStamps, a_clock_that_is_set_anew_is_followed_at_once) {
  CameraClock clock;
  EXPECT_EQ(clock.on_station_ns(1'000'000'000, 50'000'000'000), 50'000'000'000);
  EXPECT_EQ(clock.on_station_ns(1'040'000'000, 50'050'000'000), 50'040'000'000);
  EXPECT_EQ(clock.on_station_ns(0, 50'080'000'000), 50'080'000'000);
  EXPECT_EQ(clock.on_station_ns(40'000'000, 50'130'000'000), 50'120'000'000);
}

// By up to a second ahead, in the middle of a run and as its first stamp. What is given for that one is
// refused as ahead of the clock; here only that the others are right.
TEST(AravisStamps, one_stamp_that_jumps_ahead_makes_no_other_frame_older) {
  constexpr std::int64_t kApart_ns = 123'456'789'000, kFastest_ns = 2'000'000, kFrame_ns = 40'000'000;
  for (const std::int64_t ahead_ns : {30'000'000, 300'000'000, 999'000'000, 1'500'000'000}) {
    for (const int at : {0, 100}) {
      CameraClock clock;
      for (int i = 0; i < 600; ++i) {
        const std::int64_t true_ns = 1'000'000'000'000 + i * kFrame_ns;
        const std::int64_t late_ns = kFastest_ns + i % 3 * 1'000'000;
        const std::int64_t seen_ns =
            clock.on_station_ns(true_ns - kApart_ns + (i == at ? ahead_ns : 0), true_ns + late_ns);
        if (i != at) {
          EXPECT_GE(seen_ns, true_ns + kFastest_ns) << ahead_ns << ' ' << i;
          EXPECT_LE(seen_ns, true_ns + late_ns) << ahead_ns << ' ' << i;
        }
      }
    }
  }
}

TEST(AravisStamps, a_clock_that_goes_on_ahead_is_followed_from_the_second_frame_on) {
  CameraClock clock;
  constexpr std::int64_t kFrame_ns = 40'000'000, kAhead_ns = 500'000'000;
  for (int i = 0; i < 400; ++i) {
    const std::int64_t arrival_ns = i * kFrame_ns;
    const std::int64_t seen_ns = clock.on_station_ns(arrival_ns + (i >= 200 ? kAhead_ns : 0), arrival_ns);
    if (i != 200) {
      EXPECT_EQ(seen_ns, arrival_ns) << i;
    }
  }
}

// Set ahead by 200 ms while a frame waits for 3 ms, which would else count as 203 ms old: then for a second
// every frame counts as of now, and after it by the wall clock again.
TEST(AravisStamps, a_wall_clock_that_is_set_makes_no_frame_older) {
  WallClock wall;
  constexpr std::int64_t kMs = 1'000'000, kApart = 5'000'000 * kMs;
  const auto ago_ms = [&](std::int64_t now_ms, std::int64_t waited_ms, std::int64_t before_ms,
                          std::int64_t ahead_ms) {
    return wall.ago_ns((now_ms - waited_ms + before_ms) * kMs + kApart, (now_ms + ahead_ms) * kMs + kApart,
                       now_ms * kMs) /
           kMs;
  };
  EXPECT_EQ(ago_ms(1000, 3, 0, 0), 3);
  EXPECT_EQ(ago_ms(1040, 3, 0, 200), 0);
  EXPECT_EQ(ago_ms(1080, 3, 200, 200), 0) << "one that waited longer may be from before";
  EXPECT_EQ(ago_ms(2100, 3, 200, 200), 3);
  EXPECT_EQ(ago_ms(2140, 3, 200, -500), 0) << "set back";
}

TEST(AravisStamps, what_is_missing_is_counted_over_the_wrap_of_16_bits_which_leaves_out_zero) {
  EXPECT_EQ(frames_between(1, 2), 0U);
  EXPECT_EQ(frames_between(10, 14), 3U);
  EXPECT_EQ(frames_between(65535, 1), 0U);
  EXPECT_EQ(frames_between(65534, 1), 1U);
  EXPECT_EQ(frames_between(65533, 3), 4U);
  EXPECT_EQ(frames_between(65535, 65536), 0U) << "64 bits";
  EXPECT_EQ(frames_between(500, 1), 0U) << "it has started anew";
  EXPECT_EQ(frames_between(7, 7), 0U);
}

class AravisTest : public testing::Test {
 protected:
  AravisTest() {
    params.name = "Fake_1";
    settings.width = 320;
    settings.height = 240;
    settings.fps = 100;
  }
  [[nodiscard]] std::string opened() {
    camera.reset(punctum_make_aravis_camera(params, settings, clock));
    const auto done = camera->open();
    return done ? "" : done.error();
  }
  // A busy machine may lose packets, or be late for a frame.
  [[nodiscard]] Status good_frame() {
    Status status = Status::no_data;
    for (int i = 0; i < 20 && status != Status::ok && status != Status::disconnected; ++i) {
      status = camera->next(frame, kLong_ns);
    }
    return status;
  }
  [[nodiscard]] bool notes_say(const std::string& what) const {
    for (const std::string& note : camera->notes()) {
      if (note.find(what) != std::string::npos) {
        return true;
      }
    }
    return false;
  }

  rt::MonotonicClock clock;
  AravisParams params;
  hal::CameraSettings settings;
  std::unique_ptr<hal::LiveCamera> camera;
  hal::Frame frame;
};

TEST_F(AravisTest, frames_come_counted_and_stamped_on_the_stations_clock) {
  settings.exposure_s = 1e-3;
  ASSERT_EQ(opened(), "");
  const std::int64_t opened_ns = clock.now_ns();
  std::uint64_t sequence = 0;
  std::int64_t before_ns = 0;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok) << camera->last_error();
    EXPECT_GT(frame.sequence, sequence);
    EXPECT_GT(frame.exposure_ns, before_ns);
    EXPECT_LE(frame.exposure_ns, clock.now_ns());
    EXPECT_GT(frame.exposure_ns, opened_ns - 100'000'000);
    EXPECT_EQ(frame.width, 320);
    EXPECT_EQ(frame.height, 240);
    sequence = frame.sequence;
    before_ns = frame.exposure_ns;
  }
  EXPECT_EQ(camera->counts().unusable, 0U);
  EXPECT_EQ(camera->counts().delivered, 20U);
  EXPECT_EQ(sequence, 20 + camera->counts().lost + camera->counts().skipped);
}

// The library draws grey = (x + frame number + y) modulo 255 (arvfakecamera.c).
TEST_F(AravisTest, the_pixels_are_those_of_the_camera) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok);
  const int corner = frame.pixels[0];
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      ASSERT_EQ(frame.pixels[y * frame.stride + x], (corner + x + y) % 255) << x << ", " << y;
    }
  }
}

// Its ramp of 16 bits grows by 256 from pixel to pixel.
TEST_F(AravisTest, of_16_bits_the_upper_eight_are_grey) {
  params.format = AravisParams::Format::mono16;
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok) << camera->last_error();
  EXPECT_EQ(frame.stride, 320);
  int steps = 0;
  for (int x = 1; x < frame.width; ++x) {
    steps += (frame.pixels[x] - frame.pixels[x - 1] + 256) % 256 == 1 ? 1 : 0;
  }
  EXPECT_GE(steps, 316) << "of 319, but where it wraps";
}

TEST_F(AravisTest, who_comes_late_gets_the_newest_frame) {
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok);
  const std::uint64_t before = frame.sequence;
  camera->release(frame);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  ASSERT_EQ(camera->next(frame, kLong_ns), Status::ok);
  EXPECT_GE(frame.sequence, before + 4);
  EXPECT_GE(camera->counts().skipped + camera->counts().lost, 3U);
  EXPECT_EQ(frame.sequence, camera->counts().delivered + camera->counts().skipped + camera->counts().lost);
}

TEST_F(AravisTest, exposure_and_gain_are_locked_or_refused_in_one_line) {
  settings.exposure_s = 5e-3;
  settings.gain = 4;
  ASSERT_EQ(opened(), "");
  EXPECT_TRUE(notes_say("late by the readout and transfer"));
  settings.gain = 11;
  EXPECT_EQ(opened(), "Fake_1: camera.gain: is out of range, allowed: from 0 to 10");
  settings.gain = hal::kAsItIs;
  settings.exposure_s = 11;
  EXPECT_EQ(opened(), "Fake_1: camera.exposure_ms: is out of range, allowed: from 0.01 to 10000");
}

TEST_F(AravisTest, what_it_cannot_do_is_one_line) {
  params.format = AravisParams::Format::mono12;
  EXPECT_EQ(opened().find("Fake_1: aravis.format: it does not give Mono12, it offers: "), 0U);
  params.format = AravisParams::Format::mono8;
  settings.width = 4000;
  EXPECT_EQ(
      opened().find("Fake_1: camera.width_px and height_px: it does not give 4000 x 240 px, allowed: up to "
                    "2048 x 2048"),
      0U);
  settings.width = 320;
  params.name = "Fake_7";
  EXPECT_EQ(opened().find("Fake_7: no such camera is found ("), 0U);
  EXPECT_EQ(camera->next(frame, 1), Status::disconnected);
}

// ---- over the network ----

TEST_F(AravisTest, a_camera_on_the_network_is_listed_and_whoever_streams_from_it_goes_on) {
  const tests::NetworkCameraLock one_at_a_time;
  const auto here = [] {
    std::vector<NetworkCamera> found;
    punctum_list_network_cameras(found);
    std::erase_if(found, [](const NetworkCamera& one) { return one.address != "127.0.0.1"; });
    return found;
  };
  EXPECT_TRUE(here().empty());
  tests::NetworkCamera there = tests::plug_in_network_camera();
  params.name = "127.0.0.1";
  settings.fps = 25;
  ASSERT_EQ(opened(), "");
  ASSERT_EQ(good_frame(), Status::ok) << camera->last_error();
  const auto found = here();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].name, "Aravis-Fake-GV01");
  EXPECT_EQ(found[0].maker, "Aravis");
  EXPECT_EQ(found[0].serial, "GV01");
  EXPECT_EQ(found[0].model, "Fake");
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(good_frame(), Status::ok) << camera->last_error();
  }
  for (const char* name : {"Aravis-Fake-GV01", "Aravis-GV01"}) {
    params.name = name;
    ASSERT_EQ(opened(), "") << "with the model in its name and without";
  }
  camera.reset();
  there.reset();
  EXPECT_TRUE(here().empty()) << "of one that has gone nothing is kept";
}

TEST_F(AravisTest, a_camera_on_the_network_is_lost_when_it_goes_and_can_be_opened_when_it_is_back) {
  const tests::NetworkCameraLock one_at_a_time;
  tests::NetworkCamera there = tests::plug_in_network_camera();
  params.name = "127.0.0.1";
  settings.fps = 25;
  ASSERT_EQ(opened(), "");
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(good_frame(), Status::ok) << camera->last_error();
  }
  std::this_thread::sleep_for(
      std::chrono::milliseconds(1500));  // 37 frames, fewer if the machine stalls, and 6 buffers
  ASSERT_EQ(good_frame(), Status::ok) << camera->last_error();
  ASSERT_EQ(good_frame(), Status::ok) << camera->last_error();
  const hal::CameraCounts& n = camera->counts();
  EXPECT_GT(n.lost, 3U);
  EXPECT_EQ(frame.sequence, n.delivered + n.skipped + n.lost + n.unusable);
  const auto before = frame;
  there.reset();
  Status status = Status::ok;
  const std::int64_t gone_ns = clock.now_ns();
  while (status != Status::disconnected && clock.now_ns() - gone_ns < 10'000'000'000) {
    status = camera->next(frame, 100'000'000);
  }
  EXPECT_EQ(status, Status::disconnected);
  EXPECT_NE(camera->last_error(), "");
  camera->close();
  EXPECT_EQ(camera->next(frame, 1), Status::disconnected);
  EXPECT_FALSE(camera->open());
  there = tests::plug_in_network_camera();
  const auto back = camera->open();
  ASSERT_TRUE(back) << back.error();
  ASSERT_EQ(good_frame(), Status::ok) << camera->last_error();
  EXPECT_GT(frame.sequence, before.sequence);
  EXPECT_GT(frame.exposure_ns, before.exposure_ns);
  camera.reset();  // before it is unplugged: the library would wait for its answer
}

}  // namespace
}  // namespace punctum::aravis
