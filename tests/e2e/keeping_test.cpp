// What a run keeps when the machine under it fails: full disks, output that nobody takes, earlier reports,
// a parent that is too slow. The programs as built, started as a person starts them.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

// A shell's exit code.
int shell(const std::string& command) {
  const int status = std::system(("bash -c '" + command + "'").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

std::string program(const std::string& name) { return std::string(PUNCTUM_BIN_DIR) + "/" + name; }

// The lines of a table that are not like the others: a table cut in the middle of a row has one.
std::size_t broken_lines(const fs::path& csv) {
  std::istringstream in(read_all(csv));
  std::size_t broken = 0;
  std::ptrdiff_t commas = -1;
  for (std::string line; std::getline(in, line);) {
    const auto here = std::count(line.begin(), line.end(), ',');
    commas = commas < 0 ? here : commas;
    broken += here != commas || in.eof() ? 1U : 0U;  // eof: the last line has no end
  }
  return broken;
}

// Files that were not finished. A program that ends leaves none.
std::size_t unfinished_files(const fs::path& folder) {
  std::size_t n = 0;
  for (const auto& file : fs::recursive_directory_iterator(folder)) {
    n += file.path().filename().string().find(".part") != std::string::npos ? 1U : 0U;
  }
  return n;
}

// ---- words ----

TEST_F(Programs, words_that_cannot_be_written_end_no_program) {
  int programs = 0;
  for (const auto& entry : fs::directory_iterator(PUNCTUM_BIN_DIR)) {
    const std::string name = entry.path().filename().string();
    const int code = shell(program(name) + " --no-such-option nosuch >/dev/full 2>/dev/full");
    EXPECT_GE(code, 1) << name;
    EXPECT_LE(code, 3) << name << ": beyond 128 a signal has killed it";
    ++programs;
  }
  EXPECT_GE(programs, 2);
  EXPECT_EQ(shell(program("punctum") + " run nosuch 2>/dev/full"), 2);
  EXPECT_EQ(shell(program("punctum") + " explain nosuch 2>/dev/full"), 2);
}

TEST_F(Programs, a_result_that_cannot_be_written_is_no_success) {
  for (const char* args : {"explain icsi", "explain icsi --keys", "check free", "--version", "--help"}) {
    const int code = shell(program("punctum") + " " + args + " >/dev/full 2>" + words().string());
    EXPECT_EQ(code, 1) << args;
    const std::string said = read_all(words());
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << args << ": " << said;
    EXPECT_NE(said.find("cannot be written"), std::string::npos) << said;
  }
}

TEST_F(Programs, whose_words_are_their_result_do_not_end_well_where_these_are_lost) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "2", "--no-figure", "--record"}), 0);
  const std::string recording = report() + "/recording.mcap";
  ASSERT_EQ(shell(program("punctum-jitter") + " --seconds 0.2 --json " + report() + "/a.json >/dev/null"), 0);
  const Strings commands{"punctum report " + report(),
                         "punctum-replay " + recording,
                         "punctum-export " + recording + " --csv " + report() + "/tables",
                         "punctum-jitter --seconds 0.2",
                         "punctum-jitter diff " + report() + "/a.json " + report() + "/a.json",
                         "punctum-report force --quick --out " + report() + "/force"};
  for (const std::string& command : commands) {
    EXPECT_EQ(shell(program(command) + " >/dev/full 2>" + words().string()), 1) << command;
    EXPECT_NE(read_all(words()).find("the standard output cannot be written"), std::string::npos)
        << command << ": " << read_all(words());
  }
}

TEST_F(Programs, a_pipe_that_nobody_reads_any_more_ends_no_run) {
  const std::string run =
      program("punctum") + " run free --clock virtual --seconds 1 --no-figure --report " + report() + " 2>&1";
  EXPECT_EQ(shell("(sleep 0.5; " + run + ") | true; exit ${PIPESTATUS[0]}"), 0);
  EXPECT_EQ(json()["outcome"], "done");
}

TEST_F(Programs, a_title_gives_the_terminal_no_orders) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1", "--set",
                     R"(scene.title="a\u001b]0;owned\u0007 \u001b[31mred\u009b2J")"}),
            0)
      << said_;
  EXPECT_EQ(said_.find('\x1b'), std::string::npos);
  EXPECT_EQ(said_.find('\x07'), std::string::npos);
  EXPECT_EQ(said_.find("\xc2\x9b"), std::string::npos);
  EXPECT_NE(said_.find("red"), std::string::npos) << said_;
  ASSERT_EQ(punctum({"explain", report() + "/scene.toml"}), 0) << said_;
  EXPECT_EQ(said_.find('\x1b'), std::string::npos);
}

