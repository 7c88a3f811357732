// What is recorded of a run, and what is said of what is not: samples that were overwritten, files that
// cannot be written. And whether vision hangs.
#include "tools/punctum/recorder.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "rt/forces/list.hpp"
#include "tests/support/full_disk.hpp"
#include "tools/punctum/disk_space.hpp"
#include "tools/punctum/report_folder.hpp"
#include "tools/punctum/vision_watchdog.hpp"
#include "tools/shared/csv.hpp"
#include "tools/shared/program_start.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

class RecorderTest : public FullDisk {
 protected:
  void tick(std::uint64_t n, rt::Fault fault = rt::Fault::none) {
    for (std::uint64_t i = 0; i < n; ++i) {
      sample_.tick = next_++;
      sample_.t_s = static_cast<double>(sample_.tick) * 1e-3;
      sample_.fault = fault;
      core_->telemetry.push(sample_);
    }
    core_->status.ticks.store(next_);
  }
  [[nodiscard]] std::size_t lines(const char* file) const {
    std::ifstream in(folder_ / file);
    std::size_t n = 0;
    for (std::string line; std::getline(in, line);) {
      ++n;
    }
    return n;
  }
  [[nodiscard]] Recorder recorder() const {
    return std::move(*Recorder::create(folder_.string(), *load_scene("free"), *core_, nullptr, 1));
  }

  std::unique_ptr<rt::CoreSegment> core_ = std::make_unique<rt::CoreSegment>();
  rt::TelemetrySample sample_;
  std::uint64_t next_ = 0;
};

TEST_F(RecorderTest, every_sample_is_a_row_and_none_is_lost) {
  Recorder r = recorder();
  tick(3000);
  r.finish();
  EXPECT_EQ(lines("samples.csv"), 3001U);
  EXPECT_EQ(r.rows(), 3000U);
  EXPECT_EQ(r.lost(), 0U);
  EXPECT_TRUE(r.not_kept().empty());
}

TEST_F(RecorderTest, takes_no_more_than_it_may) {
  Recorder r = recorder();
  tick(100);
  EXPECT_EQ(r.drain(40), 40U);
  EXPECT_EQ(r.drain(40), 0U);
  EXPECT_EQ(r.position(), 40U);
  r.finish();
  EXPECT_EQ(r.rows(), 100U);
}

TEST_F(RecorderTest, samples_that_were_overwritten_before_they_were_read_are_counted_as_lost) {
  Recorder r = recorder();
  tick(10);
  r.drain();
  const std::uint64_t more = rt::TelemetryRing::kSize + 500;
  tick(more);
  r.finish();
  EXPECT_GE(r.lost(), 500U);
  EXPECT_EQ(r.lost() + r.rows(), 10 + more) << "each sample is a row or lost";
  ASSERT_EQ(r.not_kept().size(), 1U);
  EXPECT_EQ(r.not_kept()[0].file, "samples.csv");
  EXPECT_NEAR(r.not_kept()[0].t_s, 0.009, 1e-9) << "the last row before";
}

