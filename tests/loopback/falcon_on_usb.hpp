// An emulated Falcon on the guest's virtual USB host controller, with a hand that a test moves. A thread of
// its own answers at once: its priority is above that of a core.
#pragma once

#include <gtest/gtest.h>
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "tools/emulators/falcon/falcon.hpp"
#include "tools/emulators/falcon/vhci.hpp"

namespace punctum::loopback {

// What the device was told and showed last, and when.
class WatchedHand final : public emulator::Hand {
 public:
  emulator::Grip grip(std::int64_t now_ns) override {
    asked_ns = now_ns;
    return at;
  }
  void push(const emulator::Triple& force_N, std::int64_t now_ns) override {
    if (force_N != force) {
      changed_ns = now_ns;
    }
    force = force_N;
  }
  emulator::Grip at;
  emulator::Triple force{};
  std::int64_t changed_ns = 0, asked_ns = 0;
};

class FalconOnUsb {
 public:
  explicit FalconOnUsb(const emulator::FalconParams& params) : falcon_(params, hand_) { plug_in(); }
  ~FalconOnUsb() { unplug(); }
  FalconOnUsb(const FalconOnUsb&) = delete;
  FalconOnUsb& operator=(const FalconOnUsb&) = delete;

  void plug_in() {
    falcon_.power_on();
    device_.emplace(falcon_);
    // A port that was in use is free a moment after its device has gone.
    for (int i = 0; i < 200 && !port_; ++i) {
      auto port = emulator::VhciPort::plug_in();
      if (port) {
        port_.emplace(std::move(*port));
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        problem_ = port.error();
      }
    }
    ASSERT_TRUE(port_) << problem_;
    stop_ = false;
    thread_ = std::thread([this] { run(); });
    const sched_param priority{90};
    EXPECT_EQ(pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &priority), 0);
  }
  void unplug() {
    stop_ = true;
    if (thread_.joinable()) {
      thread_.join();
    }
    port_.reset();
  }
  // From here on it answers nothing sooner than after this time.
  void slow_down(std::chrono::microseconds by) { slower_us_ = by.count(); }
  template <class Function>
  auto with(Function&& function) {
    const std::lock_guard lock(mutex_);
    return function(falcon_, hand_);
  }

 private:
  void run() {
    constexpr std::int64_t kLongest_ns = 1'000'000;
    std::int64_t wait_ns = 0;
    while (!stop_ && port_->wait(std::min(wait_ns, kLongest_ns))) {
      if (slower_us_ > 0) {
        std::this_thread::sleep_for(std::chrono::microseconds(slower_us_));
      }
      const std::lock_guard lock(mutex_);
      if (!port_->talk(*device_)) {
        return;
      }
      const std::int64_t now_ns = emulator::monotonic_ns();
      wait_ns = device_->next_ns(now_ns) - now_ns;
    }
  }

  WatchedHand hand_;
  emulator::FalconEmulator falcon_;
  std::optional<emulator::UsbIpDevice> device_;
  std::optional<emulator::VhciPort> port_;
  std::string problem_;
  std::mutex mutex_;
  std::atomic<bool> stop_{false};
  std::atomic<std::int64_t> slower_us_{0};
  std::thread thread_;
};

}  // namespace punctum::loopback
