#include "tools/supervisor.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "hal/segment.hpp"
#include "hal/sim/bench.hpp"
#include "hal/sim/virtual_clock.hpp"
#include "hal/sim/world.hpp"
#include "rt/station/station.hpp"
#include "tools/child.hpp"
#include "tools/recorder.hpp"
#include "tools/run_report.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;
using Steady = std::chrono::steady_clock;

constexpr double kLongRun_s = 600;  // longer ones are recorded thinner
constexpr std::uint64_t kRowsOfLongRun = 500'000;
constexpr std::size_t kRestartsAtOnce = 5;  // of vision, within kRestartWindow_s
constexpr double kRestartWindow_s = 60;
constexpr double kHungCore_s = 2;          // without a tick
constexpr double kHungVirtualCore_s = 30;  // it may wait for camera and recorder
constexpr double kPatience_s = 5;          // for a child to end when asked

std::atomic<int> interrupts{0};
extern "C" void on_interrupt(int) { interrupts.fetch_add(1, std::memory_order_relaxed); }

// What cannot be told (a closed pipe, a terminal that is gone) ends no run.
void put(std::FILE* to, const std::string& text) {
  (void)std::fwrite(text.data(), 1, text.size(), to);
  (void)std::fflush(to);
}

void nap(double s) {
  timespec t{};
  t.tv_sec = static_cast<time_t>(s);
  t.tv_nsec = static_cast<long>((s - static_cast<double>(t.tv_sec)) * 1e9);
  nanosleep(&t, nullptr);
}

// Letters, digits, '-' and '_' of the scene's name, and this process: two runs never meet.
std::string station_name(const Scene& scene) {
  std::string s;
  for (const char c : scene.name)
    if (s.size() < 40) s += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' ? c : '_';
  return fmt::format("{}-{}", s.empty() ? "scene" : s, getpid());
}

constexpr const char* kReportFiles[] = {"samples.csv", "obs.csv",    "contours.csv", "report.json",
                                        "scene.toml",  "figure.png", "figure.svg",   "figure.gp",
                                        "core.log",    "vision.log", "gnuplot.log",  "frames"};

// A run that has written anything has written its resolved scene first.
bool is_report(const fs::path& folder) {
  std::ifstream in(folder / "scene.toml");
  std::string line;
  return std::getline(in, line) && line.starts_with("# ") && line.ends_with(kResolvedScene);
}

tl::expected<std::string, std::string> prepare_folder(const Scene& scene, const std::string& wanted) {
  std::error_code ec;
  fs::path folder(wanted);
  if (wanted.empty()) {
    const std::string base =
        fmt::format("reports/{}-{:%Y%m%d-%H%M%S}", scene.name, fmt::localtime(std::time(nullptr)));
    folder = base;
    for (int n = 2; fs::exists(folder, ec); ++n) folder = fmt::format("{}-{}", base, n);
  }
  fs::create_directories(folder, ec);
  if (ec || !fs::is_directory(folder))
    return tl::unexpected(fmt::format("{}: cannot be used as report folder: {}", folder.string(),
                                      ec ? ec.message() : "it is not a folder"));
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    return tl::unexpected(fmt::format("{}: cannot be written to: {}", folder.string(), std::strerror(errno)));
  // What an earlier run left, and nothing else: never a picture or a scene that is somebody's own.
  const fs::path frames = folder / "frames";
  if (!is_report(folder))
    for (const char* file : kReportFiles)
      if (fs::exists(folder / file, ec))
        return tl::unexpected(fmt::format(
            "{}: is there, but no run has written it; allowed: a folder of its own for the report",
            (folder / file).string()));
  if (scene.recorded) {
    fs::path source = fs::weakly_canonical(scene.recorded->frames, ec);
    for (const fs::path own = fs::weakly_canonical(frames, ec); source.has_relative_path();
         source = source.parent_path())
      if (source == own)
        return tl::unexpected(fmt::format(
            "{}: the recorded frames come from there; allowed: another --report", frames.string()));
  }
  for (const char* file : kReportFiles)
    if (file != std::string_view("frames")) fs::remove(folder / file, ec);
  std::vector<fs::path> drawn;
  for (auto it = fs::directory_iterator(frames, ec); !ec && it != fs::directory_iterator(); it.increment(ec))
    if (const std::string stem = it->path().stem().string();
        it->path().extension() == ".png" && stem.size() >= 6 &&
        std::all_of(stem.begin(), stem.end(), [](char c) { return c >= '0' && c <= '9'; }))
      drawn.push_back(it->path());
  for (const auto& picture : drawn) fs::remove(picture, ec);
  fs::remove(frames, ec);  // if nothing else is in it
  return fs::absolute(folder).string();
}

