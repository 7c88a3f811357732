// The segments of a station: their names, and how a parent hands them to a child. A child inherits open
// descriptors; one argument says which number stands for which segment: "core=5,observation=6".
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "rt/station/command.hpp"

namespace punctum::tools {

inline constexpr const char* kCoreSegment = "core";
inline constexpr const char* kObservationSegment = "observation";
inline constexpr const char* kInputSegment = "inputs";       // where a run is recorded
inline constexpr const char* kPictureSegment = "pictures";   // where they are recorded
inline constexpr const char* kViewSegment = "view";          // those that somebody looks at
inline constexpr const char* kViewerSegment = "viewer";      // whether somebody does
inline constexpr const char* kFingersSegment = "fingers";    // of whoever holds the hand on the page
inline constexpr const char* kProgressSegment = "progress";  // of the recording
inline constexpr const char* kBenchSegment = "bench";
inline constexpr const char* kCameraSegment = "camera";  // its answers to the bench
inline constexpr const char* kSceneText =
    "scene";  // no segment: the resolved scene, sealed (hal/ipc/sealed_text.hpp)
[[nodiscard]] inline std::string command_segment(const rt::CommandWriter& writer) {
  return std::string("commands.") + writer.name;
}

class HandedSegments {
 public:
  void add(std::string_view name, int descriptor) { list_.emplace_back(name, descriptor); }
  [[nodiscard]] std::string text() const;
  // The error is one line.
  [[nodiscard]] static tl::expected<HandedSegments, std::string> parse(std::string_view text);

  [[nodiscard]] int descriptor(std::string_view name) const;  // -1: not handed over
  [[nodiscard]] std::vector<int> descriptors() const;

 private:
  std::vector<std::pair<std::string, int>> list_;
};

}  // namespace punctum::tools
