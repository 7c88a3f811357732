// Who may include whom: the rooms of the house in one table, from the ground up. The tree is read as text;
// nothing is compiled. With PUNCTUM_DRAW=1 the first test prints every room with the rooms that it includes.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

namespace fs = std::filesystem;

// Standard headers that ask nothing of the heap, of a lock, of stdio or of the exception machinery.
constexpr std::array<std::string_view, 25> kCoreStandard = {
    "algorithm", "array",    "atomic",   "bit",        "cfloat",  "climits",  "cmath",
    "compare",   "concepts", "cstddef",  "cstdint",    "cstring", "iterator", "limits",
    "new",       "numbers",  "optional", "ratio",      "span",    "tuple",    "type_traits",
    "utility",   "variant",  "version",  "immintrin.h"};

// The libraries from outside that a room may name; a regular expression.
constexpr std::string_view kPlain = "Eigen/.*";
constexpr std::string_view kMayFail = "Eigen/.*|tl/expected.hpp";
constexpr std::string_view kPictures = "Eigen/.*|tl/expected.hpp|opencv2/.*";
constexpr std::string_view kTools =
    "Eigen/.*|tl/expected.hpp|opencv2/.*|fmt/.*|toml\\+\\+/.*|CLI/.*|nlohmann/.*";
constexpr std::string_view kMessages = "google/protobuf/.*";
constexpr std::string_view kTests =
    "Eigen/.*|tl/expected.hpp|opencv2/.*|fmt/.*|toml\\+\\+/.*|CLI/.*|nlohmann/.*|gtest/.*|gmock/.*|openssl/"
    ".*|"
    "sanitizer/.*";

using Names = std::vector<std::string_view>;

Names operator+(Names some, const Names& more) {
  some.insert(some.end(), more.begin(), more.end());
  return some;
}

// A path that ends in a slash is a folder without the folders in it; one that ends in a star, a folder with
// all in it; any other, one header and its source.
struct Room {
  std::string_view path;
  Names may_include;
  std::string_view outside;
  bool core = false;  // from outside the tree only `outside` and kCoreStandard
};

