#include "tools/punctum/recorder.hpp"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <string>
#include <utility>

#include "rt/forces/list.hpp"
#include "tools/punctum/event_log.hpp"
#include "tools/shared/station_values.hpp"

namespace punctum::tools {
namespace {

// The first effects stand before guard_N, all others at the end: columns keep their places.
constexpr std::size_t kFirstEffects = 4;

std::string effect_columns(std::size_t from, std::size_t to) {
  std::string columns;
  for (std::size_t i = from; i < to; ++i) {
    columns += std::string(rt::effect_name(i)) + "_N,";
  }
  return columns;
}

std::string columns() {
  std::string all =
      "t_s,phase,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,tip_x_m,tip_y_m,tip_z_m,cmd_x_m,cmd_y_m,cmd_z_m,fx_N,fy_N,"
      "fz_N," +
      effect_columns(0, kFirstEffects) +
      "guard_N,wd_m,a_m,R_m,obs_age_s,estop,fault,cell,alarms,buttons,stop,tip_force_N,sigma_d_Pa,pressure_"
      "Pa,"
      "obs_gap_m,stored_energy_J,injected_energy_J,injector_open,sensor_N,vacuum_Pa,true_tip_x_m,true_tip_y_"
      "m,"
      "true_tip_z_m,true_force_N,true_gap_m,true_wd_m,true_a_m,true_contact,true_punctured,true_lost," +
      effect_columns(kFirstEffects, rt::effect_count) +
      "wd_sd_m,R_sd_m,tip_force_sd_N,obs_a_m,obs_a_sd_m,E_fit_Pa,E_fit_sd_Pa,";
  all.back() = '\n';
  return all;
}

// In virtual time the core may be as fast as the recorder: the caller has other work between two rounds.
constexpr std::uint64_t kMostTicksPerRound = 4096;

constexpr double kLatestFirstTick_s = 1e6;          // later than that is no start
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
      period_ns_(std::llround(1e9 / scene.servo.rate_Hz)),
      ticks_after_fault_(static_cast<std::uint64_t>(kAfterFault_s * scene.servo.rate_Hz)) {
  samples_.file = std::move(file);
  samples_.file.append(columns());
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

std::uint64_t Recorder::drain(bool to_the_end) {
  // What a ring holds is the most that a writer which is gone has left, and no round takes more.
  const std::uint64_t most = to_the_end ? rt::TelemetryRing::kSize : kMostTicksPerRound;
  std::uint64_t taken = 0;
  while (taken < most && telemetry_.next(sample_) == hal::Read::ok) {
    ++taken;
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
  if (taker_ && to_the_end) {
    for (std::uint64_t i = 0; i < sim::kSnapshots && taker_->next(world_); ++i) {
    }
  }
  return taken;
}

// A ring whose counter is wrong may seem to have run far ahead; no more can be lost than was executed.
std::uint64_t Recorder::lost() const noexcept {
  return std::min(telemetry_.lost(), core_.status.ticks.load(std::memory_order_relaxed));
}

// The plant publishes before the core does: the snapshot of a tick is there, or it was overwritten. It is of
// the time at which the tick began, late by less than a period. Times of the run count from its first tick;
// where the first releases were missed, the plant began earlier.
const sim::Snapshot* Recorder::world_of(const rt::TelemetrySample& s) {
  if (!taker_) {
    return nullptr;
  }
  for (;;) {
    if (!world_pending_) {
      if (!taker_->next(world_)) {
        return nullptr;
      }
      world_tick_ = static_cast<std::uint64_t>((world_.t_ns - world_.start_ns) / period_ns_);
      const double first_tick_s =
          static_cast<double>(s.tick) * 1e-9 * static_cast<double>(period_ns_) - s.t_s;
      world_.start_ns += std::llround(1e9 * std::clamp(first_tick_s, 0.0, kLatestFirstTick_s));
    }
    world_pending_ = world_tick_ > s.tick;  // of a later tick: kept for that
    if (world_pending_) {
      return nullptr;
    }
    if (world_tick_ == s.tick) {
      return &world_;
    }
  }
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
      fault_.file.append(columns());
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

void Recorder::note_failure(Table& table, const std::string& why, double t_s) {
  if (!table.failed) {
    table.failed = true;
    not_kept_.push_back({table.name, t_s, why});
  }
}

void Recorder::row(Table& table, const rt::TelemetrySample& s, const sim::Snapshot* world) {
  fmt::basic_memory_buffer<char, 1024> out;
  const auto put = [&out](double v) { fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:.9g},"), v); };
  const auto count = [&out](std::uint64_t v) {
    fmt::format_to(std::back_inserter(out), FMT_COMPILE("{},"), v);
  };
  const auto three = [&put](const double (&v)[3]) {
    for (const double x : v) {
      put(x);
    }
  };
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:.6f},{},"), s.t_s, rt::name(s.phase));
  three(s.x_m);
  three(s.v_m_s);
  three(s.tip_m);
  three(s.cmd_m);
  three(s.force_N);
  for (std::size_t i = 0; i < kFirstEffects; ++i) {
    put(s.effect_N[i]);
  }
  for (const double v : {s.guard_N, s.wd_m, s.a_m, s.R_m, s.obs_age_s}) {
    put(v);
  }
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{},{},"), s.estop, rt::name(s.fault));
  count(s.cell);
  count(s.alarms);
  count(s.buttons);
  count(static_cast<std::uint64_t>(s.stop));
  for (const double v :
       {s.tip_force_N, s.sigma_d_Pa, s.pressure_Pa, s.obs_gap_m, s.stored_energy_J, s.injected_energy_J}) {
    put(v);
  }
  count(s.injector_open);
  put(s.sensor_N);
  put(s.vacuum_Pa);
  if (world == nullptr) {
    fmt::format_to(std::back_inserter(out), ",,,,,,,,,,");
  } else {
    const hal::Vec3 tip = world->stage.tip_m;
    put(tip.x());
    put(tip.y());
    put(tip.z());
    if (world->has_cell != 0) {
      const sim::Truth t = sim::truth_of(sim_, *world);
      for (const double v : {t.axial_force_N, t.gap_m, t.wd_m, t.a_m}) {
        put(v);
      }
      fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:d},{:d},{:d},"), t.contact, t.punctured, t.lost);
    } else {
      fmt::format_to(std::back_inserter(out), ",,,,,,,");
    }
  }
  for (std::size_t i = kFirstEffects; i < rt::effect_count; ++i) {
    put(s.effect_N[i]);
  }
  for (const double v :
       {s.wd_sd_m, s.R_sd_m, s.tip_force_sd_N, s.obs_a_m, s.obs_a_sd_m, s.E_fit_Pa, s.E_fit_sd_Pa}) {
    put(v);
  }
  out.data()[out.size() - 1] = '\n';  // in place of the last comma
  table.file.append({out.data(), out.size()});
  if (!table.file.failure().empty()) {
    note_failure(table, table.file.failure(), s.t_s);
  }
}

void Recorder::finish() {
  drain(true);
  measures_.finish();
  flush(samples_, measures_.last_s);
  flush(fault_, measures_.last_s);
  flush(events_table_, measures_.last_s);
}

}  // namespace punctum::tools
