// What a recording holds of a station, and what it says of what it has missed. The station is in the memory
// of this process.
#include "tools/record/station_recorder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/full_disk.hpp"
#include "tools/record/recording_reader.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

// All messages of a recording.
struct Recorded {
  std::vector<v1::Scene> scenes;
  std::vector<v1::Telemetry> ticks;
  std::vector<v1::Truth> truth;
  std::vector<v1::Observation> observations;
  std::vector<v1::CellSurface> surfaces;
  std::vector<v1::Event> events;
  std::vector<v1::Status> statuses;
  std::vector<v1::Loss> losses;
  std::vector<v1::Input> inputs;
  std::string ends;

  void operator()(const v1::Scene& m) { scenes.push_back(m); }
  void operator()(const v1::Telemetry& m) { ticks.push_back(m); }
  void operator()(const v1::Truth& m) { truth.push_back(m); }
  void operator()(const v1::Observation& m) { observations.push_back(m); }
  void operator()(const v1::CellSurface& m) { surfaces.push_back(m); }
  void operator()(const v1::Event& m) { events.push_back(m); }
  void operator()(const v1::Status& m) { statuses.push_back(m); }
  void operator()(const v1::Loss& m) { losses.push_back(m); }
  void operator()(const v1::Input& m) { inputs.push_back(m); }
};

class StationRecorderTest : public FullDisk {
 protected:
  void SetUp() override {
    FullDisk::SetUp();
    scene_ = *load_scene("free", {"scene.clock=\"virtual\""});
    core_->status.start_ns.store(5'000'000'000);
    core_->status.period_ns.store(1'000'000);
  }
  [[nodiscard]] std::string path() const { return (folder_ / "r.mcap").string(); }
  [[nodiscard]] std::unique_ptr<StationRecorder> recorder(const sim::Bench* bench = nullptr,
                                                          bool from_the_first_tick = false) const {
    auto r = StationRecorder::create(path(),
                                     {.name = "free-1",
                                      .scene = "[scene]\n",
                                      .core = *core_,
                                      .observation = observation_.get(),
                                      .bench = bench,
                                      .from_the_first_tick = from_the_first_tick},
                                     scene_);
    EXPECT_TRUE(r) << r.error();
    return std::move(*r);
  }
  void tick(std::uint64_t n) {
    for (std::uint64_t i = 0; i < n; ++i) {
      sample_.tick = next_++;
      sample_.t_s = static_cast<double>(sample_.tick) * 1e-3;
      core_->telemetry.push(sample_);
    }
    core_->status.ticks.store(next_);
  }
  [[nodiscard]] Recorded read() const {
    Recorded r;
    auto reader = RecordingReader::open(path());
    EXPECT_TRUE(reader) << reader.error();
    r.ends = reader->read_all(r);
    return r;
  }
  // Times that each message is logged and published at, of one channel.
  [[nodiscard]] std::vector<mcap::Message> of(const std::string& topic) const {
    auto reader = mcap::Reader::open(path());
    std::vector<mcap::Message> all;
    mcap::Message m;
    while (*reader->next(m)) {
      if (reader->channels().at(m.channel).topic == topic) {
        all.push_back(m);
      }
    }
    return all;
  }

  std::unique_ptr<rt::CoreSegment> core_ = std::make_unique<rt::CoreSegment>();
  std::unique_ptr<rt::ObservationSegment> observation_ = std::make_unique<rt::ObservationSegment>();
  Scene scene_;
  rt::TelemetrySample sample_;
  std::uint64_t next_ = 0;
};

TEST_F(StationRecorderTest, everything_that_a_station_tells_is_in_the_recording) {
  auto r = recorder();
  sample_.x_m[2] = 0.125;
  tick(3);
  r->drain();
  rt::Observation o;
  o.frame = 9;
  o.exposure_ns = 5'001'000'000;
  observation_->slot.push(o);
  rt::CellSurface c;
  c.flags = rt::CellSurface::outer_ok;
  c.outer.control_m[31][4] = 0.5;
  observation_->surface.push(c);
  core_->events.push({.tick = 2, .t_s = 0.002, .kind = rt::Event::phase, .what = 1});
  core_->status.missed.store(7);
  r->finish();

  const Recorded all = read();
  EXPECT_EQ(all.ends, "");
  ASSERT_EQ(all.scenes.size(), 1U);
  EXPECT_EQ(all.scenes[0].station(), "free-1");
  EXPECT_EQ(all.scenes[0].toml(), "[scene]\n");
  EXPECT_EQ(all.scenes[0].effect(0), "membrane");
  EXPECT_EQ(all.scenes[0].rate_hz(), 1000);
  EXPECT_TRUE(all.scenes[0].virtual_time());
  ASSERT_EQ(all.ticks.size(), 3U);
  EXPECT_EQ(all.ticks[2].tick(), 2U);
  EXPECT_EQ(all.ticks[2].x_m().z(), 0.125);
  ASSERT_EQ(all.observations.size(), 1U);
  EXPECT_EQ(all.observations[0].frame(), 9U);
  ASSERT_EQ(all.surfaces.size(), 1U);
  EXPECT_EQ(all.surfaces[0].outer().row(31).depth_m(), 0.5);
  EXPECT_FALSE(all.surfaces[0].has_inner());
  ASSERT_EQ(all.events.size(), 1U);
  EXPECT_EQ(all.events[0].phase(), v1::PHASE_CONTACT);
  ASSERT_EQ(all.statuses.size(), 1U);
  EXPECT_EQ(all.statuses[0].missed(), 7U);
  EXPECT_TRUE(all.losses.empty());
  EXPECT_TRUE(all.truth.empty());
  EXPECT_TRUE(r->lost_nothing());
  EXPECT_EQ(r->count(Stream::telemetry), 3U);
}

// So a file that is cut off anywhere can be replayed up to there.
TEST_F(StationRecorderTest, what_a_tick_was_given_stands_before_its_input) {
  const auto inputs = std::make_unique<rt::InputSegment>();
  auto created = StationRecorder::create(
      path(), {"free-1", "[scene]\n", *core_, observation_.get(), nullptr, inputs.get()}, scene_);
  ASSERT_TRUE(created) << created.error();
  auto& r = *created;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    observation_->slot.push({.frame = i});
    core_->events.push({.tick = i, .kind = rt::Event::command, .what = rt::Command::end});
    tick(1);
    if (i % 41 == 0) {
      r->drain();
      EXPECT_EQ(r->position(), i) << "no tick without its input";
    }
    inputs->ring.push(
        {.number = i, .tick = i, .release_ns = static_cast<std::int64_t>(i), .observations = i + 1});
    if (i % 37 == 0) {
      r->drain();
    }
  }
  tick(1);  // the core is killed in it
  r->finish();
  struct Order {
    std::uint64_t observation = 0, event = 0, inputs = 0, bad = 0;
    void operator()(const v1::Observation& m) {
      bad += m.number() != observation + 1 || m.frame() != observation ? 1 : 0;
      ++observation;
    }
    void operator()(const v1::Event&) { ++event; }
    void operator()(const v1::Input& m) {
      bad += m.number() != inputs || observation < m.observations() || event < m.tick() + 1 ? 1 : 0;
      ++inputs;
    }
  } order;
  ASSERT_EQ(RecordingReader::open(path())->read_all(order), "");
  EXPECT_EQ(order.inputs, 1000U);
  EXPECT_EQ(of("/telemetry").size(), 1001U);
  EXPECT_EQ(order.bad, 0U);
  EXPECT_TRUE(r->lost_nothing());
  EXPECT_EQ(of("/input").at(999).log_ns, 999U) << "at the tick";
}

