#include "tools/core/shut_down.hpp"

#include <signal.h>

#include <atomic>

namespace punctum::tools {
namespace {

void stop(const rt::Devices& devices) NONBLOCKING {
  (void)devices.hand.write_force(hal::Vec3::Zero());
  if (devices.injector != nullptr) {
    devices.injector->gate(false);
  }
  if (devices.stage != nullptr) {
    devices.stage->quick_stop();
  }
}

std::atomic<const rt::Devices*> devices_of_spinning{nullptr};
static_assert(std::atomic<const rt::Devices*>::is_always_lock_free);

// The tick will not come back to the loop. Raised again, the signal ends the process when this returns.
extern "C" void on_spinning(int number) {
  if (const rt::Devices* devices = devices_of_spinning.load()) {
    stop_and_power_off(*devices);
  }
  raise(number);
}

}  // namespace

void shut_down_when_spinning(const rt::Devices& devices) {
  devices_of_spinning.store(&devices);
  struct sigaction action{};
  action.sa_handler = on_spinning;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGXCPU, &action, nullptr);
}

void stop_and_power_off(const rt::Devices& devices) NONBLOCKING {
  stop(devices);
  if (devices.stage != nullptr) {
    devices.stage->enable(false);
  }
  if (devices.estop != nullptr) {
    devices.estop->drive_power(false);
  }
}

void ShutDown::run() noexcept {
  if (done_) {
    return;
  }
  done_ = true;
  stop(devices_);
  // The drive brakes for at least a period before its standstill is believed.
  const std::int64_t most_periods = longest_ns_ / period_ns_;
  for (std::int64_t i = 0; i < most_periods; ++i) {
    pass_one_period();
    if (at_standstill()) {
      break;
    }
    stop(devices_);
  }
  stop_and_power_off(devices_);
  pass_one_period();  // the devices take it before they are closed
}

bool ShutDown::at_standstill() noexcept {
  if (devices_.stage == nullptr) {
    return true;
  }
  hal::StageState stage;
  return devices_.stage->read(stage) == hal::Status::ok && stage.at_standstill;
}

void ShutDown::pass_one_period() noexcept {
  clock_.sleep_until_ns(clock_.now_ns() + period_ns_);
  if (world_ != nullptr) {
    world_->step(clock_.now_ns());
  }
}

}  // namespace punctum::tools
