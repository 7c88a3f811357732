// Recordings as a person makes them: with a run, of a station that runs, killed and on a full disk.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/descendants.hpp"
#include "tests/support/programs.hpp"

namespace punctum::e2e {
namespace {

using Strings = std::vector<std::string>;

class Recordings : public Programs {
 protected:
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_ / name).string(); }
  int run(const char* program, const Strings& args) {
    Running running(args, words("other"), program);
    const int code = running.wait();
    said_ = running.output();
    return code;
  }
  [[nodiscard]] static std::string replayed_ticks(std::size_t n) {
    return ": " + std::to_string(n) + " ticks, to ";
  }
  // The numbers of a data set, as h5dump prints them.
  [[nodiscard]] Strings dumped(const std::string& nwb, const std::string& set) const {
    EXPECT_EQ(
        std::system(("h5dump -y -w 1 -m %.9g -d " + set + " -o " + file("dumped") + " " + nwb + " >/dev/null")
                        .c_str()),
        0);
    Strings values;
    std::ifstream in(file("dumped"));
    for (std::string word; in >> word;) {
      values.push_back(word.ends_with(',') ? word.substr(0, word.size() - 1) : word);
    }
    return values;
  }
  // Samples of an exported recording; the tables go to folder `name`.
  [[nodiscard]] Table exported(const std::string& recording, const std::string& name, int expected_code) {
    EXPECT_EQ(run("punctum-export", {recording, "--csv", file(name)}), expected_code) << said_;
    return Table(file(name) + "/samples.csv");
  }
};

TEST_F(Recordings, a_recorded_run_is_exported_byte_for_byte_as_the_run_wrote_it) {
  const int code = punctum({"run", "icsi", "--clock", "virtual", "--seconds", "6", "--record", "--quiet",
                            "--set", "vision.surface=true"});
  EXPECT_EQ(code, 1) << said_;
  const std::string recording = report() + "/recording.mcap";
  ASSERT_EQ(run("punctum-export", {recording, "--csv", file("t"), "--obj", file("cell"), "--at", "5.5"}), 0)
      << said_;
  EXPECT_EQ(read_all(file("t") + "/samples.csv"), read_all(report() + "/samples.csv"));
  EXPECT_EQ(read_all(file("t") + "/events.csv"), read_all(report() + "/events.csv"));
  EXPECT_EQ(read_all(file("t") + "/scene.toml"), read_all(report() + "/scene.toml"));
  const Table observations(file("t") + "/observations.csv");
  EXPECT_GT(observations.rows.size(), 100U);
  const std::string obj = read_all(file("cell.obj"));
  EXPECT_NE(obj.find("\no outer\n"), std::string::npos);
  EXPECT_NE(obj.find("\no inner\n"), std::string::npos);

  // Its inputs through the servo again.
  EXPECT_EQ(run("punctum-replay", {recording}), 0) << said_;
  EXPECT_NE(said_.find(" ticks, to "), std::string::npos) << said_;
  EXPECT_NE(said_.find(" of the run: bit-identical\n"), std::string::npos) << said_;

  // A reader of HDF5 that is not ours.
  ASSERT_EQ(run("punctum-export", {recording, "--hdf5", file("run.nwb")}), 0) << said_;
  const Table samples(report() + "/samples.csv");
  const auto column = [&](const std::string& series, const Strings& columns) {
    const Strings values = dumped(file("run.nwb"), "/acquisition/" + series);
    ASSERT_EQ(values.size(), columns.size() * samples.rows.size()) << series;
    for (std::size_t i = 0; i < values.size(); ++i) {
      ASSERT_EQ(std::stod(values[i]), samples.number(i / columns.size(), columns[i % columns.size()]))
          << series << i;
    }
  };
  column("hand_position/data", {"x_m", "y_m", "z_m"});
  column("hand_force/data", {"fx_N", "fy_N", "fz_N"});
  column("dimple_depth/data", {"wd_m"});
  column("true_tip_position/data", {"true_tip_x_m", "true_tip_y_m", "true_tip_z_m"});
  column("true_force/data", {"true_force_N"});
  column("alarms/data", {"alarms"});
  const Strings times = dumped(file("run.nwb"), "/acquisition/guard_force/timestamps");
  ASSERT_EQ(times.size(), samples.rows.size());
  EXPECT_NEAR(std::stod(times.back()), samples.number(samples.rows.size() - 1, "t_s"), 1e-9);
  EXPECT_EQ(run("punctum-export", {recording, "--hdf5", file("run.nwb")}), 2);
  EXPECT_EQ(said_, "punctum-export: " + file("run.nwb") + ": is there already; an export replaces nothing\n");
  EXPECT_EQ(run("punctum-export", {recording, "--hdf5", "/nowhere/run.nwb"}), 2);
  EXPECT_EQ(said_, "punctum-export: /nowhere/run.nwb: cannot be written: No such file or directory\n");

  EXPECT_EQ(run("punctum", {"export", recording, "--csv", file("t")}), 2);
  EXPECT_EQ(said_,
            "punctum-export: " + file("t") + "/samples.csv: is there already; an export replaces nothing\n");
  EXPECT_EQ(run("punctum", {"report", file("t")}), 0) << said_;
}

