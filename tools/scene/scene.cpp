#include "tools/scene/scene.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>

#include "hal/cia402/calibration.hpp"
#include "tools/scene/messages.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_reader.hpp"

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;
using Unexpected = tl::unexpected<std::string>;

constexpr std::size_t kFileMax = 256 * 1024;
constexpr std::size_t kOverrideMax = 4000;

// An override as a small TOML document; bare words and paths (paper, on, frames/*.png) need no quotes.
std::string override_document(std::string_view text) {
  const auto equal = text.find('=');
  const std::string key(text.substr(0, equal));
  std::string value(text.substr(equal + 1));
  const bool plain = value.find_first_of("\"\\\t") == std::string::npos;
  const bool word =
      !value.empty() && (std::isalpha(static_cast<unsigned char>(value[0])) != 0 || value[0] == '/' ||
                         value[0] == '~' || value.starts_with("./") || value.starts_with("../"));
  if (plain && word && value != "true" && value != "false" && value != "nan" && value != "inf") {
    value = "\"" + value + "\"";
  }
  return key + " = " + value + "\n";
}

tl::expected<void, std::string> read_overrides(SceneReader& reader,
                                               const std::vector<std::string>& overrides) {
  for (const auto& o : overrides) {
    if (o.find('=') == std::string::npos || o.find('\n') != std::string::npos || o.size() > kOverrideMax) {
      return Unexpected(
          fmt::format("--set: {}: not an override, allowed: table.key=value or table=on|off", printable(o)));
    }
    if (auto r = reader.read_override(override_document(o)); !r) {
      return r;
    }
  }
  return {};
}

// Numbers that only follow from others.
void settle(Scene& s) {
  const auto real = [](const std::string& backend) { return !backend.empty() && backend != kSimulated; };
  s.servo.real_actuators =
      (real(s.devices.haptic) && s.hand_feels()) || real(s.devices.stage) || real(s.devices.injector);
  s.servo.stage_reach = s.cia402 ? cia402::reach_of_axes(*s.cia402) : std::nullopt;
  s.servo.vision = s.vision.has_value();
  if (s.sim) {
    s.sim->seed = s.seed;
    s.sim->position_scale = s.servo.mapping.position_scale;
    s.sim->cells = s.servo.cells;
  }
  if (s.vision) {
    s.vision->pixel_m = s.recorded             ? s.recorded->pixel_m
                        : s.camera             ? s.camera->pixel_m
                        : s.simulated_camera() ? s.sim->microscope->pixel_m
                                               : s.vision->pixel_m;
    if (const auto& m = s.servo.membrane) {
      s.vision->E_Pa = m->E_Pa;
      s.vision->nu = m->nu;
      s.vision->h_m = m->h_m;
      s.vision->c_m = m->c_m;
    }
    s.servo.inner_membrane = s.vision->inner;
    if (auto& m = s.servo.local_model) {
      m->R_min_m = s.vision->R_min_m;
      m->R_max_m = s.vision->R_max_m;
    }
  }
}

// What every scene has before its file is read: a handle, a stage and an e-stop chain.
void begin(Scene& s) {
  s.devices.haptic = s.devices.stage = s.devices.estop = kSimulated;
  s.sim.emplace();
  s.servo.phases.reset();
  s.servo.local_model.reset();
}

tl::expected<Scene, std::string> read_all(Scene scene, std::string_view text, std::string_view source,
                                          const std::vector<std::string>& overrides, const fs::path& folder,
                                          const Backends& backends) {
  begin(scene);
  SceneReader reader(scene, folder, backends, source);
  if (auto r = reader.read_file(text); !r) {
    return Unexpected(r.error());
  }
  if (auto r = read_overrides(reader, overrides); !r) {
    return Unexpected(r.error());
  }
  settle(scene);
  if (const auto p = check_together(scene)) {
    return Unexpected(fmt::format("{}: {}: {}", reader.where(p->key), p->key, p->text));
  }
  return scene;
}

// Where the files of the built-in scenes are: beside the folder of the programs, as built and as installed.
fs::path shipped_files() {
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec);
  return ec ? fs::path{} : program.parent_path().parent_path() / "share" / "punctum" / "scenes";
}

std::string no_such_scene(std::string_view name_or_path) {
  const std::string shown = printable(name_or_path, 200);
  std::vector<std::string> names;
  for (const auto n : builtin_names()) {
    names.emplace_back(n);
  }
  if (name_or_path.find('/') == std::string_view::npos && !name_or_path.ends_with(".toml")) {
    return fmt::format("{}: {}, or a path", shown, unknown("scene", printable(name_or_path), names));
  }
  return fmt::format("{}: no such file, allowed: a path, or {}", shown, fmt::join(names, ", "));
}

tl::expected<std::string, std::string> text_of(const fs::path& path, std::string_view name) {
  const std::string shown = printable(name, 200);
  std::error_code ec;
  const auto status = fs::status(path, ec);
  if (ec || !fs::exists(status)) {
    return Unexpected(no_such_scene(name));
  }
  if (!fs::is_regular_file(status)) {
    return Unexpected(fmt::format("{}: not a file, allowed: a scene file (TOML)", shown));
  }
  std::ifstream in(path, std::ios::binary);
  std::string text(kFileMax + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad() || (in.fail() && !in.eof())) {
    return Unexpected(fmt::format("{}: cannot be read, check its permissions", shown));
  }
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kFileMax) {
    return Unexpected(
        fmt::format("{}: too large for a scene, allowed: at most {} kB", shown, kFileMax / 1024));
  }
  return text;
}

}  // namespace

tl::expected<Scene, std::string> parse_scene(std::string_view text, std::string_view source,
                                             const std::vector<std::string>& overrides,
                                             std::string_view folder, const Backends& backends) {
  Scene scene;
  scene.name = fs::path(source).stem().string();
  scene.source = source;
  return read_all(std::move(scene), text, printable(source, 200), overrides, fs::path(folder), backends);
}

bool Scene::needs_hardware() const {
  const auto& all = scene_devices();
  return std::any_of(all.begin(), all.end(), [this](const NamedDevice& d) {
    const std::string& backend = devices.*d.backend;
    return !backend.empty() && backend != kSimulated && backend != kRecorded;
  });
}

std::string said_of_option(const std::string& error, std::string_view key, std::string_view option) {
  const std::string given = fmt::format("--set: {}: ", key);
  return error.starts_with(given) ? fmt::format("{}: {}", option, error.substr(given.size())) : error;
}

tl::expected<Scene, std::string> load_scene(std::string_view name_or_path,
                                            const std::vector<std::string>& overrides) {
  if (const auto text = builtin_text(name_or_path)) {
    Scene scene;
    scene.name = name_or_path;
    scene.source = "built-in";
    return read_all(std::move(scene), *text, fmt::format("{}.toml", name_or_path), overrides, shipped_files(),
                    known_backends());
  }
  const fs::path path(name_or_path);
  const auto text = text_of(path, name_or_path);
  if (!text) {
    return Unexpected(text.error());
  }
  return parse_scene(*text, name_or_path, overrides, path.parent_path().string());
}

}  // namespace punctum::tools
