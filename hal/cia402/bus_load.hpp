// How much of a CAN bus the cyclic traffic takes, by the longest frames that bit stuffing can make.
#pragma once

#include <cmath>

namespace punctum::cia402 {

// A data frame with 11-bit identifier and `bytes` of data, with the pause behind it: 34 + 8 bytes are subject
// to stuffing, and after the first five equal bits every fourth bit can bring another one (ISO 11898-1).
[[nodiscard]] constexpr int longest_frame_bits(int bytes) {
  const int stuffed = 34 + 8 * bytes;
  return 13 + stuffed + (stuffed - 1) / 4;
}

struct BusLoad {
  double cyclic_s = 0;  // SYNC and the PDOs of one cycle
  double spare_s = 0;   // and beside them one emergency message and one heartbeat
  double part = 0;      // of all time, with every heartbeat
  // The cycle of the SYNC is over before the next begins, also when a drive reports an error in it.
  [[nodiscard]] bool fits(double cycle_s) const { return cyclic_s + spare_s <= cycle_s && part <= 1; }
};

// force_sensor: one more node, with a PDO of four bytes.
[[nodiscard]] inline BusLoad bus_load(int axes, bool force_sensor, double bit_s, double cycle_s,
                                      double heartbeat_s) {
  constexpr int kSyncBytes = 0, kDrivePdoBytes = 6, kForceBytes = 4, kEmergencyBytes = 8, kHeartbeatBytes = 1;
  const int bits = longest_frame_bits(kSyncBytes) + 2 * axes * longest_frame_bits(kDrivePdoBytes) +
                   (force_sensor ? longest_frame_bits(kForceBytes) : 0);
  const int nodes = axes + (force_sensor ? 1 : 0) + 1;  // with the master
  BusLoad load;
  load.cyclic_s = bits * bit_s;
  load.spare_s = (longest_frame_bits(kEmergencyBytes) + longest_frame_bits(kHeartbeatBytes)) * bit_s;
  load.part = load.cyclic_s / cycle_s + nodes * longest_frame_bits(kHeartbeatBytes) * bit_s / heartbeat_s;
  return load;
}

// The interpolation time period 60C2: mantissa * 10^exponent seconds, or mantissa 0 where no byte can say it.
struct InterpolationPeriod {
  int mantissa = 0;
  int exponent = 0;
};
[[nodiscard]] inline InterpolationPeriod interpolation_period(double cycle_s) {
  for (int exponent = -3; exponent >= -6; --exponent) {
    const double mantissa = cycle_s * std::pow(10, -exponent);
    const double whole = std::round(mantissa);
    if (whole >= 1 && whole <= 255 && std::abs(mantissa - whole) < 1e-6 * whole) {
      return {static_cast<int>(whole), exponent};
    }
  }
  return {};
}

}  // namespace punctum::cia402
