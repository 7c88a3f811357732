// The injector: a valve that opens and shuts with a first-order lag, shut without power.
#pragma once

#include <cstdint>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/failures.hpp"
#include "hal/sim/noise.hpp"

namespace punctum::sim {

struct InjectorPlantState {
  double opening = 0;      // 0 shut .. 1 open
  double delivered_s = 0;  // time integral of the opening
  std::uint32_t gate = 0;  // as commanded
  std::uint32_t powered = 0;
};

// nan: reading fails. saturate: the valve's contact always reports open. noise: it reports open half of the
// time.
class SimInjector final : public hal::Injector {
 public:
  explicit SimInjector(const InjectorParams& params, std::uint64_t seed = 1)
      : params_(params), noise_(seed, Noise::Stream::injector_reading), liar_(seed, Device::injector) {}

  void step(std::int64_t t_ns, double dt_s, bool power, const Failing& failure) NONBLOCKING;

  void gate(bool open) NONBLOCKING override;
  [[nodiscard]] hal::Status read(hal::InjectorState& out) NONBLOCKING override;

  [[nodiscard]] const InjectorPlantState& state() const NONBLOCKING { return state_; }
  void restore(const InjectorPlantState& state) NONBLOCKING { state_ = state; }

 private:
  InjectorParams params_;
  Noise noise_;
  InjectorPlantState state_;
  FailingReader<InjectorPlantState> reader_;
  Liar<hal::InjectorState> liar_;
  Failing failure_;
};

}  // namespace punctum::sim
