#include "hal/gpiod/gpiod_devices.hpp"

#include <utility>

namespace punctum::gpiod {

using hal::Status;

namespace {

std::string no_chip(const GpiodParams& params, const std::string& why) {
  return params.chip + ": " + why +
         ", allowed for gpiod.chip: the path of a GPIO chip that this user may use (gpiodetect lists them)";
}

std::string title(const char* key, int offset) {
  return std::string("gpiod.") + key + " = " + std::to_string(offset) + ": ";
}

// Empty where the chip has it.
std::string no_line(const GpiodParams& params, const char* key, int offset, unsigned lines) {
  return offset >= 0 && static_cast<unsigned>(offset) < lines
             ? ""
             : title(key, offset) + "no line of " + params.chip + ", allowed: 0 to " +
                   std::to_string(static_cast<int>(lines) - 1);
}

}  // namespace

std::array<WiredLine, kWiredLines> wired_lines(const GpiodParams& params, GpiodParts parts) {
  const bool enable_low = params.enable_active_at == GpiodParams::Level::low;
  const bool holds_low = params.vacuum_holds_at == GpiodParams::Level::low;
  const bool gate_low = params.gate_opens_at == GpiodParams::Level::low;
  return {{{parts.estop, "heartbeat", params.heartbeat, Use::output},
           {parts.injector, "gate", params.gate, Use::output, gate_low},
           {parts.estop && params.enable != kNotWired, "enable", params.enable, Use::output, enable_low},
           {parts.vacuum && params.vacuum_gate != kNotWired, "vacuum_gate", params.vacuum_gate,
            Use::held_output, holds_low},
           {parts.estop, "contact_a", params.contact_a, Use::watched_input},
           {parts.estop, "contact_b", params.contact_b, Use::watched_input},
           {parts.estop, "reset", params.reset, Use::input},
           {parts.injector && params.valve_contact != kNotWired, "valve_contact", params.valve_contact,
            Use::input},
           {parts.enabling, "enabling_a", params.enabling_a, Use::watched_input},
           {parts.enabling, "enabling_b", params.enabling_b, Use::watched_input},
           {parts.vacuum, "vacuum_switch", params.vacuum_switch, Use::input}}};
}

hal::Findings look(const GpiodParams& params, GpiodParts parts, const OpenChip& open_chip_at) {
  using Is = hal::Finding::Is;
  const auto chip = open_chip_at(params.chip);
  if (!chip) {
    return {{Is::missing, no_chip(params, chip.error())}};
  }
  const unsigned count = (*chip)->line_count();
  std::string found = params.chip + " (" + (*chip)->label() + ", " + std::to_string(count) + " lines)";
  hal::Findings findings{{Is::found, ""}};
  for (const WiredLine& line : wired_lines(params, parts)) {
    if (!line.there) {
      continue;
    }
    if (std::string error = no_line(params, line.key, line.offset, count); !error.empty()) {
      findings.push_back({Is::missing, std::move(error)});
      continue;
    }
    const LineFacts facts = (*chip)->facts(static_cast<unsigned>(line.offset));
    if (facts.used) {
      findings.push_back({Is::missing, title(line.key, line.offset) + "is used by " +
                                           (facts.user.empty() ? "somebody" : facts.user) +
                                           ", allowed: a line that nothing else uses (gpioinfo lists them)"});
      continue;
    }
    found.append(", ").append(line.key).append(" ").append(std::to_string(line.offset));
    if (!facts.name.empty()) {
      found.append(" \"").append(facts.name).append("\"");
    }
  }
  findings.front().line = std::move(found);
  return findings;
}

// The level first, then the changes: one that comes in between is in this reading, not lost.
static Status read_contact(Contact& contact, bool& closed, bool& pulse) NONBLOCKING {
  if (const Status read = contact.line->read(closed); read != Status::ok) {
    return read;
  }
  int changes = 0;
  if (const Status taken = contact.line->take_changes(changes); taken != Status::ok) {
    return taken;
  }
  // Closed before and after, a single change tells of an opening whose other edge was not kept. Closed now
  // and open before, the first change is the closing itself.
  pulse = pulse || (closed && changes >= (contact.closed ? 1 : 2));
  contact.closed = closed;
  return Status::ok;
}

Status GpiodEstop::read(hal::EstopState& out) NONBLOCKING {
  for (const Status written : {written_, enable_written_}) {
    if (written != Status::ok) {
      return written;
    }
  }
  hal::EstopState state;
  state.sample_ns = clock_.now_ns();
  for (const Status status :
       {read_contact(a_, state.contact_a_closed, state.pulse_seen),
        read_contact(b_, state.contact_b_closed, state.pulse_seen), reset_->read(state.reset_pressed)}) {
    if (status != Status::ok) {
      return status;
    }
  }
  out = state;
  return Status::ok;
}

void GpiodEstop::heartbeat(bool level) NONBLOCKING { written_ = heartbeat_->write(level); }

void GpiodEstop::drive_power(bool on) NONBLOCKING {
  if (enable_) {
    enable_written_ = enable_->write(on);
  }
}

Status GpiodEnabling::read(hal::EnablingState& out) NONBLOCKING {
  hal::EnablingState state;
  state.sample_ns = clock_.now_ns();
  Status status = read_contact(a_, state.contact_a_closed, state.pulse_seen);
  if (status == Status::ok) {
    status = read_contact(b_, state.contact_b_closed, state.pulse_seen);
  }
  if (status == Status::ok) {
    out = state;
  }
  return status;
}

void GpiodInjector::gate(bool open) NONBLOCKING { written_ = gate_->write(open); }

Status GpiodInjector::read(hal::InjectorState& out) NONBLOCKING {
  if (written_ != Status::ok) {
    return written_;
  }
  hal::InjectorState state;
  state.sample_ns = clock_.now_ns();
  bool active = false;
  if (const Status status = (valve_ ? valve_ : gate_)->read(active); status != Status::ok) {
    return status;
  }
  state.open = valve_ ? !active : active;
  out = state;
  return Status::ok;
}

Status GpiodVacuum::read(hal::VacuumState& out) NONBLOCKING {
  hal::VacuumState state;
  state.sample_ns = clock_.now_ns();
  bool closed = false;
  const Status status = switch_->read(closed);
  if (status == Status::ok) {
    state.pressure_Pa = closed ? switch_Pa_ : 0;
    out = state;
  }
  return status;
}

GpiodDevices::GpiodDevices(GpiodParams params, GpiodParts parts, const hal::Clock& clock,
                           OpenChip open_chip_at)
    : params_(std::move(params)),
      parts_(parts),
      open_chip_at_(std::move(open_chip_at)),
      estop_(clock),
      enabling_(clock),
      injector_(clock),
      vacuum_(params_.vacuum_switch_Pa, clock) {}

tl::expected<void, std::string> GpiodDevices::open() {
  auto chip = open_chip_at_(params_.chip);
  if (!chip) {
    return tl::unexpected(no_chip(params_, chip.error()));
  }
  chip_ = std::move(*chip);
  auto claimed = claim_all();
  if (!claimed) {
    close();
  }
  return claimed;
}

tl::expected<void, std::string> GpiodDevices::claim_all() {
  const auto into = lines();
  const auto wired = wired_lines(params_, parts_);
  for (std::size_t i = 0; i < wired.size(); ++i) {
    if (!wired[i].there) {
      continue;
    }
    if (std::string error = claim(wired[i], *into[i]); !error.empty()) {
      return tl::unexpected(std::move(error));
    }
  }
  return {};
}

// Empty, or the line that says why not.
std::string GpiodDevices::claim(const WiredLine& line, std::unique_ptr<Line>& into) {
  if (std::string error = no_line(params_, line.key, line.offset, chip_->line_count()); !error.empty()) {
    return error;
  }
  const bool closed_low = params_.contacts_closed == GpiodParams::Closed::low;
  LineRequest request{static_cast<unsigned>(line.offset), line.use, line.active_low};
  if (!is_output(line.use)) {
    request.active_low = closed_low;
    if (params_.pull == GpiodParams::Pull::internal) {
      request.bias = closed_low ? Bias::pull_up : Bias::pull_down;
    }
  }
  auto claimed = chip_->claim(request);
  if (!claimed) {
    return title(line.key, line.offset) + claimed.error() + ", allowed: a line of " + params_.chip +
           " that nothing else uses and that can do this (gpioinfo lists them)";
  }
  into = std::move(*claimed);
  return {};
}

std::array<std::unique_ptr<Line>*, kWiredLines> GpiodDevices::lines() noexcept {
  return {&estop_.heartbeat_, &injector_.gate_,   &estop_.enable_, &vacuum_.gate_,
          &estop_.a_.line,    &estop_.b_.line,    &estop_.reset_,  &injector_.valve_,
          &enabling_.a_.line, &enabling_.b_.line, &vacuum_.switch_};
}

hal::Served GpiodDevices::served() noexcept {
  hal::Served served;
  served.estop = parts_.estop ? &estop_ : nullptr;
  served.enabling = parts_.enabling ? &enabling_ : nullptr;
  served.vacuum = parts_.vacuum ? &vacuum_ : nullptr;
  served.injector = parts_.injector ? &injector_ : nullptr;
  return served;
}

tl::expected<void, std::string> GpiodDevices::start(std::int64_t /*first_tick_ns*/) { return {}; }

void GpiodDevices::safe_state() noexcept {
  if (injector_.gate_) {
    injector_.gate(false);
  }
  if (estop_.heartbeat_) {
    estop_.heartbeat(false);
  }
  estop_.drive_power(false);
}

void GpiodDevices::close() noexcept {
  safe_state();
  for (std::unique_ptr<Line>* line : lines()) {
    line->reset();
  }
  chip_.reset();
}

}  // namespace punctum::gpiod
