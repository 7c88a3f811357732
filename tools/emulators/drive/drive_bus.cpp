#include "tools/emulators/drive/drive_bus.hpp"

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace punctum::emulator {
namespace {

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000 + t.tv_nsec;
}

}  // namespace

std::string check_nodes(const std::vector<int>& nodes) {
  for (auto it = nodes.begin(); it != nodes.end(); ++it) {
    if (std::find(nodes.begin(), it, *it) != it) {
      return "node " + std::to_string(*it) + " is given twice, allowed: each number once";
    }
  }
  return {};
}

DriveBus::~DriveBus() {
  if (socket_ >= 0) {
    close(socket_);
  }
}

std::string DriveBus::open(const std::string& interface) {
  const auto failed = [&](const char* what) { return interface + ": " + what + ": " + std::strerror(errno); };
  socket_ = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
  if (socket_ < 0) {
    return failed("this kernel gives no CAN socket");
  }
  ifreq request{};
  if (interface.size() >= sizeof(request.ifr_name)) {
    errno = ENODEV;
    return failed("is no interface");
  }
  interface.copy(request.ifr_name, interface.size());
  if (ioctl(socket_, SIOCGIFINDEX, &request) != 0) {
    return failed("there is no such interface");
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = request.ifr_ifindex;
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return failed("cannot be bound");
  }
  return {};
}

bool DriveBus::serve() {
  can_frame frame{};
  while (read(socket_, &frame, sizeof(frame)) == static_cast<ssize_t>(sizeof(frame))) {
    for (const auto& drive : drives_) {
      drive->on_frame(frame, now_ns());
    }
  }
  for (const auto& drive : drives_) {
    for (const can_frame& out : drive->step(now_ns())) {
      if (write(socket_, &out, sizeof(out)) < 0 && errno != ENOBUFS && errno != EAGAIN) {
        return false;
      }
    }
  }
  return true;
}

std::string DriveBus::command(const std::string& line) {
  char* end = nullptr;
  const long node = std::strtol(line.c_str(), &end, 10);
  const bool for_one = end != line.c_str() && std::isspace(static_cast<unsigned char>(*end)) != 0;
  const std::string rest = for_one ? line.substr(static_cast<std::size_t>(end - line.c_str())) : line;
  bool found = false;
  for (const auto& drive : drives_) {
    if (for_one && drive->node() != node) {
      continue;
    }
    found = true;
    if (std::string problem = drive->command(rest); !problem.empty()) {
      return problem;
    }
  }
  return found ? std::string{} : "\"" + line + "\": there is no such node";
}

}  // namespace punctum::emulator
