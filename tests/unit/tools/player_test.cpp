// A recording as a station: whoever joins sees at each moment what the run told up to then.
#include "tools/record/player.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <future>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/full_disk.hpp"
#include "tools/record/station_recorder.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/station_segments.hpp"

namespace punctum::tools {
namespace {

constexpr std::uint64_t kTicks = 12'000;
constexpr std::uint64_t kFaultAt = 3000, kClearedAt = 4000;

rt::TelemetrySample sample_at(std::uint64_t tick) {
  rt::TelemetrySample s;
  s.tick = tick;
  s.t_s = 1e-3 * static_cast<double>(tick);
  s.x_m[0] = std::sin(s.t_s);
  s.fault = tick >= kFaultAt && tick < kClearedAt ? rt::Fault::estop : rt::Fault::none;
  return s;
}

class PlayerTest : public FullDisk {
 protected:
  void SetUp() override {
    FullDisk::SetUp();
    record();
    auto opened = Player::open(path(), station_);
    ASSERT_TRUE(opened) << opened.error();
    player_ = std::move(*opened);
    auto joining = std::async(std::launch::async, [this] { return hal::Joined::join(station_); });
    while (joining.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) {
      (void)player_->serve(1, true);
    }
    auto joined = joining.get();
    ASSERT_TRUE(joined) << joined.error();
    auto core = hal::Shared<const rt::CoreSegment>::attach(kCoreSegment, joined->descriptor(kCoreSegment));
    auto observation = hal::Shared<const rt::ObservationSegment>::attach(
        kObservationSegment, joined->descriptor(kObservationSegment));
    const std::string queue = command_segment(rt::kConsole);
    auto commands = hal::Shared<rt::CommandSegment>::claim(queue, joined->descriptor(queue));
    auto view = hal::Shared<const rt::ViewSegment>::attach(kViewSegment, joined->descriptor(kViewSegment));
    auto replay =
        hal::Shared<const ReplaySegment>::attach(kReplaySegment, joined->descriptor(kReplaySegment));
    auto wishes =
        hal::Shared<ReplayWishSegment>::claim(kReplayWishSegment, joined->descriptor(kReplayWishSegment));
    ASSERT_TRUE(core && observation && commands && view && replay && wishes);
    view_ = std::move(*view);
    replay_ = std::move(*replay);
    wishes_ = std::move(*wishes);
    std::ifstream marks("/proc/self/fd/" + std::to_string(joined->descriptor(kReplayMarks)));
    marks_.assign(std::istreambuf_iterator<char>(marks), {});
    EXPECT_GE(joined->descriptor(kSceneText), 0);
    core_ = std::move(*core);
    observation_ = std::move(*observation);
    commands_ = std::move(*commands);
  }
  [[nodiscard]] std::string path() const { return (folder_ / "r.mcap").string(); }

  static constexpr std::uint32_t kWidth = 1000, kHeight = 601;
  // Two pixels beside each other have the same grey, two above each other, too.
  static std::vector<std::uint8_t> picture_at(std::uint64_t frame) {
    std::vector<std::uint8_t> pixels(std::size_t{kWidth} * kHeight);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      pixels[i] = static_cast<std::uint8_t>(frame + i % kWidth / 2 % 100);
    }
    return pixels;
  }

