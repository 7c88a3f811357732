// The simulated camera on a bench whose plant another thread steps, as the core does.
#include "hal/sim/camera/sim_camera.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string_view>
#include <thread>
#include <vector>

#include "hal/sim/virtual_clock.hpp"
#include "hal/sim/world.hpp"
#include "tests/support/local_bench.hpp"

using namespace punctum::sim;
namespace hal = punctum::hal;

namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kPatience = 5'000 * kMs;

SimConfig station() {
  SimConfig c;
  c.cell = CellParams{};
  c.holder = HolderParams{};
  c.microscope = MicroscopeParams{};
  return c;
}

// Steps the plant in virtual time once a camera is there.
class VirtualCore {
 public:
  VirtualCore(const SimConfig& config, LocalBench& bench, int ms)
      : clock_(std::make_unique<VirtualClock>(bench, bench.camera)) {
    thread_ = std::thread([this, config, &bench, ms] {
      World world(config, &bench, 0);
      if (clock_->await_camera()) {
        for (int i = 1; i <= ms; ++i) {
          clock_->sleep_until_ns(i * kMs);
          world.step(i * kMs);
        }
        clock_->sleep_until_ns((ms + 100) * kMs);  // until the last observation is delivered
      }
      clock_.reset();
    });
  }
  ~VirtualCore() { thread_.join(); }

 private:
  std::unique_ptr<VirtualClock> clock_;
  std::thread thread_;
};

std::size_t digest(const hal::Frame& f) {
  return std::hash<std::string_view>{}(
      {reinterpret_cast<const char*>(f.pixels), static_cast<std::size_t>(f.stride * f.height)});
}

struct Seen {
  hal::Status status{};
  std::uint64_t sequence = 0;
  std::int64_t exposure_ns = 0;
  std::int64_t deliver_ns = 0;
  std::size_t picture = 0;
  bool operator==(const Seen&) const = default;
};

std::vector<Seen> watch(const SimConfig& config, int ms,
                        SimCamera::Picture picture = SimCamera::Picture::drawn) {
  const auto bench = std::make_unique<LocalBench>();
  const VirtualCore core(config, *bench, ms);
  SimCamera camera(config, *bench, bench->camera, picture);
  std::vector<Seen> all;
  for (;;) {
    hal::Frame frame;
    const hal::Status status = camera.next(frame, kPatience);
    if (status == hal::Status::no_data) {
      break;
    }
    if (status == hal::Status::disconnected && bench->finished.load() != 0) {
      break;
    }
    all.push_back({status, frame.sequence, frame.exposure_ns, frame.deliver_ns,
                   frame.pixels != nullptr ? digest(frame) : 0});
    if (status == hal::Status::ok) {
      camera.release(frame);
    }
  }
  return all;
}

TEST(SimCamera, in_virtual_time_no_frame_is_lost_and_two_runs_are_alike) {
  const SimConfig config = station();
  const std::vector<Seen> first = watch(config, 990);
  ASSERT_EQ(first.size(), 25U);
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].status, hal::Status::ok);
    EXPECT_EQ(first[i].sequence, i);
    EXPECT_EQ(first[i].deliver_ns - first[i].exposure_ns, 40 * kMs);
  }
  EXPECT_EQ(first, watch(config, 990));
}

TEST(SimCamera, in_real_time_it_gives_the_newest_and_skips_what_it_missed) {
  const SimConfig config = station();
  const auto bench = std::make_unique<LocalBench>();
  World world(config, bench.get(), 0);
  SimCamera camera(config, *bench, bench->camera);
  hal::Frame frame;
  EXPECT_EQ(camera.next(frame, 0), hal::Status::no_data);
  for (int i = 1; i <= 50; ++i) {
    world.step(i * kMs);
  }
  ASSERT_EQ(camera.next(frame, 0), hal::Status::ok);
  EXPECT_EQ(frame.sequence, 1U);
  camera.release(frame);
  for (int i = 51; i <= 250; ++i) {
    world.step(i * kMs);
  }
  ASSERT_EQ(camera.next(frame, 0), hal::Status::ok);
  EXPECT_EQ(frame.sequence, 6U);
  EXPECT_EQ(frame.exposure_ns, 240 * kMs);
  camera.release(frame);
  EXPECT_EQ(camera.next(frame, 0), hal::Status::no_data);
  bench->finished.store(1);
  EXPECT_EQ(camera.next(frame, kPatience), hal::Status::disconnected);
}

