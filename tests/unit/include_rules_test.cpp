// Who may include whom: the walls of the house, as one table. The tree is read as text; nothing is compiled.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;

// What everybody may use: interfaces, and the two pieces that more than one segment is made of.
constexpr std::array<std::string_view, 3> kGround = {"hal/devices.hpp", "hal/exchange.hpp",
                                                     "hal/segment.hpp"};

// Standard headers that ask nothing of the heap, of a lock, of stdio or of the exception machinery.
constexpr std::array<std::string_view, 24> kCoreStandard = {
    "algorithm", "array",   "atomic",  "bit",         "climits", "cmath",   "compare", "concepts",
    "cstddef",   "cstdint", "cstring", "iterator",    "limits",  "new",     "numbers", "optional",
    "ratio",     "span",    "tuple",   "type_traits", "utility", "variant", "version", "immintrin.h"};

struct Room {
  std::string_view folder;                // the longest match decides
  std::vector<std::string_view> may_use;  // folders or files of this tree, besides the room itself
  bool ground = true;
  bool core = false;         // only kCoreStandard and Eigen from outside the tree
  std::string_view outside;  // regex: the only libraries from outside that this room may name
};

// A library is anything outside the tree in angle brackets with a slash or ".h" that is not the C or POSIX
// library.
const std::vector<Room>& rooms() {
  static const std::vector<Room> table = {
      {.folder = "hal/", .may_use = {}, .outside = "Eigen/.*|tl/expected.hpp"},  // the ground itself
      {.folder = "hal/sim/", .may_use = {}, .outside = "Eigen/.*|tl/expected.hpp"},
      {.folder = "hal/recorded/", .may_use = {}, .outside = "Eigen/.*|tl/expected.hpp|opencv2/.*"},
      {.folder = "hal/gpiod/", .may_use = {}, .outside = "Eigen/.*|tl/expected.hpp|gpiod.*"},
      {.folder = "hal/falcon/", .may_use = {}, .outside = "Eigen/.*|tl/expected.hpp|libusb.*"},
      {.folder = "hal/cia402/", .may_use = {}, .outside = "Eigen/.*|tl/expected.hpp"},
      {.folder = "hal/v4l2/", .may_use = {}, .outside = "Eigen/.*|tl/expected.hpp"},
      // The core: the interfaces and the exchange, nothing that sets up or may fail.
      {.folder = "rt/",
       .may_use = {"rt/executive/", "rt/station/", "rt/forces/", "rt/control/"},
       .core = true,
       .outside = "Eigen/.*"},
      // The machine's clock, injected like any other, in a library of its own.
      {.folder = "rt/executive/monotonic_clock.cpp",
       .may_use = {"rt/executive/monotonic_clock.hpp"},
       .core = true,
       .outside = "cerrno|ctime"},
      {.folder = "rt/platform/", .may_use = {"rt/"}, .outside = "Eigen/.*|tl/expected.hpp"},
      {.folder = "vision/", .may_use = {"rt/station/"}, .outside = "Eigen/.*|tl/expected.hpp|opencv2/.*"},
      {.folder = "tools/",
       .may_use = {"rt/", "hal/", "vision/"},
       .outside = "Eigen/.*|tl/expected.hpp|opencv2/.*|fmt/.*|toml\\+\\+/.*|CLI/.*|nlohmann/.*"},
      {.folder = "tests/",
       .may_use = {"rt/", "hal/", "vision/", "tools/"},
       .outside =
           "Eigen/.*|tl/expected.hpp|opencv2/.*|fmt/.*|toml\\+\\+/.*|CLI/.*|nlohmann/.*|gtest/.*|gmock/.*"},
  };
  return table;
}

const Room* room_of(std::string_view path) {
  const Room* best = nullptr;
  for (const Room& room : rooms()) {
    if (path.starts_with(room.folder) && (best == nullptr || room.folder.size() > best->folder.size())) {
      best = &room;
    }
  }
  return best;
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
    if (room->core && target == "hal/segment.hpp") {
      return "sets up shared memory and may fail; the core gets it ready-made";
    }
    if (room->ground && contains(kGround, target)) {
      return {};
    }
    const Room* owner = room_of(target);
    if (owner == nullptr && room->folder == "tests/" && target.find('/') == std::string_view::npos) {
      return {};  // a piece of the test that lies beside it
    }
    if (owner == nullptr) {
      return "names nothing in this tree; paths start at the top of the tree";
    }
    const bool own_room = owner->folder == room->folder;
    const bool allowed = std::any_of(room->may_use.begin(), room->may_use.end(),
                                     [&](std::string_view f) { return target.starts_with(f); });
    if (room->core ? allowed : (own_room || allowed)) {
      return {};
    }
    return "is a room that " + std::string(room->folder) + " may not use";
  }
  // In angle brackets: the standard and POSIX libraries, and what the room is built on.
  if (std::regex_match(std::string(target), std::regex(std::string(room->outside)))) {
    return {};
  }
  if (room->core) {
    return contains(kCoreStandard, target) ? std::string{} : "may allocate, lock, throw or print";
  }
  const bool standard =
      target.find('/') == std::string_view::npos && target.find(".hpp") == std::string_view::npos;
  const bool system =
      target.starts_with("sys/") || target.starts_with("linux/") || target.starts_with("net/");
  const bool foreign =
      std::regex_match(std::string(target), std::regex("gpiod.*|libusb.*|curl.*|fmt.*|spdlog.*"));
  if ((standard || system) && !foreign) {
    return {};
  }
  return "is a library that " + std::string(room->folder) + " is not built on";
}