// Each number of a sample is another: where two change places, both are wrong.
TEST_F(RecorderTest, every_column_holds_what_it_is_called_after) {
  Recorder r = recorder();
  double n = 0;
  const auto fill = [&n](auto&... numbers) {
    ((numbers = static_cast<std::decay_t<decltype(numbers)>>(++n)), ...);
  };
  rt::TelemetrySample& s = sample_;
  for (double (*three)[3] : {&s.x_m, &s.v_m_s, &s.tip_m, &s.cmd_m, &s.force_N}) {
    fill((*three)[0], (*three)[1], (*three)[2]);
  }
  for (double& effect : s.effect_N) {
    fill(effect);
  }
  fill(s.guard_N, s.wd_m, s.a_m, s.R_m, s.tip_force_N, s.sigma_d_Pa, s.pressure_Pa, s.obs_age_s, s.sensor_N,
       s.vacuum_Pa, s.stored_energy_J, s.injected_energy_J, s.obs_gap_m, s.wd_sd_m, s.R_sd_m,
       s.tip_force_sd_N, s.obs_a_m, s.obs_a_sd_m, s.E_fit_Pa, s.E_fit_sd_Pa);
  s.phase = rt::Phase::injection;
  s.fault = rt::Fault::tip_force;
  s.stop = rt::StopStage::stopping;
  s.estop = 5;
  fill(s.cell, s.alarms, s.buttons);
  s.injector_open = 1;
  s.tick = 7;
  s.t_s = 0.007;
  core_->telemetry.push(s);
  r.finish();
  CsvReader row(folder_ / "samples.csv");
  ASSERT_TRUE(row.next());
  std::vector<std::pair<std::string, double>> wanted{{"t_s", s.t_s},
                                                     {"guard_N", s.guard_N},
                                                     {"wd_m", s.wd_m},
                                                     {"a_m", s.a_m},
                                                     {"R_m", s.R_m},
                                                     {"obs_age_s", s.obs_age_s},
                                                     {"estop", s.estop},
                                                     {"cell", s.cell},
                                                     {"alarms", s.alarms},
                                                     {"buttons", s.buttons},
                                                     {"stop", 1},
                                                     {"tip_force_N", s.tip_force_N},
                                                     {"sigma_d_Pa", s.sigma_d_Pa},
                                                     {"pressure_Pa", s.pressure_Pa},
                                                     {"obs_gap_m", s.obs_gap_m},
                                                     {"stored_energy_J", s.stored_energy_J},
                                                     {"injected_energy_J", s.injected_energy_J},
                                                     {"injector_open", 1},
                                                     {"sensor_N", s.sensor_N},
                                                     {"vacuum_Pa", s.vacuum_Pa},
                                                     {"wd_sd_m", s.wd_sd_m},
                                                     {"R_sd_m", s.R_sd_m},
                                                     {"tip_force_sd_N", s.tip_force_sd_N},
                                                     {"obs_a_m", s.obs_a_m},
                                                     {"obs_a_sd_m", s.obs_a_sd_m},
                                                     {"E_fit_Pa", s.E_fit_Pa},
                                                     {"E_fit_sd_Pa", s.E_fit_sd_Pa}};
  const auto vector = [&wanted](const std::string& name, const std::string& unit, const double (&v)[3]) {
    for (int i = 0; i < 3; ++i) {
      wanted.emplace_back(name + "xyz"[i] + unit, v[i]);
    }
  };
  vector("", "_m", s.x_m), vector("v", "_m_s", s.v_m_s), vector("tip_", "_m", s.tip_m);
  vector("cmd_", "_m", s.cmd_m), vector("f", "_N", s.force_N);
  for (std::size_t i = 0; i < rt::effect_count; ++i) {
    wanted.emplace_back(std::string(rt::effect_name(i)) + "_N", s.effect_N[i]);
  }
  for (const auto& [column, value] : wanted) {
    EXPECT_EQ(row.number(column), value) << column;
  }
  EXPECT_EQ(row.text("phase"), "injection");
  EXPECT_EQ(row.text("fault"), "tip_force");
  EXPECT_EQ(row.text("true_gap_m"), "") << "nothing is simulated: unknown is no zero";
}

TEST_F(RecorderTest, every_row_has_as_many_cells_as_there_are_columns) {
  const auto bench = std::make_unique<sim::Bench>();
  for (const char* scene : {"free", "icsi"}) {
    for (const bool simulated : {false, true}) {
      auto r = Recorder::create(folder_.string(), *load_scene(scene), *core_,
                                simulated ? bench.get() : nullptr, 1);
      ASSERT_TRUE(r);
      sim::Snapshot world;
      world.has_cell = std::string(scene) == "icsi" ? 1 : 0;
      world.t_ns = static_cast<std::int64_t>(next_) * 1'000'000;
      bench->snapshots.push(world);
      tick(1);
      r->finish();
      std::ifstream in(folder_ / "samples.csv");
      std::string columns, row;
      std::getline(in, columns);
      while (std::getline(in, row)) {
        EXPECT_EQ(split_csv(row).size(), split_csv(columns).size()) << scene << simulated;
      }
    }
  }
}

