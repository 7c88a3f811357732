// A Novint Falcon as the handle. README.md says how it is connected and what it promises.
#pragma once

#include <pthread.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "hal/device_life.hpp"
#include "hal/falcon/config.hpp"
#include "hal/falcon/session.hpp"
#include "hal/falcon/usb_link.hpp"

namespace punctum::falcon {

// Of the servo, which the thread of the handle stays below and beside.
struct ServoThread {
  int priority = 80;  // SCHED_FIFO
  int cpu = -1;       // -1: not bound
};

class FalconHandle final : public hal::Device, public hal::HapticDevice {
 public:
  // clock: the station's.
  FalconHandle(FalconParams params, const ServoThread& servo, hal::Clock& clock,
               std::unique_ptr<UsbLink> link);
  ~FalconHandle() override;
  FalconHandle(const FalconHandle&) = delete;
  FalconHandle& operator=(const FalconHandle&) = delete;

  [[nodiscard]] tl::expected<void, std::string> open() override;  // 8 s at the most
  [[nodiscard]] hal::Served served() noexcept override;
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t first_tick_ns) override;
  void safe_state() noexcept override;  // zero to the motors
  void close() noexcept override;

  // no_data: nothing new, or not homed yet. fault: a place that the grip cannot be at; for good, that it lost
  // its homing. disconnected: until it is closed and opened again.
  [[nodiscard]] hal::Status read(hal::HandState& out) NONBLOCKING override { return session_->read(out); }
  // Of several the newest counts. no_data: not homed yet.
  [[nodiscard]] hal::Status write_force(const hal::Vec3& force_N) NONBLOCKING override {
    return session_->write_force(force_N);
  }

  // Valid between open() and close(); what it counts, only while no thread of its own runs.
  [[nodiscard]] const Session& session() const { return *session_; }

 private:
  static void* run(void* self);
  void settle_thread() const;
  void stop_thread() noexcept;

  const FalconParams params_;
  const ServoThread servo_;
  hal::Clock& clock_;
  const std::unique_ptr<UsbLink> link_;
  std::optional<Session> session_;
  std::optional<pthread_t> thread_;
  std::atomic<bool> stop_{false};
};

}  // namespace punctum::falcon