// From the ground up: a room includes itself and what it names, and it can name only rooms above its own
// line.
std::vector<Room> house() {
  const Names interfaces = {"hal/realtime", "hal/math/", "hal/"};
  const Names ground =
      interfaces + Names{"hal/device_life",     "hal/ipc/",       "hal/ipc/segment", "hal/ipc/rendezvous",
                         "hal/ipc/sealed_text", "hal/live_camera"};
  const Names sim_shared = {"hal/sim/point", "hal/sim/noise", "hal/sim/config", "hal/sim/failures"};
  const Names sim = sim_shared + Names{"hal/sim/plant/", "hal/sim/operator/", "hal/sim/"};
  const Names cia402_shared = {"hal/cia402/config", "hal/cia402/bus_load", "hal/cia402/calibration"};
  const Names core = {
      "rt/station/", "rt/forces/", "rt/control/", "rt/executive/", "rt/executive/monotonic_clock",
      "rt/platform/"};
  const Names vision_parts = {"vision/config",    "vision/image/",  "vision/pipettes/",
                              "vision/membrane/", "vision/events/", "vision/surface/"};
  // What a program without pictures is made of, and one with.
  const Names station = ground + sim + core + cia402_shared + Names{"tools/shared/", "tools/scene/"};
  const Names pictures =
      station + Names{"hal/sim/camera/", "hal/recorded/"} + vision_parts + Names{"vision/"};
  return {
      // The interfaces and the exchange.
      {"hal/realtime", {}, kPlain, true},
      {"hal/math/", {"hal/realtime"}, kPlain, true},
      {"hal/", {"hal/realtime", "hal/math/"}, kPlain, true},
      {"hal/device_life", interfaces, kMayFail},
      {"hal/live_camera", interfaces, kMayFail},
      {"hal/ipc/", interfaces, kPlain, true},
      {"hal/ipc/segment", interfaces + Names{"hal/ipc/"}, kMayFail},
      {"hal/ipc/rendezvous", interfaces + Names{"hal/ipc/", "hal/ipc/segment"}, kMayFail},
      {"hal/ipc/sealed_text", interfaces + Names{"hal/ipc/", "hal/ipc/segment"}, kMayFail},
      // Where a backend's tick leaves what the compiler proves.
      {"hal/kernel_call", {"hal/realtime"}, "sanitizer/rtsan_interface.h"},
      // Backends: the ground and a library of their own, never each other.
      {"hal/recorded/", ground, kPictures},
      {"hal/gpiod/config", interfaces, kMayFail},
      {"hal/gpiod/", ground + Names{"hal/gpiod/config", "hal/kernel_call"},
       "Eigen/.*|tl/expected.hpp|gpiod.*"},
      {"hal/falcon/config", interfaces, kMayFail},
      {"hal/falcon/", ground + Names{"hal/falcon/config", "hal/kernel_call"},
       "Eigen/.*|tl/expected.hpp|libusb.*"},
      {"hal/cia402/config", interfaces, kMayFail},
      {"hal/cia402/bus_load", interfaces, kMayFail},
      {"hal/cia402/calibration", interfaces + Names{"hal/cia402/config"}, kMayFail},
      {"hal/cia402/", ground + cia402_shared + Names{"hal/kernel_call"}, "Eigen/.*|tl/expected.hpp"},
      {"hal/aravis/config", interfaces, kMayFail},
      {"hal/aravis/", ground + Names{"hal/aravis/config"}, "Eigen/.*|tl/expected.hpp|arv.h"},
      {"hal/v4l2/config", interfaces, kMayFail},
      {"hal/v4l2/", ground + Names{"hal/v4l2/config"}, kMayFail},
      {"hal/evdev/config", interfaces, kMayFail},
      {"hal/evdev/", ground + Names{"hal/evdev/config", "hal/kernel_call"}, "Eigen/.*|tl/expected.hpp"},
      {"hal/browser/fingers", interfaces + Names{"hal/ipc/"}, kPlain, true},
      {"hal/browser/", ground + Names{"hal/browser/fingers"}, kMayFail},
      {"hal/zaber/config", interfaces, kMayFail},
      {"hal/zaber/", ground + Names{"hal/zaber/config"}, kMayFail},
      // The simulated backend; hal/sim/ is the bench and whatever stands beside it.
      {"hal/sim/point", ground, kMayFail},
      {"hal/sim/noise", ground, kMayFail},
      {"hal/sim/config", ground + Names{"hal/sim/point"}, kMayFail},
      {"hal/sim/failures", ground + Names{"hal/sim/point", "hal/sim/noise", "hal/sim/config"}, kMayFail},
      {"hal/sim/plant/", ground + sim_shared, kMayFail},
      {"hal/sim/operator/", ground + sim_shared + Names{"hal/sim/plant/"}, kMayFail},
      {"hal/sim/", ground + sim, kMayFail},
      {"hal/sim/camera/", ground + sim, kMayFail},
      // The core gets ready-made what sets up or may fail.
      {"rt/station/", interfaces + Names{"hal/ipc/"}, kPlain, true},
      {"rt/forces/", interfaces + Names{"hal/ipc/", "rt/station/"}, kPlain, true},
      {"rt/control/", interfaces + Names{"hal/ipc/", "rt/station/", "rt/forces/"}, kPlain, true},
      {"rt/executive/", interfaces + Names{"hal/ipc/", "rt/station/"}, kPlain, true},
      // The machine's clock, injected like any other, in a library of its own.
      {"rt/executive/monotonic_clock", interfaces, "cerrno|ctime", true},
      {"rt/platform/", ground + Names{"rt/station/"}, kMayFail},
      // Vision, from the picture up.
      {"vision/config", interfaces, kPlain},
      {"vision/image/", interfaces + Names{"vision/config"}, kPictures},
      {"vision/pipettes/", interfaces + Names{"vision/config", "vision/image/"}, kPictures},
      {"vision/membrane/", interfaces + Names{"vision/config", "vision/image/", "vision/pipettes/"},
       kPictures},
      {"vision/events/",
       interfaces +
           Names{"vision/config", "vision/image/", "vision/pipettes/", "vision/membrane/", "rt/station/"},
       kPictures},
      {"vision/surface/", interfaces + Names{"vision/image/"}, kPictures},
      {"vision/", interfaces + vision_parts + Names{"rt/station/"}, kPictures},
      // Programs do not include one another.
      {"tools/shared/", ground + sim + core, kTools},
      {"tools/scene/",
       ground + sim + core + cia402_shared +
           Names{"hal/gpiod/config", "hal/evdev/config", "hal/zaber/config", "hal/falcon/config",
                 "hal/v4l2/config", "hal/aravis/config", "vision/config", "tools/shared/"},
       kTools},
      // What a station tells, as messages.
      {"tools/wire/", interfaces + Names{"hal/ipc/", "rt/station/", "rt/forces/", "tools/shared/"},
       kMessages},
      {"tools/vision/surface_files",
       interfaces + Names{"hal/ipc/", "rt/station/", "vision/surface/", "vision/image/", "tools/shared/"},
       kTools},
      {"tools/vision/picture_file", interfaces + Names{"hal/recorded/", "tools/shared/"}, kTools},
      // The surfaces and pictures of a recording, as vision writes them.
      {"tools/record/",
       station + Names{"tools/wire/", "tools/vision/surface_files", "tools/vision/picture_file"}, kTools},
      {"tools/console/",
       ground + core + Names{"hal/browser/fingers", "tools/scene/", "tools/shared/", "tools/wire/"},
       "boost/.*|openssl/.*|fmt/.*|nlohmann/.*|CLI/.*|tl/expected.hpp"},
      {"tools/core/",
       station + Names{"hal/browser/fingers", "hal/browser/", "hal/gpiod/", "hal/cia402/", "hal/falcon/",
                       "hal/evdev/", "hal/zaber/"},
       kTools},
      // The devices of a scene, put together as the core does it; GPIO lines, from edge to edge.
      {"tools/jitter/", station + Names{"hal/gpiod/config", "hal/gpiod/", "tools/core/"}, kTools},
      {"tools/punctum/",
       station + Names{"hal/gpiod/config", "hal/gpiod/", "hal/cia402/", "hal/zaber/config", "hal/zaber/",
                       "hal/v4l2/config", "hal/v4l2/", "hal/aravis/", "hal/evdev/", "hal/browser/fingers"},
       kTools},
      {"tools/vision/",
       pictures +
           Names{"tools/vision/surface_files", "tools/vision/picture_file", "hal/v4l2/", "hal/aravis/"},
       kTools},
      {"tools/report/", pictures, kTools},
      {"tools/emulators/drive/", {"tools/shared/"}, kTools},
      {"tools/emulators/falcon/", {"tools/shared/"}, kTools},
      {"tools/emulators/positioner/", {"tools/shared/"}, kTools},
      // One world behind them all.
      {"tools/emulators/world/",
       station + Names{"hal/sim/camera/", "tools/emulators/drive/", "tools/emulators/falcon/"}, kTools},
      {"tests/support/",
       pictures + Names{"hal/browser/fingers", "hal/v4l2/config", "hal/v4l2/", "hal/cia402/", "hal/falcon/",
                        "hal/zaber/config", "hal/zaber/", "tools/emulators/drive/", "tools/emulators/falcon/",
                        "tools/emulators/positioner/"},
       kTests},
      // A libusb of its own in place of the real one.
      {"tests/unit/hal/falcon_link_test", ground + Names{"hal/falcon/"}, "gtest/.*|libusb.*"},
      {"tests/*",
       pictures + Names{"hal/gpiod/config",
                        "hal/gpiod/",
                        "hal/v4l2/config",
                        "hal/v4l2/",
                        "hal/aravis/config",
                        "hal/aravis/",
                        "hal/cia402/",
                        "hal/falcon/config",
                        "hal/falcon/",
                        "hal/evdev/config",
                        "hal/evdev/",
                        "hal/browser/",
                        "hal/browser/fingers",
                        "hal/zaber/config",
                        "hal/zaber/",
                        "tools/emulators/positioner/",
                        "tools/emulators/drive/",
                        "tools/emulators/falcon/",
                        "tools/emulators/world/",
                        "tests/support/",
                        "tools/wire/",
                        "tools/record/",
                        "tools/console/",
                        "tools/core/",
                        "tools/punctum/",
                        "tools/vision/",
                        "tools/vision/surface_files",
                        "tools/vision/picture_file",
                        "tools/jitter/",
                        "tools/report/"},
       kTests},
  };
}

