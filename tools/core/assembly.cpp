#include "tools/core/assembly.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <exception>
#include <ranges>
#include <stdexcept>

#include "hal/cia402/cia402_stage.hpp"
#include "hal/cia402/socket_can.hpp"
#ifdef PUNCTUM_HAS_LIBUSB
#include "hal/falcon/falcon_handle.hpp"
#include "hal/falcon/libusb_link.hpp"
#endif
#include "hal/browser/browser_hand.hpp"
#include "hal/evdev/evdev_hand.hpp"
#include "hal/gpiod/gpiod_devices.hpp"
#include "hal/zaber/zaber_positioner.hpp"

namespace punctum::tools {
namespace {

struct RoleName {
  std::string_view name;
  std::string DeviceNames::* device;
};
constexpr std::array<RoleName, kRoles> kNames = {{
    {"estop", &DeviceNames::estop},
    {"enabling", &DeviceNames::enabling},
    {"vacuum", &DeviceNames::vacuum},
    {"force_sensor", &DeviceNames::force_sensor},
    {"injector", &DeviceNames::injector},
    {"stage", &DeviceNames::stage},
    {"haptic", &DeviceNames::haptic},
    {"positioner", &DeviceNames::positioner},
    {"camera", &DeviceNames::camera},
}};
constexpr std::array<Role, kRoles> kAllRoles = {Role::estop,        Role::enabling,   Role::vacuum,
                                                Role::force_sensor, Role::injector,   Role::stage,
                                                Role::haptic,       Role::positioner, Role::camera};

const std::string& device_of(const DeviceNames& names, Role role) {
  return names.*kNames[static_cast<std::size_t>(role)].device;
}

std::string list(const Roles& roles) {
  std::vector<std::string_view> names;
  for (const Role role : kAllRoles) {
    if (roles.has(role)) {
      names.push_back(name_of(role));
    }
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

std::unique_ptr<hal::Device> make_simulated_devices(const Surroundings& around, const Roles& wanted) {
  sim::SimConfig config = around.scene.sim.value_or(sim::SimConfig{});
  if (!wanted.has(Role::camera)) {
    config.microscope.reset();
  }
  sim::SimulatedParts parts;
  parts.hand = wanted.has(Role::haptic);
  parts.stage = wanted.has(Role::stage);
  parts.estop = wanted.has(Role::estop);
  parts.injector = wanted.has(Role::injector);
  parts.vacuum = wanted.has(Role::vacuum);
  parts.force_sensor = wanted.has(Role::force_sensor);
  return std::make_unique<sim::SimulatedDevices>(config, parts, around.bench);
}

std::unique_ptr<hal::Device> make_simulated_positioner(const Surroundings& around, const Roles&) {
  return std::make_unique<sim::SimulatedPositioner>(sim::PositionerParams{}, around.clock);
}

std::unique_ptr<hal::Device> make_gpiod(const Surroundings& around, const Roles& wanted) {
  return std::make_unique<gpiod::GpiodDevices>(around.scene.gpiod.value_or(gpiod::GpiodParams{}),
                                               gpiod::GpiodParts{.estop = wanted.has(Role::estop),
                                                                 .injector = wanted.has(Role::injector),
                                                                 .enabling = wanted.has(Role::enabling),
                                                                 .vacuum = wanted.has(Role::vacuum)},
                                               around.clock);
}

std::unique_ptr<hal::Device> make_cia402(const Surroundings& around, const Roles&) {
  const cia402::CanStageParams& params = around.scene.cia402.value();
  return std::make_unique<cia402::Cia402Stage>(params, 1 / around.scene.servo.rate_Hz, around.clock,
                                               std::make_unique<cia402::SocketCan>(params.interface));
}

#ifdef PUNCTUM_HAS_LIBUSB
std::unique_ptr<hal::Device> make_falcon(const Surroundings& around, const Roles&) {
  const Scene& scene = around.scene;
  return std::make_unique<falcon::FalconHandle>(scene.falcon.value_or(falcon::FalconParams{}),
                                                falcon::ServoThread{scene.core_priority, scene.core_cpu},
                                                around.clock, falcon::libusb_link(around.clock));
}
#else
std::unique_ptr<hal::Device> make_falcon(const Surroundings&, const Roles&) {
  throw std::runtime_error("this punctum was built without libusb: install libusb-1.0-0-dev and build again");
}
#endif
std::unique_ptr<hal::Device> make_evdev(const Surroundings& around, const Roles&) {
  return std::make_unique<evdev::EvdevHand>(around.scene.evdev.value_or(evdev::EvdevParams{}), around.clock);
}

std::unique_ptr<hal::Device> make_browser(const Surroundings& around, const Roles&) {
  if (around.fingers == nullptr) {
    throw std::runtime_error("no console is served here");
  }
  return std::make_unique<browser::BrowserHand>(*around.fingers, around.clock);
}

// Nobody moves it while a run goes on: it is held so that nobody can.
std::unique_ptr<hal::Device> make_zaber(const Surroundings& around, const Roles&) {
  const zaber::ZaberParams& params = around.scene.zaber.value();
  return std::make_unique<zaber::ZaberPositioner>(params, around.clock,
                                                  std::make_unique<zaber::SerialLine>(params.port));
}

}  // namespace

std::span<const Backend> backends() {
  static const std::array table = {
      Backend{kSimulated,
              {Role::estop, Role::vacuum, Role::force_sensor, Role::injector, Role::stage, Role::haptic,
               Role::camera},
              make_simulated_devices},
      Backend{kSimulated, {Role::positioner}, make_simulated_positioner},
      Backend{kGpiod, {Role::estop, Role::enabling, Role::vacuum, Role::injector}, make_gpiod},
      Backend{kCia402, {Role::stage, Role::force_sensor}, make_cia402},
      Backend{kFalcon, {Role::haptic}, make_falcon},
      Backend{kEvdev, {Role::haptic}, make_evdev},
      Backend{kBrowser, {Role::haptic}, make_browser},
      Backend{kZaber, {Role::positioner}, make_zaber},
  };
  return table;
}

std::string_view name_of(Role role) noexcept { return kNames[static_cast<std::size_t>(role)].name; }

bool any_real(const DeviceNames& names) noexcept {
  return std::ranges::any_of(kAllRoles, [&](Role role) {
    const std::string& name = device_of(names, role);
    return role != Role::camera && !name.empty() && name != kSimulated;
  });
}

tl::expected<std::unique_ptr<Assembly>, std::string> Assembly::open(const Surroundings& around,
                                                                    std::span<const Backend> table) {
  const DeviceNames& names = around.scene.devices;
  std::vector<std::string> failures;
  const auto note = [&failures](std::string line) {
    if (!line.empty()) {
      failures.push_back(std::move(line));
    }
  };
  if (names.haptic.empty()) {
    note("haptic: the scene has none, and the core needs one");
  }
  std::unique_ptr<Assembly> assembly(new Assembly);
  std::vector<const Backend*> done;  // lines of the table that have had their turn
  for (const Role role : kAllRoles) {
    const std::string& name = device_of(names, role);
    if (name.empty()) {
      continue;
    }
    const auto line =
        std::ranges::find_if(table, [&](const Backend& b) { return b.name == name && b.offers.has(role); });
    if (line == table.end()) {
      if (role == Role::camera) {
        continue;  // cameras but the simulated one belong to the vision program
      }
      std::vector<std::string_view> allowed;
      for (const Backend& b : table) {
        if (b.offers.has(role)) {
          allowed.push_back(b.name);
        }
      }
      note(fmt::format("{}: device = \"{}\": unknown, allowed: {}", name_of(role), name,
                       fmt::join(allowed, ", ")));
      continue;
    }
    if (std::ranges::find(done, &*line) != done.end()) {
      continue;
    }
    done.push_back(&*line);
    Roles wanted{};
    for (const Role other : kAllRoles) {
      if (line->offers.has(other) && device_of(names, other) == name) {
        wanted.add(other);
      }
    }
    note(assembly->open_one(around, *line, wanted));
  }
  if (!failures.empty()) {
    return tl::unexpected(fmt::format("{}", fmt::join(failures, "\n")));
  }
  if (sim::World* world = assembly->world()) {
    if (names.haptic != kSimulated) {
      assembly->followed_hand_.emplace(*assembly->served_.haptic, *world);
    }
    if (assembly->served_.stage != nullptr && names.stage != kSimulated) {
      assembly->followed_stage_.emplace(*assembly->served_.stage, *world);
    }
  }
  return assembly;
}

// Empty, or the line that says why not.
std::string Assembly::open_one(const Surroundings& around, const Backend& backend, const Roles& wanted) {
  const std::string title = fmt::format("{}: {}", list(wanted), backend.name);
  try {
    std::unique_ptr<hal::Device> device = backend.make(around, wanted);
    if (const auto opened = device->open(); !opened) {
      return fmt::format("{}: {}", title, opened.error());
    }
    parts_.push_back({title, std::move(device)});
  } catch (const std::exception& e) {
    return fmt::format("{}: {}", title, e.what());
  }
  hal::Device& device = *parts_.back().device;
  if (auto* simulated = dynamic_cast<sim::SimulatedDevices*>(&device)) {
    simulated_ = simulated;
  }
  return take(device.served(), wanted, title);
}

std::string Assembly::take(const hal::Served& served, const Roles& wanted, const std::string& title) {
  std::vector<std::string_view> missing;
  const auto one = [&](Role role, auto* from, auto*& into) {
    if (!wanted.has(role)) {
      return;
    }
    if (from == nullptr) {
      missing.push_back(name_of(role));
    }
    into = from;
  };
  one(Role::estop, served.estop, served_.estop);
  one(Role::enabling, served.enabling, served_.enabling);
  one(Role::vacuum, served.vacuum, served_.vacuum);
  one(Role::force_sensor, served.force_sensor, served_.force_sensor);
  one(Role::injector, served.injector, served_.injector);
  one(Role::stage, served.stage, served_.stage);
  one(Role::haptic, served.haptic, served_.haptic);
  one(Role::positioner, served.positioner, served_.positioner);
  if (missing.empty()) {
    return {};
  }
  return fmt::format("{}: does not serve: {}", title, fmt::join(missing, ", "));
}

Assembly::~Assembly() {
  for (const Part& part : std::views::reverse(parts_)) {
    part.device->safe_state();
  }
  for (const Part& part : std::views::reverse(parts_)) {
    part.device->close();
  }
}

std::int64_t Assembly::longest_start_ns() const noexcept {
  std::int64_t all_ns = 0;
  for (const Part& part : parts_) {
    all_ns += part.device->longest_start_ns();
  }
  return all_ns;
}

tl::expected<void, std::string> Assembly::start(std::int64_t first_tick_ns) {
  for (const Part& part : parts_) {
    if (const auto started = part.device->start(first_tick_ns); !started) {
      return tl::unexpected(fmt::format("{}: {}", part.title, started.error()));
    }
  }
  return {};
}

rt::Devices Assembly::devices() noexcept {
  rt::Devices devices{followed_hand_ ? *followed_hand_ : *served_.haptic};
  devices.stage = followed_stage_ ? &*followed_stage_ : served_.stage;
  devices.estop = served_.estop;
  devices.injector = served_.injector;
  devices.vacuum = served_.vacuum;
  devices.enabling = served_.enabling;
  devices.force_sensor = served_.force_sensor;
  return devices;
}

sim::World* Assembly::world() noexcept { return simulated_ != nullptr ? simulated_->world() : nullptr; }

}  // namespace punctum::tools
