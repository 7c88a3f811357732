// Makes one telemetry sample of every tick and publishes it, and with it the core's status and the events of
// this tick.
#pragma once

#include <cstdint>

#include "hal/realtime.hpp"
#include "rt/control/cell_observer.hpp"
#include "rt/control/device_inputs.hpp"
#include "rt/control/modulus_fit.hpp"
#include "rt/control/rendering.hpp"
#include "rt/control/requests.hpp"
#include "rt/control/safety_stop.hpp"
#include "rt/control/task.hpp"
#include "rt/station/station.hpp"

namespace punctum::rt {

// What one tick has to tell.
struct TickRecord {
  const TickInfo& now;
  std::uint32_t alarms;
  const Readings& readings;
  const Requested& requested;
  const hal::Vec3& hand_velocity_m_s;  // device frame
  const CellFacts& cell;
  const TaskFacts& task;
  const Rendering& rendering;
  const ModulusEstimate& modulus;
  const SafetyOutput& safety;
  const hal::StageCommand& set_point;
};

class TelemetryWriter {
 public:
  explicit TelemetryWriter(Station& station) NONBLOCKING : station_(station) {}

  void publish(const TickRecord& tick) NONBLOCKING;
  [[nodiscard]] const TelemetrySample& sample() const NONBLOCKING { return sample_; }  // of the last tick

 private:
  struct Seen {  // of the last tick: what an event tells the change of
    Phase phase;
    Fault fault;
    std::uint32_t alarms;
    std::uint32_t cell;
  };
  void tell_events(const Seen& last, const Requested& requested) NONBLOCKING;
  void tell_alarms(std::uint32_t last) NONBLOCKING;
  void tell(Event event) NONBLOCKING;
  void fill_forces(const Rendering& rendering, const SafetyOutput& safety, double depth_sd_m) NONBLOCKING;
  void fill_cell(const CellFacts& cell) NONBLOCKING;

  Station& station_;
  TelemetrySample sample_;
  std::int64_t first_release_ns_ = 0;
  bool published_ = false;
};

}  // namespace punctum::rt
