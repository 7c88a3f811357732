#include "tools/punctum/report_folder.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

// What a run writes, or has written in earlier versions.
constexpr const char* kReportFiles[] = {
    "samples.csv", "fault.csv", "obs.csv",    "contours.csv", "report.json", "scene.toml", "figure.png",
    "figure.svg",  "figure.gp", "figure.log", "core.log",     "vision.log",  "gnuplot.log"};
constexpr const char* kFrames = "frames";

// A run that has written anything has written its resolved scene first.
bool is_report(const fs::path& folder) {
  std::ifstream in(folder / "scene.toml");
  std::string line;
  return std::getline(in, line) && line.starts_with("# ") && line.ends_with(kResolvedScene);
}

fs::path dated_folder(const std::string& scene) {
  std::error_code ec;
  const std::string base =
      fmt::format("reports/{}-{:%Y%m%d-%H%M%S}", scene, fmt::localtime(std::time(nullptr)));
  fs::path folder = base;
  for (int n = 2; fs::exists(folder, ec); ++n) {
    folder = fmt::format("{}-{}", base, n);
  }
  return folder;
}

// The first file that has the name of a report's; empty if there is none.
fs::path foreign_file(const fs::path& folder) {
  std::error_code ec;
  for (const char* file : kReportFiles) {
    if (fs::exists(folder / file, ec)) {
      return folder / file;
    }
  }
  return fs::exists(folder / kFrames, ec) ? folder / kFrames : fs::path{};
}

bool lies_within(const fs::path& inner, const fs::path& outer) {
  std::error_code ec;
  const fs::path wanted = fs::weakly_canonical(outer, ec);
  for (fs::path path = fs::weakly_canonical(inner, ec); path.has_relative_path(); path = path.parent_path()) {
    if (path == wanted) {
      return true;
    }
  }
  return false;
}

// Pictures that vision has numbered, for example 000012.png.
bool is_annotated_frame(const fs::path& file) {
  const std::string stem = file.stem().string();
  return file.extension() == ".png" && stem.size() >= 6 &&
         std::all_of(stem.begin(), stem.end(), [](char c) { return c >= '0' && c <= '9'; });
}

void clear(const fs::path& folder) {
  std::error_code ec;
  for (const char* file : kReportFiles) {
    fs::remove(folder / file, ec);
  }
  const fs::path frames = folder / kFrames;
  std::vector<fs::path> pictures;
  for (auto it = fs::directory_iterator(frames, ec); !ec && it != fs::directory_iterator();
       it.increment(ec)) {
    if (is_annotated_frame(it->path())) {
      pictures.push_back(it->path());
    }
  }
  for (const fs::path& picture : pictures) {
    fs::remove(picture, ec);
  }
  fs::remove(frames, ec);  // if nothing else is in it
}

}  // namespace

tl::expected<ReportFolder, std::string> prepare_report_folder(const Scene& scene, const std::string& wanted) {
  std::error_code ec;
  const fs::path folder = wanted.empty() ? dated_folder(scene.name) : fs::path(wanted);
  fs::create_directories(folder, ec);
  if (ec || !fs::is_directory(folder)) {
    return tl::unexpected(fmt::format("{}: cannot be used as report folder: {}", folder.string(),
                                      ec ? ec.message() : "it is not a folder"));
  }
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    return tl::unexpected(fmt::format("{}: cannot be written to: {}", folder.string(), std::strerror(errno)));
  }
  auto lock = FolderLock::take(folder.string());
  if (!lock) {
    return tl::unexpected(lock.error());
  }
  if (!is_report(folder)) {
    if (const fs::path file = foreign_file(folder); !file.empty()) {
      return tl::unexpected(
          fmt::format("{}: is there, but no run has written it; allowed: a folder of its own for the report",
                      file.string()));
    }
  }
  if (scene.recorded && lies_within(scene.recorded->frames, folder / kFrames)) {
    return tl::unexpected(fmt::format("{}: the recorded frames come from there; allowed: another --report",
                                      (folder / kFrames).string()));
  }
  clear(folder);
  return ReportFolder{fs::absolute(folder).string(), std::move(*lock)};
}

}  // namespace punctum::tools
