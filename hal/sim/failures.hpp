// Devices that fail while they run: scheduled by the scene or switched live through the bench.
//
// The device is defective, all of it:
//   freeze      readings repeat the last good one with its sample time; commands have no effect
//   drop        nothing is read, no command arrives
//   delay       readings are kFailureDelay_s old and say so in their sample time; commands arrive at once
//   nan         readings are fresh and not numbers (a device whose readings are only true or false reports a
//               fault); commands still arrive
//   disconnect  the device is gone
//   saturate    the device hangs at the end of its range; what that means is said in each device's header
//   noise       every reading carries broadband interference, as large as each device's header says; commands
//               still arrive
//
// The device lies: readings are fresh, have Status::ok and commands arrive. Of one channel,
//   glitch      one sample is wrong by `size` (yes and no are exchanged), and again every `every_s`
//   offset      every sample is wrong by `size`
//   drift       samples are wrong by `size` per second since the failure began
//   set         samples read `size`
//   stuck       samples repeat what the first one of the failure read
//   flicker     yes and no are exchanged in half of the samples, chosen by the seed
// and of the whole device
//   sparse      only every `size`-th sample is there, between them there is no data
//   repeat      only every `size`-th sample is taken, between them it is repeated with its sample time
//   ignore      the command named by `channel` has no effect
//   creep       the stage moves by itself at `size` along `component` when it should stand, while there is
//               drive power; its encoders see it
//
// A lie can be told about any reading, without a World:  Liar<hal::HandState> liar(seed, Device::hand);
// then, for each reading of a device,  status = liar.tell(failing, truth, out).
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>

#include "hal/devices.hpp"
#include "hal/realtime.hpp"
#include "hal/sim/config.hpp"
#include "hal/sim/noise.hpp"
#include "hal/sim/point.hpp"

namespace punctum::sim {

inline constexpr double kFailureDelay_s = 0.02;

// What a device does wrong at one time. A kind that needs nothing else converts to it.
struct Failing {
  Failure kind = Failure::none;
  Channel channel = Channel::none;
  Component component = Component::x;
  double size = 0;
  double every_s = 0;

  constexpr Failing() = default;
  constexpr Failing(Failure k) NONBLOCKING : kind(k) {}  // NOLINT(google-explicit-constructor)
  constexpr Failing(Failure k, Channel c, double size_ = 0, Component which = Component::x,
                    double every_s_ = 0) NONBLOCKING : kind(k),
                                                       channel(c),
                                                       component(which),
                                                       size(size_),
                                                       every_s(every_s_) {}
  friend constexpr bool operator==(const Failing& a, const Failing& b) NONBLOCKING {
    return a.kind == b.kind && a.channel == b.channel && a.component == b.component && a.size == b.size &&
           a.every_s == b.every_s;
  }
  friend constexpr bool operator==(const Failing& a, Failure k) NONBLOCKING { return a.kind == k; }
};

// Live switches, in shared memory: 0 = as scheduled, else 1 + Failure, and the channel and component in the
// bytes above.
struct FailureSwitches {
  std::array<std::atomic<std::uint64_t>, kDevices> word{};
  std::array<std::atomic<double>, kDevices> size{};
  std::array<std::atomic<double>, kDevices> every_s{};

