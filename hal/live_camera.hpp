// A camera that is plugged in: what a scene asks of any, and how it is opened and closed. The vision program
// calls all of it, never two at a time.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/devices.hpp"
#include "hal/parameters.hpp"

namespace punctum::hal {

inline constexpr double kAsItIs = -1;  // of gain: whatever the camera is set to

// Table [camera] of a scene.
struct CameraSettings {
  int width = 640;
  int height = 480;
  double pixel_m = 0.825e-6;  // what one pixel shows
  double fps = 0;             // 0: whatever the camera is set to
  double exposure_s = 0;      // 0: likewise
  double gain = kAsItIs;      // in the camera's own unit
  // From the end of the exposure until the frame is stamped, where the stamp is not of its beginning; 0: not
  // known.
  double readout_s = 0;
};
constexpr auto keys_of(const CameraSettings*) {
  return keys(whole("width_px", &CameraSettings::width, 16, 16384),
              whole("height_px", &CameraSettings::height, 16, 16384),
              micro("pixel_um", &CameraSettings::pixel_m, 0.01, 50),
              real("fps", &CameraSettings::fps, 0, 1000),
              milli("exposure_ms", &CameraSettings::exposure_s, 0, 10000),
              real("gain", &CameraSettings::gain, kAsItIs, 1e6),
              milli("readout_ms", &CameraSettings::readout_s, 0, 1000));
}

// Since the camera was opened for the first time.
struct CameraCounts {
  std::uint64_t delivered = 0;
  std::uint64_t lost = 0;      // by the camera, its bus or its driver: gaps in its own count
  std::uint64_t skipped = 0;   // a newer one was there already
  std::uint64_t unusable = 0;  // damaged, incomplete, or without a believable time
};

class LiveCamera : public Camera {
 public:
  virtual ~LiveCamera() = default;

  // Both may take seconds where a network does not answer.
  //
  // Claims the camera, sets it up, and lets it stream. The error is one line: what is wrong, what to do; the
  // camera is then closed. After `disconnected` it may be called again: the camera may be back.
  [[nodiscard]] virtual tl::expected<void, std::string> open() = 0;
  virtual void close() noexcept = 0;

  // What open() could not do although nobody asked for it: a line each.
  [[nodiscard]] virtual const std::vector<std::string>& notes() const noexcept = 0;
  // Why the last next() was fault or disconnected.
  [[nodiscard]] virtual const std::string& last_error() const noexcept = 0;
  [[nodiscard]] virtual const CameraCounts& counts() const noexcept = 0;
};

}  // namespace punctum::hal