const std::vector<Room>& rooms() {
  static const std::vector<Room> table = house();
  return table;
}

std::string folder_of(std::string_view file) { return std::string(file.substr(0, file.rfind('/') + 1)); }
std::string stem_of(std::string_view file) { return std::string(file.substr(0, file.rfind('.'))); }

const Room* room_of(std::string_view file) {
  const Room* best = nullptr;
  for (const Room& room : rooms()) {
    const bool lies_there = room.path.ends_with('*')
                                ? file.starts_with(room.path.substr(0, room.path.size() - 1))
                            : room.path.ends_with('/') ? folder_of(file) == room.path
                                                       : stem_of(file) == room.path;
    if (lies_there && (best == nullptr || room.path.size() > best->path.size())) {
      best = &room;
    }
  }
  return best;
}

// A folder that the table does not know is a room of its own, so that circles through it are found as well.
std::string room_name(std::string_view file) {
  const Room* room = room_of(file);
  return room != nullptr ? std::string(room->path) : folder_of(file);
}

template <typename Range>
bool contains(const Range& range, std::string_view item) {
  return std::find(range.begin(), range.end(), item) != range.end();
}

// Why `file` may not include `target`; empty if it may.
std::string objection(std::string_view file, std::string_view target, bool quoted) {
  const Room* room = room_of(file);
  if (room == nullptr) {
    return "lies in no room of the house";
  }
  if (target.find("..") != std::string_view::npos) {
    return "climbs out of its folder; paths start at the top of the tree";
  }
  if (quoted) {
    const Room* owner = room_of(target);
    if (owner == nullptr && room->path.starts_with("tests/") && target.find('/') == std::string_view::npos) {
      return {};  // a piece of the test that lies beside it
    }
    if (owner == nullptr) {
      return "names nothing in this tree; paths start at the top of the tree";
    }
    const bool allowed = owner == room || contains(room->may_include, owner->path);
    return allowed ? std::string{} : "is a room that " + std::string(room->path) + " may not include";
  }
  // In angle brackets: the standard and POSIX libraries, and what the room is built on. A library is anything
  // else with a slash or ".hpp".
  if (std::regex_match(std::string(target), std::regex(std::string(room->outside)))) {
    return {};
  }
  if (room->core) {
    return contains(kCoreStandard, target) ? std::string{} : "may allocate, lock, throw or print";
  }
  const bool standard =
      target.find('/') == std::string_view::npos && target.find(".hpp") == std::string_view::npos;
  const bool system = target.starts_with("sys/") || target.starts_with("linux/") ||
                      target.starts_with("net/") || target.starts_with("netinet/") ||
                      target.starts_with("arpa/");
  const bool foreign =
      std::regex_match(std::string(target), std::regex("gpiod.*|libusb.*|curl.*|fmt.*|spdlog.*"));
  if ((standard || system) && !foreign) {
    return {};
  }
  return "is a library that " + std::string(room->path) + " is not built on";
}

