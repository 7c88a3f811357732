// What vision found in one frame. Plain data, lives in shared memory.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"

namespace punctum::rt {

struct Observation {
  enum Flag : std::uint32_t {
    holder_ok = 1U << 0,
    tip_ok = 1U << 1,
    outer_ok = 1U << 2,
    inner_ok = 1U << 3,
    contact = 1U << 4,  // needle and cell have merged into one component
    // The outer membrane has given way: latched by vision from its reversal until the needle is clear.
    punctured = 1U << 5,
    // So has the inner one. Never where there is none, or where it is not followed.
    inner_punctured = 1U << 6,
  };

  std::uint64_t frame = 0;       // camera sequence number
  std::int64_t exposure_ns = 0;  // station clock
  std::uint32_t flags = 0;
  std::uint32_t reserved = 0;

  // Metres, microscope frame (see hal/devices.hpp); z is 0: one picture does not tell depth.
  double tip_m[3] = {};               // needle tip as seen
  double axis[3] = {-1, 0, 0};        // needle direction as seen, unit
  double holder_m[3] = {};            // holding pipette: centre of its mouth
  double holder_score = 0;            // eq. 1, -1 .. 1
  double centre_m[3] = {};            // undeformed cell
  double R_m = 0;                     // radius of the undeformed outer membrane
  double R_inner_m = 0;               // of the inner one, 0 if unknown
  double entry_m[3] = {};             // where the needle's axis meets the undeformed outer membrane
  double gap_m = 0;                   // along the axis from tip to entry_m: > 0 before contact, < 0 past it
  double wd_m = 0;                    // depth of the dimple from the undeformed membrane, 0 without contact
  double a_m = 0;                     // half-width of the dimple where its depth is 1 % of w_d
  double membrane_velocity_m_s = 0;   // of the contact points, along the axis; < 0 = recoil
  double contact_point_m[2][3] = {};  // the two contact points on the pipette's edges
  // Standard deviations, as vision estimates them; 0 where the value is not known.
  double noise_m = 0;  // of gap_m
  double wd_sd_m = 0;
  double a_sd_m = 0;
  double R_sd_m = 0;
  std::uint64_t total_us = 0;  // processing time; never used by the core

  [[nodiscard]] bool has(Flag f) const NONBLOCKING { return (flags & f) != 0; }
};

}  // namespace punctum::rt
