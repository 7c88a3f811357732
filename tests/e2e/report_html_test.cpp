// The report that a run leaves for a lab, what `punctum report` makes of a folder, and the words of the
// programs.
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/utsname.h>

#include <regex>

#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class LabReport : public Programs {
 protected:
  int program(const char* name, const Strings& args) {
    Running running(args, words(), name);
    const int code = running.wait();
    said_ = running.output();
    return code;
  }
  [[nodiscard]] std::string left(const std::string& file, const std::string& run = "r") const {
    return read_all(fs::path(report(run)) / file);
  }
};

TEST_F(LabReport, a_run_leaves_one_page_with_all_that_a_lab_asks) {
  const Strings run = {"run",       "free",
                       "--clock",   "virtual",
                       "--seconds", "1",
                       "--seed",    "77",
                       "--report",  report(),
                       "--set",     "sim.estop_press=[{at_s=0.5, for_s=0.1}]",
                       "--set",     "scene.title=\"<script>alert(1)</script>\""};
  ASSERT_EQ(program("punctum", run), 3) << said_;
  const std::string page = left("report.html");
  const auto r = json();
  utsname system{};
  uname(&system);
  for (const std::string& fact :
       {r["program"].get<std::string>(), r["begun_at"].get<std::string>(), std::string(system.release),
        std::string("seed 77"), std::string("1000 Hz"), std::string("latched fault, estop"),
        std::string("turn the pressed button"), std::string("<svg"), std::string("one tick of work"),
        std::string("ended"), std::string("&lt;script&gt;alert(1)"), std::string("seed = 77")}) {
    EXPECT_TRUE(contains(page, fact)) << fact;
  }
  EXPECT_FALSE(contains(page, "<script"));
  EXPECT_TRUE(contains(r["command_line"].get<std::string>(), "run free --clock virtual"));
  EXPECT_EQ(r["machine"]["real_time_kernel"], contains(system.version, "PREEMPT_RT"));
  EXPECT_EQ(r["tick_histogram"]["from_us"].size(), r["tick_histogram"]["count"].size());
  double ticks = r["tick_histogram"]["over"];
  for (const auto& n : r["tick_histogram"]["count"]) {
    ticks += n.get<double>();
  }
  EXPECT_EQ(ticks, r["ticks"].get<double>());
  EXPECT_TRUE(contains(left("figure.svg"), "fault: estop"));
  // What a terminal is told of the fault.
  EXPECT_TRUE(contains(said_, "what to do:  turn the pressed button")) << said_;
  EXPECT_TRUE(contains(said_, "cleared:")) << said_;
  EXPECT_FALSE(contains(said_, "\033")) << "colour into a pipe";
}

TEST_F(LabReport, is_made_again_from_what_a_crash_left_and_several_runs_are_compared) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "1", "--seed", "4"}, "a"), 0) << said_;
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "2", "--seed", "5"}, "b"), 0) << said_;
  const auto whole = json("a");
  const std::string samples = left("samples.csv", "a");
  for (const char* file : {"report.json", "report.html", "figure.svg"}) {
    fs::remove(fs::path(report("a")) / file);
  }
  const std::size_t last_row = samples.rfind('\n', samples.size() - 2) + 1;
  fs::resize_file(fs::path(report("a")) / "samples.csv", last_row + 40);  // in the middle of it
  const std::string out = (folder_ / "compared.html").string();
  for (const char* of_a_run : {"a/samples.csv", "b/report.html"}) {
    const std::string there = (folder_ / of_a_run).string(), before = read_all(there);
    EXPECT_EQ(program("punctum", {"report", report("a"), report("b"), "--out", there}), 2) << said_;
    EXPECT_TRUE(
        contains(said_, "--out: " + there + ": belongs to one of these reports, allowed: another file"))
        << said_;
    EXPECT_EQ(read_all(there), before);
  }
  ASSERT_EQ(program("punctum", {"report", report("a"), report("b"), "--out", out}), 0) << said_;
  const auto again = json("a");
  EXPECT_EQ(again["rebuilt"], true);
  EXPECT_EQ(again["samples"]["rows"].get<int>(), whole["samples"]["rows"].get<int>() - 1);
  EXPECT_EQ(again["samples"]["cut_off"], 1);
  EXPECT_EQ(again["outcome"], "done");  // events.csv has the core's last word
  EXPECT_EQ(again["events"].size(), whole["events"].size());
  for (const char* same : {"program", "begun_at", "machine", "scene", "rate_hz"}) {
    EXPECT_EQ(again[same], whole[same]) << same;
  }
  // samples.csv has nine digits.
  EXPECT_NEAR(again["peak_hand_force_N"].get<double>(), whole["peak_hand_force_N"].get<double>(), 1e-9);
  EXPECT_TRUE(again["page_faults"].is_null());
  EXPECT_TRUE(contains(left("report.html", "a"), "rebuilt"));
  EXPECT_TRUE(contains(left("report.html", "a"), "<svg"));
  const std::string page = read_all(out);
  EXPECT_TRUE(contains(page, ">a<") && contains(page, ">b<"));
  EXPECT_TRUE(contains(page, "<svg") && contains(page, "±"));
  EXPECT_TRUE(contains(said_, "unknown") || contains(said_, "done")) << said_;
}