// What the table tells of the needle's true place, tick by tick: empty where nobody knows it.
std::vector<std::string> true_places(const fs::path& table) {
  std::ifstream in(table);
  std::string line;
  std::getline(in, line);
  const auto columns = split_csv(line);
  const auto place = static_cast<std::size_t>(std::ranges::find(columns, "true_tip_x_m") - columns.begin());
  std::vector<std::string> places;
  while (std::getline(in, line)) {
    places.emplace_back(split_csv(line).at(place));
  }
  return places;
}

TEST_F(RecorderTest, a_row_holds_the_truth_of_its_own_tick_however_late_that_and_the_first_one_began) {
  for (const std::uint64_t first_tick : {0U, 400U}) {
    for (const std::int64_t late_ns : {0, 300'000, 900'000}) {
      const auto bench = std::make_unique<sim::Bench>();
      core_ = std::make_unique<rt::CoreSegment>();
      auto r = Recorder::create(folder_.string(), *load_scene("icsi"), *core_, bench.get(), 1);
      ASSERT_TRUE(r);
      sample_ = {};
      for (const std::uint64_t k : {0U, 1U, 2U, 5U}) {  // two releases were missed
        sim::Snapshot world;
        world.start_ns = 7'000'000'000;
        world.t_ns = world.start_ns + static_cast<std::int64_t>(first_tick + k) * 1'000'000 + late_ns;
        world.stage.tip_m = hal::Vec3(0.01 * static_cast<double>(k), 0, 0);
        world.has_cell = 1;
        world.cell.outer.punctured = k >= 1;
        world.zona_puncture_ns =
            k >= 1 ? world.start_ns + static_cast<std::int64_t>(first_tick + 1) * 1'000'000 : 0;
        if (k != 1) {  // that of the second tick was overwritten
          bench->snapshots.push(world);
        }
        sample_.tick = first_tick + k;
        sample_.t_s = 1e-3 * static_cast<double>(k);
        sample_.phase = k >= 2 ? rt::Phase::puncture : rt::Phase::indentation;
        core_->telemetry.push(sample_);
      }
      core_->status.ticks.store(4);
      r->finish();
      EXPECT_EQ(true_places(folder_ / "samples.csv"), (std::vector<std::string>{"0", "", "0.02", "0.05"}))
          << first_tick << ' ' << late_ns;
      EXPECT_NEAR(r->measures().puncture_delay_s.mean, 1e-3, 1e-9) << first_tick << ' ' << late_ns;
    }
  }
}

TEST_F(RecorderTest, events_are_rows_and_those_that_were_overwritten_are_counted) {
  Recorder r = recorder();
  rt::Event event;
  event.kind = rt::Event::phase;
  core_->events.push(event);
  r.drain();
  r.finish();
  EXPECT_EQ(lines("events.csv"), 2U);
  EXPECT_EQ(r.events().lost, 0U);
  const std::uint64_t more = rt::EventRing::kSize + 100;
  for (std::uint64_t i = 0; i < more; ++i) {
    core_->events.push(event);
  }
  r.finish();
  EXPECT_GE(r.events().lost, 100U);
  EXPECT_EQ(r.events().lost + r.events().list.size() + r.events().not_listed, 1 + more);
  EXPECT_EQ(lines("events.csv"), 2 + more - r.events().lost);
}

TEST_F(RecorderTest, the_last_two_seconds_before_a_fault_are_kept_however_thin_the_samples) {
  Recorder r = std::move(*Recorder::create(folder_.string(), *load_scene("free"), *core_, nullptr, 100));
  tick(3000);
  tick(1000, rt::Fault::estop);
  r.finish();
  EXPECT_EQ(lines("fault.csv"), 1U + 2000 + 500);
  EXPECT_LT(lines("samples.csv"), 60U);
}

