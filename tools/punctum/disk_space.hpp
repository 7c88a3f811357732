// Space on the disk that takes the report: looked at before a run, and a little of it kept back so that the
// report itself can still be written when everything else has filled the disk.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "tools/scene/scene.hpp"

namespace punctum::tools {

struct ExpectedRecording {
  double seconds = 0;
  std::uint64_t rows_every = 1;
  bool frames = false;      // annotated ones
  bool every_tick = false;  // recording.mcap
  bool pictures = false;    // in it
};

// Bytes that a run writes into its folder, at most or nearly so.
[[nodiscard]] double bytes_written(const Scene& scene, const ExpectedRecording& recording);

// Of them, what to keep back for samples.csv: all that it may need, or half of what is free. 0 where nobody
// knows.
[[nodiscard]] std::int64_t room_for_samples(const std::string& folder, const Scene& scene,
                                            const ExpectedRecording& recording);

// The error, one line: not even the report itself finds room. The value, one line: what may not find room;
// empty where everything does, or where nobody knows.
[[nodiscard]] tl::expected<std::string, std::string> look_for_space(const std::string& folder,
                                                                    double bytes_wanted);

// A file of some size in the folder until it is given back.
class SpaceReserve {
 public:
  static constexpr std::int64_t kBytes = 1 << 20;  // report.json of a long run with thousands of events

  explicit SpaceReserve(const std::string& folder);  // where that is not possible, there is none
  SpaceReserve(const SpaceReserve&) = delete;
  SpaceReserve& operator=(const SpaceReserve&) = delete;
  ~SpaceReserve() { give_back(); }
  void give_back() noexcept;

 private:
  std::string file_;
};

// Room that pictures, logs and other programs cannot fill, for tables on a disk that is full. A file without
// a name: it ends with this program, however that ends.
class RoomForRows {
 public:
  RoomForRows(const std::string& folder, std::int64_t bytes);  // where that is not possible, there is none
  RoomForRows(const RoomForRows&) = delete;
  RoomForRows& operator=(const RoomForRows&) = delete;
  ~RoomForRows() { give_back(); }
  [[nodiscard]] bool give() noexcept;  // a little of it is free from now on; false: nothing is left
  void give_back() noexcept;

 private:
  int file_ = -1;
  std::int64_t bytes_ = 0;
};

}  // namespace punctum::tools