TEST_F(Recordings, pictures_are_recorded_where_they_are_asked_for) {
  const int code =
      punctum({"run", "icsi", "--clock", "virtual", "--seconds", "1", "--record", "--pictures", "--quiet"});
  EXPECT_EQ(code, 1) << said_;
  const std::string recording = report() + "/recording.mcap";
  ASSERT_EQ(run("punctum-export",
                {recording, "--csv", file("t"), "--png", file("png"), "--ome-tiff", file("a.ome.tif")}),
            0)
      << said_;
  const Table pictures(file("png") + "/pictures.csv"), seen(file("t") + "/observations.csv");
  ASSERT_GT(pictures.rows.size(), 20U);
  EXPECT_GE(pictures.rows.size(), seen.rows.size());
  for (std::size_t i = 0; i < seen.rows.size(); ++i) {
    ASSERT_EQ(pictures.number(i, "frame"), seen.number(i, "frame"));
    ASSERT_NEAR(pictures.number(i, "t_s"),
                1e-9 * (seen.number(i, "exposure_ns") - seen.number(0, "exposure_ns")), 1e-6);
  }
  EXPECT_TRUE(fs::exists(file("png") + "/000020.png"));
  EXPECT_GT(fs::file_size(file("a.ome.tif")), pictures.rows.size() * 300'000);
  EXPECT_EQ(punctum({"run", "icsi", "--pictures"}), 2);
  EXPECT_NE(said_.find("--pictures: goes into the recording, which --record asks for\n"), std::string::npos);
  EXPECT_EQ(punctum({"run", "free", "--record", "--pictures"}), 2);
  EXPECT_NE(said_.find("--pictures: vision looks at none in this scene\n"), std::string::npos);
}

TEST_F(Recordings, a_run_goes_on_when_its_recorder_is_killed_and_the_report_says_so) {
  Running running({"run", "free", "--seconds", "5", "--quiet", "--no-figure", "--record", "--report",
                   report(), "--set", kPatientRelay},
                  words());
  pid_t recorder = 0;
  for (int i = 0; i < 1000 && recorder == 0; ++i, std::this_thread::sleep_for(10ms)) {
    recorder = child_named(running.pid(), "punctum-record");
  }
  ASSERT_NE(recorder, 0);
  const std::string recording = report() + "/recording.mcap";
  for (int i = 0; i < 1000 && (!fs::exists(recording) || fs::file_size(recording) < 250'000);
       ++i, std::this_thread::sleep_for(5ms)) {
  }
  kill(recorder, SIGKILL);
  EXPECT_EQ(running.wait(), 1);
  EXPECT_NE(running.output().find("recording.mcap is not whole: punctum-record was killed by signal 9"),
            std::string::npos)
      << running.output();
  EXPECT_EQ(json()["not_kept"][0]["file"], "recording.mcap");
  const Table cut = exported(recording, "t", 1);
  const Table whole(report() + "/samples.csv");
  EXPECT_EQ(whole.rows.size(), json()["ticks"].get<std::size_t>());
  ASSERT_GT(cut.rows.size(), 100U);
  ASSERT_LT(cut.rows.size(), whole.rows.size());
  const double told_s = json()["not_kept"][0]["t_s"], kept_s = cut.number(cut.rows.size() - 1, "t_s");
  EXPECT_GE(told_s, kept_s - 0.5);
  EXPECT_LT(told_s, whole.number(whole.rows.size() - 1, "t_s") - 0.5) << "when, not the end of the run";
  EXPECT_TRUE(std::equal(cut.rows.begin(), cut.rows.end(), whole.rows.begin()));
  EXPECT_EQ(run("punctum-export", {recording, "--csv", file("u"), "--hdf5", file("u.nwb")}), 1);
  EXPECT_NE(said_.find("was not finished"), std::string::npos) << said_;
  EXPECT_EQ(said_.find("was not finished"), said_.rfind("was not finished")) << "once, not for each output";
  EXPECT_EQ(run("punctum", {"replay", recording}), 1) << said_;
  EXPECT_NE(said_.find("was not finished"), std::string::npos) << said_;
  EXPECT_NE(said_.find(replayed_ticks(cut.rows.size())), std::string::npos) << said_;
}

// Once some of the run is in the file; 0: there is none.
pid_t recorder_at_work(pid_t parent, const std::string& recording) {
  for (int i = 0; i < 1000 && (!fs::exists(recording) || fs::file_size(recording) < 100'000);
       ++i, std::this_thread::sleep_for(5ms)) {
  }
  return child_named(parent, "punctum-record");
}

TEST_F(Recordings, a_recorder_that_somebody_asks_to_end_has_not_kept_the_run) {
  Running running({"run", "free", "--seconds", "2", "--quiet", "--no-figure", "--record", "--report",
                   report(), "--set", kPatientRelay},
                  words());
  const std::string recording = report() + "/recording.mcap";
  const pid_t recorder = recorder_at_work(running.pid(), recording);
  ASSERT_NE(recorder, 0);
  kill(recorder, SIGTERM);
  EXPECT_EQ(running.wait(), 1);
  EXPECT_NE(
      running.output().find("recording.mcap is not whole: punctum-record ended before the run had ended"),
      std::string::npos)
      << running.output();
  EXPECT_EQ(json()["not_kept"][0]["file"], "recording.mcap");
}

// The core stops by itself then, and how it does so is recorded.
TEST_F(Recordings, a_recorder_whose_parent_is_killed_records_how_the_core_stops) {
  Running running({"run", "free", "--seconds", "30", "--quiet", "--no-figure", "--record", "--report",
                   report(), "--set", kPatientRelay},
                  words());
  const std::string recording = report() + "/recording.mcap";
  const pid_t recorder = recorder_at_work(running.pid(), recording);
  ASSERT_NE(recorder, 0);
  kill(running.pid(), SIGKILL);
  (void)running.wait();
  for (int i = 0; i < 2000 && kill(recorder, 0) == 0; ++i, std::this_thread::sleep_for(5ms)) {
  }
  EXPECT_EQ(run("punctum-export", {recording, "--csv", file("orphan")}), 0) << said_;
  std::ifstream events(file("orphan") + "/events.csv");
  const std::string text{std::istreambuf_iterator<char>(events), {}};
  EXPECT_NE(text.find(",ended,"), std::string::npos) << text;
}

TEST_F(Recordings, virtual_time_waits_for_a_recorder_that_stands_still) {
  Running running({"run", "icsi", "--clock", "virtual", "--seconds", "6", "--quiet", "--no-figure",
                   "--record", "--report", report()},
                  words());
  pid_t recorder = 0;
  for (int i = 0; i < 10'000 && recorder == 0; ++i, std::this_thread::sleep_for(1ms)) {
    recorder = child_named(running.pid(), "punctum-record");
  }
  ASSERT_NE(recorder, 0);
  const std::string recording = report() + "/recording.mcap";
  for (int i = 0; i < 1000 && (!fs::exists(recording) || fs::file_size(recording) < 100'000);
       ++i, std::this_thread::sleep_for(5ms)) {
  }
  kill(recorder, SIGSTOP);
  std::this_thread::sleep_for(4s);  // the rest of the run lasts two
  EXPECT_NE(child_named(running.pid(), "punctum-core"), 0) << "the core has not waited";
  kill(recorder, SIGCONT);
  EXPECT_EQ(running.wait(), 1) << "6 s are not enough for a cell";
  EXPECT_EQ(running.output().find("not whole"), std::string::npos) << running.output();
  EXPECT_TRUE(json()["not_kept"].empty());
  EXPECT_EQ(exported(recording, "t", 0).rows, Table(report() + "/samples.csv").rows);
  EXPECT_GE(Table(report() + "/samples.csv").rows.size(), 6000U);
}

TEST_F(Recordings, a_disk_that_fills_leaves_what_was_recorded_before) {
  Running running({"run", "free", "--seconds", "5", "--quiet", "--no-figure", "--report", report(), "--set",
                   kPatientRelay},
                  words());
  Look look("free", running);
  ASSERT_TRUE(look.until_started());
  const std::string station = "free-" + std::to_string(running.pid());
  Running recorder({"--station", station, "--out", file("full.mcap")}, words("recorder"), "punctum-record");
  for (int i = 0; i < 1000 && !fs::exists(file("full.mcap")); ++i, std::this_thread::sleep_for(1ms)) {
  }
  let_no_file_grow(recorder.pid(), 700'000);
  Running second({"--station", station, "--out", file("whole.mcap")}, words("second"), "punctum-record");
  EXPECT_EQ(recorder.wait(), 1);
  EXPECT_NE(recorder.output().find("it ends here: File too large"), std::string::npos) << recorder.output();
  EXPECT_EQ(second.wait(), 0) << second.output() << "the core's end is its end";
  EXPECT_EQ(running.wait(), 0) << running.output();
  const Table cut = exported(file("full.mcap"), "t", 1), joined = exported(file("whole.mcap"), "u", 0);
  const Table whole(report() + "/samples.csv");
  ASSERT_GT(cut.rows.size(), 300U);
  EXPECT_TRUE(std::equal(cut.rows.begin(), cut.rows.end(), whole.rows.begin()));
  EXPECT_EQ(joined.rows, whole.rows) << "who joins in time gets the beginning, too";
  EXPECT_EQ(run("punctum-replay", {file("whole.mcap")}), 2) << said_;
  EXPECT_NE(said_.find("holds no inputs"), std::string::npos) << said_;
}

TEST_F(Recordings, the_death_of_the_core_ends_the_recording_in_order) {
  Running running({"run", "free", "--seconds", "30", "--quiet", "--no-figure", "--report", report(), "--set",
                   kPatientRelay},
                  words());
  Look look("free", running);
  ASSERT_TRUE(look.until_started());
  Running recorder({"--station", "free-" + std::to_string(running.pid()), "--out", file("r.mcap")},
                   words("recorder"), "punctum-record");
  for (int i = 0; i < 2000 && (!fs::exists(file("r.mcap")) || fs::file_size(file("r.mcap")) < 200'000);
       ++i, std::this_thread::sleep_for(5ms)) {
  }
  kill(look.core(), SIGKILL);
  EXPECT_EQ(running.wait(), 3);
  EXPECT_EQ(recorder.wait(), 0) << recorder.output();
  EXPECT_GT(exported(file("r.mcap"), "t", 0).rows.size(), 200U);
}

// The gateway knows nothing of recordings: it joins what looks like a run.
TEST_F(Recordings, a_recording_is_a_station_that_others_join) {
  EXPECT_EQ(
      punctum({"run", "free", "--clock", "virtual", "--seconds", "2", "--record", "--quiet", "--no-figure"}),
      0)
      << said_;
  const std::string recording = report() + "/recording.mcap";
  Running player({recording, "--station", "--speed", "2"}, words("player"), "punctum-replay");
  for (int i = 0; i < 2000 && player.output().find("station: ") == std::string::npos;
       ++i, std::this_thread::sleep_for(5ms)) {
  }
  ASSERT_NE(player.output().find("0.000 s to 2.0"), std::string::npos) << player.output();
  Running again({"--station", "replay-" + std::to_string(player.pid()), "--out", file("again.mcap")},
                words("again"), "punctum-record");
  const int recorded = again.wait();  // until the recorded run has ended once more
  kill(player.pid(), SIGTERM);
  EXPECT_EQ(player.wait(), 0) << player.output();
  EXPECT_EQ(recorded, 0) << again.output();
  const Table first(report() + "/samples.csv"), second = exported(file("again.mcap"), "t", 0);
  EXPECT_EQ(second.rows.size(), first.rows.size());
  EXPECT_EQ(second.rows.back()[0], first.rows.back()[0]);
  EXPECT_EQ(run("punctum-replay", {recording, "--speed", "2"}), 2);
  EXPECT_EQ(said_, "punctum-replay: --from and --speed are of --console and --station\n");
  EXPECT_EQ(run("punctum-replay", {recording, "--station", "--from", "1000"}), 2);
  EXPECT_EQ(said_.find("punctum-replay: --from: 1000: allowed: up to "), 0U) << said_;
}

TEST_F(Recordings, bad_input_is_one_line) {
  EXPECT_EQ(run("punctum-record", {"--station", "nowhere", "--out", file("r.mcap")}), 2);
  EXPECT_EQ(std::count(said_.begin(), said_.end(), '\n'), 1) << said_;
  EXPECT_FALSE(fs::exists(file("r.mcap")));
  EXPECT_EQ(run("punctum-record", {"--out", file("r.mcap")}), 2);
  EXPECT_EQ(said_, "punctum-record: which station? Allowed: --station NAME\n");
  EXPECT_EQ(run("punctum-export", {"/dev/null", "--csv", file("t")}), 2);
  EXPECT_EQ(said_, "punctum-export: /dev/null: not a file, allowed: a recording (MCAP)\n");
  ASSERT_EQ(mkfifo(file("pipe").c_str(), 0600), 0);
  EXPECT_EQ(run("punctum-replay", {file("pipe")}), 2) << "it is not waited for";
  EXPECT_EQ(said_, "punctum-replay: " + file("pipe") + ": not a file, allowed: a recording (MCAP)\n");
  EXPECT_EQ(run("punctum-export", {"/dev/null"}), 2);
  EXPECT_EQ(said_,
            "punctum-export: as what? Allowed: --csv FOLDER, --hdf5 FILE, --obj STEM, --png FOLDER, "
            "--ome-tiff FILE, --overview FOLDER\n");
  EXPECT_EQ(run("punctum-export", {"/dev/null", "--csv", file("t"), "--at", "5"}), 2);
  EXPECT_EQ(said_, "punctum-export: --at: a time of the surfaces, allowed with --obj\n");
  EXPECT_EQ(run("punctum-replay", {"/dev/null", "--console", "--station"}), 2);
  EXPECT_EQ(said_, "punctum-replay: --station is without a browser, allowed without --console\n");
  EXPECT_EQ(run("punctum-export", {"/dev/null", "/dev/zero", "--csv", file("t")}), 2);
  EXPECT_EQ(said_, "punctum-export: 2 recordings: only --overview takes more than one\n");
  EXPECT_EQ(run("punctum-export", {"/dev/null", "--overview", file("t")}), 2);
  EXPECT_EQ(std::count(said_.begin(), said_.end(), '\n'), 1) << said_;
  EXPECT_FALSE(fs::exists(file("t")));
}

TEST_F(Recordings, runs_stand_side_by_side_as_their_reports_say) {
  std::vector<std::string> recordings;
  for (const char* name : {"one", "two"}) {
    ASSERT_EQ(punctum({"run", "icsi", "--clock", "virtual", "--set", "vision.method=truth", "--seed",
                       name == std::string("one") ? "3" : "8", "--record"},
                      name),
              0)
        << said_;
    recordings.push_back(report(name) + "/recording.mcap");
  }
  const std::string whole = read_all(recordings.back());
  std::ofstream(file("cut.mcap")) << whole.substr(0, whole.size() / 2);
  recordings.insert(recordings.end(), {file("cut.mcap"), "/dev/null", "--overview", file("runs")});
  EXPECT_EQ(run("punctum-export", recordings), 1) << "one is left out, another ends early";
  EXPECT_NE(said_.find("left out: /dev/null"), std::string::npos) << said_;
  EXPECT_NE(said_.find("punctum-export: 1 of 4 are left out\n"), std::string::npos) << said_;
  EXPECT_NE(said_.find("was not finished"), std::string::npos) << said_;
  const Table runs(file("runs") + "/runs.csv");
  ASSERT_EQ(runs.rows.size(), 3U);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto facts = json(i == 0 ? "one" : "two");
    EXPECT_EQ(runs.text(i, "scene"), "icsi");
    EXPECT_EQ(runs.number(i, "seed"), i == 0 ? 3 : 8);
    EXPECT_EQ(runs.number(i, "injected"), facts["cells"]["done"].get<double>());
    EXPECT_EQ(runs.number(i, "lost"), facts["cells"]["lost"].get<double>());
    EXPECT_EQ(runs.text(i, "end"), "done");
    EXPECT_NEAR(runs.number(i, "hand_N"), facts["peak_hand_force_N"].get<double>(), 0.01);
    double touched_s = 0, punctured_s = 0;  // of the one cell
    for (const auto& phase : facts["phases"]) {
      touched_s = phase["name"] == "contact" && punctured_s == 0 ? phase["start_s"].get<double>() : touched_s;
      punctured_s = phase["name"] == "puncture" ? phase["start_s"].get<double>() : punctured_s;
    }
    EXPECT_NEAR(runs.number(i, "pressed_s"), punctured_s - touched_s, 0.01);
  }
}

}  // namespace
}  // namespace punctum::e2e
