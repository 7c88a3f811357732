#include "tools/shared/sample_row.hpp"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <iterator>

#include "rt/forces/list.hpp"

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

}  // namespace

std::string sample_columns() {
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

void write_sample_row(const rt::TelemetrySample& s, const RowTruth* truth, std::string& out) {
  out.clear();
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
  if (truth == nullptr) {
    out += ",,,,,,,,,,";
  } else {
    three(truth->tip_m);
    if (truth->cell) {
      for (const double v : {truth->axial_force_N, truth->gap_m, truth->wd_m, truth->a_m}) {
        put(v);
      }
      fmt::format_to(std::back_inserter(out), FMT_COMPILE("{:d},{:d},{:d},"), truth->contact,
                     truth->punctured, truth->lost);
    } else {
      out += ",,,,,,,";
    }
  }
  for (std::size_t i = kFirstEffects; i < rt::effect_count; ++i) {
    put(s.effect_N[i]);
  }
  for (const double v :
       {s.wd_sd_m, s.R_sd_m, s.tip_force_sd_N, s.obs_a_m, s.obs_a_sd_m, s.E_fit_Pa, s.E_fit_sd_Pa}) {
    put(v);
  }
  out.back() = '\n';  // in place of the last comma
}

}  // namespace punctum::tools
