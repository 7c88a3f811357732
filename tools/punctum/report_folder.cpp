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

#include "tools/scene/messages.hpp"
#include "tools/shared/whole_file.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

// What a run writes, or has written in earlier versions.
constexpr const char* kReportFiles[] = {
    "report.html", "begun.json",  "events.csv", "samples.csv",    "fault.csv",  "obs.csv",    "contours.csv",
    "report.json", "scene.toml",  "figure.png", "figure.svg",     "figure.gp",  "figure.log", "core.log",
    "vision.log",  "gnuplot.log", "reserve",    "recording.mcap", "record.log", "console.log"};
constexpr const char* kFrames = "frames";
constexpr const char* kElsewhere = ", allowed: another --report";

// A run that has written anything has written its resolved scene first.
bool is_report(const fs::path& folder) {
  std::error_code ec;
  if (!fs::is_regular_file(folder / "scene.toml", ec)) {
    return false;  // such as a pipe, which may never end
  }
  std::ifstream in(folder / "scene.toml");
  std::string line;
  return std::getline(in, line) && line.starts_with("# ") && line.ends_with(kResolvedScene);
}

std::string dated_name(const std::string& scene) {
  return fmt::format("reports/{}-{:%Y%m%d-%H%M%S}", scene, fmt::localtime(std::time(nullptr)));
}

// Makes NAME, or NAME-2, NAME-3, ...: one that was not there before, so that two runs never get the same.
tl::expected<fs::path, std::string> new_folder(const fs::path& name, int first) {
  std::error_code ec;
  if (name.has_parent_path()) {
    fs::create_directories(name.parent_path(), ec);
  }
  for (int n = first; !ec; ++n) {
    const fs::path folder = n < 2 ? name : fs::path(fmt::format("{}-{}", name.string(), n));
    if (fs::create_directory(folder, ec)) {
      return folder;
    }
    if (ec && fs::exists(folder)) {
      ec.clear();  // a file of that name
    }
  }
  return tl::unexpected(fmt::format("{}: cannot be used as report folder: {}", name.string(), ec.message()));
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

// Pictures that vision has numbered, for example 000012.jpg.
bool is_annotated_frame(const fs::path& file) {
  const std::string stem = file.stem().string();
  const std::string ending = file.extension().string();
  return (ending == ".png" || ending == ".jpg") && stem.size() >= 6 &&
         std::all_of(stem.begin(), stem.end(), [](char c) { return c >= '0' && c <= '9'; });
}

// What a run has written there, without its folder.
std::vector<fs::path> files_of_report(const fs::path& folder) {
  std::error_code ec;
  std::vector<fs::path> files;
  for (const char* file : kReportFiles) {
    for (const fs::path& name : {fs::path(file), unfinished(file)}) {
      if (fs::exists(fs::symlink_status(folder / name, ec))) {
        files.push_back(name);
      }
    }
  }
  for (auto it = fs::directory_iterator(folder / kFrames, ec); !ec && it != fs::directory_iterator();
       it.increment(ec)) {
    if (is_annotated_frame(it->path())) {
      files.push_back(fs::path(kFrames) / it->path().filename());
    }
  }
  return files;
}

void clear(const fs::path& folder) {
  std::error_code ec;
  for (const fs::path& file : files_of_report(folder)) {
    fs::remove(folder / file, ec);
  }
  fs::remove(folder / kFrames, ec);  // if nothing else is in it
}

}  // namespace

tl::expected<ReportFolder, std::string> prepare_report_folder(const Scene& scene, const std::string& wanted,
                                                              bool overwrite) {
  std::error_code ec;
  ReportFolder report;
  const fs::path name =
      (wanted.empty() ? fs::path(dated_name(printable(scene.name))) : fs::path(wanted)).lexically_normal();
  fs::path folder = name.has_filename() ? name : name.parent_path();
  const bool there = fs::exists(fs::symlink_status(folder, ec));
  if (there && !fs::is_directory(folder, ec)) {
    return tl::unexpected(
        fmt::format("{}: cannot be used as report folder: it is not a folder", folder.string()));
  }
  if (there && !wanted.empty() && !is_report(folder)) {
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
  if (!there || wanted.empty() || is_report(folder)) {
    const bool taken = there && !wanted.empty();
    if (taken) {
      if (const auto free = FolderLock::take(folder.string()); !free) {
        return tl::unexpected(free.error() + kElsewhere);
      }
    }
    const auto made = new_folder(folder, taken ? 2 : 1);
    if (!made) {
      return tl::unexpected(made.error());
    }
    if (taken && overwrite) {
      report.replaces = fs::absolute(folder).string();
    } else if (taken) {
      report.note = fmt::format("{} holds an earlier report and is left alone; --overwrite replaces it",
                                folder.string());
    }
    folder = *made;
    report.is_new = true;
  }
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    return tl::unexpected(fmt::format("{}: cannot be written to: {}", folder.string(), std::strerror(errno)));
  }
  auto lock = FolderLock::take(folder.string());
  if (!lock) {
    return tl::unexpected(lock.error() + kElsewhere);
  }
  report.lock = std::move(*lock);
  report.folder = fs::absolute(folder).string();
  return report;
}

tl::expected<std::string, std::string> take_place(const ReportFolder& report) {
  const fs::path from = report.folder, to = report.replaces;
  const auto lock = FolderLock::take(to.string());
  if (!lock) {
    return tl::unexpected(fmt::format("{}; the new report stays in {}", lock.error(), from.string()));
  }
  std::error_code ec;
  clear(to);
  fs::create_directory(to / kFrames, ec);
  for (const fs::path& file : files_of_report(from)) {
    fs::rename(from / file, to / file, ec);
    if (ec) {
      return tl::unexpected(fmt::format("{}: cannot be moved to {}: {}; the rest of the report stays there",
                                        (from / file).string(), to.string(), ec.message()));
    }
  }
  fs::remove(to / kFrames, ec);  // where there are none
  fs::remove(from / kFrames, ec);
  fs::remove(from, ec);
  return to.string();
}

void discard(const ReportFolder& report) {
  std::error_code ec;
  clear(report.folder);
  if (report.is_new) {
    fs::remove(report.folder, ec);  // if nothing else is in it
  }
}

}  // namespace punctum::tools
