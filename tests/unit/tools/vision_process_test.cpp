// The parent's hold on vision: a shell script stands in place of vision, and the test's own numbers in place
// of the time.
#include "tools/punctum/vision_process.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using News = VisionProcess::News;

class VisionProcessTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "punctum-vision-process-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    // Programs are looked for beside this one, then in PATH.
    setenv("PATH", (folder_.string() + ":/usr/bin:/bin").c_str(), 1);
  }
  void TearDown() override { fs::remove_all(folder_); }

  // What stands in place of vision; it notes each start.
  void vision_is(const std::string& script) const {
    std::ofstream(folder_ / "punctum-vision")
        << "#!/bin/sh\necho once more >>" << (folder_ / "starts").string() << "\n"
        << script << "\n";
    fs::permissions(folder_ / "punctum-vision", fs::perms::owner_all);
  }
  [[nodiscard]] std::ptrdiff_t starts() const {
    std::ifstream in(folder_ / "starts");
    return std::count(std::istreambuf_iterator<char>(in), {}, '\n');
  }
  [[nodiscard]] bool has_started(std::ptrdiff_t times) const {
    for (int i = 0; i < 1000 && starts() < times; ++i) {
      std::this_thread::sleep_for(10ms);
    }
    return starts() == times;
  }
  // It lives until watch_until() lets it die, and not longer.
  [[nodiscard]] std::string dies_when_told() const {
    return "for i in $(seq 6000); do test -e " + (folder_ / "die").string() + " && exit 1; sleep 0.02; done";
  }
  // Watches at one moment until something is new or as many restarts were noted as wanted.
  News watch_until(double now_s, std::size_t restarts) {
    std::ofstream(folder_ / "die") << "now";
    const News news = news_at(now_s, restarts);
    fs::remove(folder_ / "die");
    return news;
  }
  News news_at(double now_s, std::size_t restarts) {
    for (int i = 0; i < 1000; ++i, std::this_thread::sleep_for(10ms)) {
      const News news = vision_.watch(now_s, now_s);
      if (news != News::none || vision_.restarts().size() >= restarts) {
        return news;
      }
    }
    ADD_FAILURE() << "nothing came";
    return News::none;
  }

  fs::path folder_;
  std::atomic<std::uint64_t> rounds_{0};
  Terminal terminal_;
  VisionProcess vision_{{}, {}, "/dev/null", &rounds_, true, terminal_};
};

TEST_F(VisionProcessTest, that_dies_again_and_again_is_started_at_once_then_ever_slower_and_then_no_more) {
  vision_is(dies_when_told());
  ASSERT_TRUE(vision_.start());
  double now_s = 10;
  double pause_s = 0;  // before the next start
  for (std::size_t n = 1; n <= 5; ++n) {
    ASSERT_EQ(watch_until(now_s, n), News::none);
    ASSERT_EQ(starts(), static_cast<std::ptrdiff_t>(n));
    if (pause_s > 0) {
      (void)vision_.watch(now_s + 0.9 * pause_s, 0);
      std::this_thread::sleep_for(100ms);  // a start would show
      EXPECT_EQ(starts(), static_cast<std::ptrdiff_t>(n)) << "too early";
    }
    now_s += 1.01 * pause_s;
    (void)vision_.watch(now_s, 0);
    ASSERT_TRUE(has_started(static_cast<std::ptrdiff_t>(n) + 1));
    pause_s = pause_s > 0 ? 2 * pause_s : 0.2;
  }
  EXPECT_EQ(watch_until(now_s, 99), News::given_up);
  EXPECT_TRUE(vision_.over());
  EXPECT_EQ(vision_.restarts().size(), 6U) << "the last is the one that was given up";
  for (double later_s = now_s; later_s < now_s + 200; ++later_s) {
    EXPECT_EQ(vision_.watch(later_s, 0), News::none);
  }
  EXPECT_EQ(starts(), 6);
}

TEST_F(VisionProcessTest, that_dies_now_and_then_is_started_for_ever) {
  vision_is(dies_when_told());
  ASSERT_TRUE(vision_.start());
  for (std::size_t n = 1; n <= 12; ++n) {
    const double now_s = 100 * static_cast<double>(n);
    ASSERT_EQ(watch_until(now_s, n), News::none);
    (void)vision_.watch(now_s + 1, 0);
    ASSERT_TRUE(has_started(static_cast<std::ptrdiff_t>(n) + 1));
  }
  EXPECT_FALSE(vision_.over());
}

TEST_F(VisionProcessTest, that_does_not_go_round_is_killed_and_started_again) {
  vision_is("exec sleep 120");
  ASSERT_TRUE(vision_.start());
  double now_s = 0;
  for (; now_s < 60; now_s += 0.1) {  // it works
    rounds_.fetch_add(1);
    ASSERT_EQ(vision_.watch(now_s, now_s), News::none);
  }
  ASSERT_EQ(vision_.restarts().size(), 0U);
  for (const double hung_s = now_s;
       now_s < hung_s + 2 * VisionWatchdog::kHung_s && vision_.restarts().empty(); now_s += 0.1) {
    ASSERT_EQ(vision_.watch(now_s, now_s), News::none);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(watch_until(now_s, 1), News::none);
  ASSERT_EQ(vision_.restarts().size(), 1U);
  EXPECT_NE(vision_.restarts()[0].why.find("hung for"), std::string::npos) << vision_.restarts()[0].why;
  (void)vision_.watch(now_s, now_s);
  EXPECT_TRUE(has_started(2));
}

TEST_F(VisionProcessTest, whose_input_is_bad_is_not_started_again) {
  vision_is("exit 2");
  ASSERT_TRUE(vision_.start());
  EXPECT_EQ(watch_until(1, 1), News::refused);
  EXPECT_TRUE(vision_.over());
  EXPECT_EQ(vision_.restarts().size(), 0U);
  EXPECT_EQ(vision_.watch(100, 100), News::none);
  EXPECT_EQ(starts(), 1);
}

TEST_F(VisionProcessTest, that_has_come_to_the_end_of_its_frames_is_over) {
  vision_is("exit 0");
  ASSERT_TRUE(vision_.start());
  EXPECT_EQ(watch_until(1, 1), News::frames_ended);
  EXPECT_TRUE(vision_.over());
  EXPECT_EQ(vision_.watch(100, 100), News::none);
  EXPECT_EQ(starts(), 1);
}

}  // namespace
}  // namespace punctum::tools
