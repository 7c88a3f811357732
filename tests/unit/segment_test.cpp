// Shared segments: who may see them, and what a crash leaves behind.
#include "hal/segment.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <optional>
#include <string>

#include "rt/station/station.hpp"

namespace punctum::hal {
namespace {

struct Board {
  static constexpr std::uint64_t kMagic = 0xb0a2d;
  static constexpr std::uint64_t kLayout = fingerprint(1, 2, 3);
  SegmentHeader header;
  Word word{};
  std::uint64_t preset = 42;
};

struct NewerBoard : Board {
  static constexpr std::uint64_t kLayout = fingerprint(1, 2, 4);
};

struct OtherThing : Board {
  static constexpr std::uint64_t kMagic = 0x07e2;
};

class SegmentTest : public testing::Test {
 protected:
  std::string name = "test-" + std::to_string(::getpid()) + "-" +
                     testing::UnitTest::GetInstance()->current_test_info()->name();
  [[nodiscard]] std::string file() const { return "/dev/shm/punctum." + name; }
  [[nodiscard]] bool exists() const { return ::access(file().c_str(), F_OK) == 0; }

  // Runs work in a child; returns its wait status.
  static int in_child(const std::function<int()>& work) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(work());
    int status = 0;
    ::waitpid(child, &status, 0);
    return status;
  }

  // A child that owns the segment and waits; returns when it does.
  [[nodiscard]] pid_t owner_in_child() const {
    int ready[2];
    if (::pipe(ready) != 0) return -1;
    const pid_t child = ::fork();
    if (child == 0) {
      auto board = Shared<Board>::create(name);
      const char c = board ? 'y' : 'n';
      if (::write(ready[1], &c, 1) != 1) ::_exit(1);
      for (;;) ::pause();
    }
    char c = 'n';
    EXPECT_EQ(::read(ready[0], &c, 1), 1);
    EXPECT_EQ(c, 'y');
    ::close(ready[0]);
    ::close(ready[1]);
    return child;
  }
  static void kill_hard(pid_t child) {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
};

TEST_F(SegmentTest, BelongsToItsUserAloneWhateverTheUmask) {
  for (const mode_t mask : {mode_t{0}, mode_t{022}, mode_t{0777}}) {
    const mode_t before = ::umask(mask);
    auto board = Shared<Board>::create(name);
    ::umask(before);
    ASSERT_TRUE(board) << board.error();
    struct stat info = {};
    ASSERT_EQ(::stat(file().c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777U, 0600U);
  }
}

TEST_F(SegmentTest, IsGoneWhenItsOwnerEnds) {
  {
    auto board = Shared<Board>::create(name);
    ASSERT_TRUE(board) << board.error();
    EXPECT_TRUE(exists());
    Shared<Board> moved = std::move(*board);
    EXPECT_EQ(moved->preset, 42U);
  }
  EXPECT_FALSE(exists());
}

TEST_F(SegmentTest, SeveralReadersSeeWhatTheOwnerWrites) {
  auto board = Shared<Board>::create(name);
  ASSERT_TRUE(board) << board.error();
  auto one = Shared<const Board>::attach(name);
  auto two = Shared<const Board>::attach(name);
  auto writer = Shared<Board>::attach(name);
  ASSERT_TRUE(one && two && writer);
  (*writer)->word.store(7);
  EXPECT_EQ((*board)->word.load(), 7U);
  EXPECT_EQ((*one)->word.load(), 7U);
  EXPECT_EQ((*two)->word.load(), 7U);
  EXPECT_EQ((*two)->preset, 42U);
}

TEST_F(SegmentTest, AReaderThatWritesDiesInsteadOfHarmingTheStation) {
  auto board = Shared<Board>::create(name);
  ASSERT_TRUE(board) << board.error();
  const int status = in_child([this] {
    ::signal(SIGSEGV, SIG_DFL);
    auto reader = Shared<const Board>::attach(name);
    if (!reader) return 0;
    const_cast<Board&>(**reader).word.store(13);
    return 0;
  });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGSEGV);
  EXPECT_EQ((*board)->word.load(), 0U);
}

TEST_F(SegmentTest, ASecondOwnerIsRefusedAndToldWhoHasIt) {
  const pid_t owner = owner_in_child();
  auto second = Shared<Board>::create(name);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().find("in use by process " + std::to_string(owner)), std::string::npos)
      << second.error();
  EXPECT_TRUE(Shared<const Board>::attach(name)) << "the owner's segment is untouched";
  kill_hard(owner);
  remove_stale_segments();
}

TEST_F(SegmentTest, WhatAKilledOwnerLeavesBehindIsRefusedToReadersAndReclaimedByTheNextOwner) {
  const pid_t owner = owner_in_child();
  kill_hard(owner);
  ASSERT_TRUE(exists());
  auto reader = Shared<const Board>::attach(name);
  ASSERT_FALSE(reader);
  EXPECT_NE(reader.error().find("owner is gone"), std::string::npos) << reader.error();
  auto next = Shared<Board>::create(name);
  ASSERT_TRUE(next) << next.error();
  EXPECT_EQ((*next)->header.owner_pid, static_cast<std::uint64_t>(::getpid()));
  EXPECT_TRUE(Shared<const Board>::attach(name));
}

TEST_F(SegmentTest, SweepingRemovesTheDeadAndLeavesTheLiving) {
  const pid_t owner = owner_in_child();
  remove_stale_segments();
  EXPECT_TRUE(exists());
  kill_hard(owner);
  EXPECT_GE(remove_stale_segments(), 1U);
  EXPECT_FALSE(exists());
}

TEST_F(SegmentTest, CreatingOneSegmentCleansUpAfterCrashesUnderOtherNames) {
  const pid_t owner = owner_in_child();
  kill_hard(owner);
  ASSERT_TRUE(exists());
  auto other = Shared<Board>::create(name + "-other");
  ASSERT_TRUE(other) << other.error();
  EXPECT_FALSE(exists());
}

TEST_F(SegmentTest, AnotherVersionIsRefusedWithAClearMessage) {
  auto board = Shared<Board>::create(name);
  ASSERT_TRUE(board) << board.error();
  const auto newer = Shared<const NewerBoard>::attach(name);
  ASSERT_FALSE(newer);
  EXPECT_NE(newer.error().find("another version of punctum"), std::string::npos) << newer.error();
  const auto other = Shared<const OtherThing>::attach(name);
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().find("something else"), std::string::npos) << other.error();
}

