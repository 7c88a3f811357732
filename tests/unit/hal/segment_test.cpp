// Shared segments: who may see and change them, how others find them, what a crash leaves behind.
#include "hal/ipc/segment.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "hal/ipc/rendezvous.hpp"
#include "hal/ipc/sealed_text.hpp"
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

  std::string station_name = "test-" + std::to_string(::getpid());

  // Runs work in a child; returns its wait status.
  static int in_child(const std::function<int()>& work) {
    const pid_t child = ::fork();
    if (child == 0) {
      ::_exit(work());
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return status;
  }
  static bool mappable_for_writing(int fd) {
    void* data = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (data != MAP_FAILED) {
      ::munmap(data, 4096);
    }
    return data != MAP_FAILED;
  }
};

TEST_F(SegmentTest, several_readers_see_what_the_owner_writes) {
  auto board = Shared<Board>::create(name);
  ASSERT_TRUE(board) << board.error();
  const int fd = board->segment().descriptor();
  auto one = Shared<const Board>::attach(name, fd);
  auto two = Shared<const Board>::attach(name, fd);
  auto writer = Shared<Board>::attach(name, fd);
  ASSERT_TRUE(one && two && writer);
  (*writer)->word.store(7);
  EXPECT_EQ((*board)->word.load(), 7U);
  EXPECT_EQ((*one)->word.load(), 7U);
  EXPECT_EQ((*two)->word.load(), 7U);
  EXPECT_EQ((*two)->preset, 42U);
  Shared<Board> moved = std::move(*board);
  EXPECT_EQ(moved->preset, 42U);
}

TEST_F(SegmentTest, nobody_can_resize_it_not_even_its_maker) {
  auto board = Shared<Board>::create(name);
  ASSERT_TRUE(board) << board.error();
  const int fd = board->segment().descriptor();
  for (const off_t size : {off_t{0}, off_t{1}, off_t{1} << 30}) {
    EXPECT_EQ(::ftruncate(fd, size), -1) << size;
    EXPECT_EQ(errno, EPERM);
  }
  EXPECT_EQ(::fallocate(fd, 0, 0, 1 << 20), -1);
  EXPECT_EQ((*board)->preset, 42U);
}

TEST_F(SegmentTest, memory_that_can_be_resized_is_not_trusted) {
  const Descriptor plain(::memfd_create("plain", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  ASSERT_EQ(::ftruncate(plain.number(), sizeof(Board)), 0);
  auto refused = Shared<const Board>::attach(name, plain.number());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("not trusted"), std::string::npos) << refused.error();
  ASSERT_EQ(::fcntl(plain.number(), F_ADD_SEALS, F_SEAL_SHRINK), 0);  // it may still grow
  refused = Shared<const Board>::attach(name, plain.number());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("not trusted"), std::string::npos) << refused.error();
}

TEST_F(SegmentTest, a_readers_descriptor_and_mapping_cannot_be_made_writable) {
  auto board = Shared<Board>::create(name);
  ASSERT_TRUE(board) << board.error();
  EXPECT_TRUE(mappable_for_writing(board->segment().descriptor()));
  auto for_reading = board->segment().read_only_descriptor();
  ASSERT_TRUE(for_reading) << for_reading.error();
  EXPECT_FALSE(mappable_for_writing(for_reading->number()));
  EXPECT_FALSE(Shared<Board>::attach(name, for_reading->number()));
  const auto reader = Shared<const Board>::attach(name, for_reading->number());
  ASSERT_TRUE(reader) << reader.error();
  EXPECT_EQ(::mprotect(reader->segment().data(), reader->segment().size(), PROT_READ | PROT_WRITE), -1);
  // Opened anew for writing: refused to a user by the mode; root may do anything.
  struct stat info = {};
  ASSERT_EQ(::fstat(for_reading->number(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777U, 0400U);
}

TEST_F(SegmentTest, a_reader_that_writes_dies_instead_of_harming_the_station) {
  auto board = Shared<Board>::create(name);
  ASSERT_TRUE(board) << board.error();
  const int status = in_child([&] {
    ::signal(SIGSEGV, SIG_DFL);
    auto reader = Shared<const Board>::attach(name, board->segment().descriptor());
    if (!reader) {
      return 0;
    }
    const_cast<Board&>(**reader).word.store(13);
    return 0;
  });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGSEGV);
  EXPECT_EQ((*board)->word.load(), 0U);
}

TEST_F(SegmentTest, another_version_is_refused_with_a_clear_message) {
  auto board = Shared<Board>::create(name);
  ASSERT_TRUE(board) << board.error();
  const int fd = board->segment().descriptor();
  const auto newer = Shared<const NewerBoard>::attach(name, fd);
  ASSERT_FALSE(newer);
  EXPECT_NE(newer.error().find("another version of punctum"), std::string::npos) << newer.error();
  const auto other = Shared<const OtherThing>::attach(name, fd);
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().find("something else"), std::string::npos) << other.error();
}

