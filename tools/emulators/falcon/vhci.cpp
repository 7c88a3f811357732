#include "tools/emulators/falcon/vhci.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <sstream>
#include <utility>
#include <vector>

namespace punctum::emulator {
namespace {

using Unexpected = tl::unexpected<std::string>;

constexpr const char* kController = "/sys/devices/platform/vhci_hcd.0";
constexpr int kFullSpeed = 2, kFreePort = 4, kDeviceNumber = 0x10001;

// Ports for full and high speed; a port is one line: hub, number, state, ...
std::vector<int> free_ports() {
  std::ifstream status(std::string(kController) + "/status");
  std::vector<int> ports;
  for (std::string line; std::getline(status, line);) {
    std::istringstream words(line);
    std::string hub;
    int port = 0, state = 0;
    if (words >> hub >> port >> state && hub == "hs" && state == kFreePort) {
      ports.push_back(port);
    }
  }
  return ports;
}

}  // namespace

std::int64_t monotonic_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000 + t.tv_nsec;
}

tl::expected<VhciPort, std::string> VhciPort::plug_in() {
  const int attach = ::open((std::string(kController) + "/attach").c_str(), O_WRONLY | O_CLOEXEC);
  if (attach < 0) {
    return Unexpected(errno == ENOENT ? "there is no virtual USB host controller: modprobe vhci-hcd"
                                      : std::string(kController) + "/attach: " + std::strerror(errno));
  }
  std::array<int, 2> ends{-1, -1};
  std::string why = "every port of the virtual USB host controller is in use";
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    why = std::string("no pair of sockets: ") + std::strerror(errno);
    ::close(attach);
    return Unexpected(why);
  }
  bool plugged = false;
  for (const int port : free_ports()) {
    const std::string line = std::to_string(port) + " " + std::to_string(ends[1]) + " " +
                             std::to_string(kDeviceNumber) + " " + std::to_string(kFullSpeed);
    if (::write(attach, line.data(), line.size()) == static_cast<ssize_t>(line.size())) {
      plugged = true;
      break;
    }
    why = "the virtual USB host controller refuses: " + std::string(std::strerror(errno));
  }
  ::close(attach);
  ::close(ends[1]);  // the kernel keeps it
  if (!plugged) {
    ::close(ends[0]);
    return Unexpected(why);
  }
  return VhciPort(ends[0]);
}

VhciPort::VhciPort(VhciPort&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), more_to_say_(other.more_to_say_) {}

VhciPort::~VhciPort() {
  if (socket_ >= 0) {
    ::shutdown(socket_, SHUT_RDWR);
    ::close(socket_);
  }
}

pollfd VhciPort::waits_for() const {
  return {socket_, static_cast<short>(more_to_say_ ? POLLIN | POLLOUT : POLLIN), 0};
}

bool VhciPort::wait(std::int64_t longest_ns, int wake) const {
  const std::int64_t left_ns = std::max<std::int64_t>(longest_ns, 0);
  std::array<pollfd, 2> ready = {waits_for(), {wake, POLLIN, 0}};
  const timespec left{static_cast<time_t>(left_ns / 1'000'000'000),
                      static_cast<long>(left_ns % 1'000'000'000)};
  return ppoll(ready.data(), ready.size(), &left, nullptr) >= 0 || errno == EINTR;
}

bool VhciPort::talk(UsbIpDevice& device) {
  std::array<std::uint8_t, 4096> bytes;
  const ssize_t size = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) {
    return false;
  }
  if (size > 0 && !device.take({bytes.data(), static_cast<std::size_t>(size)}, monotonic_ns())) {
    return false;
  }
  device.step(monotonic_ns());
  auto& output = device.output();
  while (!output.empty()) {
    const ssize_t sent = send(socket_, output.data(), output.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0) {
      more_to_say_ = true;
      return errno == EAGAIN || errno == EINTR;
    }
    output.erase(output.begin(), output.begin() + sent);
  }
  more_to_say_ = false;
  return true;
}

}  // namespace punctum::emulator
