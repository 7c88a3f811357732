// Do the samples show a hand? Each sample is compared with the ones before: no hand is faster, turns faster
// or speeds up more than the limits below. A single sample that does is ignored; several end the trust in the
// device until some samples agree with each other again. So garbage at the start, or an origin that has
// moved, does not lock the station out, and whatever passes is bounded by what a hand can do.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"

namespace punctum::rt {

class HandCheck {
 public:
  enum class Is : std::uint8_t {
    good,
    leaps,    // good, but so far from where it was going that what lies between is not believed; and so
              // are those that follow, until some agree and a brief false reading would be over
    begins,   // good, and the first one: it has nothing to do with what was before
    ignored,  // cannot be true
    invalid,  // too many that cannot be true
  };

  HandCheck(double speed_m_s, double encoder_step_m) NONBLOCKING : speed_m_s_(speed_m_s),
                                                                   step_m_(encoder_step_m) {}

  // A new sample, later than the one before.
  [[nodiscard]] Is judge(const hal::HandState& sample) NONBLOCKING {
    if (!possible(sample)) {
      candidate_.agreeing = 0;
      return bad();
    }
    if (const Step step = from(trusted_, sample); trusted_.agreeing > 0 && fits(trusted_, step, sample)) {
      watch_leaps(step, sample);
      advance(trusted_, step, sample);
      suspicion_ = std::max(suspicion_ - 1, 0);
      return leapt_ ? Is::leaps : Is::good;
    }
    if (!invalid_) {
      if (trusted_.agreeing >= kAgreeing) {
        return bad();
      }
      // At the start nothing tells which of two samples is wrong: the later one counts until it is confirmed.
      const bool contradicts = trusted_.agreeing > 0;
      trusted_ = begun_by(sample);
      return contradicts && bad() == Is::invalid ? Is::invalid : Is::begins;
    }
    if (const Step step = from(candidate_, sample);
        candidate_.agreeing > 0 && fits(candidate_, step, sample)) {
      advance(candidate_, step, sample);
    } else {
      candidate_ = begun_by(sample);
    }
    if (candidate_.agreeing < kAgreeing) {
      return Is::invalid;
    }
    trusted_ = candidate_;
    candidate_.agreeing = 0;
    suspicion_ = 0;
    invalid_ = false;
    return Is::begins;
  }

  // The newest good sample has become too old: what comes next has to be confirmed.
  void distrust() NONBLOCKING {
    trusted_.agreeing = 0;
    candidate_.agreeing = 0;
    invalid_ = true;
  }

 private:
  // A handle in a free hand reaches some 100 m/s^2; thrown, or pushed by its own motors at the largest force
  // with no hand on it, 250 m/s^2. Braking is not limited: a handle may hit its stop.
  static constexpr double kAcceleration_m_s2 = 300;
  // A longer interval than 1.5 ms allows so long a way that a false sample on it is no little thing: then
  // what no hand does within 1.5 ms is a leap, and so is a hand that was stopped by as much. A hand that
  // starts back, 40 m/s^2, does not leap at 250 Hz or more.
  static constexpr double kLeap_m = kAcceleration_m_s2 * 1.5e-3 * 1.5e-3;
  static constexpr double kBrief_s = 0.02;        // interference: one period of the mains
  static constexpr double kTurn_rad_s = 50;       // the wrist's fastest turn is half of it
  static constexpr double kTurnNoise_rad = 0.05;  // of the sensors in the handle
  static constexpr double kReach_m = 2;           // from the origin: the largest devices reach one metre
  static constexpr double kUnit = 1e-3;           // a quaternion's length is as near to 1
  // Readings are rounded to the encoder's step, which a second difference sees up to four times; what
  // interference adds is measured, up to the loudest that may pass.
  static constexpr double kRounding_steps = 4;
  // Times the mean deviation; of noise, one sample in some 10^4 deviates by more.
  static constexpr double kDeviations = 4;
  static constexpr double kFirstDeviation_steps = 8;
  static constexpr double kLoudest_steps = 16;
  static constexpr double kDeviation_samples = 64;  // of the mean
  // Three bad samples in a row, or four among thirty, are more than a disturbed line gives now and then.
  static constexpr int kBad = 10;
  static constexpr int kTooBad = 30;
  static constexpr int kAgreeing = 3;  // two may agree by chance, a repeated garbage word

  // Where the hand was, and how it moved.
  struct Track {
    int agreeing = 0;  // samples in it, up to kAgreeing
    std::int64_t sample_ns = 0;
    double between_s = 0;
    hal::Vec3 at_m = hal::Vec3::Zero();
    hal::Vec3 velocity_m_s = hal::Vec3::Zero();
    hal::Quat orientation = hal::Quat::Identity();
    double deviation_m = 0;  // mean distance from where the samples before point to
  };

