// Motions of a hand whose position, velocity and device force are known in closed form, and their encoder
// readings.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string_view>
#include <vector>

#include "hal/devices.hpp"

namespace punctum::report {

enum class KnownMotion : std::uint8_t {
  approach,   // minimum-jerk strokes with peaks of 0.2, 1, 5, 20 and 50 mm/s, and rests between
  tremor,     // eight lines in 8 .. 12 Hz, 0.25 mm rms
  work,       // the sum of both: a hand at work
  hold,       // still between two counts, so that the encoder flickers
  reach,      // 0.1 m with a peak of 0.3 m/s
  impact,     // 0.1 m/s into a wall of 800 N/m that the device renders, and back; 75 g
  grip,       // held still while the device pushes with 1 N, on and off
  slow_sine,  // 5 mm at 1 Hz
  fast_sine,  // 5 mm at 4 Hz
};
struct NamedMotion {
  KnownMotion motion;
  std::string_view name;
};
inline constexpr std::array kMotions{
    NamedMotion{KnownMotion::approach, "approach"}, NamedMotion{KnownMotion::tremor, "tremor"},
    NamedMotion{KnownMotion::work, "work"},         NamedMotion{KnownMotion::hold, "hold"},
    NamedMotion{KnownMotion::reach, "reach"},       NamedMotion{KnownMotion::impact, "impact"},
    NamedMotion{KnownMotion::grip, "grip"}};

struct HandTruth {
  double position_m = 0, velocity_m_s = 0, force_N = 0;
};

class HandMotion {
 public:
  // One axis. Another seed gives another hand.
  HandMotion(KnownMotion motion, std::uint64_t seed) : motion_(motion) {
    std::mt19937_64 random(seed);
    const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    start_m_ = 0.02 * (uniform() - 0.5);
    start_s_ = 0.1 + 0.02 * uniform();
    for (std::size_t i = 0; i < tremor_.size(); ++i) {
      tremor_[i] = {2 * kPi * (8 + 4 * (static_cast<double>(i) + uniform()) / kLines), 2 * kPi * uniform()};
    }
  }

  [[nodiscard]] double seconds() const {
    switch (motion_) {
      case KnownMotion::approach:
      case KnownMotion::work:
        return 8;
      case KnownMotion::reach:
        return 0.8;
      case KnownMotion::impact:
        return 0.3;
      default:
        return 4;
    }
  }

  [[nodiscard]] HandTruth at(double t) const {
    switch (motion_) {
      case KnownMotion::approach:
        return strokes(t);
      case KnownMotion::tremor:
        return trembling(t);
      case KnownMotion::work: {
        const HandTruth a = strokes(t), b = trembling(t);
        return {a.position_m + b.position_m, a.velocity_m_s + b.velocity_m_s, 0};
      }
      case KnownMotion::hold:
        return {start_m_, 0, 0};
      case KnownMotion::reach:
        return stroke(t - start_s_, 0.1, 0.3);
      case KnownMotion::impact:
        return bounce(t - start_s_);
      case KnownMotion::grip:
        return {start_m_, 0, std::fmod(t, 0.5) < 0.25 ? 0.0 : 1.0};
      case KnownMotion::slow_sine:
        return sine(t, 1);
      case KnownMotion::fast_sine:
        return sine(t, 4);
    }
    return {};
  }

 private:
  static constexpr double kPi = std::numbers::pi;
  static constexpr int kLines = 8;
  struct Line {
    double omega = 0, phase = 0;
  };

