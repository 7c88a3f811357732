#include "hal/sim/plant/estop.hpp"

#include "hal/sim/point.hpp"

namespace punctum::sim {
namespace {
constexpr double kResetAfter_s = 0.2;  // release to press
constexpr double kResetFor_s = 0.1;
}  // namespace

SimEstop::SimEstop(const SimConfig& config)
    : events_(config.estop_events),
      event_count_(config.estop_event_count),
      timeout_ns_(to_ns(config.relay_timeout_s)),
      noise_(config.seed, Noise::Stream::estop_reading),
      liar_(config.seed, Device::estop) {}

void SimEstop::step(std::int64_t t_ns, double from_s, double to_s, bool reset, const Failing& failure)
    NONBLOCKING {
  failure_ = failure;
  bool a = true;
  bool b = true;
  bool pulse = false;
  for (int i = 0; i < event_count_; ++i) {
    const EstopEvent& e = events_[static_cast<std::size_t>(i)];
    const double end_s = e.at_s + e.for_s;
    if (to_s >= e.at_s && to_s < end_s) {
      a = a && !e.contact_a;
      b = b && !e.contact_b;
    }
    if (e.at_s > from_s && end_s <= to_s && (e.contact_a || e.contact_b)) {
      pulse = true;
    }
    const double press_s = end_s + kResetAfter_s;
    if (e.reset_after && to_s >= press_s && to_s < press_s + kResetFor_s) {
      reset = true;
    }
  }
  if (failure == Failure::saturate) {
    a = true;
  }
  state_.contact_a_closed = a ? 1 : 0;
  state_.contact_b_closed = b ? 1 : 0;
  state_.reset_pressed = reset ? 1 : 0;
  unread_ = unread_ || pulse || !a || !b;
  state_.pulse_seen = unread_ && a && b ? 1 : 0;

  if (reset) {
    state_.last_reset_ns = t_ns;
    state_.was_reset = 1;
  }
  const bool beats = state_.heartbeat_seen != 0 && t_ns - state_.last_toggle_ns <= timeout_ns_;
  if (state_.relay_closed != 0 && !beats) {
    state_.relay_closed = 0;
    state_.was_reset = 0;
    state_.opened_ns = state_.last_toggle_ns + timeout_ns_;
  } else if (state_.relay_closed == 0 && beats && (state_.was_reset != 0 || state_.opened_ns == 0)) {
    state_.relay_closed = 1;
  }
  reader_.push(t_ns, state_, failure);
  now_ns_ = t_ns;
}

hal::Status SimEstop::read(hal::EstopState& out) NONBLOCKING {
  Sample<EstopPlantState> sample;
  const hal::Status status = reader_.read(sample);
  if (status != hal::Status::ok) {
    return status;
  }
  hal::EstopState truth;
  const EstopPlantState& s = sample.reading;
  if (failure_ == Failure::nan) {
    unread_ = false;
    return hal::Status::fault;
  }
  const std::uint64_t flicker =
      failure_ == Failure::noise ? noise_.bits(static_cast<std::uint64_t>(reader_.newest_ns())) : ~0ULL;
  truth.contact_a_closed = s.contact_a_closed != 0 && (flicker & 1) != 0;
  truth.contact_b_closed = s.contact_b_closed != 0 && (flicker & 2) != 0;
  truth.reset_pressed = s.reset_pressed != 0;
  truth.pulse_seen = s.pulse_seen != 0;
  truth.sample_ns = sample.sample_ns;
  const hal::Status told = liar_.tell(failure_, truth, out);
  unread_ =
      truth.pulse_seen && !(told == hal::Status::ok && out.pulse_seen);  // a driver keeps it until asked
  return told;
}

void SimEstop::heartbeat(bool level) NONBLOCKING {
  if (!commands_arrive(failure_) || (level ? 1 : 0) == state_.heartbeat_level) {
    return;
  }
  state_.heartbeat_level = level ? 1 : 0;
  state_.heartbeat_seen = 1;
  state_.last_toggle_ns = now_ns_;
}

void SimEstop::restore(const EstopPlantState& state, std::int64_t t_ns) NONBLOCKING {
  state_ = state;
  now_ns_ = t_ns;
}

}  // namespace punctum::sim