// ---- a disk that fills ----

TEST_F(Programs, a_run_whose_files_cannot_grow_goes_on_and_says_at_once_what_it_does_not_keep) {
  Running run({"run", "free", "--clock", "virtual", "--seconds", "60", "--no-figure", "--report", report()},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  let_no_file_grow(run.pid(), 200'000);
  EXPECT_EQ(run.wait(), 1) << run.output();
  const std::string said = run.output();
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done") << said;
  EXPECT_GE(r["ticks"], 60'000) << "it went on to its end";
  EXPECT_LT(r["samples"]["rows"], 60'000);
  ASSERT_EQ(r["not_kept"].size(), 1U) << said;
  EXPECT_EQ(r["not_kept"][0]["file"], "samples.csv");
  const auto told = said.find("samples.csv is not kept from here on");
  EXPECT_NE(told, std::string::npos) << said;
  EXPECT_LT(told, said.find("outcome")) << said;
  const fs::path samples = fs::path(report()) / "samples.csv";
  EXPECT_GT(fs::file_size(samples), 1000U);
  EXPECT_EQ(broken_lines(samples), 0U);
  EXPECT_EQ(unfinished_files(report()), 0U);
  EXPECT_FALSE(fs::exists(fs::path(report()) / "reserve"));
}

TEST_F(Programs, a_table_that_somebody_removes_is_not_kept_and_the_run_says_so) {
  Running run({"run", "free", "--clock", "virtual", "--seconds", "60", "--no-figure", "--report", report()},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  fs::remove(fs::path(report()) / "samples.csv");
  EXPECT_EQ(run.wait(), 1) << run.output();
  const auto r = json();
  EXPECT_EQ(r["outcome"], "done");
  ASSERT_EQ(r["not_kept"].size(), 1U) << run.output();
  EXPECT_EQ(r["not_kept"][0]["file"], "samples.csv");
  EXPECT_EQ(r["not_kept"][0]["why"], "it was removed meanwhile");
}

TEST_F(Programs, files_that_find_no_room_at_all_are_not_there_and_the_exit_code_says_so) {
  Running run({"run", "free", "--clock", "virtual", "--seconds", "60", "--report", report()}, words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  let_no_file_grow(run.pid(), 1000);  // too little even for report.json
  EXPECT_EQ(run.wait(), 1) << run.output();
  EXPECT_FALSE(fs::exists(fs::path(report()) / "report.json"));
  EXPECT_FALSE(fs::exists(fs::path(report()) / "figure.png"));
  EXPECT_EQ(unfinished_files(report()), 0U);
  EXPECT_EQ(broken_lines(fs::path(report()) / "samples.csv"), 0U);
  EXPECT_NE(run.output().find("report.json: cannot be written"), std::string::npos) << run.output();
}

TEST_F(Programs, a_run_that_may_write_more_than_there_is_room_for_says_so_before_it_begins) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.1", "--samples-every", "1"}), 0);
  EXPECT_EQ(said_.find("MB are free"), std::string::npos) << said_;
  // At its time limit it has written terabytes.
  Running long_run({"run", "free", "--seconds", "1000000", "--rate", "8000", "--samples-every", "1",
                    "--report", report("l"), "--no-figure"},
                   words("l"));
  for (int i = 0; i < 500 && long_run.output().find("report:") == std::string::npos; ++i) {
    std::this_thread::sleep_for(10ms);
  }
  long_run.send(SIGINT);
  (void)long_run.wait();
  EXPECT_NE(long_run.output().find("MB are free on the disk of the report"), std::string::npos)
      << long_run.output();
}

// ---- earlier reports ----

TEST_F(Programs, a_run_leaves_an_earlier_report_alone_and_says_where_it_writes_instead) {
  const Strings args{"run", "free",     "--clock", "virtual",    "--seconds",
                     "0.5", "--report", report(),  "--no-figure"};
  Running first(args, words("1"));
  ASSERT_EQ(first.wait(), 0) << first.output();
  const std::string before = read_all(fs::path(report()) / "report.json");
  Running second(args, words("2"));
  EXPECT_EQ(second.wait(), 0) << second.output();
  EXPECT_TRUE(read_all(fs::path(report()) / "report.json") == before);
  EXPECT_EQ(json("r-2")["outcome"], "done");
  EXPECT_NE(second.output().find("report: " + report("r-2")), std::string::npos) << second.output();
  EXPECT_NE(second.output().find("--overwrite"), std::string::npos) << second.output();
}

TEST_F(Programs, with_overwrite_the_new_report_takes_the_place_of_the_old_one_and_other_files_stay) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "1", "--set",
                     "sim.estop_press=[{at_s=0.5}]"}),
            3)
      << said_;
  ASSERT_TRUE(fs::exists(fs::path(report()) / "fault.csv"));
  std::ofstream(fs::path(report()) / "notes.txt") << "mine";
  std::ofstream(fs::path(report()) / "recording.mcap") << "of the old run";
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.5"}), 0) << said_;
  EXPECT_EQ(json()["outcome"], "done");
  EXPECT_LT(json()["seconds"], 0.8);
  EXPECT_FALSE(fs::exists(fs::path(report()) / "fault.csv")) << "of the old run";
  EXPECT_FALSE(fs::exists(fs::path(report()) / "recording.mcap"));
  EXPECT_EQ(read_all(fs::path(report()) / "notes.txt"), "mine");
  EXPECT_FALSE(fs::exists(report("r-2")));
}

TEST_F(Programs, with_overwrite_the_old_report_stays_until_the_new_one_is_whole) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "0.5"}), 0) << said_;
  const std::string before = read_all(fs::path(report()) / "report.json");
  const std::string samples = read_all(fs::path(report()) / "samples.csv");
  // One that dies on the way, and one that cannot begin: its core is not there.
  {
    Running run({"run", "free", "--seconds", "60", "--report", report(), "--overwrite", "--no-figure"},
                words("killed"));
    Look look("free", run);
    ASSERT_TRUE(look.until_started()) << run.output();
    run.send(SIGKILL);
    run.wait();
  }
  const fs::path alone = folder_ / "alone";
  fs::create_directory(alone);
  fs::copy_file(program("punctum"), alone / "punctum");
  EXPECT_EQ(shell("PATH=/usr/bin:/bin " + (alone / "punctum").string() +
                  " run free --clock virtual --seconds 1 --overwrite --report " + report() + " >" +
                  words("alone").string() + " 2>&1"),
            2)
      << read_all(words("alone"));
  EXPECT_TRUE(read_all(fs::path(report()) / "report.json") == before);
  EXPECT_TRUE(read_all(fs::path(report()) / "samples.csv") == samples);
}

