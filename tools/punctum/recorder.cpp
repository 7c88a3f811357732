#include "tools/punctum/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "tools/shared/event_words.hpp"
#include "tools/shared/sample_row.hpp"
#include "tools/shared/station_values.hpp"

namespace punctum::tools {
namespace {

// In virtual time the core may be as fast as the recorder: the caller has other work between two rounds.
constexpr std::uint64_t kMostTicksPerRound = 4096;

constexpr std::chrono::milliseconds kFlushed{500};  // so long at most a row waits for its file
constexpr double kBeforeFault_s = 2;
constexpr double kAfterFault_s = 0.5;
constexpr int kMostFaultsKept = 20;  // a station that is reset again and again fills no disk

}  // namespace

tl::expected<Recorder, std::string> Recorder::create(const std::string& folder, const Scene& scene,
                                                     const rt::CoreSegment& core, sim::Bench* bench,
                                                     std::uint64_t every) {
  auto file = RowFile::open(folder + "/samples.csv", RowFile::Begin::empty);
  if (!file) {
    return tl::unexpected(file.error());
  }
  return Recorder(std::move(*file), folder, scene, core, bench, every);
}

Recorder::Recorder(RowFile file, const std::string& folder, const Scene& scene, const rt::CoreSegment& core,
                   sim::Bench* bench, std::uint64_t every)
    : folder_(folder),
      recent_(static_cast<std::size_t>(kBeforeFault_s * scene.servo.rate_Hz)),
      sim_(scene.sim.value_or(sim::SimConfig{})),
      measures_(scene),
      core_(core),
      telemetry_(core.telemetry),
      event_ring_(core.events),
      every_(every > 0 ? every : 1),
      world_of_tick_(std::llround(1e9 / scene.servo.rate_Hz)),
      ticks_after_fault_(static_cast<std::uint64_t>(kAfterFault_s * scene.servo.rate_Hz)) {
  samples_.file = std::move(file);
  samples_.file.append(sample_columns());
  // Without it the run loses nothing but what a crash would leave.
  if (auto opened = RowFile::open(folder + "/events.csv", RowFile::Begin::empty)) {
    events_table_.file = std::move(*opened);
    events_table_.file.append(kEventColumns);
  }
  if (bench != nullptr) {
    taker_ = std::make_unique<sim::SnapshotTaker>(*bench);
    taker_->attach();
  }
}

void Recorder::keep_room(std::int64_t bytes) {
  room_ = std::make_unique<RoomForRows>(folder_, bytes);
  for (Table* table : {&samples_, &events_table_}) {
    table->file.when_full([room = room_.get()] { return room->give(); });
  }
}

std::uint64_t Recorder::drain(std::uint64_t until) {
  std::uint64_t taken = 0;
  while (taken < kMostTicksPerRound && telemetry_.position() < until &&
         telemetry_.next(sample_) == hal::Read::ok) {
    ++taken;
    note_gap();
    if (usable(sample_)) {
      record(sample_, world_of(sample_));
    } else {
      ++unusable_;
    }
  }
  rt::Event event;
  for (std::size_t i = 0; i < rt::EventRing::kSize && event_ring_.next(event) == hal::Read::ok; ++i) {
    events_.add(event);
    events_table_.file.append(event_line(event));
  }
  events_.lost = event_ring_.lost();
  flush_now_and_then();
  return taken;
}

// The first one; how many samples all of them have cost is counted.
void Recorder::note_gap() {
  if (gap_noted_ || telemetry_.lost() == 0) {
    return;
  }
  gap_noted_ = true;
  not_kept_.push_back(
      {samples_.name, before_.t_s,
       fmt::format("the samples up to {:.3f} s were overwritten before this program, which did "
                   "not get to run, came to read them",
                   sample_.t_s)});
}

// A ring whose counter is wrong may seem to have run far ahead; no more can be lost than was executed.
std::uint64_t Recorder::lost() const noexcept {
  return std::min(telemetry_.lost(), core_.status.ticks.load(std::memory_order_relaxed));
}

const sim::Snapshot* Recorder::world_of(const rt::TelemetrySample& s) {
  return taker_ ? world_of_tick_(s, [this](sim::Snapshot& out) { return taker_->next(out); }) : nullptr;
}

void Recorder::flush_now_and_then() {
  const auto now = std::chrono::steady_clock::now();
  if (now < flushed_ + kFlushed) {
    return;
  }
  flushed_ = now;
  flush(samples_, before_.t_s);
  flush(events_table_, before_.t_s);
}

void Recorder::record(const rt::TelemetrySample& s, const sim::Snapshot* world) {
  measures_.tick(s, world);
  const bool change = measures_.ticks == 1 || s.phase != before_.phase || s.fault != before_.fault ||
                      s.stop != before_.stop || s.estop != before_.estop || s.cell != before_.cell;
  if (change || s.tick % every_ == 0) {
    row(samples_, s, world);
    rows_ += samples_.failed ? 0 : 1;
  }
  record_fault(s, world);
  before_ = s;
}

void Recorder::record_fault(const rt::TelemetrySample& s, const sim::Snapshot* world) {
  if (after_fault_ > 0) {
    row(fault_, s, world);
    --after_fault_;
    return;
  }
  Tick& tick = recent_[recent_end_++ % recent_.size()];
  tick.sample = s;
  tick.has_world = world != nullptr;
  if (world != nullptr) {
    tick.world = *world;
  }
  recent_count_ = std::min<std::uint64_t>(recent_count_ + 1, recent_.size());
  if (s.fault != rt::Fault::none && s.fault != before_.fault) {
    keep_last_seconds();
  }
}

void Recorder::keep_last_seconds() {
  if (faults_kept_ >= kMostFaultsKept || recent_count_ == 0) {
    return;
  }
  ++faults_kept_;
  if (!fault_.file.is_open() && !fault_.failed) {
    if (auto opened = RowFile::open(folder_ + "/" + fault_.name, RowFile::Begin::empty)) {
      fault_.file = std::move(*opened);
      if (room_) {
        fault_.file.when_full([room = room_.get()] { return room->give(); });
      }
      fault_.file.append(sample_columns());
    } else {
      note_failure(fault_, opened.error(), before_.t_s);
    }
  }
  for (std::uint64_t i = recent_end_ - recent_count_; i < recent_end_; ++i) {
    const Tick& tick = recent_[i % recent_.size()];
    row(fault_, tick.sample, tick.has_world ? &tick.world : nullptr);
  }
  recent_count_ = 0;
  after_fault_ = ticks_after_fault_;
  flush(fault_, before_.t_s);
}

void Recorder::flush(Table& table, double t_s) {
  table.file.flush();
  if (!table.file.failure().empty()) {
    note_failure(table, table.file.failure(), t_s);
  }
}

// Of a table that could not be written to its end some rows were given to the file and are not in it.
std::uint64_t Recorder::rows() const {
  if (!samples_.failed) {
    return rows_;
  }
  std::ifstream file(folder_ + "/" + samples_.name);
  const auto lines = std::count(std::istreambuf_iterator<char>(file), {}, '\n');
  return static_cast<std::uint64_t>(std::max<std::int64_t>(lines - 1, 0));
}

void Recorder::note_failure(Table& table, const std::string& why, double t_s) {
  if (!table.failed) {
    table.failed = true;
    not_kept_.push_back({table.name, t_s, why});
  }
}

void Recorder::row(Table& table, const rt::TelemetrySample& s, const sim::Snapshot* world) {
  std::optional<RowTruth> truth;
  if (world != nullptr) {
    truth = row_truth(sim_, *world);
  }
  write_sample_row(s, truth ? &*truth : nullptr, row_);
  table.file.append(row_);
  if (!table.file.failure().empty()) {
    note_failure(table, table.file.failure(), s.t_s);
  }
}

void Recorder::finish() {
  // What a ring holds is the most that a writer which is gone has left.
  for (std::uint64_t taken = 0, now = 1; now > 0 && taken < rt::TelemetryRing::kSize; taken += now) {
    now = drain();
  }
  sim::Snapshot rest;
  for (std::uint64_t i = 0; taker_ && i < sim::kSnapshots && taker_->next(rest); ++i) {
  }
  measures_.finish();
  flush(samples_, measures_.last_s);
  flush(fault_, measures_.last_s);
  flush(events_table_, measures_.last_s);
  if (room_) {
    room_->give_back();
  }
}

}  // namespace punctum::tools