TEST_F(StationRecorderTest, inputs_that_were_overwritten_are_counted) {
  const auto inputs = std::make_unique<rt::InputSegment>();
  auto r = StationRecorder::create(path(), {"free-1", "[scene]\n", *core_, nullptr, nullptr, inputs.get()},
                                   scene_);
  ASSERT_TRUE(r) << r.error();
  for (std::uint64_t i = 0; i < rt::InputRing::kSize + 5; ++i) {
    tick(1);
    inputs->ring.push({});
  }
  (*r)->drain();
  EXPECT_GE((*r)->loss().inputs(), 5U);
  EXPECT_FALSE((*r)->lost_nothing());
}

std::vector<std::uint8_t> picture_of(std::uint32_t width, std::uint32_t height, std::uint8_t first) {
  std::vector<std::uint8_t> pixels(std::size_t{width} * height);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i] = static_cast<std::uint8_t>(first + 7 * i + i / width);
  }
  return pixels;
}

TEST_F(StationRecorderTest, pictures_of_any_size_are_in_the_recording_pixel_by_pixel) {
  const auto pictures = std::make_unique<rt::PictureSegment>();
  auto created = StationRecorder::create(
      path(), {"free-1", "[scene]\n", *core_, nullptr, nullptr, nullptr, &pictures->ring}, scene_);
  ASSERT_TRUE(created) << created.error();
  tick(1);
  const std::pair<std::uint32_t, std::uint32_t> sizes[] = {{1, 1}, {13, 7}, {640, 480}, {727, 485}, {8, 1}};
  for (std::uint64_t i = 0; i < std::size(sizes); ++i) {
    const auto [width, height] = sizes[i];
    const std::size_t stride = width + 5;  // rows that do not follow each other
    const auto pixels = picture_of(width, height, static_cast<std::uint8_t>(i));
    std::vector<std::uint8_t> padded(stride * height, 255);
    for (std::uint32_t y = 0; y < height; ++y) {
      std::copy_n(pixels.begin() + static_cast<std::ptrdiff_t>(y) * width, width,
                  padded.begin() + static_cast<std::ptrdiff_t>(y * stride));
    }
    ASSERT_TRUE(pictures->ring.push({.frame = i,
                                     .exposure_ns = 5'000'000'000 + static_cast<std::int64_t>(i),
                                     .width = width,
                                     .height = height},
                                    padded.data(), stride));
  }
  EXPECT_FALSE(pictures->ring.push({.width = 5000, .height = 5000}, nullptr, 5000)) << "too large";
  EXPECT_FALSE(pictures->ring.push({.width = 0, .height = 5}, nullptr, 0));
  (*created)->finish();
  std::vector<v1::Picture> got;
  auto take = [&got](const v1::Picture& p) { got.push_back(p); };
  ASSERT_EQ(RecordingReader::open(path())->read_all(take), "");
  ASSERT_EQ(got.size(), std::size(sizes));
  for (std::uint64_t i = 0; i < got.size(); ++i) {
    const auto pixels = picture_of(sizes[i].first, sizes[i].second, static_cast<std::uint8_t>(i));
    EXPECT_EQ(got[i].frame(), i);
    EXPECT_EQ(got[i].width(), sizes[i].first);
    EXPECT_EQ(got[i].height(), sizes[i].second);
    EXPECT_TRUE(std::equal(pixels.begin(), pixels.end(), got[i].grey().begin(), got[i].grey().end(),
                           [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); }))
        << i;
  }
  EXPECT_EQ(of("/picture").at(2).publish_ns, 5'000'000'002U) << "the exposure";
  EXPECT_TRUE((*created)->lost_nothing());
}

