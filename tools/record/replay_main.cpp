// punctum-replay: a recorded run again.
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tools/record/player.hpp"
#include "tools/record/replay.hpp"
#include "tools/shared/child.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/input_lines.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/version.hpp"

namespace {

using namespace punctum::tools;

int replay_again(const std::string& recording) {
  const auto replayed = replay_inputs(recording);
  if (!replayed) {
    complain("punctum-replay: " + replayed.error());
    return exit_bad_input;
  }
  for (const auto& [ticks, which] :
       {std::pair{replayed->not_told, "whose telemetry is not in the recording"},
        {replayed->not_known, "whose phase, fault, stop or time is none that this build knows"},
        {replayed->not_given, "whose input is not in the recording"}}) {
    if (ticks > 0) {
      complain(fmt::format("punctum-replay: not compared: {} ticks {}", ticks, which));
    }
  }
  if (!replayed->ends.empty()) {
    complain("punctum-replay: " + replayed->ends);
  }
  if (const auto& d = replayed->differs) {
    say(fmt::format("{}: differs first at tick {} ({:.6f} s): {}: recorded {}, now {}{}\n", recording,
                    d->tick, d->t_s, d->field, d->recorded, d->now,
                    d->more > 0 ? fmt::format("; and {} more values of this tick", d->more) : ""));
    return exit_not_done;
  }
  const std::uint64_t not_compared = replayed->not_told + replayed->not_known + replayed->not_given;
  say(fmt::format("{}: {} ticks, to {:.3f} s of the run: bit-identical{}\n", recording, replayed->ticks,
                  replayed->end_s,
                  not_compared > 0 ? fmt::format("; {} more were not compared", not_compared) : ""));
  return replayed->ends.empty() && not_compared == 0 ? exit_done : exit_not_done;
}

constexpr std::chrono::milliseconds kRound{5};
constexpr int kMostWishes = 32;  // of a console in one round

// What a person types while a recording plays.
class Remote {
 public:
  explicit Remote(Player& player) : player_(player) {}

  double speed = 1;
  bool playing = true;
  bool quit = false;
  bool jumped = false;  // to a moment, which takes a while

  void obey(const std::string& line) {
    std::istringstream words(line);
    std::string what;
    words >> what;
    double number = 0;
    const bool has_number = static_cast<bool>(words >> number) && std::isfinite(number);
    if (what == "seek" && has_number) {
      go_to(number);
    } else if (what == "speed" && has_number && number >= kSlowestReplay && number <= kFastestReplay) {
      speed = number;
    } else if (what == "pause") {
      playing = false;
    } else if (what == "play") {
      playing = true;
    } else if (what == "next" || what == "back") {
      to_mark(what == "next");
    } else if (what == "marks") {
      for (const Mark& mark : player_.marks()) {
        say(fmt::format("{:9.3f} s  {}\n", mark.t_s, mark.text));
      }
    } else if (what == "quit") {
      quit = true;
    } else {
      say(fmt::format(
          "allowed: seek SECONDS, speed {} .. {}, pause, play, next, back (to a mark), marks, quit\n",
          kSlowestReplay, kFastestReplay));
    }
  }

  void obey(const ReplayWish& wish) {
    if (wish.kind == ReplayWish::seek && std::isfinite(wish.value)) {
      player_.go_to(wish.value);
      jumped = true;
    } else if (wish.kind == ReplayWish::speed && wish.value >= kSlowestReplay &&
               wish.value <= kFastestReplay) {
      speed = wish.value;
    } else if (wish.kind == ReplayWish::play || wish.kind == ReplayWish::pause) {
      playing = wish.kind == ReplayWish::play;
    }
  }

 private:
  void go_to(double t_s) {
    player_.go_to(t_s);
    jumped = true;
    say(fmt::format("{:9.3f} s of {:.3f} s\n", player_.now_s(), player_.last_s()));
  }
  // The next one after now, or the last one before it; those of one tick are one.
  void to_mark(bool next) {
    const Mark* to = nullptr;
    for (const Mark& mark : player_.marks()) {
      if (next ? mark.t_s > player_.now_s() && to == nullptr : mark.t_s < player_.now_s() - 0.001) {
        to = &mark;
      }
    }
    if (to != nullptr) {
      say(to->text + "\n");
      go_to(to->t_s);
    }
  }