TEST(SimCamera, the_truth_beside_the_frame_is_what_the_frame_shows) {
  const SimConfig config = station();
  const auto bench = std::make_unique<LocalBench>();
  World world(config, bench.get(), 0);
  SimCamera camera(config, *bench, bench->camera);
  for (int i = 1; i <= 100; ++i) {
    world.step(i * kMs);
  }
  hal::Frame frame;
  ASSERT_EQ(camera.next(frame, 0), hal::Status::ok);
  EXPECT_EQ(camera.snapshot().t_ns, frame.exposure_ns);
  EXPECT_EQ(camera.truth().tip_m, camera.snapshot().stage.tip_m.vec());
  ASSERT_EQ(camera.outer().size(), static_cast<std::size_t>(Cell::kContour));
  ASSERT_EQ(camera.inner().size(), static_cast<std::size_t>(Cell::kContour));
  // The zona is darker just inside the outer contour than just outside, all round but at the holding pipette.
  const auto grey = [&](double x_m, double y_m) {
    const int x = static_cast<int>(std::lround(x_m / 0.825e-6 + 363));
    const int y = static_cast<int>(std::lround(y_m / 0.825e-6 + 242));
    return static_cast<int>(frame.pixels[y * frame.stride + x]);
  };
  int right = 0;
  int asked = 0;
  const Vec3 centre = camera.truth().centre_m;
  for (const auto& [x, y] : camera.outer()) {
    if (x < centre.x() - 20e-6) {
      continue;
    }
    const Vec3 out = (Vec3(x, y, 0) - centre).normalized() * 2.5e-6;
    right += grey(x - out.x(), y - out.y()) + 8 < grey(x + out.x(), y + out.y()) ? 1 : 0;
    ++asked;
  }
  EXPECT_GT(right, asked * 95 / 100);
}

TEST(SimCamera, without_a_picture_there_is_still_the_truth) {
  const SimConfig config = station();
  const std::vector<Seen> seen = watch(config, 190, SimCamera::Picture::none);
  ASSERT_EQ(seen.size(), 5U);
  for (const Seen& s : seen) {
    EXPECT_EQ(s.picture, 0U);
  }
}

SimConfig failing(Failure kind, double for_s = 0.4) {
  SimConfig c = station();
  c.failures[0] = {Device::camera, kind, 0.2, for_s};  // frames 5 .. 14
  c.failure_count = 1;
  return c;
}

TEST(SimCameraFailure, freeze_repeats_the_picture_under_fresh_numbers) {
  const std::vector<Seen> seen = watch(failing(Failure::freeze), 990);
  ASSERT_EQ(seen.size(), 25U);
  std::set<std::size_t> pictures;
  for (std::size_t i = 0; i < 25; ++i) {
    EXPECT_EQ(seen[i].sequence, i);
    pictures.insert(seen[i].picture);
    if (i >= 6 && i <= 13) {
      EXPECT_EQ(seen[i].picture, seen[i - 1].picture) << i;
    }
  }
  EXPECT_LE(pictures.size(), 17U);
  EXPECT_NE(seen[20].picture, seen[21].picture);
}

TEST(SimCameraFailure, drop_leaves_a_gap) {
  const std::vector<Seen> seen = watch(failing(Failure::drop), 990);
  std::size_t gap = 0;
  for (std::size_t i = 1; i < seen.size(); ++i) {
    gap = std::max<std::size_t>(gap, seen[i].sequence - seen[i - 1].sequence);
  }
  EXPECT_GE(gap, 10U);
  EXPECT_EQ(seen.back().sequence, 24U);
}

TEST(SimCameraFailure, delay_gives_old_pictures_under_their_own_time) {
  const std::vector<Seen> seen = watch(failing(Failure::delay), 990);
  int late = 0;
  for (const Seen& s : seen) {
    EXPECT_EQ(s.exposure_ns, static_cast<std::int64_t>(std::max<std::uint64_t>(s.sequence * 40, 1)) * kMs);
    late += s.deliver_ns - s.exposure_ns > 250 * kMs ? 1 : 0;
  }
  EXPECT_GE(late, 2);
  EXPECT_EQ(seen.back().deliver_ns - seen.back().exposure_ns, 40 * kMs);
  EXPECT_EQ(seen, watch(failing(Failure::delay), 990));
}