// Whoever is late reads no picture of two halves, and knows how many there were.
TEST_F(StationRecorderTest, pictures_that_were_overwritten_are_counted_and_none_is_torn) {
  const auto pictures = std::make_unique<rt::PictureSegment>();
  auto created = StationRecorder::create(
      path(), {"free-1", "[scene]\n", *core_, nullptr, nullptr, nullptr, &pictures->ring}, scene_);
  ASSERT_TRUE(created) << created.error();
  tick(1);
  constexpr std::uint64_t kPictures = 60;  // twice what the ring holds of them
  std::thread writer([&pictures] {
    for (std::uint64_t i = 0; i < kPictures; ++i) {
      const std::vector<std::uint8_t> pixels(1024 * 1024, static_cast<std::uint8_t>(i));
      (void)pictures->ring.push({.frame = i, .exposure_ns = 1, .width = 1024, .height = 1024}, pixels.data(),
                                1024);
    }
  });
  for (int i = 0; i < 10; ++i) {
    (*created)->drain();
  }
  writer.join();
  (*created)->finish();
  std::uint64_t seen = 0, torn = 0;
  auto take = [&](const v1::Picture& p) {
    ++seen;
    torn += p.grey() == std::string(p.grey().size(), static_cast<char>(p.frame())) ? 0 : 1;
  };
  EXPECT_EQ(RecordingReader::open(path())->read_all(take).empty(), (*created)->lost_nothing());
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(seen + (*created)->loss().pictures(), kPictures);
  EXPECT_GT(seen, 0U);

  auto second = StationRecorder::create(
      (folder_ / "second.mcap").string(),
      {"free-1", "[scene]\n", *core_, nullptr, nullptr, nullptr, &pictures->ring}, scene_);
  ASSERT_TRUE(second) << second.error();
  (*second)->drain();
  const std::uint64_t before = (*second)->loss().pictures();
  for (std::uint64_t i = 0; i < 3; ++i) {  // half the ring each: the first is gone
    const std::vector<std::uint8_t> pixels(rt::PictureSegment::Ring::kLargest);
    (void)pictures->ring.push({.frame = i, .width = 4096, .height = 4096}, pixels.data(), 4096);
  }
  (*second)->drain();
  EXPECT_EQ((*second)->loss().pictures() - before, 1U);
  EXPECT_FALSE((*second)->lost_nothing());
}

