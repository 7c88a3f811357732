// punctum-vision: frames -> observations, live for a running station or offline on recorded frames.
#include <CLI/CLI.hpp>
#include <exception>
#include <opencv2/core/utility.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tools/shared/command_line.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/version.hpp"
#include "tools/vision/live_vision.hpp"
#include "tools/vision/track.hpp"

namespace {

int run(int argc, char** argv) {
  using namespace punctum;
  const std::vector<std::pair<int, const char*>> exit_codes = {
      {tools::exit_done, "all frames were looked at"},
      {tools::exit_not_done, "the camera was lost, or what was found could not be written"},
      {tools::exit_bad_input, "bad input, or no first frame"}};
  CLI::App app{"What the microscope shows: finds pipettes and membranes in frames.", "punctum-vision"};
  tools::set_help_style(app);
  app.require_subcommand(1);
  app.set_version_flag("--version", tools::version_line("punctum-vision"), "version and commit");
  app.footer(tools::help_footer(
      {{"punctum-vision track --frames my/pictures --scene zebrafish --out obs.csv --overlay out",
        "a row per frame into obs.csv, and pictures with what was found drawn in"}},
      exit_codes));

  tools::TrackOptions t;
  std::vector<int> roi;
  std::vector<double> seed;
  CLI::App* track = app.add_subcommand("track", "follow recorded frames");
  track->add_option("--frames", t.frames, "folder, glob, picture or video file")
      ->required()
      ->type_name("FOLDER|GLOB|FILE");
  track->add_option("--scene", t.scene, "built-in name or scene file")->required()->type_name("SCENE");
  track->add_option("--set", t.overrides, "change the scene; may be repeated")
      ->take_all()
      ->type_name("TABLE.KEY=VALUE");
  track->add_option("--out", t.out, "table of what was found, a row per frame (obs.csv)")
      ->required()
      ->type_name("FILE");
  track->add_option("--contours", t.contours, "table of the contours (contours.csv)")->type_name("FILE");
  track
      ->add_option("--deviations", t.deviations,
                   "table of the standard deviation of every node of the contours")
      ->type_name("FILE");
  track->add_option("--overlay", t.overlay, "folder for annotated frames")->type_name("FOLDER");
  track->add_option("--surface", t.surface, "folder for the membranes' surfaces (json, obj, stl)")
      ->type_name("FOLDER");
  track
      ->add_option(
          "--fps", t.fps,
          "frames per second; without, what the scene says of its recorded frames, a video's own rate, or 25")
      ->check(tools::within(0.001, 1e5))
      ->type_name("RATE");
  track->add_option("--roi", roi, "the part of the picture to look at, in pixels")
      ->delimiter(',')
      ->expected(4)
      ->type_name("X,Y,WIDTH,HEIGHT");
  track->add_option("--seed-circle", seed, "where the outer membrane is, in pixels")
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,R");
  track
      ->add_option("--poses", t.poses,
                   "table of where the manipulator had the tip (samples.csv of a run: t_s, tip_x_m, tip_y_m)")
      ->type_name("FILE");
  track->add_option("--template", t.holder_template, "picture of the holding pipette")->type_name("FILE");

  tools::LiveOptions l;
  CLI::App* live = app.add_subcommand("live", "observe for a running station (`punctum run` starts this)");
  live->add_option("--scene", l.scene, "resolved scene file")->required()->type_name("FILE");
  live->add_option("--segments", l.segments, "inherited segments of the station")
      ->required()
      ->type_name("NAME=DESCRIPTOR,...");
  live->add_option("--out", l.out, "table of what was found (obs.csv)")->type_name("FILE");
  live->add_option("--overlay", l.overlay, "folder for annotated frames")->type_name("FOLDER");

  track->footer(tools::help_footer({}, exit_codes));
  live->footer(tools::help_footer({}, exit_codes));
  if (const auto code = tools::parse_command_line(app, argc, argv)) {
    return *code;
  }
  if (track->parsed()) {
    if (roi.size() == 4) {
      t.roi = {roi[0], roi[1], roi[2], roi[3]};
    }
    if (seed.size() == 3) {
      t.seed_circle = {seed[0], seed[1], seed[2]};
    }
    return tools::code_after_words(tools::track(t));
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
    punctum::tools::complain(std::string("punctum-vision: ") + e.what());
    return punctum::tools::exit_bad_input;
  }
}
