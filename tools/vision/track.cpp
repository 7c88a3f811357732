#include "tools/vision/track.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "hal/recorded/picture.hpp"
#include "hal/recorded/recorded_camera.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/whole_file.hpp"
#include "tools/vision/observation_csv.hpp"
#include "tools/vision/picture_file.hpp"
#include "tools/vision/stage_poses.hpp"
#include "tools/vision/surface_files.hpp"
#include "vision/events/scene_change.hpp"
#include "vision/overlay.hpp"
#include "vision/tracker.hpp"

namespace punctum::tools {

namespace {

constexpr int kDone = 0, kNotWritten = 1, kBadInput = 2;

template <class T>
using Or = tl::expected<T, std::string>;  // the error is one line for the user

tl::unexpected<std::string> wrong(std::string text) { return tl::unexpected<std::string>(std::move(text)); }

Or<Scene> scene_of(const TrackOptions& options) {
  auto scene = load_scene(options.scene, options.overrides);
  if (!scene) {
    return wrong(scene.error());
  }
  if (!scene->vision) {
    return wrong(fmt::format("{}: it has no [vision], so there is nothing to look for", options.scene));
  }
  return std::move(*scene);
}

vision::VisionConfig vision_of(const Scene& scene, const TrackOptions& options) {
  vision::VisionConfig config = *scene.vision;
  if (config.method == vision::Method::truth) {  // recorded pictures have none
    config.method = vision::Method::tracker;
  }
  config.surface = !options.surface.empty();
  return config;
}

Or<cv::Rect> region_of(const TrackOptions& options, const recorded::Camera& camera) {
  if (!options.roi) {
    return cv::Rect(0, 0, camera.width(), camera.height());
  }
  const auto& r = *options.roi;
  if (r[0] < 0 || r[1] < 0 || r[2] < 32 || r[3] < 32 ||
      static_cast<std::int64_t>(r[0]) + r[2] > camera.width() ||
      static_cast<std::int64_t>(r[1]) + r[3] > camera.height()) {
    return wrong(fmt::format("--roi {},{},{},{}: does not lie in the {}x{} picture, or is smaller than 32x32",
                             r[0], r[1], r[2], r[3], camera.width(), camera.height()));
  }
  return cv::Rect(r[0], r[1], r[2], r[3]);
}

// In pixels of the region.
Or<std::optional<vision::Circle>> seed_of(const TrackOptions& options, const cv::Rect& roi) {
  if (!options.seed_circle) {
    return std::nullopt;
  }
  const auto& c = *options.seed_circle;
  if (!(c[0] >= roi.x && c[0] < roi.x + roi.width && c[1] >= roi.y && c[1] < roi.y + roi.height) ||
      !(c[2] >= 4) || !(c[2] < 1e4)) {
    return wrong(fmt::format("--seed-circle {},{},{}: a centre in the picture and a radius of at least 4 px",
                             c[0], c[1], c[2]));
  }
  return vision::Circle{{c[0] - roi.x, c[1] - roi.y}, c[2], 0, 0};
}

// Template of the holding pipette; empty when none is given.
Or<cv::Mat> template_of(const TrackOptions& options, const vision::VisionConfig& config,
                        const cv::Rect& roi) {
  const std::string path = !options.holder_template.empty() ? options.holder_template
                           : config.holder                  ? config.holder->template_path
                                                            : "";
  if (path.empty()) {
    return cv::Mat();
  }
  const auto picture = recorded::read_picture(path);
  if (!picture) {
    return wrong(picture.error());
  }
  if (picture->width >= roi.width || picture->height >= roi.height || picture->width < 4 ||
      picture->height < 4) {
    return wrong(fmt::format("{}: {}x{} does not fit as a template in {}x{}", path, picture->width,
                             picture->height, roi.width, roi.height));
  }
  return cv::Mat(picture->height, picture->width, CV_8U, const_cast<std::uint8_t*>(picture->pixels.data()))
      .clone();
}

struct Input {
  vision::VisionConfig config;
  recorded::Camera camera;
  cv::Rect roi;
  std::optional<vision::Circle> seed;
  cv::Mat holder_template;
  std::optional<StagePoses> poses;

  // px of the region.
  [[nodiscard]] std::optional<vision::Point> stage_at(double t_s) const {
    const auto tip_m = poses ? poses->at(t_s) : std::nullopt;
    if (!tip_m) {
      return std::nullopt;
    }
    const vision::Point middle((camera.width() - 1) / 2.0 - roi.x, (camera.height() - 1) / 2.0 - roi.y);
    return middle + *tip_m / config.pixel_m;
  }

