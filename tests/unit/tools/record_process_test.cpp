// The parent's hold on the recording: a shell script stands in place of the recorder.
#include "tools/punctum/record_process.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "hal/ipc/sealed_text.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class RecordProcessTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "punctum-record-process-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    // Programs are looked for beside this one, then in PATH.
    setenv("PATH", (folder_.string() + ":/usr/bin:/bin").c_str(), 1);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void start(const std::string& script) {
    std::ofstream(folder_ / "punctum-record") << "#!/bin/sh\n" << script << "\n";
    fs::permissions(folder_ / "punctum-record", fs::perms::owner_all);
    const auto scene = hal::seal_text("scene", "");
    ASSERT_TRUE(scene) << scene.error();
    ASSERT_TRUE(record_.tell_progress("station-" + std::to_string(getpid())));
    const auto started = record_.start("station", *scene, folder_.string());
    ASSERT_TRUE(started) << started.error();
  }

  fs::path folder_;
  RecordProcess record_;
};

TEST_F(RecordProcessTest, one_that_is_content_before_the_run_has_ended_is_told_all_the_same) {
  start("echo well done");
  std::string why;
  for (int i = 0; i < 1000 && record_.is_running() && why.empty(); ++i, std::this_thread::sleep_for(10ms)) {
    why = record_.watch();
  }
  EXPECT_EQ(why, "punctum-record ended before the run had ended");
  EXPECT_EQ(record_.watch(), "") << "once";
  EXPECT_EQ(record_.end(), "");
}

TEST_F(RecordProcessTest, one_that_was_content_when_the_end_came_has_not_recorded_it) {
  start("trap 'exit 0' TERM\necho ready\nwhile :; do sleep 0.02; done");
  for (int i = 0; i < 1000 && fs::file_size(folder_ / "record.log") == 0;
       ++i, std::this_thread::sleep_for(10ms)) {
  }
  EXPECT_EQ(record_.end(), "punctum-record ended before the run had ended");
}

TEST_F(RecordProcessTest, one_that_fails_tells_its_last_words) {
  start("trap 'echo no room; exit 1' TERM\necho ready\nwhile :; do sleep 0.02; done");
  for (int i = 0; i < 1000 && fs::file_size(folder_ / "record.log") == 0;
       ++i, std::this_thread::sleep_for(10ms)) {
  }
  EXPECT_EQ(record_.end(), "punctum-record ended with code 1: no room");
}

}  // namespace
}  // namespace punctum::tools
