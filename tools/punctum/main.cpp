// punctum: runs, explains and checks scenes. The only program that starts others.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "tools/punctum/explain.hpp"
#include "tools/punctum/supervisor.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/version.hpp"

namespace {

using namespace punctum::tools;

int bad(const std::string& text) {
  fmt::print(stderr, "{}\n", text);
  return 2;
}

int main_or_throw(int argc, char** argv) {
  CLI::App app{"Haptic cell injection: control core, simulated station and vision"};
  app.require_subcommand(1);
  app.set_version_flag("--version", version_line("punctum"));
  app.failure_message([](const CLI::App*, const CLI::Error& e) { return std::string(e.what()) + "\n"; });
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
    sub->add_option("--set", overrides, "table.key=value, or table=on|off; may be repeated")
        ->allow_extra_args(false)
        ->take_all();
    sub->add_option("--rate", rate, "servo rate in Hz: 1000, 2000, 4000 or 8000");
    sub->add_option("--clock", clock, "real, or virtual: as fast as possible, the same every time")
        ->check(CLI::IsMember({"real", "virtual"}));
    sub->add_option("--seed", seed, "of the simulated world");
    sub->add_option("--seconds", seconds, "time limit");
  };
  CLI::App* run = app.add_subcommand("run", "run a scene and write a report");
  common(run);
  run->add_option("--report", settings.report, "folder of the report (default: reports/SCENE-DATE)");
  run->add_option("--samples-every", settings.samples_every,
                  "write every n-th tick to samples.csv (0: choose)")
      ->check(CLI::Range(0, 1'000'000'000));
  run->add_flag("--no-frames", no_frames, "write no annotated frames");
  run->add_flag("--no-figure", no_figure, "draw no figure");
  run->add_flag("--quiet", settings.quiet, "no progress, only the summary");
  CLI::App* explaining =
      app.add_subcommand("explain", "print what a scene would start, and what it leaves out");
  common(explaining);
  explaining->add_flag("--keys", keys, "every table and key, its value and what is allowed");
  CLI::App* checking =
      app.add_subcommand("check", "validate a scene, devices and permissions; touches no actuator");
  common(checking);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const int code = app.exit(e);
    return code == 0 ? 0 : 2;
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
  const auto scene = load_scene(scene_name, overrides);
  if (!scene) {
    return bad(scene.error());
  }

  if (*explaining) {
    fmt::print("{}", keys ? explain_keys(*scene) : explain(*scene));
    return 0;
  }
  if (*checking) {
    std::string text;
    const int code = check(*scene, text);
    fmt::print("{}", text);
    return code;
  }
  if (const auto files = files_of(*scene); !files) {
    return bad(files.error());
  }
  settings.frames = !no_frames;
  settings.figure = !no_figure;
  return run_scene(*scene, settings);
}

}  // namespace

int main(int argc, char** argv) {
  start_program();
  try {
    return main_or_throw(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "punctum: {}\n", e.what());
    return 2;
  }
}