using Drawing = std::map<std::string, std::set<std::string>>;  // a room and the rooms that it includes

struct Findings {
  std::vector<std::string> breaches;  // "file:line: target why"
  Drawing drawing;                    // without tests/
};

Findings read_tree(const fs::path& top) {
  Findings found;
  const std::regex directive(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  for (const char* folder : {"rt", "hal", "vision", "tools", "tests"}) {
    if (!fs::exists(top / folder)) {
      continue;
    }
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(top / folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".cpp" && extension != ".hpp" && extension != ".h" && extension != ".c") {
        continue;
      }
      const std::string file = entry.path().lexically_relative(top).generic_string();
      std::ifstream in(entry.path());
      std::string line;
      for (int number = 1; std::getline(in, line); ++number) {
        std::smatch m;
        if (line.find('#') == std::string::npos || !std::regex_search(line, m, directive)) {
          continue;
        }
        const bool quoted = m[1].str() == "\"";
        const std::string why = objection(file, m[2].str(), quoted);
        if (!why.empty()) {
          found.breaches.push_back(file + ":" + std::to_string(number) + ": " + m[2].str() + " " + why);
        }
        if (quoted && !file.starts_with("tests/")) {
          std::set<std::string>& included = found.drawing[room_name(file)];
          if (room_name(m[2].str()) != room_name(file)) {
            included.insert(room_name(m[2].str()));
          }
        }
      }
    }
  }
  std::sort(found.breaches.begin(), found.breaches.end());
  return found;
}