class Run {
 public:
  Run(const Scene& scene, const RunSettings& settings) : scene_(scene), settings_(settings) {}
  int run();

 private:
  [[nodiscard]] double wall_s() const { return Seconds(Steady::now() - began_).count(); }
  template <class... Args>
  void say(fmt::format_string<Args...> text, Args&&... args) {
    clear_line();
    put(stdout, fmt::format(text, std::forward<Args>(args)...) + "\n");
  }
  void complain(const std::string& text) {
    clear_line();
    put(stderr, fmt::format("punctum: {}\n", text));
  }
  void clear_line() {
    if (line_drawn_) put(stdout, "\r\033[K");
    line_drawn_ = false;
  }
  [[nodiscard]] bool long_run() const { return scene_.seconds > kLongRun_s || scene_.seconds <= 0; }
  tl::expected<void, std::string> start_vision();
  void watch_vision();
  void watch_interrupts();
  void watch_core();
  void progress();
  void core_died();
  void end_vision();
  [[nodiscard]] Outcome judge(const Ended& core) const;

  const Scene& scene_;
  const RunSettings& settings_;
  std::string folder_, station_name_, bench_name_;
  Steady::time_point began_ = Steady::now();
  std::optional<hal::Shared<rt::Station>> station_;
  std::optional<hal::Shared<sim::Bench>> bench_;
  std::optional<Recorder> recorder_;
  Child core_, vision_;
  bool vision_over_ = false;  // it ended for good
  bool vision_refused_ = false;
  double vision_again_at_ = 0;  // wall time of the next start, 0 = none planned
  std::vector<double> restarts_at_;
  RunEnd end_;
  int stop_stage_ = 0;
  std::uint64_t seen_ticks_ = 0;
  double ticked_at_ = 0;
  double stop_at_ = 0;
  bool stopped_by_user_ = false;
  bool tty_ = isatty(STDOUT_FILENO) != 0;
  bool line_drawn_ = false;
  double next_progress_ = 0;
  bool rights_told_ = false;
};

tl::expected<void, std::string> Run::start_vision() {
  std::vector<std::string> args{"live",        "--scene", folder_ + "/scene.toml", "--station",
                                station_name_, "--out",   folder_ + "/obs.csv"};
  if (bench_) args.insert(args.end(), {"--bench", bench_name_});
  if (settings_.frames && !long_run()) args.insert(args.end(), {"--overlay", folder_ + "/frames"});
  auto child = Child::start("punctum-vision", args, folder_ + "/vision.log");
  if (!child) return tl::unexpected(child.error());
  vision_ = std::move(*child);
  return {};
}

void Run::watch_vision() {
  if (vision_over_ || !scene_.vision) return;
  if (vision_again_at_ > 0 && wall_s() >= vision_again_at_) {
    vision_again_at_ = 0;
    if (auto r = start_vision(); !r) {
      complain(r.error());
      vision_over_ = true;
    } else {
      say("vision restarted (process {})", vision_.pid());
    }
  }
  Ended how;
  if (!vision_.ended(how)) return;
  const double t = recorder_->measures().last_s;
  if (how.exited && how.code == 0) {
    vision_over_ = true;
    if (scene_.recorded) {
      say("{:8.3f} s  the recorded frames have ended", t);
      rt::Command end;
      end.kind = rt::Command::end;
      (void)(*station_)->commands.try_push(end);
    }
    return;
  }
  const std::string why = how.text() + (how.exited ? ": " + last_line(vision_.log()) : "");
  if (how.exited && how.code == 2) {  // it will not get better by trying again
    complain("vision " + why);
    vision_over_ = vision_refused_ = true;
    interrupts.store(1);
    return;
  }
  end_.vision_restarts.push_back({t, why});
  restarts_at_.push_back(wall_s());
  std::erase_if(restarts_at_, [this](double at) { return at < wall_s() - kRestartWindow_s; });
  if (restarts_at_.size() > kRestartsAtOnce) {
    complain(fmt::format("vision {}; {} restarts within {:.0f} s are enough, going on without it", why,
                         kRestartsAtOnce, kRestartWindow_s));
    vision_over_ = true;
    if (bench_) (*bench_)->camera_pid.store(0);
    return;
  }
  // The first at once, then slower. Virtual time waits meanwhile: the dead one still counts as attached.
  const double pause =
      restarts_at_.size() == 1 ? 0 : 0.1 * std::pow(2.0, static_cast<double>(restarts_at_.size()) - 1);
  vision_again_at_ = std::max(wall_s() + pause, 1e-9);
  complain(fmt::format("vision {} at {:.3f} s; the core goes on without it, restarting", why, t));
}

