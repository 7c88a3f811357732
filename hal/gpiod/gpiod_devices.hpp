// The e-stop chain, the enabling switch, the injector and the holding vacuum on the GPIO lines of one chip.
// Wiring: README.md.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "hal/device_life.hpp"
#include "hal/gpiod/config.hpp"
#include "hal/gpiod/lines.hpp"
#include "hal/realtime.hpp"

namespace punctum::gpiod {

// The level decides; the changes that the kernel kept only add pulses which no reading saw.
struct Contact {
  std::unique_ptr<Line> line;
  bool closed = false;  // when it was read last
};

// Two contacts, the reset button and the heartbeat; where it is wired, the line that enables the drives.
class GpiodEstop final : public hal::EstopChain {
 public:
  explicit GpiodEstop(const hal::Clock& clock) : clock_(clock) {}

  // fault, disconnected: also when the heartbeat or the enable line could not be written last.
  [[nodiscard]] hal::Status read(hal::EstopState& out) NONBLOCKING override;
  void heartbeat(bool level) NONBLOCKING override;
  void drive_power(bool on) NONBLOCKING override;

 private:
  friend class GpiodDevices;
  const hal::Clock& clock_;
  Contact a_, b_;
  std::unique_ptr<Line> reset_, heartbeat_, enable_;
  hal::Status written_ = hal::Status::ok, enable_written_ = hal::Status::ok;
};

// Two contacts that are closed in the middle position.
class GpiodEnabling final : public hal::EnablingSwitch {
 public:
  explicit GpiodEnabling(const hal::Clock& clock) : clock_(clock) {}

  [[nodiscard]] hal::Status read(hal::EnablingState& out) NONBLOCKING override;

 private:
  friend class GpiodDevices;
  const hal::Clock& clock_;
  Contact a_, b_;
};

// The gate, and the contact of its valve; where that is not wired, the gate's own line is read back.
class GpiodInjector final : public hal::Injector {
 public:
  explicit GpiodInjector(const hal::Clock& clock) : clock_(clock) {}

  void gate(bool open) NONBLOCKING override;
  // fault, disconnected: also when the gate could not be written last.
  [[nodiscard]] hal::Status read(hal::InjectorState& out) NONBLOCKING override;

 private:
  friend class GpiodDevices;
  const hal::Clock& clock_;
  std::unique_ptr<Line> gate_, valve_;
  hal::Status written_ = hal::Status::ok;
};

// A pressure switch, and where it is wired the valve between pump and pipette: it holds from the moment it is
// claimed on and is never written again, whatever becomes of the run.
class GpiodVacuum final : public hal::HoldingVacuum {
 public:
  GpiodVacuum(double switch_Pa, const hal::Clock& clock) : switch_Pa_(switch_Pa), clock_(clock) {}

  [[nodiscard]] hal::Status read(hal::VacuumState& out) NONBLOCKING override;

 private:
  friend class GpiodDevices;
  const double switch_Pa_;
  const hal::Clock& clock_;
  std::unique_ptr<Line> gate_, switch_;
};

struct GpiodParts {
  bool estop = false;
  bool injector = false;
  bool enabling = false;
  bool vacuum = false;
};

// The lines that these parts use, outputs first: they are to be in their safe state before anything else.
struct WiredLine {
  bool there;
  const char* key;
  int offset;
  Use use;
  bool active_low = false;  // of an output; inputs are as contacts_closed says
};
inline constexpr std::size_t kWiredLines = 11;
[[nodiscard]] std::array<WiredLine, kWiredLines> wired_lines(const GpiodParams& params, GpiodParts parts);

// Chip, lines, their names and users; claims none.
[[nodiscard]] hal::Findings look(const GpiodParams& params, GpiodParts parts,
                                 const OpenChip& open_chip_at = open_chip);

class GpiodDevices final : public hal::Device {
 public:
  // clock: the station's, on which samples are dated.
  GpiodDevices(GpiodParams params, GpiodParts parts, const hal::Clock& clock,
               OpenChip open_chip_at = open_chip);

  [[nodiscard]] tl::expected<void, std::string> open()
      override;  // heartbeat low, drives disabled, gate shut, vacuum held
  [[nodiscard]] hal::Served served() noexcept override;
  [[nodiscard]] tl::expected<void, std::string> start(std::int64_t first_tick_ns) override;
  void safe_state() noexcept override;  // heartbeat low, drives disabled, gate shut; the vacuum as it is
  void close() noexcept override;

 private:
  [[nodiscard]] tl::expected<void, std::string> claim_all();
  [[nodiscard]] std::string claim(const WiredLine& line, std::unique_ptr<Line>& into);
  [[nodiscard]] std::array<std::unique_ptr<Line>*, kWiredLines> lines() noexcept;  // as wired_lines()

  const GpiodParams params_;
  const GpiodParts parts_;
  const OpenChip open_chip_at_;
  std::unique_ptr<Chip> chip_;
  GpiodEstop estop_;
  GpiodEnabling enabling_;
  GpiodInjector injector_;
  GpiodVacuum vacuum_;
};

}  // namespace punctum::gpiod
