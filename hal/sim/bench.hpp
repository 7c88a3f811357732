// The bench: the simulated world's shared-memory segment. One owner steps the plant and writes here - the
// simulated devices inside the core program; camera, emulators and the recorder only map it. Everything is
// plain data or an atomic word; nobody can block the writer, except in virtual time, where waiting happens
// inside the clock (virtual_clock.hpp).
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "hal/ipc/exchange.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/failures.hpp"
#include "hal/sim/operator/operator.hpp"
#include "hal/sim/plant/cell.hpp"
#include "hal/sim/plant/estop.hpp"
#include "hal/sim/plant/force_sensor.hpp"
#include "hal/sim/plant/hand.hpp"
#include "hal/sim/plant/injector.hpp"
#include "hal/sim/plant/stage.hpp"
#include "hal/sim/plant/vacuum.hpp"
#include "hal/sim/point.hpp"

namespace punctum::sim {

// What the cell's tables give at one instant: plain copies of sim::CellForce.
struct CellReading {
  Point centre_m;        // of this individual, where it is now, undeformed
  double R_m = 0;        // its outer face
  double R_inner_m = 0;  // 0: no inner membrane
  Point entry_m;         // needle's axis meets the undeformed outer face; valid if aims_at_cell
  double depth_m = 0;    // of the tip past entry_m along the axis; < 0 outside
  double wd_m = 0;
  double a_m = 0;
  double inner_wd_m = 0;
  double chord_m = 0;     // from entry_m to the far wall
  Point force_N;          // on the needle
  double membrane_N = 0;  // along the needle, >= 0
  double outer_N = 0;
  double inner_N = 0;
  double drag_N = 0;
  double strain = 0;
  double pressure_Pa = 0;
  std::uint32_t contact = 0;
  std::uint32_t aims_at_cell = 0;
};

// The whole state of the plant after one tick, before the core answers: enough to continue from
// (World::restore). truth.hpp says what it means.
struct Snapshot {
  std::int64_t t_ns = 0;      // station clock
  std::int64_t start_ns = 0;  // of the run
  std::uint64_t tick = 0;     // counts from 1
  HandPlantState hand;
  OperatorState operator_state;
  StagePlantState stage;
  CellState cell;            // valid if has_cell
  CellReading cell_reading;  // likewise
  InjectorPlantState injector;
  VacuumPlantState vacuum;
  ForceSensorPlantState force_sensor;
  EstopPlantState estop;
  std::int64_t puncture_ns = 0;  // when the innermost membrane of this cell gave way; 0 = not yet
  std::int64_t zona_puncture_ns = 0;
  std::uint64_t cell_index = 0;  // counts cells of this run from 0
  std::uint32_t has_cell = 0;
  std::uint32_t next_cell_was_down = 0;
  std::array<Failing, kDevices> failure{};  // per Device, now
};
static_assert(std::is_trivially_copyable_v<Snapshot>);

// What the camera saw at the first tick of a frame's time.
struct Exposure {
  std::uint64_t frame = 0;  // number of the frame: gaps are frames nobody exposed
  std::int64_t exposure_ns = 0;
  std::int64_t deliver_ns = 0;  // its observation may not be seen before; 0 in real time
  Snapshot world;
};
static_assert(std::is_trivially_copyable_v<Exposure>);

inline constexpr std::uint64_t kSnapshots = 8192;
inline constexpr std::uint64_t kExposures = 8;
// Ticks that virtual time gets ahead of a recorder at most: what vision tells meanwhile fits its ring of 64
// at up to 250 pictures per second of a station at 1 kHz.
inline constexpr std::uint64_t kMostAhead = 256;

struct Bench {
  static constexpr std::uint64_t kMagic = 0x0068636e65625350ULL;  // "Psbench"
  static constexpr std::uint64_t kVersion = 2;                    // raise when a meaning changes
  static const std::uint64_t kLayout;                             // version, sizes and offsets

  hal::SegmentHeader header;

  // Virtual clock.
  std::atomic<std::int64_t> now_ns{0};         // time of the newest tick, in either kind of time
  std::atomic<std::uint64_t> virtual_time{0};  // 1: time advances when everybody attached is ready
  std::atomic<std::uint64_t> finished{0};      // 1: the plant will not be stepped any more

