// systemd, where it has started this program (a unit with Type=notify): it is told when the station runs and
// when it ends, and its watchdog (WatchdogSec=) is fed while the core ticks. The protocol is sd_notify(3):
// datagrams to $NOTIFY_SOCKET. Started by anybody else, nothing is said.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace punctum::tools {

class ServiceManager {
 public:
  // Takes NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID out of the environment: they are not for children.
  ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;
  ~ServiceManager();

  // Once per round of the parent. Says READY=1 with the first ticks; then WATCHDOG=1 if `ticks` have gone on
  // since the last call, four times in WatchdogSec at most: more would keep systemd busy.
  void ticks(std::uint64_t ticks, double now_s);
  // What follows, the report, needs no feeding.
  void stopping();

 private:
  bool say(std::string_view state) const;

  int socket_ = -1;
  std::string address_;      // a path, or a name behind a zero byte
  double feed_every_s_ = 0;  // 0: no watchdog
  double next_s_ = 0;
  std::uint64_t ticks_ = 0;
  bool ready_ = false;
};

}  // namespace punctum::tools
