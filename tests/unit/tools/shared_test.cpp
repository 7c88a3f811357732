// What several programs share: CSV rows, segments handed to a child, signals that ask to stop, the version
// line.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/full_disk.hpp"
#include "tools/shared/child.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/event_words.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/row_file.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/station_segments.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/version.hpp"
#include "tools/shared/whole_file.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using Cells = std::vector<std::string_view>;

TEST(CsvTest, a_line_has_one_cell_more_than_commas) {
  EXPECT_EQ(split_csv(""), Cells({""}));
  EXPECT_EQ(split_csv("a"), Cells({"a"}));
  EXPECT_EQ(split_csv("a,b"), Cells({"a", "b"}));
  EXPECT_EQ(split_csv(",a,,"), Cells({"", "a", "", ""}));
}

TEST(CsvTest, a_reader_finds_cells_by_the_name_of_their_column) {
  const fs::path file = fs::temp_directory_path() / ("punctum-csv-" + std::to_string(::getpid()));
  std::ofstream(file) << "t_s,phase,x_m\n0.001,free,-1.5e-6\n0.002,contact,\n0.003\n";
  CsvReader table(file.string());
  EXPECT_TRUE(table.has("x_m"));
  EXPECT_FALSE(table.has("y_m"));
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.text("phase"), "free");
  EXPECT_EQ(table.number("x_m"), -1.5e-6);
  EXPECT_EQ(table.number("phase"), std::nullopt);
  EXPECT_EQ(table.number("y_m"), std::nullopt);
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.number("t_s"), 0.002);
  EXPECT_EQ(table.number("x_m"), std::nullopt) << "an empty cell is no zero";
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.text("phase"), "") << "the row is shorter than the header";
  EXPECT_FALSE(table.next());
  fs::remove(file);
}

TEST(CsvTest, a_file_that_is_not_there_has_no_rows) {
  CsvReader table("/nowhere/obs.csv");
  EXPECT_FALSE(table.has("t_s"));
  EXPECT_FALSE(table.next());
}

// ---- files ----

