#include "tools/punctum/kernel_watchdog.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/watchdog.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace punctum::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNoWatchdog = "is no watchdog, allowed: such as /dev/watchdog";
// The number of /dev/watchdog: Documentation/admin-guide/devices.txt.
constexpr unsigned kMiscMajor = 10, kWatchdogMinor = 130;

std::string word_in(const fs::path& file) {
  std::ifstream in(file);
  std::string word;
  in >> word;
  return word;
}

}  // namespace

std::optional<fs::path> watchdog_folder(const fs::path& device, const fs::path& sysfs) {
  struct stat about{};
  if (stat(device.c_str(), &about) != 0 || !S_ISCHR(about.st_mode)) {
    return std::nullopt;
  }
  const fs::path all = sysfs / "class" / "watchdog";
  // The old name of the first one has a number of its own.
  if (major(about.st_rdev) == kMiscMajor && minor(about.st_rdev) == kWatchdogMinor) {
    return all / "watchdog0";
  }
  const std::string number = fmt::format("{}:{}", major(about.st_rdev), minor(about.st_rdev));
  std::error_code ec;
  for (auto it = fs::directory_iterator(all, ec); !ec && it != fs::directory_iterator(); it.increment(ec)) {
    if (word_in(it->path() / "dev") == number) {
      return it->path();
    }
  }
  return std::nullopt;
}

std::string why_not_disarmed(const fs::path& folder) {
  const std::string nowayout = word_in(folder / "nowayout");
  if (nowayout == "0") {
    return "";
  }
  return nowayout.empty()
             ? fmt::format(
                   "nobody knows whether it could be disarmed at the end of a run: {} is missing, allowed: a "
                   "watchdog whose driver and kernel tell it (CONFIG_WATCHDOG_SYSFS)",
                   (folder / "nowayout").string())
             : "could not be disarmed at the end of a run (its driver's option nowayout), allowed: with "
               "nowayout=0";
}

tl::expected<void, std::string> may_be_armed(const fs::path& device, const fs::path& sysfs) {
  struct stat about{};
  if (stat(device.c_str(), &about) != 0) {
    return tl::unexpected<std::string>(std::strerror(errno));
  }
  const auto folder = watchdog_folder(device, sysfs);
  if (!folder) {
    return tl::unexpected<std::string>(kNoWatchdog);
  }
  if (std::string why = why_not_disarmed(*folder); !why.empty()) {
    return tl::unexpected(std::move(why));
  }
  return {};
}

tl::expected<void, std::string> KernelWatchdog::arm(const WatchdogParams& params, const fs::path& sysfs) {
  const auto refused = [&](const std::string& why) {
    disarm();
    return tl::unexpected(fmt::format("watchdog: {}: {}", params.path, why));
  };
  if (const auto may = may_be_armed(params.path, sysfs); !may) {
    return refused(may.error());
  }
  file_ = open(params.path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file_ < 0) {
    return refused(
        fmt::format("{}{}", std::strerror(errno),
                    errno == EBUSY ? ": somebody else feeds it (systemd: RuntimeWatchdogSec)" : ""));
  }
  watchdog_info about{};
  if (ioctl(file_, WDIOC_GETSUPPORT, &about) != 0) {
    return refused(kNoWatchdog);
  }
  if ((about.options & WDIOF_MAGICCLOSE) == 0) {
    return refused("would be disarmed when the program dies (its driver knows no magic close)");
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
