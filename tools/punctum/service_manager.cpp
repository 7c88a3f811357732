#include "tools/punctum/service_manager.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace punctum::tools {
namespace {

constexpr double kFeedsInTimeout = 4;

std::string taken_from_environment(const char* name) {
  const char* const found = std::getenv(name);
  std::string value = found == nullptr ? "" : found;
  unsetenv(name);
  return value;
}

long long whole_number(const std::string& text) {
  long long number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && rest == text.data() + text.size() ? number : 0;
}

}  // namespace

ServiceManager::ServiceManager() : address_(taken_from_environment("NOTIFY_SOCKET")) {
  const long long timeout_us = whole_number(taken_from_environment("WATCHDOG_USEC"));
  const std::string watched = taken_from_environment("WATCHDOG_PID");
  const bool usable = address_.size() > 1 && address_.size() < sizeof(sockaddr_un::sun_path) &&
                      (address_[0] == '/' || address_[0] == '@');
  if (!usable) {
    return;
  }
  if (address_[0] == '@') {
    address_[0] = '\0';
  }
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (timeout_us > 0 && (watched.empty() || whole_number(watched) == getpid())) {
    feed_every_s_ = 1e-6 * static_cast<double>(timeout_us) / kFeedsInTimeout;
  }
}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) {
    close(socket_);
  }
}

bool ServiceManager::say(std::string_view state) const {
  if (socket_ < 0) {
    return false;
  }
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  std::memcpy(to.sun_path, address_.data(), address_.size());
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  return sendto(socket_, state.data(), state.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to),
                size) >= 0;
}

void ServiceManager::ticks(std::uint64_t ticks, double now_s) {
  if (socket_ < 0 || ticks == ticks_) {
    return;
  }
  ticks_ = ticks;
  if (!ready_) {
    ready_ = say("READY=1\nSTATUS=The core ticks.");
    next_s_ = now_s + feed_every_s_;
  } else if (feed_every_s_ > 0 && now_s >= next_s_ && say("WATCHDOG=1")) {
    next_s_ = now_s + feed_every_s_;
  }
}

void ServiceManager::stopping() { (void)say("STOPPING=1\nSTATUS=The core has ended."); }

}  // namespace punctum::tools