// The picture at 0.3 s, and what a camera that draws none says then.
std::vector<std::uint8_t> picture(const SimConfig& config, hal::Status without_picture) {
  const auto bench = std::make_unique<LocalBench>();
  World world(config, bench.get(), 0);
  SimCamera camera(config, *bench, bench->camera);
  SimCamera blind(config, *bench, bench->camera, SimCamera::Picture::none);
  for (int i = 1; i <= 300; ++i) {
    world.step(i * kMs);
  }
  hal::Frame frame;
  EXPECT_EQ(blind.next(frame, 0), without_picture);
  EXPECT_EQ(camera.next(frame, 0), hal::Status::ok);
  return {frame.pixels, frame.pixels + frame.width * frame.height};
}

TEST(SimCameraFailure, a_white_picture_is_white_and_noise_is_noise) {
  for (const Failure kind : {Failure::saturate, Failure::nan}) {
    const std::vector<std::uint8_t> pixels = picture(failing(kind, 0), hal::Status::fault);
    double sum = 0;
    double sum2 = 0;
    for (const double grey : pixels) {
      sum += grey;
      sum2 += grey * grey;
    }
    const double n = static_cast<double>(pixels.size());
    const double mean = sum / n;
    const double variance = sum2 / n - mean * mean;
    if (kind == Failure::saturate) {
      EXPECT_EQ(mean, 255);
    } else {
      EXPECT_NEAR(mean, 127.5, 1);
      EXPECT_NEAR(variance, (256.0 * 256 - 1) / 12, 60);
    }
  }
}

TEST(SimCameraFailure, interference_is_added_to_the_picture_and_the_truth_has_none) {
  const std::vector<std::uint8_t> clean = picture(station(), hal::Status::ok);
  const std::vector<std::uint8_t> disturbed = picture(failing(Failure::noise, 0), hal::Status::ok);
  ASSERT_EQ(clean.size(), disturbed.size());
  double sum2 = 0;
  int n = 0;
  for (std::size_t i = 0; i < clean.size(); ++i) {
    const int off = disturbed[i] - clean[i];
    ASSERT_LE(std::abs(off), SimCamera::kInterference_grey);
    if (clean[i] < 60 || clean[i] > 195) {
      continue;  // nothing clips there
    }
    sum2 += 1.0 * off * off;
    ++n;
  }
  ASSERT_GT(n, 10'000);
  // Every whole number from -60 to 60 equally likely.
  EXPECT_NEAR(sum2 / n, (121.0 * 121 - 1) / 12, 30);
}

TEST(SimCameraFailure, disconnect_says_so_and_time_goes_on) {
  const std::vector<Seen> seen = watch(failing(Failure::disconnect), 990);
  const auto gone = std::count_if(seen.begin(), seen.end(),
                                  [](const Seen& s) { return s.status == hal::Status::disconnected; });
  EXPECT_GE(gone, 5);
  EXPECT_EQ(seen.back().status, hal::Status::ok);
  EXPECT_EQ(seen.back().sequence, 24U);
}

TEST(SimCamera, one_that_died_holding_a_frame_is_replaced_and_goes_on) {
  const SimConfig config = station();
  const auto bench = std::make_unique<LocalBench>();
  const VirtualCore core(config, *bench, 990);
  std::uint64_t last = 0;
  {
    SimCamera first(config, *bench, bench->camera);
    hal::Frame frame;
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(first.next(frame, kPatience), hal::Status::ok);
      last = frame.sequence;
      if (i < 4) {
        first.release(frame);
      }
    }
    bench->camera.pid.store(0);  // what its supervisor does when it was killed
  }
  SimCamera second(config, *bench, bench->camera);
  hal::Frame frame;
  int n = 0;
  while (second.next(frame, kPatience) == hal::Status::ok) {
    EXPECT_GT(frame.sequence, last);
    last = frame.sequence;
    second.release(frame);
    ++n;
  }
  // How far virtual time ran on alone meanwhile is not determined; that nothing hangs is.
  EXPECT_LE(last, 24U);
  EXPECT_LE(n, 20);
}

}  // namespace
