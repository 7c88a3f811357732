// punctum-export: a recording as tables and surfaces.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/record/export_csv.hpp"
#include "tools/record/export_hdf5.hpp"
#include "tools/record/export_pictures.hpp"
#include "tools/record/export_surface.hpp"
#include "tools/record/overview.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/version.hpp"

namespace {

using namespace punctum::tools;

int run(int argc, char** argv) {
  std::vector<std::string> recordings;
  std::string csv, hdf5, surface, png, tiff, overview;
  std::optional<double> at_s;
  CLI::App app{"Makes tables and surfaces of a recording.", "punctum-export"};
  set_help_style(app);
  app.set_version_flag("--version", version_line("punctum-export"), "version and commit");
  app.footer(help_footer(
      {{"punctum-export recording.mcap --csv tables",
        "samples.csv and events.csv as the run wrote them, observations.csv, scene.toml"},
       {"punctum-export recording.mcap --csv tables && punctum report tables", "and a report of them"},
       {"punctum-export recording.mcap --obj cell --at 7.5",
        "cell.obj, cell.json, cell-outer.stl, ... of a run with vision.surface = true"},
       {"punctum-export */recording.mcap --overview runs",
        "many runs side by side: runs.csv, punctures.csv, runs.svg"}},
      {{exit_done, "exported, and the recording is whole"},
       {exit_not_done,
        "the recording ends early, has holes, or tells what this build does not know: the rest is exported"},
       {exit_bad_input, "no recording, nowhere to write, or what is asked for is not in it"}}));
  app.add_option("RECORDING", recordings, "MCAP files of punctum-record; one, but for --overview")
      ->required();
  app.add_option("--csv", csv, "folder for the tables")->type_name("FOLDER");
  app.add_option("--hdf5", hdf5, "all quantities over time in one file, in the layout of NWB")
      ->type_name("FILE.nwb");
  app.add_option("--obj", surface, "the surfaces of the membranes: files that begin with this")
      ->type_name("STEM");
  app.add_option("--at", at_s, "time of the run of these surfaces (default: the last ones)")
      ->type_name("SECONDS");
  app.add_option("--png", png, "folder for the pictures, a file each, and the table of their times")
      ->type_name("FOLDER");
  app.add_option("--ome-tiff", tiff, "all pictures in one file, with their times and the size of a pixel")
      ->type_name("FILE.ome.tif");
  app.add_option("--overview", overview,
                 "folder for a table of all recordings, one of their punctures, and a figure")
      ->type_name("FOLDER");
  if (const auto code = parse_command_line(app, argc, argv)) {
    return *code;
  }
  const auto refuse = [](const std::string& why) {
    complain("punctum-export: " + why);
    return exit_bad_input;
  };
  const bool one = !csv.empty() || !hdf5.empty() || !surface.empty() || !png.empty() || !tiff.empty();
  if (!one && overview.empty()) {
    return refuse(
        "as what? Allowed: --csv FOLDER, --hdf5 FILE, --obj STEM, --png FOLDER, --ome-tiff FILE, --overview "
        "FOLDER");
  }
  if (one && recordings.size() > 1) {
    return refuse(fmt::format("{} recordings: only --overview takes more than one", recordings.size()));
  }
  if (at_s && surface.empty()) {
    return refuse("--at: a time of the surfaces, allowed with --obj");
  }
  const std::string& recording = recordings.front();
  std::vector<std::string> early;  // why an output is not all that was wanted
  const auto ends = [&early](const std::string& why) {
    if (!why.empty() && std::find(early.begin(), early.end(), why) == early.end()) {
      early.push_back(why);
    }
  };
  bool refused = false;
  // What cannot be made does not keep the rest from being made.
  const auto made = [&](const tl::expected<std::string, std::string>& exported) {
    if (!exported) {
      refused = true;
      complain("punctum-export: " + exported.error());
    } else {
      ends(*exported);
    }
  };
  if (!overview.empty()) {
    std::vector<RunFacts> runs;
    std::size_t unreadable = 0;
    for (const std::string& path : recordings) {
      if (auto facts = facts_of(path)) {
        ends(facts->ends);
        runs.push_back(std::move(*facts));
      } else if (recordings.size() == 1) {
        return refuse(facts.error());
      } else {
        complain("punctum-export: left out: " + facts.error());
        ++unreadable;
      }
    }
    if (runs.empty()) {
      return refuse("none of these is a recording with a tick in it");
    }
    if (unreadable > 0) {
      ends(fmt::format("{} of {} are left out", unreadable, recordings.size()));
    }
    if (const auto written = write_overview(runs, overview); !written) {
      return refuse(written.error());
    }
    say(overview_table(runs));
    if (const auto drawn = draw_overview(runs, overview); !drawn) {
      complain("punctum-export: no figure: " + drawn.error());
      ends("the tables are there, the figure is not");
    }
  }
  if (!csv.empty()) {
    const auto exported = export_csv(recording, csv);
    if (exported) {
      say(fmt::format("{}: {} ticks, {} events, {} observations\n", csv, exported->ticks, exported->events,
                      exported->observations));
    }
    made(exported.map([](const auto& counts) { return counts.ends; }));
  }
  if (!hdf5.empty()) {
    made(export_hdf5(recording, hdf5));
  }
  if (!surface.empty()) {
    made(export_surface(recording, surface, at_s));
  }
  if (!png.empty()) {
    made(export_png(recording, png));
  }
  if (!tiff.empty()) {
    made(export_ome_tiff(recording, tiff));
  }
  if (refused) {
    return exit_bad_input;
  }
  for (const std::string& why : early) {
    complain("punctum-export: " + why);
  }
  return early.empty() ? exit_done : exit_not_done;
}

}  // namespace

int main(int argc, char** argv) {
  start_program();
  try {
    return code_after_words(run(argc, argv));
  } catch (const std::exception& e) {
    complain(std::string("punctum-export: ") + e.what());
    return exit_bad_input;
  }
}