  // From the newest sample of a track to another one.
  struct Step {
    double dt_s;
    hal::Vec3 gone_m;
    double
        deviation_m;  // from the way that leads on at the last velocity; its beginning is a hand that stands
  };

  [[nodiscard]] static bool possible(const hal::HandState& sample) NONBLOCKING {
    for (const double x_m : {sample.position_m.x(), sample.position_m.y(), sample.position_m.z()}) {
      if (!(std::abs(x_m) <= kReach_m)) {
        return false;
      }
    }
    return std::abs(sample.orientation.norm() - 1) <= kUnit;
  }

  [[nodiscard]] static double seconds(std::int64_t ns) NONBLOCKING { return 1e-9 * static_cast<double>(ns); }

  [[nodiscard]] static Step from(const Track& track, const hal::HandState& sample) NONBLOCKING {
    const double dt_s = seconds(sample.sample_ns - track.sample_ns);
    const hal::Vec3 way_m = track.velocity_m_s * dt_s;
    const hal::Vec3 gone_m = sample.position_m - track.at_m;
    const double length2 = way_m.squaredNorm();
    const double along = length2 > 0 ? std::clamp(gone_m.dot(way_m) / length2, 0.0, 1.0) : 0.0;
    return {dt_s, gone_m, (gone_m - along * way_m).norm()};
  }

  [[nodiscard]] static double sped_up_m(const Track& track, double dt_s) NONBLOCKING {
    return kAcceleration_m_s2 * (track.between_s + dt_s) / 2 * dt_s;
  }

  [[nodiscard]] bool is_leap(const Track& track, const Step& step) const NONBLOCKING {
    return sped_up_m(track, step.dt_s) > kLeap_m &&
           (step.gone_m - step.dt_s * track.velocity_m_s).norm() > kLeap_m + kRounding_steps * step_m_;
  }

  void watch_leaps(const Step& step, const hal::HandState& sample) NONBLOCKING {
    if (is_leap(trusted_, step)) {
      leapt_ = true;
      leapt_ns_ = sample.sample_ns;
      since_leap_ = 0;
      return;
    }
    since_leap_ = std::min(since_leap_ + 1, kAgreeing);
    leapt_ = leapt_ && (since_leap_ < kAgreeing || seconds(sample.sample_ns - leapt_ns_) < kBrief_s);
  }

  [[nodiscard]] bool fits(const Track& track, const Step& step, const hal::HandState& sample) const
      NONBLOCKING {
    if (!(step.dt_s > 0)) {
      return false;
    }
    const double noise_m = kRounding_steps * step_m_ + kDeviations * track.deviation_m;
    const double turned =
        std::sqrt(std::min((sample.orientation.coeffs() - track.orientation.coeffs()).squaredNorm(),
                           (sample.orientation.coeffs() + track.orientation.coeffs()).squaredNorm()));
    return step.gone_m.norm() <= speed_m_s_ * step.dt_s + noise_m &&
           step.deviation_m <= sped_up_m(track, step.dt_s) + noise_m &&
           turned <= 0.5 * (kTurn_rad_s * step.dt_s + kTurnNoise_rad);
  }

  [[nodiscard]] Track begun_by(const hal::HandState& sample) const NONBLOCKING {
    Track track;
    track.agreeing = 1;
    track.sample_ns = sample.sample_ns;
    track.at_m = sample.position_m;
    track.orientation = sample.orientation;
    track.deviation_m = kFirstDeviation_steps * step_m_;
    return track;
  }

  void advance(Track& track, const Step& step, const hal::HandState& sample) const NONBLOCKING {
    const double loudest_m = kLoudest_steps * step_m_;
    const double deviates_m = std::min(step.deviation_m, loudest_m);
    track.deviation_m += (deviates_m - track.deviation_m) / kDeviation_samples;
    track.velocity_m_s = step.gone_m / step.dt_s;
    track.between_s = step.dt_s;
    track.at_m = sample.position_m;
    track.orientation = sample.orientation;
    track.sample_ns = sample.sample_ns;
    track.agreeing = std::min(track.agreeing + 1, kAgreeing);
  }

  [[nodiscard]] Is bad() NONBLOCKING {
    suspicion_ = std::min(suspicion_ + kBad, kTooBad);
    if (suspicion_ >= kTooBad) {
      distrust();
    }
    return invalid_ ? Is::invalid : Is::ignored;
  }

  double speed_m_s_;
  double step_m_;
  Track trusted_;    // what the hand did
  Track candidate_;  // while invalid_: what it may be doing
  int suspicion_ = 0;
  bool leapt_ = false;  // lately
  std::int64_t leapt_ns_ = 0;
  int since_leap_ = 0;  // samples
  bool invalid_ = false;
};

}  // namespace punctum::rt
