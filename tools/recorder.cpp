#include "tools/recorder.hpp"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <iterator>

namespace punctum::tools {
namespace {

constexpr const char* kColumns =
    "t_s,phase,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,tip_x_m,tip_y_m,tip_z_m,cmd_x_m,cmd_y_m,cmd_z_m,fx_N,fy_N,fz_"
    "N,"
    "membrane_N,cone_N,axis_N,damping_N,guard_N,wd_m,a_m,R_m,obs_age_s,estop,fault,"
    "cell,alarms,buttons,stop,tip_force_N,sigma_d_Pa,pressure_Pa,obs_gap_m,stored_energy_J,injected_energy_J,"
    "injector_open,sensor_N,vacuum_Pa,"
    "true_tip_x_m,true_tip_y_m,true_tip_z_m,true_force_N,true_gap_m,true_wd_m,true_a_m,true_contact,true_"
    "punctured,"
    "true_lost,repulsive_N,friction_N,vibration_N\n";

// A core in virtual time may be as fast as this: the caller has more to do than to drain.
constexpr std::uint64_t kAtOnce = 4096;

}  // namespace

tl::expected<Recorder, std::string> Recorder::create(const std::string& csv_path, const Scene& scene,
                                                     const rt::Station& station, sim::Bench* bench,
                                                     std::uint64_t every) {
  std::FILE* file = std::fopen(csv_path.c_str(), "we");
  if (file == nullptr) return tl::unexpected(fmt::format("{}: {}", csv_path, std::strerror(errno)));
  return Recorder(file, scene, station, bench, every);
}

Recorder::Recorder(std::FILE* file, const Scene& scene, const rt::Station& station, sim::Bench* bench,
                   std::uint64_t every)
    : file_(file),
      sim_(scene.sim.value_or(sim::SimConfig{})),
      measures_(scene),
      station_(&station),
      every_(every > 0 ? every : 1),
      half_period_s_(0.5 / scene.servo.rate_Hz) {
  std::fputs(kColumns, file);
  if (bench != nullptr) {
    taker_ = std::make_unique<sim::SnapshotTaker>(*bench);
    taker_->attach();
  }
}

std::uint64_t Recorder::drain(bool to_the_end) {
  std::uint64_t taken = 0;
  while (to_the_end || taken < kAtOnce) {
    if (!have_) {
      const hal::Read r = station_->telemetry.read(next_, sample_);
      if (r == hal::Read::not_yet) break;
      if (r == hal::Read::overrun) {
        const std::uint64_t tail = station_->telemetry.tail();
        const std::uint64_t to = tail > next_ ? tail + rt::Station::TelemetryRing::kSize / 4 : next_ + 1;
        lost_ += to - next_;
        next_ = to;
        continue;
      }
      ++next_;
      have_ = true;
    }
    const sim::Snapshot* world = nullptr;
    if (taker_) {
      // The plant publishes before the core does: the snapshot of this tick is there, or it was overrun.
      while (true) {
        if (!have_world_) have_world_ = taker_->next(world_);
        if (!have_world_) break;
        const double t = static_cast<double>(world_.t_ns - world_.start_ns) * 1e-9;
        if (t < sample_.t_s - half_period_s_) {
          have_world_ = false;  // of a tick whose sample is gone
          continue;
        }
        if (t < sample_.t_s + half_period_s_) world = &world_;
        break;
      }
    }
    take(sample_, world);
    if (world != nullptr) have_world_ = false;
    have_ = false;
    ++taken;
  }
  if (taker_ && to_the_end)
    while (taker_->next(world_)) {
    }
  return taken;
}

void Recorder::take(const rt::TelemetrySample& s, const sim::Snapshot* world) {
  measures_.tick(s, world);
  const bool change = rows_ == 0 || s.phase != before_.phase || s.fault != before_.fault ||
                      s.stop != before_.stop || s.estop != before_.estop || s.cell != before_.cell;
  if (change || s.tick % every_ == 0) row(s, world);
  before_ = s;
}

void Recorder::row(const rt::TelemetrySample& s, const sim::Snapshot* world) {
  fmt::basic_memory_buffer<char, 1024> out;
  const auto put = [&out](double v) { fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:.9g},"), v); };
  const auto count = [&out](std::uint64_t v) {
    fmt::format_to(std::back_inserter(out), FMT_COMPILE("{},"), v);
  };
  const auto three = [&put](const double(&v)[3]) { put(v[0]), put(v[1]), put(v[2]); };
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:.6f},{},"), s.t_s, rt::name(s.phase));
  three(s.x_m);
  three(s.v_m_s);
  three(s.tip_m);
  three(s.cmd_m);
  three(s.force_N);
  for (const double v :
       {s.membrane_N, s.cone_N, s.axis_N, s.damping_N, s.guard_N, s.wd_m, s.a_m, s.R_m, s.obs_age_s})
    put(v);
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{},{},"), s.estop, rt::name(s.fault));
  count(s.cell), count(s.alarms), count(s.buttons), count(static_cast<std::uint64_t>(s.stop));
  for (const double v :
       {s.tip_force_N, s.sigma_d_Pa, s.pressure_Pa, s.obs_gap_m, s.stored_energy_J, s.injected_energy_J})
    put(v);
  count(s.injector_open);
  put(s.sensor_N), put(s.vacuum_Pa);
  if (world == nullptr) {
    fmt::format_to(std::back_inserter(out), ",,,,,,,,,,");
  } else {
    const hal::Vec3 tip = world->stage.tip_m;
    put(tip.x()), put(tip.y()), put(tip.z());
    if (world->has_cell != 0) {
      const sim::Truth t = sim::truth_of(sim_, *world);
      put(t.axial_force_N), put(t.gap_m), put(t.wd_m), put(t.a_m);
      fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:d},{:d},{:d},"), t.contact, t.punctured, t.lost);
    } else {
      fmt::format_to(std::back_inserter(out), ",,,,,,,");
    }
  }
  put(s.repulsive_N), put(s.friction_N);
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:.9g}\n"), s.vibration_N);
  if (std::fwrite(out.data(), 1, out.size(), file_.get()) != out.size()) failed_ = true;
  ++rows_;
}

void Recorder::finish() {
  drain(true);
  measures_.finish();
  if (std::fflush(file_.get()) != 0) failed_ = true;
}

}  // namespace punctum::tools
