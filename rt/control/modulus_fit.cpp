#include "rt/control/modulus_fit.hpp"

#include <algorithm>
#include <cmath>

#include "rt/control/device_inputs.hpp"
#include "rt/forces/ramp.hpp"

namespace punctum::rt {
namespace {

constexpr double kTareTau_s = 0.3;
// Corrections by vision, and so the errors of the depth, are alike for about as long.
constexpr double kWindow_s = 0.1;
constexpr int kLeastEquations = 6;
constexpr double kLeastNoise_N = 1e-9;
constexpr double kLeastDepthSd_m = 1e-9;
// Of the law against the full equations, and of what else is in a cell (its inner membrane): up to 3 % in
// `icsi`.
constexpr double kLawPart = 0.02;

}  // namespace

const ModulusEstimate& ModulusFit::step(const ModulusInput& in) NONBLOCKING {
  if (in.new_cell) {
    begin();
  }
  const double part = low_pass_part(in.dt_s, kSensorTau_s);
  filtered_f_ += part * (in.law.force_N / scene_E_Pa_ - filtered_f_);
  filtered_k_ += part * (in.law.stiffness_N_m / scene_E_Pa_ - filtered_k_);
  if (!in.sensor_fresh) {
    interrupt();
    return estimate_;
  }
  if (in.clear) {
    tare_N_ += low_pass_part(in.dt_s, kTareTau_s) * (in.sensor_N - tare_N_);
  }
  if (!in.pressing || !in.law.valid) {
    interrupt();
    return estimate_;
  }
  window_.f += in.dt_s * filtered_f_;
  window_.k += in.dt_s * filtered_k_;
  window_.y += in.dt_s * (in.sensor_N - tare_N_);
  window_.lasts_s += in.dt_s;
  if (window_.lasts_s >= kWindow_s) {
    count_oldest(std::max(in.depth_sd_m, kLeastDepthSd_m));
  }
  return estimate_;
}

void ModulusFit::interrupt() NONBLOCKING {
  window_ = {};
  waiting_ = {};
}

void ModulusFit::begin() NONBLOCKING {
  interrupt();
  sums_ = {};
  noise_N2_ = 0;
  estimate_ = {};
}

// The window that is full waits in its place.
void ModulusFit::count_oldest(double depth_sd_m) NONBLOCKING {
  const Window full = window_;
  window_ = {};
  if (waiting_.count < waiting_.windows.size()) {
    waiting_.windows[waiting_.count++] = full;
    return;
  }
  const Window oldest = waiting_.windows.front();
  std::copy(waiting_.windows.begin() + 1, waiting_.windows.end(), waiting_.windows.begin());
  waiting_.windows.back() = full;

  const double f = oldest.f / oldest.lasts_s, k = oldest.k / oldest.lasts_s, y = oldest.y / oldest.lasts_s;
  sums_.ff += f * f;
  sums_.fk += f * k;
  sums_.kk += k * k;
  sums_.fy += f * y;
  sums_.ky += k * y;
  sums_.yy += y * y;
  if (++sums_.equations >= kLeastEquations) {
    solve(depth_sd_m);
  }
}

// The equations and the expectation of delta, each by the inverse of its variance.
void ModulusFit::solve(double depth_sd_m) NONBLOCKING {
  const Sums& s = sums_;
  const double expected = (estimate_.E_Pa > 0 ? estimate_.E_Pa : scene_E_Pa_) * depth_sd_m;
  noise_N2_ = std::max(noise_N2_, kLeastNoise_N * kLeastNoise_N);
  const double kk = s.kk + noise_N2_ / (expected * expected);
  const double determinant = s.ff * kk - s.fk * s.fk;
  const double E_Pa = (kk * s.fy - s.fk * s.ky) / determinant;
  const double E_delta = (s.ff * s.ky - s.fk * s.fy) / determinant;
  const double rest_N2 = s.yy - 2 * (E_Pa * s.fy + E_delta * s.ky) + E_Pa * E_Pa * s.ff +
                         2 * E_Pa * E_delta * s.fk + E_delta * E_delta * s.kk;
  noise_N2_ = std::max(rest_N2 / (s.equations - 2), kLeastNoise_N * kLeastNoise_N);
  const double variance = noise_N2_ * kk / determinant + kLawPart * kLawPart * E_Pa * E_Pa;
  estimate_ = {};
  if (E_Pa > 0 && std::isfinite(variance)) {
    estimate_ = {E_Pa, std::sqrt(variance)};
  }
}

}  // namespace punctum::rt
