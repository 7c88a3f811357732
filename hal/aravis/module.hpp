// What a program that loads this backend while it runs must know of it: no header of the library's.
#pragma once

#include <string>
#include <vector>

#include "hal/aravis/config.hpp"
#include "hal/live_camera.hpp"

namespace punctum::aravis {

inline constexpr const char* kModule = "punctum_aravis.so";
inline constexpr const char* kNotInstalled =
    "not part of this installation: it is built where libaravis-dev is installed";
inline constexpr const char* kMakeCamera = "punctum_make_aravis_camera";
inline constexpr const char* kListNetworkCameras = "punctum_list_network_cameras";

// The caller owns what it makes. clock: the station's, CLOCK_MONOTONIC.
using MakeCamera = hal::LiveCamera* (*)(const AravisParams& params, const hal::CameraSettings& settings,
                                        const hal::Clock& clock);

struct NetworkCamera {
  std::string name;  // as aravis.name says it
  std::string maker, model, serial, address;
};
// Asks for GigE Vision cameras in every network that this machine is on, and waits a second for their
// answers. Opens none and leaves alone who uses one. Cameras behind a router are not asked.
using ListNetworkCameras = void (*)(std::vector<NetworkCamera>& out);

}  // namespace punctum::aravis

extern "C" void punctum_list_network_cameras(std::vector<punctum::aravis::NetworkCamera>& out);
extern "C" punctum::hal::LiveCamera* punctum_make_aravis_camera(const punctum::aravis::AravisParams& params,
                                                                const punctum::hal::CameraSettings& settings,
                                                                const punctum::hal::Clock& clock);
