// The elastic modulus of this cell's membrane, from the force sensor while the needle presses.
//
// The law is proportional to E, so every tenth of a second gives one equation of a linear fit of two
// unknowns,
//
//   F_sensor - tare = E f(w) + E delta f'(w),
//
// f: the law's force per modulus at the depth that the core has. delta: the error of that depth as far as it
// stays; also what a lag of the sensor does at a steady speed. It is expected to be 0 with the depth's own
// standard deviation. An equation counts once it is older than a puncture that is not told yet. An inner
// membrane that is dented with the outer one counts as a part of it. The core renders the scene's modulus,
// never this one: it is for the operator to read.
#pragma once

#include <array>

#include "hal/realtime.hpp"
#include "rt/forces/membrane.hpp"

namespace punctum::rt {

struct ModulusInput {
  double dt_s = 0;
  double sensor_N = 0;  // low-pass of kSensorTau_s
  bool sensor_fresh = false;
  bool clear = false;     // the needle touches nothing: what the sensor tells is its tare
  bool pressing = false;  // the needle presses on a membrane that is whole
  bool new_cell = false;
  const MembraneState& law;  // at the scene's modulus
  double depth_sd_m = 0;
};

struct ModulusEstimate {
  double E_Pa = 0;   // 0: not known
  double sd_Pa = 0;  // standard deviation, the law's own included
};

// Real-time safe. One for each cell: a new one begins anew.
class ModulusFit {
 public:
  explicit ModulusFit(double scene_E_Pa) NONBLOCKING : scene_E_Pa_(scene_E_Pa) {}

  const ModulusEstimate& step(const ModulusInput& in) NONBLOCKING;

 private:
  // Sums over the equations: of E, of E delta, and of what both shall give.
  struct Sums {
    double ff = 0, fk = 0, kk = 0, fy = 0, ky = 0, yy = 0;
    int equations = 0;
  };
  // Means of a tenth of a second; f and k have the sensor's low-pass.
  struct Window {
    double f = 0, k = 0, y = 0;
    double lasts_s = 0;
  };
  // Not counted yet, the oldest first.
  struct Waiting {
    std::array<Window, 3> windows{};
    std::size_t count = 0;
  };
  void begin() NONBLOCKING;
  void interrupt() NONBLOCKING;
  void count_oldest(double depth_sd_m) NONBLOCKING;
  void solve(double depth_sd_m) NONBLOCKING;

  double scene_E_Pa_;
  double tare_N_ = 0;
  double filtered_f_ = 0, filtered_k_ = 0;  // N/Pa, N/(m Pa)
  Window window_;
  Waiting waiting_;
  Sums sums_;
  double noise_N2_ = 0;  // variance of an equation's rest
  ModulusEstimate estimate_;
};

}  // namespace punctum::rt