// Ctrl-C: first a commanded stop, then a signal, then the end.
void Run::watch_interrupts() {
  const int n = interrupts.load(std::memory_order_relaxed);
  if (n > 0 && stop_stage_ == 0) {
    stopped_by_user_ = true;
    stop_stage_ = 1;
    stop_at_ = wall_s();
    say("stopping: needle held, force to zero (again Ctrl-C to insist)");
    rt::Command stop;
    stop.kind = rt::Command::stop;
    (void)(*station_)->commands.try_push(stop);
  }
  if (stop_stage_ == 1 && (n > 1 || wall_s() > stop_at_ + kPatience_s)) {
    stop_stage_ = 2;
    stop_at_ = wall_s();
    core_.send(SIGTERM);
  }
  if (stop_stage_ == 2 && (n > 2 || wall_s() > stop_at_ + kPatience_s)) {
    stop_stage_ = 3;
    complain("the core does not end: killed");
    core_.send(SIGKILL);
  }
}

// A core that hangs: its heartbeat has stopped and the relay has acted; it will not come back by itself.
void Run::watch_core() {
  const auto& core = (*station_)->core;
  const std::uint64_t ticks = core.ticks.load(std::memory_order_relaxed);
  const double hung_s = scene_.clock == ClockKind::real ? kHungCore_s : kHungVirtualCore_s;
  if (ticks != seen_ticks_ || core.started.load(std::memory_order_relaxed) == 0 ||
      core.counters_final.load(std::memory_order_relaxed) != 0) {
    seen_ticks_ = ticks;
    ticked_at_ = wall_s();
  } else if (wall_s() > ticked_at_ + hung_s) {
    complain(fmt::format("the core has not ticked for {:.0f} s: killed", hung_s));
    core_.send(SIGKILL);
    ticked_at_ = wall_s();
  }
}

void Run::progress() {
  const auto& core = (*station_)->core;
  if (!rights_told_ && core.started.load() != 0) {
    rights_told_ = true;
    if (core.degraded.load() != 0 && scene_.clock == ClockKind::real)
      if (const std::string text = missing_rights(core); !text.empty()) say("{}", text);
  }
  if (settings_.quiet || wall_s() < next_progress_) return;
  next_progress_ = wall_s() + (tty_ ? 0.1 : 5);
  const Measures& m = recorder_->measures();
  if (m.ticks == 0) return;
  const auto& s = m.last;
  const double hand =
      std::sqrt(s.force_N[0] * s.force_N[0] + s.force_N[1] * s.force_N[1] + s.force_N[2] * s.force_N[2]);
  std::string line = fmt::format("{:8.1f} s  {:<11}  hand {:5.2f} N", s.t_s, rt::name(s.phase), hand);
  if (scene_.servo.membrane)
    line += fmt::format("  needle {:6.1f} uN  depth {:6.1f} um", s.tip_force_N * 1e6, s.wd_m * 1e6);
  if (scene_.servo.cells != 1 && scene_.servo.phases) line += fmt::format("  cell {}", s.cell + 1);
  line += fmt::format("  missed {}", core.missed.load());
  if (s.fault != rt::Fault::none) line += fmt::format("  FAULT {}", rt::name(s.fault));
  if ((s.alarms & rt::alarm_vision_stale) != 0) line += "  vision stale";
  if (tty_) {
    put(stdout, "\r\033[K" + line);
    line_drawn_ = true;
  } else {
    say("{}", line);
  }
}

