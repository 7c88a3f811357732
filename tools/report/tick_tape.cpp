#include "tools/report/tick_tape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <stdexcept>

#include "hal/sim/truth.hpp"
#include "hal/sim/world.hpp"
#include "rt/station/station.hpp"
#include "tools/shared/truth_observer.hpp"

namespace punctum::report {
namespace {

// Devices between servo and tape. With a device behind them they record what it returns; without one they
// return what was recorded.
struct TapedHand final : hal::HapticDevice {
  TickTold* told = nullptr;
  hal::HapticDevice* device = nullptr;
  hal::Status read(hal::HandState& out) noexcept override {
    if (device != nullptr) {
      told->hand_status = device->read(out);
      told->hand_m = out.position_m;
      const hal::Quat& q = out.orientation;
      const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
      std::copy(wxyz, wxyz + 4, told->hand_wxyz);
      told->buttons = out.buttons;
    } else if (told->hand_status == hal::Status::ok) {
      out.position_m = told->hand_m.vec();
      out.orientation =
          hal::Quat(told->hand_wxyz[0], told->hand_wxyz[1], told->hand_wxyz[2], told->hand_wxyz[3]);
      out.buttons = told->buttons;
      out.sample_ns = told->release_ns;
    }
    return told->hand_status;
  }
  hal::Status write_force(const hal::Vec3& force_N) noexcept override {
    return device != nullptr ? device->write_force(force_N) : hal::Status::ok;
  }
};

struct TapedStage final : hal::Stage {
  TickTold* told = nullptr;
  hal::Stage* device = nullptr;
  hal::Status read(hal::StageState& out) noexcept override {
    if (device != nullptr) {
      told->stage_status = device->read(out);
      told->tip_m = out.tip_m;
      told->axis = out.axis;
      told->following_error_m = out.following_error_m;
      told->stage_enabled = out.enabled;
      told->stage_powered = out.powered;
      told->stage_at_standstill = out.at_standstill;
    } else if (told->stage_status == hal::Status::ok) {
      out = {.tip_m = told->tip_m.vec(),
             .axis = told->axis.vec(),
             .following_error_m = told->following_error_m.vec(),
             .enabled = told->stage_enabled,
             .powered = told->stage_powered,
             .at_standstill = told->stage_at_standstill,
             .sample_ns = told->release_ns};
    }
    return told->stage_status;
  }
  hal::Status command(const hal::StageCommand& set_point) noexcept override {
    return device != nullptr ? device->command(set_point) : hal::Status::ok;
  }
  void quick_stop() noexcept override {
    if (device != nullptr) {
      device->quick_stop();
    }
  }
  void enable(bool on) noexcept override {
    if (device != nullptr) {
      device->enable(on);
    }
  }
};

struct TapedEstop final : hal::EstopChain {
  TickTold* told = nullptr;
  hal::EstopChain* device = nullptr;
  hal::Status read(hal::EstopState& out) noexcept override {
    hal::Status status = hal::Status::ok;
    if (device != nullptr) {
      status = device->read(out);
      told->estop = out;
    } else {
      out = told->estop;
      out.sample_ns = told->release_ns;
    }
    return status;
  }
  void heartbeat(bool level) noexcept override {
    if (device != nullptr) {
      device->heartbeat(level);
    }
  }
};

// When it plays, it obeys the gate at once, since a scene may open the gate at other times than the recorded
// one.
struct TapedInjector final : hal::Injector {
  TickTold* told = nullptr;
  hal::Injector* device = nullptr;
  bool gate_open = false;
  void gate(bool open) noexcept override {
    gate_open = open;
    if (device != nullptr) {
      device->gate(open);
    }
  }
  hal::Status read(hal::InjectorState& out) noexcept override {
    if (device != nullptr) {
      return device->read(out);
    }
    out.open = gate_open;
    out.sample_ns = told->release_ns;
    return hal::Status::ok;
  }
};

// Holding vacuum or force sensor: one number.
template <class Device, class Reading, double Reading::* value, double TickTold::* number>
struct TapedNumber final : Device {
  TickTold* told = nullptr;
  Device* device = nullptr;
  hal::Status read(Reading& out) noexcept override {
    if (device != nullptr) {
      const hal::Status status = device->read(out);
      told->*number = out.*value;
      return status;
    }
    out.*value = told->*number;
    out.sample_ns = told->release_ns;
    return hal::Status::ok;
  }
};

struct TapedDevices {
  TapedHand hand;
  TapedStage stage;
  TapedEstop estop;
  TapedInjector injector;
  TapedNumber<hal::HoldingVacuum, hal::VacuumState, &hal::VacuumState::pressure_Pa, &TickTold::vacuum_Pa>
      vacuum;
  TapedNumber<hal::ForceSensor, hal::ForceState, &hal::ForceState::axial_force_N, &TickTold::axial_N>
      force_sensor;

