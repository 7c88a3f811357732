// A camera whose driver hangs while it is opened keeps nobody from stopping.
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <vector>

#include "tools/vision/camera_opening.hpp"

namespace punctum::tools {
namespace {

using namespace std::chrono_literals;

// Opens when it is let.
class SlowCamera final : public hal::LiveCamera {
 public:
  [[nodiscard]] tl::expected<void, std::string> open() override {
    answer.wait(false);
    return tl::unexpected(std::string("no such camera"));
  }
  void close() noexcept override {}
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return none_; }
  [[nodiscard]] const std::string& last_error() const noexcept override { return error_; }
  [[nodiscard]] const hal::CameraCounts& counts() const noexcept override { return counts_; }
  [[nodiscard]] hal::Status next(hal::Frame& /*out*/, std::int64_t /*timeout_ns*/) override {
    return hal::Status::disconnected;
  }
  void release(const hal::Frame& /*frame*/) override {}
  void let() {
    answer = true;
    answer.notify_all();
  }

  std::atomic<bool> answer{false};

 private:
  std::vector<std::string> none_;
  std::string error_;
  hal::CameraCounts counts_;
};

TEST(CameraOpening, one_that_hangs_keeps_nobody_from_stopping) {
  const auto camera = std::make_shared<SlowCamera>();
  int rounds = 0;
  const auto opened = open_unless_stopped(camera, 1ms, [&] { ++rounds; }, [&] { return rounds == 3; });
  EXPECT_FALSE(opened) << "it has not answered";
  EXPECT_EQ(rounds, 3) << "meanwhile whoever waits goes on";
  camera->let();
  while (camera.use_count() > 1) {
    std::this_thread::sleep_for(1ms);
  }
}

TEST(CameraOpening, what_a_slow_one_says_is_heard) {
  const auto camera = std::make_shared<SlowCamera>();
  const auto opened = open_unless_stopped(camera, 1ms, [&] { camera->let(); }, [] { return false; });
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->error(), "no such camera");
}

}  // namespace
}  // namespace punctum::tools
