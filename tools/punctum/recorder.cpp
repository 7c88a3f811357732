#include "tools/punctum/recorder.hpp"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <string>

#include "rt/forces/list.hpp"
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
      effect_columns(kFirstEffects, rt::effect_count);
  all.back() = '\n';
  return all;
}

// In virtual time the core may be as fast as the recorder: the caller has other work between two rounds.
constexpr std::uint64_t kMostTicksPerRound = 4096;

constexpr double kBeforeFault_s = 2;
constexpr double kAfterFault_s = 0.5;
constexpr int kMostFaultsKept = 20;  // a station that is reset again and again fills no disk

}  // namespace

tl::expected<Recorder, std::string> Recorder::create(const std::string& folder, const Scene& scene,
                                                     const rt::CoreSegment& core, sim::Bench* bench,
                                                     std::uint64_t every) {
  const std::string csv_path = folder + "/samples.csv";
  std::FILE* file = std::fopen(csv_path.c_str(), "we");
  if (file == nullptr) {
    return tl::unexpected(fmt::format("{}: {}", csv_path, std::strerror(errno)));
  }
  return Recorder(file, folder, scene, core, bench, every);
}

Recorder::Recorder(std::FILE* file, const std::string& folder, const Scene& scene,
                   const rt::CoreSegment& core, sim::Bench* bench, std::uint64_t every)
    : file_(file),
      fault_path_(folder + "/fault.csv"),
      recent_(static_cast<std::size_t>(kBeforeFault_s * scene.servo.rate_Hz)),
      sim_(scene.sim.value_or(sim::SimConfig{})),
      measures_(scene),
      core_(core),
      telemetry_(core.telemetry),
      event_ring_(core.events),
      every_(every > 0 ? every : 1),
      half_period_s_(0.5 / scene.servo.rate_Hz),
      ticks_after_fault_(static_cast<std::uint64_t>(kAfterFault_s * scene.servo.rate_Hz)) {
  std::fputs(columns().c_str(), file);
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
  }
  events_.lost = event_ring_.lost();
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

// The plant publishes before the core does: the snapshot of a tick is there, or it was overwritten.
const sim::Snapshot* Recorder::world_of(const rt::TelemetrySample& s) {
  if (!taker_) {
    return nullptr;
  }
  for (;;) {
    if (!world_pending_ && !taker_->next(world_)) {
      return nullptr;
    }
    const double t_s = static_cast<double>(world_.t_ns - world_.start_ns) * 1e-9;
    world_pending_ = t_s >= s.t_s + half_period_s_;  // of a later tick: kept for that
    if (world_pending_) {
      return nullptr;
    }
    if (t_s >= s.t_s - half_period_s_) {
      return &world_;
    }
  }
}

void Recorder::record(const rt::TelemetrySample& s, const sim::Snapshot* world) {
  measures_.tick(s, world);
  const bool change = rows_ == 0 || s.phase != before_.phase || s.fault != before_.fault ||
                      s.stop != before_.stop || s.estop != before_.estop || s.cell != before_.cell;
  if (change || s.tick % every_ == 0) {
    row(file_.get(), s, world);
    ++rows_;
  }
  record_fault(s, world);
  before_ = s;
}

void Recorder::record_fault(const rt::TelemetrySample& s, const sim::Snapshot* world) {
  if (after_fault_ > 0) {
    row(fault_file_.get(), s, world);
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
  if (!fault_file_) {
    std::FILE* const opened = std::fopen(fault_path_.c_str(), "we");
    if (opened == nullptr) {
      failed_ = true;
      return;
    }
    fault_file_ = File(opened);
    std::fputs(columns().c_str(), fault_file_.get());
  }
  for (std::uint64_t i = recent_end_ - recent_count_; i < recent_end_; ++i) {
    const Tick& tick = recent_[i % recent_.size()];
    row(fault_file_.get(), tick.sample, tick.has_world ? &tick.world : nullptr);
  }
  recent_count_ = 0;
  after_fault_ = ticks_after_fault_;
  if (std::fflush(fault_file_.get()) != 0) {
    failed_ = true;
  }
}

void Recorder::row(std::FILE* file, const rt::TelemetrySample& s, const sim::Snapshot* world) {
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
  out.data()[out.size() - 1] = '\n';  // in place of the last comma
  if (std::fwrite(out.data(), 1, out.size(), file) != out.size()) {
    failed_ = true;
  }
}

void Recorder::finish() {
  drain(true);
  measures_.finish();
  for (std::FILE* file : {file_.get(), fault_file_.get()}) {
    if (file != nullptr && std::fflush(file) != 0) {
      failed_ = true;
    }
  }
}

}  // namespace punctum::tools
