#include "hal/sim/failures.hpp"

#include <algorithm>

namespace punctum::sim {
namespace {

constexpr std::uint64_t kByte = 0xFF;

// Bounded, so that an absurd size is an absurd time and nothing worse.
std::int64_t ns_of(double seconds) NONBLOCKING {
  constexpr double most_s = 4e9;
  return seconds == seconds ? to_ns(std::clamp(seconds, -most_s, most_s)) : 0;
}

void overwrite(const Field& field, bool on) NONBLOCKING {
  if (field.flag != nullptr) {
    *field.flag = on;
  } else if (on) {
    *field.word |= field.bit;
  } else {
    *field.word &= ~field.bit;
  }
}
bool is_on(const Field& field) NONBLOCKING {
  return field.flag != nullptr ? *field.flag : (*field.word & field.bit) != 0;
}

void distort_flag(const Field& field, const Field& held, const Failing& failing, std::uint64_t chance)
    NONBLOCKING {
  switch (failing.kind) {
    case Failure::glitch:
      overwrite(field, !is_on(field));
      break;
    case Failure::flicker:
      overwrite(field, is_on(field) != ((chance & 1) != 0));
      break;
    case Failure::set:
      overwrite(field, failing.size != 0);
      break;
    case Failure::stuck:
      overwrite(field, is_on(held));
      break;
    default:
      break;
  }
}

void distort_time(const Field& field, const Field& held, const Failing& failing, double elapsed_s)
    NONBLOCKING {
  switch (failing.kind) {
    case Failure::glitch:
    case Failure::offset:
      *field.time_ns += ns_of(failing.size);
      break;
    case Failure::drift:
      *field.time_ns += ns_of(failing.size * elapsed_s);
      break;
    case Failure::set:
      *field.time_ns = ns_of(failing.size);
      break;
    case Failure::stuck:
      *field.time_ns = *held.time_ns;
      break;
    default:
      break;
  }
}

void distort_number(double& number, double held, const Failing& failing, double elapsed_s) NONBLOCKING {
  switch (failing.kind) {
    case Failure::glitch:
    case Failure::offset:
      number += failing.size;
      break;
    case Failure::drift:
      number += failing.size * elapsed_s;
      break;
    case Failure::set:
      number = failing.size;
      break;
    case Failure::stuck:
      number = held;
      break;
    default:
      break;
  }
}

Field numbers(double* first, int count) NONBLOCKING {
  Field f;
  f.number = first;
  f.numbers = count;
  return f;
}
Field flag(bool& on) NONBLOCKING {
  Field f;
  f.flag = &on;
  return f;
}
Field bit(std::uint32_t& word, std::uint32_t which) NONBLOCKING {
  Field f;
  f.word = &word;
  f.bit = which;
  return f;
}
Field time(std::int64_t& t_ns) NONBLOCKING {
  Field f;
  f.time_ns = &t_ns;
  return f;
}

}  // namespace

void FailureSwitches::set(Device device, const Failing& failing) NONBLOCKING {
  const auto d = static_cast<std::size_t>(device);
  size[d].store(failing.size, std::memory_order_relaxed);
  every_s[d].store(failing.every_s, std::memory_order_relaxed);
  word[d].store((1 + static_cast<std::uint64_t>(failing.kind)) |
                    static_cast<std::uint64_t>(failing.channel) << 8U |
                    static_cast<std::uint64_t>(failing.component) << 16U,
                std::memory_order_release);
}

std::array<Failing, kDevices> failures_at(const SimConfig& config, const FailureSwitches* live, double t_s)
    NONBLOCKING {
  std::array<Failing, kDevices> now{};
  for (int i = 0; i < config.failure_count; ++i) {
    const ScheduledFailure& f = config.failures[static_cast<std::size_t>(i)];
    if (t_s >= f.at_s && (f.for_s <= 0 || t_s < f.at_s + f.for_s)) {
      now[static_cast<std::size_t>(f.device)] = {f.kind, f.channel, f.size, f.component, f.every_s};
    }
  }
  if (live != nullptr) {
    for (std::size_t d = 0; d < now.size(); ++d) {
      const std::uint64_t word = live->word[d].load(std::memory_order_acquire);
      const std::uint64_t kind = word & kByte;
      const std::uint64_t channel = word >> 8U & kByte;
      const std::uint64_t component = word >> 16U;
      if (kind != 0 && kind <= 1 + static_cast<std::uint64_t>(kLastFailure) &&
          channel <= static_cast<std::uint64_t>(kLastChannel) &&
          component <= static_cast<std::uint64_t>(kLastComponent)) {
        now[d] = {static_cast<Failure>(kind - 1), static_cast<Channel>(channel),
                  live->size[d].load(std::memory_order_relaxed), static_cast<Component>(component),
                  live->every_s[d].load(std::memory_order_relaxed)};
      }
    }
  }
  return now;
}

void distort(const Field& field, const Field& held, const Failing& failing, double elapsed_s,
             std::uint64_t chance) NONBLOCKING {
  if (field.time_ns != nullptr) {
    distort_time(field, held, failing, elapsed_s);
    return;
  }
  if (field.flag != nullptr || field.word != nullptr) {
    distort_flag(field, held, failing, chance);
    return;
  }
  const bool all = failing.component == Component::all || field.numbers == 1;
  for (int i = 0; i < field.numbers; ++i) {
    if (all || i == static_cast<int>(failing.component)) {
      distort_number(field.number[i], held.number[i], failing, elapsed_s);
    }
  }
}

Field field_of(hal::HandState& reading, Channel channel) NONBLOCKING {
  switch (channel) {
    case Channel::time:
      return time(reading.sample_ns);
    case Channel::position:
      return numbers(reading.position_m.data(), 3);
    case Channel::orientation:
      return numbers(reading.orientation.coeffs().data(), 4);  // x, y, z, w
    case Channel::clutch:
      return bit(reading.buttons, hal::kButtonClutch);
    case Channel::inject:
      return bit(reading.buttons, hal::kButtonInject);
    case Channel::next_cell:
      return bit(reading.buttons, hal::kButtonNextCell);
    default:
      return {};
  }
}

Field field_of(hal::StageState& reading, Channel channel) NONBLOCKING {
  switch (channel) {
    case Channel::time:
      return time(reading.sample_ns);
    case Channel::position:
      return numbers(reading.tip_m.data(), 3);
    case Channel::axis:
      return numbers(reading.axis.data(), 3);
    case Channel::following_error:
      return numbers(reading.following_error_m.data(), 3);
    case Channel::enabled:
      return flag(reading.enabled);
    case Channel::standstill:
      return flag(reading.at_standstill);
    default:
      return {};
  }
}

Field field_of(hal::EstopState& reading, Channel channel) NONBLOCKING {
  switch (channel) {
    case Channel::time:
      return time(reading.sample_ns);
    case Channel::contact_a:
      return flag(reading.contact_a_closed);
    case Channel::contact_b:
      return flag(reading.contact_b_closed);
    case Channel::reset:
      return flag(reading.reset_pressed);
    case Channel::pulse:
      return flag(reading.pulse_seen);
    default:
      return {};
  }
}

Field field_of(hal::InjectorState& reading, Channel channel) NONBLOCKING {
  return channel == Channel::time   ? time(reading.sample_ns)
         : channel == Channel::open ? flag(reading.open)
                                    : Field{};
}

Field field_of(hal::VacuumState& reading, Channel channel) NONBLOCKING {
  return channel == Channel::time       ? time(reading.sample_ns)
         : channel == Channel::pressure ? numbers(&reading.pressure_Pa, 1)
                                        : Field{};
}

Field field_of(hal::ForceState& reading, Channel channel) NONBLOCKING {
  return channel == Channel::time    ? time(reading.sample_ns)
         : channel == Channel::force ? numbers(&reading.axial_force_N, 1)
                                     : Field{};
}

}  // namespace punctum::sim