  std::atomic<std::uint64_t> exposed{0};  // exposures pushed
  std::array<std::atomic<std::int64_t>, kExposures> deliver_ns{};

  // Recorder handshake: the recorder has taken all snapshots before recorder_cursor.
  std::atomic<std::uint64_t> recorder_attached{0};
  std::atomic<std::uint64_t> recorder_cursor{0};
  std::atomic<std::uint64_t> recorder_gave_up{0};

  FailureSwitches failures;
  hal::SeqRing<Snapshot, kSnapshots> snapshots;
  hal::SeqRing<Exposure, kExposures> exposures;
};

inline constexpr std::uint64_t Bench::kLayout = hal::fingerprint(
    Bench::kVersion, sizeof(Bench), sizeof(Snapshot), sizeof(Exposure), offsetof(Snapshot, stage),
    offsetof(Snapshot, cell), offsetof(Snapshot, cell_index), offsetof(Bench, now_ns),
    offsetof(Bench, failures), offsetof(Bench, snapshots), offsetof(Bench, exposures));
static_assert(std::is_standard_layout_v<Bench> && std::is_trivially_destructible_v<Bench>);

// The camera's answers to the bench: a segment of its own, so that whoever sees the pictures can write no
// word of the world. Exposure i is delivered once `delivered` > i.
struct CameraAnswers {
  static constexpr std::uint64_t kMagic = 0x00006172656d6350ULL;  // "Pcmera"
  static constexpr std::uint64_t kVersion = 1;
  static const std::uint64_t kLayout;

  hal::SegmentHeader header;
  std::atomic<std::uint64_t> pid{0};  // 0 = none attached; the supervisor clears it when it dies
  std::atomic<std::uint64_t> delivered{0};
  std::atomic<std::uint64_t> gave_up{0};  // how often the clock stopped waiting for one
};
inline constexpr std::uint64_t CameraAnswers::kLayout =
    hal::fingerprint(CameraAnswers::kVersion, sizeof(CameraAnswers), offsetof(CameraAnswers, delivered));
static_assert(std::is_standard_layout_v<CameraAnswers> && std::is_trivially_destructible_v<CameraAnswers>);

// Takes exposures from the bench, for a camera. In virtual time the choice of the next frame depends on
// virtual time alone: frames that fell due while one was being worked on are skipped, except the newest.
// May block; not for the tick.
class ExposureTaker {
 public:
  ExposureTaker(const Bench& bench, CameraAnswers& answers) : bench_(bench), answers_(answers) {}
  ~ExposureTaker() { detach(); }
  ExposureTaker(const ExposureTaker&) = delete;
  ExposureTaker& operator=(const ExposureTaker&) = delete;

  void attach() noexcept;  // from the next exposure on
  void detach() noexcept;

  // Waits at most timeout_ns of real time: ok, no_data, or disconnected once the plant has stopped.
  [[nodiscard]] hal::Status next(Exposure& out, std::int64_t timeout_ns) noexcept;
  // The observation of the last exposure is published (or never will be).
  void release() noexcept;

 private:
  const Bench& bench_;
  CameraAnswers& answers_;
  std::uint64_t next_ = 0;
  bool attached_ = false;
  bool taken_ = false;
  std::int64_t deliver_ns_ = 0;  // of the exposure that is taken
};

// Takes every snapshot in order, for a recorder: in virtual time the clock waits for it (kMostAhead).
class SnapshotTaker {
 public:
  explicit SnapshotTaker(Bench& bench) : bench_(bench), follower_(bench.snapshots) {}
  ~SnapshotTaker() { detach(); }
  SnapshotTaker(const SnapshotTaker&) = delete;
  SnapshotTaker& operator=(const SnapshotTaker&) = delete;

  void attach() noexcept;  // from the next snapshot on
  void detach() noexcept;
  [[nodiscard]] bool next(Snapshot& out) noexcept;  // false: none now
  [[nodiscard]] std::uint64_t lost() const noexcept { return follower_.lost(); }

 private:
  Bench& bench_;
  hal::Follower<hal::SeqRing<Snapshot, kSnapshots>> follower_;
  bool attached_ = false;
};

}  // namespace punctum::sim
