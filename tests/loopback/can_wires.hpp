// A CAN interface of the guest, brought up and taken down as `ip link` would, and emulated drives on another
// one of the same bus: between them the kernel's own driver and an emulated controller at either end.
#pragma once

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/netlink.h>
#include <linux/can/raw.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <poll.h>
#include <pthread.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hal/cia402/config.hpp"
#include "tools/emulators/drive/drive_bus.hpp"

namespace punctum::loopback {

// One request to the kernel's rtnetlink, attribute by attribute.
class LinkRequest {
 public:
  LinkRequest(const char* interface, unsigned flags) {
    header().nlmsg_type = RTM_NEWLINK;
    header().nlmsg_flags = NLM_F_REQUEST | NLM_F_ACK;
    header().nlmsg_len = NLMSG_LENGTH(sizeof(ifinfomsg));
    auto* info = static_cast<ifinfomsg*>(NLMSG_DATA(&header()));
    info->ifi_index = static_cast<int>(if_nametoindex(interface));
    info->ifi_change = IFF_UP;
    info->ifi_flags = flags;
  }
  void add(std::uint16_t type, const void* data, std::size_t size) {
    rtattr* attribute = reinterpret_cast<rtattr*>(bytes_ + NLMSG_ALIGN(header().nlmsg_len));
    attribute->rta_type = type;
    attribute->rta_len = static_cast<std::uint16_t>(RTA_LENGTH(size));
    if (size > 0) {
      std::memcpy(RTA_DATA(attribute), data, size);
    }
    header().nlmsg_len = NLMSG_ALIGN(header().nlmsg_len) + RTA_ALIGN(attribute->rta_len);
  }
  // Everything that is added until end() belongs to it.
  [[nodiscard]] std::size_t begin(std::uint16_t type) {
    const std::size_t at = NLMSG_ALIGN(header().nlmsg_len);
    add(type, nullptr, 0);
    return at;
  }
  void end(std::size_t at) {
    reinterpret_cast<rtattr*>(bytes_ + at)->rta_len = static_cast<std::uint16_t>(header().nlmsg_len - at);
  }
  // 0, or errno.
  [[nodiscard]] int send() {
    const int socket = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
    if (socket < 0 || ::send(socket, bytes_, header().nlmsg_len, 0) < 0) {
      return errno;
    }
    alignas(nlmsghdr) char answer[1024];
    const ssize_t size = recv(socket, answer, sizeof(answer), 0);
    close(socket);
    const auto* head = reinterpret_cast<const nlmsghdr*>(answer);
    if (size < static_cast<ssize_t>(NLMSG_LENGTH(sizeof(nlmsgerr))) || head->nlmsg_type != NLMSG_ERROR) {
      return EPROTO;
    }
    return -static_cast<const nlmsgerr*>(NLMSG_DATA(head))->error;
  }

 private:
  nlmsghdr& header() { return *reinterpret_cast<nlmsghdr*>(bytes_); }
  alignas(nlmsghdr) char bytes_[512]{};
};

inline constexpr double kCount_m = 40e-9;

inline cia402::CanStageParams three_drives() {
  cia402::CanStageParams params;
  params.axis_count = 3;
  for (int i = 0; i < 3; ++i) {
    params.axes[static_cast<std::size_t>(i)].node = i + 1;
    params.axes[static_cast<std::size_t>(i)].count_m[i] = kCount_m;
  }
  return params;
}

class CanInterface {
 public:
  explicit CanInterface(const char* name, std::uint32_t queue = 128) : name_(name) {
    down();
    LinkRequest request(name_, IFF_UP);
    request.add(IFLA_TXQLEN, &queue, sizeof(queue));
    const std::size_t info = request.begin(IFLA_LINKINFO);
    request.add(IFLA_INFO_KIND, "can", 3);
    const std::size_t data = request.begin(IFLA_INFO_DATA);
    can_bittiming timing{};
    timing.bitrate = 1'000'000;
    request.add(IFLA_CAN_BITTIMING, &timing, sizeof(timing));
    const std::uint32_t never = 0;
    request.add(IFLA_CAN_RESTART_MS, &never, sizeof(never));
    request.end(data);
    request.end(info);
    EXPECT_EQ(request.send(), 0) << name;
  }
  ~CanInterface() { down(); }
  CanInterface(const CanInterface&) = delete;
  CanInterface& operator=(const CanInterface&) = delete;
  void down() { EXPECT_EQ(LinkRequest(name_, 0).send(), 0); }

 private:
  const char* name_;
};

// Drives on a thread of their own, which answers at once: its priority is above that of a core.
class DrivesOnBus {
 public:
  DrivesOnBus(const char* interface, int count) {
    for (int node = 1; node <= count; ++node) {
      bus_.add(emulator::DriveParams{.node = node});
    }
    EXPECT_EQ(bus_.open(interface), "");
    thread_ = std::thread([this] { run(); });
    const sched_param priority{90};
    EXPECT_EQ(pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &priority), 0);
  }
  ~DrivesOnBus() { stop(); }
  DrivesOnBus(const DrivesOnBus&) = delete;
  DrivesOnBus& operator=(const DrivesOnBus&) = delete;

  // As if their supply were cut.
  void stop() {
    stop_ = true;
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  template <class Function>
  auto with(std::size_t i, Function&& function) {
    const std::lock_guard lock(mutex_);
    return function(bus_.drive(i));
  }
  // Frames with this identifier reach no drive any more.
  void lose(canid_t id) {
    const can_filter all_others{id | CAN_INV_FILTER, CAN_SFF_MASK};
    EXPECT_EQ(setsockopt(bus_.socket(), SOL_CAN_RAW, CAN_RAW_FILTER, &all_others, sizeof(all_others)), 0);
  }
  void send(const can_frame& frame) {
    EXPECT_EQ(write(bus_.socket(), &frame, sizeof(frame)), static_cast<ssize_t>(sizeof(frame)));
  }

 private:
  void run() {
    while (!stop_) {
      pollfd in{bus_.socket(), POLLIN, 0};
      (void)poll(&in, 1, 1);
      const std::lock_guard lock(mutex_);
      (void)bus_.serve();
    }
  }

  emulator::DriveBus bus_;
  std::mutex mutex_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace punctum::loopback