  [[nodiscard]] vision::Tracker new_tracker() const {
    vision::Tracker tracker(config, roi.width, roi.height);
    if (seed) {
      tracker.seed_circle(*seed);
    }
    if (!holder_template.empty()) {
      tracker.holder_template(holder_template);
    }
    return tracker;
  }
};

Or<Input> open_input(const TrackOptions& options) {
  const auto scene = scene_of(options);
  if (!scene) {
    return wrong(scene.error());
  }
  vision::VisionConfig config = vision_of(*scene, options);
  auto camera = recorded::Camera::open(options.frames,
                                       options.fps.value_or(scene->recorded ? scene->recorded->fps : 0));
  if (!camera) {
    return wrong(camera.error());
  }
  const auto roi = region_of(options, *camera);
  if (!roi) {
    return wrong(roi.error());
  }
  const auto seed = seed_of(options, *roi);
  if (!seed) {
    return wrong(seed.error());
  }
  const auto holder_template = template_of(options, config, *roi);
  if (!holder_template) {
    return wrong(holder_template.error());
  }
  std::optional<StagePoses> poses;
  if (!options.poses.empty()) {
    auto read = StagePoses::read(options.poses);
    if (!read) {
      return wrong(read.error());
    }
    poses = std::move(*read);
  }
  return Input{std::move(config), std::move(*camera), *roi, *seed, *holder_template, std::move(poses)};
}

struct Output {
  ObservationCsv observations;
  std::optional<ContoursCsv> contours, deviations;
  std::string overlay_folder;  // empty: no overlays
  std::string surface_folder;  // empty: no surfaces
  bool whole = true;           // else a picture or a surface could not be written

