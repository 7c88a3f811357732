// punctum: runs, explains and checks scenes. The only program that starts others.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/punctum/explain.hpp"
#include "tools/punctum/lab_report.hpp"
#include "tools/punctum/plugged_in.hpp"
#include "tools/punctum/positioning.hpp"
#include "tools/punctum/supervisor.hpp"
#include "tools/punctum/terminal.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/child.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/version.hpp"

namespace {

using namespace punctum::tools;

std::vector<std::pair<int, const char*>> exit_codes_of_run() {
  return {{exit_done, "the task ended well"},
          {exit_not_done, "it ended without a fault, but is not done, or its report is not complete"},
          {exit_bad_input, "bad input: nothing was started"},
          {exit_fault, "a latched fault, or a control core that died"}};
}

int bad(const std::string& text) {
  complain(text);
  return 2;
}

// Programs of their own, which need libraries that a station does not.
constexpr const char* kOtherPrograms[] = {"export", "replay"};

// Returns only where the command line names none of them, or one that is not there: then why.
std::string become_another(int argc, char** argv) {
  for (const char* command : kOtherPrograms) {
    if (argc > 1 && std::string_view(argv[1]) == command) {
      const std::string name = std::string("punctum-") + command;
      if (const std::string program = find_program(name); !program.empty()) {
        execv(program.c_str(), argv + 1);
      }
      return fmt::format(
          "{} is not there, neither beside this program nor in PATH (Debian package punctum-tools)", name);
    }
  }
  return {};
}

int main_or_throw(int argc, char** argv) {
  CLI::App app{"Haptic cell injection: runs a scene on control core, station and vision, and reports.",
               "punctum"};
  set_help_style(app);
  app.require_subcommand(1);
  app.set_version_flag("--version", version_line("punctum"), "version and commit");
  app.footer(help_footer(
      {{"punctum run icsi", "one injection on the simulated station; its report goes to reports/"},
       {"punctum run icsi --clock virtual --seed 7", "the same, as fast as possible and the same every time"},
       {"punctum run my.toml --set servo.rate_hz=2000", "a scene of your own, one number changed"},
       {"punctum explain zebrafish", "what would run, and what is left out"},
       {"punctum devices", "what is plugged in, and how a scene names it"},
       {"punctum report reports/a reports/b", "their reports once more, and the two compared"},
       {"punctum export recording.mcap --csv tables", "a recorded run as tables; the program punctum-export"},
       {"punctum replay recording.mcap",
        "its inputs through this build's servo again: the same bits?; the program punctum-replay"}},
      exit_codes_of_run()));
  std::string scene_name;
  std::vector<std::string> overrides;
  std::string clock, seed, rate, seconds;
  RunSettings settings;
  bool no_frames = false, no_figure = false, keys = false;

  const auto common = [&](CLI::App* sub) {
    std::string names;
    for (const auto n : builtin_names()) {
      names += (names.empty() ? "" : ", ") + std::string(n);
    }
    sub->add_option("SCENE", scene_name, "a scene file, or one of: " + names)->required();
    sub->add_option("--set", overrides, "change the scene; or TABLE=on, TABLE=off; may be repeated")
        ->type_name("TABLE.KEY=VALUE")
        ->allow_extra_args(false)
        ->take_all();
    sub->add_option("--rate", rate, "of the servo: 1000, 2000, 4000 or 8000")->type_name("HZ");
    sub->add_option("--clock", clock, "virtual: as fast as possible, the same every time")
        ->check(CLI::IsMember({"real", "virtual"}))
        ->type_name("real|virtual");
    sub->add_option("--seed", seed, "of the simulated world: a whole number")->type_name("NUMBER");
    sub->add_option("--seconds", seconds, "time limit of the run, in the scene's time")->type_name("SECONDS");
  };
  CLI::App* run = app.add_subcommand("run", "run a scene and write a report");
  common(run);
  run->add_option("--report", settings.report, "folder of the report (default: reports/SCENE-DATE)")
      ->type_name("FOLDER");
  run->add_flag("--overwrite", settings.overwrite,
                "the new report takes the place of the one in --report once it is whole; without, it gets a "
                "new folder");
  run->add_option("--samples-every", settings.samples_every,
                  "write every n-th tick to samples.csv (default: all, of long runs fewer)")
      ->check(within(1, 1'000'000'000))
      ->type_name("TICKS");
  run->add_flag("--no-frames", no_frames, "write no annotated frames");
  run->add_flag("--no-figure", no_figure, "draw no figure");
  run->add_flag("--record", settings.record,
                "record all that the station tells into recording.mcap of the report");
  run->add_flag("--pictures", settings.pictures,
                "and the pictures that vision looks at, with --record: 8 MB/s of 640 x 480 at 25 per second");
  run->add_flag("--console", settings.console,
                "show it in a browser on this machine; the address is printed");
  run->add_flag("--quiet", settings.quiet, "no progress, only the summary");
  CLI::App* explaining =
      app.add_subcommand("explain", "print what a scene would start, and what it leaves out");
  common(explaining);
  explaining->add_flag("--keys", keys, "every table and key, its value and what is allowed");
  CLI::App* checking =
      app.add_subcommand("check", "validate a scene, devices and permissions; touches no actuator");
  common(checking);

  CLI::App* moving = app.add_subcommand(
      "move", "move the slow manipulator of a scene to a point, or park it; not while a run goes on");
  common(moving);
  std::vector<double> to_um;
  bool parks = false;
  auto* const to = moving->add_option("--to", to_um, "in micrometres, in the manipulator's own frame")
                       ->type_name("X,Y,Z")
                       ->delimiter(',')
                       ->expected(3);
  auto* const park = moving->add_flag("--park", parks, "to zaber.park_um of the scene");
  to->excludes(park);
  CLI::App* listing =
      app.add_subcommand("devices", "list what is plugged in, and the lines of a scene that would use it");

  CLI::App* reporting = app.add_subcommand(
      "report", "make report.html again, after a crash report.json too; of several runs also compare them");
  std::vector<std::string> folders;
  std::string comparison;
  reporting->add_option("FOLDER", folders, "report folders of runs")->required();
  reporting
      ->add_option("--out", comparison, "where the comparison goes (default: reports/comparison-DATE.html)")
      ->type_name("FILE");
  for (const char* command : kOtherPrograms) {  // their help is their own
    (void)app.add_subcommand(command)->group("");
  }
  run->footer(
      help_footer({{"punctum run icsi --report reports/mine", "the report goes to that folder"},
                   {"punctum run recorded --set camera.frames=my/pictures", "vision on your own pictures"},
                   {"NO_COLOR=1 punctum run icsi", "without colour on the terminal"}},
                  exit_codes_of_run()));
  explaining->footer(help_footer({{"punctum explain icsi --keys", "every number that can be set"}},
                                 {{exit_done, "explained"}, {exit_bad_input, "bad input"}}));
  checking->footer(
      help_footer({{"punctum check my.toml", "before the first run on a machine"}},
                  {{exit_done, "it can run"}, {exit_bad_input, "it cannot; the text says why"}}));
  moving->footer(help_footer(
      {{"punctum move my.toml --to 1000,2500,-300", "it says when it is there"},
       {"punctum move my.toml --park", "out of the way"}},
      {{exit_done, "it is there"},
       {exit_not_done, "stopped on the way, by control-C"},
       {exit_bad_input, "bad input: nothing has moved"},
       {exit_fault, "the manipulator has a fault, came to rest somewhere else, or does not come to rest"}}));
  listing->footer(
      help_footer({{"punctum devices", "what a scene could name on this machine"}}, {{exit_done, "listed"}}));
  reporting->footer(help_footer(
      {{"punctum report reports/icsi-20260101-120000", "after a crash, or from an older version"},
       {"punctum report reports/icsi-*", "all of them, compared in a table with figures"}},
      {{exit_done, "written"},
       {exit_not_done, "a report could not be written, or what it is made of is damaged or ends early"},
       {exit_bad_input, "bad input"}}));

  if (const auto code = parse_command_line(app, argc, argv)) {
    return *code;
  }
  if (*listing) {
    Terminal().print(plugged_in(Machine{}));
    return code_after_words(exit_done);
  }
  if (*reporting) {
    return code_after_words(report_folders(folders, comparison));
  }

  // Options are overrides too, so that their messages are the same.
  // (scene.seconds = 0 is no limit; whoever types --seconds wants one.)
  const auto given = [&app](const char* option) { return app.get_subcommands().front()->count(option) > 0; };
  if (given("--seconds")) {
    char* rest = nullptr;
    const double s = std::strtod(seconds.c_str(), &rest);
    if (seconds.empty() || *rest != '\0' || !(s >= 1e-3 && s <= 1e6)) {
      return bad(
          fmt::format("--seconds: {}: not a time limit, allowed: a number from 0.001 to 1000000", seconds));
    }
    overrides.push_back(fmt::format("scene.seconds={}", s));
  }
  if (given("--rate")) {
    overrides.push_back("servo.rate_hz=" + rate);
  }
  if (given("--clock")) {
    overrides.push_back("scene.clock=\"" + clock + "\"");
  }
  if (given("--seed")) {
    overrides.push_back("scene.seed=" + seed);
  }
  auto scene = load_scene(scene_name, overrides);
  if (!scene) {
    std::string why = scene.error();
    for (const auto& [option, key] : {std::pair{"--rate", "servo.rate_hz"}, {"--seed", "scene.seed"}}) {
      why = given(option) ? said_of_option(why, key, option) : why;
    }
    return bad(why);
  }

  if (*explaining) {
    Terminal().print(keys ? explain_keys(*scene) : explain(*scene));
    return code_after_words(exit_done);
  }
  if (*checking) {
    std::string text;
    const int code = check(*scene, text);
    Terminal().print(text);
    return code_after_words(code);
  }
  if (*moving) {
    if (to_um.empty() && !parks) {
      return bad("punctum move: where to? Allowed: --to X,Y,Z or --park");
    }
    return move_positioner(*scene, to_um.empty()
                                       ? std::nullopt
                                       : std::optional<punctum::hal::Vec3>(
                                             punctum::hal::Vec3(to_um[0], to_um[1], to_um[2]) * 1e-6));
  }
  if (const auto files = files_of(*scene); !files) {
    return bad(files.error());
  }
  if (given("--report") && settings.report.empty()) {
    return bad("--report: names no folder");
  }
  if (settings.overwrite && settings.report.empty()) {
    return bad("--overwrite: allowed with --report, which names the folder");
  }
  settings.frames = !no_frames;
  settings.figure = !no_figure;
  // Its hand is on the page.
  settings.console = settings.console || scene->devices.haptic == kBrowser;
  if (settings.console && scene->vision && scene->vision->method != punctum::vision::Method::truth) {
    scene->vision->surface = true;  // which the page draws
  }
  return run_scene(*scene, settings);
}

}  // namespace

int main(int argc, char** argv) {
  start_program();
  if (const std::string lacks = become_another(argc, argv); !lacks.empty()) {
    return bad(lacks);
  }
  try {
    return main_or_throw(argc, argv);
  } catch (const std::exception& e) {
    punctum::tools::complain(std::string("punctum: ") + e.what());
    return 2;
  }
}
