// What a program that loads this backend while it runs must know of it: no header of the library's.
#pragma once

#include "hal/aravis/config.hpp"
#include "hal/live_camera.hpp"

namespace punctum::aravis {

inline constexpr const char* kModule = "punctum_aravis.so";
inline constexpr const char* kMakeCamera = "punctum_make_aravis_camera";

// The caller owns what it makes. clock: the station's, CLOCK_MONOTONIC.
using MakeCamera = hal::LiveCamera* (*)(const AravisParams& params, const hal::CameraSettings& settings,
                                        const hal::Clock& clock);

}  // namespace punctum::aravis

extern "C" punctum::hal::LiveCamera* punctum_make_aravis_camera(const punctum::aravis::AravisParams& params,
                                                                const punctum::hal::CameraSettings& settings,
                                                                const punctum::hal::Clock& clock);
