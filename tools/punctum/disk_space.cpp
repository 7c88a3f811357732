#include "tools/punctum/disk_space.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace punctum::tools {
namespace {

// Measured on scene icsi: a row of samples.csv, a row of obs.csv, an annotated frame.
constexpr double kRecordedTick_bytes = 1000;
constexpr double kRow_bytes = 620, kObservation_bytes = 420, kFrame_bytes = 330e3;
constexpr double kFramesPerAnnotated = 12;
constexpr double kRest_bytes = 4e6;  // the report, the figure and its script, the logs

double frame_rate(const Scene& scene) {
  constexpr double kUsual = 30;  // of a camera whose rate the scene does not say
  return scene.recorded             ? scene.recorded->fps
         : scene.camera             ? (scene.camera->fps > 0 ? scene.camera->fps : kUsual)
         : scene.simulated_camera() ? scene.sim->microscope->fps
                                    : 0;
}

double sample_bytes(const Scene& scene, const ExpectedRecording& recording) {
  return recording.seconds * scene.servo.rate_Hz / static_cast<double>(recording.rows_every) * kRow_bytes;
}

double picture_bytes(const Scene& scene) {
  constexpr double kUsual = 640 * 480;  // of recorded ones nobody has looked
  if (scene.camera) {
    return static_cast<double>(scene.camera->width) * scene.camera->height;
  }
  return scene.simulated_camera()
             ? static_cast<double>(scene.sim->microscope->width) * scene.sim->microscope->height
             : kUsual;
}

}  // namespace

double bytes_written(const Scene& scene, const ExpectedRecording& recording) {
  const double frames = scene.vision ? recording.seconds * frame_rate(scene) : 0;
  return kRest_bytes + sample_bytes(scene, recording) + frames * kObservation_bytes +
         (recording.every_tick ? recording.seconds * scene.servo.rate_Hz * kRecordedTick_bytes : 0) +
         (recording.pictures ? frames * picture_bytes(scene) : 0) +
         (recording.frames ? frames / kFramesPerAnnotated * kFrame_bytes : 0);
}

std::int64_t room_for_samples(const std::string& folder, const Scene& scene,
                              const ExpectedRecording& recording) {
  std::error_code ec;
  const std::filesystem::space_info space = std::filesystem::space(folder, ec);
  return ec ? 0
            : static_cast<std::int64_t>(
                  std::min(sample_bytes(scene, recording), static_cast<double>(space.available) / 2));
}

tl::expected<std::string, std::string> look_for_space(const std::string& folder, double bytes_wanted) {
  std::error_code ec;
  const std::filesystem::space_info space = std::filesystem::space(folder, ec);
  if (ec) {
    return std::string();
  }
  const auto free = static_cast<double>(space.available);
  if (free < kRest_bytes) {
    return tl::unexpected(
        fmt::format("{}: {:.1f} MB are free on its disk, needed: {:.0f} MB for the report alone", folder,
                    free * 1e-6, kRest_bytes * 1e-6));
  }
  if (free >= bytes_wanted) {
    return std::string();
  }
  return fmt::format(
      "{:.0f} MB are free on the disk of the report, and a run up to its time limit writes about {:.0f} MB: "
      "what finds no room will be missing",
      free * 1e-6, bytes_wanted * 1e-6);
}

SpaceReserve::SpaceReserve(const std::string& folder) : file_(folder + "/reserve") {
  const int file = open(file_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0) {
    file_.clear();
    return;
  }
  const bool kept = posix_fallocate(file, 0, kBytes) == 0;
  (void)close(file);
  if (!kept) {
    give_back();
  }
}

void SpaceReserve::give_back() noexcept {
  if (!file_.empty()) {
    (void)unlink(file_.c_str());
    file_.clear();
  }
}

RoomForRows::RoomForRows(const std::string& folder, std::int64_t bytes) {
  const std::string name = folder + "/room";
  file_ = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file_ < 0) {
    return;
  }
  (void)unlink(name.c_str());
  // Not posix_fallocate, which writes it all where the file system cannot.
  if (fallocate(file_, 0, 0, bytes) == 0) {
    bytes_ = bytes;
  } else {
    give_back();
  }
}

bool RoomForRows::give() noexcept {
  constexpr std::int64_t kStep = 256 * 1024;
  const std::int64_t left = std::max<std::int64_t>(bytes_ - kStep, 0);
  if (bytes_ == 0 || ftruncate(file_, left) != 0) {
    return false;
  }
  bytes_ = left;
  return true;
}

void RoomForRows::give_back() noexcept {
  if (file_ >= 0) {
    (void)close(file_);
  }
  file_ = -1;
  bytes_ = 0;
}

}  // namespace punctum::tools
