// A scene: which things exist on this station and in which numbers, read from a TOML file or a built-in name.
// Set-up code: may allocate, never throws, never crashes on a bad file; every error is one line.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "hal/aravis/config.hpp"
#include "hal/cia402/config.hpp"
#include "hal/evdev/config.hpp"
#include "hal/falcon/config.hpp"
#include "hal/gpiod/config.hpp"
#include "hal/live_camera.hpp"
#include "hal/parameters.hpp"
#include "hal/sim/config.hpp"
#include "hal/v4l2/config.hpp"
#include "hal/zaber/config.hpp"
#include "rt/control/config.hpp"
#include "vision/config.hpp"

namespace punctum::tools {

enum class ClockKind : std::uint8_t { real, virtual_time };

// Frames from a folder, a glob or a video file instead of a camera.
struct RecordedFrames {
  std::string frames;
  double fps = 25;
  double pixel_m = 0.825e-6;
};
constexpr auto keys_of(const RecordedFrames*) {
  return hal::keys(hal::path("frames", &RecordedFrames::frames),
                   hal::real("fps", &RecordedFrames::fps, 0.01, 1000),
                   hal::micro("pixel_um", &RecordedFrames::pixel_m, 0.01, 50));
}

// The machine's hardware watchdog: fed while the core ticks, disarmed at the end of a run.
struct WatchdogParams {
  std::string path = "/dev/watchdog";
  int timeout_s = 10;  // from the last feeding to the restart of the machine
};
constexpr auto keys_of(const WatchdogParams*) {
  return hal::keys(hal::text("path", &WatchdogParams::path),
                   hal::whole("timeout_s", &WatchdogParams::timeout_s, 2, 600));
}

// Positions and forces for a program on another machine, as UDP datagrams of punctum-console.
struct StreamParams {
  std::string to;  // ADDRESS:PORT
};
constexpr auto keys_of(const StreamParams*) { return hal::keys(hal::text("to", &StreamParams::to)); }

inline constexpr std::string_view kSimulated = "simulated";

// Which backend stands behind each device: its name; empty where the scene has no such device. Of the
// enabling device also where it is a button of the handle, which is none of its own.
struct DeviceNames {
  std::string haptic, stage, estop, injector, vacuum, force_sensor, camera, positioner, enabling;
};
inline constexpr std::string_view kHandle = "haptic";
inline constexpr std::string_view kRecorded = "recorded";
inline constexpr std::string_view kGpiod = "gpiod";
inline constexpr std::string_view kCia402 = "cia402";
inline constexpr std::string_view kV4l2 = "v4l2";
inline constexpr std::string_view kAravis = "aravis";
inline constexpr std::string_view kFalcon = "falcon";
inline constexpr std::string_view kEvdev = "evdev";
inline constexpr std::string_view kBrowser = "browser";
inline constexpr std::string_view kZaber = "zaber";

struct Scene {
  std::string name;    // of the file without folder and suffix, or the built-in name
  std::string source;  // path as given, or "built-in"
  std::string title;
  double seconds = 0;  // time limit of the run; 0 = until the task is done or someone stops it
  ClockKind clock = ClockKind::real;
  std::uint64_t seed = 1;  // of everything random

  // Where the programs run. -1 = not pinned.
  int core_priority = 80;  // SCHED_FIFO of the control core
  int core_cpu = -1;
  int vision_cpu = -1;
  int vision_nice = 5;

  DeviceNames devices;
  rt::ServoConfig servo;                         // what the core does
  std::optional<sim::SimConfig> sim;             // absent: no device is simulated
  std::optional<RecordedFrames> recorded;        // camera = recorded frames
  std::optional<cia402::CanStageParams> cia402;  // stage = drives on a CAN bus
  std::optional<gpiod::GpiodParams> gpiod;       // lines of the devices that name it
  std::optional<WatchdogParams> watchdog;        // of the machine
  std::optional<StreamParams> stream;            // absent: nobody is told over UDP
  std::optional<hal::CameraSettings> camera;     // camera = one that is plugged in
  std::optional<v4l2::V4l2Params> v4l2;
  std::optional<aravis::AravisParams> aravis;
  std::optional<falcon::FalconParams> falcon;  // haptic = a Novint Falcon
  std::optional<evdev::EvdevParams> evdev;     // the hand is an input device of Linux
  std::optional<zaber::ZaberParams> zaber;     // positioner = devices on a serial line
  std::optional<vision::VisionConfig> vision;  // absent: no vision process

  [[nodiscard]] bool simulated_camera() const noexcept { return sim && sim->microscope.has_value(); }
  // A device that is neither simulated nor recorded.
  [[nodiscard]] bool needs_hardware() const;
  // By the core's own account; the effects are summed and shown all the same.
  [[nodiscard]] bool hand_feels() const noexcept { return servo.device.force_max_N > 0; }
  // A task that ends by itself: cells to inject. Otherwise the run is open-ended and a time limit ends it
  // well.
  [[nodiscard]] bool has_task() const noexcept { return servo.phases.has_value() && servo.cells > 0; }
};
// [scene]
inline constexpr auto kSceneKeys =
    hal::keys(hal::text("title", &Scene::title), hal::real("seconds", &Scene::seconds, 0, 1e6),
              hal::choice("clock", &Scene::clock, "real", "virtual"),
              hal::whole("seed", &Scene::seed, 0, std::numeric_limits<std::int64_t>::max()));
// [servo]
inline constexpr auto kCoreKeys = hal::keys(hal::whole("priority", &Scene::core_priority, 1, 98),
                                            hal::whole("cpu", &Scene::core_cpu, -1, 1023));
// [vision]
inline constexpr auto kVisionProcessKeys = hal::keys(hal::whole("cpu", &Scene::vision_cpu, -1, 1023),
                                                     hal::whole("nice", &Scene::vision_nice, 0, 19));

// The backends that the table of each device may name.
using Backends = std::map<std::string, std::vector<std::string>, std::less<>>;
[[nodiscard]] const Backends& known_backends();

// A built-in name (builtin_names()) or a path; each override is "table.key=value" or "table=on|off".
// The error is one line: `file:line:column: key: what is wrong, what is allowed`.
[[nodiscard]] tl::expected<Scene, std::string> load_scene(std::string_view name_or_path,
                                                          const std::vector<std::string>& overrides = {});

// An error about what `--set KEY=` would have set, as one about the option of its own that was given instead.
[[nodiscard]] std::string said_of_option(const std::string& error, std::string_view key,
                                         std::string_view option);

// The same for text already in memory; `source` stands in the messages, `folder` resolves relative paths.
[[nodiscard]] tl::expected<Scene, std::string> parse_scene(std::string_view text, std::string_view source,
                                                           const std::vector<std::string>& overrides = {},
                                                           std::string_view folder = {},
                                                           const Backends& backends = known_backends());

// Ends the first line of what to_toml() writes.
inline constexpr std::string_view kResolvedScene = ": the scene as it ran, every number resolved";

// The resolved scene, every key of every table that is there. Numbers that were read from a file read back to
// the same bits; others to the last digit.
[[nodiscard]] std::string to_toml(const Scene& scene);

[[nodiscard]] std::vector<std::string_view> builtin_names();
[[nodiscard]] std::optional<std::string_view> builtin_text(std::string_view name);

// Tables a scene may have and which of them this one has, for `explain`.
struct TableState {
  std::string name;
  bool present = false;
};
[[nodiscard]] std::vector<TableState> tables(const Scene& scene);

}  // namespace punctum::tools