TEST_F(SegmentTest, AMissingSegmentIsSaidToBeMissing) {
  const auto board = Shared<const Board>::attach(name);
  ASSERT_FALSE(board);
  EXPECT_NE(board.error().find("does not exist"), std::string::npos) << board.error();
}

TEST_F(SegmentTest, ASegmentThatOthersCouldWriteIsNotTrusted) {
  auto board = Shared<Board>::create(name);
  ASSERT_TRUE(board) << board.error();
  ASSERT_EQ(::chmod(file().c_str(), 0666), 0);
  const auto reader = Shared<const Board>::attach(name);
  ASSERT_FALSE(reader);
  EXPECT_NE(reader.error().find("not trusted"), std::string::npos) << reader.error();
}

TEST_F(SegmentTest, NamesThatCouldLeaveTheirDirectoryAreRefused) {
  for (const char* bad : {"", "../x", "a/b", "a b", "\n"}) {
    EXPECT_FALSE(Shared<Board>::create(bad)) << bad;
    EXPECT_FALSE(Shared<const Board>::attach(bad)) << bad;
  }
}

TEST_F(SegmentTest, MoreMemoryThanThereIsIsRefusedInsteadOfKillingLater) {
  const auto segment = Segment::create(name, std::size_t{1} << 46);
  ASSERT_FALSE(segment);
  EXPECT_NE(segment.error().find("MiB"), std::string::npos) << segment.error();
  EXPECT_FALSE(exists());
}

TEST_F(SegmentTest, OfSeveralProcessesThatCreateAtOnceExactlyOneWinsEveryTime) {
  for (int round = 0; round < 50; ++round) {
    if (round % 2 == 1) kill_hard(owner_in_child());  // with and without a stale one in the way
    int go[2];
    int result[2];
    int end[2];
    ASSERT_EQ(::pipe(go) + ::pipe(result) + ::pipe(end), 0);
    constexpr int kProcesses = 4;
    pid_t children[kProcesses];
    for (pid_t& child : children) {
      child = ::fork();
      if (child == 0) {
        ::close(go[1]);
        ::close(end[1]);
        char c = 0;
        (void)!::read(go[0], &c, 1);  // returns when the parent closes it
        {
          auto board = Shared<Board>::create(name);
          c = board ? 'y' : 'n';
          (void)!::write(result[1], &c, 1);
          (void)!::read(end[0], &c, 1);
        }
        ::_exit(0);
      }
    }
    ::close(go[1]);
    int winners = 0;
    for (int i = 0; i < kProcesses; ++i) {
      char c = 'n';
      ASSERT_EQ(::read(result[0], &c, 1), 1);
      winners += c == 'y' ? 1 : 0;
    }
    ::close(end[1]);
    for (const pid_t child : children) ::waitpid(child, nullptr, 0);
    for (const int fd : {go[0], result[0], result[1], end[0]}) ::close(fd);
    ASSERT_EQ(winners, 1) << "round " << round;
    ASSERT_FALSE(exists());
  }
}

TEST_F(SegmentTest, TheStationFitsAndItsReadersSeeTheTelemetry) {
  auto station = Shared<rt::Station>::create(name);
  ASSERT_TRUE(station) << station.error();
  auto reader = Shared<const rt::Station>::attach(name);
  ASSERT_TRUE(reader) << reader.error();
  rt::TelemetrySample sample;
  sample.tick = 5;
  sample.wd_m = 3e-6;
  (*station)->telemetry.push(sample);
  rt::TelemetrySample got;
  std::uint64_t index = 99;
  ASSERT_EQ((*reader)->telemetry.newest(got, index), Read::ok);
  EXPECT_EQ(index, 0U);
  EXPECT_EQ(got.tick, 5U);
  EXPECT_EQ(got.wd_m, 3e-6);
}

}  // namespace
}  // namespace punctum::hal