  void write_overlay(const cv::Mat& grey, const vision::Result& result, const vision::VisionConfig& config,
                     const std::string& picture_name);
  void write_surfaces(const vision::Result& result, const Input& input, const std::string& picture_name);
};

// Which output would replace what is read, or come into the file of another; empty: none.
std::string clash(const TrackOptions& options, const Input& input) {
  namespace fs = std::filesystem;
  std::vector<std::pair<std::string, std::string>> taken = {
      {"--frames", options.frames},
      {"--scene", options.scene},
      {"--poses", options.poses},
      {"--template", options.holder_template},
      {"the scene's template", input.config.holder ? input.config.holder->template_path : ""}};
  for (const std::string& file : input.camera.files()) {
    taken.emplace_back("--frames", file);
  }
  std::error_code ec;
  std::erase_if(taken, [&ec](const auto& one) { return !fs::is_regular_file(one.second, ec); });
  for (const auto& [option, path] : {std::pair{"--out", options.out},
                                     {"--contours", options.contours},
                                     {"--deviations", options.deviations}}) {
    if (path.empty()) {
      continue;
    }
    for (const auto& [other, file] : taken) {
      if (same_file(path, file)) {
        return fmt::format("{} {}: is the file of {}, allowed: another one", option, path, other);
      }
    }
    taken.emplace_back(option, path);
  }
  if (!options.overlay.empty() && !input.camera.files().empty() &&
      fs::equivalent(options.overlay, fs::absolute(input.camera.files().front()).parent_path(), ec)) {
    return fmt::format("--overlay {}: is the folder of --frames, allowed: another one", options.overlay);
  }
  return {};
}

Or<Output> open_output(const TrackOptions& options) {
  auto observations = ObservationCsv::open(options.out, false, false);
  if (!observations) {
    return wrong(observations.error());
  }
  Output out{std::move(*observations), std::nullopt, std::nullopt, options.overlay, options.surface};
  if (!options.contours.empty()) {
    auto contours = ContoursCsv::open(options.contours, ContoursCsv::Of::place);
    if (!contours) {
      return wrong(contours.error());
    }
    out.contours = std::move(*contours);
  }
  if (!options.deviations.empty()) {
    auto deviations = ContoursCsv::open(options.deviations, ContoursCsv::Of::deviation);
    if (!deviations) {
      return wrong(deviations.error());
    }
    out.deviations = std::move(*deviations);
  }
  for (const std::string& folder : {options.overlay, options.surface}) {
    std::error_code error;
    if (!folder.empty() && !std::filesystem::create_directories(folder, error) && error) {
      return wrong(fmt::format("{}: {}", folder, error.message()));
    }
  }
  return out;
}

std::string stem_of(const std::string& folder, const vision::Result& result,
                    const std::string& picture_name) {
  return fmt::format("{}/{:06}_{}", folder, result.frame,
                     std::filesystem::path(picture_name).stem().string());
}

void Output::write_overlay(const cv::Mat& grey, const vision::Result& result,
                           const vision::VisionConfig& config, const std::string& picture_name) {
  if (overlay_folder.empty()) {
    return;
  }
  const std::string path = stem_of(overlay_folder, result, picture_name) + ".png";
  if (const auto written = write_picture(path, vision::draw_overlay(grey, result, config)); !written) {
    complain(written.error() + "; going on without overlays");
    overlay_folder.clear();
    whole = false;
  }
}

// In the frame of the whole picture, as every other place that is written.
void Output::write_surfaces(const vision::Result& result, const Input& input,
                            const std::string& picture_name) {
  if (surface_folder.empty()) {
    return;
  }
  const int width = input.camera.width() - 2 * input.roi.x, height = input.camera.height() - 2 * input.roi.y;
  const auto written = write_surface(stem_of(surface_folder, result, picture_name),
                                     vision::to_surface(result, input.config, width, height));
  if (!written) {
    complain(written.error() + "; going on without surfaces");
    surface_folder.clear();
    whole = false;
  }
}

struct Counts {
  int frames = 0, outer = 0, inner = 0, unusable = 0;
  std::string ends;  // why it ends before the recording should; empty if it does not
};

Counts track_all(Input& input, Output& output) {
  Counts counts;
  struct Scene {
    vision::Tracker tracker;
    cv::Mat last;
    [[nodiscard]] bool shows(const cv::Mat& grey) const {
      return vision::similarity(last, grey) >= vision::kSameScene;
    }
  };
  Scene now{input.new_tracker(), {}};
  std::optional<Scene> before;  // of this one
  for (;;) {
    hal::Frame frame;
    const hal::Status status = input.camera.next(frame, 0);
    if (status == hal::Status::disconnected || status == hal::Status::no_data) {
      counts.ends = input.camera.last_error();
      return counts;
    }
    ++counts.frames;
    const double t_s = static_cast<double>(frame.exposure_ns) * 1e-9;
    if (status == hal::Status::fault) {
      ++counts.unusable;
      output.observations.row(frame.sequence, t_s, 0, input.camera.last_error());
      continue;
    }
    hal::Frame part = frame;
    part.pixels += static_cast<std::ptrdiff_t>(input.roi.y) * frame.stride + input.roi.x;
    part.width = input.roi.width;
    part.height = input.roi.height;
    const cv::Mat grey(part.height, part.width, CV_8U, const_cast<std::uint8_t*>(part.pixels),
                       static_cast<std::size_t>(part.stride));
    // Stills of different scenes may share a folder. What was learnt from one does not hold for the next, but
    // for the one before where a broken picture lay between.
    if (!now.last.empty() && !now.shows(grey)) {
      if (before && before->shows(grey)) {
        now = std::move(*before);
        before.reset();
        complain(fmt::format("{}: the scene before the last picture again, what was learnt of it holds",
                             input.camera.name()));
      } else {
        before = std::exchange(now, {input.new_tracker(), {}});
        complain(fmt::format("{}: another scene, started afresh", input.camera.name()));
      }
    }
    grey.copyTo(now.last);
    const vision::Result& result = now.tracker.process(part, input.stage_at(t_s));
    output.observations.row(result, input.config, t_s, input.roi.tl());
    counts.outer += result.outer.ok;
    counts.inner += result.inner.ok;
    counts.unusable += !result.usable;
    for (auto* nodes : {&output.contours, &output.deviations}) {
      if (*nodes) {
        (*nodes)->rows(result, input.roi.tl());
      }
    }
    output.write_overlay(grey, result, input.config, input.camera.name());
    output.write_surfaces(result, input, input.camera.name());
    if (counts.frames == 1 && !result.outer.ok && !result.inner.ok) {
      complain("first frame: " + result.verdict);
    }
    input.camera.release(frame);
  }
}

}  // namespace

int track(const TrackOptions& options) {
  auto input = open_input(options);
  if (!input) {
    complain(input.error());
    return kBadInput;
  }
  if (const std::string mixed_up = clash(options, *input); !mixed_up.empty()) {
    complain(mixed_up);
    return kBadInput;
  }
  auto output = open_output(options);
  if (!output) {
    complain(output.error());
    return kBadInput;
  }
  const Counts counts = track_all(*input, *output);
  if (!counts.ends.empty()) {
    complain(counts.ends);
  }
  int code = output->whole && counts.ends.empty() ? kDone : kNotWritten;
  const auto check_complete = [&code](bool written, const std::string& file, const std::string& why) {
    if (!written) {
      complain(fmt::format("{}: not complete: {}", file, why));
      code = kNotWritten;
    }
  };
  check_complete(output->observations.flush(), options.out, output->observations.failure());
  if (output->contours) {
    check_complete(output->contours->flush(), options.contours, output->contours->failure());
  }
  if (output->deviations) {
    check_complete(output->deviations->flush(), options.deviations, output->deviations->failure());
  }
  say(fmt::format("{} frames, outer membrane in {}, inner in {}, unusable {}\n", counts.frames, counts.outer,
                  input->config.inner ? fmt::format("{}", counts.inner) : "-", counts.unusable));
  return code;
}

}  // namespace punctum::tools