std::string read_all(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class FilesTest : public FullDisk {
 protected:
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
};

TEST_F(FilesTest, a_file_is_written_whole_and_nothing_lies_beside_it) {
  const fs::path file = folder_ / "report.json";
  ASSERT_TRUE(write_whole(file, "old"));
  ASSERT_TRUE(write_whole(file, "new and longer"));
  EXPECT_EQ(read_all(file), "new and longer");
  EXPECT_EQ(files(), 1U);
}

TEST_F(FilesTest, where_there_is_no_room_the_old_file_stays_and_no_half_of_the_new_one) {
  const fs::path file = folder_ / "report.json";
  ASSERT_TRUE(write_whole(file, "old"));
  full_beyond(1000);
  const auto written = write_whole(file, std::string(5000, 'x'));
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().find("report.json: cannot be written: "), std::string::npos) << written.error();
  EXPECT_EQ(read_all(file), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(FilesTest, what_has_the_name_of_a_work_file_is_not_written_to) {
  const fs::path file = folder_ / "a.csv", mine = folder_ / "mine";
  ASSERT_TRUE(write_whole(mine, "mine"));
  fs::create_symlink(mine, unfinished(file));
  ASSERT_TRUE(write_whole(file, "new"));
  EXPECT_EQ(read_all(file), "new");
  EXPECT_EQ(read_all(mine), "mine");
  EXPECT_TRUE(fs::is_symlink(unfinished(file)));
  EXPECT_EQ(files(), 3U);
}

TEST_F(FilesTest, a_folder_that_is_not_there_is_an_error_and_a_device_is_written_directly) {
  EXPECT_FALSE(write_whole(folder_ / "nowhere" / "a.csv", "x"));
  EXPECT_TRUE(write_whole("/dev/null", "x"));
  EXPECT_FALSE(write_whole("/dev/full", "x"));
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST_F(FilesTest, what_is_no_file_or_too_large_is_not_read_to_its_end) {
  const fs::path file = folder_ / "a.json", pipe = folder_ / "pipe", large = folder_ / "large";
  ASSERT_TRUE(write_whole(file, "{}\n"));
  EXPECT_EQ(read_whole(file), "{}\n");
  ASSERT_TRUE(write_whole(file, ""));
  EXPECT_EQ(read_whole(file), "");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const fs::path& none : {pipe, folder_, fs::path("/dev/zero")}) {
    EXPECT_EQ(read_whole(none).error(), none.string() + ": not a file");
  }
  EXPECT_EQ(read_whole(folder_ / "none").error(), (folder_ / "none").string() + ": cannot be read");
  std::ofstream(large) << "{";
  fs::resize_file(large, kReadMost + 1);
  EXPECT_EQ(read_whole(large).error(), large.string() + ": too large, allowed: at most 64 MB");
}

TEST_F(FilesTest, a_table_that_is_no_file_has_no_rows) {
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const fs::path& none : {pipe, fs::path("/dev/zero")}) {
    CsvReader table(none);
    EXPECT_TRUE(table.is_empty());
    EXPECT_FALSE(table.next());
  }
}

TEST_F(FilesTest, rows_do_not_wait_for_somebody_to_read_a_pipe) {
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(RowFile::open(pipe, RowFile::Begin::empty).error(),
            pipe.string() + ": cannot be written: nobody reads it");
}

TEST_F(FilesTest, an_output_is_the_same_file_by_whatever_name) {
  const fs::path file = folder_ / "a.csv", link = folder_ / "link";
  EXPECT_TRUE(same_file(file, folder_ / "." / "a.csv")) << "that is not there yet";
  ASSERT_TRUE(write_whole(file, "a"));
  fs::create_symlink(file, link);
  EXPECT_TRUE(same_file(file, link));
  EXPECT_FALSE(same_file(file, folder_ / "b.csv"));
  EXPECT_FALSE(same_file(folder_ / "b.csv", file));
  EXPECT_FALSE(same_file("/dev/null", "/dev/null"));
}

TEST_F(FilesTest, rows_are_written_in_order_and_continued) {
  const std::string file = folder_ / "samples.csv";
  {
    auto rows = RowFile::open(file, RowFile::Begin::empty);
    ASSERT_TRUE(rows);
    rows->append("t,x\n");
    rows->append("1,2\n");
  }
  auto more = RowFile::open(file, RowFile::Begin::after);
  ASSERT_TRUE(more);
  more->append("2,3\n");
  more->flush();
  EXPECT_EQ(read_all(file), "t,x\n1,2\n2,3\n");
  EXPECT_TRUE(more->failure().empty());
}

TEST_F(FilesTest, rows_that_find_no_room_are_cut_off_at_a_line_end_and_the_failure_is_told) {
  const std::string file = folder_ / "samples.csv";
  constexpr std::size_t kRoom = 105;  // in the middle of a row
  full_beyond(kRoom);
  auto rows = RowFile::open(file, RowFile::Begin::empty);
  ASSERT_TRUE(rows);
  std::string whole;
  for (int i = 0; i < 20; ++i) {
    const std::string row = "row " + std::to_string(i) + ",abc\n";
    if (whole.size() + row.size() <= kRoom) {
      whole += row;
    }
    rows->append(row);
  }
  rows->flush();
  EXPECT_FALSE(rows->failure().empty());
  EXPECT_EQ(read_all(file), whole);
  has_room_again();
  rows->append("later\n");
  rows->flush();
  EXPECT_EQ(read_all(file), whole) << "after a failure there are no rows: none is missing in between";
}

TEST_F(FilesTest, a_table_that_cannot_be_opened_is_an_error) {
  EXPECT_FALSE(RowFile::open(folder_ / "nowhere" / "a.csv", RowFile::Begin::empty));
}

// In a child, which returns 0 when all is as it should be.
int in_child(int (*work)()) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::_exit(work());
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST(ProgramStartTest, descriptors_0_to_2_exist_from_then_on) {
  EXPECT_EQ(in_child([] {
              ::close_range(0, ~0U, 0);
              start_program();
              struct stat null = {}, here = {};
              bool right = ::stat("/dev/null", &null) == 0;
              for (int fd = 0; fd < 3; ++fd) {
                right = right && ::fstat(fd, &here) == 0 && here.st_rdev == null.st_rdev;
              }
              return right && ::dup(0) == 3 ? 0 : 1;
            }),
            0);
}

TEST(ProgramStartTest, descriptors_that_are_there_stay_as_they_are) {
  EXPECT_EQ(in_child([] {
              int pipes[2];
              if (::pipe(pipes) != 0 || ::dup2(pipes[1], 1) != 1) {
                return 2;
              }
              ::close(0);
              start_program();
              char got = 0;
              return ::write(1, "x", 1) == 1 && ::read(pipes[0], &got, 1) == 1 && got == 'x' ? 0 : 1;
            }),
            0);
}

TEST(ProgramStartTest, a_file_that_may_not_grow_is_a_write_error) {
  EXPECT_EQ(in_child([] {
              start_program();
              const rlimit none{0, 0};
              std::FILE* file = std::tmpfile();
              ::setrlimit(RLIMIT_FSIZE, &none);
              return ::write(::fileno(file), "x", 1) < 0 && errno == EFBIG ? 0 : 1;
            }),
            0);
}

// ---- children ----

class ChildTest : public FilesTest {
 protected:
  // A shell script in the folder, which is looked for in PATH.
  [[nodiscard]] Child start(const std::string& script, const std::vector<int>& descriptors = {}) const {
    std::ofstream(folder_ / "a-child") << "#!/bin/sh\n" << script << "\n";
    fs::permissions(folder_ / "a-child", fs::perms::owner_all);
    ::setenv("PATH", (folder_.string() + ":/usr/bin:/bin").c_str(), 1);
    auto child = Child::start("a-child", {}, folder_ / "log", descriptors);
    EXPECT_TRUE(child) << child.error();
    return std::move(*child);
  }
  [[nodiscard]] bool says(const std::string& wanted) const {
    for (int i = 0; i < 3000; ++i, ::usleep(10'000)) {
      if (read_all(folder_ / "log") == wanted) {
        return true;
      }
    }
    return false;
  }
};

TEST_F(ChildTest, stands_outside_the_group_that_a_terminal_sends_ctrl_c_to) {
  const Child child = start("echo up; sleep 60");
  ASSERT_TRUE(says("up\n"));
  EXPECT_EQ(::getpgid(child.pid()), child.pid());
  EXPECT_NE(::getpgid(child.pid()), ::getpgrp());
}

TEST_F(ChildTest, goes_with_its_owner_even_if_it_ignores_what_asks_it_to_end) {
  pid_t pid = 0;
  {
    const Child child = start("trap '' TERM INT HUP; echo up; sleep 3; echo over");
    ASSERT_TRUE(says("up\n"));
    pid = child.pid();
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
  EXPECT_EQ(read_all(folder_ / "log"), "up\n") << "it was waited for";
}

TEST_F(ChildTest, inherits_the_descriptors_it_is_given_and_no_others) {
  const int given = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const int kept = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const auto there = [](int fd) {
    const std::string n = std::to_string(fd);
    return "test -e /proc/$$/fd/" + n + " && echo " + n + "; ";
  };
  const Child child = start(there(given) + there(kept) + "echo all", {given});
  EXPECT_TRUE(says(std::to_string(given) + "\nall\n")) << read_all(folder_ / "log");
  ::close(given);
  ::close(kept);
}

// The thread that starts the child ends before its process does: the kernel tells of both deaths.
TEST(StopSignalTest, the_death_of_the_parent_is_one_request_whichever_of_its_threads_die) {
  ASSERT_EQ(stop_signal::count(), 0);
  int ready[2];
  int told[2];
  ASSERT_EQ(::pipe(ready) + ::pipe(told), 0);
  const auto child = [&] {
    static int report = -1;
    report = told[1];
    stop_signal::watch({SIGTERM}, [](int count) noexcept {
      const char digit = static_cast<char>('0' + count);
      (void)!::write(report, stop_signal::parent_has_died() ? &digit : "-", 1);
    });
    const auto maker = static_cast<std::uint64_t>(::getppid());
    const bool alive_maker = stop_signal::watch_parent(maker);
    const bool dead_maker = stop_signal::watch_parent(1U << 30);  // no process has this number
    const char alive = alive_maker && !dead_maker ? 'y' : 'n';
    (void)!::write(ready[1], &alive, 1);
    ::alarm(10);
    for (;;) {
      ::pause();
    }
  };
  const pid_t parent = ::fork();
  if (parent == 0) {
    std::thread([&] {
      if (::fork() == 0) {
        child();
      }
      char c = 'n';
      (void)!::read(ready[0], &c, 1);
      (void)!::write(told[1], &c, 1);
    }).join();
    for (;;) {
      ::pause();
    }
  }
  ::close(told[1]);
  char c = 'n';
  ASSERT_EQ(::read(told[0], &c, 1), 1);
  EXPECT_EQ(c, 'y');
  ASSERT_EQ(::read(told[0], &c, 1), 1) << "the death of a thread was not told";
  EXPECT_EQ(c, '1');
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  ASSERT_EQ(::read(told[0], &c, 1), 1) << "the death of the process was not told";
  EXPECT_EQ(c, '1') << "a second death is no second request";
  for (const int fd : {ready[0], ready[1], told[0]}) {
    ::close(fd);
  }
}

std::atomic<int> woken{0};

TEST(StopSignalTest, signals_are_counted_and_wake_whoever_waits) {
  stop_signal::watch({SIGUSR1, SIGUSR2}, [](int count) noexcept { woken.store(count); });
  EXPECT_EQ(stop_signal::count(), 0);
  stop_signal::request();
  EXPECT_EQ(stop_signal::count(), 1);
  stop_signal::request();
  EXPECT_EQ(stop_signal::count(), 1) << "a request is not made twice";
  EXPECT_EQ(woken.load(), 0);
  ASSERT_EQ(::raise(SIGUSR1), 0);
  EXPECT_EQ(stop_signal::count(), 2);
  EXPECT_EQ(woken.load(), 2);
  ASSERT_EQ(::raise(SIGUSR2), 0);
  EXPECT_EQ(woken.load(), 3);
}

TEST(HandedSegments, are_the_same_after_their_way_through_an_argument) {
  HandedSegments handed;
  handed.add("core", 5);
  handed.add("commands.parent", 17);
  const auto parsed = HandedSegments::parse(handed.text());
  ASSERT_TRUE(parsed) << parsed.error();
  EXPECT_EQ(parsed->descriptor("core"), 5);
  EXPECT_EQ(parsed->descriptor("commands.parent"), 17);
  EXPECT_EQ(parsed->descriptor("bench"), -1);
  EXPECT_EQ(parsed->descriptors(), (std::vector<int>{5, 17}));
  for (const char* bad :
       {"core", "core=", "=5", "core=x", "core=-1", "core=5x", ",core=5", "core=99999999999"}) {
    EXPECT_FALSE(HandedSegments::parse(bad)) << bad;
  }
}

TEST(VersionTest, names_the_program_the_version_and_the_commit) {
  const std::string line = version_line("punctum-core");
  EXPECT_TRUE(std::regex_match(
      line, std::regex("punctum-core [0-9]+\\.[0-9]+ \\((unknown|[0-9a-f]{12,40}(\\+changes)?)\\)")))
      << line;
}

TEST(EventLine, names_a_target_only_where_a_command_has_one) {
  rt::Event e{
      .tick = 12, .t_s = 0.5, .kind = rt::Event::command, .what = rt::Command::effect_gain, .value = 0.25};
  e.writer = 1;
  e.target = 3;
  EXPECT_EQ(event_line(e), "0.500000,12,command,effect_gain,,0.25,damping,console\n");
  e.what = rt::Command::force_scale;
  EXPECT_EQ(event_line(e), "0.500000,12,command,force_scale,,0.25,,console\n");
  e.writer = 99;
  e.value = std::numeric_limits<double>::infinity();
  EXPECT_EQ(event_line(e), "0.500000,12,command,force_scale,,,,99\n");
}

}  // namespace
}  // namespace punctum::tools
