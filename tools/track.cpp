#include "tools/track.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "hal/recorded/picture.hpp"
#include "hal/recorded/recorded_camera.hpp"
#include "tools/observation_csv.hpp"
#include "tools/scene.hpp"
#include "vision/overlay.hpp"
#include "vision/picture_change.hpp"
#include "vision/tracker.hpp"

namespace punctum::tools {

namespace {

constexpr int kDone = 0, kNotWritten = 1, kBadInput = 2;

int bad(const std::string& text) {
  fmt::print(stderr, "{}\n", text);
  return kBadInput;
}

}  // namespace

int track(const TrackOptions& options) {
  const auto scene = load_scene(options.scene, options.overrides);
  if (!scene) {
    return bad(scene.error());
  }
  if (!scene->vision) {
    return bad(fmt::format("{}: it has no [vision], so there is nothing to look for", options.scene));
  }
  vision::VisionConfig config = *scene->vision;
  config.method = vision::Method::paper;  // recorded pictures have no simulated truth

  auto camera = recorded::Camera::open(options.frames, options.fps);
  if (!camera) {
    return bad(camera.error());
  }
  cv::Rect roi(0, 0, camera->width(), camera->height());
  if (options.roi) {
    const auto& r = *options.roi;
    roi = cv::Rect(r[0], r[1], r[2], r[3]);
    if (r[0] < 0 || r[1] < 0 || r[2] < 32 || r[3] < 32 ||
        static_cast<std::int64_t>(r[0]) + r[2] > camera->width() ||
        static_cast<std::int64_t>(r[1]) + r[3] > camera->height()) {
      return bad(fmt::format("--roi {},{},{},{}: does not lie in the {}x{} picture, or is smaller than 32x32",
                             r[0], r[1], r[2], r[3], camera->width(), camera->height()));
    }
  }
  if (options.seed_circle) {
    const auto& c = *options.seed_circle;
    if (!(c[0] >= roi.x && c[0] < roi.x + roi.width && c[1] >= roi.y && c[1] < roi.y + roi.height) ||
        !(c[2] >= 4) || !(c[2] < 1e4)) {
      return bad(fmt::format("--seed-circle {},{},{}: a centre in the picture and a radius of at least 4 px",
                             c[0], c[1], c[2]));
    }
  }
  const std::string pattern_path = !options.holder_template.empty() ? options.holder_template
                                   : config.holder                  ? config.holder->template_path
                                                                    : "";
  cv::Mat pattern;
  if (!pattern_path.empty()) {
    const auto picture = recorded::read_picture(pattern_path);
    if (!picture) {
      return bad(picture.error());
    }
    if (picture->width >= roi.width || picture->height >= roi.height || picture->width < 4 ||
        picture->height < 4) {
      return bad(fmt::format("{}: {}x{} does not fit as a template in {}x{}", pattern_path, picture->width,
                             picture->height, roi.width, roi.height));
    }
    pattern =
        cv::Mat(picture->height, picture->width, CV_8U, const_cast<std::uint8_t*>(picture->pixels.data()))
            .clone();
  }
  const auto new_tracker = [&] {
    vision::Tracker tracker(config, roi.width, roi.height);
    if (options.seed_circle) {
      const auto& c = *options.seed_circle;
      tracker.seed_circle({vision::Point(c[0] - roi.x, c[1] - roi.y), c[2], 0});
    }
    if (!pattern.empty()) tracker.holder_template(pattern);
    return tracker;
  };
  vision::Tracker tracker = new_tracker();
  auto csv = ObservationCsv::open(options.out, false, false);
  if (!csv) {
    return bad(csv.error());
  }
  std::optional<ContoursCsv> contours;
  if (!options.contours.empty()) {
    auto opened = ContoursCsv::open(options.contours);
    if (!opened) {
      return bad(opened.error());
    }
    contours = std::move(*opened);
  }
  if (!options.overlay.empty()) {
    std::error_code error;
    std::filesystem::create_directories(options.overlay, error);
    if (error) {
      return bad(fmt::format("{}: {}", options.overlay, error.message()));
    }
  }

  int frames = 0, outer = 0, inner = 0, unusable = 0;
  bool overlays_fail = false;
  cv::Mat before;
  for (;;) {
    hal::Frame frame;
    const hal::Status status = camera->next(frame, 0);
    if (status == hal::Status::disconnected || status == hal::Status::no_data) {
      break;
    }
    ++frames;
    const double t_s = static_cast<double>(frame.exposure_ns) * 1e-9;
    if (status == hal::Status::fault) {
      ++unusable;
      csv->row(frame.sequence, t_s, 0, camera->last_error());
      continue;
    }
    hal::Frame part = frame;
    part.pixels += static_cast<std::ptrdiff_t>(roi.y) * frame.stride + roi.x;
    part.width = roi.width;
    part.height = roi.height;
    const cv::Mat grey(part.height, part.width, CV_8U, const_cast<std::uint8_t*>(part.pixels),
                       static_cast<std::size_t>(part.stride));
    // Stills of different scenes may share a folder: what was learnt from one says nothing of the next.
    if (!before.empty() && vision::likeness(before, grey) < vision::kSameScene) {
      tracker = new_tracker();
      fmt::print(stderr, "{}: another scene, started afresh\n", camera->name());
    }
    grey.copyTo(before);
    const vision::Result& result = tracker.process(part);
    csv->row(result, config, t_s, roi.tl());
    outer += result.outer.ok;
    inner += result.inner.ok;
    unusable += !result.usable;
    if (contours) {
      contours->rows(result, roi.tl());
    }
    if (!options.overlay.empty() && !overlays_fail) {
      const std::string stem = std::filesystem::path(camera->name()).stem().string();
      const std::string path = fmt::format("{}/{:06}_{}.png", options.overlay, frame.sequence, stem);
      bool written = false;
      try {
        written = cv::imwrite(path, vision::draw_overlay(grey, result, config));
      } catch (const cv::Exception&) {
      }
      if (!written) {
        fmt::print(stderr, "{}: cannot be written; going on without overlays\n", path);
        overlays_fail = true;
      }
    }
    if (frames == 1 && !result.outer.ok && !result.inner.ok) {
      fmt::print(stderr, "first frame: {}\n", result.verdict);
    }
    camera->release(frame);
  }
  int code = kDone;
  const auto complete = [&code](bool written, const std::string& file) {
    if (written) return;
    fmt::print(stderr, "{}: not complete, is the disk full?\n", file);
    code = kNotWritten;
  };
  complete(csv->flush(), options.out);
  if (contours) complete(contours->flush(), options.contours);
  fmt::print("{} frames, outer membrane in {}, inner in {}, unusable {}\n", frames, outer,
             config.inner ? fmt::format("{}", inner) : "-", unusable);
  return code;
}

}  // namespace punctum::tools
