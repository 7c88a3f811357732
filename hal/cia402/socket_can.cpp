#include "hal/cia402/socket_can.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <vector>

#include "hal/cia402/look.hpp"
#include "hal/kernel_call.hpp"

namespace punctum::cia402 {
namespace {

using Unexpected = tl::unexpected<std::string>;

// What the interface says of itself; the error says what to do.
tl::expected<int, std::string> check(int socket, const std::string& name) {
  const auto wrong = [&](const std::string& what) { return Unexpected(name + ": " + what); };
  ifreq request{};
  if (name.empty() || name.size() >= sizeof(request.ifr_name)) {
    return wrong("is no name of an interface, allowed: as `ip link` shows it");
  }
  name.copy(request.ifr_name, name.size());
  if (ioctl(socket, SIOCGIFINDEX, &request) != 0) {
    return wrong("there is no such CAN interface: `ip link` shows those that there are");
  }
  const int index = request.ifr_ifindex;
  if (ioctl(socket, SIOCGIFFLAGS, &request) != 0 || (request.ifr_flags & IFF_UP) == 0) {
    return wrong("the interface is down: ip link set " + name +
                 " txqueuelen 128 up type can bitrate 1000000 restart-ms 0");
  }
  if (ioctl(socket, SIOCGIFMTU, &request) != 0 ||
      (request.ifr_mtu != CAN_MTU && request.ifr_mtu != CANFD_MTU)) {
    return wrong("is no CAN interface");
  }
  // 0: a virtual bus without a queue.
  if (ioctl(socket, SIOCGIFTXQLEN, &request) == 0 && request.ifr_qlen != 0 &&
      request.ifr_qlen < kShortestQueue) {
    return wrong("its queue of " + std::to_string(request.ifr_qlen) + " frames is too short: ip link set " +
                 name + " txqueuelen 128");
  }
  return index;
}

}  // namespace

tl::expected<void, std::string> SocketCan::open(std::span<const std::uint16_t> ids) {
  const auto failed = [&](const char* what) {
    const int error = errno;
    close();
    return Unexpected(interface_ + ": " + what + ": " + std::generic_category().message(error));
  };
  socket_ = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
  if (socket_ < 0) {
    return failed("this kernel gives no CAN socket");
  }
  const auto index = check(socket_, interface_);
  if (!index) {
    close();
    return Unexpected(index.error());
  }
  std::vector<can_filter> filters;
  for (const std::uint16_t id : ids) {
    filters.push_back({id, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG});
  }
  const can_err_mask_t errors = CAN_ERR_MASK;
  if (setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                 static_cast<socklen_t>(filters.size() * sizeof(can_filter))) != 0 ||
      setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof(errors)) != 0) {
    return failed("filters are refused");
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = *index;
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return failed("cannot be bound");
  }
  return {};
}

void SocketCan::close() noexcept {
  if (socket_ >= 0) {
    ::close(socket_);
    socket_ = -1;
  }
}

// In the tick: a datagram socket with MSG_DONTWAIT returns at once, EAGAIN or ENOBUFS if it must; the kernel
// copies one frame of 16 bytes, and takes the socket's spin lock.
Sent SocketCan::send(const CanFrame& frame) NONBLOCKING {
  can_frame out{};
  out.can_id = frame.id;
  out.can_dlc = frame.size;
  std::memcpy(out.data, frame.data.data(), frame.data.size());
  const hal::Answer sent = hal::kernel_call<::send>(socket_, &out, sizeof(out), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (sent.value == static_cast<int>(sizeof(out))) {
    return Sent::ok;
  }
  return sent.error == ENOBUFS || sent.error == EAGAIN || sent.error == EINTR ? Sent::full : Sent::down;
}

Received SocketCan::receive(CanFrame& out) NONBLOCKING {
  can_frame in{};
  const hal::Answer got = hal::kernel_call<::recv>(socket_, &in, sizeof(in), MSG_DONTWAIT);
  if (got.value < 0) {
    return got.error == EAGAIN || got.error == EINTR ? Received::nothing : Received::down;
  }
  if (got.value != static_cast<int>(sizeof(in))) {
    return Received::error;
  }
  if ((in.can_id & CAN_ERR_FLAG) != 0) {
    return (in.can_id & CAN_ERR_BUSOFF) != 0 ? Received::bus_off : Received::error;
  }
  out.id = static_cast<std::uint16_t>(in.can_id & CAN_SFF_MASK);
  out.size = std::min<std::uint8_t>(in.can_dlc, CAN_MAX_DLEN);
  std::memcpy(out.data.data(), in.data, out.data.size());
  return Received::frame;
}

}  // namespace punctum::cia402
