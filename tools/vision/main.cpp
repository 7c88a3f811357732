// punctum-vision: frames -> observations, live for a running station or offline on recorded frames.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "tools/shared/exit_codes.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/version.hpp"
#include "tools/vision/live_vision.hpp"
#include "tools/vision/track.hpp"

namespace {

int run(int argc, char** argv) {
  using namespace punctum;
  CLI::App app{"punctum-vision: what the microscope shows"};
  app.require_subcommand(1);
  app.set_version_flag("--version", tools::version_line("punctum-vision"));

  tools::TrackOptions t;
  std::vector<int> roi;
  std::vector<double> seed;
  CLI::App* track = app.add_subcommand("track", "follow recorded frames");
  track->add_option("--frames", t.frames, "folder, glob, picture or video file")->required();
  track->add_option("--scene", t.scene, "built-in name or scene file")->required();
  track->add_option("--set", t.overrides, "table.key=value of the scene")->take_all();
  track->add_option("--out", t.out, "obs.csv")->required();
  track->add_option("--contours", t.contours, "contours.csv");
  track->add_option("--overlay", t.overlay, "folder for annotated frames");
  track->add_option("--fps", t.fps, "frames per second")->check(CLI::Range(0.001, 1e6));
  track->add_option("--roi", roi, "x,y,width,height in pixels")->delimiter(',')->expected(4);
  track->add_option("--seed-circle", seed, "x,y,r in pixels: where the outer membrane is")
      ->delimiter(',')
      ->expected(3);
  track->add_option("--template", t.holder_template, "picture of the holding pipette");

  tools::LiveOptions l;
  CLI::App* live = app.add_subcommand("live", "observe for a running station (`punctum run` starts this)");
  live->add_option("--scene", l.scene, "resolved scene file")->required();
  live->add_option("--segments", l.segments, "inherited segments of the station: NAME=DESCRIPTOR,...")
      ->required();
  live->add_option("--out", l.out, "obs.csv");
  live->add_option("--overlay", l.overlay, "folder for annotated frames");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {
      return app.exit(e);
    }
    fmt::print(stderr, "{}\n", e.what());
    return tools::exit_bad_input;
  }
  if (track->parsed()) {
    if (roi.size() == 4) {
      t.roi = {roi[0], roi[1], roi[2], roi[3]};
    }
    if (seed.size() == 3) {
      t.seed_circle = {seed[0], seed[1], seed[2]};
    }
    return tools::track(t);
  }
  return tools::live(l);
}

}  // namespace

int main(int argc, char** argv) {
  punctum::tools::start_program();
  // Errors come as one line of ours, not OpenCV's own log as well.
  cv::redirectError([](int, const char*, const char*, const char*, int, void*) { return 0; });
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "punctum-vision: {}\n", e.what());
    return punctum::tools::exit_bad_input;
  }
}
