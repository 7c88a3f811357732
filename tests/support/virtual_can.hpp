// A CAN bus in memory, under a virtual clock: a master's end of it and emulated drives at the other. Frames
// arrive in the order in which they were sent, unless a test says otherwise.
#pragma once

#include <linux/can.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hal/cia402/can_bus.hpp"
#include "hal/devices.hpp"
#include "tools/emulators/drive/drive.hpp"

namespace punctum::tests {

class VirtualCan final : public hal::Clock {
 public:
  static constexpr std::int64_t kStep_ns = 100'000;

  emulator::Drive& add(const emulator::DriveParams& params) {
    drives_.push_back(std::make_unique<emulator::Drive>(params));
    return *drives_.back();
  }
  [[nodiscard]] emulator::Drive& drive(std::size_t i) { return *drives_[i]; }

  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ns_; }
  void sleep_until_ns(std::int64_t t_ns) noexcept override {
    while (now_ns_ < t_ns) {
      now_ns_ = std::min(t_ns, now_ns_ + kStep_ns);
      if (contact && !waiting_.empty()) {
        const can_frame next = waiting_.front();
        waiting_.pop_front();
        deliver(next);
      }
      collect();
    }
  }

  // ---- what a test does to the bus ----
  std::function<bool(const can_frame&)> lose_of_master, lose_of_drives;  // true: the frame is lost
  int copies_of_drives = 1;
  bool bus_off = false, down = false, full = false;
  bool hold_drives = false;  // frames of the drives wait until it is false again
  // False: the master's connector is open. Nobody acknowledges its frames: they wait in its queue and go out
  // later in order, one in each step. What the drives say meanwhile, it never hears.
  bool contact = true;
  std::size_t queue = 128;      // frames that may wait: txqueuelen
  std::vector<can_frame> sent;  // by the master
  bool record = false;

  // As from another node.
  void inject(const can_frame& frame) {
    if (std::find(ids_.begin(), ids_.end(), frame.can_id) != ids_.end()) {
      to_master_.push_back(frame);
    }
  }
  void inject_error() { ++errors_; }
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

  [[nodiscard]] std::unique_ptr<cia402::CanBus> master() { return std::make_unique<End>(*this); }
  [[nodiscard]] bool is_open() const { return open_; }

 private:
  class End final : public cia402::CanBus {
   public:
    explicit End(VirtualCan& can) : can_(can) {}
    tl::expected<void, std::string> open(std::span<const std::uint16_t> ids) override {
      if (can_.down) {
        return tl::unexpected(std::string("vcan9: the interface is down"));
      }
      can_.ids_.assign(ids.begin(), ids.end());
      can_.to_master_.clear();
      can_.open_ = true;
      return {};
    }
    void close() noexcept override { can_.open_ = false; }
    cia402::Sent send(const cia402::CanFrame& frame) noexcept override { return can_.take(frame); }
    cia402::Received receive(cia402::CanFrame& out) noexcept override { return can_.give(out); }

   private:
    VirtualCan& can_;
  };

  cia402::Sent take(const cia402::CanFrame& frame) {
    if (down) {
      return cia402::Sent::down;
    }
    if (full || waiting_.size() >= queue) {
      return cia402::Sent::full;
    }
    can_frame out{};
    out.can_id = frame.id;
    out.can_dlc = frame.size;
    std::memcpy(out.data, frame.data.data(), frame.data.size());
    if (record) {
      sent.push_back(out);
    }
    if (bus_off || (lose_of_master && lose_of_master(out))) {
      return cia402::Sent::ok;
    }
    if (!contact || !waiting_.empty()) {
      waiting_.push_back(out);
      return cia402::Sent::ok;
    }
    deliver(out);
    collect();
    return cia402::Sent::ok;
  }
  void deliver(const can_frame& frame) {
    for (const auto& drive : drives_) {
      drive->on_frame(frame, now_ns_);
    }
  }
  cia402::Received give(cia402::CanFrame& out) {
    if (down) {
      return cia402::Received::down;
    }
    if (bus_off) {
      return cia402::Received::bus_off;
    }
    if (errors_ > 0) {
      --errors_;
      return cia402::Received::error;
    }
    if (to_master_.empty()) {
      return cia402::Received::nothing;
    }
    const can_frame frame = to_master_.front();
    to_master_.pop_front();
    out.id = static_cast<std::uint16_t>(frame.can_id);
    out.size = frame.can_dlc;
    std::memcpy(out.data.data(), frame.data, out.data.size());
    return cia402::Received::frame;
  }
  void collect() {
    for (const auto& drive : drives_) {
      for (const can_frame& frame : drive->step(now_ns_)) {
        for (int i = 0; i < copies_of_drives && !bus_off && contact; ++i) {
          held_.push_back(frame);
        }
      }
    }
    while (!hold_drives && !held_.empty()) {
      if (!lose_of_drives || !lose_of_drives(held_.front())) {
        inject(held_.front());
      }
      held_.pop_front();
    }
  }

  std::vector<std::unique_ptr<emulator::Drive>> drives_;
  std::vector<std::uint16_t> ids_;
  std::deque<can_frame> to_master_, held_, waiting_;
  std::int64_t now_ns_ = 1'000'000'000;
  int errors_ = 0;
  bool open_ = false;
};

[[nodiscard]] inline can_frame frame_of(std::uint32_t id, std::initializer_list<int> bytes) {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(bytes.size());
  int i = 0;
  for (const int byte : bytes) {
    frame.data[i++] = static_cast<std::uint8_t>(byte);
  }
  return frame;
}

}  // namespace punctum::tests
