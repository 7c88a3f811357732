#include "tools/emulators/world/wired_world.hpp"

#include <algorithm>
#include <utility>

namespace punctum::emulator {
namespace {

constexpr double kGripMiddle_z_m = 0.12;
// A trembling hand passes places without force all the time.
constexpr std::int64_t kLasts_ns = 200'000'000;

sim::SimulatedParts hand_and_suction() {
  sim::SimulatedParts parts;
  parts.stage = false;
  parts.estop = false;
  parts.injector = false;
  parts.force_sensor = false;
  return parts;
}

const char* name(DriveState state) {
  switch (state) {
    case DriveState::switch_on_disabled:
      return "switch-on disabled";
    case DriveState::ready_to_switch_on:
      return "ready to switch on";
    case DriveState::switched_on:
      return "switched on";
    case DriveState::operation_enabled:
      return "operation enabled";
    case DriveState::quick_stop_active:
      return "quick stop active";
    case DriveState::fault_reaction:
      return "fault reaction active";
    case DriveState::fault:
      return "fault";
  }
  return "unknown";
}

}  // namespace

WiredWorld::WiredWorld(const sim::SimConfig& config, sim::Bench* bench)
    : config_(config), world_(config, bench, hand_and_suction()) {
  needle_.axis = config.stage.axis.normalized();
}

void WiredWorld::step(DriveBus& drives, std::int64_t now_ns) {
  needle_.tip_m = config_.stage.start_m + config_.stage.registration_m;
  needle_.enabled = true;
  needle_.powered = true;
  needle_.at_standstill = true;
  for (int i = 0; i < kAxes; ++i) {
    const Drive& drive = drives.drive(static_cast<std::size_t>(i));
    needle_.tip_m[i] += kCount_m * drive.position();
    needle_.enabled = needle_.enabled && drive.state() == DriveState::operation_enabled;
    needle_.powered = needle_.powered && drive.motor_has_power();
    needle_.at_standstill = needle_.at_standstill && drive.speed() == 0;
  }
  needle_.sample_ns = now_ns;
  world_.follow_stage(needle_);
  {
    const std::lock_guard lock(mutex_);
    (void)world_.hand().write_force(force_N_);
  }
  world_.step(now_ns);

  const sim::Snapshot& snapshot = world_.snapshot();
  const sim::Truth truth = sim::truth_of(config_, snapshot);
  const std::lock_guard lock(mutex_);
  hand_m_ = snapshot.hand.position_m;
  buttons_ = snapshot.hand.buttons;
  note(now_ns, truth.contact, now_.truth.contact, "the needle touches the cell");
  note(now_ns, truth.zona_punctured, now_.truth.zona_punctured, "the zona gives way");
  note(now_ns, truth.punctured, now_.truth.punctured, "the inner membrane gives way");
  note(now_ns, truth.lost, now_.truth.lost, "the cell is lost");
  note(now_ns, !truth.contact, !now_.truth.contact, "the needle is clear of the cell");
  now_.truth = truth;
  if (no_force_since_ns_ >= 0 && now_ns - no_force_since_ns_ > kLasts_ns) {
    events_.push_back({no_force_since_ns_, "the handle is without force"});
    no_force_since_ns_ = -1;
  }
}

void WiredWorld::look_at(DriveBus& drives, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  now_.powered = false;
  for (std::size_t i = 0; i < kAxes; ++i) {
    const DriveState state = drives.drive(i).state();
    now_.powered = now_.powered || drives.drive(i).motor_has_power();
    if (state != drive_states_[i]) {
      drive_states_[i] = state;
      events_.push_back({now_ns, "drive " + std::to_string(drives.drive(i).node()) + ": " + name(state)});
    }
  }
}

Grip WiredWorld::grip() const {
  const std::lock_guard lock(mutex_);
  return {{hand_m_.x(), hand_m_.y(), hand_m_.z() + kGripMiddle_z_m}, static_cast<std::uint8_t>(buttons_)};
}

void WiredWorld::push_hand(const Triple& force_N, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  force_N_ = {force_N[0], force_N[1], force_N[2]};
  if (!force_N_.isZero()) {
    no_force_since_ns_ = -1;
  } else if (now_.force_N > 0) {
    no_force_since_ns_ = now_ns;
  }
  now_.force_N = force_N_.norm();
  now_.largest_force_N = std::max(now_.largest_force_N, now_.force_N);
}

WiredWorld::Now WiredWorld::now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

void WiredWorld::tell(std::int64_t now_ns, std::string what) {
  const std::lock_guard lock(mutex_);
  events_.push_back({now_ns, std::move(what)});
}

std::vector<WorldEvent> WiredWorld::events(std::size_t from) const {
  const std::lock_guard lock(mutex_);
  return {events_.begin() + static_cast<std::ptrdiff_t>(std::min(from, events_.size())), events_.end()};
}

void WiredWorld::note(std::int64_t now_ns, bool now, bool before, const char* what) {
  if (now && !before) {
    events_.push_back({now_ns, what});
  }
}

}  // namespace punctum::emulator