TEST_F(RecorderTest, samples_that_cannot_be_written_are_noticed_while_the_run_goes_on) {
  Recorder r = recorder();
  full_beyond(20'000);
  tick(4000);
  r.drain();
  ASSERT_EQ(r.not_kept().size(), 1U) << "at once, not at the end";
  EXPECT_EQ(r.not_kept()[0].file, "samples.csv");
  EXPECT_GT(r.not_kept()[0].t_s, 0);
  EXPECT_LT(r.not_kept()[0].t_s, 4);
  EXPECT_FALSE(r.not_kept()[0].why.empty());
  tick(4000);
  r.finish();
  EXPECT_EQ(r.not_kept().size(), 1U) << "once";
  EXPECT_EQ(r.measures().ticks, 8000U) << "it is measured all the same";
  EXPECT_LT(r.rows(), 4000U);
  EXPECT_LE(lines("samples.csv"), r.rows() + 1);
}

// A disk of 4 MB for this process alone; false: this machine lets nobody have one.
bool mount_small_disk(const fs::path& at) {
  const uid_t user = geteuid();
  const gid_t group = getegid();
  if (unshare(user == 0 ? CLONE_NEWNS : CLONE_NEWNS | CLONE_NEWUSER) != 0) {
    return false;
  }
  if (user != 0) {
    std::ofstream("/proc/self/setgroups") << "deny";
    std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
    std::ofstream("/proc/self/gid_map") << "0 " << group << " 1";
  }
  return mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         mount("small", at.c_str(), "tmpfs", 0, "size=4m") == 0;
}

void fill(const fs::path& disk) {
  std::ofstream other(disk / "picture", std::ios::app);
  for (const std::size_t size : {std::size_t{4096}, std::size_t{1}}) {
    while (other << std::string(size, 'x') << std::flush) {
    }
    other.clear();
  }
}

TEST_F(RecorderTest, rows_find_room_on_a_full_disk_until_what_was_kept_back_for_them_is_used_up) {
  constexpr int kNoDisk = 77;
  const pid_t child = fork();
  if (child == 0) {
    if (!mount_small_disk(folder_)) {
      std::_Exit(kNoDisk);
    }
    {
      Recorder r = recorder();
      r.keep_room(2 << 20);
      fill(folder_);
      for (int i = 0; i < 3; ++i) {
        tick(1000);
        r.drain();
      }
      EXPECT_TRUE(r.not_kept().empty()) << "what others wrote stands in the way of no row";
      EXPECT_GT(lines("samples.csv"), 2500U);
      for (int i = 0; i < 10; ++i) {
        tick(3000);
        r.drain();
      }
      r.finish();
      EXPECT_EQ(r.not_kept().size(), 1U) << "it is said when that is over";
      EXPECT_GT(r.rows(), 5000U);
      EXPECT_LT(r.rows(), 33'000U);
      std::ifstream table(folder_ / "samples.csv");
      const std::string all(std::istreambuf_iterator<char>(table), {});
      EXPECT_EQ(all.back(), '\n') << "what was written stays whole";
    }
    fs::remove(folder_ / "samples.csv");
    Recorder r = recorder();
    r.keep_room(2 << 20);
    fill(folder_);
    EXPECT_EQ(fs::space(folder_).available, 0U);
    r.finish();
    EXPECT_GT(fs::space(folder_).available, 1U << 20) << "for the report";
    std::_Exit(HasFailure() ? 1 : 0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == kNoDisk) {
    GTEST_SKIP() << "this machine lets no process mount a disk of its own";
  }
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(RecorderTest, samples_ask_for_the_room_of_a_whole_run_but_leave_half_of_what_is_free) {
  const Scene scene = *load_scene("icsi");
  EXPECT_EQ(room_for_samples(folder_.string(), scene, {.seconds = 2}),
            room_for_samples(folder_.string(), scene, {.seconds = 2, .frames = true}));
  EXPECT_GT(room_for_samples(folder_.string(), scene, {.seconds = 2}), 2000 * 300);
  const auto half = static_cast<double>(fs::space(folder_).available) / 2;
  const auto asked = static_cast<double>(room_for_samples(folder_.string(), scene, {.seconds = 1e12}));
  EXPECT_NEAR(asked, half, 0.1 * half) << "others write on that disk, too";
  EXPECT_EQ(room_for_samples("/nowhere", scene, {.seconds = 2}), 0);
}

TEST_F(RecorderTest, what_is_left_in_the_buffer_at_the_end_is_noticed_too) {
  Recorder r = recorder();
  full_beyond(1000);
  tick(5);  // fewer bytes than are written at once
  r.finish();
  ASSERT_EQ(r.not_kept().size(), 1U);
  EXPECT_EQ(r.not_kept()[0].file, "samples.csv");
}

TEST_F(RecorderTest, the_last_seconds_before_a_fault_that_cannot_be_written_are_noticed) {
  Recorder r = recorder();
  tick(1000);
  r.drain();
  fs::create_directory(folder_ / "fault.csv");  // no file of that name can be
  tick(100, rt::Fault::estop);
  r.finish();
  ASSERT_EQ(r.not_kept().size(), 1U);
  EXPECT_EQ(r.not_kept()[0].file, "fault.csv");
  EXPECT_EQ(lines("samples.csv"), 1101U);
}

// ---- the place of the report ----

TEST_F(RecorderTest, a_folder_without_room_for_a_report_is_refused_and_a_small_one_is_warned_of) {
  const auto enough = look_for_space(folder_.string(), 0);
  ASSERT_TRUE(enough) << enough.error();
  EXPECT_EQ(*enough, "");
  const auto small = look_for_space(folder_.string(), 1e30);
  ASSERT_TRUE(small);
  EXPECT_NE(small->find("MB are free"), std::string::npos);
  EXPECT_EQ(std::count(small->begin(), small->end(), '\n'), 0);
}

TEST_F(RecorderTest, a_run_at_a_faster_rate_or_with_more_frames_needs_more_room) {
  Scene scene = *load_scene("icsi");
  const ExpectedRecording minute{.seconds = 60};
  const double one = bytes_written(scene, minute);
  EXPECT_GT(one, 60e3 * 300);  // 60 000 rows of some 60 numbers
  EXPECT_LT(one, 60e3 * 2000);
  EXPECT_GT(bytes_written(scene, {.seconds = 60, .frames = true}), one);
  EXPECT_LT(bytes_written(scene, {.seconds = 60, .rows_every = 10}), one);
  scene.servo.rate_Hz = 8000;
  EXPECT_GT(bytes_written(scene, minute), one);
}

TEST_F(RecorderTest, the_room_kept_back_is_there_until_it_is_given_back) {
  {
    SpaceReserve reserve(folder_.string());
    EXPECT_EQ(fs::file_size(folder_ / "reserve"), static_cast<std::uintmax_t>(SpaceReserve::kBytes));
    reserve.give_back();
    EXPECT_TRUE(fs::is_empty(folder_));
  }
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(RecorderTest, two_runs_never_get_the_same_new_folder) {
  const Scene scene = *load_scene("free");
  const std::string wanted = folder_ / "r";
  {
    const auto first = prepare_report_folder(scene, wanted, false);
    ASSERT_TRUE(first);
    EXPECT_EQ(first->folder, wanted);
    std::ofstream(fs::path(first->folder) / "scene.toml") << "# free" << kResolvedScene << "\n";
    for (const bool overwrite : {false, true}) {
      const auto meanwhile = prepare_report_folder(scene, wanted, overwrite);
      ASSERT_FALSE(meanwhile);
      EXPECT_NE(meanwhile.error().find("another run writes its report there"), std::string::npos);
    }
  }
  const auto second = prepare_report_folder(scene, wanted, false);
  const auto third = prepare_report_folder(scene, wanted, true);
  ASSERT_TRUE(second && third);
  EXPECT_EQ(second->folder, wanted + "-2");
  EXPECT_EQ(second->replaces, "");
  EXPECT_NE(second->note, "");
  EXPECT_EQ(third->folder, wanted + "-3");
  EXPECT_EQ(third->replaces, wanted);
  EXPECT_TRUE(fs::exists(fs::path(wanted) / "scene.toml")) << "it stays until the new one is whole";
  discard(*second);
  EXPECT_FALSE(fs::exists(second->folder));
}

TEST_F(RecorderTest, a_report_that_is_replaced_takes_no_file_of_anybody_else_with_it) {
  const Scene scene = *load_scene("free");
  const auto put = [](const fs::path& file, const char* text) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text;
  };
  const fs::path old = folder_ / "r";
  put(old / "scene.toml", ("# free" + std::string(kResolvedScene) + "\n").c_str());
  put(old / "fault.csv", "of the old run");
  put(old / "samples.csv", "of the old run");
  put(old / "frames" / "000012.jpg", "of the old run");
  put(old / "frames" / "of_mine.jpg", "somebody's");
  put(old / "notes.txt", "somebody's");
  const auto fresh = prepare_report_folder(scene, old.string(), true);
  ASSERT_TRUE(fresh) << fresh.error();
  put(fs::path(fresh->folder) / "samples.csv", "of the new run");
  put(fs::path(fresh->folder) / "frames" / "000007.jpg", "of the new run");
  const auto place = take_place(*fresh);
  ASSERT_TRUE(place) << place.error();
  EXPECT_EQ(*place, old.string());
  std::string samples;
  std::getline(std::ifstream(old / "samples.csv"), samples);
  EXPECT_EQ(samples, "of the new run");
  EXPECT_TRUE(fs::exists(old / "frames" / "000007.jpg"));
  EXPECT_FALSE(fs::exists(old / "fault.csv"));
  EXPECT_FALSE(fs::exists(old / "frames" / "000012.jpg"));
  EXPECT_TRUE(fs::exists(old / "frames" / "of_mine.jpg"));
  EXPECT_TRUE(fs::exists(old / "notes.txt"));
  EXPECT_FALSE(fs::exists(fresh->folder));
}

TEST_F(RecorderTest, a_pipe_in_place_of_a_scene_is_no_report_and_is_not_waited_for) {
  ASSERT_EQ(mkfifo((folder_ / "scene.toml").c_str(), 0600), 0);
  const auto report = prepare_report_folder(*load_scene("free"), folder_.string(), false);
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().find("scene.toml: is there, but no run has written it"), std::string::npos);
}

// ---- whether vision hangs ----

TEST(VisionWatchdog, a_loop_that_goes_round_never_hangs_and_one_that_stops_does) {
  VisionWatchdog dog(true);
  double now_s = 100;
  std::uint64_t rounds = 7;  // of one that ran before
  dog.started(now_s, rounds);
  const auto watch_for = [&](double seconds, bool goes_round) {
    bool hangs = false;
    for (double until_s = now_s + seconds; now_s < until_s && !hangs; now_s += 0.01) {
      rounds += goes_round ? 1 : 0;
      hangs = dog.hangs(now_s, rounds);
    }
    return hangs;
  };
  EXPECT_FALSE(watch_for(VisionWatchdog::kStart_s - 1, false)) << "it may take its time to start";
  EXPECT_FALSE(watch_for(60, true));
  EXPECT_FALSE(watch_for(VisionWatchdog::kHung_s - 0.1, false));
  EXPECT_TRUE(watch_for(0.3, false));
  dog.started(now_s, rounds);
  EXPECT_FALSE(watch_for(VisionWatchdog::kStart_s - 1, false));
  EXPECT_TRUE(watch_for(2, false)) << "it may also hang before its first round";
}

TEST(VisionWatchdog, time_in_which_nobody_watched_does_not_count) {
  VisionWatchdog dog(true);
  dog.started(0, 0);
  EXPECT_FALSE(dog.hangs(0.1, 1));
  EXPECT_FALSE(dog.hangs(600, 1)) << "the parent was stopped, and perhaps the whole machine";
  EXPECT_FALSE(dog.hangs(600.1, 2));
}

}  // namespace
}  // namespace punctum::tools