  Player& player_;
};

struct Showing {
  bool console = false;
  double from_s = 0, speed = 1;
};

int show(const std::string& recording, const Showing& how) {
  stop_signal::watch({SIGINT, SIGTERM, SIGHUP, SIGQUIT});
  signal(SIGPIPE, SIG_IGN);
  const std::string station = fmt::format("replay-{}", ::getpid());
  auto opened = Player::open(recording, station);
  if (!opened) {
    complain("punctum-replay: " + opened.error());
    return exit_bad_input;
  }
  Player& player = **opened;
  if (how.from_s > player.last_s()) {
    complain(fmt::format("punctum-replay: --from: {}: allowed: up to {:.3f}, where the recording ends",
                         how.from_s, player.last_s()));
    return exit_bad_input;
  }
  if (!player.ends().empty()) {
    complain("punctum-replay: " + player.ends());
  }
  Child console;
  // Nobody else may lay a file where the log is to be, or read the token in it.
  std::string private_folder = (std::filesystem::temp_directory_path() / "punctum-replay-XXXXXX").string();
  if (how.console && ::mkdtemp(private_folder.data()) == nullptr) {
    complain(fmt::format("punctum-replay: {}: cannot be made: {}", private_folder, std::strerror(errno)));
    return exit_bad_input;
  }
  const std::string log = private_folder + "/console.log";
  const auto remove_log = [&] {
    std::error_code ignored;
    std::filesystem::remove_all(private_folder, ignored);
  };
  bool address_told = !how.console;
  if (how.console) {
    auto started = Child::start("punctum-console", {"--station", station}, log);
    if (!started) {
      complain("punctum-replay: " + started.error());
      remove_log();
      return exit_bad_input;
    }
    console = std::move(*started);
  }
  say(
      fmt::format("station: {}, {:.3f} s to {:.3f} s, {} marks; seek SECONDS, speed FACTOR, pause, play, "
                  "next, back, marks, quit\n",
                  station, player.first_s(), player.last_s(), player.marks().size()));
  Remote remote(player);
  remote.speed = how.speed;
  player.go_to(how.from_s);
  InputLines typed(STDIN_FILENO);
  bool listening = true;
  for (auto before = std::chrono::steady_clock::now(); stop_signal::count() == 0 && !remote.quit;) {
    pollfd look{STDIN_FILENO, POLLIN, 0};
    if (listening && ::poll(&look, 1, 0) > 0) {
      std::vector<std::string> lines;
      listening = typed.read_into(lines);
      std::for_each(lines.begin(), lines.end(), [&remote](const std::string& line) { remote.obey(line); });
    }
    ReplayWish newest_seek{ReplayWish::seek, player.now_s()}, wish;
    bool seeks = false;
    for (int i = 0; i < kMostWishes && player.next(wish); ++i) {
      if (wish.kind == ReplayWish::seek) {  // of several moments the last one alone
        newest_seek = wish;
        seeks = true;
      } else {
        remote.obey(wish);
      }
    }
    if (seeks) {
      remote.obey(newest_seek);
    }
    const auto now = std::chrono::steady_clock::now();
    if (std::exchange(remote.jumped, false)) {
      before = now;
    }
    if (remote.playing) {
      player.go_to(player.now_s() + remote.speed * std::chrono::duration<double>(now - before).count());
    }
    before = now;
    if (player.serve(remote.speed, remote.playing)) {
      remote.playing = false;
      say("stop: a recording moves nothing; it is paused\n");
    }
    if (!address_told) {
      if (const std::string line = last_line(log); line.find("http://") != std::string::npos) {
        say(line + "\n");
        address_told = true;
      }
    }
    if (Ended end; console.running() && console.ended(end)) {
      complain("punctum-replay: the console " + end.text() + ": " + last_line(log));
      address_told = true;
    }
    std::this_thread::sleep_for(kRound);
  }
  console.send(SIGTERM);
  remove_log();
  return player.ends().empty() ? exit_done : exit_not_done;
}

int run(int argc, char** argv) {
  std::string recording;
  Showing showing;
  bool as_station = false;
  CLI::App app{
      "Gives the recorded inputs of a run to today's servo again and compares what it does, bit by bit.",
      "punctum-replay"};
  set_help_style(app);
  app.set_version_flag("--version", version_line("punctum-replay"), "version and commit");
  app.footer(help_footer(
      {{"punctum run icsi --record && punctum-replay FOLDER/recording.mcap",
        "whether this build's servo does, tick by tick, what was recorded"},
       {"punctum-replay recording.mcap --console --speed 0.25", "the run once more in a browser, slowly"}},
      {{exit_done, "bit-identical, and the recording is whole"},
       {exit_not_done,
        "it differs, and the first difference is said; or the recording ends early, has holes, or has ticks "
        "that cannot be compared"},
       {exit_bad_input, "no recording, or none that holds the inputs of a run from its first tick on"}}));
  app.add_flag("--console", showing.console,
               "show it in a browser instead, as a run; what is typed seeks, changes the speed, pauses");
  app.add_flag("--station", as_station, "likewise without a browser: punctum-console and others may join");
  const auto* const from = app.add_option("--from", showing.from_s, "time of the run to begin at")
                               ->type_name("SECONDS")
                               ->check(within(0.0, 1e9));
  const auto* const speed = app.add_option("--speed", showing.speed, "times as fast as it was (default: 1)")
                                ->check(within(kSlowestReplay, kFastestReplay))
                                ->type_name("FACTOR");
  app.add_option("RECORDING", recording, "an MCAP file of `punctum run --record`")->required();
  if (const auto code = parse_command_line(app, argc, argv)) {
    return *code;
  }
  if (as_station && showing.console) {
    complain("punctum-replay: --station is without a browser, allowed without --console");
    return exit_bad_input;
  }
  if (as_station || showing.console) {
    return show(recording, showing);
  }
  if (from->count() > 0 || speed->count() > 0) {
    complain("punctum-replay: --from and --speed are of --console and --station");
    return exit_bad_input;
  }
  return replay_again(recording);
}

}  // namespace

int main(int argc, char** argv) {
  start_program();
  try {
    return code_after_words(run(argc, argv));
  } catch (const std::exception& e) {
    complain(std::string("punctum-replay: ") + e.what());
    return exit_bad_input;
  }
}
