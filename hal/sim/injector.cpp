#include "hal/sim/injector.hpp"

#include <cmath>

namespace punctum::sim {
namespace {
constexpr double kShutBelow = 0.05;  // of the opening: the contact then says shut
}

void SimInjector::step(std::int64_t t_ns, double dt_s, bool power, Failure failure) noexcept {
  failure_ = failure;
  const double target = power && state_.gate != 0 && failure != Failure::disconnect ? 1 : 0;
  // o' = (target - o) / lag, and its integral.
  const double part = params_.open_s > 0 ? -std::expm1(-dt_s / params_.open_s) : 1.0;
  state_.delivered_s += target * dt_s + (state_.opening - target) * params_.open_s * part;
  state_.opening += (target - state_.opening) * part;
  state_.powered = power ? 1 : 0;
  reader_.push(t_ns, state_, failure);
}

void SimInjector::gate(bool open) noexcept {
  if (commands_arrive(failure_)) state_.gate = open ? 1 : 0;
}

hal::Status SimInjector::read(bool& open) noexcept {
  InjectorPlantState s;
  const hal::Status status = reader_.read(s);
  if (status != hal::Status::ok) return status;
  if (failure_ == Failure::nan) return hal::Status::fault;
  open = failure_ == Failure::saturate || s.opening > kShutBelow;
  if (failure_ == Failure::noise) {
    open = (noise_.bits(static_cast<std::uint64_t>(reader_.newest_ns())) & 1) != 0;
  }
  return hal::Status::ok;
}

}  // namespace punctum::sim
