// A force sensor as a CANopen slave, written from CiA 301 and CiA 404 and from nothing of hal/cia402: with
// every SYNC it sends its value as a PDO of four bytes, once it is told to and is operational. What it sends
// in place of that is the test's.
#pragma once

#include <gtest/gtest.h>
#include <linux/can.h>
#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <thread>
#include <utility>

#include "tools/emulators/drive/drive_bus.hpp"

namespace punctum::loopback {

class ForceSensorOnBus {
 public:
  static constexpr int kNode = 30;

  explicit ForceSensorOnBus(const char* interface) {
    EXPECT_EQ(bus_.open(interface), "");
    thread_ = std::thread([this] { run(); });
    const sched_param priority{90};
    EXPECT_EQ(pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &priority), 0);
  }
  ~ForceSensorOnBus() {
    stop_ = true;
    thread_.join();
  }
  ForceSensorOnBus(const ForceSensorOnBus&) = delete;
  ForceSensorOnBus& operator=(const ForceSensorOnBus&) = delete;

  std::atomic<std::int32_t> counts{0};
  std::atomic<int> bytes{4};  // of its PDO
  std::atomic<bool> silent{false};

 private:
  void send(const can_frame& frame) {
    EXPECT_EQ(write(bus_.socket(), &frame, sizeof(frame)), static_cast<ssize_t>(sizeof(frame)));
  }
  [[nodiscard]] bool sends() {
    return operational_ && (objects_[{0x1800, 1}] & 0x8000'0000U) == 0 && objects_[{0x1800, 2}] == 1 &&
           objects_[{0x1A00, 0}] == 1 && objects_[{0x1A00, 1}] == 0x9130'0120U;
  }
  void run() {
    while (!stop_) {
      pollfd in{bus_.socket(), POLLIN, 0};
      can_frame frame{};
      if (poll(&in, 1, 1) == 1 && read(bus_.socket(), &frame, sizeof(frame)) == sizeof(frame)) {
        take(frame);
      }
    }
  }
  void take(const can_frame& frame) {
    if (frame.can_id == 0x000 && (frame.data[1] == 0 || frame.data[1] == kNode)) {
      operational_ = frame.data[0] == 1;
    } else if (frame.can_id == 0x600 + kNode) {
      answer(frame);
    } else if (frame.can_id == 0x080 && sends() && !silent) {
      can_frame force{};
      force.can_id = objects_[{0x1800, 1}] & CAN_SFF_MASK;
      force.can_dlc = static_cast<std::uint8_t>(bytes.load());
      const auto value = static_cast<std::uint32_t>(counts.load());
      for (unsigned i = 0; i < 8; ++i) {
        force.data[i] = static_cast<std::uint8_t>(i < 4 ? value >> (8 * i) : 0xA5);
      }
      send(force);
    }
  }
  // Expedited transfers; whatever is written is kept.
  void answer(const can_frame& asked) {
    std::uint32_t& object = objects_[{asked.data[1] | asked.data[2] << 8, asked.data[3]}];
    can_frame out = asked;
    out.can_id = 0x580 + kNode;
    if (asked.data[0] >> 5 == 1) {
      const int given = 4 - ((asked.data[0] >> 2) & 3);
      object = 0;
      for (int i = 0; i < given; ++i) {
        object |= static_cast<std::uint32_t>(asked.data[4 + i]) << (8 * i);
      }
      out.data[0] = 0x60;
    } else {
      out.data[0] = 0x43;
      for (unsigned i = 0; i < 4; ++i) {
        out.data[4 + i] = static_cast<std::uint8_t>(object >> (8 * i));
      }
    }
    send(out);
  }

  emulator::DriveBus bus_;  // without drives: a socket
  std::map<std::pair<int, int>, std::uint32_t> objects_{{{0x1800, 1}, 0x8000'0000U}};
  bool operational_ = false;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace punctum::loopback