  [[nodiscard]] HandTruth stroke(double t, double length_m, double peak_m_s) const {
    const double T = 1.875 * length_m / peak_m_s;
    const double u = std::fmin(std::fmax(t / T, 0), 1);
    return {start_m_ + length_m * u * u * u * (10 + u * (-15 + 6 * u)),
            length_m / T * 30 * u * u * (1 - u) * (1 - u), 0};
  }
  [[nodiscard]] HandTruth strokes(double t) const {
    constexpr double kRest_s = 0.1;
    constexpr std::array<double, 5> peak{0.2e-3, 1e-3, 5e-3, 20e-3, 50e-3};
    constexpr std::array<double, 5> length{0.2e-3, 1e-3, 4e-3, 12e-3, 25e-3};
    HandTruth truth;
    double begun = start_s_, before = 0;
    for (std::size_t i = 0; i < peak.size(); ++i) {
      truth = stroke(t - begun, length[i], peak[i]);
      truth.position_m += before;
      begun += 1.875 * length[i] / peak[i] + kRest_s;
      before += length[i];
      if (t < begun) {
        break;
      }
    }
    return truth;
  }
  [[nodiscard]] HandTruth trembling(double t) const {
    const double amplitude = 0.25e-3 * std::sqrt(2.0 / kLines);
    HandTruth truth;
    for (const Line& line : tremor_) {
      truth.position_m += amplitude * std::sin(line.omega * t + line.phase);
      truth.velocity_m_s += amplitude * line.omega * std::cos(line.omega * t + line.phase);
    }
    return truth;
  }
  [[nodiscard]] HandTruth bounce(double t) const {
    constexpr double v = 0.1, K = 800, m = 0.075, before = 0.05;
    const double omega = std::sqrt(K / m);
    const double inside = t - before;
    if (inside < 0) {
      return {start_m_ + v * inside, v, 0};
    }
    if (omega * inside > kPi) {
      return {start_m_ - v * (inside - kPi / omega), -v, 0};
    }
    const double depth = v / omega * std::sin(omega * inside);
    return {start_m_ + depth, v * std::cos(omega * inside), -K * depth};
  }
  [[nodiscard]] HandTruth sine(double t, double frequency_Hz) const {
    const double omega = 2 * kPi * frequency_Hz;
    return {5e-3 * std::sin(omega * t), 5e-3 * omega * std::cos(omega * t), 0};
  }

  KnownMotion motion_;
  double start_m_ = 0, start_s_ = 0;
  std::array<Line, kLines> tremor_{};
};

struct EncoderSampling {
  double rate_Hz = 1000;
  double step_m = 0.03e-3;
  bool uneven = false;  // ticks wake up to some 10 us late, and one in 200 is 1 .. 4 periods late
};

// What a program reads, tick by tick, and the truth.
struct EncoderRecord {
  std::vector<hal::Vec3> position_m, velocity_m_s, force_N;
  std::vector<double> dt_s;
};

// Three axes with three different hands.
inline EncoderRecord record(KnownMotion motion, const EncoderSampling& sampling, std::uint64_t seed = 1) {
  const std::array hands{HandMotion(motion, 3 * seed), HandMotion(motion, 3 * seed + 1),
                         HandMotion(motion, 3 * seed + 2)};
  std::mt19937_64 random(seed + 1000);
  std::normal_distribution<double> gaussian;
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const double T = 1 / sampling.rate_Hz, d = sampling.step_m;
  const auto ticks = static_cast<std::int64_t>(hands[0].seconds() * sampling.rate_Hz);
  EncoderRecord out;
  double last = -T;
  for (std::int64_t k = 0; k < ticks; ++k) {
    if (sampling.uneven && uniform() < 0.005) {
      k += 1 + static_cast<std::int64_t>(4 * uniform());
    }
    const double t = static_cast<double>(k) * T + (sampling.uneven ? 10e-6 * std::abs(gaussian(random)) : 0);
    hal::Vec3 x, v, f;
    for (Eigen::Index i = 0; i < 3; ++i) {
      HandTruth truth = hands[static_cast<std::size_t>(i)].at(t);
      v[i] = truth.velocity_m_s;
      f[i] = truth.force_N;
      if (motion == KnownMotion::hold) {
        truth.position_m = (std::floor(truth.position_m / d) + 0.5 + 0.05 * gaussian(random)) * d;
      }
      x[i] = d * std::floor(truth.position_m / d + 0.5);
    }
    out.position_m.push_back(x);
    out.velocity_m_s.push_back(v);
    out.force_N.push_back(f);
    out.dt_s.push_back(t - last);
    last = t;
  }
  return out;
}

inline constexpr double kSettled_s = 0.08;  // at the start: not part of any error

// RMS over axes and time; step(k) is the estimate at sample k.
template <class Step>
double rms_error_m_s(const EncoderRecord& samples, Step step) {
  double sum = 0, t = 0;
  std::int64_t count = 0;
  for (std::size_t k = 0; k < samples.position_m.size(); ++k) {
    const hal::Vec3 estimate = step(k);
    t += samples.dt_s[k];
    if (t < kSettled_s) {
      continue;
    }
    sum += (estimate - samples.velocity_m_s[k]).squaredNorm();
    count += 3;
  }
  return std::sqrt(sum / static_cast<double>(count));
}

}  // namespace punctum::report
