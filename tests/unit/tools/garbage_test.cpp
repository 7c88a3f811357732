// What the parent makes of a core segment and a bench that hold anything at all: a defective writer ends no
// reader.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "hal/sim/valid.hpp"
#include "hal/sim/world.hpp"
#include "tools/punctum/judge.hpp"
#include "tools/punctum/lab_report.hpp"
#include "tools/punctum/recorder.hpp"
#include "tools/punctum/run_report.hpp"
#include "tools/punctum/terminal.hpp"
#include "tools/shared/station_values.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

class Garbage : public testing::TestWithParam<unsigned> {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "punctum-garbage-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    scene_ = *load_scene("icsi");
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Random bytes; every second time mostly zeros, so that some of what stands there could be.
  template <class T>
  void fill(T& with_garbage) {
    auto* bytes = reinterpret_cast<unsigned char*>(&with_garbage);
    const bool mostly_zeros = random_() % 2 == 0;
    static_assert(sizeof(T) % 8 == 0);
    for (std::size_t i = 0; i < sizeof(T); i += 8) {
      const std::uint64_t word = random_();
      const std::uint64_t kept = mostly_zeros ? word & random_() & random_() & random_() : word;
      std::memcpy(bytes + i, &kept, 8);
    }
  }
  template <class T>
  T garbage() {
    T made;
    fill(made);
    return made;
  }

  std::mt19937_64 random_{GetParam()};
  fs::path folder_;
  Scene scene_;
  std::unique_ptr<rt::CoreSegment> core_ = std::make_unique<rt::CoreSegment>();
  std::unique_ptr<sim::Bench> bench_ = std::make_unique<sim::Bench>();
};

TEST_P(Garbage, in_samples_events_and_status_leaves_a_report_that_can_be_read) {
  auto recorder = Recorder::create(folder_, scene_, *core_, bench_.get(), 1);
  ASSERT_TRUE(recorder) << recorder.error();
  rt::TelemetrySample good;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    bench_->snapshots.push(garbage<sim::Snapshot>());
    auto sample = garbage<rt::TelemetrySample>();
    sample.t_s = random_() % 4 == 0 ? sample.t_s : 1e-3 * static_cast<double>(i);
    core_->telemetry.push(i % 3 == 0 ? good : sample);
    core_->events.push(garbage<rt::Event>());
    if (i % 500 == 0) {
      recorder->drain();
    }
  }
  fill(core_->status);
  recorder->finish();
  EXPECT_GT(recorder->unusable(), 0U);
  EXPECT_GE(recorder->measures().ticks, 1000U);  // the good ones
  RunResult result;
  result.end = judge({.core_exited = true, .has_task = true}, core_->status, recorder->measures());
  result.samples_lost = recorder->lost();
  ASSERT_TRUE(write_report_json(
      folder_, report_facts(scene_, result, recorder->measures(), recorder->events(), core_->status, {})));
  std::ifstream in(folder_ / "report.json");
  EXPECT_TRUE(nlohmann::json::parse(in, nullptr, false).is_object());
  for (const std::string& text :
       {summary(scene_, result, recorder->measures(), core_->status, {}, false),
        progress_line(scene_, recorder->measures(), core_->status, {}), missing_rights(core_->status)}) {
    for (const char c : text) {
      ASSERT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20) << text;
    }
  }
}

TEST_P(Garbage, in_the_rings_themselves_is_read_in_bounded_time) {
  fill(*core_);
  fill(*bench_);
  auto recorder = Recorder::create(folder_, scene_, *core_, bench_.get(), 1);
  ASSERT_TRUE(recorder) << recorder.error();
  for (int i = 0; i < 5; ++i) {
    EXPECT_LE(recorder->drain(), rt::TelemetryRing::kSize);
    fill(core_->telemetry);
  }
  recorder->finish();
  EXPECT_LE(recorder->lost(), core_->status.ticks.load());
}

TEST_P(Garbage, in_the_bench_is_no_state_to_go_on_from) {
  for (int i = 0; i < 200; ++i) {
    bench_->snapshots.push(garbage<sim::Snapshot>());
  }
  sim::Snapshot newest;
  EXPECT_FALSE(sim::newest_valid(*bench_, newest));
  EXPECT_FALSE(sim::run_unattended(*scene_.sim, *bench_).safe);
}

TEST_P(Garbage, after_a_state_that_could_be_is_passed_over) {
  sim::Snapshot good;
  good.tick = 77;
  bench_->snapshots.push(good);
  bench_->snapshots.push(garbage<sim::Snapshot>());
  sim::Snapshot newest;
  ASSERT_TRUE(sim::newest_valid(*bench_, newest));
  EXPECT_EQ(newest.tick, 77U);
}

TEST_P(Garbage, in_exposures_is_never_shown) {
  sim::CameraAnswers answers;
  sim::ExposureTaker taker(*bench_, answers);
  taker.attach();
  for (std::uint64_t i = 0; i < 100; ++i) {
    bench_->exposures.push(garbage<sim::Exposure>());
    bench_->exposed.store(i + 1);
    sim::Exposure out;
    EXPECT_EQ(taker.next(out, 0), hal::Status::no_data) << i;
  }
  bench_->exposed.store(random_());  // a count that is not true
  sim::Exposure out;
  EXPECT_EQ(taker.next(out, 0), hal::Status::no_data);
  bench_->exposed.store(100);
  EXPECT_EQ(taker.next(out, 0), hal::Status::no_data);
  bench_->exposures.push(sim::Exposure{});
  bench_->exposed.store(101);
  EXPECT_EQ(taker.next(out, 1'000'000'000), hal::Status::ok);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Garbage, testing::Range(1U, 7U));

TEST(StationValues, words_that_stand_for_nothing_are_told_from_those_that_do) {
  EXPECT_EQ(phase_in(rt::kPhases - 1), rt::Phase::clear);
  EXPECT_EQ(phase_in(rt::kPhases), std::nullopt);
  EXPECT_EQ(fault_in(rt::kFaults), std::nullopt);
  EXPECT_EQ(fault_in(256), std::nullopt) << "256 is not 0";
  EXPECT_EQ(run_end_in(rt::kRunEnds), std::nullopt);
  rt::TelemetrySample sample;
  EXPECT_TRUE(usable(sample));
  sample.t_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(usable(sample));
  rt::Text<32> text;
  std::memset(text.text, 'x', sizeof text.text);
  EXPECT_EQ(bounded(text).size(), 32U);
  text.set("short");
  EXPECT_EQ(bounded(text), "short");
}

}  // namespace
}  // namespace punctum::tools
