#include "hal/sim/plant/injector.hpp"

#include <cmath>

#include "hal/math/elementary.hpp"

namespace punctum::sim {
namespace {
constexpr double kShutBelow = 0.05;  // of the opening: the contact then reports shut
}

void SimInjector::step(std::int64_t t_ns, double dt_s, bool power, const Failing& failure) NONBLOCKING {
  failure_ = failure;
  const double target = power && state_.gate != 0 && failure != Failure::disconnect ? 1 : 0;
  // o' = (target - o) / lag, and its integral.
  const double part = params_.open_s > 0 ? -math::expm1(-dt_s / params_.open_s) : 1.0;
  state_.delivered_s += target * dt_s + (state_.opening - target) * params_.open_s * part;
  state_.opening += (target - state_.opening) * part;
  state_.powered = power ? 1 : 0;
  reader_.push(t_ns, state_, failure);
}

void SimInjector::gate(bool open) NONBLOCKING {
  if (commands_arrive(failure_) && !ignores(failure_, Channel::gate)) {
    state_.gate = open ? 1 : 0;
  }
}

hal::Status SimInjector::read(hal::InjectorState& out) NONBLOCKING {
  Sample<InjectorPlantState> sample;
  const hal::Status status = reader_.read(sample);
  if (status != hal::Status::ok) {
    return status;
  }
  hal::InjectorState truth;
  if (failure_ == Failure::nan) {
    return hal::Status::fault;
  }
  truth.open = failure_ == Failure::saturate || sample.reading.opening > kShutBelow;
  if (failure_ == Failure::noise) {
    truth.open = (noise_.bits(static_cast<std::uint64_t>(reader_.newest_ns())) & 1) != 0;
  }
  truth.sample_ns = sample.sample_ns;
  return liar_.tell(failure_, truth, out);
}

}  // namespace punctum::sim