  void set(Device device, const Failing& failing) NONBLOCKING;
  void as_scheduled(Device device) NONBLOCKING {
    word[static_cast<std::size_t>(device)].store(0, std::memory_order_relaxed);
  }
};

static_assert(std::atomic<double>::is_always_lock_free);

// Which failure each device has at time t_s of the run: the last one of the list that is due.
[[nodiscard]] std::array<Failing, kDevices> failures_at(const SimConfig& config, const FailureSwitches* live,
                                                        double t_s) NONBLOCKING;

[[nodiscard]] constexpr bool is_one_of(Channel channel, std::initializer_list<Channel> list) NONBLOCKING {
  return std::find(list.begin(), list.end(), channel) != list.end();
}

// The channels of a device's readings.
[[nodiscard]] constexpr bool tells(Device device, Channel channel) NONBLOCKING {
  if (device != Device::camera && (channel == Channel::time || channel == Channel::all)) {
    return true;
  }
  switch (device) {
    case Device::hand:
      return is_one_of(channel, {Channel::position, Channel::orientation, Channel::clutch, Channel::inject,
                                 Channel::next_cell});
    case Device::stage:
      return is_one_of(channel, {Channel::position, Channel::axis, Channel::following_error, Channel::enabled,
                                 Channel::standstill});
    case Device::estop:
      return is_one_of(channel, {Channel::contact_a, Channel::contact_b, Channel::reset, Channel::pulse});
    case Device::injector:
      return channel == Channel::open;
    case Device::vacuum:
      return channel == Channel::pressure;
    case Device::force_sensor:
      return channel == Channel::force;
    case Device::vision:
      return is_one_of(channel, {Channel::position, Channel::axis, Channel::centre, Channel::cell,
                                 Channel::radius, Channel::entry, Channel::gap, Channel::dimple_depth,
                                 Channel::dimple_width, Channel::membrane_velocity, Channel::contact,
                                 Channel::punctured, Channel::inner_punctured});
    case Device::camera:
      return false;
  }
  return false;
}

// The commands that a device can ignore.
[[nodiscard]] constexpr bool obeys(Device device, Channel command) NONBLOCKING {
  return (device == Device::stage &&
          is_one_of(command, {Channel::enable, Channel::disable, Channel::quick_stop})) ||
         (device == Device::injector && command == Channel::gate);
}

[[nodiscard]] constexpr bool is_yes_or_no(Channel channel) NONBLOCKING {
  return is_one_of(
      channel, {Channel::clutch, Channel::inject, Channel::next_cell, Channel::enabled, Channel::standstill,
                Channel::contact_a, Channel::contact_b, Channel::reset, Channel::pulse, Channel::open,
                Channel::contact, Channel::punctured, Channel::inner_punctured});
}

// Which channels of a device a kind can concern; none at all for a kind that concerns the whole device.
[[nodiscard]] constexpr bool can_concern(Device device, Failure kind, Channel channel) NONBLOCKING {
  const bool number = tells(device, channel) && !is_yes_or_no(channel) && channel != Channel::all;
  switch (kind) {
    case Failure::glitch:
    case Failure::set:
      return tells(device, channel) && channel != Channel::all;
    case Failure::offset:
    case Failure::drift:
      return number;
    case Failure::stuck:
      return tells(device, channel);
    case Failure::flicker:
      return tells(device, channel) && is_yes_or_no(channel);
    case Failure::ignore:
      return obeys(device, channel);
    default:
      return channel == Channel::none;
  }
}

// Which kinds a device can have.
[[nodiscard]] constexpr bool can_have(Device device, Failure kind) NONBLOCKING {
  if (kind == Failure::creep) {
    return device == Device::stage;
  }
  if (kind < Failure::glitch) {
    return device != Device::vision;  // the camera's failures are its own
  }
  if (kind == Failure::sparse || kind == Failure::repeat) {
    return device != Device::camera;
  }
  for (int c = 0; c <= static_cast<int>(kLastChannel); ++c) {
    if (can_concern(device, kind, static_cast<Channel>(c))) {
      return true;
    }
  }
  return false;
}

// Commands reach a device unless it has one of these.
[[nodiscard]] constexpr bool commands_arrive(const Failing& f) NONBLOCKING {
  return f != Failure::freeze && f != Failure::drop && f != Failure::disconnect;
}
[[nodiscard]] constexpr hal::Status command_status(const Failing& f) NONBLOCKING {
  return f == Failure::disconnect ? hal::Status::disconnected : hal::Status::ok;
}
[[nodiscard]] constexpr bool ignores(const Failing& f, Channel command) NONBLOCKING {
  return f == Failure::ignore && f.channel == command;
}

// One channel of a reading, to be read and overwritten: numbers, yes or no, or the sample time.
struct Field {
  double* number = nullptr;
  int numbers = 0;
  bool* flag = nullptr;
  std::uint32_t* word = nullptr;  // yes or no is one bit of it
  std::uint32_t bit = 0;
  std::int64_t* time_ns = nullptr;
};

// The channels of each reading; an empty field where it has no such channel. A reading from elsewhere has
// its own field_of beside it; every reading has a time.
[[nodiscard]] Field field_of(hal::HandState& reading, Channel channel) NONBLOCKING;
[[nodiscard]] Field field_of(hal::StageState& reading, Channel channel) NONBLOCKING;
[[nodiscard]] Field field_of(hal::EstopState& reading, Channel channel) NONBLOCKING;
[[nodiscard]] Field field_of(hal::InjectorState& reading, Channel channel) NONBLOCKING;
[[nodiscard]] Field field_of(hal::VacuumState& reading, Channel channel) NONBLOCKING;
[[nodiscard]] Field field_of(hal::ForceState& reading, Channel channel) NONBLOCKING;

// How one sample is wrong. `held`: the same channel of the first sample of the failure. elapsed_s: since
// then. chance: random bits of this sample.
void distort(const Field& field, const Field& held, const Failing& failing, double elapsed_s,
             std::uint64_t chance) NONBLOCKING;

// Tells the lies about one device's readings. What is told depends on the seed, the failure and the true
// readings, in their order, only. A sample that is read twice is told twice in the same way.
template <typename Reading>
class Liar {
 public:
  explicit constexpr Liar(std::uint64_t seed, Device device)
      : noise_(seed, Noise::Stream::lie, static_cast<std::uint64_t>(device)) {}