// ---- samples that are lost ----

TEST_F(Programs, samples_that_a_stopped_parent_did_not_read_are_told_and_what_they_may_hold_is_not) {
  Running run({"run", "free", "--rate", "8000", "--seconds", "60", "--set", kPatientRelay, "--report",
               report(), "--no-figure", "--quiet"},
              words());
  Look look("free", run);
  ASSERT_TRUE(look.until_started()) << run.output();
  run.send(SIGSTOP);
  const std::uint64_t from = look.ticks();
  constexpr std::uint64_t kRing = 8192, kMore = 4000;
  for (int i = 0; i < 6000 && look.ticks() < from + kRing + kMore; ++i) {
    std::this_thread::sleep_for(10ms);
  }
  const std::uint64_t passed = look.ticks() - from;
  run.send(SIGCONT);
  ASSERT_GE(passed, kRing + kMore) << "the core has not ticked on";
  std::this_thread::sleep_for(100ms);
  run.send(SIGINT);
  EXPECT_EQ(run.wait(), 1) << run.output();
  const auto r = json();
  EXPECT_GE(r["samples"]["lost"].get<std::uint64_t>(), passed - kRing) << run.output();
  EXPECT_EQ(r["not_kept"].at(0)["file"], "samples.csv");
  EXPECT_TRUE(r["peak_hand_force_N"].is_null());
  EXPECT_NE(r["sentence"].get<std::string>().find("samples of it are missing"), std::string::npos);
  EXPECT_NE(run.output().find("were overwritten before they were read"), std::string::npos) << run.output();
}

}  // namespace
}  // namespace punctum::e2e
