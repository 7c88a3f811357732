#include "tools/punctum/kernel_watchdog.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/watchdog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace punctum::tools {

tl::expected<void, std::string> KernelWatchdog::arm(const WatchdogParams& params) {
  const auto refused = [&](const std::string& why) {
    disarm();
    return tl::unexpected(fmt::format("watchdog: {}: {}", params.path, why));
  };
  file_ = open(params.path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file_ < 0) {
    return refused(
        fmt::format("{}{}", std::strerror(errno),
                    errno == EBUSY ? ": somebody else feeds it (systemd: RuntimeWatchdogSec)" : ""));
  }
  watchdog_info about{};
  if (ioctl(file_, WDIOC_GETSUPPORT, &about) != 0) {
    return refused("is no watchdog, allowed: such as /dev/watchdog");
  }
  if ((about.options & WDIOF_MAGICCLOSE) == 0) {
    return refused("could not be disarmed at the end of a run (its driver's option nowayout)");
  }
  int timeout_s = params.timeout_s;
  if ((about.options & WDIOF_SETTIMEOUT) == 0 || ioctl(file_, WDIOC_SETTIMEOUT, &timeout_s) != 0 ||
      timeout_s != params.timeout_s) {
    int has_s = 0;
    (void)ioctl(file_, WDIOC_GETTIMEOUT, &has_s);
    return refused(
        fmt::format("does not take watchdog.timeout_s = {}; it has {} now", params.timeout_s, has_s));
  }
  timeout_s_ = timeout_s;
  return {};
}

void KernelWatchdog::feed(std::uint64_t ticks, double now_s) {
  if (file_ < 0 || now_s < next_s_ || (ticks == ticks_ && ticks != 0)) {
    return;
  }
  ticks_ = ticks;
  next_s_ = now_s + timeout_s_ / 10;
  (void)ioctl(file_, WDIOC_KEEPALIVE, nullptr);
}

void KernelWatchdog::disarm() {
  if (file_ < 0) {
    return;
  }
  (void)!write(file_, "V", 1);
  close(file_);
  file_ = -1;
}

}  // namespace punctum::tools
