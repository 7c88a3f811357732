// The drives of a stage on a CAN bus: [cia402] and [[cia402.axis]] of a scene.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include "hal/parameters.hpp"

namespace punctum::cia402 {

inline constexpr int kMaxAxes = 6;
inline constexpr int kMaxNode = 127;

// One drive. A count is the drive's own unit of position; speeds and accelerations are in counts per second.
struct AxisParams {
  int node = 0;
  hal::Vec3 count_m = hal::Vec3::Zero();  // motion of the tip with one count, world frame
  int min_counts = -1'000'000;            // 607D: the drive goes no further
  int max_counts = 1'000'000;
  int following_counts = 2000;           // 6065: further from its set-point it has a fault
  int following_ms = 10;                 // 6066: for so long
  int quick_stop_counts_s2 = 5'000'000;  // 6085
  int homing_method = 37;                // 6098; 35 and 37 move nothing
  int homing_fast_counts_s = 10'000;     // 6099:1, to the switch
  int homing_slow_counts_s = 1'000;      // 6099:2, to its edge
  int homing_counts_s2 = 100'000;        // 609A
  std::uint64_t vendor_id = 0;           // 1018:1; 0 = any
  std::uint64_t product_code = 0;        // 1018:2; 0 = any
};
constexpr auto keys_of(const AxisParams*) {
  constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
  return hal::keys(hal::whole("node", &AxisParams::node, 1, kMaxNode),
                   hal::micro_vector("count_um", &AxisParams::count_m, -100, 100),
                   hal::whole("min_counts", &AxisParams::min_counts, -most, most),
                   hal::whole("max_counts", &AxisParams::max_counts, -most, most),
                   hal::whole("following_counts", &AxisParams::following_counts, 1, most),
                   hal::whole("following_ms", &AxisParams::following_ms, 0, 65535),
                   hal::whole("quick_stop_counts_s2", &AxisParams::quick_stop_counts_s2, 1, most),
                   hal::whole("homing_method", &AxisParams::homing_method, 1, 37),
                   hal::whole("homing_fast_counts_s", &AxisParams::homing_fast_counts_s, 1, most),
                   hal::whole("homing_slow_counts_s", &AxisParams::homing_slow_counts_s, 1, most),
                   hal::whole("homing_counts_s2", &AxisParams::homing_counts_s2, 1, most),
                   hal::whole("vendor_id", &AxisParams::vendor_id, 0, 0xFFFFFFFF),
                   hal::whole("product_code", &AxisParams::product_code, 0, 0xFFFFFFFF));
}

struct CanStageParams {
  std::string interface = "can0";
  double bitrate_kbit = 1000;  // of the interface, for the bus load; `ip link` sets it
  int sync_divisor = 1;        // ticks from SYNC to SYNC
  int master_node = 127;       // whose heartbeat the drives watch
  double heartbeat_s = 0.02;   // of drives and master
  double heartbeat_timeout_s = 0.06;
  // SYNCs in a row after which no node was heard at all: then none of our frames may have passed, and nothing
  // but a stop goes out. More for an adapter that hands on answers late; so many cycles of set-points may be
  // played after a contact that was open. Not 1: a tick that comes early after a late one has sent its SYNC
  // before the answers to the last could be there.
  int silence_cycles = 2;
  bool homing = false;                  // on the first enable after the start, each drive by its method
  hal::Vec3 tip_m = hal::Vec3::Zero();  // where the tip is when every drive stands at zero
  hal::Vec3 needle{-1, 0, 0};   // its axis, out of the tip; no drive turns it, one or two move along it
  int force_node = 0;           // of the force sensor, 0 = none
  double force_count_N = 1e-9;  // per count of 9130:1; negative where tension counts up
  std::array<AxisParams, kMaxAxes> axes{};
  int axis_count = 0;
};
// [cia402]; the force sensor's keys are spread by the same table.
inline constexpr auto kCia402Keys =
    hal::keys(hal::text("interface", &CanStageParams::interface),
              hal::one_of("bitrate_kbit", &CanStageParams::bitrate_kbit, 125, 250, 500, 800, 1000),
              hal::whole("sync_divisor", &CanStageParams::sync_divisor, 1, 64),
              hal::whole("master_node", &CanStageParams::master_node, 1, kMaxNode),
              hal::milli("heartbeat_ms", &CanStageParams::heartbeat_s, 5, 1000),
              hal::milli("heartbeat_timeout_ms", &CanStageParams::heartbeat_timeout_s, 10, 5000),
              hal::whole("silence_cycles", &CanStageParams::silence_cycles, 2, 10),
              hal::flag("homing", &CanStageParams::homing),
              hal::micro_vector("tip_um", &CanStageParams::tip_m, -1e6, 1e6),
              hal::direction("needle", &CanStageParams::needle),
              hal::whole("force_node", &CanStageParams::force_node, 0, kMaxNode),
              hal::micro("force_count_uN", &CanStageParams::force_count_N, -1e3, 1e3));

}  // namespace punctum::cia402
