// The parent's hold on the core: a shell script stands in place of the core, and the test's own numbers in
// place of the time.
#include "tools/punctum/core_process.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class CoreProcessTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "punctum-core-process-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    // Programs are looked for beside this one, then in PATH.
    std::ofstream(folder_ / "punctum-core")
        << "#!/bin/sh\ntrap 'echo asked' TERM\necho up\nfor i in $(seq 6000); do sleep 0.02; done\n";
    fs::permissions(folder_ / "punctum-core", fs::perms::owner_all);
    setenv("PATH", (folder_.string() + ":" + getenv("PATH")).c_str(), 1);
    ASSERT_TRUE(core_.start({}, (folder_ / "log").string(), {}));
    ASSERT_TRUE(says("up\n"));
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Waits until the script has said exactly this.
  [[nodiscard]] bool says(const std::string& wanted) const {
    for (int i = 0; i < 3000; ++i, std::this_thread::sleep_for(10ms)) {
      std::ifstream in(folder_ / "log");
      if (std::string(std::istreambuf_iterator<char>(in), {}) == wanted) {
        return true;
      }
    }
    return false;
  }
  [[nodiscard]] bool lives() {
    std::this_thread::sleep_for(100ms);
    Ended how;
    return !core_.ended(how);
  }
  [[nodiscard]] bool was_killed() {
    Ended how;
    for (int i = 0; i < 3000; ++i, std::this_thread::sleep_for(10ms)) {
      if (core_.ended(how)) {
        return how.signal == SIGKILL;
      }
    }
    return false;
  }
  // A round of the parent in which the core has ticked.
  void tick_and_watch(double now_s, int stop_signals) {
    segment_->status.started.store(1);
    segment_->status.ticks.fetch_add(1);
    core_.watch(now_s, stop_signals);
  }

  fs::path folder_;
  std::unique_ptr<rt::CoreSegment> segment_ = std::make_unique<rt::CoreSegment>();
  rt::CommandQueue commands_;
  Terminal terminal_;
  CoreProcess core_{*segment_, commands_, true, terminal_};
};

TEST_F(CoreProcessTest, the_first_stop_signal_is_a_command_the_second_asks_and_the_third_kills) {
  rt::Command command;
  tick_and_watch(1, 0);
  EXPECT_FALSE(commands_.try_pop(command));
  tick_and_watch(2, 1);
  ASSERT_TRUE(commands_.try_pop(command));
  EXPECT_EQ(command.kind, rt::Command::stop);
  EXPECT_TRUE(core_.stop_was_asked());
  EXPECT_TRUE(lives());
  EXPECT_TRUE(says("up\n"));
  tick_and_watch(2, 2);
  ASSERT_TRUE(says("up\nasked\n"));
  EXPECT_TRUE(lives());
  tick_and_watch(2, 3);
  EXPECT_TRUE(was_killed());
}

TEST_F(CoreProcessTest, a_core_that_does_not_answer_is_asked_again_and_then_killed) {
  tick_and_watch(1, 1);
  tick_and_watch(5.9, 1);
  EXPECT_TRUE(lives());
  EXPECT_TRUE(says("up\n"));
  tick_and_watch(6.1, 1);
  ASSERT_TRUE(says("up\nasked\n"));
  tick_and_watch(11, 1);
  EXPECT_TRUE(lives());
  tick_and_watch(11.2, 1);
  EXPECT_TRUE(was_killed());
}

TEST_F(CoreProcessTest, a_core_that_hangs_in_its_set_up_is_killed) {
  core_.watch(0.1, 0);
  core_.watch(9.9, 0);
  EXPECT_TRUE(lives());
  core_.watch(10.1, 0);
  EXPECT_TRUE(was_killed());
}

TEST_F(CoreProcessTest, a_core_that_hangs_in_its_loop_is_killed) {
  tick_and_watch(7, 0);
  core_.watch(8.9, 0);
  EXPECT_TRUE(lives());
  core_.watch(9.1, 0);
  EXPECT_TRUE(was_killed());
}

TEST_F(CoreProcessTest, a_core_that_hangs_in_its_shut_down_is_killed) {
  tick_and_watch(7, 0);
  segment_->status.counters_final.store(1);
  core_.watch(8, 0);
  core_.watch(17.9, 0);
  EXPECT_TRUE(lives());
  core_.watch(18.1, 0);
  EXPECT_TRUE(was_killed());
}

}  // namespace
}  // namespace punctum::tools