  // From the true reading, whose sample time is on the clock of the station, what is told: into `out`, which
  // stays as it was with another status than ok.
  [[nodiscard]] hal::Status tell(const Failing& failing, const Reading& truth, Reading& out) NONBLOCKING {
    if (failing.kind < Failure::glitch || failing.kind > Failure::repeat) {
      told_ = Failure::none;
      out = truth;
      return hal::Status::ok;
    }
    Reading reading = truth;
    const std::int64_t t_ns = *field_of(reading, Channel::time).time_ns;
    const bool begins = !(failing == told_);
    if (begins) {
      told_ = failing;
      began_ns_ = t_ns;
      samples_ = 0;
      period_ = 0;
      first_ = reading;
    } else if (t_ns != newest_ns_) {
      ++samples_;
    }
    const bool again = !begins && t_ns == newest_ns_;
    newest_ns_ = t_ns;
    const double elapsed_s = static_cast<double>(t_ns - began_ns_) * 1e-9;

    if (failing == Failure::sparse || failing == Failure::repeat) {
      const auto n = static_cast<std::uint64_t>(failing.size >= 1 && failing.size <= 1e6 ? failing.size : 1);
      const bool taken = samples_ % n == 0;
      if (taken) {
        first_ = reading;
      } else if (failing == Failure::sparse) {
        return hal::Status::no_data;
      }
      out = first_;
      return hal::Status::ok;
    }
    if (failing == Failure::glitch) {
      if (!again) {
        const double period = failing.every_s > 0 ? std::floor(elapsed_s / failing.every_s) : 0;
        wrong_ = begins || period != period_;
        period_ = period;
      }
      if (!wrong_) {
        out = truth;
        return hal::Status::ok;
      }
    }
    if (failing.channel == Channel::all) {  // everything is stuck but its time
      reading = first_;
      *field_of(reading, Channel::time).time_ns = t_ns;
    } else {
      distort(field_of(reading, failing.channel), field_of(first_, failing.channel), failing, elapsed_s,
              noise_.bits(static_cast<std::uint64_t>(t_ns)));
    }
    out = reading;
    return hal::Status::ok;
  }

 private:
  Noise noise_;
  Failing told_;
  Reading first_{};            // of the failure; of sparse samples the newest
  std::int64_t began_ns_ = 0;  // true sample times
  std::int64_t newest_ns_ = 0;
  std::uint64_t samples_ = 0;  // since it began
  double period_ = 0;
  bool wrong_ = false;
};

// A device's true reading at one plant step.
template <typename Reading>
struct Sample {
  std::int64_t sample_ns = 0;
  Reading reading{};
};

// What can be read of a device's true readings while it fails. One push per plant step, any number of reads.
template <typename Reading>
class FailingReader {
 public:
  void push(std::int64_t t_ns, const Reading& fresh, const Failing& failing) NONBLOCKING {
    past_[head_ % kPast] = {t_ns, fresh};
    ++head_;
    if (failing.kind != Failure::freeze) {
      frozen_ = {t_ns, fresh};
    }
    failure_ = failing.kind;
  }

  // The sample and its status. What `nan`, `saturate` and `noise` do to the reading, each device adds itself;
  // lies are told about what comes out of that.
  [[nodiscard]] hal::Status read(Sample<Reading>& out) const NONBLOCKING {
    if (head_ == 0) {
      return hal::Status::no_data;
    }
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
        out = past_[(head_ - 1) % kPast];
        return hal::Status::ok;
    }
  }

  [[nodiscard]] std::int64_t newest_ns() const NONBLOCKING {
    return head_ == 0 ? 0 : past_[(head_ - 1) % kPast].sample_ns;
  }

 private:
  static constexpr std::uint64_t kPast = 256;  // more than kFailureDelay_s at 8 kHz

  // The newest reading at least kFailureDelay_s old, else the oldest kept.
  [[nodiscard]] const Sample<Reading>& delayed() const NONBLOCKING {
    const std::int64_t limit = past_[(head_ - 1) % kPast].sample_ns - to_ns(kFailureDelay_s);
    const std::uint64_t oldest = head_ > kPast ? head_ - kPast : 0;
    std::uint64_t i = head_ - 1;
    while (i > oldest && past_[i % kPast].sample_ns > limit) {
      --i;
    }
    return past_[i % kPast];
  }

  std::array<Sample<Reading>, kPast> past_{};
  std::uint64_t head_ = 0;
  Sample<Reading> frozen_{};
  Failure failure_ = Failure::none;
};

inline constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

}  // namespace punctum::sim