TEST_F(LabReport, of_a_folder_without_a_run_is_refused) {
  fs::create_directories(report());
  EXPECT_EQ(program("punctum", {"report", report()}), 2);
  EXPECT_TRUE(contains(said_, "no report of a run")) << said_;
  EXPECT_TRUE(fs::is_empty(report()));
}

TEST_F(LabReport, samples_can_be_read_row_by_row_while_they_grow) {
  Running run({"run", "free", "--seconds", "3", "--report", report(), "--no-figure", "--set", kPatientRelay},
              words());
  const fs::path file = fs::path(report()) / "samples.csv";
  int with_rows = 0;
  for (int i = 0; i < 6000 && alive(run.pid()); ++i, std::this_thread::sleep_for(20ms)) {
    std::string text = read_all(file);
    for (int again = 0; again < 20 && !text.empty() && text.back() != '\n';
         ++again) {  // in the middle of a write
      std::this_thread::sleep_for(5ms);
      text = read_all(file);
    }
    if (!text.empty()) {
      ASSERT_EQ(text.back(), '\n');
      with_rows += std::count(text.begin(), text.end(), '\n') > 1 ? 1 : 0;
    }
    if (fs::exists(fs::path(report()) / "report.json")) {
      break;
    }
  }
  EXPECT_GE(with_rows, 2) << "nothing could be read before the run was over";
  EXPECT_EQ(run.wait(), 0) << run.output();
}

TEST_F(LabReport, no_number_tells_of_conversions_between_units) {
  ASSERT_EQ(punctum({"run", "free", "--clock", "virtual", "--seconds", "1"}), 0) << said_;
  // Twelve digits are enough; 0.030000000000000002 has seventeen.
  const std::regex too_long("[0-9]\\.[0-9]{15,}");
  EXPECT_FALSE(std::regex_search(left("report.json"), too_long));
}

// ---- the command lines ----

TEST_F(LabReport, help_has_examples_and_exit_codes_and_no_type_of_a_library) {
  const std::vector<std::pair<const char*, Strings>> calls = {
      {"punctum", {"--help"}},
      {"punctum", {"run", "--help"}},
      {"punctum", {"explain", "--help"}},
      {"punctum", {"check", "--help"}},
      {"punctum", {"report", "--help"}},
      {"punctum-core", {"--help"}},
      {"punctum-report", {"--help"}},
#ifdef PUNCTUM_WITH_VISION
      {"punctum-vision", {"--help"}},
      {"punctum-vision", {"track", "--help"}},
#endif
  };
  const std::regex type("\\b(TEXT|FLOAT|INT|UINT|REQUIRED)\\b|:\\{|\\bin \\[");
  for (const auto& [name, args] : calls) {
    ASSERT_EQ(program(name, args), 0) << name << ": " << said_;
    EXPECT_TRUE(contains(said_, "Exit codes:")) << name << " " << args[0] << ": " << said_;
    EXPECT_TRUE(contains(said_, "  0  ")) << said_;
    EXPECT_TRUE(contains(said_, "Examples:") || args.size() > 1) << said_;
    EXPECT_FALSE(std::regex_search(said_, type)) << said_;
  }
}

TEST_F(LabReport, what_is_mistyped_is_answered_with_what_was_meant) {
  const std::vector<std::tuple<const char*, Strings, const char*>> calls = {
      {"punctum", {"rnu", "icsi"}, "did you mean run?"},
      {"punctum", {"run", "icis"}, "did you mean icsi?"},
      {"punctum", {"run", "icsi", "--sede", "4"}, "did you mean --seed?"},
      {"punctum", {"run", "icsi", "--clok=real"}, "did you mean --clock?"},
      {"punctum", {"run", "icsi", "--set", "servo.rat_hz=1000"}, "did you mean rate_hz?"},
      {"punctum", {"run", "icsi", "--set", "membrane.law=papre"}, "did you mean paper?"},
      {"punctum-report", {"frce"}, "did you mean force?"},
      {"punctum-report", {"force", "--qiuck"}, "did you mean --quick?"},
#ifdef PUNCTUM_WITH_VISION
      {"punctum-vision", {"trakc"}, "did you mean track?"},
      {"punctum-vision", {"track", "--frame", "x"}, "did you mean --frames?"},
#endif
  };
  for (const auto& [name, args, meant] : calls) {
    EXPECT_EQ(program(name, args), 2) << said_;
    EXPECT_TRUE(contains(said_, meant)) << meant << ": " << said_;
    EXPECT_EQ(std::count(said_.begin(), said_.end(), '\n'), 1) << said_;
  }
}

