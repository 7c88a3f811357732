// Takes what a station tells and writes it into an MCAP file, live: telemetry, simulated truth, the tick's
// inputs, observations, surfaces, events and the core's status. It maps the station for reading; what was
// overwritten before it came to it is counted and written, too. The file is never more than about half a
// second behind.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "hal/ipc/exchange.hpp"
#include "hal/sim/bench.hpp"
#include "rt/station/picture.hpp"
#include "rt/station/station.hpp"
#include "tools/record/disk_sync.hpp"
#include "tools/record/mcap_writer.hpp"
#include "tools/record/recording.hpp"
#include "tools/scene/scene.hpp"
#include "tools/shared/world_of_tick.hpp"
#include "tools/wire/messages.hpp"

namespace punctum::tools {

// What is recorded; the segments outlive the recorder.
struct RecordedStation {
  std::string name;
  std::string scene;  // its text
  const rt::CoreSegment& core;
  const rt::ObservationSegment* observation;           // null: the scene has no vision
  const sim::Bench* bench;                             // null: nothing is simulated
  const rt::InputSegment* inputs = nullptr;            // null: the core does not tell what it was given
  const rt::PictureSegment::Ring* pictures = nullptr;  // null: vision does not tell what it looked at
  bool from_the_first_tick = false;                    // else from what the rings still hold on
};

class StationRecorder {
 public:
  // The error is one line.
  [[nodiscard]] static tl::expected<std::unique_ptr<StationRecorder>, std::string> create(
      const std::string& path, const RecordedStation& station, const Scene& scene);

  // Takes what is there; returns the number of ticks taken.
  std::uint64_t drain();
  // Ticks that it has taken or lost, and with them all that was told before the last of them.
  [[nodiscard]] std::uint64_t position() const noexcept { return telemetry_.position(); }
  // Takes the rest and ends the file.
  void finish();

  [[nodiscard]] bool core_has_ended() const noexcept { return ended_; }  // by its own last word
  // Messages in whole chunks.
  [[nodiscard]] std::uint64_t count(Stream stream) const noexcept {
    return written_[static_cast<std::size_t>(stream)];
  }
  // Time of the run of the first tick, and of the exposure of the first observation, s, where something was
  // told before them and is not in the file; nothing: all is, or none has come.
  [[nodiscard]] std::optional<double> ticks_from_s() const noexcept { return ticks_from_s_; }
  [[nodiscard]] std::optional<double> observations_from_s() const noexcept { return observations_from_s_; }
  [[nodiscard]] v1::Loss loss() const;
  [[nodiscard]] bool lost_nothing() const;
  [[nodiscard]] std::uint64_t bytes() const noexcept { return file_.bytes(); }
  // Why nothing more is written; empty while it is.
  [[nodiscard]] const std::string& failure() const noexcept { return file_.failure(); }

 private:
  using Instant = std::chrono::steady_clock::time_point;
  using SnapshotRing = hal::SeqRing<sim::Snapshot, sim::kSnapshots>;

  StationRecorder(mcap::Writer file, const RecordedStation& station, const Scene& scene, std::int64_t utc_ns);
  template <class Message>
  void add(Stream stream, std::uint64_t log_ns, std::uint64_t publish_ns, const Message& message);
  template <class Message>
  void add(Stream stream, const Message& message) {
    add(stream, now_ns_, now_ns_, message);
  }
  std::uint64_t take_ticks(std::uint64_t until);
  void take(const rt::TelemetrySample& sample);
  void take_inputs(std::uint64_t until);
  void take_what_vision_found();
  void take_pictures();
  void take_events();
  void tell_state();
  [[nodiscard]] std::uint64_t file_ns(std::int64_t station_ns) const noexcept {
    return static_cast<std::uint64_t>(station_ns) + static_cast<std::uint64_t>(utc_ns_);
  }
  [[nodiscard]] bool chunk_spans_enough() const noexcept;
  void close_chunk();

  mcap::Writer file_;
  std::unique_ptr<DiskSync> sync_;
  std::array<std::uint16_t, kStreams> channels_{};
  std::array<std::uint64_t, kStreams> counts_{}, written_{};  // taken; of these in whole chunks
  const rt::CoreSegment& core_;
  sim::SimConfig sim_;
  std::int64_t utc_ns_;  // its time less the station's
  std::uint64_t period_ns_;
  v1::Scene scene_;
  bool scene_told_ = false;

  hal::Follower<rt::TelemetryRing> telemetry_;
  hal::Follower<rt::EventRing> events_;
  std::unique_ptr<hal::Follower<rt::ObservationSlot>> observations_;
  std::unique_ptr<hal::Follower<rt::SurfaceSlot>> surfaces_;
  std::unique_ptr<hal::Follower<SnapshotRing>> snapshots_;
  const rt::InputRing* inputs_ring_ = nullptr;
  std::unique_ptr<hal::Follower<rt::InputRing>> inputs_;
  const rt::PictureSegment::Ring* picture_ring_ = nullptr;
  std::unique_ptr<hal::Follower<rt::PictureSegment::Ring::Heads>> pictures_;
  std::uint64_t pictures_lost_ = 0;
  std::optional<double> ticks_from_s_, observations_from_s_;
  WorldOfTick world_of_tick_;
  std::uint64_t unusable_ = 0;
  std::uint64_t now_ns_ = 0;  // of the file, at the newest tick
  bool ended_ = false;
  Instant chunk_begun_{};
  std::uint64_t chunk_begun_ns_ = 0;  // of the file

  rt::TelemetrySample sample_;
  std::string bytes_;
  v1::Telemetry telemetry_message_;
  v1::Truth truth_message_;
  v1::Input input_message_;
  v1::Picture picture_message_;
  v1::Observation observation_message_;
  v1::CellSurface surface_message_;
  v1::Event event_message_;
  v1::Status status_message_;
};

}  // namespace punctum::tools