// Every breach in the tree below `top`, as "file:line: target why".
std::vector<std::string> breaches(const fs::path& top) {
  std::vector<std::string> found;
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
        if (!std::regex_search(line, m, directive)) {
          continue;
        }
        const std::string why = objection(file, m[2].str(), m[1].str() == "\"");
        if (!why.empty()) {
          found.push_back(file + ":" + std::to_string(number) + ": " + m[2].str() + " " + why);
        }
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

TEST(IncludeRules, HoldInTheWholeTree) {
  ASSERT_TRUE(fs::exists(PUNCTUM_SOURCE_DIR "/hal/devices.hpp"));
  const std::vector<std::string> found = breaches(PUNCTUM_SOURCE_DIR);
  EXPECT_TRUE(found.empty()) << joined(found);
}

// One planted file per wall: the check must see each.
class PlantedBreach : public testing::Test {
 protected:
  void SetUp() override {
    top_ = fs::temp_directory_path() / ("punctum-walls-" + std::to_string(::getpid()));
    fs::create_directories(top_);
  }
  void TearDown() override { fs::remove_all(top_); }

  std::size_t breaches_of(const std::string& file, const std::string& include) {
    fs::remove_all(top_);
    fs::create_directories((top_ / file).parent_path());
    std::ofstream(top_ / file) << "#pragma once\n#include " << include << "\n";
    return breaches(top_).size();
  }

  fs::path top_;
};

TEST_F(PlantedBreach, IsSeenAtEveryWall) {
  const std::pair<const char*, const char*> forbidden[] = {
      {"rt/control/a.cpp", "<vector>"},
      {"rt/control/a.cpp", "<string>"},
      {"rt/forces/a.hpp", "<mutex>"},
      {"rt/executive/a.hpp", "<cstdio>"},
      {"rt/station/a.hpp", "<opencv2/core.hpp>"},
      {"rt/station/a.hpp", "<tl/expected.hpp>"},
      {"rt/control/a.cpp", "\"rt/platform/memory.hpp\""},
      {"rt/control/a.cpp", "\"hal/segment.hpp\""},
      {"rt/control/a.cpp", "\"hal/sim/bench.hpp\""},
      {"rt/control/a.cpp", "\"vision/config.hpp\""},
      {"rt/control/a.cpp", "\"tools/scene.hpp\""},
      {"rt/platform/a.cpp", "\"hal/sim/bench.hpp\""},
      {"rt/platform/a.cpp", "<opencv2/core.hpp>"},
      {"hal/devices.hpp", "\"hal/sim/bench.hpp\""},
      {"hal/sim/a.cpp", "\"rt/station/observation.hpp\""},
      {"hal/sim/a.cpp", "\"hal/recorded/folder.hpp\""},
      {"hal/recorded/a.cpp", "\"hal/sim/bench.hpp\""},
      {"hal/recorded/a.cpp", "\"vision/config.hpp\""},
      {"hal/gpiod/a.cpp", "<libusb-1.0/libusb.h>"},
      {"hal/sim/a.cpp", "<gpiod.h>"},
      {"hal/sim/a.cpp", "\"tools/scene.hpp\""},
      {"vision/a.cpp", "\"rt/control/config.hpp\""},
      {"vision/a.cpp", "\"hal/recorded/folder.hpp\""},
      {"vision/a.cpp", "\"hal/sim/bench.hpp\""},
      {"vision/a.cpp", "<toml++/toml.h>"},
      {"tools/a.cpp", "<gtest/gtest.h>"},
      {"tools/a.cpp", "\"tests/unit/a.hpp\""},
      {"tools/a.cpp", "<boost/format.hpp>"},
      {"tools/a.cpp", "\"../rt/control/config.hpp\""},
      {"tools/a.cpp", "\"config.hpp\""},
  };
  for (const auto& [file, include] : forbidden) {
    EXPECT_EQ(breaches_of(file, include), 1U) << file << " includes " << include;
  }
}

TEST_F(PlantedBreach, IsNotSeenWhereAPathIsOpen) {
  const std::pair<const char*, const char*> open[] = {
      {"rt/control/a.cpp", "<array>"},
      {"rt/control/a.cpp", "<Eigen/Core>"},
      {"rt/control/a.cpp", "\"hal/devices.hpp\""},
      {"rt/control/a.cpp", "\"rt/forces/membrane.hpp\""},
      {"rt/station/a.hpp", "\"hal/exchange.hpp\""},
      {"rt/platform/a.cpp", "<string>"},
      {"rt/platform/a.cpp", "<sys/mman.h>"},
      {"rt/platform/a.cpp", "\"hal/segment.hpp\""},
      {"hal/sim/a.cpp", "\"hal/segment.hpp\""},
      {"vision/a.cpp", "\"rt/station/observation.hpp\""},
      {"vision/a.cpp", "<opencv2/core.hpp>"},
      {"tools/a.cpp", "\"rt/forces/membrane.hpp\""},
      {"tools/a.cpp", "<toml++/toml.h>"},
      {"tests/unit/a.cpp", "\"tools/scene.hpp\""},
  };
  for (const auto& [file, include] : open) {
    EXPECT_EQ(breaches_of(file, include), 0U) << file << " includes " << include;
  }
}

}  // namespace
