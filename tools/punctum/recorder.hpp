// Writes samples.csv and feeds the measures: takes the telemetry and the events of the core and, when the
// world is simulated, the snapshots of the bench, tick by tick. Under the virtual clock the same seed gives
// the same bytes. However thin samples.csv is, fault.csv has every tick from two seconds before a fault to
// half a second after it. samples.csv and events.csv grow by whole rows, and are never more than half a
// second old.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "hal/ipc/exchange.hpp"
#include "hal/sim/bench.hpp"
#include "rt/station/station.hpp"
#include "tools/punctum/disk_space.hpp"
#include "tools/punctum/event_list.hpp"
#include "tools/punctum/measures.hpp"
#include "tools/punctum/not_kept.hpp"
#include "tools/shared/row_file.hpp"
#include "tools/shared/world_of_tick.hpp"

namespace punctum::tools {

class Recorder {
 public:
  // Every n-th tick becomes a row, and every tick on which phase, fault, e-stop or cell changes.
  static tl::expected<Recorder, std::string> create(const std::string& folder, const Scene& scene,
                                                    const rt::CoreSegment& core, sim::Bench* bench,
                                                    std::uint64_t every);

  // So many bytes of the disk are kept back until finish(), for the tables alone when all else is full.
  void keep_room(std::int64_t bytes);

  // Takes what is there of the first `until` ticks; returns the number of ticks taken.
  std::uint64_t drain(std::uint64_t until = UINT64_MAX);
  [[nodiscard]] std::uint64_t position() const noexcept { return telemetry_.position(); }

  // As after a fault, where the core died and latched none.
  void keep_last_seconds();

  [[nodiscard]] const Measures& measures() const noexcept { return measures_; }
  [[nodiscard]] const EventList& events() const noexcept { return events_; }
  [[nodiscard]] std::uint64_t rows() const;  // of samples.csv, after finish()
  // Samples that were overwritten before they were read.
  [[nodiscard]] std::uint64_t lost() const noexcept;
  // Samples that named what does not exist; they are in no file.
  [[nodiscard]] std::uint64_t unusable() const noexcept { return unusable_; }
  [[nodiscard]] std::uint64_t every() const noexcept { return every_; }
  // What could not be written so far: of each file the first failure, and the first gap. The run goes on.
  [[nodiscard]] const std::vector<NotKept>& not_kept() const noexcept { return not_kept_; }
  void finish();

 private:
  // A table of the report, and what the report must tell of it.
  struct Table {
    const char* name;
    RowFile file;
    bool failed = false;
  };
  struct Tick {
    rt::TelemetrySample sample;
    sim::Snapshot world;
    bool has_world = false;
  };
  Recorder(RowFile file, const std::string& folder, const Scene& scene, const rt::CoreSegment& core,
           sim::Bench* bench, std::uint64_t every);
  [[nodiscard]] const sim::Snapshot* world_of(const rt::TelemetrySample& s);  // null: there is none
  void record(const rt::TelemetrySample& s, const sim::Snapshot* world);
  void note_gap();
  void flush_now_and_then();
  void record_fault(const rt::TelemetrySample& s, const sim::Snapshot* world);
  void row(Table& table, const rt::TelemetrySample& s, const sim::Snapshot* world);
  void flush(Table& table, double t_s);
  void note_failure(Table& table, const std::string& why, double t_s);

  std::string folder_;
  std::unique_ptr<RoomForRows> room_;
  Table samples_{.name = "samples.csv", .file = {}};
  Table fault_{.name = "fault.csv", .file = {}};  // open from the first fault on
  std::vector<NotKept> not_kept_;
  bool gap_noted_ = false;
  std::vector<Tick> recent_;  // a ring of two seconds
  std::uint64_t recent_end_ = 0, recent_count_ = 0;
  std::uint64_t after_fault_ = 0;  // rows that are still to be written after it
  int faults_kept_ = 0;
  sim::SimConfig sim_;
  Measures measures_;
  const rt::CoreSegment& core_;
  hal::Follower<rt::TelemetryRing> telemetry_;
  hal::Follower<rt::EventRing> event_ring_;
  EventList events_;
  Table events_table_{.name = "events.csv", .file = {}};
  std::chrono::steady_clock::time_point flushed_{};
  std::unique_ptr<sim::SnapshotTaker> taker_;
  std::uint64_t every_;
  std::uint64_t rows_ = 0, unusable_ = 0;
  WorldOfTick world_of_tick_;
  std::uint64_t ticks_after_fault_;
  rt::TelemetrySample sample_, before_;
  std::string row_;
};

}  // namespace punctum::tools
