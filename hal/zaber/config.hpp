// A manipulator of three axes behind a serial line that speaks the Zaber ASCII protocol: table [zaber].
#pragma once

#include <array>
#include <string>

#include "hal/parameters.hpp"

namespace punctum::zaber {

inline constexpr int kAxes = 3;  // x, y and z of the positioner's own frame

struct AxisParams {
  int device = 1;                    // number of the device in the chain
  int axis = 1;                      // of its axes
  double microstep_m = 0.047625e-6;  // negative where the device counts the other way
};
constexpr auto keys_of(const AxisParams*) {
  return hal::keys(hal::whole("device", &AxisParams::device, 1, 99),
                   hal::whole("axis", &AxisParams::axis, 1, 9),
                   hal::micro("microstep_um", &AxisParams::microstep_m, -100, 100));
}

struct ZaberParams {
  std::string port = "/dev/ttyUSB0";
  double answer_s = 0.2;  // a device that is silent for longer does not answer
  hal::Vec3 park_m = hal::Vec3::Zero();
  std::array<AxisParams, kAxes> axes{};
  int axis_count = 0;
};
// [zaber]; [[zaber.axis]] are x, y and z in this order.
inline constexpr auto kZaberKeys = hal::keys(hal::text("port", &ZaberParams::port),
                                             hal::milli("answer_ms", &ZaberParams::answer_s, 10, 5000),
                                             hal::micro_vector("park_um", &ZaberParams::park_m, -1e6, 1e6));

}  // namespace punctum::zaber