  // Twelve seconds: a fault that is cleared, an observation every 100 ms, a picture every second, the end.
  void record() {
    auto scene = load_scene("free", {"scene.clock=\"virtual\""});
    ASSERT_TRUE(scene) << scene.error();
    const auto core = std::make_unique<rt::CoreSegment>();
    const auto observation = std::make_unique<rt::ObservationSegment>();
    core->status.missed.store(7);
    core->status.wake.add(3'500);
    const auto pictures = std::make_unique<rt::PictureSegment>();
    auto recorder = StationRecorder::create(
        path(), {"free-1", to_toml(*scene), *core, observation.get(), nullptr, nullptr, &pictures->ring},
        *scene);
    ASSERT_TRUE(recorder) << recorder.error();
    for (std::uint64_t tick = 0; tick < kTicks; ++tick) {
      const rt::TelemetrySample s = sample_at(tick);
      const auto tell = [&](rt::Event::Kind kind, std::uint64_t what) {
        core->events.push({.tick = tick, .t_s = s.t_s, .kind = kind, .what = what});
      };
      if (tick == kFaultAt) {
        tell(rt::Event::fault, static_cast<std::uint64_t>(rt::Fault::estop));
      }
      if (tick == kClearedAt) {
        tell(rt::Event::fault_cleared, static_cast<std::uint64_t>(rt::Fault::estop));
      }
      if (tick % 1000 == 500) {
        tell(rt::Event::alarm_on, 3);
      }
      if (tick + 1 == kTicks) {
        tell(rt::Event::ended, static_cast<std::uint64_t>(rt::RunEnd::done));
      }
      core->telemetry.push(s);
      if (tick % 1000 == 0) {
        rt::PictureHead head;
        head.frame = tick / 100;
        head.width = kWidth;
        head.height = kHeight;
        head.pixel_m = 0.5e-6F;
        head.outer.count = 3;
        head.outer.point[2] = {static_cast<float>(tick), 4, 0.25F};
        ASSERT_TRUE(pictures->ring.push(head, picture_at(head.frame).data(), kWidth));
      }
      if (tick % 100 == 0) {
        observation->slot.push({.frame = tick / 100});
      }
      if (tick == kClearedAt) {
        for (int i = 0; i < 9; ++i) {
          core->status.wake.add(10'000'000);  // beyond the bins
          core->status.tick.add(42'000);
        }
      }
      (*recorder)->drain();
    }
    (*recorder)->finish();
    ASSERT_TRUE((*recorder)->lost_nothing());
  }
  [[nodiscard]] std::uint64_t newest_tick() const {
    rt::TelemetrySample s;
    std::uint64_t index = 0;
    EXPECT_EQ((*core_)->telemetry.newest(s, index), hal::Read::ok);
    const rt::TelemetrySample told = sample_at(s.tick);
    EXPECT_EQ(std::memcmp(&s, &told, sizeof s), 0);
    return s.tick;
  }
  [[nodiscard]] std::uint64_t newest_frame() const {
    rt::Observation o;
    std::uint64_t index = 0;
    EXPECT_EQ((*observation_)->slot.newest(o, index), hal::Read::ok);
    return o.frame;
  }
  [[nodiscard]] rt::Fault fault() const { return static_cast<rt::Fault>((*core_)->status.fault.load()); }
  [[nodiscard]] rt::RunEnd run_end() const {
    return static_cast<rt::RunEnd>((*core_)->status.run_end.load());
  }

  std::string station_ = "replay-test-" + std::to_string(::getpid());
  std::unique_ptr<Player> player_;
  std::optional<hal::Shared<const rt::CoreSegment>> core_;
  std::optional<hal::Shared<const rt::ObservationSegment>> observation_;
  std::optional<hal::Shared<rt::CommandSegment>> commands_;
  std::optional<hal::Shared<const rt::ViewSegment>> view_;
  std::optional<hal::Shared<const ReplaySegment>> replay_;
  std::optional<hal::Shared<ReplayWishSegment>> wishes_;
  std::string marks_;
};

TEST_F(PlayerTest, step_by_step_every_tick_is_told_once) {
  EXPECT_EQ(player_->first_s(), 0);
  EXPECT_DOUBLE_EQ(player_->last_s(), 11.999);
  EXPECT_EQ(newest_tick(), 0U);
  for (int i = 1; i <= 400; ++i) {
    player_->go_to(0.005 * i + 1e-9);
  }
  EXPECT_EQ(newest_tick(), 2000U);
  EXPECT_EQ((*core_)->telemetry.head(), 2001U);
  EXPECT_EQ(newest_frame(), 20U);
  EXPECT_EQ((*observation_)->slot.head(), 21U);
  EXPECT_EQ(fault(), rt::Fault::none);
  EXPECT_EQ((*core_)->status.missed.load(), 7U);
  EXPECT_EQ((*core_)->status.started.load(), 1U);
}

TEST_F(PlayerTest, a_moment_is_shown_as_it_was_wherever_one_comes_from) {
  player_->go_to(3.5);
  EXPECT_EQ(newest_tick(), 3500U);
  EXPECT_EQ(fault(), rt::Fault::estop);
  player_->go_to(11);  // far ahead: what lies between is not told
  EXPECT_EQ(newest_tick(), 11'000U);
  EXPECT_EQ(newest_frame(), 110U);
  EXPECT_EQ(fault(), rt::Fault::none);
  EXPECT_EQ((*core_)->telemetry.head(), 3502U);
  player_->go_to(3.9);
  EXPECT_EQ(newest_tick(), 3900U);
  EXPECT_EQ(newest_frame(), 39U);
  EXPECT_EQ(fault(), rt::Fault::estop);
  player_->go_to(100);
  EXPECT_EQ(newest_tick(), kTicks - 1);
  EXPECT_EQ(run_end(), rt::RunEnd::done);
  player_->go_to(-5);
  EXPECT_EQ(newest_tick(), 0U);
  EXPECT_EQ(run_end(), rt::RunEnd::running);
  EXPECT_EQ(player_->now_s(), 0);
}

TEST_F(PlayerTest, the_timing_of_the_core_is_what_it_was_at_that_moment) {
  const rt::CoreStatus& status = (*core_)->status;
  for (const double t_s : {1.0, 11.0, 2.0, 12.0}) {
    player_->go_to(t_s);
    EXPECT_EQ(status.wake.count(), t_s < 3 ? 1U : 10U) << t_s;
    EXPECT_EQ(status.wake.bin(3), 1U);
    EXPECT_EQ(status.wake.max_us(), t_s < 3 ? 3.5 : 1e4);
    EXPECT_EQ(status.tick.bin(42), t_s < 3 ? 0U : 9U);
    EXPECT_EQ(status.tick.percentile_us(0.5), t_s < 3 ? 0 : 42);
  }
}

TEST_F(PlayerTest, each_event_is_told_once_and_marks_are_where_it_happened) {
  for (const double t_s : {1.0, 5.0, 0.0, 5.0, 2.0, 12.0, 0.0, 12.0}) {
    player_->go_to(t_s);
  }
  EXPECT_EQ((*core_)->events.head(), 15U) << "2 of the fault, 12 alarms, the end";
  ASSERT_EQ(player_->marks().size(), 3U) << "alarms are none";
  EXPECT_DOUBLE_EQ(player_->marks()[0].t_s, 3);
  EXPECT_EQ(player_->marks()[0].text, "fault estop");
  EXPECT_EQ(player_->marks()[2].text, "ended done");
}

TEST_F(PlayerTest, the_picture_of_the_moment_is_shown_reduced_with_its_contour) {
  for (const std::uint64_t second : {2U, 11U, 5U}) {
    player_->go_to(static_cast<double>(second) + 0.95);
    rt::PictureHead head;
    std::uint64_t index = 0;
    ASSERT_EQ((*view_)->ring.heads().newest(head, index), hal::Read::ok);
    EXPECT_EQ(head.frame, 10 * second);
    EXPECT_EQ(head.step_px, 2U);
    EXPECT_EQ(head.width, kWidth / 2);
    EXPECT_EQ(head.height, kHeight / 2);
    EXPECT_EQ(head.outer.count, 3U);
    EXPECT_EQ(head.outer.point[2].x_px, static_cast<float>(1000 * second));
    EXPECT_EQ(head.inner.count, 0U);
    std::vector<std::uint8_t> pixels(head.bytes() + 7);
    ASSERT_TRUE((*view_)->ring.read(head, pixels.data()));
    for (std::size_t i = 0; i < head.bytes(); ++i) {
      ASSERT_EQ(pixels[i], static_cast<std::uint8_t>(head.frame + i % head.width % 100)) << i;
    }
  }
}

TEST_F(PlayerTest, a_console_sees_where_it_is_and_what_it_asks_for_comes_in_order) {
  EXPECT_EQ(marks_, "3 fault estop\n4 fault_cleared estop\n11.999 ended done\n");
  player_->go_to(3);
  EXPECT_FALSE(player_->serve(0.25, false));
  ReplayState state;
  std::uint64_t index = 0;
  ASSERT_EQ((*replay_)->state.newest(state, index), hal::Read::ok);
  EXPECT_EQ(state.now_s, 3);
  EXPECT_EQ(state.last_s, player_->last_s());
  EXPECT_EQ(state.speed, 0.25);
  EXPECT_EQ(state.playing, 0U);
  ReplayWish wish;
  EXPECT_FALSE(player_->next(wish));
  ASSERT_TRUE((*wishes_)->queue.try_push({ReplayWish::seek, 7.5}));
  ASSERT_TRUE((*wishes_)->queue.try_push({ReplayWish::play, 0}));
  ASSERT_TRUE(player_->next(wish));
  EXPECT_EQ(wish.kind, ReplayWish::seek);
  EXPECT_EQ(wish.value, 7.5);
  ASSERT_TRUE(player_->next(wish));
  EXPECT_EQ(wish.kind, ReplayWish::play);
  EXPECT_FALSE(player_->next(wish));
}

TEST_F(PlayerTest, it_lives_for_whoever_joined_and_says_that_a_stop_was_asked) {
  const std::uint64_t ticks = (*core_)->status.ticks.load();
  EXPECT_FALSE(player_->serve(1, true));
  EXPECT_GT((*core_)->status.ticks.load(), ticks);
  ASSERT_TRUE((*commands_)->queue.try_push({.kind = rt::Command::force_scale, .value = 0.5}));
  EXPECT_FALSE(player_->serve(1, true));
  ASSERT_TRUE((*commands_)->queue.try_push({.kind = rt::Command::stop}));
  EXPECT_TRUE(player_->serve(1, true));
  EXPECT_FALSE(player_->serve(1, true));
}

TEST_F(PlayerTest, what_is_no_recording_is_one_line) {
  EXPECT_EQ(Player::open("/dev/null", "replay-none").error().find('\n'), std::string::npos);
  EXPECT_NE(Player::open(path(), station_).error(), "") << "the name is taken";
}

}  // namespace
}  // namespace punctum::tools