TEST_F(LabReport, a_number_that_is_none_or_too_large_is_refused_with_those_that_are_allowed) {
  const std::vector<std::tuple<const char*, Strings, const char*>> calls = {
      {"punctum-positioner", {"--start", "nan"}, "--start: nan, allowed: from 0 to 533333\n"},
      {"punctum-positioner", {"--start", "1e6"}, "--start: 1e6, allowed: from 0 to 533333\n"},
      {"punctum-positioner", {"--devices", "10"}, "--devices: 10, allowed: from 1 to 9\n"},
      {"punctum-positioner", {"--devices", "two"}, "--devices: two, allowed: from 1 to 9\n"},
  };
  for (const auto& [name, args, refusal] : calls) {
    EXPECT_EQ(program(name, args), 2) << said_;
    EXPECT_EQ(said_, refusal);
  }
}

// ---- the terminal ----

// What a program writes to a terminal of that many columns.
std::string on_terminal(const Strings& args, const char* no_color, unsigned short columns) {
  winsize size{};
  size.ws_col = columns;
  size.ws_row = 24;
  int master = -1;
  const pid_t pid = forkpty(&master, nullptr, nullptr, &size);
  if (pid == 0) {
    setenv("TERM", "xterm", 1);
    unsetenv("NO_COLOR");
    if (no_color != nullptr) {
      setenv("NO_COLOR", no_color, 1);
    }
    const std::string program = std::string(PUNCTUM_BIN_DIR) + "/punctum";
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const auto& a : args) {
      argv.push_back(const_cast<char*>(a.c_str()));
    }
    argv.push_back(nullptr);
    execv(program.c_str(), argv.data());
    _exit(127);
  }
  std::string text;
  char buffer[4096];
  for (ssize_t n = 0; (n = read(master, buffer, sizeof buffer)) > 0;) {
    text.append(buffer, static_cast<std::size_t>(n));
  }
  close(master);
  waitpid(pid, nullptr, 0);
  return text;
}

TEST_F(LabReport, colour_is_for_terminals_that_want_it_and_the_live_line_fits_them) {
  const auto run = [this](const char* name) {
    return Strings{"run",        "free",        "--seconds", "2",          "--report",
                   report(name), "--no-figure", "--set",     kPatientRelay};
  };
  const std::regex colour("\033\\[[0-9;]*m");
  const std::string wide = on_terminal(run("a"), nullptr, 120);
  EXPECT_TRUE(std::regex_search(wide, colour)) << wide;
  EXPECT_TRUE(contains(wide, " s left")) << wide;
  const std::string plain = on_terminal(run("b"), "1", 40);
  EXPECT_FALSE(std::regex_search(plain, colour)) << plain;
  // Each drawing of the live line begins with a return and ends before the next control character.
  const std::regex drawn("\r\033\\[K([^\r\n\033]+)");
  int lines = 0;
  for (std::sregex_iterator it(plain.begin(), plain.end(), drawn), end; it != end; ++it, ++lines) {
    EXPECT_LT((*it)[1].length(), 40) << it->str();
  }
  EXPECT_GE(lines, 2) << plain;
}

#ifdef PUNCTUM_WITH_VISION
TEST_F(LabReport, recorded_runs_on_the_frames_that_come_with_it) {
  const fs::path elsewhere = folder_ / "elsewhere";
  fs::create_directories(elsewhere);
  fs::current_path(elsewhere);
  // How soon a picture is stale is another test's; here each one has to be seen, however slow the machine.
  const int code = program("punctum", {"run", "recorded", "--report", report(), "--set", kPatientRelay,
                                       "--set", "local_model.stale_after_s=5", "--set", "camera.fps=2"});
  fs::current_path("/");
  EXPECT_EQ(code, 0) << said_;
  const auto r = json();
  EXPECT_GT(r["observations"], 20);
  const Table seen(fs::path(report()) / "obs.csv");
  int punctured = 0;
  for (std::size_t i = 0; i < seen.rows.size(); ++i) {
    punctured += seen.text(i, "punctured") == "1" ? 1 : 0;
  }
  EXPECT_GT(punctured, 0);
  const std::string page = left("report.html");
  EXPECT_TRUE(contains(page, "data:image/jpeg;base64,"));
}

TEST_F(LabReport, a_run_on_pictures_that_show_nothing_was_without_vision) {
  const fs::path blank = folder_ / "blank";
  fs::create_directories(blank);
  for (int i = 0; i < 10; ++i) {
    std::ofstream(blank / (std::to_string(i) + ".pgm")) << "P5 320 240 255\n"
                                                        << std::string(320 * 240, '\x80');
  }
  EXPECT_EQ(program("punctum", {"run", "recorded", "--report", report(), "--set", kPatientRelay, "--set",
                                "camera.frames=" + blank.string()}),
            1)
      << said_;
  EXPECT_EQ(json()["outcome"], "without vision") << said_;
}
#endif

}  // namespace
}  // namespace punctum::e2e
