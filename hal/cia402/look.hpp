// A CAN interface as the kernel describes it: whether a stage could use it. Nothing is sent on the bus, so
// that drives hear nothing; whether they are there shows when the stage is opened.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "hal/cia402/config.hpp"
#include "hal/device_life.hpp"

namespace punctum::cia402 {

struct CanLink {
  std::string name;
  bool can = false;  // else an interface of another kind
  bool up = false;
  std::uint32_t queue = 0;    // frames
  std::string kind;           // of its driver: "can" has a controller, "vcan" is virtual
  std::uint32_t bitrate = 0;  // 0: not known
  std::uint32_t restart_ms = 0;
  bool bus_off = false;
};

// One RTM_NEWLINK message of rtnetlink(7).
[[nodiscard]] std::optional<CanLink> can_link_of(std::span<const std::byte> message);
// The kernel's answer for one interface; none: there is no such interface.
[[nodiscard]] std::optional<CanLink> can_link(const std::string& interface);

[[nodiscard]] hal::Findings look(const CanStageParams& params, const std::optional<CanLink>& link);

// As `ip link` brings it up for this backend.
[[nodiscard]] std::string bring_up(const std::string& interface, double bitrate_kbit);

// Frames that wait when the tick is late: more than a cycle's answers, or ENOBUFS comes in ordinary
// operation.
inline constexpr int kShortestQueue = 64;

}  // namespace punctum::cia402