void Run::core_died() {
  if (!bench_ || !scene_.sim) return;
  if ((*bench_)->snapshots.head() == 0) {
    say("it had not begun: no device was switched on");
    return;
  }
  end_.unattended = sim::run_unattended(*scene_.sim, **bench_);
  const auto& u = *end_.unattended;
  const auto when = [](double s) {
    return s < 0 ? std::string("not") : fmt::format("after {:.0f} ms", s * 1e3);
  };
  say("the devices without it: relay opened {}, stage at rest {} ({:.1f} um further), injector gate shut {}, "
      "hand force off {}, holding vacuum {}: {}",
      when(u.relay_opened_s), when(u.stage_at_rest_s), u.stage_moved_m * 1e6, when(u.gate_shut_s),
      when(u.hand_force_off_s), u.vacuum_kept ? "kept" : "LOST", u.safe ? "safe" : "NOT SAFE");
}

void Run::end_vision() {
  if (!vision_.running()) return;
  const double began = wall_s();
  bool asked = false;
  Ended how;
  while (!vision_.ended(how)) {
    if (!asked && wall_s() > began + kPatience_s) {
      vision_.send(SIGTERM);
      asked = true;
    }
    if (wall_s() > began + 2 * kPatience_s) {
      complain("vision does not end: killed");
      vision_.send(SIGKILL);
      nap(0.05);
      (void)vision_.ended(how);
      return;
    }
    nap(0.005);
  }
  if (!how.exited || how.code != 0)
    complain(fmt::format("vision {}{}", how.text(), how.exited ? ": " + last_line(vision_.log()) : ""));
}

Outcome Run::judge(const Ended& ended) const {
  if (!ended.exited) return Outcome::core_died;
  const auto& core = (*station_)->core;
  const auto fault = static_cast<rt::Fault>(core.fault.load());
  if (fault != rt::Fault::none && fault != rt::Fault::command_stop) return Outcome::fault;
  const auto phase = static_cast<rt::Phase>(core.phase.load());
  const bool left = phase == rt::Phase::clear;
  const bool outside = left || phase == rt::Phase::free;
  if (stopped_by_user_ || fault == rt::Fault::command_stop)
    return scene_.has_task() || vision_over_ || !outside ? Outcome::stopped : Outcome::done;
  const Measures& m = recorder_->measures();
  if (m.cells_lost > 0 && scene_.has_task()) return Outcome::cell_lost;
  // The core knows that it opened the gate; the simulated world, whether anything came out.
  if (m.cells_without > 0 && scene_.has_task()) return Outcome::not_injected;
  if (core.task_finished.load() != 0 || !scene_.has_task()) return Outcome::done;
  return left && !stopped_by_user_ &&
                 core.exit_reason.load() != static_cast<std::uint64_t>(rt::ExitReason::time_limit)
             ? Outcome::not_injected
             : Outcome::time_limit;
}