TEST_F(StationRecorderTest, times_are_those_of_the_ticks_and_of_the_pictures) {
  auto r = recorder();
  tick(3);
  r->drain();
  rt::Observation o;
  o.exposure_ns = 5'000'500'000;
  observation_->slot.push(o);
  r->finish();
  const auto ticks = of("/telemetry");
  ASSERT_EQ(ticks.size(), 3U);
  EXPECT_EQ(ticks[2].log_ns, 5'002'000'000U) << "virtual time is written as it is";
  const auto observations = of("/observation");
  ASSERT_EQ(observations.size(), 1U);
  EXPECT_EQ(observations[0].log_ns, 5'002'000'000U) << "the core could have seen it then";
  EXPECT_EQ(observations[0].publish_ns, 5'000'500'000U);
}

TEST_F(StationRecorderTest, a_recording_in_real_time_says_what_the_clock_on_the_wall_says) {
  scene_.clock = ClockKind::real;
  core_->status.start_ns.store(
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                     std::chrono::steady_clock::now().time_since_epoch())
                                     .count()));
  auto r = recorder();
  tick(1);
  r->finish();
  const auto now =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch());
  EXPECT_NEAR(static_cast<double>(of("/telemetry").at(0).log_ns) * 1e-9, static_cast<double>(now.count()),
              60);
}

TEST_F(StationRecorderTest, what_was_overwritten_before_it_was_read_is_counted_and_written) {
  auto r = recorder();
  tick(10);
  r->drain();
  const std::uint64_t more = rt::TelemetryRing::kSize + 500;
  tick(more);
  for (std::uint64_t i = 0; i < rt::EventRing::kSize + 5; ++i) {
    core_->events.push({.tick = i});
  }
  static_assert(rt::SurfaceSlot::kSize == rt::ObservationSlot::kSize);
  for (std::uint64_t i = 0; i < rt::ObservationSlot::kSize + 6; ++i) {
    observation_->slot.push({});
    observation_->surface.push({});
  }
  r->finish();
  const Recorded all = read();
  ASSERT_FALSE(all.losses.empty());
  const v1::Loss& lost = all.losses.back();
  EXPECT_EQ(lost.telemetry() + all.ticks.size(), 10 + more);
  EXPECT_GE(lost.telemetry(), 500U);
  EXPECT_EQ(lost.events() + all.events.size(), rt::EventRing::kSize + 5);
  EXPECT_EQ(lost.observations() + all.observations.size(), rt::ObservationSlot::kSize + 6);
  EXPECT_GE(lost.observations(), 6U);
  EXPECT_EQ(lost.surfaces() + all.surfaces.size(), rt::SurfaceSlot::kSize + 6);
  EXPECT_FALSE(r->lost_nothing());
}

TEST_F(StationRecorderTest, what_came_before_it_had_begun_is_lost_only_where_all_is_wanted) {
  tick(rt::TelemetryRing::kSize + 500);
  auto all = recorder(nullptr, true);
  all->finish();
  EXPECT_EQ(all->loss().telemetry() + all->count(Stream::telemetry), rt::TelemetryRing::kSize + 500);
  EXPECT_FALSE(all->lost_nothing());
  EXPECT_EQ(all->position(), rt::TelemetryRing::kSize + 500);
  fs::remove(path());
  auto joined = recorder();
  joined->finish();
  EXPECT_GT(joined->count(Stream::telemetry), rt::TelemetryRing::kSize / 2);
  EXPECT_TRUE(joined->lost_nothing());
}

TEST_F(StationRecorderTest, a_sample_that_names_what_does_not_exist_is_counted_and_not_written) {
  auto r = recorder();
  tick(1);
  sample_.phase = static_cast<rt::Phase>(99);
  tick(1);
  r->finish();
  EXPECT_EQ(read().ticks.size(), 1U);
  EXPECT_EQ(r->loss().unusable(), 1U);
  EXPECT_FALSE(r->lost_nothing());
}

TEST_F(StationRecorderTest, who_comes_late_gets_what_the_rings_still_hold_and_has_lost_nothing) {
  tick(3 * rt::TelemetryRing::kSize);
  auto r = recorder();
  r->finish();
  const Recorded all = read();
  EXPECT_GE(all.ticks.size(), rt::TelemetryRing::kSize / 2);
  EXPECT_LT(all.ticks.size(), rt::TelemetryRing::kSize) << "the oldest would be overwritten under it";
  EXPECT_EQ(all.ticks.back().tick(), 3 * rt::TelemetryRing::kSize - 1);
  EXPECT_TRUE(r->lost_nothing());
}

