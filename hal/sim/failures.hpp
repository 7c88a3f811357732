// Devices that fail while they run: scheduled by the scene or switched live through the bench.
//
//   freeze      readings repeat the last good one and look fresh; commands have no effect
//   drop        nothing is read, nothing arrives
//   delay       readings are kFailureDelay_s old; commands arrive at once
//   nan         readings look fresh and are not numbers (a device that only knows yes and no reports a
//   fault);
//               commands still arrive
//   disconnect  the device is gone
//   saturate    the device hangs at the end of its range; what that means is said in each device's header
//   noise       every reading carries broadband interference, as large as each device's header says; commands
//               still arrive
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>

#include "hal/sim/config.hpp"
#include "hal/sim/point.hpp"

namespace punctum::sim {

inline constexpr double kFailureDelay_s = 0.02;

// Live switches, in shared memory: 0 = as scheduled, else 1 + Failure.
struct FailureSwitches {
  std::array<std::atomic<std::uint64_t>, kDevices> word{};

  void set(Device device, Failure kind) noexcept {
    word[static_cast<std::size_t>(device)].store(1 + static_cast<std::uint64_t>(kind),
                                                 std::memory_order_relaxed);
  }
  void as_scheduled(Device device) noexcept {
    word[static_cast<std::size_t>(device)].store(0, std::memory_order_relaxed);
  }
};

// Which failure each device has at time t_s of the run.
[[nodiscard]] std::array<Failure, kDevices> failures_at(const SimConfig& config, const FailureSwitches* live,
                                                        double t_s) noexcept;

// Commands reach a device unless it has one of these.
[[nodiscard]] constexpr bool commands_arrive(Failure f) noexcept {
  return f != Failure::freeze && f != Failure::drop && f != Failure::disconnect;
}
[[nodiscard]] constexpr hal::Status command_status(Failure f) noexcept {
  return f == Failure::disconnect ? hal::Status::disconnected : hal::Status::ok;
}

// What a device's reader sees of its true readings. One push per tick, any number of reads.
template <typename Reading>
class FailingReader {
 public:
  void push(std::int64_t t_ns, const Reading& fresh, Failure failure) noexcept {
    past_[head_ % kPast] = {t_ns, fresh};
    ++head_;
    if (failure != Failure::freeze) frozen_ = fresh;
    failure_ = failure;
  }

  // The reading and its status, before what `nan` and `saturate` do to it (the device's own business).
  [[nodiscard]] hal::Status read(Reading& out) const noexcept {
    if (head_ == 0) return hal::Status::no_data;
    switch (failure_) {
      case Failure::drop:
        return hal::Status::no_data;
      case Failure::disconnect:
        return hal::Status::disconnected;
      case Failure::freeze:
        out = frozen_;
        return hal::Status::ok;
      case Failure::delay:
        out = delayed();
        return hal::Status::ok;
      default:
        out = past_[(head_ - 1) % kPast].reading;
        return hal::Status::ok;
    }
  }

  [[nodiscard]] Failure failure() const noexcept { return failure_; }
  [[nodiscard]] std::int64_t newest_ns() const noexcept {
    return head_ == 0 ? 0 : past_[(head_ - 1) % kPast].t_ns;
  }

 private:
  static constexpr std::uint64_t kPast = 256;  // more than kFailureDelay_s at 8 kHz
  struct Stamped {
    std::int64_t t_ns = 0;
    Reading reading{};
  };

  // The newest reading at least kFailureDelay_s old, else the oldest kept.
  [[nodiscard]] const Reading& delayed() const noexcept {
    const std::int64_t limit = past_[(head_ - 1) % kPast].t_ns - to_ns(kFailureDelay_s);
    const std::uint64_t oldest = head_ > kPast ? head_ - kPast : 0;
    std::uint64_t i = head_ - 1;
    while (i > oldest && past_[i % kPast].t_ns > limit) --i;
    return past_[i % kPast].reading;
  }

  std::array<Stamped, kPast> past_{};
  std::uint64_t head_ = 0;
  Reading frozen_{};
  Failure failure_ = Failure::none;
};

inline constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

}  // namespace punctum::sim
