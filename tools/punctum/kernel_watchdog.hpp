// The machine's hardware watchdog, through the kernel (Documentation/watchdog/watchdog-api.rst): unless it is
// fed in time, the machine restarts. It is for what kills the parent or the kernel; of a core that hangs the
// parent takes care, and the relay of the heartbeat before everybody.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "tools/scene/scene.hpp"

namespace punctum::tools {

// Opening a watchdog arms it, so whether it could be disarmed again is asked of sysfs (/sys, or a test's own
// folder) before.
//
// The folder of a watchdog, such as /sys/class/watchdog/watchdog0; none: the file is no watchdog.
[[nodiscard]] std::optional<std::filesystem::path> watchdog_folder(const std::filesystem::path& device,
                                                                   const std::filesystem::path& sysfs);
// Why a watchdog of this folder could not be disarmed at the end of a run, or is not known to; empty: it
// could.
[[nodiscard]] std::string why_not_disarmed(const std::filesystem::path& folder);
// One line says why it must not be opened.
[[nodiscard]] tl::expected<void, std::string> may_be_armed(const std::filesystem::path& device,
                                                           const std::filesystem::path& sysfs);

class KernelWatchdog {
 public:
  KernelWatchdog() = default;
  KernelWatchdog(const KernelWatchdog&) = delete;
  KernelWatchdog& operator=(const KernelWatchdog&) = delete;
  ~KernelWatchdog() { disarm(); }

  // Armed from here on. One line says why not; one that could not be disarmed again is not armed.
  [[nodiscard]] tl::expected<void, std::string> arm(const WatchdogParams& params,
                                                    const std::filesystem::path& sysfs = "/sys");
  // Feeds it if `ticks` have gone on since the last call, at most ten times in its time-out.
  void feed(std::uint64_t ticks, double now_s);
  void disarm();

 private:
  int file_ = -1;
  double timeout_s_ = 0, next_s_ = 0;
  std::uint64_t ticks_ = 0;
};

}  // namespace punctum::tools
