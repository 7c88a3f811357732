// What the servo is given, written down as it sees it: devices and observations in front of the station's
// own, and a sample of each tick into the segment of inputs. There where a run is recorded.
#pragma once

#include <cstdint>

#include "rt/control/tick_timing.hpp"
#include "rt/station/station.hpp"
#include "tools/shared/taped_devices.hpp"

namespace punctum::tools {

class InputTape {
 public:
  // `observation`: of vision; null: nobody observes.
  InputTape(const rt::Devices& devices, const rt::ObservationSlot* observation, bool degraded,
            rt::InputRing& ring)
      : ring_(ring),
        theirs_(observation),
        always_(TapedDevices::flags_of(devices) | (degraded ? rt::InputSample::degraded : 0U)),
        devices_(taped_.before(devices)) {
    taped_.at(input_);
  }
  InputTape(const InputTape&) = delete;
  InputTape& operator=(const InputTape&) = delete;

  // For the servo instead of those given.
  [[nodiscard]] const rt::Devices& devices() const noexcept { return devices_; }
  [[nodiscard]] const rt::ObservationSlot* observation() const noexcept {
    return theirs_ != nullptr ? &mine_ : nullptr;
  }

  // Before the servo's tick; `asked`: InputSample::stop, end, end_here.
  void begin(const rt::TickInfo& now, std::uint32_t asked) NONBLOCKING {
    const std::uint64_t number = next_++;
    input_ = {};
    input_.number = number;
    input_.tick = now.tick;
    input_.release_ns = now.release_ns;
    input_.start_ns = now.start_ns;
    input_.period_s = now.period_s;
    input_.missed_in_window = now.missed_in_window;
    input_.flags = always_ | asked;
    take_newest_observation();
    input_.observations = seen_;
  }
  // After it.
  void end() NONBLOCKING { ring_.push(input_); }

 private:
  void take_newest_observation() NONBLOCKING {
    if (theirs_ == nullptr || theirs_->head() == seen_) {
      return;
    }
    rt::Observation observation;
    std::uint64_t index = 0;
    if (theirs_->newest(observation, index) == hal::Read::ok) {
      seen_ = index + 1;
      mine_.push(observation);
    }
  }

  rt::InputRing& ring_;
  const rt::ObservationSlot* theirs_;
  rt::ObservationSlot mine_;
  std::uint64_t seen_ = 0;
  std::uint32_t always_;
  std::uint64_t next_ = 0;
  rt::InputSample input_;
  TapedDevices taped_;
  rt::Devices devices_;
};

}  // namespace punctum::tools