// A page and more beyond what a Board has, under the same name and layout.
struct LargeBoard : Board {
  Word more[1024] = {};
};

// Sealed memory of `bytes`, whose header claims that a LargeBoard of `claimed` bytes lies in it.
Descriptor forged(std::size_t bytes, std::size_t claimed) {
  Descriptor made(::memfd_create("punctum.forged", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  SegmentHeader header;
  header.magic.store(LargeBoard::kMagic);
  header.layout = LargeBoard::kLayout;
  header.size = claimed;
  EXPECT_EQ(::ftruncate(made.number(), static_cast<off_t>(bytes)), 0);
  EXPECT_EQ(::pwrite(made.number(), static_cast<const void*>(&header), sizeof header, 0),
            static_cast<ssize_t>(sizeof header));
  EXPECT_EQ(::fcntl(made.number(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL), 0);
  return made;
}

TEST_F(SegmentTest, memory_of_another_size_is_refused_whatever_its_header_claims) {
  const std::size_t right = sizeof(LargeBoard);
  const auto attaches = [this](const Descriptor& memory) {
    return Shared<const LargeBoard>::attach(name, memory.number()).has_value();
  };
  EXPECT_TRUE(attaches(forged(right, right)));
  EXPECT_FALSE(attaches(forged(sizeof(Board), right))) << "whoever read it to its end would be killed";
  EXPECT_FALSE(attaches(forged(sizeof(SegmentHeader) - 8, right)));
  EXPECT_FALSE(attaches(forged(right + 4096, right)));
  EXPECT_FALSE(attaches(forged(right, right + 8)));
  EXPECT_FALSE(attaches(forged(right, 0)));
}

TEST_F(SegmentTest, a_text_that_was_handed_over_can_be_read_again_and_again_and_changed_by_nobody) {
  const std::string text(100'000, 'a');
  auto sealed = seal_text(name, text + "b");
  ASSERT_TRUE(sealed) << sealed.error();
  for (int i = 0; i < 2; ++i) {
    std::ifstream in(inherited_path(*sealed));
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), text + "b");
  }
  EXPECT_LT(::pwrite(sealed->number(), "x", 1, 0), 0);
  EXPECT_NE(::ftruncate(sealed->number(), 0), 0);
  EXPECT_FALSE(mappable_for_writing(sealed->number()));
  const Descriptor again(::open(inherited_path(*sealed).c_str(), O_RDWR | O_CLOEXEC));
  EXPECT_LT(::pwrite(again.number(), "x", 1, 0), 0);
}

TEST_F(SegmentTest, a_missing_segment_is_said_to_be_missing) {
  const auto board = Shared<const Board>::attach(name, -1);
  ASSERT_FALSE(board);
  EXPECT_NE(board.error().find("was not handed over"), std::string::npos) << board.error();
}

TEST_F(SegmentTest, more_memory_than_there_is_is_refused_instead_of_killing_later) {
  const auto segment = Segment::create(name, std::size_t{1} << 46);
  ASSERT_FALSE(segment);
  EXPECT_NE(segment.error().find("MiB"), std::string::npos) << segment.error();
}

// ---- the rendezvous ----

TEST_F(SegmentTest, who_joins_a_station_gets_what_it_offers_and_no_more) {
  auto station = Rendezvous::open(station_name);
  ASSERT_TRUE(station) << station.error();
  auto board = Shared<Board>::create("board");
  ASSERT_TRUE(board);
  station->offer("board", std::move(*board->segment().read_only_descriptor()));
  int go[2];
  ASSERT_EQ(::pipe(go), 0);
  const pid_t visitor = ::fork();
  if (visitor == 0) {
    const auto joined = Joined::join(station_name);
    if (!joined || joined->descriptor("other") != -1) {
      ::_exit(1);
    }
    const auto seen = Shared<const Board>::attach("board", joined->descriptor("board"));
    ::_exit(seen && (*seen)->preset == 42 && !mappable_for_writing(joined->descriptor("board")) ? 0 : 2);
  }
  int status = 0;
  for (int i = 0; i < 2000 && ::waitpid(visitor, &status, WNOHANG) == 0; ++i) {
    station->serve();
    ::usleep(1000);
  }
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

TEST_F(SegmentTest, a_visitor_that_leaves_before_it_is_served_holds_up_nobody) {
  auto station = Rendezvous::open(station_name);
  ASSERT_TRUE(station) << station.error();
  station->serve();  // nobody there
  const int status = in_child([this] {
    ::alarm(1);
    ::signal(SIGALRM, [](int) { ::_exit(0); });
    (void)Joined::join(station_name);  // nobody serves it
    return 0;
  });
  EXPECT_TRUE(WIFEXITED(status));
  station->serve();
}

TEST_F(SegmentTest, the_name_of_a_station_is_taken_once_and_free_when_its_holder_was_killed) {
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t holder = ::fork();
  if (holder == 0) {
    const auto station = Rendezvous::open(station_name);
    const char c = station ? 'y' : 'n';
    (void)!::write(ready[1], &c, 1);
    for (;;) {
      ::pause();
    }
  }
  char c = 'n';
  ASSERT_EQ(::read(ready[0], &c, 1), 1);
  ASSERT_EQ(c, 'y');
  const auto second = Rendezvous::open(station_name);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().find("already running"), std::string::npos) << second.error();
  ::kill(holder, SIGKILL);
  ::waitpid(holder, nullptr, 0);
  EXPECT_FALSE(Joined::join(station_name));
  EXPECT_TRUE(Rendezvous::open(station_name));
}

TEST_F(SegmentTest, names_that_are_none_are_refused) {
  for (const std::string& bad : {std::string(), std::string("../x"), std::string("a/b"), std::string("a b"),
                                 std::string("\n"), std::string(81, 'a')}) {
    EXPECT_FALSE(Rendezvous::open(bad)) << bad;
    EXPECT_FALSE(Joined::join(bad)) << bad;
  }
}

// ---- segments with one writer ----

struct Diary {  // as the core's and vision's segments: one writes, all read
  static constexpr bool kOneWriter = true;
  static constexpr std::uint64_t kMagic = 0xd1a27;
  static constexpr std::uint64_t kLayout = fingerprint(1);
  SegmentHeader header;
  Word word{};
};

template <class T>
concept CanAttach = requires { Shared<T>::attach("", 0); };
template <class T>
concept CanCreate = requires { Shared<T>::create(""); };
template <class T>
concept CanClaim = requires { Shared<T>::claim("", 0); };
// Nobody gets such a segment for writing but by claiming it.
static_assert(!CanAttach<Diary> && !CanCreate<Diary> && CanClaim<Diary>);
static_assert(CanAttach<const Diary> && CanCreate<const Diary> && !CanClaim<const Diary>);
static_assert(!CanAttach<rt::CoreSegment> && !CanCreate<rt::CoreSegment>);
static_assert(!CanAttach<rt::ObservationSegment> && !CanCreate<rt::ObservationSegment>);
// What is mapped read-only is also const to the compiler.
static_assert(std::is_same_v<decltype(*std::declval<Shared<const Diary>>()), const Diary&>);

TEST_F(SegmentTest, the_owner_of_a_segment_with_one_writer_dies_when_it_writes_to_it) {
  const auto diary = Shared<const Diary>::create(name);
  ASSERT_TRUE(diary) << diary.error();
  const int status = in_child([&diary] {
    ::signal(SIGSEGV, SIG_DFL);
    const_cast<Diary&>(**diary).word.store(13);
    return 0;
  });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGSEGV);
  EXPECT_EQ((*diary)->word.load(), 0U);
}

TEST_F(SegmentTest, everybody_sees_what_the_one_writer_writes) {
  const auto diary = Shared<const Diary>::create(name);
  ASSERT_TRUE(diary) << diary.error();
  const auto writer = Shared<Diary>::claim(name, diary->segment().descriptor());
  ASSERT_TRUE(writer) << writer.error();
  (*writer)->word.store(7);
  const auto reader = Shared<const Diary>::attach(name, diary->segment().descriptor());
  ASSERT_TRUE(reader) << reader.error();
  EXPECT_EQ((*diary)->word.load(), 7U);
  EXPECT_EQ((*reader)->word.load(), 7U);
}

TEST_F(SegmentTest, a_second_writer_is_refused_and_told_who_writes) {
  const auto diary = Shared<const Diary>::create(name);
  ASSERT_TRUE(diary) << diary.error();
  {
    const auto first = Shared<Diary>::claim(name, diary->segment().descriptor());
    ASSERT_TRUE(first) << first.error();
    const auto second = Shared<Diary>::claim(name, diary->segment().descriptor());
    ASSERT_FALSE(second);
    EXPECT_NE(second.error().find("already written by process " + std::to_string(::getpid())),
              std::string::npos)
        << second.error();
    const int status =
        in_child([&] { return Shared<Diary>::claim(name, diary->segment().descriptor()) ? 1 : 0; });
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "another process could write as well";
    (*first)->word.store(1);
  }
  EXPECT_TRUE(Shared<Diary>::claim(name, diary->segment().descriptor()))
      << "a writer that ended is still in the way";
  EXPECT_EQ((*diary)->word.load(), 1U);
}

TEST_F(SegmentTest, the_next_writer_may_claim_what_a_killed_one_held) {
  const auto diary = Shared<const Diary>::create(name);
  ASSERT_TRUE(diary) << diary.error();
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t writer = ::fork();
  if (writer == 0) {
    const auto mine = Shared<Diary>::claim(name, diary->segment().descriptor());
    const char c = mine ? 'y' : 'n';
    if (::write(ready[1], &c, 1) != 1) {
      ::_exit(1);
    }
    for (;;) {
      ::pause();
    }
  }
  char c = 'n';
  ASSERT_EQ(::read(ready[0], &c, 1), 1);
  ASSERT_EQ(c, 'y');
  EXPECT_FALSE(Shared<Diary>::claim(name, diary->segment().descriptor()));
  ::kill(writer, SIGKILL);
  ::waitpid(writer, nullptr, 0);
  EXPECT_TRUE(Shared<Diary>::claim(name, diary->segment().descriptor()));
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST_F(SegmentTest, of_several_processes_that_claim_at_once_exactly_one_writes) {
  const auto diary = Shared<const Diary>::create(name);
  ASSERT_TRUE(diary) << diary.error();
  for (int round = 0; round < 50; ++round) {
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
        const auto mine = Shared<Diary>::claim(name, diary->segment().descriptor());
        c = mine ? 'y' : 'n';
        (void)!::write(result[1], &c, 1);
        (void)!::read(end[0], &c, 1);
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
    for (const pid_t child : children) {
      ::waitpid(child, nullptr, 0);
    }
    for (const int fd : {go[0], result[0], result[1], end[0]}) {
      ::close(fd);
    }
    ASSERT_EQ(winners, 1) << "round " << round;
  }
}

// ---- the station ----

TEST_F(SegmentTest, the_readers_of_the_cores_segment_see_its_telemetry_through_a_read_only_mapping) {
  const auto parent = Shared<const rt::CoreSegment>::create(name);
  ASSERT_TRUE(parent) << parent.error();
  const auto core = Shared<rt::CoreSegment>::claim(name, parent->segment().descriptor());
  ASSERT_TRUE(core) << core.error();
  rt::TelemetrySample sample;
  sample.tick = 5;
  sample.wd_m = 3e-6;
  (*core)->telemetry.push(sample);
  Follower follower((*parent)->telemetry);
  rt::TelemetrySample got;
  ASSERT_EQ(follower.next(got), Read::ok);
  EXPECT_EQ(got.tick, 5U);
  EXPECT_EQ(got.wd_m, 3e-6);
  EXPECT_EQ(follower.next(got), Read::not_yet);
}

TEST_F(SegmentTest, a_command_of_a_named_writer_reaches_the_core) {
  const auto writer = Shared<rt::CommandSegment>::create(name);
  ASSERT_TRUE(writer) << writer.error();
  const auto core = Shared<rt::CommandSegment>::attach(name, writer->segment().descriptor());
  ASSERT_TRUE(core) << core.error();
  ASSERT_TRUE((*writer)->queue.try_push({rt::Command::force_scale, 0.5}));
  rt::Command got;
  ASSERT_TRUE((*core)->queue.try_pop(got));
  EXPECT_EQ(got.kind, rt::Command::force_scale);
  EXPECT_EQ(got.value, 0.5);
  EXPECT_FALSE((*core)->queue.try_pop(got));
}

}  // namespace
}  // namespace punctum::hal
