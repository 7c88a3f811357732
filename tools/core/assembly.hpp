// Turns a scene into the devices of the core: one table of backends, one life cycle for all of them.
//
// Set-up code; only the pointers in devices() are used in the tick. Simulated and real devices mix freely;
// the simulated plant exists only if the scene names a simulated device.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "hal/browser/fingers.hpp"
#include "hal/device_life.hpp"
#include "hal/sim/simulated_devices.hpp"
#include "rt/control/servo.hpp"
#include "tools/scene/scene.hpp"

namespace punctum::tools {

// What a device is to the station: the members of DeviceNames. In the order in which devices are opened and
// started: the safety chain first, what can move or push last. They are closed in reverse.
enum class Role : std::uint8_t {
  estop,
  enabling,
  vacuum,
  force_sensor,
  injector,
  stage,
  haptic,
  positioner,
  camera,  // of the core's devices only the simulated plant has one: it exposes the pictures
};
inline constexpr int kRoles = 9;
[[nodiscard]] std::string_view name_of(Role role) noexcept;

class Roles {
 public:
  constexpr Roles(std::initializer_list<Role> roles) {
    for (const Role role : roles) {
      add(role);
    }
  }
  constexpr void add(Role role) noexcept { bits_ |= 1U << static_cast<unsigned>(role); }
  [[nodiscard]] constexpr bool has(Role role) const noexcept {
    return (bits_ >> static_cast<unsigned>(role) & 1U) != 0;
  }

 private:
  unsigned bits_ = 0;
};

// What a backend may use to make its device.
struct Surroundings {
  const Scene& scene;
  hal::Clock& clock;            // the station's, for sample times and for waits of the set-up
  sim::Bench* bench = nullptr;  // null: the simulated plant publishes nothing
  const browser::FingersSegment* fingers = nullptr;  // null: no page moves a hand
};

// One line of the table. A name may stand on several lines: each makes a device of its own.
struct Backend {
  std::string_view name;  // as a scene writes it
  Roles offers;
  // Makes one device for those of its roles that the scene gives to this name. It is not opened yet.
  std::function<std::unique_ptr<hal::Device>(const Surroundings&, const Roles& wanted)> make;
};
[[nodiscard]] std::span<const Backend> backends();

class Assembly {
 public:
  // Makes and opens every device that the scene names. The error has one line for each device that failed;
  // the others were tried and are closed again. `surroundings` is used here only.
  [[nodiscard]] static tl::expected<std::unique_ptr<Assembly>, std::string> open(
      const Surroundings& surroundings, std::span<const Backend> table = backends());
  // Safe state of every device, then close, both in reverse order.
  ~Assembly();
  Assembly(const Assembly&) = delete;
  Assembly& operator=(const Assembly&) = delete;

  // What start() may wait for the hardware.
  [[nodiscard]] std::int64_t longest_start_ns() const noexcept;
  // In order, up to the first that fails. The first tick is due at first_tick_ns.
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t first_tick_ns);

  [[nodiscard]] rt::Devices devices() noexcept;
  [[nodiscard]] hal::QueuedPositioner* positioner() noexcept { return served_.positioner; }
  [[nodiscard]] sim::World*
  world() noexcept;  // to be stepped before every tick; null without simulated device

 private:
  struct Part {
    std::string title;  // "stage, estop: cia402", for messages
    std::unique_ptr<hal::Device> device;
  };

  Assembly() = default;
  [[nodiscard]] std::string open_one(const Surroundings& surroundings, const Backend& backend,
                                     const Roles& wanted);
  [[nodiscard]] std::string take(const hal::Served& served, const Roles& wanted, const std::string& title);

  std::vector<Part> parts_;  // opened, in order
  sim::SimulatedDevices* simulated_ = nullptr;
  hal::Served served_;
  std::optional<sim::FollowedHand> followed_hand_;
  std::optional<sim::FollowedStage> followed_stage_;
};

// What is to be known before anything is opened: virtual time is for a core without real devices.
[[nodiscard]] bool any_real(const DeviceNames& names) noexcept;

}  // namespace punctum::tools