// The rooms from which one comes back to where one was, in the order of the way; empty if there is no circle.
std::vector<std::string> circle_in(const Drawing& drawing) {
  std::vector<std::string> way;
  std::set<std::string> left;
  const std::function<bool(const std::string&)> visit = [&](const std::string& room) {
    const auto met = std::find(way.begin(), way.end(), room);
    if (met != way.end()) {
      way.erase(way.begin(), met);
      way.push_back(room);
      return true;
    }
    if (left.contains(room)) {
      return false;
    }
    way.push_back(room);
    if (const auto it = drawing.find(room); it != drawing.end()) {
      for (const std::string& next : it->second) {
        if (visit(next)) {
          return true;
        }
      }
    }
    way.pop_back();
    left.insert(room);
    return false;
  };
  for (const auto& [room, included] : drawing) {
    if (visit(room)) {
      return way;
    }
  }
  return {};
}

// Sources without a header of their own name, and sources that do not include it first (a header that
// compiles only after others would stay unseen). main.cpp and *_main.cpp have none; the topics of the report
// share topic.hpp; hal/math shares elementary.hpp; hal/gpiod/lines_*.cpp share lines.hpp, *_module.cpp
// modules.hpp; scene_checks.cpp and scene_writer.cpp are declared in scene.hpp.
std::vector<std::string> sources_without_their_header(const fs::path& top) {
  const std::regex includes(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::vector<std::string> found;
  for (const char* folder : {"rt", "hal", "vision", "tools"}) {
    if (!fs::exists(top / folder)) {
      continue;
    }
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(top / folder)) {
      const std::string file = entry.path().lexically_relative(top).generic_string();
      if (entry.path().extension() != ".cpp" || file.ends_with("main.cpp")) {
        continue;
      }
      const std::string header = stem_of(file) + ".hpp";
      if (!fs::exists(top / header)) {
        if (!file.starts_with("tools/report/") && !file.starts_with("hal/math/") &&
            !file.starts_with("hal/gpiod/lines_") && !file.ends_with("_module.cpp") &&
            file != "tools/scene/scene_checks.cpp" && file != "tools/scene/scene_writer.cpp") {
          found.push_back(file + " has no " + header);
        }
        continue;
      }
      std::ifstream in(entry.path());
      std::string line;
      std::smatch m;
      while (std::getline(in, line) && !std::regex_search(line, m, includes)) {
      }
      if (m.empty() || m[1].str() != header) {
        found.push_back(file + " does not include " + header + " first");
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) {
    all += "\n  " + line;
  }
  return all;
}

TEST(Rooms, include_only_what_they_may_and_never_in_a_circle) {
  ASSERT_TRUE(fs::exists(PUNCTUM_SOURCE_DIR "/hal/devices.hpp"));
  const Findings found = read_tree(PUNCTUM_SOURCE_DIR);
  EXPECT_TRUE(found.breaches.empty()) << joined(found.breaches);
  EXPECT_GT(found.drawing.size(), 20U);
  const std::vector<std::string> circle = circle_in(found.drawing);
  EXPECT_TRUE(circle.empty()) << "a circle of rooms:" << joined(circle);
  if (std::getenv("PUNCTUM_DRAW") != nullptr) {
    for (const Room& room : rooms()) {
      if (const auto it = found.drawing.find(std::string(room.path)); it != found.drawing.end()) {
        std::cout << room.path << " ->";
        for (const std::string& included : it->second) {
          std::cout << ' ' << included;
        }
        std::cout << '\n';
      }
    }
  }
}

TEST(Rooms, name_only_rooms_nearer_to_the_ground) {
  for (auto room = rooms().begin(); room != rooms().end(); ++room) {
    for (const std::string_view name : room->may_include) {
      EXPECT_TRUE(name == room->path ||
                  std::any_of(rooms().begin(), room, [&](const Room& r) { return r.path == name; }))
          << room->path << " names " << name << ", which is not above it in the table";
    }
  }
}

TEST(Sources, have_a_header_of_their_own_and_include_it_first) {
  const std::vector<std::string> found = sources_without_their_header(PUNCTUM_SOURCE_DIR);
  EXPECT_TRUE(found.empty()) << joined(found);
}

// Planted files: the check must see each.
class PlantedBreach : public testing::Test {
 protected:
  void SetUp() override {
    top_ = fs::temp_directory_path() / ("punctum-walls-" + std::to_string(::getpid()));
    clear();
  }
  void TearDown() override { fs::remove_all(top_); }

  void clear() {
    fs::remove_all(top_);
    fs::create_directories(top_);
  }
  void plant(const std::string& file, const std::string& include) {
    fs::create_directories((top_ / file).parent_path());
    std::ofstream(top_ / file) << "#include " << include << "\n";
  }
  std::size_t breaches_of(const std::string& file, const std::string& include) {
    clear();
    plant(file, include);
    return read_tree(top_).breaches.size();
  }

  fs::path top_;
};

TEST_F(PlantedBreach, is_seen_at_every_wall) {
  const std::pair<const char*, const char*> forbidden[] = {
      // What the core may not use.
      {"rt/control/a.cpp", "<vector>"},
      {"rt/control/a.cpp", "<string>"},
      {"rt/forces/a.hpp", "<mutex>"},
      {"rt/executive/a.hpp", "<cstdio>"},
      {"rt/executive/a.cpp", "<ctime>"},
      {"rt/station/a.hpp", "<opencv2/core.hpp>"},
      {"rt/station/a.hpp", "<tl/expected.hpp>"},
      {"rt/control/a.cpp", "\"rt/platform/memory.hpp\""},
      {"rt/control/a.cpp", "\"hal/ipc/segment.hpp\""},
      {"rt/control/a.cpp", "\"hal/device_life.hpp\""},
      {"rt/control/a.cpp", "\"hal/sim/bench.hpp\""},
      {"rt/control/a.cpp", "\"vision/config.hpp\""},
      {"rt/control/a.cpp", "\"tools/scene/scene.hpp\""},
      {"rt/executive/monotonic_clock.cpp", "\"rt/executive/executive.hpp\""},
      {"rt/platform/a.cpp", "\"hal/sim/bench.hpp\""},
      {"rt/platform/a.cpp", "<opencv2/core.hpp>"},
      // Inside rt.
      {"rt/station/a.hpp", "\"rt/forces/membrane.hpp\""},
      {"rt/station/a.hpp", "\"rt/control/servo.hpp\""},
      {"rt/station/a.hpp", "\"rt/executive/executive.hpp\""},
      {"rt/forces/a.hpp", "\"rt/control/config.hpp\""},
      {"rt/executive/a.cpp", "\"rt/control/servo.hpp\""},
      {"rt/executive/a.cpp", "\"rt/forces/membrane.hpp\""},
      {"rt/control/a.cpp", "\"rt/executive/executive.hpp\""},
      {"rt/platform/a.cpp", "\"rt/control/servo.hpp\""},
      {"rt/platform/a.cpp", "\"rt/executive/executive.hpp\""},
      // Inside hal: the ground, the exchange, the backends.
      {"hal/math/a.hpp", "\"hal/devices.hpp\""},
      {"hal/math/a.cpp", "<vector>"},
      {"hal/devices.hpp", "\"hal/ipc/exchange.hpp\""},
      {"hal/devices.hpp", "\"hal/device_life.hpp\""},
      {"hal/devices.hpp", "\"hal/sim/bench.hpp\""},
      {"hal/devices.hpp", "<string>"},
      {"hal/device_life.hpp", "\"hal/ipc/exchange.hpp\""},
      {"hal/ipc/a.hpp", "\"hal/sim/point.hpp\""},
      {"hal/ipc/exchange.hpp", "\"hal/ipc/segment.hpp\""},
      {"hal/sim/a.cpp", "\"rt/station/observation.hpp\""},
      {"hal/sim/a.cpp", "\"hal/recorded/folder.hpp\""},
      {"hal/sim/plant/a.cpp", "\"hal/recorded/folder.hpp\""},
      {"hal/recorded/a.cpp", "\"hal/sim/bench.hpp\""},
      {"hal/recorded/a.cpp", "\"hal/sim/plant/cell.hpp\""},
      {"hal/recorded/a.cpp", "\"vision/config.hpp\""},
      {"hal/v4l2/a.cpp", "\"hal/recorded/picture.hpp\""},
      {"hal/gpiod/a.cpp", "<libusb-1.0/libusb.h>"},
      {"hal/sim/a.cpp", "<gpiod.h>"},
      {"hal/sim/a.cpp", "\"tools/scene/scene.hpp\""},
      // Inside hal/sim.
      {"hal/sim/point.hpp", "\"hal/sim/config.hpp\""},
      {"hal/sim/noise.hpp", "\"hal/sim/failures.hpp\""},
      {"hal/sim/config.hpp", "\"hal/sim/failures.hpp\""},
      {"hal/sim/config.hpp", "\"hal/sim/plant/cell.hpp\""},
      {"hal/sim/failures.hpp", "\"hal/sim/bench.hpp\""},
      {"hal/sim/plant/a.cpp", "\"hal/sim/operator/operator.hpp\""},
      {"hal/sim/plant/a.cpp", "\"hal/sim/bench.hpp\""},
      {"hal/sim/operator/a.cpp", "\"hal/sim/world.hpp\""},
      {"hal/sim/operator/a.cpp", "\"hal/sim/camera/microscope.hpp\""},
      {"hal/sim/world.cpp", "\"hal/sim/camera/microscope.hpp\""},
      // Inside vision.
      {"vision/surface/a.cpp", "\"vision/membrane/undeformed.hpp\""},
      {"vision/events/a.cpp", "\"vision/surface/membrane_net.hpp\""},
      {"vision/a.cpp", "\"rt/control/config.hpp\""},
      {"vision/a.cpp", "\"rt/forces/membrane.hpp\""},
      {"vision/a.cpp", "\"hal/recorded/folder.hpp\""},
      {"vision/a.cpp", "\"hal/sim/bench.hpp\""},
      {"vision/a.cpp", "<toml++/toml.h>"},
      {"vision/config.hpp", "\"vision/image/snake.hpp\""},
      {"vision/config.hpp", "<opencv2/core.hpp>"},
      {"vision/image/a.cpp", "\"vision/pipettes/pipette_mask.hpp\""},
      {"vision/image/a.cpp", "\"vision/result.hpp\""},
      {"vision/image/a.cpp", "\"rt/station/observation.hpp\""},
      {"vision/pipettes/a.cpp", "\"vision/membrane/dimple.hpp\""},
      {"vision/membrane/a.cpp", "\"vision/events/contact.hpp\""},
      {"vision/membrane/a.cpp", "\"rt/station/observation.hpp\""},
      {"vision/events/a.cpp", "\"vision/tracker.hpp\""},
      // Inside tools, and nothing but tests includes tools.
      {"tools/shared/a.cpp", "\"tools/scene/scene.hpp\""},
      {"tools/shared/a.cpp", "\"vision/config.hpp\""},
      {"tools/scene/a.cpp", "\"tools/core/assembly.hpp\""},
      {"tools/scene/a.cpp", "\"vision/tracker.hpp\""},
      {"tools/core/a.cpp", "\"tools/punctum/recorder.hpp\""},
      {"tools/wire/a.cpp", "\"tools/scene/scene.hpp\""},
      {"tools/core/a.cpp", "<google/protobuf/message_lite.h>"},
      {"tools/console/a.cpp", "\"tools/punctum/recorder.hpp\""},
      {"tools/punctum/a.cpp", "\"tools/console/gateway.hpp\""},
      {"tools/core/a.cpp", "\"hal/recorded/picture.hpp\""},
      {"tools/core/a.cpp", "\"vision/tracker.hpp\""},
      {"tools/punctum/a.cpp", "\"tools/vision/track.hpp\""},
      {"tools/punctum/a.cpp", "\"vision/tracker.hpp\""},
      {"tools/vision/a.cpp", "\"tools/punctum/recorder.hpp\""},
      {"tools/report/a.cpp", "\"tools/vision/track.hpp\""},
      {"tools/new_program/a.cpp", "<array>"},
      {"tools/core/a.cpp", "<gtest/gtest.h>"},
      {"tools/core/a.cpp", "\"tests/unit/a.hpp\""},
      {"tools/core/a.cpp", "<boost/format.hpp>"},
      {"tools/core/a.cpp", "\"../rt/control/config.hpp\""},
      {"tools/core/a.cpp", "\"config.hpp\""},
      {"tests/support/a.hpp", "\"tests/unit/a.hpp\""},
      {"tests/unit/hal/a.cpp", "<libusb.h>"},
  };
  for (const auto& [file, include] : forbidden) {
    EXPECT_EQ(breaches_of(file, include), 1U) << file << " includes " << include;
  }
}

TEST_F(PlantedBreach, is_not_seen_where_a_path_is_open) {
  const std::pair<const char*, const char*> open[] = {
      {"rt/control/a.cpp", "<array>"},
      {"rt/control/a.cpp", "<Eigen/Core>"},
      {"rt/control/a.cpp", "\"hal/devices.hpp\""},
      {"rt/control/a.cpp", "\"hal/math/sine.hpp\""},
      {"rt/control/a.cpp", "\"rt/forces/membrane.hpp\""},
      {"rt/control/a.cpp", "\"rt/station/phase.hpp\""},
      {"rt/station/a.hpp", "\"hal/ipc/exchange.hpp\""},
      {"rt/executive/monotonic_clock.cpp", "<ctime>"},
      {"rt/platform/a.cpp", "<string>"},
      {"rt/platform/a.cpp", "<sys/mman.h>"},
      {"rt/platform/a.cpp", "\"hal/ipc/segment.hpp\""},
      {"hal/sim/a.cpp", "\"hal/ipc/segment.hpp\""},
      {"hal/sim/a.cpp", "\"hal/device_life.hpp\""},
      {"hal/sim/camera/a.cpp", "\"hal/sim/bench.hpp\""},
      {"hal/gpiod/a.cpp", "<gpiod.h>"},
      {"vision/a.cpp", "\"rt/station/observation.hpp\""},
      {"vision/image/a.cpp", "<opencv2/core.hpp>"},
      {"tools/report/a.cpp", "\"vision/image/snake.hpp\""},
      {"tools/core/a.cpp", "\"rt/forces/membrane.hpp\""},
      {"tools/scene/a.cpp", "<toml++/toml.h>"},
      {"tests/unit/a.cpp", "\"tools/scene/scene.hpp\""},
      {"tests/unit/hal/a.cpp", "\"tests/support/programs.hpp\""},
  };
  for (const auto& [file, include] : open) {
    EXPECT_EQ(breaches_of(file, include), 0U) << file << " includes " << include;
  }
}

TEST_F(PlantedBreach, is_a_circle_even_through_rooms_that_no_rule_names) {
  plant("vision/first/a.hpp", "\"vision/second/b.hpp\"");
  plant("vision/second/b.hpp", "\"vision/third/c.hpp\"");
  EXPECT_TRUE(circle_in(read_tree(top_).drawing).empty());
  plant("vision/third/c.cpp", "\"vision/first/a.hpp\"");
  EXPECT_EQ(circle_in(read_tree(top_).drawing),
            (std::vector<std::string>{"vision/first/", "vision/second/", "vision/third/", "vision/first/"}));
}

TEST_F(PlantedBreach, is_a_source_without_a_header_or_one_that_comes_late) {
  plant("rt/control/alone.cpp", "<array>");
  plant("rt/control/late.hpp", "<array>");
  plant("rt/control/late.cpp", "<array>");
  plant("rt/control/good.hpp", "<array>");
  plant("rt/control/good.cpp", "\"rt/control/good.hpp\"");
  plant("tools/core/main.cpp", "<array>");
  EXPECT_EQ(sources_without_their_header(top_).size(), 2U);
}

}  // namespace
