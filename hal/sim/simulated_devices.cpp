#include "hal/sim/simulated_devices.hpp"

namespace punctum::sim {

tl::expected<void, std::string> SimulatedDevices::open() {
  world_.emplace(config_, bench_, simulated_);
  return {};
}

hal::Served SimulatedDevices::served() noexcept {
  hal::Served served;
  if (!world_) {
    return served;
  }
  served.haptic = simulated_.hand ? &world_->hand() : nullptr;
  served.stage = simulated_.stage ? &world_->stage() : nullptr;
  served.estop = simulated_.estop ? &world_->estop() : nullptr;
  served.injector = world_->injector();
  served.vacuum = world_->vacuum();
  served.force_sensor = world_->force_sensor();
  return served;
}

tl::expected<void, std::string> SimulatedDevices::start(std::int64_t first_tick_ns) {
  world_->begin(first_tick_ns);
  return {};
}

void SimulatedDevices::safe_state() noexcept {
  const hal::Served devices = served();
  if (devices.haptic != nullptr) {
    (void)devices.haptic->write_force(Vec3::Zero());
  }
  if (devices.stage != nullptr) {
    devices.stage->quick_stop();
  }
  if (devices.injector != nullptr) {
    devices.injector->gate(false);
  }
}

void SimulatedDevices::close() noexcept { world_.reset(); }

hal::Served SimulatedPositioner::served() noexcept {
  hal::Served served;
  served.positioner = &positioner_;
  return served;
}

hal::Status FollowedHand::read(hal::HandState& out) NONBLOCKING {
  const hal::Status status = real_.read(out);
  if (status == hal::Status::ok && out.position_m.allFinite()) {
    world_.follow_hand(out);
  }
  return status;
}

hal::Status FollowedStage::read(hal::StageState& out) NONBLOCKING {
  const hal::Status status = real_.read(out);
  if (status == hal::Status::ok && out.tip_m.allFinite() && out.axis.allFinite() &&
      out.axis.squaredNorm() > 0.5) {
    world_.follow_stage(out);
  }
  return status;
}

}  // namespace punctum::sim