  void at(TickTold& told) {
    hand.told = stage.told = estop.told = injector.told = vacuum.told = force_sensor.told = &told;
  }
  // The devices that the scene has.
  [[nodiscard]] rt::Devices of(const tools::Scene& scene) {
    return {hand,
            &stage,
            &estop,
            scene.servo.injector ? &injector : nullptr,
            scene.servo.vacuum ? &vacuum : nullptr,
            scene.servo.force_sensor ? &force_sensor : nullptr};
  }
};

rt::TickInfo tick_info(const TickTold& told, double period_s) {
  return {told.tick, told.release_ns, told.release_ns, period_s, 0};
}

std::int64_t nanoseconds(double s) { return std::llround(s * 1e9); }

struct OnItsWay {
  std::int64_t deliver_ns = 0;
  rt::Observation observation;
};

}  // namespace

std::vector<TickTold> record_ticks(const tools::Scene& scene, double seconds) {
  if (!scene.sim) {
    throw std::runtime_error(scene.name + ": no device of it is simulated");
  }
  if (scene.recorded) {
    auto icsi = tools::load_scene("icsi");
    if (!icsi) {
      throw std::runtime_error(icsi.error());
    }
    icsi->sim->operator_params = scene.sim->operator_params;
    return record_ticks(*icsi, seconds);
  }
  const double period_s = 1 / scene.servo.rate_Hz;
  const std::int64_t period_ns = nanoseconds(period_s), start_ns = period_ns;
  sim::World world(*scene.sim, nullptr, start_ns);
  TapedDevices devices;
  devices.hand.device = &world.hand();
  devices.stage.device = &world.stage();
  devices.estop.device = &world.estop();
  devices.injector.device = world.injector();
  devices.vacuum.device = world.vacuum();
  devices.force_sensor.device = world.force_sensor();
  const auto station = std::make_unique<rt::LocalStation>();
  const auto servo = std::make_unique<rt::Servo>(scene.servo, devices.of(scene), station->station);

  const bool seen = scene.vision && scene.simulated_camera();
  const std::int64_t frame_ns = seen ? nanoseconds(1 / scene.sim->microscope->fps) : 0;
  const std::int64_t latency_ns = seen ? nanoseconds(scene.sim->microscope->latency_s) : 0;
  std::int64_t next_frame_ns = start_ns;
  std::uint64_t frame = 0;
  std::deque<OnItsWay> on_its_way;
  std::optional<sim::Truth> before;

  const auto most = static_cast<std::size_t>(seconds * scene.servo.rate_Hz);
  std::vector<TickTold> tape;
  tape.reserve(most);
  while (tape.size() < most && !servo->finished()) {
    TickTold& told = tape.emplace_back();
    told.tick = tape.size() - 1;
    told.release_ns = start_ns + static_cast<std::int64_t>(told.tick) * period_ns;
    devices.at(told);
    world.step(told.release_ns);
    if (frame_ns > 0 && told.release_ns >= next_frame_ns) {
      next_frame_ns += frame_ns;
      const sim::Truth truth = sim::truth_of(*scene.sim, world.snapshot());
      on_its_way.push_back(
          {told.release_ns + latency_ns, tools::observe_truth(truth, frame++, told.release_ns, before)});
      before = truth;
    }
    if (!on_its_way.empty() && on_its_way.front().deliver_ns <= told.release_ns) {
      told.observed = true;
      told.observation = on_its_way.front().observation;
      on_its_way.pop_front();
      station->observation.slot.push(told.observation);
    }
    servo->tick(tick_info(told, period_s));
  }
  return tape;
}

rt::Fault replay_ticks(const tools::Scene& scene, const std::vector<TickTold>& tape) {
  TapedDevices devices;
  const auto station = std::make_unique<rt::LocalStation>();
  const auto servo = std::make_unique<rt::Servo>(scene.servo, devices.of(scene), station->station);
  for (TickTold told : tape) {
    devices.at(told);
    if (told.observed) {
      station->observation.slot.push(told.observation);
    }
    servo->tick(tick_info(told, 1 / scene.servo.rate_Hz));
  }
  return servo->fault();
}

tl::expected<void, std::string> write_tape(const std::string& path, const std::vector<TickTold>& tape) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) {
    return tl::unexpected(fmt::format("{}: cannot be written", path));
  }
  const bool all = std::fwrite(tape.data(), sizeof(TickTold), tape.size(), file) == tape.size();
  if (std::fclose(file) != 0 || !all) {
    return tl::unexpected(fmt::format("{}: cannot be written", path));
  }
  return {};
}

tl::expected<std::vector<TickTold>, std::string> read_tape(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) {
    return tl::unexpected(fmt::format("{}: cannot be read", path));
  }
  std::vector<TickTold> tape;
  TickTold told;
  while (std::fread(&told, sizeof told, 1, file) == 1) {
    tape.push_back(told);
  }
  (void)std::fclose(file);
  return tape;
}

}  // namespace punctum::report