TEST_F(StationRecorderTest, who_comes_late_knows_from_when_on_the_file_tells) {
  tick(1);
  EXPECT_FALSE(recorder()->ticks_from_s());
  fs::remove(path());
  tick(3 * rt::TelemetryRing::kSize);
  rt::Observation o;
  for (std::uint64_t i = 0; i < 3 * rt::ObservationSlot::kSize; ++i) {
    o.exposure_ns = 5'000'000'000 + static_cast<std::int64_t>(i) * 40'000'000;
    observation_->slot.push(o);
  }
  auto r = recorder();
  r->finish();
  const Recorded all = read();
  ASSERT_TRUE(r->ticks_from_s() && r->observations_from_s());
  EXPECT_EQ(*r->ticks_from_s(), all.ticks.front().t_s());
  EXPECT_NEAR(*r->observations_from_s(),
              1e-9 * static_cast<double>(all.observations.front().exposure_ns() - 5'000'000'000), 1e-9);
  EXPECT_GT(*r->observations_from_s(), 0);
  EXPECT_TRUE(r->lost_nothing());
}

TEST_F(StationRecorderTest, the_truth_of_a_tick_follows_it) {
  scene_ = *load_scene("free", {"scene.clock=\"virtual\""});
  const auto bench = std::make_unique<sim::Bench>();
  const auto at = [](std::int64_t tick) {
    sim::Snapshot s;
    s.t_ns = 5'000'000'000 + tick * 1'000'000;
    s.start_ns = 5'000'000'000;
    s.stage.tip_m = hal::Vec3(1e-6 * static_cast<double>(tick), 0, 0);
    return s;
  };
  auto r = recorder(bench.get());
  bench->snapshots.push(at(0));
  bench->snapshots.push(at(1));
  bench->snapshots.push(at(3));
  tick(4);
  bench->snapshots.push(at(4));
  bench->snapshots.push(at(5));
  ++next_;  // a tick that the core told nothing of
  tick(1);
  r->finish();
  const Recorded all = read();
  std::vector<std::uint64_t> ticks;
  for (const v1::Truth& t : all.truth) {
    ticks.push_back(t.tick());
    EXPECT_DOUBLE_EQ(t.tip_m().x(), 1e-6 * static_cast<double>(t.tick()));
    EXPECT_FALSE(t.cell());
  }
  EXPECT_EQ(ticks, (std::vector<std::uint64_t>{0, 1, 3, 5})) << "none where the plant told none";
}

TEST_F(StationRecorderTest, a_file_that_is_killed_holds_all_but_the_last_half_second) {
  auto r = recorder();
  for (int i = 0; i < 20; ++i) {
    tick(100);
    r->drain();
  }
  const Recorded now = read();  // as if the program had just been killed
  EXPECT_NE(now.ends, "");
  EXPECT_GE(now.ticks.size(), 2000U - 501U);
  EXPECT_EQ(now.scenes.size(), 1U);
  EXPECT_GE(now.statuses.size(), 3U) << "one with each chunk";
  r->finish();
  EXPECT_EQ(read().ticks.size(), 2000U);
}

TEST_F(StationRecorderTest, a_chunk_is_closed_in_time_where_time_is_all_that_goes_on) {
  auto r = recorder();
  tick(10);
  r->drain();
  const auto before = r->bytes();
  std::this_thread::sleep_for(std::chrono::milliseconds(450));
  r->drain();
  EXPECT_GT(r->bytes(), before);
  EXPECT_EQ(read().ticks.size(), 10U);
}

TEST_F(StationRecorderTest, a_full_disk_ends_the_recording_and_is_told) {
  auto r = recorder();
  tick(600);
  r->drain();
  const std::size_t kept = read().ticks.size();
  ASSERT_GT(kept, 0U);
  full_beyond(r->bytes() + 1000);
  tick(1500);
  r->drain();
  EXPECT_EQ(r->failure(), "File too large");
  r->finish();
  has_room_again();
  EXPECT_EQ(read().ticks.size(), kept);
  EXPECT_EQ(r->count(Stream::telemetry), kept);
}

TEST_F(StationRecorderTest, the_last_word_of_the_core_ends_it) {
  auto r = recorder();
  tick(1);
  r->drain();
  EXPECT_FALSE(r->core_has_ended());
  core_->events.push({.kind = rt::Event::ended});
  r->drain();
  EXPECT_TRUE(r->core_has_ended());
}

TEST_F(StationRecorderTest, a_station_that_never_began_leaves_its_scene) {
  auto r = recorder();
  r->finish();
  const Recorded all = read();
  EXPECT_EQ(all.ends, "");
  EXPECT_EQ(all.scenes.size(), 1U);
  EXPECT_TRUE(all.ticks.empty());
  EXPECT_TRUE(all.statuses.empty());
}

}  // namespace
}  // namespace punctum::tools
