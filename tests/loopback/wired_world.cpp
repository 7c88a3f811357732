#include "tests/loopback/wired_world.hpp"

#include <algorithm>
#include <utility>

#include "hal/sim/truth.hpp"

namespace punctum::loopback {
namespace {

sim::SimulatedParts hand_and_suction() {
  sim::SimulatedParts parts;
  parts.stage = false;
  parts.estop = false;
  parts.injector = false;
  parts.force_sensor = false;
  return parts;
}

const char* name(emulator::DriveState state) {
  switch (state) {
    case emulator::DriveState::switch_on_disabled:
      return "switch-on disabled";
    case emulator::DriveState::ready_to_switch_on:
      return "ready to switch on";
    case emulator::DriveState::switched_on:
      return "switched on";
    case emulator::DriveState::operation_enabled:
      return "operation enabled";
    case emulator::DriveState::quick_stop_active:
      return "quick stop active";
    case emulator::DriveState::fault_reaction:
      return "fault reaction active";
    case emulator::DriveState::fault:
      return "fault";
  }
  return "unknown";
}

}  // namespace

WiredWorld::WiredWorld(const sim::SimConfig& config, sim::Bench* bench)
    : config_(config), world_(config, bench, hand_and_suction()) {
  needle_.axis = config.stage.axis.normalized();
}

void WiredWorld::begin(std::int64_t now_ns) { world_.begin(now_ns); }

void WiredWorld::step(emulator::DriveBus& drives, std::int64_t now_ns) {
  needle_.tip_m = config_.stage.start_m + config_.stage.registration_m;
  needle_.enabled = true;
  needle_.powered = true;
  needle_.at_standstill = true;
  for (int i = 0; i < kAxes; ++i) {
    const emulator::Drive& drive = drives.drive(static_cast<std::size_t>(i));
    needle_.tip_m[i] += kCount_m * drive.position();
    needle_.enabled = needle_.enabled && drive.state() == emulator::DriveState::operation_enabled;
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
  look(drives, now_ns);
}

void WiredWorld::note(std::int64_t now_ns, bool now, bool& before, const char* what) {
  if (now && !before) {
    events_.push_back({now_ns, what});
  }
  before = now;
}

void WiredWorld::look(const emulator::DriveBus& drives, std::int64_t now_ns) {
  const sim::Snapshot& snapshot = world_.snapshot();
  const sim::Truth truth = sim::truth_of(config_, snapshot);
  const std::lock_guard lock(mutex_);
  summary_.moved_m += (snapshot.hand.position_m.vec() - hand_m_).norm();
  hand_m_ = snapshot.hand.position_m;
  buttons_ = snapshot.hand.buttons;
  note(now_ns, truth.contact, summary_.contact, "the needle touches the cell");
  note(now_ns, truth.zona_punctured, summary_.zona_punctured, "the zona gives way");
  note(now_ns, truth.punctured, summary_.punctured, "the inner membrane gives way");
  note(now_ns, truth.lost, summary_.cell_lost, "the cell is lost");
  summary_.cell_held = truth.held;
  summary_.depth_m = -truth.gap_m;
  summary_.deepest_m = std::max(summary_.deepest_m, summary_.depth_m);
  summary_.force_N = force_N_.norm();
  summary_.largest_force_N = std::max(summary_.largest_force_N, summary_.force_N);
  for (std::size_t i = 0; i < kAxes; ++i) {
    const emulator::DriveState state = drives.drive(i).state();
    if (state != drive_states_[i]) {
      drive_states_[i] = state;
      events_.push_back({now_ns, "drive " + std::to_string(i + 1) + ": " + name(state)});
    }
  }
}

hal::Vec3 WiredWorld::hand_m() const {
  const std::lock_guard lock(mutex_);
  return hand_m_;
}

std::uint32_t WiredWorld::buttons() const {
  const std::lock_guard lock(mutex_);
  return buttons_;
}

void WiredWorld::push_hand(const hal::Vec3& force_N) {
  const std::lock_guard lock(mutex_);
  force_N_ = force_N;
}

WorldSummary WiredWorld::summary() const {
  const std::lock_guard lock(mutex_);
  return summary_;
}

std::vector<WorldEvent> WiredWorld::take_events() {
  const std::lock_guard lock(mutex_);
  return std::exchange(events_, {});
}

}  // namespace punctum::loopback