int Run::run() {
  const auto folder = prepare_folder(scene_, settings_.report);
  if (!folder) {
    complain(folder.error());
    return 2;
  }
  folder_ = *folder;
  {
    std::ofstream out(folder_ + "/scene.toml");
    out << to_toml(scene_);
    if (!out.flush()) {
      complain(fmt::format("{}/scene.toml: cannot be written", folder_));
      return 2;
    }
  }
  hal::remove_stale_segments();
  const std::string name = station_name(scene_);
  station_name_ = name + ".station";
  auto station = hal::Shared<rt::Station>::create(station_name_);
  if (!station) {
    complain(station.error());
    return 2;
  }
  station_ = std::move(*station);
  if (scene_.sim) {
    bench_name_ = name + ".bench";
    auto bench = hal::Shared<sim::Bench>::create(bench_name_);
    if (!bench) {
      complain(bench.error());
      return 2;
    }
    bench_ = std::move(*bench);
    (*bench_)->virtual_time.store(scene_.clock == ClockKind::virtual_time ? 1 : 0);
  }

  std::uint64_t every = settings_.samples_every;
  if (every == 0) {
    every = 1;
    if (long_run()) {
      const double limit = scene_.seconds > 0 ? scene_.seconds : 8 * 3600.0;
      every = std::max<std::uint64_t>(
          1, static_cast<std::uint64_t>(limit * scene_.servo.rate_Hz) / kRowsOfLongRun);
    }
  }
  auto recorder =
      Recorder::create(folder_ + "/samples.csv", scene_, **station_, bench_ ? bench_->get() : nullptr, every);
  if (!recorder) {
    complain(recorder.error());
    return 2;
  }
  recorder_ = std::move(*recorder);

  struct sigaction action {};
  action.sa_handler = on_interrupt;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);

  say("{}: {} ({} Hz, {} clock, seed {})", scene_.name, scene_.title.empty() ? scene_.source : scene_.title,
      scene_.servo.rate_Hz, scene_.clock == ClockKind::real ? "real" : "virtual",
      scene_.sim ? scene_.sim->seed : 0);
  say("report: {}", folder_);

  // Recorded frames play from the core's first tick on; a camera is there before it.
  const bool vision_later = scene_.recorded && scene_.clock == ClockKind::real;
  if (scene_.vision && !vision_later)
    if (auto r = start_vision(); !r) {
      complain(r.error());
      return 2;
    }
  std::vector<std::string> args{"--scene",   folder_ + "/scene.toml",
                                "--station", station_name_,
                                "--clock",   scene_.clock == ClockKind::real ? "real" : "virtual"};
  if (bench_) args.insert(args.end(), {"--bench", bench_name_});
  auto core = Child::start("punctum-core", args, folder_ + "/core.log");
  if (!core) {
    complain(core.error());
    return 2;
  }
  core_ = std::move(*core);

  Ended ended;
  began_ = Steady::now();
  while (true) {
    const std::uint64_t taken = recorder_->drain();
    if (core_.ended(ended)) break;
    if (vision_later && !vision_.running() && !vision_over_ && vision_again_at_ == 0 &&
        restarts_at_.empty() && (*station_)->core.started.load() != 0)
      if (auto r = start_vision(); !r) {
        complain(r.error());
        vision_over_ = vision_refused_ = true;
        interrupts.store(1);
      }
    watch_vision();
    watch_interrupts();
    watch_core();
    progress();
    if (taken < 64) nap(scene_.clock == ClockKind::real ? 2e-3 : 1e-4);
  }
  recorder_->finish();
  clear_line();

  const auto& status = (*station_)->core;
  if (ended.exited && ended.code == 2) {  // it never started
    complain(fmt::format("punctum-core: {}", last_line(core_.log())));
    vision_.send(SIGTERM);
    end_vision();
    return 2;
  }
  end_.outcome = judge(ended);
  end_.wall_s = wall_s();
  if (end_.outcome == Outcome::core_died) {
    end_.outcome_detail = ended.text();
    complain(fmt::format("the control core {} at {:.3f} s", ended.text(), recorder_->measures().last_s));
    core_died();
  }
  if (end_.outcome == Outcome::fault)
    end_.outcome_detail = rt::name(static_cast<rt::Fault>(status.fault.load()));
  if (bench_) (*bench_)->finished.store(1);  // a camera that still waits goes home
  end_vision();

  end_.rows = recorder_->rows();
  end_.rows_every = recorder_->every();
  end_.samples_lost = recorder_->lost();
  const auto contour = read_contour_error(folder_ + "/obs.csv");
  const Measures& m = recorder_->measures();
  bool written = true;
  if (auto r = write_report(folder_ + "/report.json", scene_, end_, m, status, contour); !r) {
    written = false;
    complain(r.error());
  }
  if (recorder_->write_failed())
    complain(fmt::format("{}/samples.csv: not complete, is the disk full?", folder_));
  std::string drawn;
  if (settings_.figure) {
    if (auto r = draw_figure(folder_, scene_, m, end_.rows); !r) {
      complain(fmt::format("no figure: {}", r.error()));
    } else {
      drawn = *r;
    }
  }
  std::string last_words = "\n" + summary(scene_, end_, m, status, contour);
  if (!drawn.empty()) last_words += fmt::format("figure          {}\n", drawn);
  if (written) last_words += fmt::format("report          {}\n", folder_ + "/report.json");
  put(stdout, last_words);
  if (vision_refused_) return 2;
  switch (end_.outcome) {
    case Outcome::done:
      return written && !recorder_->write_failed() ? 0 : 1;
    case Outcome::cell_lost:
    case Outcome::not_injected:
    case Outcome::time_limit:
    case Outcome::stopped:
      return 1;
    case Outcome::fault:
    case Outcome::core_died:
      return 3;
  }
  return 3;
}

}  // namespace

int run_scene(const Scene& scene, const RunSettings& settings) {
  Run run(scene, settings);
  return run.run();
}

}  // namespace punctum::tools
