#include "tools/report/real_frames.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgproc.hpp>

#include "hal/recorded/picture.hpp"
#include "hal/recorded/recorded_camera.hpp"
#include "vision/tracker.hpp"

namespace punctum::report {
namespace {

namespace fs = std::filesystem;

hal::Frame frame_of(const cv::Mat& m) {
  hal::Frame f;
  f.pixels = m.data;
  f.width = m.cols;
  f.height = m.rows;
  f.stride = static_cast<int>(m.step);
  return f;
}

// Intersection over union of the labelled ooplasm and the inside of the contour. Needle and sperm inside the
// ooplasm belong to it. Labels: 85 needle, 170 ooplasm, 255 sperm.
double intersection_over_union(const vision::Contour& contour, const cv::Mat& label) {
  const cv::Mat ooplasm = label == 170;
  cv::Mat closed;
  cv::morphologyEx(ooplasm, closed, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_ELLIPSE, {31, 31}));
  const cv::Mat wanted = ooplasm | (closed & ((label == 85) | (label == 255)));
  cv::Mat seen = cv::Mat::zeros(label.size(), CV_8U);
  std::vector<cv::Point> line;
  for (const auto& p : contour) {
    line.emplace_back(static_cast<int>(std::lround(p.x * 16)), static_cast<int>(std::lround(p.y * 16)));
  }
  cv::fillPoly(seen, std::vector<std::vector<cv::Point>>{line}, cv::Scalar(255), cv::LINE_8, 4);
  return static_cast<double>(cv::countNonZero(seen & wanted)) / cv::countNonZero(seen | wanted);
}

// Empty: it cannot be read.
cv::Mat read_grey(const std::string& path) {
  const auto picture = recorded::read_picture(path);
  return picture ? cv::Mat(picture->height, picture->width, CV_8U,
                           const_cast<std::uint8_t*>(picture->pixels.data()))
                       .clone()
                 : cv::Mat();
}

void see_oocytes(const fs::path& folder, Table& table) {
  for (const char* number : {"00", "01", "03", "06"}) {
    const std::string stem = (folder / "icsi_").string() + number;
    const cv::Mat picture = read_grey(stem + "_img.png");
    const cv::Mat label = read_grey(stem + "_label.png");
    if (picture.empty() || label.size() != picture.size()) {
      continue;
    }
    vision::VisionConfig config;
    config.pixel_m = 0.85e-6;
    vision::Tracker tracker(config, picture.cols, picture.rows);
    const vision::Result& r = tracker.process(frame_of(picture));
    table.add({std::string("icsi_") + number, 0, picture.cols, picture.rows, r.us.total, true, r.outer.ok,
               r.inner.ok, r.inner.ok ? intersection_over_union(r.inner.contour, label) : std::nan("")});
  }
}

// One of many embryos, cut out of each picture.
void see_embryo(const fs::path& folder, Table& table, Progress& progress) {
  auto camera = recorded::Camera::open(folder.string(), 25);
  if (!camera) {
    return;
  }
  const cv::Rect part(700, 140, 420, 420);
  if (camera->width() < part.br().x || camera->height() < part.br().y) {
    return;
  }
  vision::VisionConfig config;
  config.pixel_m = 3.25e-6;
  config.holder.reset();
  config.needle = false;
  config.R_min_m = 400e-6;
  config.R_max_m = 800e-6;
  vision::Tracker tracker(config, part.width, part.height);
  progress.start("zebrafish", camera->count());
  int n = 0;
  for (hal::Frame frame; camera->next(frame, 0) == hal::Status::ok; ++n) {
    hal::Frame cut = frame;
    cut.pixels += static_cast<std::ptrdiff_t>(part.y) * frame.stride + part.x;
    cut.width = part.width;
    cut.height = part.height;
    const vision::Result& r = tracker.process(cut);
    table.add({"zebrafish", n, part.width, part.height, r.us.total, r.us.start > 0, r.outer.ok, r.inner.ok,
               std::nan("")});
    progress.step();
  }
}

}  // namespace

RealFrames see_real_frames(bool quick, Progress& progress) {
  const char* named = std::getenv("PUNCTUM_DATA");
  const fs::path data = named != nullptr ? named : "../shared/data";
  RealFrames out;
  Table table{.name = "vision_real",
              .columns = {"picture", "frame", "width_px", "height_px", "total_us", "started", "outer_ok",
                          "inner_ok", "inner_iou"}};
  if (fs::is_directory(data / "icsi")) {
    see_oocytes(data / "icsi", table);
  }
  if (!quick && fs::is_directory(data / "zebrafish-timelapse")) {
    see_embryo(data / "zebrafish-timelapse", table, progress);
  }
  if (table.rows.empty()) {
    out.summary = "Real frames: none were found; PUNCTUM_DATA names their folder.";
    return out;
  }
  out.summary = fmt::format("Real frames: {} seen, in vision_real.csv.", table.rows.size());
  out.table = std::move(table);
  return out;
}

}  // namespace punctum::report
