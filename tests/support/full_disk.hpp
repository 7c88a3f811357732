// A folder of the test's own, on a disk that may become full.
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tools/shared/program_start.hpp"

namespace punctum {

class FullDisk : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before_), 0);
    std::string name = (std::filesystem::temp_directory_path() / "punctum-disk-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    tools::start_program();  // a file that may not grow is a write error from now on
  }
  void TearDown() override {
    has_room_again();
    std::filesystem::remove_all(folder_);
  }
  // No file may grow beyond so many bytes. It takes the place of a full disk: it needs no rights, and a
  // program sees the same, a write that fails.
  void full_beyond(rlim_t bytes) const {
    const rlimit limit{.rlim_cur = bytes, .rlim_max = before_.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  }
  void has_room_again() const { EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &before_), 0); }

  std::filesystem::path folder_;

 private:
  rlimit before_{};
};

}  // namespace punctum
